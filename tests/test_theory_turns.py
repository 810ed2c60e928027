"""Banned turns against what they mean, worked out by hand: every link takes 50 s unless told."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from plain_paths import Way
from small_networks import Row, demand, link, network, on_link

from uxsim_geo.analysis.skims import skims
from uxsim_geo.analysis.trips import trip_summary
from uxsim_geo.control.closures import Closure
from uxsim_geo.control.drivers import DriverClass
from uxsim_geo.control.guidance import EnforcedRoute
from uxsim_geo.control.site import Measure
from uxsim_geo.demand.demand import Demand
from uxsim_geo.engine.simulation import Simulation, simulate
from uxsim_geo.errors import InputError
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings
from uxsim_geo.world.tables import od_table

sizes = pytest.mark.parametrize("size", [1, 5, 10])

#: a crossing at 2 whose left turn leads to 3 at once; straight on there is a way round to it
CROSSING = [
    link("in", "1", "2"),
    link("side", "9", "2"),
    link("left", "2", "3"),
    link("straight", "2", "4"),
    link("round", "4", "3", 3000),
]
NO_LEFT: list[Way] = [("in", "left")]


def run(
    links: Iterable[Row],
    banned: Sequence[Way],
    pairs: Sequence[tuple[str, str]],
    size: int = 5,
    *,
    control: Sequence[Measure] = (),
    **options: Any,
) -> Result:
    """One platoon of each pair, one after the other, so that nobody waits for anybody."""
    rows = [(*pair, 600.0 * number, 600.0 * number + 10, size) for number, pair in enumerate(pairs)]
    settings = Settings(4000.0, size, **{"route_noise": 0.0} | options)
    return simulate(network(links, banned=banned), demand(*rows), settings, control=control)


def times(result: Result, origin: str, destination: str) -> np.ndarray:
    trips = result.trips
    own = trips[(trips["origin"] == origin) & (trips["destination"] == destination)]
    assert len(own) > 0
    assert (own["status"] == "completed").all()
    taken = (own["arrive_s"] - own["enter_s"]).to_numpy()
    assert own["free_time_s"].to_numpy() == pytest.approx(taken, abs=1e-6)
    return taken


@sizes
def test_a_banned_left_turn_is_driven_round(size: int) -> None:
    assert times(run(CROSSING, [], [("1", "3")], size), "1", "3") == pytest.approx(100)
    result = run(CROSSING, NO_LEFT, [("1", "3")], size)
    assert times(result, "1", "3") == pytest.approx(50 + 50 + 150)
    assert set(result.events["link"]) == {"in", "straight", "round"}


@sizes
def test_a_ban_is_for_one_approach_and_one_way_out(size: int) -> None:
    pairs = [("1", "3"), ("9", "3"), ("2", "3"), ("1", "4")]
    result = run(CROSSING, NO_LEFT, pairs, size)
    expected = {("1", "3"): 250, ("9", "3"): 100, ("2", "3"): 50, ("1", "4"): 100}
    for pair, time in expected.items():
        assert times(result, *pair) == pytest.approx(time)


@sizes
def test_of_parallel_links_that_without_the_ban_is_taken(size: int) -> None:
    links = [
        link("fast", "1", "2"),
        link("slow", "1", "2", 1200),
        link("out", "2", "3"),
        link("other", "2", "4"),
    ]
    result = run(links, [("fast", "out")], [("1", "3"), ("1", "4")], size)
    assert times(result, "1", "3") == pytest.approx(60 + 50)
    assert times(result, "1", "4") == pytest.approx(50 + 50)


#: from 2 to 3 by turning round at 4, or further on at 5
TURNING = [
    link("in", "1", "2"),
    link("on", "2", "4"),
    link("back", "4", "2"),
    link("out", "2", "3"),
    link("further", "4", "5"),
    link("nearer", "5", "4"),
]


@sizes
@pytest.mark.parametrize("no_cycles", [False, True])
def test_a_banned_u_turn_is_made_at_the_next_node(size: int, no_cycles: bool) -> None:
    """Who turns comes through node 2 twice: that is no cycle, as only then may he leave by out."""
    for banned, expected in (
        ([("in", "out")], 200),
        ([("in", "out"), ("on", "back")], 300),
    ):
        result = run(TURNING, banned, [("1", "3")], size, no_cycles=no_cycles)
        assert times(result, "1", "3") == pytest.approx(expected)


@sizes
@pytest.mark.parametrize("no_cycles", [False, True])
def test_a_left_turn_is_three_right_turns(size: int, no_cycles: bool) -> None:
    block = [
        link("straight", "2", "5"),
        link("b", "5", "6"),
        link("c", "6", "7"),
        link("d", "7", "2"),
    ]
    links = [link("in", "1", "2"), link("left", "2", "3"), *block]
    result = run(links, [("in", "left")], [("1", "3")], size, no_cycles=no_cycles)
    assert times(result, "1", "3") == pytest.approx(300)


#: two carriageways and a short way between them, over which one could turn round
CARRIAGEWAYS = [
    link("east", "1", "2"),
    link("from_side", "8", "2"),
    link("between", "2", "3", 100),
    link("west", "3", "4"),
    link("to_side", "3", "9"),
    link("east_on", "2", "5"),
    link("far_between", "5", "6", 100),
    link("west_before", "6", "3"),
]


@sizes
def test_a_ban_over_a_via_link_is_for_those_alone_who_drive_all_of_it(size: int) -> None:
    banned = [("east", "between", "west")]
    pairs = [("1", "4"), ("8", "4"), ("1", "9"), ("2", "4"), ("1", "3")]
    result = run(CARRIAGEWAYS, banned, pairs, size)
    expected = (50 + 50 + 5 + 50 + 50, 50 + 5 + 50, 50 + 5 + 50, 5 + 50, 50 + 5)
    for pair, time in zip(pairs, expected, strict=True):
        assert times(result, *pair) == pytest.approx(time)


@sizes
def test_a_ban_over_two_via_links(size: int) -> None:
    chain = [link(name, *ends) for name, ends in zip("abcd", ("12", "23", "34", "45"), strict=True)]
    links = [*chain, link("e", "4", "6"), link("f", "6", "5", 3000), link("x", "9", "2")]
    result = run(links, [("a", "b", "c", "d")], [("1", "5"), ("9", "5"), ("2", "5")], size)
    assert times(result, "1", "5") == pytest.approx(150 + 50 + 150)
    assert times(result, "9", "5") == pytest.approx(200)
    assert times(result, "2", "5") == pytest.approx(150)


@sizes
def test_bans_that_overlap_hold_each_by_itself(size: int) -> None:
    """Along b one may be in the midst of two banned ways, of which the shorter forbids more."""
    chain = [link(name, *ends) for name, ends in zip("abc", ("12", "23", "34"), strict=True)]
    links = [*chain, link("d", "4", "5"), link("e", "4", "5", 1400), link("g", "4", "5", 1800)]
    result = run(links, [("a", "b", "c", "d"), ("b", "c", "e")], [("1", "5"), ("2", "5")], size)
    assert times(result, "1", "5") == pytest.approx(150 + 90)
    assert times(result, "2", "5") == pytest.approx(100 + 50)


@sizes
def test_where_no_legal_way_leads_trips_end_at_home(size: int) -> None:
    banned = [("in", "left"), ("straight", "round")]
    result = run(CROSSING, banned, [("1", "3"), ("9", "3"), ("1", "4")], size)
    trips = result.trips
    lost = (trips["origin"] == "1") & (trips["destination"] == "3")
    assert (trips.loc[lost, "status"] == "aborted").all()
    assert trips.loc[lost, ["enter_s", "free_time_s"]].isna().all(axis=None)
    assert (trips.loc[~lost, "status"] == "completed").all()


@sizes
def test_a_link_whose_every_turn_is_banned_ends_trips_that_are_bound_for_its_end(size: int) -> None:
    banned = [("in", "left"), ("in", "straight")]
    result = run(CROSSING, banned, [("1", "2"), ("9", "3")], size)
    assert times(result, "1", "2") == pytest.approx(50)
    assert times(result, "9", "3") == pytest.approx(100)
    result = run(CROSSING, banned, [("1", "3")], size)
    assert (result.trips["status"] == "aborted").all()


@sizes
def test_approaches_with_different_bans_choose_by_weights_of_their_own(size: int) -> None:
    """Two ways of 50 s: each gets half by logit, but of those who must not take one, none."""
    links = [
        link("free", "1", "2", lanes=3),
        link("barred", "9", "2", lanes=3),
        link("a", "2", "3", lanes=3),
        link("b", "2", "3", lanes=3),
    ]
    told = {"route_choice": "logit", "logit_spread": 10.0, "route_noise": 0.0}
    rows = [
        ("1", "3", 0.0, 2000.0 * size, 500.0 * size),
        ("9", "3", 0.0, 2000.0 * size, 500.0 * size),
    ]
    net = network(links, banned=[("barred", "a")])
    result = simulate(net, demand(*rows), Settings(3000.0 * size, size, **told))
    origin = result.trips["origin"].astype(str)
    by_a = origin[on_link(result, "a")["vehicle"]]
    assert set(by_a) == {"1"}
    assert (origin == "9").sum() == 500
    assert len(by_a) / 500 == pytest.approx(0.5, abs=4 * np.sqrt(0.25 / 500))


@sizes
def test_a_closure_of_the_way_round_leaves_them_waiting_for_it(size: int) -> None:
    """Nobody takes the banned turn even when the only legal way is closed for a while."""
    closure = Closure(("straight",), begin=0.0, end=1500.0)
    result = run(CROSSING, NO_LEFT, [("1", "3")], size, control=[closure])
    assert not (result.events["link"] == "left").any()
    assert on_link(result, "straight")["enter_s"].min() == pytest.approx(1500.0)
    assert (result.trips["status"] == "completed").all()


def test_a_class_that_may_not_use_the_way_round_has_no_way() -> None:
    rows = [("1", "3", 0.0, 100.0, 10.0, name) for name in ("lorries", "default")]
    table = pd.DataFrame(
        rows, columns=["origin", "destination", "start_s", "end_s", "vehicles", "class"]
    )
    classes = [DriverClass(name="lorries", banned=("round",))]
    net = network(CROSSING, banned=NO_LEFT)
    trips = simulate(net, Demand(table), Settings(1000, 5), classes=classes).trips
    by_class = trips.groupby("class", observed=True)["status"].unique()
    assert [*by_class["lorries"]] == ["aborted"]
    assert [*by_class["default"]] == ["completed"]


def given(route: Sequence[str]) -> Demand:
    row = {"origin": "1", "destination": "3", "start_s": 0.0, "end_s": 10.0, "vehicles": 5.0}
    return Demand(pd.DataFrame([row | {"route": tuple(route)}]))


def test_a_given_route_over_a_banned_turn_is_refused() -> None:
    net, settings = network(CROSSING, banned=NO_LEFT), Settings(1000, 5)
    told = "must not be driven after in on this route: the turn is banned"
    with pytest.raises(InputError, match=told):
        simulate(net, given(["in", "left"]), settings)
    wanted, enforced = demand(("1", "3", 0, 10, 5)), EnforcedRoute("1", "3", ("in", "left"))
    with pytest.raises(InputError, match=told):
        simulate(net, wanted, settings, control=[enforced])


def test_an_enforced_route_over_a_banned_way_is_refused() -> None:
    net = network(CARRIAGEWAYS, banned=[("east", "between", "west")])
    enforced = EnforcedRoute("1", "4", ("east", "between", "west"))
    wanted = demand(("1", "4", 0, 10, 5))
    with pytest.raises(InputError, match="must not be driven after between on this route"):
        simulate(net, wanted, Settings(1000, 5), control=[enforced])


def test_a_given_route_over_no_node_without_through_traffic() -> None:
    net = network(CROSSING, no_through=["2"])
    with pytest.raises(InputError, match="must not be driven after in on this route"):
        simulate(net, given(["in", "left"]), Settings(1000, 5))


def test_given_routes_that_obey_the_bans_are_driven() -> None:
    net = network(CROSSING, banned=NO_LEFT)
    result = simulate(net, given(["in", "straight", "round"]), Settings(1000, 5))
    assert result.events["link"].tolist() == ["in", "straight", "round"]
    enforced = EnforcedRoute("9", "3", ("side", "straight", "round"))
    result = simulate(net, demand(("9", "3", 0, 10, 5)), Settings(1000, 5), control=[enforced])
    assert result.events["link"].tolist() == ["side", "straight", "round"]


def test_demand_added_during_the_run_obeys_the_bans() -> None:
    net = network(CROSSING, banned=NO_LEFT)
    simulation = Simulation(net, demand(("9", "4", 0, 10, 5)), Settings(2000, 5))
    simulation.advance(500)
    simulation.add(demand(("1", "3", 600, 700, 5), ("2", "3", 600, 700, 5)))
    simulation.advance(2000)
    result = simulation.result()
    assert times(result, "1", "3") == pytest.approx(250)
    assert times(result, "2", "3") == pytest.approx(50)
    with pytest.raises(InputError, match="the turn is banned"):
        Simulation(net, demand(("9", "4", 0, 10, 5)), Settings(2000, 5)).add(given(["in", "left"]))


def test_a_run_that_is_resumed_obeys_the_bans(tmp_path: Path) -> None:
    net = network(CARRIAGEWAYS, banned=[("east", "between", "west")])
    wanted = demand(("1", "4", 0.0, 100.0, 5.0), ("8", "4", 600.0, 700.0, 5.0))
    simulation = Simulation(net, wanted, Settings(2000, 5))
    simulation.advance(130)
    simulation.save(tmp_path / "run.zip")
    resumed = Simulation.resume(tmp_path / "run.zip")
    resumed.advance(2000)
    once = simulate(net, wanted, Settings(2000, 5))
    pd.testing.assert_frame_equal(resumed.result().events, once.events)
    assert times(resumed.result(), "1", "4") == pytest.approx(205)
    assert times(resumed.result(), "8", "4") == pytest.approx(105)


def test_skims_and_shortest_distances_obey_the_bans() -> None:
    net = network(CROSSING, banned=NO_LEFT)
    result = simulate(net, demand(("1", "3", 0, 10, 5), ("9", "3", 0, 10, 5)), Settings(1000, 5))
    table = skims(result, net, bin_s=1000.0).set_index(["origin", "destination"])
    assert table.loc[("1", "3"), "free_flow_travel_time_s"] == pytest.approx(250)
    assert table.loc[("9", "3"), "free_flow_travel_time_s"] == pytest.approx(100)
    distances = od_table(net, trip_summary(result, net), 1000.0).set_index("orig")[
        "shortest_distance"
    ]
    assert distances["1"] == pytest.approx(5000)
    assert distances["9"] == pytest.approx(2000)
