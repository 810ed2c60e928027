"""Projection, what cannot be driven, the part that hangs together, turning back."""

from __future__ import annotations

from dataclasses import replace

import geopandas
import numpy as np
import pandas as pd
import pytest
import shapely
from road_tables import banned, drawn, link, road, street
from small_networks import link as plain_link
from small_networks import network as plain_network

from uxsim_geo.errors import InputError
from uxsim_geo.network.largest_part import keep_largest_part
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.projection import project, utm_zone
from uxsim_geo.network.pruning import drop_undrivable
from uxsim_geo.network.ready import make_ready
from uxsim_geo.network.ready_options import ReadyOptions
from uxsim_geo.network.u_turns import ban_u_turns

# ---- projection


@pytest.mark.parametrize(
    ("longitudes", "latitude", "zone"),
    [
        ([8.6, 8.8], 49.4, "EPSG:32632"),
        ([-8.7, -8.5], 41.2, "EPSG:32629"),
        ([-51.3, -51.1], -30.0, "EPSG:32722"),
        ([179.2, 179.9], -17.0, "EPSG:32760"),
        ([179.9, -179.2], -17.0, "EPSG:32701"),  # the middle lies beyond the meridian
        ([179.2, -179.9], -17.0, "EPSG:32760"),
        ([181.0, 182.0], 52.0, "EPSG:32601"),
        ([15.0, 16.0], 85.0, "EPSG:32661"),
        ([15.0, 16.0], -81.0, "EPSG:32761"),
        ([12.0, 12.0], 0.0, "EPSG:32633"),
    ],
)
def test_the_zone_around_the_middle(longitudes: list[float], latitude: float, zone: str) -> None:
    assert utm_zone(np.array([[x, latitude] for x in longitudes])) == zone


def island(west: float, east: float) -> Network:
    """Two nodes on the parallel of 16.8 degrees south, and the geodesic between them."""
    places = {"a": (west, -16.8), "b": (east, -16.8)}
    return drawn(places, [street("a", "b", length=21326.0)], crs="EPSG:4326")


@pytest.mark.parametrize(("west", "east"), [(179.9, -179.9), (8.9, 9.1), (-0.1, 0.1)])
def test_a_network_in_metres_is_as_long_as_its_geodesics(west: float, east: float) -> None:
    """0.2 degrees of that parallel are 21.3 km, across the 180th meridian too."""
    network = project(island(west, east), None, Notes())
    assert network.links.crs.axis_info[0].unit_name == "metre"
    assert network.links.crs == network.nodes.crs
    drawn_length = shapely.length(network.links["geometry"].to_numpy())
    assert drawn_length == pytest.approx(21326.0, rel=0.005)
    assert list(network.links["length"]) == [21326.0, 21326.0]
    ends = shapely.get_coordinates(network.nodes["geometry"].to_numpy())
    assert network.links["geometry"].iloc[0].coords[0] == tuple(ends[0])


def test_coordinates_are_whole_millimetres() -> None:
    network = project(island(8.9, 9.1), None, Notes())
    found = shapely.get_coordinates(network.nodes["geometry"].to_numpy())
    assert (found == np.round(found, 3)).all()


def test_metres_stay_and_other_units_go() -> None:
    metric = drawn({"a": (5e5, 5e6), "b": (5.001e5, 5e6)}, [street("a", "b")])
    assert project(metric, None, Notes()).links.crs == "EPSG:32632"
    assert project(metric, "EPSG:25832", Notes()).links.crs == "EPSG:25832"
    feet = drawn({"a": (1e6, 2e5), "b": (1.01e6, 2e5)}, [street("a", "b")], crs="EPSG:2263")
    assert project(feet, None, Notes()).links.crs == "EPSG:32618"


def test_without_geometry_or_system_nothing_happens() -> None:
    plain = plain_network([plain_link("1", "a", "b")])
    assert project(plain, None, Notes()) is plain
    unknown = drawn({"a": (0.0, 0.0), "b": (1.0, 0.0)}, [street("a", "b")], crs=None)
    assert project(unknown, None, Notes()) is unknown


def test_a_wide_network_is_warned_of() -> None:
    notes = Notes()
    project(island(0.0, 20.0), None, notes)
    assert "warning" in set(notes.table()["severity"])


# ---- what cannot be driven, and what does not hang together

SQUARE = {"a": (0.0, 0.0), "b": (100.0, 0.0), "c": (100.0, 100.0), "d": (0.0, 100.0)}
OUTER = {"x": (200.0, 0.0), "y": (300.0, 0.0), "z": (400.0, 0.0)}


def kept(network: Network, notes: Notes | None = None) -> set[str]:
    return set(keep_largest_part(network, notes or Notes()).links["link_id"])


def ring(*others: tuple[str, str, dict[str, object]], **more: object) -> Network:
    around = [road("a", "b"), road("b", "c"), road("c", "d"), road("d", "a")]
    return drawn(SQUARE | OUTER, [*around, *others], **more)


CIRCLE = {"a-b", "b-c", "c-d", "d-a"}


def test_undrivable_links_and_their_nodes_go() -> None:
    network = ring(
        street("b", "x"), road("x", "x"), road("x", "y", lanes=0), road("y", "z", free_speed=0.0)
    )
    network = drop_undrivable(network, (), Notes())
    assert set(network.links["link_id"]) == CIRCLE | {"b-x", "x-b"}
    assert set(network.nodes["node_id"]) == {"a", "b", "c", "d", "x"}
    classes = ring(street("b", "x", road_class="track"))
    assert set(drop_undrivable(classes, ("track",), Notes()).links["link_id"]) == CIRCLE


def test_what_leads_in_only_out_only_or_nowhere_falls_out_and_is_listed() -> None:
    notes = Notes()
    network = ring(road("b", "x"), road("y", "c"))
    assert kept(network, notes) == CIRCLE
    table = notes.table()
    told = table[table["topic"] == "fell out"]
    assert {"b-x", "y-c"} == set(told["element_id"].dropna())
    listed = told.set_index("element_id")["note"]
    assert "entered but not left" in listed["b-x"]
    assert "left but not entered" in listed["y-c"]
    assert "0.100 km" in listed["b-x"]


def test_the_part_with_the_most_lanes_is_kept() -> None:
    short_and_wide = [street("x", "y", lanes=4), street("y", "z", lanes=4)]
    assert kept(ring(*short_and_wide)) == {"x-y", "y-x", "y-z", "z-y"}
    narrow = [street("x", "y"), street("y", "z", length=50.0)]
    assert kept(ring(*narrow)) == CIRCLE


def test_a_street_that_only_a_banned_turn_leaves_falls_out() -> None:
    streets = [street("b", "x"), street("x", "y")]
    assert kept(ring(*streets)) == CIRCLE | {"b-x", "x-b", "x-y", "y-x"}
    closed = ["x-b b-c", "x-b b-x"]
    assert kept(ring(*streets, bans=closed)) == CIRCLE


def test_bans_of_what_fell_out_go() -> None:
    network = ring(road("b", "x"), bans=["a-b b-x", "a-b b-c c-d"])
    network = keep_largest_part(network, Notes())
    assert banned(network) == {"a-b b-c c-d"}


def test_centroids_keep_the_connectors_that_lead_in_or_out() -> None:
    network = ring(street("x", "b"), road("y", "c"), road("z", "y"))
    nodes = network.nodes
    nodes["through_traffic"] = ~nodes["node_id"].isin(["x", "y"])
    assert kept(replace(network, nodes=nodes)) == CIRCLE | {"x-b", "b-x", "y-c"}


def test_zones_keep_the_ways_from_them_in_and_to_them_out() -> None:
    """From x one only comes in, to z one only comes out; y is no zone."""
    roads = [road("x", "y"), road("y", "b"), road("c", "z"), road("y", "z")]
    assert kept(ring(*roads, zones={"x": "1", "z": "2"})) == CIRCLE | {"x-y", "y-b", "c-z"}
    assert kept(ring(*roads)) == CIRCLE
    network = ring(*roads)
    nodes = network.nodes
    nodes["destination_of"] = nodes["node_id"].map({"z": "2", "x": "1"})
    nodes["origin_of"] = None
    assert kept(replace(network, nodes=nodes)) == CIRCLE | {"c-z"}


def test_where_nothing_leads_back_everything_is_kept() -> None:
    notes = Notes()
    network = drawn(SQUARE, [road("a", "b"), road("b", "c"), road("a", "d"), road("d", "c")])
    assert len(kept(network, notes)) == 4
    assert set(notes.table()["severity"]) == {"warning"}


def test_unknown_lengths_and_speeds_are_no_hindrance() -> None:
    """An overrides table may bring them later. Around a link of unknown length nodes stay."""
    roads = [street("a", "b"), street("b", "x"), street("x", "c"), street("c", "a")]
    network = drawn(SQUARE | OUTER, roads)
    network.links.loc[2, ["length", "lanes"]] = float("nan")
    network.links["free_speed"] = float("nan")
    ready = make_ready(network, ReadyOptions())
    assert set(ready.nodes["node_id"]) == {"b", "x"}
    assert "not measured" in ready.notes["note"].str.cat()


def test_keeping_twice_changes_nothing() -> None:
    once = keep_largest_part(ring(road("b", "x"), street("c", "y")), Notes())
    twice = keep_largest_part(once, Notes())
    assert list(once.links["link_id"]) == list(twice.links["link_id"])


# ---- turning back

CROSS = {"m": (0.0, 0.0), "e": (90.0, 0.0), "n": (0.0, 90.0), "w": (-90.0, 0.0)}
ARMS = [street(name, "m") for name in "enw"]
BACK = {f"{name}-m m-{name}" for name in "enw"}


def test_turning_back_is_banned_at_signals_but_not_at_dead_ends() -> None:
    network = ban_u_turns(drawn(CROSS, ARMS, signals="me"), "signals", Notes())
    assert banned(network) == BACK
    assert set(network.movements["node_id"]) == {"m"}
    assert banned(ban_u_turns(drawn(CROSS, ARMS), "signals", Notes())) == set()
    assert banned(ban_u_turns(drawn(CROSS, ARMS, signals="m"), "nowhere", Notes())) == set()
    assert banned(ban_u_turns(drawn(CROSS, ARMS), "junctions", Notes())) == BACK


def test_turning_back_stays_open_where_nothing_else_does() -> None:
    """Of the three ways on from e, two are banned; the only way into n's street is from n."""
    bans = ["e-m m-n", "e-m m-w", "w-m m-n"]
    network = ban_u_turns(drawn(CROSS, ARMS, bans=bans), "junctions", Notes())
    assert banned(network) == {*bans, "w-m m-w"}


def test_turning_back_twice_is_banned_once() -> None:
    network = drawn(CROSS, ARMS, bans=["e-m m-e"])
    once = ban_u_turns(network, "junctions", Notes())
    assert len(once.movements) == 3
    assert len(ban_u_turns(once, "junctions", Notes()).movements) == 3


def test_two_roads_side_by_side_are_no_way_back() -> None:
    """From m to e and back over another road of another length."""
    arms = [road("m", "e"), road("e", "m", length=300.0), *ARMS[1:]]
    network = ban_u_turns(drawn(CROSS, arms), "junctions", Notes())
    assert banned(network) == {"n-m m-n", "w-m m-w"}


# ---- options


@pytest.mark.parametrize(
    "wrong",
    [
        {"crs": "EPSG:4326"},
        {"crs": "nonsense"},
        {"short_piece": -1.0},
        {"step": float("nan")},
        {"u_turns": "everywhere"},
        {"driving_side": "middle"},
        {"sampled_ways": -1},
    ],
)
def test_wrong_options_are_told(wrong: dict[str, object]) -> None:
    with pytest.raises(InputError, match=next(iter(wrong))):
        ReadyOptions(**wrong)  # type: ignore[arg-type]


def test_tables_that_do_not_fit_together_are_told_of() -> None:
    network = ring(street("b", "x"), bans=["b-x x-b"])
    movements = pd.concat([network.movements, network.movements, network.movements])
    movements["to_link_id"] = ["x-b", "nowhere", "c-d"]
    with pytest.raises(InputError) as told:
        make_ready(replace(network, movements=movements), ReadyOptions())
    assert "1 row has links that are not in the links (row 2)" in str(told.value)
    assert "1 row has links that do not lead to one another (row 3)" in str(told.value)
    links = network.links
    links.loc[0, "link_id"] = "b-c"
    links.loc[1, "to_node_id"] = "q"
    with pytest.raises(InputError) as told:
        make_ready(network, ReadyOptions())
    assert "the link_id of an earlier row (link_id b-c)" in str(told.value)
    assert "a to_node_id that is not in the nodes" in str(told.value)


def test_tables_keep_their_kind() -> None:
    network = keep_largest_part(ring(road("b", "x")), Notes())
    assert isinstance(network.links, geopandas.GeoDataFrame)
    assert isinstance(network.movements, pd.DataFrame)
    assert link(network, "a-b")["length"] == 100.0


def test_where_every_node_left_is_a_merged_junction_nothing_is_measured() -> None:
    # five junctions of two nodes each, 4 m apart, with a road from each to every other
    angle = np.radians(72 * np.arange(5))
    places, roads = {}, [street(f"{k}w", f"{k}e") for k in range(5)]
    for k, (x, y) in enumerate(zip(400 * np.cos(angle), 400 * np.sin(angle), strict=True)):
        places |= {
            f"{k}{side}": (500_000 + x + more, 5_400_000 + y)
            for side, more in (("w", -2), ("e", 2))
        }
        roads += [street(f"{k}e", f"{(k + step) % 5}w") for step in (1, 2)]
    ready = make_ready(drawn(places, roads), ReadyOptions())
    assert len(ready.nodes) == 5
    assert ready.nodes["merged_node_ids"].notna().all()
    told = ready.notes["note"][ready.notes["topic"] == "distortion"].tolist()
    assert "not measured: every node left is a merged junction" in told
