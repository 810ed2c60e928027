"""Merged junctions change no way by more than is allowed, by a plain search of every way."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
import pytest
from road_tables import city, drawn, plain_costs, road, street

from uxsim_geo.network.changed_ways import HARDLY, TINY, junctions_to_leave
from uxsim_geo.network.clusters import JunctionSizes
from uxsim_geo.network.distortion import NEAR, WITHIN, compare, note_distortion, sample_nodes
from uxsim_geo.network.incidence import Rows
from uxsim_geo.network.joining import join_links
from uxsim_geo.network.junctions import find_junctions, merge_junctions
from uxsim_geo.network.largest_part import keep_largest_part
from uxsim_geo.network.merged_steps import MergedSteps
from uxsim_geo.network.near_ways import regions_of, ways_around
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.settling import merge_within
from uxsim_geo.network.squares import points_by_road
from uxsim_geo.network.turn_graph import shortest, turn_graph

#: such that single junctions change ways by more than is allowed
SIZES = JunctionSizes(link=30.0, signal_link=40.0, extent=80.0, error=25.0)

SEEDS = range(5)


@cache
def whole(seed: int) -> Network:
    return join_links(keep_largest_part(city(11, seed), Notes()), 30.0, Notes())


@cache
def within(seed: int) -> tuple[Network, Notes]:
    notes = Notes()
    return merge_within(whole(seed), SIZES, notes, lambda _: None), notes


def changes(before: Network, after: Network) -> pd.DataFrame:
    """Lengths and times before and after between nodes that both have and that are no merged."""
    merged = after.nodes.get("merged_node_ids", pd.Series(None, after.nodes.index))
    places = list(after.nodes["node_id"][merged.isna()])
    rows = []
    for origin in places[::6]:
        costs = [plain_costs(net, origin, c) for c in ("length", "time") for net in (before, after)]
        rows += [[found.get(other, np.inf) for found in costs] for other in places]
    table = pd.DataFrame(rows, columns=["length", "length_after", "time", "time_after"])
    return table[np.isfinite(table).all(axis=1)]


@cache
def changed(seed: int) -> pd.DataFrame:
    return changes(whole(seed), within(seed)[0])


def worst(table: pd.DataFrame) -> float:
    """The greatest change of a length, as a share of what is allowed."""
    allowed = WITHIN * np.maximum(table["length"], NEAR)
    return float(((table["length_after"] - table["length"]).abs() / allowed).max())


@pytest.mark.parametrize("seed", SEEDS)
def test_no_length_changes_by_more_than_a_hundredth_or_ten_metres(seed: int) -> None:
    assert worst(changed(seed)) <= 1.0


def test_no_time_of_a_kilometre_changes_by_more_than_a_hundredth() -> None:
    table = pd.concat([changed(seed) for seed in SEEDS])
    far = table[table["length"] >= NEAR]
    assert len(far) > 100
    assert ((far["time_after"] / far["time"] - 1.0).abs() <= WITHIN).all()


def test_some_would_change_by_more_and_some_junctions_stay_merged() -> None:
    """What the tests above rest on: without the search they fail, and it is not too strict."""
    plain = [merge_junctions(whole(seed), SIZES, Notes()) for seed in SEEDS]
    pairs = zip(SEEDS, plain, strict=True)
    assert max(worst(changes(whole(seed), after)) for seed, after in pairs) > 1.5
    assert sum(within(seed)[0].nodes["merged_node_ids"].notna().sum() for seed in SEEDS) > 8


@pytest.mark.parametrize("seed", SEEDS)
def test_what_the_notes_say_of_lengths_below_a_kilometre_holds(seed: int) -> None:
    told = within(seed)[1].table().set_index("note")["value"].astype(float)
    table = changed(seed)
    near = table[table["length"] < NEAR]
    most = told[told.index.str.startswith("length of all ways")].item()
    off = (near["length_after"] - near["length"]).abs().max()
    assert off <= max(most, HARDLY) + 10 * TINY


@pytest.mark.parametrize("seed", SEEDS)
def test_where_nodes_lie_need_not_be_known(seed: int) -> None:
    """Then regions go by what is near by road; the fastest ways around may be others."""
    steps = MergedSteps.of(find_junctions(whole(seed), SIZES))
    apart, _ = junctions_to_leave(steps, lambda _: None)
    length = steps.found.network.links["length"].to_numpy()[steps.link]
    by_road = replace(steps, points=points_by_road(steps.graph.ends, length))
    alone, _ = junctions_to_leave(by_road, lambda _: None)
    assert 0 < apart.sum() < len(apart)
    assert abs(int(apart.sum()) - int(alone.sum())) <= 2


@pytest.mark.parametrize("seed", SEEDS)
def test_each_junction_has_its_node_in_the_merged_network(seed: int) -> None:
    found = find_junctions(whole(seed), SIZES)
    before, steps = found.network.nodes["node_id"], MergedSteps.of(found)
    after = merge_junctions(whole(seed), SIZES, Notes()).nodes
    for one, row in zip(found.merged, steps.nodes().tolist(), strict=True):
        ids = set(before.iloc[sorted(one.junction.nodes)])
        assert set(after["merged_node_ids"].iloc[row].split()) == ids


@pytest.mark.parametrize("seed", SEEDS)
def test_ways_around_are_those_of_the_whole_graph(seed: int) -> None:
    network = whole(seed)
    graph = turn_graph(network)
    cost = network.links["length"].to_numpy()
    of_step = cost[graph.link[graph.after]]
    points = network.nodes.geometry.get_coordinates().to_numpy()
    nodes: Rows = np.arange(0, len(points), 9)
    trees = dict(zip(nodes.tolist(), shortest(graph, cost, nodes, 300.0), strict=True))
    places = len(graph.link) + nodes
    alike = np.zeros(len(graph.link) + len(points), dtype=bool)
    for region in regions_of(graph, points, places, 300.0):
        found = ways_around(region, region.origins, (of_step, 300.0), alike)
        for place, ways in zip(region.origins.tolist(), found, strict=True):
            origin = place - len(graph.link)
            assert ways.sums(of_step) == pytest.approx(ways.cost)
            ends = graph.ends.end[graph.link[ways.place[1:]]]
            least = pd.Series(ways.cost[1:]).groupby(ends).min().drop(origin, errors="ignore")
            tree = trees.pop(origin)
            tree[origin] = np.inf
            assert least.index.tolist() == np.flatnonzero(np.isfinite(tree)).tolist()
            assert least.to_numpy() == pytest.approx(tree[np.isfinite(tree)])
    assert not trees


def test_nearby_ways_are_compared_from_more_origins_than_far_ones() -> None:
    before = whole(0)
    after, _ = within(0)
    sample = sample_nodes(before, after, 1, 2)
    assert sample.far == 8
    assert len(sample.origins) == min(100, len(sample.nodes))
    own = compare(before, before, sample)
    assert {float(np.abs(one.after - one.before).max()) for one in own.values()} == {0.0}
    notes = Notes()
    note_distortion(compare(before, after, sample), notes)
    assert notes.table()["note"].str.contains("ways below 1 km").sum() == 2


def test_a_street_where_a_stub_lets_one_turn_round_keeps_its_node() -> None:
    """The stub at b becomes a part of it; joined to one link, one could not turn round there."""
    places = {"a": (0.0, 0.0), "b": (300.0, 0.0), "c": (600.0, 0.0), "x": (300.0, 8.0)}
    places |= {"d": (0.0, 300.0), "e": (0.0, -300.0)}
    roads = [street("a", "b"), street("b", "c"), street("b", "x"), road("d", "a"), road("a", "e")]
    network = drawn(places, roads, bans=["d-a a-e"], zones={"d": "1", "e": "2"})
    merged = merge_junctions(network, JunctionSizes(), Notes())
    assert "x" not in set(merged.nodes["node_id"])
    again = join_links(merged, 50.0, Notes())
    assert plain_costs(network, "d", "length")["e"] == pytest.approx(300 + 2 * 308 + 300)
    assert plain_costs(again, "d", "length")["e"] == pytest.approx(1216, abs=3 * 7.0)
