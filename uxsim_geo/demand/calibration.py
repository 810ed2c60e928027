"""The impedance of a gravity model from the mean time of trips, which surveys tell."""

from __future__ import annotations

import math
from dataclasses import replace

import pandas as pd

from uxsim_geo.demand.free_flow import ZoneTimes
from uxsim_geo.demand.gravity import GravityOptions, Impedance, gravity
from uxsim_geo.errors import Faults

#: 1/min; with more, trips go to the nearest zones only
STEEPEST = 10.0

#: the mean time is met to this part of itself
NEAR = 1e-4


def calibrated_impedance(
    ends: pd.DataFrame,
    times: ZoneTimes,
    mean_time_s: float,
    *,
    impedance: Impedance | None = None,
    options: GravityOptions | None = None,
) -> Impedance:
    """The decay with which trips take a given time on average, at free flow (Hyman 1969).

    The mean time falls as the decay rises, so that halving an interval finds it. The exponent and
    least time are those of ``impedance``; its decay is replaced. Arguments as of
    :func:`uxsim_geo.demand.gravity.gravity`.

    Raises :class:`uxsim_geo.errors.InputError` for a time that no decay gives: longer than if
    distance did not matter at all, or shorter than with the nearest zones only.
    """
    impedance = impedance or Impedance()

    def mean(decay: float) -> float:
        model = gravity(ends, times, replace(impedance, decay_per_min=decay), options)
        return model.figures["mean_time_s"]

    longest, low, high = mean(0.0), 0.0, 0.05
    while mean(high) > mean_time_s and high < STEEPEST:
        low, high = high, high * 2
    faults = Faults("calibration")
    if not (math.isfinite(longest) and mean(high) <= mean_time_s <= longest):
        what = (
            f"no decay gives trips of this mean time: they take {longest:.6g} s if it does not "
            f"matter, and {mean(high):.6g} s at {high:g} per min"
        )
        faults.add(what, column="mean_time_s", value=mean_time_s)
    faults.raise_if_any()
    while True:
        middle = (low + high) / 2
        found = mean(middle)
        if abs(found - mean_time_s) <= NEAR * mean_time_s or high - low <= 1e-12 * high:
            return replace(impedance, decay_per_min=middle)
        low, high = (middle, high) if found > mean_time_s else (low, middle)
