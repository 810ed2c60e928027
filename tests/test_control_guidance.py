"""Route guidance: advice against the time that it is worth, and routes that are given."""

from __future__ import annotations

import pytest
from control_site import assert_names, bind, faults_of, only, site_of, traffic_of
from small_networks import demand, link, network, simulate

from uxsim_geo.control import Advice, EnforcedRoute
from uxsim_geo.engine.steering import base_levers
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

# 50 s over the short way, 100 s over the long one
WAYS = [
    link("to", "1", "2"),
    link("short", "2", "3"),
    link("long", "2", "3", 2000),
    link("on", "3", "4"),
]
SITE = site_of(network(WAYS))
CASE = (
    network(WAYS),
    demand(("1", "4", 0.0, 1800.0, 90.0)),
    Settings(3600, 1, route_noise=0.0),
)


def taken(result: Result) -> dict[str, set[int]]:
    """Which vehicles took which link."""
    events = result.events
    return {name: set(events["vehicle"][events["link"] == name]) for name in ("short", "long")}


def test_advice_is_for_the_classes_that_are_named() -> None:
    levers = base_levers(SITE)
    rule = only(Advice(["long"], -30.0, classes=("lorries",)), SITE)
    rule.act(traffic_of(SITE, 0.0), levers)
    only(Advice(["short"], 20.0), SITE).act(traffic_of(SITE, 0.0), levers)
    assert levers.advice.tolist() == [[0, 20, 0, 0], [0, 20, -30, 0]]
    assert_names(faults_of(Advice(["long"], 1.0, ("bus",)), SITE), ["there are cars, lorries"])


@pytest.mark.parametrize(
    ("link_id", "seconds", "way"),
    [
        ("short", 49.5, "short"),
        ("short", 50.5, "long"),
        ("long", -49.5, "short"),
        ("long", -50.5, "long"),
    ],
)
def test_advice_is_worth_its_seconds(link_id: str, seconds: float, way: str) -> None:
    result = simulate(*CASE, control=[Advice([link_id], seconds)])
    assert len(taken(result)[way]) == 90


def test_a_given_route_is_driven_by_those_who_leave_in_its_period() -> None:
    route = EnforcedRoute("1", "4", ("to", "long", "on"), begin=600, end=1200)
    assert bind(route, SITE) == []
    result = simulate(*CASE, control=[route])
    depart = result.trips["depart_s"]
    forced = set(result.trips["vehicle"][(depart >= 600) & (depart < 1200)])
    assert taken(result) == {"long": forced, "short": set(result.trips["vehicle"]) - forced}
    assert len(forced) == pytest.approx(30, abs=1)


def test_all_faults_of_a_given_route_are_named_at_once() -> None:
    bad = EnforcedRoute(
        "2", "9", ("to", "on", "to"), share=1.5, classes=("bus",), begin=5.0, end=4.0
    )
    assert_names(
        faults_of(bad, SITE),
        [
            "'9'",
            "'bus'",
            "must be 1 or less",
            "later than begin",
            "stands twice in the route",
            "begins at node 1, not at the origin 2",
            "begins at node 3, but to ends at 2",
            "ends at node 2, not at the destination 9",
        ],
    )
    assert_names(faults_of(EnforcedRoute("1", "4", ("to", "shirt")), SITE), ["mean short"])
    assert "names no links" in faults_of(EnforcedRoute("1", "4", ()), SITE)
