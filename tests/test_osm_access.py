"""Which ways become links, each on a road of its own that is named by its tags."""

from __future__ import annotations

import pandas as pd
from osm_files import noted, read_data

from uxsim_geo.network.osm_options import PUBLIC_ROADS, OsmOptions

KEPT = {
    "nothing",
    "access=yes",
    "access=permissive",
    "access=destination",
    "access=customers",
    "access=private;destination",
    "access=unheard_of",
    "access=;",
    "access=no & motor_vehicle=yes",
    "access=no & vehicle=yes",
    "access=no & motorcar=yes",
    "motor_vehicle=no & motorcar=designated",
    "vehicle=no & motor_vehicle=destination",
    "motor_vehicle=no & motor_vehicle:forward=yes",
    "motor_vehicle:conditional=no @ (22:00-06:00)",
    "area=no",
    "construction=minor",
    "highway=road",
    "bridge=yes & layer=1",
    "bridge=viaduct & layer=2",
    "tunnel=yes & layer=-1",
    "bridge=no",
    "layer=high",
    "layer=1;2",
    "layer=9",
}

PRIVATE = {"access=private", "access=delivery", "access=permit"}


def names(options: OsmOptions) -> set[str]:
    return set(read_data("access.osm", options).links["name"])


def test_public_roads_are_kept_and_nothing_else() -> None:
    assert names(OsmOptions()) == KEPT


def test_private_roads_on_demand() -> None:
    assert names(OsmOptions(private=True)) == KEPT | PRIVATE


def test_service_ways_and_tracks_on_demand() -> None:
    more = OsmOptions(road_classes=(*PUBLIC_ROADS, "service", "track"))
    service = {"highway=service", "highway=service & service=parking_aisle", "highway=track"}
    assert names(more) == KEPT | service


def test_one_class_alone() -> None:
    assert names(OsmOptions(road_classes=("road",))) == {"highway=road"}


def test_a_direction_may_be_open_alone() -> None:
    links = read_data("access.osm").links
    only = links[links["name"] == "motor_vehicle=no & motor_vehicle:forward=yes"]
    assert list(only["direction"]) == ["forward"]
    assert list(only["access"]) == ["yes"]


def test_bridges_tunnels_and_layers_are_kept() -> None:
    links = read_data("access.osm").links.drop_duplicates("name").set_index("name")
    assert links.loc["bridge=yes & layer=1", ["bridge", "layer"]].tolist() == ["yes", 1]
    assert links.loc["bridge=viaduct & layer=2", ["bridge", "layer"]].tolist() == ["viaduct", 2]
    assert links.loc["tunnel=yes & layer=-1", ["tunnel", "layer"]].tolist() == ["yes", -1]
    assert pd.isna(links.loc["bridge=no", "bridge"])
    assert links.loc["layer=high", "layer"] == 0
    assert noted(read_data("access.osm"), "unreadable layer") == ["high", "1;2", "9"]


def test_what_was_left_out_is_counted_by_reason() -> None:
    notes = read_data("access.osm").notes
    left = notes[notes["topic"] == "ways left out"]
    counts = {note.partition(":")[0]: int(value) for note, value in left[["note", "value"]].values}
    assert counts == {
        "area=yes": 1,
        "closed to cars": 8,
        "construction=yes": 1,
        "disused=yes": 1,
        "proposed=yes": 1,
        "highway=construction": 2,
        "highway=proposed": 2,
        "other road classes": 8,
        "private access": 3,
    }
