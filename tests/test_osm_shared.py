"""Every measured file: what the network holds agrees with counts made plainly from the file."""

from __future__ import annotations

import csv
import re
from collections import Counter, defaultdict
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pandas as pd
import pytest
from osm_raw import Raw, is_oneway, is_shut, read_raw

from uxsim_geo.network.check import check_network
from uxsim_geo.network.network import Network
from uxsim_geo.network.osm import read_osm_network
from uxsim_geo.network.osm_options import OsmOptions

FILES = (
    "West-Oakland.osm.bz2",
    "andorra.osm.pbf",
    "bad-hersfeld.osm.xml.gz",
    "bautzen.osm",
    "beatty.osm",
    "campo-grande.osm.gz",
    "heidelberg.osm.pbf",
    "helsinki.osm.pbf",
    "monaco-latest.osm.pbf",
    "moorgate.osm.pbf",
    "o2s_fremantle_placement.osm",
    "o2s_leeds_cycleway.osm",
    "o2s_perth_peanut_roundabout.osm",
    "o2s_tiny_roundabout.osm",
    "otp_columbus.osm.pbf",
    "portland-central-filtered.osm.pbf",
    "porto-alegre.osm.pbf",
    "porto_portugal.osm.pbf",
    "reisterstown-via-restriction.osm.pbf",
    "sao-paulo-centro.osm.pbf",
)


@pytest.fixture(scope="module", params=FILES)
def both(request: pytest.FixtureRequest, shared: Path) -> tuple[Network, Raw]:
    """The network of a file and the plain file."""
    path = shared / "data" / "osm" / request.param
    return read_osm_network(path, OsmOptions()), read_raw(path)


def roads(network: Network) -> pd.DataFrame:
    """One row a piece of road: its link forward, or its only link."""
    links = network.links
    return links[(links["direction"] == "forward") | links["oneway"]]


def test_no_file_is_forgotten_here(shared: Path) -> None:
    there = {path.name for path in (shared / "data" / "osm").iterdir() if ".osm" in path.name}
    assert there == set(FILES)


def test_the_network_is_fit_to_be_simulated(both: tuple[Network, Raw]) -> None:
    network, _ = both
    check_network(replace(network, movements=network.movements[:0]))
    assert (network.links["lanes"] >= 1).all()
    assert network.links["free_speed"].between(1 / 3.6, 70.0).all()


def test_km_of_each_class(both: tuple[Network, Raw]) -> None:
    network, raw = both
    found = roads(network).groupby("road_class")["length"].sum() / 1000.0
    for road_class, length_km in raw.km_by_class.items():
        assert found.get(road_class, 0.0) == pytest.approx(length_km, rel=0.01, abs=1e-3)
    assert set(found.index) <= set(raw.km_by_class)


def test_km_of_oneway_roads(both: tuple[Network, Raw]) -> None:
    network, raw = both
    links = network.links
    found = links["length"][links["oneway"]].sum() / 1000.0
    expected = sum(raw.km(way) for way, (_, tags) in raw.ways.items() if is_oneway(tags))
    assert found == pytest.approx(expected, rel=0.01, abs=1e-3)


def test_every_piece_of_road_is_in_one_link_of_its_direction(both: tuple[Network, Raw]) -> None:
    network, raw = both
    found: Counter[tuple[str, int, int]] = Counter()
    for way, along in roads(network)[["source_id", "source_node_ids"]].values:
        nodes = [int(node) for node in along.split()]
        found.update((way, *sorted(pair)) for pair in pairwise(nodes))
    expected: Counter[tuple[str, int, int]] = Counter()
    for way in raw.ways:
        expected.update((str(way), *sorted(pair)) for pair in raw.pieces(way))
    assert found == expected


def test_links_meet_where_roads_do(both: tuple[Network, Raw]) -> None:
    """A node with other than two neighbours is an end of links wherever a road comes to it."""
    network, raw = both
    junctions = {str(n) for n, others in raw.neighbours.items() if len(others) != 2}
    assert junctions <= set(network.nodes["node_id"])
    inner = network.links["source_node_ids"].str.split().map(lambda nodes: nodes[1:-1])
    assert junctions.isdisjoint(node for nodes in inner for node in nodes)


def test_signals(both: tuple[Network, Raw]) -> None:
    network, raw = both
    neighbours = raw.neighbours
    on_roads = {
        node
        for node, tags in raw.node_tags.items()
        if tags["highway"] == "traffic_signals" and node in neighbours
    }
    sources = network.nodes["signal_node_ids"].dropna().str.split().explode()
    notes = network.notes
    left = set(notes["element_id"][notes["topic"] == "signal at no junction"])
    assert {*sources, *left} == {str(node) for node in on_roads}
    assert len(sources) + len(left) == len(on_roads)
    own = {n for n, found in network.nodes[["node_id", "signal_node_ids"]].dropna().values}
    at_junctions = {str(node) for node in on_roads if len(neighbours[node]) >= 3}
    assert at_junctions <= own
    assert at_junctions <= set(sources)
    assert ((network.nodes["control"] == "signal") == network.nodes["node_id"].isin(own)).all()


def of_relations(network: Network) -> pd.DataFrame:
    """The movements that turn restrictions ban, and not barriers."""
    return network.movements[network.movements["restriction"] != "barrier"]


def test_barriers(both: tuple[Network, Raw]) -> None:
    """Nobody passes those that keep cars out, within a road; nothing else is closed by one."""
    network, raw = both
    within = {node for node in raw.barriers if len(raw.neighbours.get(node, ())) == 2}
    shut = {str(node) for node in within if is_shut(raw.barriers[node])}
    barred = network.movements[network.movements["restriction"] == "barrier"]
    assert set(barred["node_id"]) <= shut
    assert set(barred["source_id"]) <= shut
    banned = set(zip(*network.movements[["from_link_id", "to_link_id"]].T.values, strict=True))
    links = network.links[["link_id", "from_node_id", "to_node_id", "source_node_ids"]]
    told = set(network.notes["element_id"][network.notes["topic"] == "barrier"])
    for node in shut:
        arriving = links[links["to_node_id"] == node]
        leaving = links[links["from_node_id"] == node]
        assert set(arriving["link_id"]) <= told
        for before, _, _, along in arriving.values:
            for after, _, _, onward in leaving.values:
                back = along.split()[::-1] == onward.split()
                assert ((before, after) in banned) != back
    inner = links["source_node_ids"].str.split().map(lambda nodes: nodes[1:-1])
    assert shut.isdisjoint(node for nodes in inner for node in nodes)


def test_every_restriction_is_applied_or_told_of(both: tuple[Network, Raw]) -> None:
    network, raw = both
    applied = {int(n) for ids in of_relations(network)["source_id"] for n in ids.split()}
    notes = network.notes
    told = {
        topic: {int(value) for value in found}
        for topic, found in notes.groupby("topic")["value"]
        if topic in ("broken restriction", "conditional restriction")
    }
    broken, conditional = (
        told.get(f"{what} restriction", set()) for what in ("broken", "conditional")
    )
    counted = notes["topic"].isin(
        [
            "restriction of other vehicles",
            "restriction excepts cars",
            "restriction on other roads",
            "restriction without effect",
        ]
    )
    assert applied.isdisjoint(broken)
    number = len(applied | broken | conditional) + notes["value"][counted].astype(int).sum()
    assert number == len(raw.relations)
    for ids, kind in of_relations(network)[["source_id", "restriction"]].values:
        assert kind in [raw.relations[int(n)][0].get("restriction") for n in ids.split()]


def test_simple_restrictions_of_each_kind(both: tuple[Network, Raw]) -> None:
    """Those over a node between two ways that end there, as most are: the very turns."""
    network, raw = both
    links = network.links.set_index("link_id")
    table = of_relations(network)
    way_of = links["source_id"].astype("int64")
    found: Counter[tuple[int, int, int]] = Counter(
        zip(
            table["node_id"].astype("int64"),
            table["from_link_id"].map(way_of),
            table["to_link_id"].map(way_of),
            strict=True,
        )
    )
    banned_by = {number for ids in table["source_id"] for number in ids.split()}
    for relation, (tags, members) in raw.relations.items():
        turn = simple_turn(tags, members, raw)
        if turn is None:
            continue
        assert str(relation) in banned_by
        if tags["restriction"].startswith("no_"):
            assert found[turn] == 1
        else:
            node, start, end = turn
            rows = table[[str(relation) in ids.split() for ids in table["source_id"]]]
            assert set(rows["node_id"]) == {str(node)}
            assert set(rows["from_link_id"].map(way_of)) == {start}
            assert end not in set(rows["to_link_id"].map(way_of)) - {start}
            leaving = links[links["from_node_id"] == str(node)]
            assert len(rows) == len(leaving) - 1


def simple_turn(
    tags: dict[str, str], members: list[tuple[str, int, str]], raw: Raw
) -> tuple[int, int, int] | None:
    """Node, way from, way to of a restriction on two twoway roads that end at its node."""
    roles = [(type_, role) for type_, _, role in members]
    if sorted(roles) != [("n", "via"), ("w", "from"), ("w", "to")]:
        return None
    if {*tags} & {"except", "day_on", "hour_on"} or tags.get("type") != "restriction":
        return None
    if not re.fullmatch(
        "(no|only)_(left|right)_turn|(no|only)_straight_on", tags.get("restriction", "")
    ):
        return None
    refs = {role: ref for _, ref, role in members}
    start, node, end = refs["from"], refs["via"], refs["to"]
    for way in (start, end):
        if way not in raw.ways or is_oneway(raw.ways[way][1]):
            return None
        nodes = raw.ways[way][0]
        if (nodes[0] == node) == (nodes[-1] == node) or node in nodes[1:-1]:
            return None
    neighbours = {
        b for way in (start, end) for pair in raw.pieces(way) for b in pair if node in pair
    }
    return (node, start, end) if start != end and len(neighbours) == 3 else None


def test_restrictions_of_each_kind(both: tuple[Network, Raw]) -> None:
    """Of every kind no fewer are applied than are plain, nor more than there are."""
    network, raw = both
    table = of_relations(network)
    kind_of = {
        int(number): kind
        for ids, kind in table[["source_id", "restriction"]].values
        if len(numbers := ids.split()) == 1
        for number in numbers
    }
    kinds = Counter(tags.get("restriction") for tags, _ in raw.relations.values())
    assert Counter(kind_of.values()) <= kinds
    several = {int(n) for ids in table["source_id"] for n in ids.split()} - set(kind_of)
    applied = Counter(kind_of.values())
    applied.update(raw.relations[number][0]["restriction"] for number in several)
    certain = Counter(
        tags["restriction"]
        for tags, members in raw.relations.values()
        if simple_turn(tags, members, raw) is not None
    )
    assert certain <= applied


def test_restrictions_over_ways_name_the_links_between(both: tuple[Network, Raw]) -> None:
    network, raw = both
    over_ways = {
        relation
        for relation, (_, members) in raw.relations.items()
        if any((type_, role) == ("w", "via") for type_, _, role in members)
        and all(ref in raw.ways for _, ref, _ in members)
    }
    table = of_relations(network).dropna(subset="via_link_ids")
    assert {int(number) for ids in table["source_id"] for number in ids.split()} == over_ways
    way_of = network.links.set_index("link_id")["source_id"]
    for ids, between in table[["source_id", "via_link_ids"]].values:
        members = raw.relations[int(ids)][1]
        via = {str(ref) for _, ref, role in members if role == "via"}
        assert {way_of[link] for link in between.split()} == via


def test_banned_turns_lie_on_links_that_meet(both: tuple[Network, Raw]) -> None:
    network, _ = both
    ends = network.links.set_index("link_id")[["from_node_id", "to_node_id"]]
    for row in network.movements.fillna("").itertuples():
        path = [row.from_link_id, *row.via_link_ids.split(), row.to_link_id]
        for link, onward in pairwise(path):
            assert ends.loc[link, "to_node_id"] == ends.loc[onward, "from_node_id"]
        assert ends.loc[path[0], "to_node_id"] == row.node_id


def values_by_way(network: Network, column: str) -> dict[str, list[tuple[float, str, str]]]:
    """Values of a column, their sources and directions, of the links of each way."""
    found: dict[str, list[tuple[float, str, str]]] = defaultdict(list)
    table = network.links[["source_id", column, f"{column}_source", "direction"]]
    for way, value, source, direction in table.itertuples(index=False):
        found[way].append((value, source, direction))
    return found


def test_speeds_in_miles_and_in_kilometres(both: tuple[Network, Raw]) -> None:
    network, raw = both
    links = values_by_way(network, "free_speed")
    for way, (_, tags) in raw.ways.items():
        if {"maxspeed:forward", "maxspeed:backward"} & set(tags):
            continue
        found = links[str(way)]
        match = re.fullmatch(r"([1-9]\d*)( mph)?", tags.get("maxspeed", ""))
        if match:
            speed = float(match[1]) * (0.44704 if match[2] else 1 / 3.6)
            assert all(abs(value - speed) < 1e-9 for value, _, _ in found)
            assert all(source == "given" for _, source, _ in found)
        elif not any("maxspeed" in key or "zone" in key for key in tags):
            assert all(source == "assumed" for _, source, _ in found)


def test_numbers_of_mph_speeds_and_of_given_lanes(both: tuple[Network, Raw]) -> None:
    """Ways with the tag that became links with a given value, and no others."""
    network, raw = both
    links = network.links
    by_limit = links[(links["free_speed_basis"] == "maxspeed")]
    mph = {way for way, (_, tags) in raw.ways.items() if tags.get("maxspeed", "").endswith("mph")}
    ways = set(by_limit["source_id"].astype("int64"))
    there = set(links["source_id"].astype("int64"))
    assert mph & there <= ways
    numbered = {way for way, (_, tags) in raw.ways.items() if tags.get("lanes", "").isdigit()}
    given = set(links["source_id"][links["lanes_source"] == "given"].astype("int64"))
    assert numbered & there <= given
    said = {way for way, (_, tags) in raw.ways.items() if any("lanes" in key for key in tags)}
    assert given <= said


#: keys that say whose each lane is
LISTS = ("bus:lanes", "psv:lanes", "access:lanes", "motor_vehicle:lanes", "vehicle:lanes")

#: parts of keys that part lanes between the directions, or between cars and others
SPLIT = ("turn:lanes:", "bus:lanes", "psv:lanes", "access:lanes", "vehicle:lanes")


def test_lanes_of_buses(both: tuple[Network, Raw]) -> None:
    """On one-way roads: all lanes less those of buses, by their number or lane by lane."""
    network, raw = both
    links = values_by_way(network, "lanes")
    for way, (_, tags) in raw.ways.items():
        lists = [tags[key].split("|") for key in LISTS if key in tags]
        counts = [int(tags[key]) for key in ("lanes:bus", "lanes:psv") if key in tags]
        sides = any(key in tags for key in ("lanes:forward", "lanes:backward"))
        if not re.fullmatch("[1-9]", tags.get("lanes", "")) or not is_oneway(tags) or sides:
            continue
        if not lists and counts and not any("lanes:" in key and "ward" in key for key in tags):
            left = int(tags["lanes"]) - max(counts)
        elif len(lists) == 1 and not counts and len(lists[0]) == int(tags["lanes"]):
            left = sum(entry not in ("no", "psv", "agricultural") for entry in lists[0])
            by_bus = "bus:lanes" in tags or "psv:lanes" in tags
            left = sum(entry != "designated" for entry in lists[0]) if by_bus else left
        else:
            continue
        assert {value for value, _, _ in links[str(way)]} == {max(left, 1)}, tags


def test_lanes(both: tuple[Network, Raw]) -> None:
    """One-way roads have all lanes, others half of an even number; where no tag is, assumed."""
    network, raw = both
    links = values_by_way(network, "lanes")
    for way, (_, tags) in raw.ways.items():
        said = {key for key in tags if key.startswith("lanes")}
        if said - {"lanes"} or any(part in key for key in tags for part in SPLIT):
            continue
        found = links[str(way)]
        by_side = {direction: value for value, _, direction in found}
        if not said:
            assert all(source == "assumed" for _, source, _ in found)
        elif found and re.fullmatch("[1-9]|10", tags["lanes"]):
            lanes = int(tags["lanes"])
            assert all(source == "given" for _, source, _ in found)
            if is_oneway(tags) or lanes > 1:
                assert sum(by_side.values()) == lanes
            if lanes % 2 == 0 and not is_oneway(tags):
                assert set(by_side.values()) == {lanes // 2}


def test_the_inventory(
    both: tuple[Network, Raw], shared: Path, request: pytest.FixtureRequest
) -> None:
    """Counts that others took of the same files, of drivable ways whatever their access."""
    text = (shared / "data" / "osm" / "SOURCES.tsv").read_text(encoding="utf-8")
    rows = csv.DictReader([line for line in text.splitlines() if line[0] != "#"], delimiter="\t")
    name = request.node.callspec.params["both"]
    row = next(row for row in rows if row["file"] == name)
    network, _ = both
    length_km = roads(network)["length"].sum() / 1000.0
    assert length_km <= float(row["km_ex_service"]) * 1.02 + 0.05
    assert length_km >= float(row["km_ex_service"]) * 0.95 - 0.05
    ways = network.links.drop_duplicates("source_id")
    assert (ways["junction"] == "roundabout").sum() <= int(row["roundabout_ways"])
    against = ways["oneway"] & (ways["direction"] == "backward")
    assert int(row["oneway_-1"]) * 0.8 - 1 <= against.sum() <= int(row["oneway_-1"]) + 1
    signals = network.nodes["signal_node_ids"].dropna().str.split().explode()
    assert len(signals) <= int(row["signals"])
