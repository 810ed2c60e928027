"""What every measure has in common, and what levers refuse."""

from __future__ import annotations

import math

import numpy as np
import pytest
from control_site import assert_names, bind, faults_of, site_of, touched
from small_networks import link, network

from uxsim_geo.control import (
    Advice,
    Closure,
    CongestionToll,
    DriverClass,
    EnforcedRoute,
    Feedback,
    Incident,
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
    Target,
    Toll,
)
from uxsim_geo.control.levers import QUANTITIES
from uxsim_geo.engine.steering import base_levers
from uxsim_geo.errors import Faults

SITE = site_of(
    network([link("a", "1", "2", lanes=2), link("b", "2", "3", lanes=2), link("c", "3", "4")])
)


def idle(*_: object) -> None:
    """Change nothing."""


def measures(**period: float) -> list[Measure]:
    """One of each kind that is called, on link b."""
    return [
        Signal("3", (Phase(10, ("b",)), Phase(10, ())), **period),
        RampMeter(["b"], rate=0.2, **period),
        RampMeter(["b"], feedback=Feedback(["c"], 0.03, max_rate=0.5), **period),
        Perimeter(["c"], ["b"], target_vehicles=50, max_flow=0.5, **period),
        Perimeter(["c"], flow=0.5, **period),
        LinkCapacity(["b"], exit=0.3, **period),
        LinkCapacity(["b"], entry=0.3, **period),
        NodeCapacity(["3"], 0.3, **period),
        Toll(["b"], 2.0, **period),
        CongestionToll(["b"], 0.02, 50.0, 5.0, 1.0, **period),
        Closure(["b"], **period),
        Closure(["b"], on_link="stay", **period),
        Closure(["b"], classes=("lorries",), **period),
        Incident(["b"], 1, **period),
        SpeedLimit(["b"], 10.0, **period),
        MergePriority(["b"], 5.0, **period),
        Advice(["b"], -60.0, **period),
    ]


@pytest.mark.parametrize("measure", measures(begin=600.0, end=1200.0), ids=repr)
def test_a_measure_changes_what_it_claims_in_its_period_and_nothing_else(measure: Measure) -> None:
    (rule,) = bind(measure, SITE)
    assert (rule.begin, rule.end) == (600.0, 1200.0)
    assert touched(rule, SITE) == {claim.quantity for claim in rule.claims}
    assert SITE.link_position["b"] in rule.felt_at
    assert all(600 <= time < 1200 for time in rule.times(SITE.duration))
    assert "b" in rule.name or "3" in rule.name


@pytest.mark.parametrize(
    ("period", "message"),
    [
        ({"begin": -1.0}, "column begin: must be a finite time of 0 s or more"),
        ({"begin": math.nan}, "column begin: must be a finite time"),
        ({"begin": 3600.0}, "column begin: begins when the simulation is over"),
        ({"begin": 900.0, "end": 900.0}, "column end: must be later than begin"),
        ({"end": "noon"}, "column end: must be a number of seconds"),
        ({"end": 3700.0}, "column end: lies beyond the end of the simulation"),
    ],
)
def test_no_measure_takes_a_period_outside_of_the_run(
    period: dict[str, float], message: str
) -> None:
    every = [*measures(**period), OwnControl(idle, **period)]
    every.append(EnforcedRoute("1", "3", ("a", "b"), **period))
    for measure in every:
        assert message in faults_of(measure, SITE), measure


@pytest.mark.parametrize("chosen", [["nowhere"], Target(where="lanes > 7"), Target()], ids=str)
def test_no_measure_takes_links_that_are_not_there(chosen: list[str] | Target) -> None:
    for measure in (
        RampMeter(chosen, rate=0.2),
        Perimeter(chosen, flow=0.5),
        LinkCapacity(chosen, exit=0.3),
        Toll(chosen, 2.0),
        CongestionToll(chosen, 0.02, 50.0, 5.0),
        Closure(chosen),
        Incident(chosen, 1),
        SpeedLimit(chosen, 10.0),
        MergePriority(chosen, 5.0),
        Advice(chosen, -60.0),
    ):
        text = faults_of(measure, SITE)
        assert "column region" in text or "column links" in text, measure
        assert len(text.splitlines()) == 1, text


def test_a_timetable_that_cannot_be_followed_is_refused_where_it_is_written() -> None:
    for timetable, message in (
        ((), "column amount: needs a number, or pairs"),
        ("morning", "column amount: needs a number, or pairs"),
        (((0, 1, 2),), "column amount: needs a number, or pairs"),
        (((600, 1.0), (600, 2.0)), "column amount: its times must rise"),
        (((0, 1.0), (3600, 2.0)), "column amount: changes when the simulation is over"),
        (((0, 1.0), (60, -2.0)), "column amount: must be a finite number of 0 or more (found"),
        (math.nan, "column amount: must be a finite number of 0 or more (found"),
    ):
        assert message in faults_of(Toll(["b"], timetable), SITE)


def test_long_lists_of_links_are_named_shortly() -> None:
    links = [link(f"n{number}", str(number), str(number + 1)) for number in range(14)]
    site = site_of(network(links))
    for count, name in ((1, "n0"), (2, "n0, n1"), (3, "n0, n1, n2"), (14, "n0, n1 and 12 more")):
        rule = bind(Toll([row["link_id"] for row in links[:count]], 1.0), site)[0]
        assert rule.name == f"toll on link{'s' if count > 1 else ''} {name}"


def test_links_can_be_told_by_a_condition() -> None:
    (rule,) = bind(Toll(Target(where="lanes == 2"), 1.0), SITE)
    assert rule.felt_at.tolist() == [0, 1]


def test_all_values_that_no_road_can_have_are_named_at_once() -> None:
    levers = base_levers(SITE)
    levers.exit_capacity[1] = -0.1
    levers.speed_limit[0] = 0.0
    levers.merge_priority[2] = np.inf
    levers.toll[1] = -1.0
    levers.advice[1, 2] = np.nan
    levers.node_capacity[3] = -1.0
    levers.phase[0] = -2
    faults = Faults()
    levers.add_faults(faults, {"links": SITE.link_ids, "nodes": SITE.node_ids}, QUANTITIES)
    assert len(faults.found) == 7
    assert_names(
        "\n".join(str(fault) for fault in faults.found),
        [
            "exit_capacity of link b",
            "speed_limit of link a",
            "merge_priority of link c",
            "toll of link b",
            "advice of link c",
            "node_capacity of node 4",
            "phase of node 1",
        ],
    )


def test_a_lever_that_is_none_names_the_nearest() -> None:
    levers = base_levers(SITE)
    with pytest.raises(AttributeError, match="did you mean exit_capacity"):
        levers.exit_capacities = 3.0
    levers.toll = 2.0
    assert levers.toll.tolist() == [2.0, 2.0, 2.0]


def test_numbers_may_come_from_arrays_and_texts_are_no_numbers() -> None:
    assert bind(Toll(["b"], np.float32(2.0)), SITE)[0].claims[0].quantity == "toll"
    assert bind(Incident(["b"], np.int64(1)), SITE)
    assert_names(faults_of(Incident(["b"], "one"), SITE), ["column lanes_closed"])
    faults = Faults()
    DriverClass(informed_share="half", value_of_time=np.int64(9)).add_faults(faults)
    assert [fault.column for fault in faults.found] == ["informed_share"]
