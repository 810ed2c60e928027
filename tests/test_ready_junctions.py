"""Junctions of several nodes that become one: which, with which turns, and how long."""

from __future__ import annotations

from itertools import pairwise

import pytest
from road_tables import banned, drawn, link, plain_costs, road, street

from uxsim_geo.network.clusters import JunctionSizes
from uxsim_geo.network.junctions import merge_junctions
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes

#: generous, so that a test's junction is refused only where it means to test that
SIZES = JunctionSizes(link=25.0, signal_link=25.0, ring=60.0, extent=80.0, error=25.0)


def merged(network: Network, sizes: JunctionSizes = SIZES) -> Network:
    return merge_junctions(network, sizes, Notes())


def turns(network: Network) -> set[tuple[str, str]]:
    """Open turns, turning back included."""
    links = network.links
    closed = {tuple(ban.split()) for ban in banned(network)}
    pairs = links.merge(links, left_on="to_node_id", right_on="from_node_id")
    return set(zip(pairs["link_id_x"], pairs["link_id_y"], strict=True)) - closed


#: a dual carriageway from west to east, 20 m apart, crosses a street from south to north
CROSSING = {
    "1": (0.0, 0.0),
    "2": (0.0, 20.0),
    "w1": (-500.0, 0.0),
    "w2": (-500.0, 20.0),
    "e1": (500.0, 0.0),
    "e2": (500.0, 20.0),
    "s": (0.0, -500.0),
    "n": (0.0, 520.0),
}
CARRIAGEWAYS = [road("w1", "1"), road("1", "e1"), road("e2", "2"), road("2", "w2")]
STREETS = [street("s", "1"), street("1", "2"), street("2", "n")]


def test_a_crossing_of_a_dual_carriageway_becomes_one_node() -> None:
    network = merged(drawn(CROSSING, [*CARRIAGEWAYS, *STREETS]))
    assert set(network.nodes["node_id"]) == {*CROSSING} - {"2"}
    node = network.nodes.set_index("node_id").loc["1"]
    assert node["merged_node_ids"] == "1 2"
    assert (node["geometry"].x, node["geometry"].y) == (0.0, 10.0)
    approaches, exits = {"w1-1", "e2-2", "s-1", "n-2"}, {"1-e1", "2-w2", "1-s", "2-n"}
    closed = {("s-1", "1-s"), ("n-2", "2-n")}  # nobody turns back at once
    at_node = {(a, b) for a, b in turns(network) if a in approaches}
    assert at_node == {(a, b) for a in approaches for b in exits} - closed


def test_ways_straight_on_keep_their_length_and_time() -> None:
    before = drawn(CROSSING, [*CARRIAGEWAYS, *STREETS])
    after = merged(before)
    assert plain_costs(after, "s", "length")["n"] == pytest.approx(1020.0, abs=0.6)
    assert plain_costs(after, "w1", "length")["e1"] == pytest.approx(1000.0, abs=0.6)
    assert plain_costs(after, "s", "time")["n"] == pytest.approx(102.0, abs=0.06)
    error = after.nodes.set_index("node_id").loc["1", "merge_error"]
    for origin in ("w1", "e2", "s", "n"):
        was, now = (plain_costs(network, origin, "length") for network in (before, after))
        for place in ("e1", "w2", "s", "n"):
            assert now[place] == pytest.approx(was[place], abs=3 * error + 0.01)
    # both directions of a street are as long as each other
    assert link(after, "s-1")["length"] == link(after, "1-s")["length"]


def test_lines_lead_to_the_middle() -> None:
    network = merged(drawn(CROSSING, [*CARRIAGEWAYS, *STREETS]))
    assert list(link(network, "w1-1")["geometry"].coords) == [(-500.0, 0.0), (0.0, 10.0)]
    assert list(link(network, "2-n")["geometry"].coords) == [(0.0, 10.0), (0.0, 520.0)]


def test_lines_do_not_run_past_the_middle_and_back() -> None:
    """The corner at (-4, 4) is nearer to the middle than node 1 was, that at (-90, 5) is not."""
    corners = [(-90.0, 5.0), (-4.0, 4.0)]
    carriageways = [road("w1", "1", through=corners), *CARRIAGEWAYS[1:]]
    network = merged(drawn(CROSSING, [*carriageways, *STREETS]))
    line = list(link(network, "w1-1")["geometry"].coords)
    assert line == [(-500.0, 0.0), (-90.0, 5.0), (0.0, 10.0)]


def test_a_slow_way_through_slows_the_links_around() -> None:
    streets = [street("s", "1"), street("1", "2", free_speed=5.0), street("2", "n")]
    after = merged(drawn(CROSSING, [*CARRIAGEWAYS, *streets]))
    assert plain_costs(after, "s", "time")["n"] == pytest.approx(104.0, abs=0.12)
    assert link(after, "s-1")["free_speed"] < 10.0
    assert link(after, "w1-1")["free_speed"] == 10.0


def test_a_banned_turn_stays_banned_and_others_stay_open() -> None:
    """No left turn from the south: at the second carriageway, from the piece between."""
    bans = ["1-2 2-w2", "n-2 2-1"]
    network = merged(drawn(CROSSING, [*CARRIAGEWAYS, *STREETS], bans=bans))
    open_turns = turns(network)
    # the piece between is closed to those from the north: they reach neither south nor east
    closed = {("s-1", "2-w2"), ("n-2", "1-s"), ("n-2", "1-e1"), ("s-1", "1-s"), ("n-2", "2-n")}
    # from the west one comes over the same piece
    closed.add(("w1-1", "2-w2"))
    assert banned(network) == {f"{a} {b}" for a, b in closed}
    assert {("s-1", "2-n"), ("s-1", "1-e1"), ("w1-1", "2-n"), ("e2-2", "1-s")} <= open_turns
    assert set(network.movements["node_id"]) == {"1"}


def test_a_ban_over_the_piece_between_holds_for_those_who_came_that_way() -> None:
    """From the west nobody may turn round over the piece between; from the south one may."""
    bans = ["w1-1 1-2 2-w2"]
    network = merged(drawn(CROSSING, [*CARRIAGEWAYS, *STREETS], bans=bans))
    assert network.movements["via_link_ids"].isna().all()
    assert ("w1-1", "2-w2") not in turns(network)
    assert {("s-1", "2-w2"), ("w1-1", "2-n")} <= turns(network)


def test_a_ban_that_goes_on_outside_leaves_the_junction_as_it_is() -> None:
    bans = ["s-1 1-2 2-n n-x"]
    places = {**CROSSING, "x": (0.0, 900.0)}
    network = drawn(places, [*CARRIAGEWAYS, *STREETS, street("n", "x")], bans=bans)
    notes = Notes()
    assert set(merge_junctions(network, SIZES, notes).nodes["node_id"]) == set(places)
    table = notes.table()
    assert "goes on outside" in table["note"][table["topic"] == "junction left"].item()


def test_a_ban_of_links_around_goes_on_to_hold() -> None:
    """From the street before the southern one to the east: the way leads over no inner piece."""
    places = {**CROSSING, "t": (0.0, -900.0), "u": (300.0, -500.0)}
    roads = [*CARRIAGEWAYS, *STREETS, street("t", "s"), street("u", "s")]
    network = merged(drawn(places, roads, bans=["t-s s-1 1-e1"]))
    assert "t-s s-1 1-e1" in banned(network)
    assert "2" not in set(network.nodes["node_id"])


#: a ring of four nodes, driven against the clock, with a street at each
RING = {"e": (8.0, 0.0), "n": (0.0, 8.0), "w": (-8.0, 0.0), "s": (0.0, -8.0)}
ARMS = {"E": (400.0, 0.0), "N": (0.0, 400.0), "W": (-400.0, 0.0), "S": (0.0, -400.0)}


def roundabout(scale: float = 1.0) -> Network:
    places = {name: (scale * x, scale * y) for name, (x, y) in RING.items()} | ARMS
    around = [road(a, b, junction="roundabout") for a, b in ("en", "nw", "ws", "se")]
    return drawn(places, [*around, *(street(a.upper(), a) for a in "enws")])


def test_a_small_roundabout_becomes_a_node_at_which_one_may_turn_round() -> None:
    network = merged(roundabout())
    assert set(network.nodes["node_id"]) == {*ARMS, "e"}
    assert banned(network) == set()
    ring = 4 * 128**0.5
    was = plain_costs(roundabout(), "W", "length")["E"]
    assert was == pytest.approx(784.0 + ring / 2)
    assert plain_costs(network, "W", "length")["E"] == pytest.approx(was, abs=0.6)


def test_a_large_roundabout_stays_though_its_pieces_are_short() -> None:
    sizes = JunctionSizes(link=25.0, ring=60.0, extent=80.0, error=25.0)
    assert len(merged(roundabout(2.0), sizes).nodes) == 8


def test_signals_at_the_corners_become_one() -> None:
    """A square of one-way streets with a signal on every corner, 30 m apart."""
    places = {"a": (0.0, 0.0), "b": (30.0, 0.0), "c": (30.0, 30.0), "d": (0.0, 30.0)}
    outer = {"w": (-300.0, 0.0), "e": (330.0, 0.0), "s": (30.0, -300.0), "n": (30.0, 330.0)}
    outer |= {"E": (330.0, 30.0), "W": (-300.0, 30.0), "N": (0.0, 330.0), "S": (0.0, -300.0)}
    ways = ["wabe", "sbcn", "EcdW", "NdaS"]
    roads = [road(*pair) for way in ways for pair in pairwise(way)]
    network = drawn(places | outer, roads, signals="abcd")
    sizes = JunctionSizes(link=10.0, signal_link=35.0, error=35.0)
    after = merged(network, sizes)
    assert set(after.nodes["node_id"]) == {*outer, "a"}
    assert after.nodes.set_index("node_id").loc["a", "control"] == "signal"
    # straight on, left, right and round over the other side; all of them were possible
    assert banned(after) == set()
    for one, other in (("w", "e"), ("s", "n"), ("E", "W"), ("N", "S")):
        assert plain_costs(after, one, "length")[other] == pytest.approx(630.0, abs=0.6)
    assert len(merged(network, JunctionSizes(link=10.0, signal_link=25.0)).nodes) == 12


def test_oneway_pieces_ban_the_turns_they_do_not_allow() -> None:
    """The piece between leads north only: from the north, south and east are out of reach."""
    streets = [street("s", "1"), road("1", "2"), street("2", "n")]
    network = merged(drawn(CROSSING, [*CARRIAGEWAYS, *streets]))
    closed = {"n-2 1-s", "n-2 1-e1", "e2-2 1-s", "e2-2 1-e1"}
    assert banned(network) == closed | {"s-1 1-s", "n-2 2-n"}
    # to the north one comes over the piece between, to the south nobody does
    for one, other in (("s-1", "1-s"), ("n-2", "2-n")):
        assert link(network, one)["length"] == link(network, other)["length"]
    assert set(network.movements.columns) == {
        "node_id",
        "from_link_id",
        "to_link_id",
        "via_link_ids",
    }


def test_a_stub_is_a_part_of_its_junction_where_one_may_turn_round() -> None:
    places = {"a": (0.0, 0.0), "w": (-300.0, 0.0), "e": (300.0, 0.0), "x": (0.0, 12.0)}
    network = merged(drawn(places, [street("w", "a"), street("a", "e"), street("a", "x")]))
    assert set(network.nodes["node_id"]) == {"w", "e", "a"}
    assert plain_costs(network, "w", "length")["e"] == pytest.approx(600.0, abs=0.6)
    assert banned(network) == set()


def test_zones_and_long_links_within_keep_a_junction_as_it_is() -> None:
    zoned = drawn(CROSSING, [*CARRIAGEWAYS, *STREETS], zones={"2": "5"})
    assert len(merged(zoned).nodes) == 8
    roads = [*CARRIAGEWAYS, *STREETS, road("1", "2", link_id="long", length=400.0)]
    assert len(merged(drawn(CROSSING, roads)).nodes) == 8


def test_a_junction_is_left_where_ways_would_change_by_more_than_the_error() -> None:
    network = drawn(CROSSING, [*CARRIAGEWAYS, *STREETS])
    notes = Notes()
    sizes = JunctionSizes(link=25.0, error=5.0)
    assert len(merge_junctions(network, sizes, notes).nodes) == 8
    assert "too long or too short" in notes.table()["note"].str.cat()


def test_no_junction_is_longer_than_the_extent() -> None:
    """A row of junctions 20 m apart: pairs at most, if no junction is longer than 30 m."""
    places = {f"{k}": (20.0 * k, 0.0) for k in range(6)}
    arms = {f"n{k}": (20.0 * k, 300.0) for k in range(6)}
    roads = [street(f"{k}", f"{k + 1}") for k in range(5)]
    roads += [street(f"{k}", f"n{k}") for k in range(6)]
    network = merged(drawn(places | arms, roads), JunctionSizes(link=25, extent=30.0, error=25))
    assert set(network.nodes["merged_node_ids"].dropna()) == {"0 1", "2 3", "4 5"}


def test_without_coordinates_lengths_say_how_large_a_junction_is() -> None:
    located = drawn(CROSSING, [*CARRIAGEWAYS, *STREETS])
    tables = [table.drop(columns="geometry") for table in (located.nodes, located.links)]
    network = merged(Network(*tables, located.movements))
    assert banned(network) == banned(merged(located))
    assert set(network.nodes["node_id"]) == {*CROSSING} - {"2"}


def test_what_was_merged_is_not_merged_again() -> None:
    """With limits at which everything would be one junction."""
    once = merged(drawn(CROSSING, [*CARRIAGEWAYS, *STREETS]))
    twice = merged(once, JunctionSizes(link=600.0, extent=2000.0, error=1e6))
    assert twice.nodes.equals(once.nodes)
    assert twice.links.equals(once.links)


def test_other_junctions_may_be_merged_later() -> None:
    """A pair 10 m apart on the street to the north, then the crossing with its 20 m."""
    places = {**CROSSING, "m": (0.0, 530.0), "x": (-300.0, 520.0), "y": (300.0, 530.0)}
    roads = [*CARRIAGEWAYS, *STREETS, street("n", "m"), street("n", "x"), street("m", "y")]
    once = merged(drawn(places, roads), JunctionSizes(link=12.0, error=25.0))
    twice = merged(once)
    found = twice.nodes.set_index("node_id")[["merged_node_ids", "merge_error"]].dropna()
    assert found["merged_node_ids"].to_dict() == {"m": "m n", "1": "1 2"}
    assert found.loc["m", "merge_error"] == once.nodes["merge_error"].dropna().item()
