"""Edits of networks: what each leaves, worked out by hand; inverses, and edits elsewhere."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import LineString, Point
from small_networks import demand, link, network

from uxsim_geo.control.site import Target
from uxsim_geo.errors import InputError
from uxsim_geo.network.check import check_network
from uxsim_geo.network.network import Network
from uxsim_geo.network.signal_rows import COLUMNS
from uxsim_geo.scenario.cut_off import cut_off_pairs
from uxsim_geo.scenario.link_attributes import add_lanes, scale_attributes, set_attributes
from uxsim_geo.scenario.links_added import NewLink, add_link
from uxsim_geo.scenario.links_removed import (
    remove_links,
    without_routes_over,
    without_signals_over,
)
from uxsim_geo.scenario.nodes_added import add_node, remove_signals
from uxsim_geo.scenario.turns import allow_turn, ban_turn

#: degrees on the equator, 0.01 of which are 1113.195 m on the WGS 84 ellipsoid
PLACES = {"a": (0.0, 0.0), "b": (0.01, 0.0), "c": (0.02, 0.0), "d": (0.01, 0.01)}
HUNDREDTH = 6378137.0 * np.pi / 180 / 100


def plain() -> Network:
    return network(
        [
            link("ab", "a", "b", lanes=2, capacity=1.0, name="Mill Lane"),
            link("bc", "b", "c", lanes=1, name="Mill Lane"),
            link("cb", "c", "b", lanes=1, name="Mill Lane"),
            link("bd", "b", "d", lanes=3, capacity=1.5, free_speed=10.0, name="High Street"),
        ],
        banned=[("ab", "bc"), ("ab", "bd"), ("cb", "bd")],
    )


def mapped(crs: str | None = "EPSG:4326") -> Network:
    bare = plain()
    points = [Point(PLACES[node]) for node in bare.nodes["node_id"]]
    ends = zip(bare.links["from_node_id"], bare.links["to_node_id"], strict=True)
    lines = [LineString([PLACES[one], PLACES[other]]) for one, other in ends]
    return Network(
        gpd.GeoDataFrame(bare.nodes.assign(control="none"), geometry=points, crs=crs),
        gpd.GeoDataFrame(bare.links, geometry=lines, crs=crs),
        bare.movements,
    )


def row(edited: Network, link_id: str) -> dict[str, Any]:
    table = edited.links.set_index("link_id")
    return dict(table.loc[link_id])


def told(changes: pd.DataFrame) -> list[tuple[object, ...]]:
    return [
        tuple(None if pd.isna(one) else one for one in values)
        for values in changes.itertuples(index=False)
    ]


def refusal(edit: Any, *arguments: Any) -> str:
    with pytest.raises(InputError) as error:
        edit(*arguments)
    return str(error.value)


def same_tables(one: Network, other: Network) -> None:
    for name in ("nodes", "links", "movements"):
        pd.testing.assert_frame_equal(getattr(one, name), getattr(other, name))


def test_set_values_stand_in_the_links_meant_alone() -> None:
    before = plain()
    edited, changes = set_attributes(before, Target(street="Mill Lane"), {"free_speed": 15.0})
    assert edited.links["free_speed"].tolist() == [15.0, 15.0, 15.0, 10.0]
    assert told(changes) == [
        ("link", name, "free_speed", "20", "15") for name in ("ab", "bc", "cb")
    ]
    same_tables(before, plain())
    check_network(edited)


def test_a_given_capacity_follows_the_lanes_and_one_of_the_diagram_stays_its_own() -> None:
    edited, changes = set_attributes(plain(), Target(("ab", "bc")), {"lanes": 3})
    assert edited.links["lanes"].tolist() == [3, 3, 1, 3]
    assert edited.links["lanes"].dtype == np.int64
    assert row(edited, "ab")["capacity"] == pytest.approx(1.5)
    assert np.isnan(row(edited, "bc")["capacity"])
    assert told(changes) == [
        ("link", "ab", "lanes", "2", "3"),
        ("link", "bc", "lanes", "1", "3"),
        ("link", "ab", "capacity", "1", "1.5"),
    ]


def test_a_capacity_that_is_set_with_the_lanes_is_what_is_said() -> None:
    edited, _ = set_attributes(plain(), Target(("ab",)), {"lanes": 1, "capacity": 0.9})
    assert row(edited, "ab")["capacity"] == 0.9


def test_lanes_and_speeds_that_are_set_are_given() -> None:
    before = plain()
    before.links["lanes_source"] = "assumed"
    before.links["free_speed_source"] = "assumed"
    edited, _ = set_attributes(before, Target(("ab",)), {"lanes": 1})
    assert edited.links["lanes_source"].tolist() == ["given", "assumed", "assumed", "assumed"]
    assert (edited.links["free_speed_source"] == "assumed").all()


def test_texts_are_set_also_where_no_link_had_any() -> None:
    edited, changes = set_attributes(plain(), Target(("bd",)), {"road_class": "primary"})
    assert row(edited, "bd")["road_class"] == "primary"
    assert edited.links["road_class"].isna().sum() == 3
    assert told(changes) == [("link", "bd", "road_class", None, "primary")]


def test_a_scaled_capacity_is_that_of_the_diagram_where_none_is_given() -> None:
    edited, _ = scale_attributes(
        plain(), Target(("ab", "bc")), {"capacity": 0.5, "free_speed": 0.8}
    )
    assert row(edited, "ab")["capacity"] == pytest.approx(0.5)
    # 20·0.2 / (1 + 20·1·0.2) = 0.8 veh/s, of the speed before
    assert row(edited, "bc")["capacity"] == pytest.approx(0.4)
    assert edited.links["free_speed"].tolist() == [16.0, 16.0, 20.0, 10.0]


def test_lanes_are_added_and_taken_but_for_the_last() -> None:
    edited, _ = add_lanes(plain(), Target(("ab", "bd")), -1)
    assert edited.links["lanes"].tolist() == [1, 1, 1, 2]
    assert edited.links["capacity"].fillna(-1).tolist() == pytest.approx([0.5, -1, -1, 1.0])
    text = refusal(add_lanes, plain(), Target(where="lanes < 3"), -1)
    assert "leaves no lane of 2 links, of bc, cb: close them instead" in text
    assert "adds no lane" in refusal(add_lanes, plain(), Target(("ab",)), 0)


@pytest.mark.parametrize("edit", [remove_links, lambda n, t: set_attributes(n, t, {"lanes": 1})])
def test_an_edit_that_chooses_nothing_is_refused(edit: Any) -> None:
    assert "no link of the network is meant" in refusal(edit, plain(), Target(where="lanes > 7"))
    assert "did you mean Mill Lane?" in refusal(edit, plain(), Target(street="Mill Lan"))
    assert "no such link_id" in refusal(edit, plain(), Target(("zz",)))


def test_a_straight_link_is_as_long_as_the_way_on_the_ground() -> None:
    new = NewLink("ac", "a", "c", values={"lanes": 2, "free_speed": 12.5}, back_id="ca")
    edited, changes = add_link(mapped(), new)
    there, back = row(edited, "ac"), row(edited, "ca")
    assert there["length"] == pytest.approx(2 * HUNDREDTH, rel=1e-9)
    assert (there["from_node_id"], there["to_node_id"]) == ("a", "c")
    assert (back["from_node_id"], back["to_node_id"]) == ("c", "a")
    assert list(back["geometry"].coords) == [PLACES["c"], PLACES["a"]]
    assert (there["lanes"], there["free_speed"], there["jam_density"]) == (2, 12.5, 0.2)
    assert np.isnan(there["capacity"])
    assert edited.links["lanes"].dtype == np.int64
    assert told(changes) == [("link", name, "exists", None, "yes") for name in ("ac", "ca")]
    assert edited.links.crs == mapped().links.crs
    check_network(edited)


def test_a_drawn_link_keeps_its_bends_and_ends_at_its_nodes() -> None:
    along = "LINESTRING (0.0001 0, 0 0.01, 0.01 0.0101)"
    edited, _ = add_link(mapped(), NewLink("ad", "a", "d", along, {"lanes": 1, "free_speed": 10.0}))
    assert list(row(edited, "ad")["geometry"].coords) == [(0, 0), (0, 0.01), (0.01, 0.01)]
    # a hundredth of a degree of latitude is 1105.7 m there
    assert row(edited, "ad")["length"] == pytest.approx(HUNDREDTH + 1105.74, rel=1e-4)


def test_a_line_from_a_file_comes_in_its_own_reference_system(tmp_path: Path) -> None:
    line = gpd.GeoDataFrame(geometry=[LineString([(0, 0), (0.01, 0.01)])], crs="EPSG:4326")
    line.to_crs("EPSG:3857").to_file(tmp_path / "line.gpkg")
    new = NewLink("ad", "a", "d", tmp_path / "line.gpkg", {"lanes": 1, "free_speed": 10.0})
    straight = NewLink("ad", "a", "d", None, {"lanes": 1, "free_speed": 10.0})
    lengths = [row(add_link(mapped(), one)[0], "ad")["length"] for one in (new, straight)]
    assert lengths[0] == pytest.approx(lengths[1], rel=1e-6)


def test_a_length_that_is_given_holds_whatever_the_line() -> None:
    values = {"lanes": 1, "free_speed": 10.0, "length": 5000.0}
    assert row(add_link(mapped(), NewLink("ad", "a", "d", None, values))[0], "ad")["length"] == 5000
    assert row(add_link(plain(), NewLink("ad", "a", "d", None, values))[0], "ad")["length"] == 5000


def test_links_that_cannot_be_added_are_refused_with_all_that_is_wrong(tmp_path: Path) -> None:
    values = {"lanes": 1, "free_speed": 10.0}
    text = refusal(add_link, mapped(), NewLink("ab", "x", "c", None, values, "bc"))
    for message in ("column id: the network has this link_id already", "column both_ways", "from:"):
        assert message in text
    turned = "LINESTRING (0.01 0.01, 0 0)"
    for along, message in (
        (turned, "is drawn from the last node to the first: turn it round"),
        ("LINESTRING (0.1 0, 0.01 0.01)", "11,132 m from where the link starts; 100 m is the most"),
        ("LINESTRING (0 0)", "must be a LINESTRING"),
        ("POINT (0 0)", "must be a LINESTRING"),
    ):
        assert message in refusal(add_link, mapped(), NewLink("n", "a", "d", along, values)), along
    assert "give the length" in refusal(add_link, plain(), NewLink("n", "a", "d", None, values))
    two = gpd.GeoDataFrame(geometry=[LineString([(0, 0), (1, 1)])] * 2, crs="EPSG:4326")
    two.to_file(tmp_path / "two.gpkg")
    text = refusal(add_link, mapped(), NewLink("n", "a", "d", tmp_path / "two.gpkg", values))
    assert "must hold one line, and holds 2 features" in text


def test_columns_of_readers_stay_what_they_are_where_a_new_link_has_nothing() -> None:
    before = mapped()
    before.links["toll_road"] = [True, False, False, True]
    before.links["width"] = 3.5
    before.links["count"] = 7
    edited, _ = add_link(before, NewLink("ac", "a", "c", None, {"lanes": 1, "free_speed": 9.0}))
    assert edited.links["toll_road"].tolist()[:4] == [True, False, False, True]
    assert pd.isna(row(edited, "ac")["toll_road"])
    assert pd.isna(row(edited, "ac")["width"])
    assert edited.links["count"].tolist()[:4] == [7.0] * 4
    assert list(edited.links.columns) == list(before.links.columns)


def test_a_link_goes_with_the_banned_turns_that_name_it() -> None:
    edited, changes = remove_links(plain(), Target(("bd",)))
    assert edited.links["link_id"].tolist() == ["ab", "bc", "cb"]
    assert edited.movements[["from_link_id", "to_link_id"]].to_numpy().tolist() == [["ab", "bc"]]
    assert told(changes) == [
        ("link", "bd", "exists", "yes", None),
        ("turn", "ab bd", "banned", "yes", None),
        ("turn", "cb bd", "banned", "yes", None),
    ]
    check_network(edited)
    assert "would stay" in refusal(remove_links, plain(), Target(where="lanes > 0"))


def test_a_ban_over_via_links_goes_with_each_of_them() -> None:
    rows = [link("ab", "a", "b"), link("bc", "b", "c"), link("cd", "c", "d"), link("bd", "b", "d")]
    edited, _ = remove_links(network(rows, banned=[("ab", "bc", "cd")]), Target(("bc",)))
    assert len(edited.movements) == 0
    check_network(edited)


def test_drivers_whose_route_is_gone_choose_their_way() -> None:
    asked = demand(("a", "d", 0, 600, 10), ("a", "c", 0, 600, 5))
    asked.table["route"] = [["ab", "bd"], ["ab", "bc"]]
    edited, changes = without_routes_over(asked, {"bd"})
    assert edited.table["route"].tolist() == [None, ["ab", "bc"]]
    assert told(changes) == [("demand", "a to d", "route", "ab bd", "chosen on the way")]
    assert asked.table["route"].tolist()[0] == ["ab", "bd"]


def test_signal_plans_lose_links_that_are_gone_and_keep_their_times() -> None:
    rows = [("n", 1, "ab"), ("n", 1, "cb"), ("n", 2, "bd"), ("m", 1, "bd")]
    table = pd.DataFrame(rows, columns=["node_id", "phase", "link_id"]).reindex(columns=COLUMNS)
    left = without_signals_over(table, ["ab", "cb", "bc"])
    assert left["node_id"].tolist() == ["n", "n", "n"]
    assert left["phase"].tolist() == [1, 1, 2]
    assert left["link_id"].isna().tolist() == [False, False, True]
    pd.testing.assert_frame_equal(without_signals_over(table, ["ab", "cb", "bd"]), table)


def test_a_node_is_put_where_it_is_said_in_either_reference_system() -> None:
    for place, crs in (((0.02, 0.01), None), ((2226.389815865, 1113.1949079), "EPSG:3857")):
        edited, changes = add_node(mapped(), "e", place, crs)
        point = edited.nodes["geometry"].iloc[-1]
        assert (point.x, point.y) == pytest.approx((0.02, 0.01), abs=1e-6)
        assert edited.nodes.iloc[-1][["node_id", "control"]].tolist() == ["e", "none"]
        assert edited.nodes["through_traffic"].tolist() == [True] * 5
        assert edited.nodes["through_traffic"].dtype == bool
        assert told(changes) == [("node", "e", "exists", None, "yes")]
    linked, _ = add_link(edited, NewLink("de", "d", "e", None, {"lanes": 1, "free_speed": 10.0}))
    assert row(linked, "de")["length"] == pytest.approx(HUNDREDTH, rel=1e-4)
    check_network(linked)


@pytest.mark.parametrize(
    ("at", "crs", "message"),
    [
        (("a", (0.0, 0.0)), None, "column id: the network has this node_id already"),
        (("e", (0.0, 95.0)), None, "not at a longitude and latitude"),
        (("e", (0.0, 0.0)), "EPSG:nothing", "is not a reference system"),
        (("e", (400.0, 100.0)), "EPSG:4258", "not at a longitude and latitude"),
    ],
)
def test_nodes_that_cannot_be_added(at: Any, crs: str | None, message: str) -> None:
    assert message in refusal(add_node, mapped(), *at, crs)


def test_a_place_in_a_system_needs_a_network_that_has_one() -> None:
    text = refusal(add_node, mapped(None), "e", (0.0, 0.0), "EPSG:4326")
    assert "the network has no reference system" in text


def test_a_signal_is_taken_away_and_unknown_nodes_are_refused() -> None:
    before = mapped()
    before.nodes["control"] = ["signal", "none", "signal", "none"]
    edited, changes = remove_signals(before, ["a", "b"])
    assert edited.nodes["control"].tolist() == ["none", "none", "signal", "none"]
    assert told(changes) == [("node", "a", "control", "signal", "none")]
    assert "no such node_id" in refusal(remove_signals, before, ["nowhere"])


def test_turns_are_banned_and_allowed() -> None:
    edited, changes = ban_turn(plain(), ("cb", "bc"))
    assert edited.movements.iloc[-1].dropna().tolist() == ["b", "cb", "bc"]
    assert told(changes) == [("turn", "cb bc", "banned", None, "yes")]
    check_network(edited)
    open_again, changes = allow_turn(plain(), ("ab", "bd"))
    assert open_again.movements["from_link_id"].tolist() == ["ab", "cb"]
    assert told(changes) == [("turn", "ab bd", "banned", "yes", None)]


def test_a_way_over_links_between_is_banned_where_no_ban_had_any() -> None:
    rows = [link("ab", "a", "b"), link("bc", "b", "c"), link("cd", "c", "d")]
    edited, _ = ban_turn(network(rows), ("ab", "bc", "cd"))
    assert edited.movements.iloc[0].tolist() == ["b", "ab", "cd", "bc"]
    check_network(edited)
    back, _ = allow_turn(edited, ("ab", "bc", "cd"))
    assert len(back.movements) == 0


@pytest.mark.parametrize(
    ("edit", "way", "message"),
    [
        (ban_turn, ("ab", "bc"), "is banned already"),
        (ban_turn, ("bc", "ab"), "column to_link: does not start where bc ends: that is node c"),
        (ban_turn, ("ab", "bbc"), "did you mean bc?"),
        (ban_turn, ("ab", "zz", "bc"), "column via_links: the network has no such link_id"),
        (allow_turn, ("cb", "bc"), "is not banned; banned from there: cb bd"),
    ],
)
def test_turns_that_cannot_be_changed(edit: Any, way: tuple[str, ...], message: str) -> None:
    assert message in refusal(edit, plain(), way)


def test_pairs_that_lose_every_way_are_told_apart_from_those_that_never_had_one() -> None:
    asked = demand(("a", "c", 0, 600, 10), ("a", "b", 0, 600, 5), ("d", "a", 0, 600, 2))
    before = network([link("ab", "a", "b"), link("bc", "b", "c"), link("bd", "b", "d")])
    after, _ = remove_links(before, Target(("bc",)))
    lost = cut_off_pairs(before, after, asked)
    assert lost.to_numpy().tolist() == [["a", "c", 10.0, True], ["d", "a", 2.0, False]]
    closed = cut_off_pairs(before, before, asked, {"bc"})
    pd.testing.assert_frame_equal(closed, lost)


# properties: an edit and its inverse, and edits of different links in either order

IDS = st.sampled_from(["ab", "bc", "cb", "bd"])


@given(IDS, st.integers(1, 5))
def test_lanes_taken_after_being_added_leave_the_same_tables(link_id: str, lanes: int) -> None:
    more, _ = add_lanes(mapped(), Target((link_id,)), lanes)
    same_tables(add_lanes(more, Target((link_id,)), -lanes)[0], mapped())


@given(IDS, st.sampled_from(["length", "free_speed", "jam_density", "merge_priority"]))
def test_a_value_set_back_leaves_the_same_tables(link_id: str, name: str) -> None:
    before = mapped()
    other, _ = set_attributes(before, Target((link_id,)), {name: 0.123})
    old = row(before, link_id)[name]
    same_tables(set_attributes(other, Target((link_id,)), {name: old})[0], before)


@given(IDS, IDS, st.floats(0.1, 10))
def test_a_new_link_removed_again_leaves_the_same_tables(
    one: str, other: str, speed: float
) -> None:
    before = mapped()
    start, end = row(before, one)["from_node_id"], row(before, other)["to_node_id"]
    if start != end:
        new = NewLink("new", start, end, None, {"lanes": 1, "free_speed": speed})
        same_tables(remove_links(add_link(before, new)[0], Target(("new",)))[0], before)


@given(st.permutations([0, 1, 2]))
def test_a_ban_lifted_again_leaves_the_same_tables(order: list[int]) -> None:
    before = plain()
    edited, _ = ban_turn(before, ("cb", "bc"))
    same_tables(allow_turn(edited, ("cb", "bc"))[0], before)
    ways = [("ab", "bc"), ("ab", "bd"), ("cb", "bd")]
    for number in order:
        before, _ = allow_turn(before, ways[number])
    assert len(before.movements) == 0


@given(st.permutations(range(5)))
def test_edits_of_different_links_may_come_in_any_order(order: list[int]) -> None:
    edits = [
        lambda n: set_attributes(n, Target(("ab",)), {"lanes": 4})[0],
        lambda n: scale_attributes(n, Target(("bc",)), {"capacity": 2.0})[0],
        lambda n: add_lanes(n, Target(("bd",)), 1)[0],
        lambda n: remove_links(n, Target(("cb",)))[0],
        lambda n: set_attributes(n, Target(("bd",)), {"road_class": "primary"})[0],
    ]
    plainly = edited = mapped()
    for edit in edits:
        plainly = edit(plainly)
    for number in order:
        edited = edits[number](edited)
    same_tables(edited, plainly)
