"""Doubtful spots: each kind in a small network that has it, and beside it one that just has not."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from road_tables import Road, drawn, road, shuffled, street
from shapely import LineString, MultiLineString

from uxsim_geo.network import doubts
from uxsim_geo.network.doubts import CONNECTIONS, DOUBTS, note_doubts
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes


def noted(network: Network) -> pd.DataFrame:
    notes = Notes()
    note_doubts(network, notes)
    return notes.table()


def doubted(network: Network, topic: str) -> dict[str, str]:
    """Values by element of the doubts of a topic."""
    table = noted(network)
    found = table[table["topic"] == topic]
    assert set(found["severity"]) <= {"doubt"}
    return dict(zip(found["element_id"], found["value"], strict=True))


def avenue(length: float, *pieces: dict[str, Any], bend: float = 0.0) -> Network:
    """A one-way road of three pieces, the middle one so long."""
    ends = {
        "a": (0.0, 0.0),
        "b": (300.0, 0.0),
        "c": (300.0 + length, 0.0),
        "d": (600.0 + length, bend),
    }
    common = {"name": "Avenue", "road_class": "primary"}
    roads = [
        road(start, end, **{**common, **values})
        for start, end, values in zip("abc", "bcd", pieces, strict=True)
    ]
    return drawn(ends, roads)


ASSUMED_LANES = {"lanes": 1, "lanes_source": "assumed"}


@pytest.mark.parametrize(
    ("length", "pieces", "told"),
    [
        (99.0, ({"lanes": 2}, {"lanes": 1}, {"lanes": 3}), "2-1-3 lanes"),
        (101.0, ({"lanes": 2}, {"lanes": 1}, {"lanes": 3}), None),  # long enough to be meant
        (99.0, ({"lanes": 1}, {"lanes": 1}, {"lanes": 3}), None),  # as wide as before
        (99.0, ({"lanes": 1}, {"lanes": 2}, {"lanes": 1}), None),  # wider
        (400.0, ({"lanes": 2}, ASSUMED_LANES, {"lanes": 2}), "2-1-2 lanes"),
        (400.0, ({"lanes": 2, "lanes_source": "assumed"}, ASSUMED_LANES, {"lanes": 2}), None),
        (99.0, ({"lanes": 2}, {"lanes": 1, "name": "Other"}, {"lanes": 2}), None),
        (99.0, ({"lanes": 2}, {"lanes": 1, "road_class": "trunk"}, {"lanes": 2}), None),
    ],
)
def test_a_narrow_piece(length: float, pieces: tuple[Any, ...], told: str | None) -> None:
    found = doubted(avenue(length, *pieces), "doubtful narrow piece")
    assert found == ({} if told is None else {"b-c": told})


def test_lanes_for_turning_are_no_narrow_piece_behind_the_junction() -> None:
    network = avenue(99.0, {"lanes": 3}, {"lanes": 2}, {"lanes": 3})
    for turning in ("a-b", "c-d"):
        marked = np.where(network.links["link_id"] == turning, "left|through|right", None)
        links = network.links.assign(turn_lanes=pd.Series(marked, dtype="str"))
        assert doubted(replace(network, links=links), "doubtful narrow piece") == {}


@pytest.mark.parametrize(
    ("pieces", "told"),
    [
        (({"lanes": 1}, {"lanes": 3}, {"lanes": 3}), {"a-b": "1-3 lanes"}),
        (({"lanes": 3}, {"lanes": 3}, {"lanes": 1}), {"b-c": "3-1 lanes"}),
        (({"lanes": 1}, {"lanes": 2}, {"lanes": 3}), {}),
        ((ASSUMED_LANES, {"lanes": 3}, {"lanes": 3}), {"a-b": "1-3 lanes"}),
    ],
)
def test_lanes_that_jump(pieces: tuple[Any, ...], told: dict[str, str]) -> None:
    assert doubted(avenue(200.0, *pieces), "doubtful lanes") == told


def test_given_lanes_may_widen_shortly_before_a_junction() -> None:
    short = avenue(140.0, {"lanes": 1}, {"lanes": 3}, {"lanes": 2})
    assert doubted(short, "doubtful lanes") == {}
    assumed = avenue(140.0, ASSUMED_LANES, {"lanes": 3}, {"lanes": 2})
    assert doubted(assumed, "doubtful lanes") == {"a-b": "1-3 lanes"}
    turning = pd.Series([None, "left|through|right", None], dtype="str")
    marked = replace(assumed, links=assumed.links.assign(turn_lanes=turning))
    assert doubted(marked, "doubtful lanes") == {}


def test_given_lanes_that_another_road_takes_or_brings_are_no_jump() -> None:
    places = {"a": (0.0, 0.0), "b": (300.0, 0.0), "c": (600.0, 0.0), "x": (600.0, 120.0)}
    motorway = {"name": "M", "road_class": "motorway"}
    wide, narrow = {**motorway, "lanes": 4}, {**motorway, "lanes": 2}
    ramp = {"road_class": "motorway_link"}
    leaves = [road("a", "b", **wide), road("b", "c", **narrow), road("b", "x", lanes=2, **ramp)]
    assert doubted(drawn(places, leaves), "doubtful lanes") == {}
    assert doubted(drawn(places, leaves[:2]), "doubtful lanes") == {"a-b": "4-2 lanes"}
    joins = [road("c", "b", **narrow), road("b", "a", **wide), road("x", "b", lanes=2, **ramp)]
    assert doubted(drawn(places, joins), "doubtful lanes") == {}
    assert doubted(drawn(places, joins[:2]), "doubtful lanes") == {"c-b": "2-4 lanes"}


def speeds(*values: float, source: str = "given") -> list[dict[str, Any]]:
    """Pieces with speeds in km/h; the middle one of a source."""
    pieces = [{"free_speed": value / 3.6} for value in values]
    pieces[1] |= {"free_speed_source": source}
    return pieces


@pytest.mark.parametrize(
    ("length", "values", "source", "told"),
    [
        (200.0, (50, 90, 50), "given", "50-90-50 km/h"),
        (200.0, (50, 89, 50), "given", None),
        (200.0, (50, 90, 60), "given", None),  # one side is near
        (200.0, (60, 30, 60), "given", "60-30-60 km/h"),
        (600.0, (50, 100, 50), "given", None),  # between villages
        (600.0, (30, 50, 30), "assumed", "30-50-30 km/h"),
        (600.0, (30, 41, 30), "assumed", None),
        (200.0, (30, 40, 50), "assumed", None),  # from slow to fast
    ],
)
def test_a_speed_far_from_that_of_the_road(
    length: float, values: tuple[float, ...], source: str, told: str | None
) -> None:
    found = doubted(avenue(length, *speeds(*values, source=source)), "doubtful speed")
    assert found == ({} if told is None else {"b-c": told})


def test_a_speed_between_assumed_ones_is_no_doubt() -> None:
    pieces = speeds(50, 100, 50)
    pieces[2] |= {"free_speed_source": "assumed"}
    assert doubted(avenue(200.0, *pieces), "doubtful speed") == {}


@pytest.mark.parametrize(("capacity", "found"), [(0.49, {"b-c"}), (0.51, set()), (np.nan, set())])
def test_a_capacity_far_below_that_of_the_road(capacity: float, found: set[str]) -> None:
    pieces = [{"capacity": value} for value in (1.0, capacity, 1.2)]
    network = avenue(300.0, *pieces)
    told = doubted(network, "doubtful capacity")
    assert set(told) == found
    assert set(told.values()) <= {"3600-1764-4320 veh/h"}


def test_a_road_that_turns_off_or_may_not_be_followed_is_not_the_same() -> None:
    pieces = speeds(50, 100, 50)
    assert doubted(avenue(200.0, *pieces, bend=250.0), "doubtful speed")  # 40 degrees
    assert not doubted(avenue(200.0, *pieces, bend=330.0), "doubtful speed")  # 48 degrees
    network = avenue(200.0, *pieces)
    ban = pd.DataFrame([("c", "b-c", "c-d")], columns=["node_id", "from_link_id", "to_link_id"])
    assert not doubted(replace(network, movements=ban.astype("str")), "doubtful speed")


def test_the_straightest_of_several_goes_on_and_none_of_two_alike() -> None:
    places = {"a": (0.0, 0.0), "b": (300.0, 0.0), "c": (500.0, 0.0), "d": (700.0, 0.0)}
    places |= {"e": (500.0, 60.0), "f": (500.0, -60.0)}
    same = {"name": "Avenue"}
    fast = {**same, "free_speed": 30.0}
    straight = [road("a", "b", **same), road("b", "c", **fast), road("c", "d", **same)]
    fork = [*straight, road("b", "e", **same)]
    assert set(doubted(drawn(places, fork), "doubtful speed")) == {"b-c"}
    even = [road("a", "b", **same), road("b", "e", **fast), road("b", "f", **fast)]
    even += [road("e", "d", **same), road("f", "d", **same)]
    assert doubted(drawn(places, even), "doubtful speed") == {}


def test_joined_roads_are_known_by_one_of_their_names() -> None:
    pieces = speeds(50, 100, 50)
    for piece, name in zip(pieces, ("A; B", "B", "C; B"), strict=True):
        piece["name"] = name
    assert set(doubted(avenue(200.0, *pieces), "doubtful speed")) == {"b-c"}
    pieces[2]["name"] = "C; Bb"
    assert doubted(avenue(200.0, *pieces), "doubtful speed") == {}


def gap(metres: float, *more: Road, **street_values: Any) -> Network:
    """A street from the south that ends so far before a cross road, joined 1 km further on."""
    places = {
        "west": (-500.0, 0.0),
        "east": (500.0, 0.0),
        "south": (0.0, -500.0),
        "end": (0.0, -metres),
        "corner": (500.0, -500.0),
    }
    roads = [
        street("west", "east", name="Cross"),
        street("south", "end", **{"name": "Street", **street_values}),
        street("south", "corner"),
        street("corner", "east"),
    ]
    return drawn(places, [*roads, *more])


DEAD_END = "doubtful dead end"


def test_a_street_that_ends_before_another() -> None:
    assert doubted(gap(6.0), DEAD_END) == {"end": "6.0 m to east-west"}
    assert doubted(gap(10.0), DEAD_END) == {"end": "10.0 m to east-west"}
    assert doubted(gap(10.5), DEAD_END) == {}


def test_a_street_that_ends_before_one_of_its_own_name_may_be_further() -> None:
    assert set(doubted(gap(19.0, name="Cross"), DEAD_END)) == {"end"}
    assert doubted(gap(20.5, name="Cross"), DEAD_END) == {}


def test_a_street_beside_the_end_is_not_ahead() -> None:
    places = {"a": (0.0, 0.0), "b": (0.0, 300.0), "far": (900.0, 0.0), "c": (6.0, -400.0)}
    places |= {"d": (6.0, 700.0)}
    roads = [street("a", "b"), street("a", "far"), street("far", "c"), street("c", "d")]
    assert doubted(drawn(places, roads), DEAD_END) == {}


@pytest.mark.parametrize(("side", "found"), [(50.0, set()), (52.0, {"end"})])
def test_a_place_that_a_short_way_leads_to_is_connected(side: float, found: set[str]) -> None:
    places = {"west": (-500.0, 0.0), "mid": (side, 0.0), "corner": (side, -side)}
    places |= {"south": (0.0, -side), "end": (0.0, -3.0), "root": (0.0, -900.0)}
    roads = [street("west", "mid"), street("mid", "corner"), street("corner", "south")]
    roads += [street("south", "end"), street("root", "south")]
    # round three sides of a square and back along the road: 4 side - 3 m, 200 m at most
    assert set(doubted(drawn(places, roads), DEAD_END)) == found


@pytest.mark.parametrize(
    ("link_id", "column", "value"),
    [
        ("south-end", "tunnel", "yes"),
        ("west-east", "bridge", "yes"),
        ("west-east", "layer", 1),
        ("west-east", "road_class", "motorway"),
    ],
)
def test_roads_that_streets_cannot_be_joined_to(link_id: str, column: str, value: Any) -> None:
    network = gap(6.0)
    one, other = link_id.split("-")
    rows = network.links["link_id"].isin([link_id, f"{other}-{one}"])
    before = network.links[column] if column in network.links else pd.Series([None] * len(rows))
    links = network.links.assign(**{column: before.astype(object).where(~rows, value)})
    assert set(doubted(network, DEAD_END)) == {"end"}
    assert doubted(replace(network, links=links), DEAD_END) == {}


@pytest.mark.parametrize("column", ["barrier", "highway", "beyond"])
def test_an_end_with_a_known_reason_is_meant(column: str) -> None:
    network = gap(6.0)
    told = pd.Series([None] * len(network.nodes), dtype="str")
    assert set(doubted(with_node(network, column, told), DEAD_END)) == {"end"}
    told[network.nodes["node_id"] == "end"] = "reason"
    assert doubted(with_node(network, column, told), DEAD_END) == {}


def with_node(network: Network, column: str, values: pd.Series) -> Network:
    return replace(network, nodes=network.nodes.assign(**{column: values}))


def test_degrees_are_measured_in_metres() -> None:
    network = gap(6.0)
    nodes, links = (table.to_crs("EPSG:4326") for table in (network.nodes, network.links))
    (value,) = doubted(replace(network, nodes=nodes, links=links), DEAD_END).values()
    assert value == "6.0 m to east-west"


def test_without_known_places_the_connections_alone_are_told() -> None:
    network = gap(6.0)
    unknown = replace(
        network,
        nodes=network.nodes.set_crs(None, allow_override=True),
        links=network.links.set_crs(None, allow_override=True),
    )
    plain = Network(
        pd.DataFrame(network.nodes.drop(columns="geometry")),
        pd.DataFrame(network.links.drop(columns="geometry")),
    )
    for one in (unknown, plain):
        assert set(noted(one)["topic"]) == {CONNECTIONS}


def test_missing_numbers_are_no_doubts_and_no_errors() -> None:
    network = gap(6.0)
    lacking = network.links.assign(lanes=np.nan, free_speed=np.nan, length=np.nan)
    assert set(noted(replace(network, links=lacking))["topic"]) == {CONNECTIONS}
    none = replace(network, links=network.links.iloc[:0])
    assert set(noted(none)["topic"]) == {CONNECTIONS}


def test_how_links_hang_together() -> None:
    places = {"a": (0.0, 0.0), "b": (300.0, 0.0), "c": (300.0, 100.0)}
    table = noted(drawn(places, [street("a", "b"), road("b", "c")]))
    (row,) = table[table["topic"] == CONNECTIONS].to_dict("records")
    assert row["note"].startswith("2 parts in which every link leads to every other")
    assert float(row["value"]) == pytest.approx(600 / 700, abs=1e-6)


def test_doubts_beyond_number_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    places = {
        f"{side}{row}": (300.0 * k, 500.0 * row)
        for row in range(5)
        for k, side in enumerate("abcd")
    }
    odd = {"free_speed": 30.0}
    roads = []
    for row in range(5):
        for start, end, values in (("a", "b", {}), ("b", "c", odd), ("c", "d", {})):
            roads.append(road(f"{start}{row}", f"{end}{row}", name=f"{row}", **values))
    network = drawn(places, roads)
    assert len(doubted(network, "doubtful speed")) == 5
    monkeypatch.setattr(doubts, "MOST_SINGLE_NOTES", 3)
    table = noted(network)
    found = table[table["topic"] == "doubtful speed"]
    assert list(found["element_id"].fillna("")) == ["b0-c0", "b1-c1", "b2-c2", ""]
    assert list(found["value"])[-1] == "2"
    assert set(found["severity"]) == {"doubt"}


def test_doubts_do_not_hang_on_the_order_of_rows() -> None:
    network = gap(6.0, *[street("south", "west", name="Street", lanes=3)])
    tables = [
        noted(one).sort_values(["topic", "element_id"], ignore_index=True)
        for one in (network, *(shuffled(network, seed) for seed in range(3)))
    ]
    for table in tables[1:]:
        pd.testing.assert_frame_equal(tables[0], table)


def test_every_topic_is_told_apart() -> None:
    assert len(set(DOUBTS)) == 5


def odd_geometry() -> dict[str, Any]:
    """Geometry that is no line, by what it is."""
    return {
        "missing": None,
        "empty": LineString(),
        "in parts": MultiLineString([[(0, 0), (1, 1)], [(5, 5), (6, 6)]]),
    }


@pytest.mark.parametrize("kind", sorted(odd_geometry()))
def test_where_a_link_is_no_line_the_connections_alone_are_told(kind: str) -> None:
    network = gap(6.0)
    lines = network.links["geometry"].to_numpy().copy()
    lines[2] = odd_geometry()[kind]
    links = network.links.set_geometry(lines, crs=network.links.crs)
    table = noted(replace(network, links=links))
    assert set(table["topic"]) == {CONNECTIONS}


def test_tables_that_do_not_hang_together_are_left_to_the_check() -> None:
    network = gap(6.0)
    twice = pd.concat([network.links, network.links], ignore_index=True)
    unknown = network.links.assign(to_node_id=network.links["to_node_id"].replace("end", "?"))
    for links in (twice, unknown):
        assert noted(replace(network, links=links)).empty


def test_a_network_around_the_world_is_no_error() -> None:
    places = {"a": (0.0, 0.0), "b": (1.0, 1.0), "c": (179.0, 0.0), "d": (-120.0, 80.0)}
    roads = [street("a", "b"), street("b", "c"), street("c", "d")]
    table = noted(drawn(places, roads, crs="EPSG:4326"))
    assert set(table["topic"]) == {CONNECTIONS}


def test_a_street_that_ends_on_another_without_a_node_there() -> None:
    assert doubted(gap(0.0), DEAD_END) == {"end": "0.0 m to east-west"}
