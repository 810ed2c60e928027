"""Edie's definitions of flow, density and speed in a rectangle of space and time (Edie 1963)."""

from __future__ import annotations

import numpy as np

from uxsim_geo.analysis.types import Floats


def edie_states(distance: Floats, time: Floats, area: Floats) -> dict[str, Floats]:
    """States from the vehicles' total distance (veh·m) and time (veh·s) in areas of road × time.

    With the area A = L T in m·s (or lane length × time, which gives states per lane):

        flow q = d / A  (veh/s)    density k = t / A  (veh/m)    speed v = d / t = q / k  (m/s)

    The speed is NaN where no vehicle was.
    """
    return {"flow": distance / area, "density": time / area, "speed": ratio(distance, time)}


def ratio(numerator: Floats, denominator: Floats) -> Floats:
    """The quotient of two arrays of one shape, NaN where the denominator is 0."""
    nothing = np.full(np.shape(numerator), np.nan)
    quotient: Floats = np.divide(numerator, denominator, out=nothing, where=denominator > 0)
    return quotient
