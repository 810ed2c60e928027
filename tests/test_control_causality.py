"""Control acts from its time on: whatever it does, what has happened before stays as it was."""

from __future__ import annotations

import math
from dataclasses import replace

import pandas as pd
import pytest
from small_networks import across, demand, grid, link, network, simulate

from uxsim_geo.control import (
    Advice,
    Closure,
    CongestionToll,
    EnforcedRoute,
    Feedback,
    LinkCapacity,
    Measure,
    MergePriority,
    NodeCapacity,
    OwnControl,
    Perimeter,
    Phase,
    RampMeter,
    Signal,
    SpeedLimit,
    Toll,
)
from uxsim_geo.engine.simulation import Simulation
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

# a grid so full that queues stand at its middle, and links of it
CASE = (network(grid(3)), across(3, 100.0, 1500.0), Settings(1800, 5, route_update_interval=300))
IN = ("0,1-1,1", "1,0-1,1")
OUT = ("1,1-2,1", "1,1-1,2")
NORTH, WEST = IN
SOUTH, EAST = OUT


def measures(begin: float, end: float) -> list[Measure]:
    period = {"begin": begin, "end": end}
    return [
        Signal("1,1", (Phase(20, (NORTH,)), Phase(20, (WEST,))), offset=7, **period),
        RampMeter(IN, rate=0.1, **period),
        RampMeter(IN, feedback=Feedback(OUT, 0.01, max_rate=0.2), **period),
        Perimeter(OUT, target_vehicles=10, max_flow=0.5, **period),
        LinkCapacity(OUT, exit=0.1, entry=0.05, **period),
        LinkCapacity(IN, exit=0.0, **period),
        LinkCapacity(OUT, entry=0.0, **period),
        NodeCapacity(["1,1"], 0.1, **period),
        NodeCapacity(["1,1"], 0.0, **period),
        Toll(OUT, 5.0, **period),
        CongestionToll(OUT, 0.01, 500.0, 5.0, 1.0, **period),
        Closure(OUT, **period),
        Closure(IN, **period),
        Closure(OUT, on_link="stay", **period),
        Closure(OUT, classes=("default",), **period),
        SpeedLimit(OUT, 2.0, **period),
        MergePriority([NORTH, "0,0-1,0", "0,2-1,2", SOUTH], 0.02, **period),
        Advice([SOUTH], 600.0, **period),
    ]


def before(result: Result, time: float) -> pd.DataFrame:
    """All entries before a time, with their exits if they are before it too."""
    events = result.events[result.events["enter_s"] < time]
    exits = events["exit_s"].where(events["exit_s"] < time)
    return events.assign(exit_s=exits).sort_values(["vehicle", "enter_s"], ignore_index=True)


@pytest.fixture(scope="module")
def free() -> Result:
    return simulate(*CASE)


@pytest.mark.parametrize("measure", measures(600.0, 1200.0), ids=repr)
def test_nothing_happens_before_its_cause(measure: Measure, free: Result) -> None:
    """Before it begins a run is as without it; before it ends, as if it did not end."""
    told = simulate(*CASE, control=[measure])
    number = [repr(one) for one in measures(600.0, 1200.0)].index(repr(measure))
    endless = simulate(*CASE, control=[measures(600.0, math.inf)[number]])
    pd.testing.assert_frame_equal(before(told, 600), before(free, 600))
    pd.testing.assert_frame_equal(before(told, 1200), before(endless, 1200))
    assert not before(told, 1200).equals(before(free, 1200))
    assert not before(told, 1800).equals(before(endless, 1800))


def test_a_given_route_leaves_those_who_left_home_earlier_alone(free: Result) -> None:
    route = EnforcedRoute("0,1", "2,1", ("0,1-0,0", "0,0-1,0", "1,0-2,0", "2,0-2,1"), begin=600)
    told = simulate(*CASE, control=[route])
    pd.testing.assert_frame_equal(before(told, 600), before(free, 600))
    assert not before(told, 900).equals(before(free, 900))


def test_a_trip_is_given_up_when_its_last_way_is_banned_and_not_before() -> None:
    """Held at the end of a by a closure of b from the start, banned from b at 600 s."""
    ways = [link("a", "1", "2", 100), link("b", "2", "3"), link("c", "3", "4")]
    control = [Closure(["b"]), Closure(["b"], 600, 900, classes=("default",))]
    settings = Settings(900, 5, route_update_interval=100)
    result = simulate(network(ways), demand(("1", "4", 0, 100, 20)), settings, control=control)
    assert (result.trips["status"] == "aborted").all()
    assert result.events["exit_s"].min() == 600
    assert result.events["exit_s"].is_monotonic_increasing


@pytest.mark.parametrize("period", [(0.0, 600.0), (0.0, 604.0), (603.0, 607.0), (599.0, 602.0)])
def test_what_has_ended_is_not_called_again_in_the_step_of_its_end(
    period: tuple[float, float],
) -> None:
    """Steps of 7 s: times between two steps stand for the later one, and the end does as well."""
    begin, end = period
    control = [
        Toll([SOUTH], [(begin, 1.0), (end - 0.5, 2.0)], begin, end),
        OwnControl(lambda *_: None, begin=begin, end=end),
        RampMeter([WEST], feedback=Feedback(OUT, 0.01, interval=7.0), begin=begin, end=end),
    ]
    run = Simulation(*CASE[:2], replace(CASE[2], platoon_size=7), control=control)
    run.advance(700)
    assert run.levers.differences(run.steering.base) == set()
