"""Where ways are cut, how long the pieces are, and what their ids and nodes are."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from osm_files import node as node_at
from osm_files import noted, read, read_data, restriction, topics
from osm_files import way as way_over
from pyproj import Geod

from uxsim_geo.network.check import check_network
from uxsim_geo.network.network import LINK_COLUMNS, NODE_COLUMNS
from uxsim_geo.network.osm_links import OWN_LINK_COLUMNS
from uxsim_geo.network.osm_options import OsmOptions


def ends(name: str, file: str = "shapes.osm") -> list[str]:
    """Ids without the way's of the links forward along a road."""
    links = read_data(file).links
    found = links[(links["name"] == name) & (links["direction"] == "forward")]
    return [link_id.partition(":")[2] for link_id in found["link_id"]]


def test_a_roundabout_is_cut_at_its_arms_and_goes_round_one_way() -> None:
    assert ends("roundabout") == ["1-2", "2-4", "4-1"]
    links = read_data("shapes.osm").links
    round_it = links[links["name"] == "roundabout"]
    assert len(round_it) == 3
    assert round_it["oneway"].all()
    assert set(round_it["junction"]) == {"roundabout"}
    assert list(round_it["source_node_ids"]) == ["1 2", "2 3 4", "4 1"]


def test_a_loop_at_the_end_of_a_street_is_a_link_to_its_own_node() -> None:
    links = read_data("shapes.osm").links
    ids = list(links["link_id"][links["name"] == "street with a loop"])
    assert ids == ["200:21-22", "200:22-21", "200:22-22", "200:22-22:2"]
    assert ends("ring") == ["31-31"]
    loops = noted(read_data("shapes.osm"), "self-loop")
    assert len(loops) == 5  # of the street and the knot in both directions


def test_a_way_is_cut_where_it_crosses_itself() -> None:
    assert ends("knot") == ["41-42", "42-42", "42-45"]
    links = read_data("shapes.osm").links
    along = links["source_node_ids"][links["link_id"] == "400:42-42"]
    assert list(along) == ["42 43 44 42"]


def test_inner_nodes_are_kept_in_the_geometry_and_cut_nothing() -> None:
    network = read_data("shapes.osm")
    assert ends("curve") == ["51-53"]
    curve = network.links.set_index("link_id").loc["500:51-53"]
    assert list(curve["geometry"].coords) == [(0.0, 0.04), (0.001, 0.041), (0.002, 0.04)]
    assert curve["source_node_ids"] == "51 52 53"
    assert "52" not in set(network.nodes["node_id"])
    back = network.links.set_index("link_id").loc["500:53-51"]
    assert list(back["geometry"].coords) == list(curve["geometry"].coords)[::-1]
    assert ends("straight") == ["71-73"]  # a footway meets it between


def test_a_way_over_the_same_nodes_again_has_ids_of_its_own() -> None:
    links = read_data("shapes.osm").links
    ids = list(links["link_id"][links["name"] == "out and back"])
    assert ids == ["600:61-62", "600:62-61", "600:62-61:2", "600:61-62:2"]


def test_lengths_are_those_of_the_ellipsoid() -> None:
    """A degree of the equator is a radius of 6,378,137 m times π/180."""
    links = read_data("shapes.osm").links.set_index("link_id")
    degree = 6_378_137.0 * np.pi / 180.0
    assert links.loc["101:11-1", "length"] == pytest.approx(0.0016 * degree, rel=1e-9)
    by_geometry = [Geod(ellps="WGS84").geometry_length(line) for line in links["geometry"]]
    assert links["length"].to_numpy() == pytest.approx(by_geometry, rel=1e-9)


def test_the_180th_meridian_and_the_pole_are_no_borders() -> None:
    links = read_data("edges.osm").links.set_index("name")
    line = links.loc["date line"].iloc[0]
    degree = 6_378_137.0 * np.pi / 180.0 * np.cos(np.radians(16.8))
    assert line["length"] == pytest.approx(0.003 * degree, rel=1e-3)
    assert [x for x, _ in line["geometry"].coords] == [179.999, -179.999, -179.998]
    pole = links.loc["over the pole"].iloc[0]
    assert pole["length"] == pytest.approx(0.2 * 111_694, rel=1e-3)  # a degree of latitude there


def test_ways_are_cut_where_the_file_lacks_nodes() -> None:
    network = read_data("edges.osm")
    assert ends("with gaps", "edges.osm") == ["21-22", "23-24"]
    missing = network.notes[network.notes["topic"] == "missing nodes"]
    with_links = missing[missing["element_id"].notna()]
    assert with_links[["element_id", "value"]].values.tolist() == [["120:21-22", "4"]]
    without = missing[missing["element_id"].isna()]
    assert [(note.split()[1], value) for note, value in without[["note", "value"]].values] == [
        ("121", "2")
    ]
    assert set(missing["severity"]) == {"warning"}
    assert noted(network, "way without links") == ["121", "150", "151"]


def test_ids_may_be_negative_or_of_64_bits_and_deleted_elements_are_not_there() -> None:
    network = read_data("edges.osm")
    ids = list(network.links["link_id"])
    assert ids[:2] == ["-130:-1--2", "-130:-2--1"]  # sorted by number
    large = "9000000000000000003:9000000000000000001-9000000000000000002"
    assert ids[-2] == large
    assert "deleted" not in set(network.links["name"])
    assert list(network.nodes["node_id"])[:2] == ["-2", "-1"]


def test_nodes_at_one_place_are_told_apart_by_a_small_length() -> None:
    network = read_data("edges.osm")
    short = network.links[network.links["name"] == "of no length"]
    assert list(short["length"]) == [0.1, 0.1]
    assert topics(network)["length assumed"] == 2


@pytest.mark.parametrize("file", ["shapes.osm", "edges.osm", "lanes.osm", "speeds.osm"])
def test_tables_are_fit_to_be_simulated(file: str) -> None:
    network = read_data(file)
    check_network(replace(network, movements=network.movements[:0]))
    assert list(network.nodes.columns[:5]) == [*NODE_COLUMNS, "geometry"]
    assert list(network.links.columns) == [*LINK_COLUMNS, "geometry", *OWN_LINK_COLUMNS]
    assert network.nodes.crs == network.links.crs == "EPSG:4326"
    assert network.links["capacity"].isna().all()
    used = {*network.links["from_node_id"], *network.links["to_node_id"]}
    assert set(network.nodes["node_id"]) == used


def test_ways_are_cut_at_the_place_of_a_restriction(tmp_path: Path) -> None:
    """Node 2 lies within way 10 alone, and is cut since nobody may turn round there."""
    nodes = [node_at(number, number, 0) for number in (1, 2, 3)]
    street = way_over(10, [1, 2, 3])
    assert len(read(tmp_path, *nodes, street).links) == 2
    no_turning = restriction(5, "no_u_turn", "from w10 via n2 to w10")
    network = read(tmp_path, *nodes, street, no_turning)
    assert len(network.links) == 4
    pairs = set(
        zip(network.movements["from_link_id"], network.movements["to_link_id"], strict=True)
    )
    assert pairs == {("10:1-2", "10:2-1"), ("10:3-2", "10:2-3")}


def test_where_one_drives_on_the_left_directions_and_lanes_are_as_drawn() -> None:
    """South of the equator, clockwise round: nothing is turned about, and the side is noted."""
    network = read_data("left_hand.osm", OsmOptions(country="AU"))
    assert ends("clockwise", "left_hand.osm") == ["12-13", "13-14", "14-12"]
    assert ends("eastward", "left_hand.osm") == ["3-12"]
    assert ends("westward", "left_hand.osm") == ["14-1"]
    links = network.links
    carriageways = links[links["name"].isin(["eastward", "westward"])]
    assert carriageways["oneway"].all()
    assert set(carriageways["lanes"]) == {2}
    single = links[links["name"] == "single"].set_index("direction")
    assert single["lanes"].to_dict() == {"forward": 1, "backward": 2}
    assert single["turn_lanes"].to_dict() == {"forward": "through", "backward": "left|through"}
    assert noted(network, "driving side") == ["left"]
    assert noted(read_data("left_hand.osm"), "driving side") == ["right"]  # of no country


def test_ends_at_which_a_path_goes_on_or_nothing_does_are_marked(tmp_path: Path) -> None:
    elements = [
        *(node_at(number, number, 0.0) for number in (1, 2)),
        node_at(3, 3.0, 0.0, {"noexit": "yes"}),
        node_at(4, 1.0, 1.0),
        node_at(5, 1.0, 2.0),
        way_over(10, [1, 2, 3]),
        way_over(11, [2, 4]),
        way_over(12, [4, 5], {"highway": "steps"}),
    ]
    network = read(tmp_path, *elements)
    beyond = dict(zip(network.nodes["node_id"], network.nodes["beyond"].fillna(""), strict=True))
    assert beyond == {"1": "", "2": "", "3": "noexit", "4": "other way"}
    turned = read(tmp_path, *reversed(elements))
    pd.testing.assert_frame_equal(network.nodes, turned.nodes)
    assert list(network.links["source_id"].unique()) == ["10", "11"]
