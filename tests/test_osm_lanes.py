"""Lanes of each direction in every form, each on a road of its own that is named by its tags."""

from __future__ import annotations

import pytest
from osm_files import both_ways, noted, read_data

GIVEN, ASSUMED = "given", "assumed"

#: lanes forward and backward (None: no link), and whether each is given
LANES = {
    "nothing": (1, 1, ASSUMED, ASSUMED),
    "lanes=2": (1, 1, GIVEN, GIVEN),
    "lanes=4": (2, 2, GIVEN, GIVEN),
    "lanes=3": (2, 1, GIVEN, GIVEN),
    "lanes=5": (3, 2, GIVEN, GIVEN),
    "lanes=1": (1, 1, GIVEN, GIVEN),
    "lanes=2 & oneway=yes": (2, None, GIVEN, None),
    "lanes=3 & oneway=-1": (None, 3, None, GIVEN),
    "lanes=1 & oneway=yes": (1, None, GIVEN, None),
    "lanes=2 & junction=roundabout": (2, None, GIVEN, None),
    "lanes=3 & lanes:forward=2 & lanes:backward=1": (2, 1, GIVEN, GIVEN),
    "lanes=3 & lanes:forward=1": (1, 2, GIVEN, GIVEN),
    "lanes=3 & lanes:backward=1": (2, 1, GIVEN, GIVEN),
    "lanes:forward=2": (2, 1, GIVEN, ASSUMED),
    "lanes:backward=3": (1, 3, ASSUMED, GIVEN),
    "lanes:forward=2 & lanes:backward=1": (2, 1, GIVEN, GIVEN),
    "lanes=3 & lanes:both_ways=1": (1, 1, GIVEN, GIVEN),
    "lanes=5 & lanes:both_ways=1": (2, 2, GIVEN, GIVEN),
    "lanes=4 & lanes:both_ways=1": (2, 1, GIVEN, GIVEN),
    "lanes=5 & lanes:forward=2 & lanes:backward=2 & lanes:both_ways=1": (2, 2, GIVEN, GIVEN),
    "lanes=4 & lanes:forward=1 & lanes:backward=1": (1, 1, GIVEN, GIVEN),
    "lanes=2 & lanes:forward=2": (2, 1, GIVEN, GIVEN),
    "lanes=2 & lanes:forward=3": (3, 1, GIVEN, GIVEN),
    "lanes=1 & lanes:both_ways=1": (1, 1, GIVEN, GIVEN),
    "lanes=4 & turn:lanes:forward=left|through|right": (3, 1, GIVEN, GIVEN),
    "lanes=3 & turn:lanes:backward=left|through": (1, 2, GIVEN, GIVEN),
    "lanes=2 & turn:lanes:forward=left|through|right": (1, 1, GIVEN, GIVEN),
    "turn:lanes=left|through & oneway=yes": (1, None, ASSUMED, None),
    "lanes=3 & lanes:backward=1 & oneway=yes": (2, None, GIVEN, None),
    "lanes=3 & lanes:forward=2 & oneway=yes": (2, None, GIVEN, None),
    "lanes=2 & lanes:backward=2 & oneway=-1": (None, 2, None, GIVEN),
    "lanes=2;3": (1, 1, GIVEN, GIVEN),
    "lanes=1.5": (1, 1, GIVEN, GIVEN),
    "lanes=2.0": (1, 1, GIVEN, GIVEN),
    "lanes=none": (1, 1, ASSUMED, ASSUMED),
    "lanes=-2": (1, 1, ASSUMED, ASSUMED),
    "lanes=0": (1, 1, GIVEN, GIVEN),
    "lanes=99": (1, 1, ASSUMED, ASSUMED),
    "lanes=two": (1, 1, ASSUMED, ASSUMED),
    "lanes=2 & oneway=alternating": (1, 1, GIVEN, GIVEN),
    "lanes=4 & oneway=reversible": (2, 2, GIVEN, GIVEN),
    "lanes=0 & oneway=yes": (1, None, GIVEN, None),
    "highway=motorway": (2, None, ASSUMED, None),
    "highway=motorway & lanes=3": (3, None, GIVEN, None),
    "lanes=2 & lanes:conditional=1 @ (Su)": (1, 1, GIVEN, GIVEN),
}


@pytest.mark.parametrize("name", LANES)
def test_lanes_of_each_direction(name: str) -> None:
    network = read_data("lanes.osm")
    lanes = both_ways(network, name, "lanes")
    sources = both_ways(network, name, "lanes_source")
    assert (*lanes, *sources) == LANES[name]


def test_no_road_of_the_file_is_forgotten_here() -> None:
    assert set(read_data("lanes.osm").links["name"]) == set(LANES)


def test_what_contradicts_itself_or_cannot_be_meant_is_noted() -> None:
    network = read_data("lanes.osm")
    assert noted(network, "contradictory lanes") == [
        "lanes=4 lanes:forward=1 lanes:backward=1",
        "lanes=2 lanes:forward=2",
        "lanes=2 lanes:forward=3",
        "lanes=3 lanes:forward=2",
    ]
    assert noted(network, "odd lanes") == ["lanes=3", "lanes=5", "lanes=4 lanes:both_ways=1"]
    assert noted(network, "shared lane")[0] == "lanes=1"
    assert noted(network, "several lanes") == ["lanes=2;3", "lanes=1.5"]
    assert len(noted(network, "unreadable lanes")) == 4


def test_shares_of_what_is_assumed_are_noted_by_class() -> None:
    network = read_data("lanes.osm")
    links = network.links
    residential = links[links["road_class"] == "residential"]
    share = (residential["lanes_source"] == "assumed").mean()
    assert noted(network, "lanes assumed") == ["0.5", f"{share:.6g}"]


def test_turn_lanes_are_kept_by_direction() -> None:
    network = read_data("lanes.osm")
    name = "lanes=4 & turn:lanes:forward=left|through|right"
    forward, backward = both_ways(network, name, "turn_lanes")
    assert forward == "left|through|right"
    assert backward != backward  # null
    oneway = both_ways(network, "turn:lanes=left|through & oneway=yes", "turn_lanes")
    assert oneway == ("left|through", None)
