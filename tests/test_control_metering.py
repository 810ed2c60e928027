"""Ramp meters: a rate let through exactly, and ALINEA holding a road at its target."""

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
from small_networks import Q, demand, entries, exits, link, network, simulate

from uxsim_geo.control import Feedback, RampMeter
from uxsim_geo.engine.steering import base_levers
from uxsim_geo.settings import Settings

MERGE = [
    link("main", "1", "3"),
    link("ramp", "2", "3", 500),
    link("below", "3", "4", 500),
    link("on", "4", "5"),
]
SITE = site_of(network(MERGE))


def test_a_rate_follows_its_timetable() -> None:
    meter = RampMeter(["ramp"], ((0, 0.1), (900, 0.2), (1800, 0.3)), begin=600, end=1800)
    steps = steps_of_rule(only(meter, SITE), SITE, "exit_capacity")
    assert {time: values[1] for time, values in steps.items()} == {600: 0.1, 900: 0.2}
    assert all(values[[0, 2, 3]].tolist() == [Q, Q, Q] for values in steps.values())


def test_alinea_moves_its_rate_by_what_is_missing() -> None:
    """r ← r + K (k* − k) from the highest rate on, with k over both measured links."""
    law = Feedback(["below", "on"], 0.04, gain=2.0, min_rate=0.1, max_rate=0.5)
    rule = only(RampMeter(["ramp"], feedback=law), SITE)
    levers = base_levers(SITE)
    rates = []
    # 1,500 m: 60 vehicles are the target
    for time, vehicles in enumerate([0, 60, 90, 90, 60, 45, 600, 0, 0]):
        rule.act(traffic_of(SITE, 60.0 * time, [50, 50, vehicles / 3, vehicles * 2 / 3]), levers)
        rates.append(levers.exit_capacity[1])
    assert rates == pytest.approx([0.5, 0.5, 0.46, 0.42, 0.42, 0.44, 0.1, 0.18, 0.26])


def test_the_gain_of_alinea_is_70_vehicles_an_hour_for_each_per_cent() -> None:
    rule = only(RampMeter(["ramp"], feedback=Feedback(["below"], 0.06)), SITE)
    levers = base_levers(SITE)
    rule.act(traffic_of(SITE, 0.0, [0, 0, 500 * 0.06 + 500 * 0.002, 0]), levers)  # 1 % of 0.2
    assert levers.exit_capacity[1] == pytest.approx(Q - 70 / 3600)


def test_all_faults_of_meters_are_named_at_once() -> None:
    assert_names(faults_of(RampMeter(["ramp"]), SITE), ["give either rate or feedback"])
    both = RampMeter(["ramp"], rate=0.1, feedback=Feedback(["below"], 0.04))
    assert_names(faults_of(both, SITE), ["give either rate or feedback"])
    assert_names(faults_of(RampMeter(["ramp"], rate=720), SITE), ["changes nothing", "veh/s"])
    bad = Feedback(["below", "belov"], -0.1, gain=0.0, min_rate=-1, max_rate=-2, interval=1.0)
    assert_names(
        faults_of(RampMeter(["ramb"], feedback=bad), SITE),
        [
            "did you mean ramp",
            "did you mean below",
            "column target_density",
            "column gain",
            "column min_rate",
            "column max_rate",
            "column interval: is shorter than a step",
        ],
    )
    high = Feedback(["below"], 0.3, min_rate=1.0)
    assert_names(
        faults_of(RampMeter(["ramp"], feedback=high), SITE),
        ["below the jam density of the links, 0.2 veh/m", "above the capacity of a metered link"],
    )


@pytest.mark.parametrize("size", [1, 5, 10])
def test_a_meter_lets_exactly_its_rate_through(size: int) -> None:
    """A queue that never ends leaves 0.2 veh/s, a platoon every Δn / 0.2 s, while it is metered."""
    meter = RampMeter(["ramp"], rate=0.2, begin=600, end=1800)
    result = simulate(
        network(MERGE[1:]),
        demand(("2", "5", 0.0, 1000.0, 2000.0)),
        Settings(3000, size),
        control=[meter],
    )
    times = exits(result, "ramp")
    metered = times[(times >= 600 + size / 0.2) & (times < 1800)]
    assert np.diff(metered) == pytest.approx(size / 0.2)
    free = times[(times > 100) & (times < 600)]
    assert np.diff(free) == pytest.approx(size / Q)


def test_alinea_holds_the_road_at_its_target() -> None:
    """Free traffic of 0.4 veh/s on the main road: the ramp fills up to the wanted 0.03 veh/m."""
    law = Feedback(["below"], 0.03, interval=60)
    result = simulate(
        network(MERGE),
        demand(("1", "5", 0.0, 5000.0, 2000.0), ("2", "5", 0.0, 5000.0, 4000.0)),
        Settings(5000, 1),
        control=[RampMeter(["ramp"], feedback=law)],
    )
    late = entries(result, "below")
    flow = np.sum((late >= 2000) & (late < 5000)) / 3000
    # k* u = 0.6 veh/s pass at free flow: 0.4 on the main road and 0.2 from the ramp
    assert flow == pytest.approx(0.03 * 20, abs=0.02)
    ramp = exits(result, "ramp")
    assert np.sum((ramp >= 2000) & (ramp < 5000)) / 3000 == pytest.approx(0.2, abs=0.02)
