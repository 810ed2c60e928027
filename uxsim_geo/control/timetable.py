"""Values that change with the time of day."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from uxsim_geo.errors import Faults

#: what counts as a number, be it from an array
NUMBER = int | float | np.integer | np.floating

#: a value for all times, or pairs (from when on in s, value)
Timetable = float | Sequence[tuple[float, float]]


def steps_of(timetable: Timetable) -> list[tuple[float, float]]:
    """Return pairs (from when on, value)."""
    if isinstance(timetable, NUMBER):
        return [(0.0, float(timetable))]
    return [(float(time), float(value)) for time, value in timetable]


def value_at(timetable: Timetable, time: float) -> float:
    """Return the value in force at a time; before the first pair, that of the first."""
    steps = steps_of(timetable)
    return steps[max(bisect_right(steps, (time, math.inf)) - 1, 0)][1]


def moments_of(timetable: Timetable) -> tuple[float, ...]:
    """Return the times at which it changes."""
    return tuple(time for time, _ in steps_of(timetable))[1:]


def check_timetable(
    timetable: Timetable,
    name: str,
    duration: float,
    faults: Faults,
    *,
    above: float | None = None,
) -> bool:
    """Note times out of order or beyond the end, and values that are no number of 0 or more.

    Told so, values must lie above another limit instead; ``-inf`` lets them be negative. Returns
    whether it can be read at all.
    """
    try:
        steps = steps_of(timetable)
    except (TypeError, ValueError):
        steps = []
    if not steps:
        faults.add("needs a number, or pairs [from_s, number]", column=name, value=timetable)
    times = [time for time, _ in steps]
    if any(later <= earlier for earlier, later in pairwise(times)):
        faults.add("its times must rise", column=name, value=times)
    for time, value in steps:
        _check_time(time, name, duration, faults)
        if not math.isfinite(value) or (value < 0 if above is None else value <= above):
            limit = " of 0 or more" if above is None else f" above {above:g}"
            what = f"must be a finite number{'' if above == -math.inf else limit}"
            faults.add(what, column=name, value=value)
    return bool(steps)


def _check_time(time: float, name: str, duration: float, faults: Faults) -> None:
    if not 0 <= time < math.inf:
        faults.add("must be a finite time of 0 s or more", column=name, value=time)
    elif time >= duration:
        what = f"changes when the simulation is over, which ends at {duration:g} s"
        faults.add(what, column=name, value=time)
