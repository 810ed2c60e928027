"""Speed limits in every form, each on a road of its own that is named by its tags."""

from __future__ import annotations

import pytest
from osm_files import both_ways, noted, read_data

from uxsim_geo.network.network import Network
from uxsim_geo.network.osm_options import OsmOptions

MPH, KNOT = 1.609344, 1.852
GIVEN, ASSUMED = "given", "assumed"

#: of residential roads in the shipped table
RESIDENTIAL = (30.0, ASSUMED)

#: km/h, and whether it is given; of both directions
SPEEDS = {
    "nothing": RESIDENTIAL,
    "maxspeed=50": (50.0, GIVEN),
    "maxspeed=50 km/h": (50.0, GIVEN),
    "maxspeed=50 kmh": (50.0, GIVEN),
    "maxspeed=30 mph": (30 * MPH, GIVEN),
    "maxspeed=30mph": (30 * MPH, GIVEN),
    "maxspeed=10 knots": (10 * KNOT, GIVEN),
    "maxspeed=12.5": (12.5, GIVEN),
    "maxspeed=12,5": (12.5, GIVEN),
    "maxspeed=35 mph;40 mph": (35 * MPH, GIVEN),
    "maxspeed=80|60": (60.0, GIVEN),
    "maxspeed=50;signals": (50.0, GIVEN),
    "maxspeed=walk": (7.0, ASSUMED),
    "maxspeed=none": (130.0, ASSUMED),
    "maxspeed=signals": RESIDENTIAL,
    "maxspeed=variable": RESIDENTIAL,
    "maxspeed=unposted": RESIDENTIAL,
    "maxspeed=DE:urban": (50.0, ASSUMED),
    "maxspeed=de:rural": (100.0, ASSUMED),
    "maxspeed=RO:motorway": (130.0, ASSUMED),
    "maxspeed=RO:trunk": (100.0, ASSUMED),
    "maxspeed=DE:living_street": (7.0, ASSUMED),
    "maxspeed=DE:zone30": (30.0, GIVEN),
    "maxspeed=AT:zone:30": (30.0, GIVEN),
    "maxspeed=DE:30": (30.0, GIVEN),
    "maxspeed=GB:zone20": (20 * MPH, GIVEN),
    "maxspeed=GB:nsl_single": (60 * MPH, ASSUMED),
    "maxspeed=UK:nsl_dual": (70 * MPH, ASSUMED),
    "maxspeed=BE-VLG:rural": (70.0, ASSUMED),
    "maxspeed=BE-WAL:motorway": (120.0, ASSUMED),
    "maxspeed=XX:urban": (50.0, ASSUMED),
    "maxspeed=XX:nonsense": RESIDENTIAL,
    "maxspeed=urban": (50.0, ASSUMED),
    "maxspeed=national": RESIDENTIAL,
    "maxspeed:type=DE:rural": (100.0, ASSUMED),
    "source:maxspeed=FR:urban": (50.0, ASSUMED),
    "zone:maxspeed=DE:20": (20.0, GIVEN),
    "zone:traffic=DE:urban": (50.0, ASSUMED),
    "maxspeed:source=GB:nsl_restricted": (30 * MPH, ASSUMED),
    "source:maxspeed=sign": RESIDENTIAL,
    "maxspeed=signals & maxspeed:type=DE:motorway": (130.0, ASSUMED),
    "maxspeed=40 & maxspeed:type=DE:rural": (40.0, GIVEN),
    "maxspeed=5000": RESIDENTIAL,
    "maxspeed=0": RESIDENTIAL,
    "maxspeed=fast": RESIDENTIAL,
    "maxspeed=-50": RESIDENTIAL,
    "maxspeed=1e2": RESIDENTIAL,
    "maxspeed=５０": RESIDENTIAL,  # digits that are none here
    "maxspeed=100 & maxspeed:conditional=60 @ (22:00-06:00)": (100.0, GIVEN),
    "maxspeed=40 & maxspeed:lanes=40|60": (40.0, GIVEN),
    "highway=living_street": (10.0, ASSUMED),
}

#: km/h and source forward, then backward
BY_DIRECTION = {
    "maxspeed:forward=30 & maxspeed:backward=50": ((30.0, GIVEN), (50.0, GIVEN)),
    "maxspeed=60 & maxspeed:backward=40": ((60.0, GIVEN), (40.0, GIVEN)),
    "maxspeed:forward=70": ((70.0, GIVEN), RESIDENTIAL),
}


def speeds(network: Network, name: str) -> list[tuple[object, object]]:
    """km/h and source, forward and backward."""
    sources = both_ways(network, name, "free_speed_source")
    values = both_ways(network, name, "free_speed")
    return [(value, source) for value, source in zip(values, sources, strict=True)]


@pytest.mark.parametrize("name", [*SPEEDS, *BY_DIRECTION])
def test_speed_of_each_direction(name: str) -> None:
    expected = BY_DIRECTION[name] if name in BY_DIRECTION else (SPEEDS[name], SPEEDS[name])
    for (value, source), (speed_kmh, known) in zip(
        speeds(read_data("speeds.osm"), name), expected, strict=True
    ):
        assert value == pytest.approx(speed_kmh / 3.6, rel=1e-12)
        assert source == known


def test_no_road_of_the_file_is_forgotten_here() -> None:
    named = set(read_data("speeds.osm").links["name"])
    assert named == {*SPEEDS, *BY_DIRECTION, "highway=motorway"}


@pytest.mark.parametrize(
    ("country", "name", "speed_kmh"),
    [
        ("default", "highway=motorway", 110.0),
        ("DE", "highway=motorway", 130.0),
        ("US", "highway=motorway", 65 * MPH),
        ("UK", "highway=motorway", 70 * MPH),
        ("DE", "highway=living_street", 7.0),
        ("US", "nothing", 25 * MPH),
        ("DE", "nothing", 30.0),  # that of default
        ("US", "maxspeed=urban", 25 * MPH),
        ("GB", "maxspeed=national", 60 * MPH),
        ("US", "maxspeed=DE:urban", 50.0),
        ("BE-BRU", "maxspeed=urban", 30.0),
    ],
)
def test_the_country_says_what_is_assumed(country: str, name: str, speed_kmh: float) -> None:
    network = read_data("speeds.osm", OsmOptions(country=country))
    value, source = speeds(network, name)[0]
    assert value == pytest.approx(speed_kmh / 3.6, rel=1e-12)
    assert source == "assumed"


def test_the_basis_names_the_tag_or_the_class() -> None:
    network = read_data("speeds.osm")
    basis = dict(network.links[["name", "free_speed_basis"]].itertuples(index=False))
    assert basis["nothing"] == "class residential"
    assert basis["maxspeed=50"] == "maxspeed"
    assert basis["maxspeed=DE:urban"] == "maxspeed=DE:urban"
    assert basis["source:maxspeed=FR:urban"] == "source:maxspeed=FR:urban"


def test_what_is_unusual_is_noted_once_a_way() -> None:
    network = read_data("speeds.osm")
    assert noted(network, "several speed limits") == ["maxspeed=35 mph;40 mph", "maxspeed=80|60"]
    assert noted(network, "implausible speed limit") == ["maxspeed=5000", "maxspeed=0"]
    assert len(noted(network, "speed limit without number")) == 5
    assert len(noted(network, "unreadable speed limit")) == 5
    assert noted(network, "conditional tag") == ["1"]
