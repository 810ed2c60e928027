"""Speed limits: exactly those who enter while one is in force drive slower."""

from __future__ import annotations

import numpy as np
import pytest
from control_site import assert_names, faults_of, only, site_of, steps_of_rule
from small_networks import demand, entries, link, network, on_link, simulate

from uxsim_geo.control import SpeedLimit
from uxsim_geo.settings import Settings

ROAD = [link("a", "1", "2", 10), link("b", "2", "3"), link("slow", "3", "4", free_speed=8.0)]
SITE = site_of(network(ROAD))


def test_a_limit_never_makes_a_link_faster() -> None:
    rule = only(SpeedLimit(["b", "slow"], ((0, 10.0), (600, 5.0))), SITE)
    steps = steps_of_rule(rule, SITE, "speed_limit")
    assert {time: values.tolist() for time, values in steps.items()} == {
        0: [20, 10, 8],
        600: [20, 5, 5],
    }


def test_a_limit_that_nobody_can_feel_is_refused() -> None:
    text = faults_of(SpeedLimit(["b", "slow"], ((0, 50.0), (600, 30.0))), SITE)
    assert_names(text, ["column speed: changes nothing", "20 m/s at most", "'30.0'"])
    assert "changes nothing" not in faults_of(SpeedLimit(["b"], ((0, 50.0), (60, 15.0))), SITE)
    assert_names(faults_of(SpeedLimit(["b"], 0.0), SITE), ["must be a finite number above 0"])


def test_those_who_enter_under_a_limit_drive_at_it() -> None:
    """A vehicle every 100 s: 1 km takes 100 s at 10 m/s, and 50 s at 20 m/s."""
    settings = Settings(4000, 1, demand_rounding="truncate")
    result = simulate(
        network(ROAD[1:]),
        demand(("2", "4", 0.0, 3000.0, 30.0)),
        settings,
        control=[SpeedLimit(["b"], 10.0, begin=600, end=1200)],
    )
    events = on_link(result, "b")
    limited = (events["enter_s"] >= 600) & (events["enter_s"] < 1200)
    assert 5 <= limited.sum() <= 6
    assert (events["exit_s"] - events["enter_s"]).to_numpy() == pytest.approx(
        np.where(limited, 100.0, 50.0)
    )


def test_a_limit_lowers_the_capacity_of_the_diagram_and_not_one_that_is_lower_still() -> None:
    """At 2.5 m/s the diagram lets 2.5·0.2 / (1 + 2.5·0.2) = 1/3 veh/s through; 0.3 are given."""
    settings = Settings(1500, 1, demand_rounding="truncate")
    for given, headway in ((np.nan, 3.0), (0.3, 1 / 0.3)):
        ways = [link("a", "1", "2"), link("b", "2", "3", capacity=given)]
        result = simulate(
            network(ways),
            demand(("1", "3", 0.0, 1000.0, 700.0)),
            settings,
            control=[SpeedLimit(["b"], 2.5)],
        )
        assert np.diff(entries(result, "b")[20:60]) == pytest.approx(headway)
