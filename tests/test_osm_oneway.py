"""Every form of one-way road, each on a road of its own that is named by its tags."""

from __future__ import annotations

import pytest
from osm_files import both_ways, noted, read_data

FORWARD, BACKWARD, BOTH = (True, False), (False, True), (True, True)

DIRECTIONS = {
    "nothing": BOTH,
    "oneway=yes": FORWARD,
    "oneway=true": FORWARD,
    "oneway=1": FORWARD,
    "oneway=no": BOTH,
    "oneway=-1": BACKWARD,
    "oneway=reverse": BACKWARD,
    "oneway=reversible": BOTH,
    "oneway=alternating": BOTH,
    "oneway=yes; no": BOTH,
    "junction=roundabout": FORWARD,
    "junction=circular": FORWARD,
    "junction=roundabout & oneway=no": BOTH,
    "junction=roundabout & oneway=-1": BACKWARD,
    "junction=jughandle": BOTH,
    "junction=spui": BOTH,
    "highway=motorway": FORWARD,
    "highway=motorway & oneway=no": BOTH,
    "highway=motorway & oneway=-1": BACKWARD,
    "highway=motorway_link": BOTH,
    "oneway=yes & oneway:motor_vehicle=no": BOTH,
    "oneway=no & oneway:motorcar=yes": FORWARD,
    "oneway=yes & oneway:bicycle=no": FORWARD,
    "oneway:bicycle=yes": BOTH,
    "motor_vehicle:backward=no": FORWARD,
    "vehicle:forward=no": BACKWARD,
    "access:backward=private": FORWARD,
    "oneway=yes & motor_vehicle:forward=no": (False, False),
}


@pytest.mark.parametrize("name", DIRECTIONS)
def test_directions_are_those_that_cars_may_drive_in(name: str) -> None:
    network = read_data("oneway.osm")
    found = tuple(value is not None for value in both_ways(network, name, "link_id"))
    assert found == DIRECTIONS[name]
    links = network.links[network.links["name"] == name]
    assert (links["oneway"] == (DIRECTIONS[name] != BOTH)).all()


def test_no_road_of_the_file_is_forgotten_here() -> None:
    named = set(read_data("oneway.osm").links["name"])
    assert named == {name for name, found in DIRECTIONS.items() if any(found)}


def test_links_against_the_drawing_run_from_its_end_to_its_start() -> None:
    links = read_data("oneway.osm").links.set_index("name")
    against = links.loc["oneway=-1"]
    assert against["link_id"] == "106:12-11"
    assert (against["from_node_id"], against["to_node_id"]) == ("12", "11")
    assert list(against["geometry"].coords) == [(8.001, 50.006), (8.0, 50.006)]
    assert against["source_node_ids"] == "12 11"


def test_what_changes_or_cannot_be_read_or_leads_nowhere_is_noted() -> None:
    network = read_data("oneway.osm")
    assert noted(network, "changing direction") == ["oneway=reversible", "oneway=alternating"]
    assert noted(network, "unreadable oneway") == ["oneway=yes; no"]
    assert noted(network, "way without links") == ["128"]
