"""Values that scripts hand over: checked when they are set, told by element and name."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from uxsim_geo.errors import Faults

#: s after the start -> what driving a link costs then, s of travel time
Pricing = Callable[[float], float]


def number(
    faults: Faults, name: str, value: Any, *, above: float | None = None, least: float = 0.0
) -> float:
    """Return a value as a finite number of at least ``least``, or more than ``above``.

    What is none becomes NaN and a fault.
    """
    try:
        found = float(value)
    except (TypeError, ValueError):
        found = math.nan
    if math.isfinite(found) and (found > above if above is not None else found >= least):
        return found
    limit = f" above {above:g}" if above is not None else f", {least:g} or more"
    if above is None and least == -math.inf:
        limit = ""
    faults.add(f"must be a finite number{limit}", column=name, value=repr(value))
    return math.nan


def capacity(faults: Faults, name: str, value: Any) -> float | None:
    """Return a capacity, veh/s; None sets no limit."""
    return None if value is None else number(faults, name, value)


def lanes(faults: Faults, value: Any) -> int:
    """Return a whole number of lanes, 1 or more."""
    found = number(faults, "number_of_lanes", value, least=1.0)
    if found % 1:
        faults.add("must be a whole number", column="number_of_lanes", value=value)
    return 1 if math.isnan(found) else int(found)


def pricing(faults: Faults, value: Any) -> Pricing | None:
    """Return a function of time, or None."""
    if value is None or callable(value):
        return value  # type: ignore[no-any-return]
    what = "must be a function of the time in s; for a toll at all times, lambda t: 30"
    faults.add(what, column="congestion_pricing", value=repr(value))
    return None


def signal(faults: Faults, value: Any) -> tuple[float, ...]:
    """Return the durations of a signal's phases, s; none where there is no signal."""
    if not isinstance(value, Sequence) or isinstance(value, str):
        what = "must be a list of the phases' durations in s, or [0] for no signal"
        faults.add(what, column="signal", value=repr(value))
        return ()
    if list(value) in ([], [0]):
        return ()
    return tuple(number(faults, "signal", duration, above=0.0) for duration in value)


def signal_group(faults: Faults, value: Any) -> tuple[int, ...]:
    """Return the phases in which a link has green."""
    groups = list(value) if isinstance(value, Sequence) else [value]
    for group in groups:
        if not isinstance(group, int | float | np.integer) or int(group) != group or group < 0:
            what = "must be the number of a phase, counted from 0, or a list of such"
            faults.add(what, column="signal_group", value=repr(value))
            return (0,)
    return tuple(int(group) for group in groups)


def jam_density_per_lane(
    faults: Faults, total: Any, per_lane: Any, number_of_lanes: int, default: float
) -> float:
    """Return κ of one lane, veh/m, from UXsim's total over the lanes, or from that of a lane."""
    if total is None and per_lane is None:
        return default
    if per_lane is None:
        return number(faults, "jam_density", total, above=0.0) / number_of_lanes
    found = number(faults, "jam_density_per_lane", per_lane, above=0.0)
    if total is not None:
        whole = number(faults, "jam_density", total, above=0.0)
        if not math.isclose(whole, found * number_of_lanes):
            what = (
                f"is the total over {number_of_lanes} lanes and contradicts jam_density_per_lane, "
                f"{per_lane}: give one of the two"
            )
            faults.add(what, column="jam_density", value=total)
    return found


def user_function(faults: Faults, value: Any) -> Callable[[Any], object] | None:
    """Return a function of the element it is called with, or None."""
    if value is not None and not callable(value):
        what = "must be a function of one argument, the element itself"
        faults.add(what, column="user_function", value=repr(value))
        return None
    return value  # type: ignore[no-any-return]
