"""Perimeter control: what gates let in, and how many vehicles a region then holds."""

from __future__ import annotations

import numpy as np
import pytest
from control_site import (
    assert_names,
    faults_of,
    only,
    site_of,
    steps_of_rule,
    traffic_of,
)
from small_networks import Q, demand, exits, link, network, simulate

from uxsim_geo.control import Perimeter, Target
from uxsim_geo.engine.steering import base_levers
from uxsim_geo.settings import Settings

# two roads lead into a region of two links, one road leads out
TOWN = [
    link("west", "1", "3", 2000),
    link("south", "2", "3", 2000, lanes=3),
    link("in", "3", "4"),
    link("through", "4", "5"),
    link("out", "5", "6"),
]
SITE = site_of(network(TOWN))
REGION = ("in", "through")


def test_the_gates_are_the_links_that_lead_in() -> None:
    for measure in (
        Perimeter(REGION, flow=0.4),
        Perimeter(REGION, ("west", "south"), flow=0.4),
        Perimeter(("south", *REGION), ("west", "south"), flow=0.4),
        Perimeter(Target(where="link_id in ['in', 'through']"), flow=0.4),
    ):
        rule = only(measure, SITE)
        assert rule.felt_at.tolist() == [0, 1]
        assert rule.name == "perimeter with links west, south as gates"


def test_a_flow_is_shared_by_the_capacity_of_the_gates() -> None:
    rule = only(Perimeter(REGION, flow=((0, 0.4), (600, 1.2))), SITE)
    steps = steps_of_rule(rule, SITE, "exit_capacity")
    assert steps[0.0][:2] == pytest.approx([0.1, 0.3])
    assert steps[600.0][:2] == pytest.approx([0.3, 0.9])
    assert steps[600.0][2:].tolist() == [Q, Q, Q]


def test_the_gating_law() -> None:
    """F ← F − D (n − n') + K (n* − n), from the highest flow on, within its limits."""
    law = Perimeter(REGION, target_vehicles=50, gain=0.01, damping=0.02, min_flow=0.2, max_flow=2.0)
    rule = only(law, SITE)
    levers, before, flows = base_levers(SITE), None, []
    for time, vehicles in enumerate([0, 50, 60, 60, 50, 40, 300]):
        count = [100, 0, vehicles / 2, vehicles / 2, 9]
        before = traffic_of(SITE, 60.0 * time, count, before)
        rule.act(before, levers)
        flows.append(levers.exit_capacity[:2].sum())
    # 50 more: −1.0; 10 more and 10 too many: −0.3; 10 too many: −0.1; 10 less: +0.2; …: +0.3
    assert flows == pytest.approx([2.0, 1.0, 0.7, 0.6, 0.8, 1.1, 0.2])
    assert levers.exit_capacity[:2] == pytest.approx([0.05, 0.15])


def test_all_faults_of_a_perimeter_are_named_at_once() -> None:
    text = faults_of(Perimeter(REGION, flow=1.0, target_vehicles=10.0), SITE)
    assert "give either target_vehicles or flow" in text
    assert "give either" in faults_of(Perimeter(REGION), SITE)
    assert "changes nothing" in faults_of(Perimeter(REGION, flow=3.3), SITE)
    everything = tuple(SITE.link_ids)
    assert "no link leads into the region" in faults_of(Perimeter(everything, flow=1.0), SITE)
    assert "all its links are gates" in faults_of(Perimeter(["in"], ["in"], flow=0.5), SITE)
    bad = Perimeter(
        REGION,
        target_vehicles=400.0,  # 2 km of 0.2 veh/m
        gain=0.0,
        damping=-1.0,
        min_flow=4.0,
        interval=0.0,
    )
    assert_names(
        faults_of(bad, SITE),
        [
            "can hold, 400 vehicles",
            "column gain",
            "column damping",
            "above the capacity of the gates, 3.2 veh/s",
            "column interval",
        ],
    )


@pytest.mark.parametrize("size", [1, 5])
def test_a_region_keeps_the_vehicles_that_it_is_given(size: int) -> None:
    """The way out takes 0.4 veh/s; the gates would let 0.8 in, and the region would fill up."""
    links = [*TOWN[:4], link("out", "5", "6", capacity=0.4)]
    rows = [(start, "6", 0.0, 9000.0, 9000.0) for start in ("1", "2")]
    case = (network(links), demand(*rows), Settings(9000, size))
    result = simulate(*case, control=[Perimeter(REGION, target_vehicles=80.0)])
    held = vehicles_in_region(result, size)
    assert held.mean() == pytest.approx(80, abs=2 + size)
    assert np.abs(held - 80).max() <= 10 + 2 * size
    free = simulate(*case)
    assert vehicles_in_region(free, size).mean() > 180


def vehicles_in_region(result: object, size: int) -> np.ndarray:
    """Vehicles between the gates and the way out, every 10 s of the second half."""
    times = np.arange(4500, 9000, 10)
    entered = np.sort(np.concatenate([exits(result, gate) for gate in ("west", "south")]))
    left = exits(result, "through")
    return size * (np.searchsorted(entered, times) - np.searchsorted(left, times))
