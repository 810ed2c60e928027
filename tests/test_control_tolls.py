"""Tolls against the time that they weigh, and congestion tolls against their law."""

from __future__ import annotations

import pytest
from control_site import (
    assert_names,
    faults_of,
    only,
    site_of,
    steps_of_rule,
    traffic_of,
)
from small_networks import demand, entries, link, network, simulate

from uxsim_geo.control import CongestionToll, Toll
from uxsim_geo.engine.steering import base_levers
from uxsim_geo.settings import Settings

# 50 s over the short way, 100 s over the long one
WAYS = [
    link("to", "1", "2"),
    link("short", "2", "3"),
    link("long", "2", "3", 2000),
    link("on", "3", "4"),
]
SITE = site_of(network(WAYS))
PER_SECOND = 15.0 / 3600.0  # the value of time of drivers of no class, currency/s


def test_an_amount_follows_its_timetable() -> None:
    rule = only(Toll(["short"], ((0, 1.0), (900, 3.0), (1800, 0.0))), SITE)
    steps = steps_of_rule(rule, SITE, "toll")
    assert {time: values.tolist() for time, values in steps.items()} == {
        0: [0, 1, 0, 0],
        900: [0, 3, 0, 0],
        1800: [0, 0, 0, 0],
    }


def test_a_congestion_toll_moves_by_what_is_too_much() -> None:
    """p ← p + g (k − k*) for each link by itself, within the limits."""
    law = CongestionToll(["short", "long"], 0.02, 50.0, max_amount=2.0, min_amount=0.5)
    rule = only(law, SITE)
    levers = base_levers(SITE)
    tolls = []
    for time, (short, long) in enumerate([(0, 0), (30, 80), (30, 80), (20, 40), (100, 0)]):
        rule.act(traffic_of(SITE, 300.0 * time, [9, short, long, 9]), levers)
        tolls.append(levers.toll.tolist())
    assert [row[1] for row in tolls] == pytest.approx([0.5, 1.0, 1.5, 1.5, 2.0])
    assert [row[2] for row in tolls] == pytest.approx([0.5, 1.5, 2.0, 2.0, 1.0])
    assert all(row[0] == row[3] == 0 for row in tolls)


def test_all_faults_of_congestion_tolls_are_named_at_once() -> None:
    bad = CongestionToll(["shirt"], -0.1, 0.0, max_amount=1.0, min_amount=2.0, interval=-5.0)
    assert_names(
        faults_of(bad, SITE),
        ["did you mean short", "target_density", "gain", "column max_amount", "interval"],
    )
    text = faults_of(CongestionToll(["short"], 20.0, 1.0, 2.0), SITE)
    assert_names(text, ["below the jam density of the links, 0.2 veh/m"])


@pytest.mark.parametrize(("seconds", "taken"), [(49.5, "short"), (50.5, "long")])
def test_a_toll_is_worth_its_time_and_no_more(seconds: float, taken: str) -> None:
    """The short way saves 50 s: a toll worth a little less leaves all on it, a little more none."""
    result = simulate(
        network(WAYS),
        demand(("1", "4", 0.0, 1800.0, 90.0)),
        Settings(3600, 1, route_noise=0.0),
        control=[Toll(["short"], seconds * PER_SECOND)],
    )
    assert len(entries(result, taken)) == 90
    assert (result.trips["status"] == "completed").all()


def test_a_toll_holds_in_its_period() -> None:
    settings = Settings(3600, 1, route_noise=0.0, route_update_interval=60, route_update_weight=1)
    result = simulate(
        network(WAYS),
        demand(("1", "4", 0.0, 3000.0, 150.0)),
        settings,
        control=[Toll(["short"], 1.0, begin=1200, end=2400)],
    )
    short, long = entries(result, "short"), entries(result, "long")
    assert not ((short >= 1260) & (short < 2400)).any()
    assert not ((long < 1200) | (long >= 2460)).any()
    assert min(len(short), len(long)) > 40
