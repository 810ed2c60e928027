"""Closures and incidents: who gets in, who gets out, and what a road with fewer lanes passes."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest
from control_site import assert_names, bind, faults_of, only, site_of, traffic_of
from small_networks import Q, demand, entries, exits, link, network, simulate

from uxsim_geo.control import Closure, Incident
from uxsim_geo.engine.steering import base_levers
from uxsim_geo.settings import Settings

ROAD = [link("a", "1", "2"), link("b", "2", "3", lanes=2), link("c", "3", "4", lanes=2)]
SITE = site_of(network(ROAD))


def test_a_closure_is_felt_on_the_links_and_on_those_that_lead_to_them() -> None:
    rule = only(Closure(["c"]), SITE)
    assert rule.felt_at.tolist() == [1, 2]
    assert rule.name == "closure of link c"


def test_a_closure_for_a_class_bans_it_and_closes_nothing() -> None:
    rule = only(Closure(["b", "c"], classes=("lorries",)), SITE)
    levers = base_levers(SITE)
    rule.act(traffic_of(SITE, 0.0), levers)
    assert levers.banned.tolist() == [[False, False, False], [False, True, True]]
    assert not levers.entry_closed.any()
    assert rule.name == "closure of links b, c to lorries"
    (claim,) = rule.claims
    assert (claim.positions.tolist(), claim.rows.tolist()) == ([1, 2], [1])


def test_all_faults_of_closures_are_named_at_once() -> None:
    text = faults_of(Closure(["x"], on_link="vanish", classes=("lorry",), begin=-1), SITE)
    assert_names(text, ["'x'", "clear or stay", "there are cars, lorries", "column begin"])
    text = faults_of(Closure(["b"], on_link="stay", classes=("lorries",)), SITE)
    assert_names(text, ["holds all who are on the link"])


@pytest.mark.parametrize("size", [1, 5])
@pytest.mark.parametrize("on_link", ["clear", "stay"])
def test_nobody_enters_a_closed_link_and_those_on_it_do_as_told(on_link: str, size: int) -> None:
    result = simulate(
        network(ROAD),
        demand(("1", "4", 0.0, 1500.0, 600.0)),
        Settings(4000, size),
        control=[Closure(["b"], 600, 1200, on_link=on_link)],
    )
    into, out = entries(result, "b"), exits(result, "b")
    assert not ((into >= 600) & (into < 1200)).any()
    assert (into < 600).sum() * size > 200
    before = (into < 600).sum()
    if on_link == "clear":
        # 1 km at 20 m/s: all are gone after 50 s
        assert (out < 650 + size).sum() == before
    else:
        assert not ((out >= 600) & (out < 1200)).any()
        assert (out < 600).sum() < before
    assert (result.trips["status"] == "completed").all()


def test_an_incident_on_several_links_leaves_each_its_share() -> None:
    links = [link("a", "1", "2", lanes=4), link("b", "2", "3", lanes=2, capacity=1.0)]
    site = site_of(network(links))
    levers = base_levers(site)
    rule = only(Incident(["a", "b"], 1), site)
    rule.act(traffic_of(site, 0.0), levers)
    assert levers.exit_capacity == pytest.approx([0.75 * 4 * Q, 0.5])


def test_an_incident_that_leaves_no_lane_is_a_closure() -> None:
    assert_names(faults_of(Incident(["a", "b"], 2), SITE), ["links a, b: close it instead"])
    assert_names(faults_of(Incident(["a", "b"], 1), SITE), ["link a: close it instead"])
    for lanes in (0, -1, 1.5):
        assert "column lanes_closed" in faults_of(Incident(["c"], lanes), SITE)
    assert len(bind(Incident(["b"], 1), SITE)) == 1


@pytest.mark.parametrize("size", [1, 5, 10])
def test_an_incident_on_one_of_two_lanes_halves_the_discharge(size: int) -> None:
    links = [link("a", "1", "2", lanes=2), *ROAD[1:]]
    result = simulate(
        network(links),
        demand(("1", "4", 0.0, 1000.0, 5000.0)),
        Settings(3000, size),
        control=[Incident(["b"], 1, 600, 1800)],
    )
    times = exits(result, "b")
    during = times[(times >= 600 + size / Q) & (times < 1800)]
    assert np.diff(during) == pytest.approx(size / Q)
    after = times[(times >= 1800 + size / Q) & (times < 2900)]
    assert np.diff(after) == pytest.approx(size / (2 * Q))


@pytest.mark.parametrize("route_choice", ["inertia", "logit"])
def test_who_must_go_through_many_closed_links_waits_for_them(
    route_choice: Literal["inertia", "logit"],
) -> None:
    """Twenty closed links in a row are farther than any number of ms, but not out of reach."""
    ways = [link(f"{place}", f"{place}", f"{place + 1}", 100) for place in range(21)]
    closure = Closure([str(place) for place in range(1, 21)], end=600)
    settings = Settings(3000, 5, route_choice=route_choice)
    result = simulate(network(ways), demand(("0", "21", 0, 100, 20)), settings, control=[closure])
    assert (result.trips["status"] == "completed").all()
    assert result.trips["arrive_s"].min() >= 600 + 20 * 5
