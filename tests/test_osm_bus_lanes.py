"""Lanes that are not for cars, in every form, each on a road that is named by its tags."""

from __future__ import annotations

import pytest
from osm_files import both_ways, noted, read_data

from uxsim_geo.network.osm_options import OsmOptions

#: lanes of cars forward and backward (None: no link)
LANES = {
    "nothing": (1, 1),
    "lanes=3 & lanes:psv=1 & oneway=yes": (2, None),
    "lanes=3 & lanes:bus=1 & oneway=yes": (2, None),
    "lanes=3 & lanes:bus=1 & lanes:psv=1 & oneway=yes": (2, None),  # the same lane
    "lanes=1 & lanes:psv=1 & oneway=yes": (1, None),  # one is kept
    "lanes:psv=1 & oneway=yes": (1, None),  # assumed lanes are those of cars
    "lanes=3 & lanes:bus=2 & oneway=-1": (None, 1),
    "lanes=4 & lanes:psv=2": (1, 1),
    "lanes=3 & lanes:psv=1": (1, 1),  # where there are more lanes
    "lanes=4 & lanes:bus=1": (1, 2),  # forward, which is not said
    "lanes=3 & lanes:psv:forward=1": (1, 1),
    "lanes=4 & lanes:bus:backward=1": (2, 1),
    "lanes=3 & lanes:forward=2 & lanes:backward=1 & lanes:bus:backward=1": (2, 1),  # one is kept
    "lanes=3 & lanes:bus:backward=1 & oneway=yes": (2, None),  # against the traffic
    "lanes=3 & lanes:forward=2 & lanes:backward=1 & lanes:psv:backward=1 & oneway=yes": (2, None),
    "lanes=3 & lanes:backward=1 & lanes:psv=1 & oneway=yes": (2, None),
    "lanes=3 & bus:lanes=yes|yes|designated & oneway=yes": (2, None),
    "lanes=3 & psv:lanes=designated|| & oneway=yes": (2, None),
    "lanes=3 & bus:lanes=no|no|yes & oneway=yes": (3, None),
    "lanes=2 & bus:lanes=designated|yes & psv:lanes=designated|yes & oneway=yes": (1, None),
    "lanes=3 & bus:lanes=yes|designated|designated & lanes:bus=1 & oneway=yes": (1, None),
    "lanes=4 & bus:lanes:forward=yes|designated": (1, 2),
    "lanes=4 & bus:lanes:forward=yes|designated & bus:lanes:backward=|designated": (1, 1),
    "lanes=3 & bus:lanes=yes|yes|designated & vehicle:lanes=yes|yes|no & oneway=yes": (2, None),
    "lanes=2 & bus:lanes=yes|designated & vehicle:lanes=yes|yes & oneway=yes": (2, None),
    "lanes=3 & access:lanes=yes|yes|no & oneway=yes": (2, None),
    "lanes=3 & access:lanes=psv|yes|yes & oneway=yes": (2, None),
    "lanes=3 & access:lanes=||no & oneway=yes": (2, None),
    "lanes=3 & access:lanes=no|no|yes & motor_vehicle:lanes=|yes| & oneway=yes": (2, None),
    # a lane of bicycles is in the list and not among the lanes
    "lanes=2 & vehicle:lanes=yes|yes|no & bicycle:lanes=|no|designated & oneway=yes": (2, None),
    "lanes=2 & vehicle:lanes=yes|no|no & bus:lanes=yes|designated|no & oneway=yes": (1, None),
    "lanes=2 & bus:lanes=yes|designated|no & oneway=yes": (1, None),
    "lanes=4 & motor_vehicle:lanes:backward=yes|no": (2, 1),
    "lanes=4 & access:lanes=yes|no & oneway=yes": (3, None),
    "lanes=1 & access:lanes=no & oneway=yes": (1, None),
    "lanes=2 & hov:lanes=|designated & oneway=yes": (2, None),
    "lanes=2 & bus:lanes=|designated": (1, 1),  # says nothing of a direction
    "lanes=2 & lanes:bus:conditional=1 @ (Mo-Fr 07:00-09:00) & oneway=yes": (2, None),
    "lanes=2 & access:lanes=yes|private & oneway=yes": (1, None),
    "lanes=2 & lanes:psv=many & oneway=yes": (2, None),
}

#: where lanes of buses are shared, those above that differ
SHARED = {
    "lanes=3 & lanes:psv=1 & oneway=yes": (3, None),
    "lanes=4 & lanes:psv=2": (2, 2),
    "lanes=3 & bus:lanes=yes|yes|designated & oneway=yes": (3, None),
    "lanes=3 & bus:lanes=yes|yes|designated & vehicle:lanes=yes|yes|no & oneway=yes": (2, None),
    "lanes=3 & access:lanes=psv|yes|yes & oneway=yes": (2, None),
}


@pytest.mark.parametrize("name", LANES)
def test_lanes_of_cars(name: str) -> None:
    assert both_ways(read_data("bus_lanes.osm"), name, "lanes") == LANES[name]


@pytest.mark.parametrize("name", SHARED)
def test_lanes_of_buses_may_be_shared_but_none_that_is_closed(name: str) -> None:
    network = read_data("bus_lanes.osm", OsmOptions(bus_lanes="shared"))
    assert both_ways(network, name, "lanes") == SHARED[name]


def test_private_lanes_on_demand() -> None:
    network = read_data("bus_lanes.osm", OsmOptions(private=True))
    name = "lanes=2 & access:lanes=yes|private & oneway=yes"
    assert both_ways(network, name, "lanes") == (2, None)


def test_no_road_of_the_file_is_forgotten_here() -> None:
    assert set(read_data("bus_lanes.osm").links["name"]) == set(LANES)


def test_what_is_left_out_is_noted_road_by_road() -> None:
    network = read_data("bus_lanes.osm")
    told = noted(network, "reserved lanes")
    assert told[0] == "lanes=3 lanes:psv=1"
    assert len(told) == 26
    assert noted(network, "no lane for cars") == [
        "lanes=1 lanes:psv=1",
        "lanes=3 lanes:forward=2 lanes:backward=1 lanes:bus:backward=1",
        "lanes=1 access:lanes=no",
    ]
    assert noted(network, "conditional tag") == ["1"]
