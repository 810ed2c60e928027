"""The tables of what is assumed: shipped, one's own laid over them, and what is wrong in those."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import pytest
from osm_files import both_ways, node, read, read_data, way

from uxsim_geo.errors import InputError
from uxsim_geo.network.driving_side import LEFT
from uxsim_geo.network.note_words import note_in_words
from uxsim_geo.network.osm import read_osm_network
from uxsim_geo.network.osm_defaults import read_defaults
from uxsim_geo.network.osm_options import ROAD_CLASSES, OsmOptions

CLASSES = "country,road_class,speed,lanes,merge_priority\n"
ZONES = "country,zone,speed\n"


def own_classes(folder: Path, rows: str, country: str = "default") -> OsmOptions:
    path = folder / "classes.csv"
    path.write_text(CLASSES + rows, encoding="utf-8")
    return OsmOptions(class_table=path, country=country)


def own_zones(folder: Path, rows: str) -> OsmOptions:
    path = folder / "zones.csv"
    path.write_text(ZONES + rows, encoding="utf-8")
    return OsmOptions(zone_table=path)


@pytest.mark.parametrize("road_class", ROAD_CLASSES)
def test_the_default_rows_are_complete_and_sensible(road_class: str) -> None:
    defaults = read_defaults(OsmOptions())
    assert 10 / 3.6 <= defaults.speed("default", road_class) <= 130 / 3.6
    assert defaults.lanes("default", road_class) in (1, 2)
    assert 0 < defaults.merge_priority("default", road_class) <= 10


def test_larger_roads_go_first_where_links_meet() -> None:
    defaults = read_defaults(OsmOptions())
    names = ("motorway", "trunk", "primary", "secondary", "tertiary", "unclassified", "residential")
    weights = [defaults.merge_priority("default", name) for name in names]
    assert weights == sorted(set(weights), reverse=True)


def test_a_carriageway_of_a_wide_road_has_more_lanes_than_one_direction_of_a_narrow_one(
    tmp_path: Path,
) -> None:
    defaults = read_defaults(OsmOptions())
    assert defaults.lanes("default", "secondary") == 1
    assert defaults.lanes("default", "secondary", oneway=True) == 2
    assert defaults.lanes("default", "residential", oneway=True) == 1
    assert defaults.lanes("BR", "primary", oneway=True) == 3
    own = tmp_path / "own.csv"
    own.write_text("country,road_class,lanes\ndefault,secondary,4\n", encoding="utf-8")
    more = read_defaults(OsmOptions(class_table=own))
    assert more.lanes("default", "secondary", oneway=True) == 4
    own.write_text("country,road_class,lanes\nDE,primary,1\n", encoding="utf-8")
    fewer = read_defaults(OsmOptions(class_table=own))
    assert fewer.lanes("DE", "primary", oneway=True) == 1
    assert fewer.lanes("FR", "primary", oneway=True) == 2  # shipped


def test_roundabouts_are_no_carriageways(tmp_path: Path) -> None:
    network = read(
        tmp_path,
        *(node(number, float(number), float(number % 2)) for number in (1, 2, 3, 4)),
        way(10, [1, 2], {"highway": "secondary", "oneway": "yes"}),
        way(11, [2, 3, 4, 2], {"highway": "secondary", "junction": "roundabout"}),
        way(12, [3, 1], {"highway": "secondary"}),
    )
    lanes = network.links.groupby("source_id")["lanes"].unique()
    assert [list(lanes[number]) for number in ("10", "11", "12")] == [[2], [1], [1]]
    assert set(network.links["lanes_source"]) == {"assumed"}


def test_own_rows_go_before_the_shipped_ones_cell_by_cell(tmp_path: Path) -> None:
    options = own_classes(tmp_path, "default,residential,20 mph,2,\nDE,motorway,,4,\n")
    defaults = read_defaults(options)
    assert defaults.speed("default", "residential") == pytest.approx(20 * 0.44704)
    assert defaults.lanes("FR", "residential") == 2
    assert defaults.merge_priority("default", "residential") == 1.0  # shipped
    assert defaults.lanes("DE", "motorway") == 4
    assert defaults.speed("DE", "motorway") == pytest.approx(130 / 3.6)  # shipped
    assert defaults.lanes("default", "motorway") == 2
    network = read_osm_network(Path(__file__).parent / "data" / "osm" / "lanes.osm", options)
    assert both_ways(network, "nothing", "lanes") == (2, 2)
    assert both_ways(network, "nothing", "merge_priority") == (1.0, 1.0)


def test_a_country_of_ones_own(tmp_path: Path) -> None:
    options = own_classes(tmp_path, "ZZ,residential,25,,\n", country="ZZ")
    network = read(tmp_path, node(1, 0, 0), node(2, 1, 0), way(10, [1, 2]), options=options)
    assert network.links["free_speed"].tolist() == pytest.approx([25 / 3.6] * 2)


def test_own_zones(tmp_path: Path) -> None:
    defaults = read_defaults(
        own_zones(tmp_path, "DE,urban,40\nDE,City Centre,15\ndefault,none,100\n")
    )
    assert defaults.zone("DE", "urban") == pytest.approx(40 / 3.6)
    assert defaults.zone("DE", "city centre") == pytest.approx(15 / 3.6)
    assert defaults.zone("FR", "urban") == pytest.approx(50 / 3.6)
    assert defaults.zone("DE", "none") == pytest.approx(100 / 3.6)
    assert defaults.zone("DE", "nowhere") is None


#: countries of the measured files and those that analysts ask for most
COUNTRIES = (
    *("AD", "AR", "AT", "AU", "BE", "BR", "CA", "CH", "CL", "CN", "CO", "CZ", "DE", "DK", "ES"),
    *("FI", "FR", "GB", "GR", "HR", "HU", "IE", "IL", "IN", "IT", "JP", "KR", "LU", "MC", "MX"),
    *("NL", "NO", "NZ", "PL", "PT", "RO", "RS", "SE", "SG", "SI", "SK", "TH", "TR", "US", "ZA"),
)

#: km/h of zones that were looked up one by one: laws of the countries, see docs/networks.md
LOOKED_UP = {
    ("AT", "rural"): 100,
    ("BE-BRU", "urban"): 30,
    ("BR", "rural"): 100,
    ("CH", "rural"): 80,
    ("DK", "living_street"): 15,
    ("ES", "urban"): 30,
    ("FI", "rural"): 80,
    ("FR", "rural"): 80,
    ("GB-WLS", "nsl_restricted"): 20 * 1.609344,
    ("IE", "rural"): 60,
    ("MC", "urban"): 50,
    ("PL", "trunk"): 120,
    ("RS", "motorway"): 130,
    ("TR", "motorway"): 130,
    ("US-OR", "rural"): 55 * 1.609344,
    ("ZA", "urban"): 60,
}


@pytest.mark.parametrize("country", COUNTRIES)
def test_countries_are_known_with_speeds_that_go_together(country: str) -> None:
    defaults = read_defaults(OsmOptions(country=country))
    speeds = {zone: defaults.zone(country, zone) or 0.0 for zone in ("urban", "rural", "motorway")}
    assert 0 < speeds["urban"] <= speeds["rural"] <= speeds["motorway"]
    assert defaults.speed(country, "residential") <= 50 / 3.6 + 1e-9
    assert defaults.speed(country, "residential") <= defaults.speed(country, "primary")


@pytest.mark.parametrize("road_class", ["motorway", "living_street"])
def test_classes_that_are_zones_have_their_speeds(road_class: str) -> None:
    defaults = read_defaults(OsmOptions())
    zones = {key[0]: speed for key, speed in defaults.zones.items() if key[1] == road_class}
    classes = {
        key[0]: speed
        for key, speed in defaults.classes.items()
        if key[1:] == (road_class, "speed") and key[0] != "default"
    }
    assert set(zones) - {"default"} <= set(classes)
    assert all(zones.get(country, speed) == speed for country, speed in classes.items())


@pytest.mark.parametrize("place", LOOKED_UP)
def test_speeds_of_the_law(place: tuple[str, str]) -> None:
    found = read_defaults(OsmOptions()).zone(*place)
    assert found == pytest.approx(LOOKED_UP[place] / 3.6)


@pytest.mark.parametrize(
    ("country", "told", "side"),
    [
        ("default", None, "right"),
        ("DE", None, "right"),
        ("GB", None, "left"),
        ("UK", None, "left"),
        ("GB-WLS", None, "left"),
        ("AU-WA", None, "left"),
        ("JP", None, "left"),
        ("IE", None, "left"),
        ("US", None, "right"),
        ("VI", None, "left"),
        ("GB", "right", "right"),
        ("default", "left", "left"),
    ],
)
def test_the_side_is_that_of_the_country_unless_told(
    country: str, told: Literal["right", "left"] | None, side: str
) -> None:
    assert OsmOptions(country=country, driving_side=told).side == side


def test_as_many_countries_drive_on_the_left_as_lists_have() -> None:
    assert len(LEFT - {"UK"}) == 75
    assert all(len(code) == 2 for code in LEFT)


def test_merge_priorities_are_those_of_the_class() -> None:
    links = read_data("shapes.osm").links
    assert set(links["merge_priority"][links["road_class"] == "tertiary"]) == {3.0}
    assert set(links["merge_priority"][links["road_class"] == "residential"]) == {1.0}


@pytest.mark.parametrize(
    ("rows", "why"),
    [
        ("default,street,50,1,1\n", "street"),
        ("default,residential,fast,1,1\n", "must be a speed"),
        ("default,residential,0,1,1\n", "must be a speed"),
        ("default,residential,30;50,1,1\n", "must be a speed"),
        ("default,residential,30,1.5,1\n", "must be a whole number"),
        ("default,residential,30,0,1\n", "must be a whole number"),
        ("default,residential,30,inf,1\n", "must be a whole number"),
        ("default,residential,30,1,nan\n", "must be above 0"),
        ("default,residential,30,1,-1\n", "must be above 0"),
        ("default,residential,30,1\n", "4 values under 5 names"),
        (",residential,30,1,1\n", "must name a country"),
        ("DE,residential,30,1,1\n" * 2, "more than once"),
        ("GB,residential,30,1,1\nUK,residential,30,1,1\n", "more than once"),
        ('"DE,residential\n', "is not a CSV table"),
    ],
)
def test_faults_of_own_tables_are_told_with_their_line(tmp_path: Path, rows: str, why: str) -> None:
    with pytest.raises(InputError, match=why) as raised:
        read_defaults(own_classes(tmp_path, rows))
    assert all(fault.line for fault in raised.value.faults)


def test_all_faults_are_told_at_once(tmp_path: Path) -> None:
    rows = "default,street,50,1,1\ndefault,residential,fast,0,-1\n"
    with pytest.raises(InputError) as raised:
        read_defaults(own_classes(tmp_path, rows, country="QQ"))
    assert len(raised.value.faults) == 5


@pytest.mark.parametrize("content", ["", "country;road_class;speed\n", "a,b\n1,2\n", "\0"])
def test_tables_that_are_none_are_told(tmp_path: Path, content: str) -> None:
    path = tmp_path / "classes.csv"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(InputError):
        read_defaults(OsmOptions(class_table=path))
    with pytest.raises(InputError, match="no such file"):
        read_defaults(OsmOptions(zone_table=tmp_path / "absent.csv"))


@pytest.mark.parametrize(
    "changes",
    [
        {"road_classes": ()},
        {"road_classes": ("motorway", "footway")},
        {"driving_side": "middle"},
        {"barriers": "closed"},
        {"bus_lanes": None},
        {"jam_density": 0.0},
        {"signal_distance": float("nan")},
        {"max_unpacked_mb": -1.0},
    ],
)
def test_options_that_mean_nothing_are_refused(changes: dict[str, object]) -> None:
    with pytest.raises(InputError, match=next(iter(changes))):
        OsmOptions(**changes)  # type: ignore[arg-type]


@pytest.mark.parametrize(("country", "near"), [("ATLANTIS", "AT"), ("de", "DE"), ("Germany", "GE")])
def test_an_unknown_country_is_told_how_to_write_one(country: str, near: str) -> None:
    with pytest.raises(InputError, match=rf"as DE or BR: .*{near}.*{country}"):
        read_defaults(OsmOptions(country=country))


def whose(folder: Path, options: OsmOptions) -> tuple[str, str]:
    """Severity and words of what is said of the defaults of a street without any tags."""
    street = (node(1, 0, 0), node(2, 1, 0), way(10, [1, 2]))
    notes = read(folder, *street, options=options).notes
    (told,) = notes[notes["topic"] == "country"].to_dict("records")
    return told["severity"], note_in_words(told["note"], told["value"])


def test_it_is_told_whose_speeds_and_lanes_are_assumed(tmp_path: Path) -> None:
    severity, words = whose(tmp_path, OsmOptions())
    assert severity == "warning"
    assert words.startswith("no country is given, as DE: ")
    assert words.endswith("of no country in particular (100.0 % of the links)")
    severity, words = whose(tmp_path, OsmOptions(country="DE"))
    assert severity == "info"
    assert words == (
        "speeds and lanes that the file lacks are those usual in DE (100.0 % of the links)"
    )
    assert whose(tmp_path, OsmOptions(country="US-TX"))[0] == "info"


@pytest.mark.parametrize(
    ("region", "told"),
    [
        ("US-TY", "are those of US; regions with rows: US-WY, US-VT, US-TX, US-AL, US-AR, ... ("),
        ("BE-VLX", "are those of BE; regions with rows: BE-VLG, BE-WAL, BE-BRU ("),
        ("DE-BY", "that the file lacks are those of DE (100.0 %"),
    ],
)
def test_a_region_without_rows_falls_back_and_says_so(
    tmp_path: Path, region: str, told: str
) -> None:
    severity, words = whose(tmp_path, OsmOptions(country=region))
    assert severity == "warning"
    assert f"no table has a row of the region {region}" in words
    assert told in words


def test_where_nothing_is_assumed_nothing_is_said_of_a_country(tmp_path: Path) -> None:
    tags = {"highway": "residential", "maxspeed": "30", "lanes": "2"}
    network = read(tmp_path, node(1, 0, 0), node(2, 1, 0), way(10, [1, 2], tags))
    assert "country" not in set(network.notes["topic"])


def test_options_reach_the_tables(tmp_path: Path) -> None:
    street = (node(1, 0, 0), node(2, 1, 0), way(10, [1, 2]))
    network = read(tmp_path, *street, options=OsmOptions(jam_density=0.15, driving_side="left"))
    assert set(network.links["jam_density"]) == {0.15}
    notes = network.notes.set_index("topic")["value"]
    assert notes["driving side"] == "left"


def test_progress_is_told_from_nothing_to_all() -> None:
    told: list[tuple[str, float]] = []
    path = Path(__file__).parent / "data" / "osm" / "lanes.osm"
    read_osm_network(path, OsmOptions(), progress=lambda what, share: told.append((what, share)))
    shares = [share for _, share in told]
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (0.0, 1.0)
