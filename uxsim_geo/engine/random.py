"""The draws of the engine: those of ``uxsim_geo.draws``, compiled."""

from __future__ import annotations

import numpy as np

from uxsim_geo import draws
from uxsim_geo.draws import CHOICE, MERGE, NOISE
from uxsim_geo.engine.records import kernel

__all__ = ["CHOICE", "MERGE", "NOISE", "draw"]

combine = kernel(draws.combine)
unit = kernel(draws.unit)


@kernel
def draw(who, where, purpose, counter):
    """Draw from U[0, 1): for whom, where, what for, and the how-manieth time."""
    return unit(combine(combine(who, where ^ purpose), np.uint64(counter)))
