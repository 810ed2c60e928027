"""Rules that write what a timetable says."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from uxsim_geo.control.levers import Levers
from uxsim_geo.control.site import Claim, Floats, Rule
from uxsim_geo.control.timetable import Timetable, moments_of, steps_of, value_at
from uxsim_geo.control.traffic import Traffic
from uxsim_geo.errors import Faults

#: s; a step may begin this much before the time it stands for, by rounding
ROUNDING = 1e-6


def scheduled_rule(
    name: str,
    claim: Claim,
    timetable: Timetable,
    period: tuple[float, float],
    values: Callable[[float], Floats | float] = float,
) -> Rule:
    """Return the rule that writes a timetable to a claim, from ``period[0]`` to ``period[1]``, s.

    ``values`` makes what is written of the value in force: a number, or one for every position.
    It is felt on the claimed links; for a quantity of nodes, say where.
    """

    def act(traffic: Traffic, levers: Levers) -> None:
        claim.write(levers, values(value_at(timetable, traffic.time + ROUNDING)))

    begin, end = period
    moments = tuple(time for time in moments_of(timetable) if begin < time < end)
    return Rule(name, act, (claim,), begin, end, moments=moments, felt_at=claim.positions)


def check_binds(timetable: Timetable, name: str, limit: Floats, unit: str, faults: Faults) -> None:
    """Note a limit that changes nothing: always above all that holds without control."""
    highest = float(np.max(limit, initial=0.0))
    lowest = min((value for _, value in steps_of(timetable)), default=0.0)
    if limit.size and lowest > highest:
        what = f"changes nothing: without control there are {highest:g} {unit} at most"
        faults.add(f"{what}; is the unit {unit}?", column=name, value=lowest)
