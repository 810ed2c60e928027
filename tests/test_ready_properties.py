"""Whatever streets, signals and bans: what making ready keeps, and what it does not depend on."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from road_tables import banned, city, in_order, plain_costs, shuffled

from uxsim_geo.network.check import check_network
from uxsim_geo.network.clusters import JunctionSizes
from uxsim_geo.network.incidence import Rows
from uxsim_geo.network.joining import join_links
from uxsim_geo.network.junctions import merge_junctions
from uxsim_geo.network.largest_part import keep_largest_part
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.ready import make_ready
from uxsim_geo.network.ready_options import ReadyOptions
from uxsim_geo.network.rows import numbers
from uxsim_geo.network.turn_graph import shortest, turn_graph

SEEDS = range(12)


def whole(seed: int) -> Network:
    return keep_largest_part(city(7, seed), Notes())


def joined(network: Network) -> Network:
    return join_links(network, 30.0, Notes())


def total_time(network: Network) -> float:
    links = network.links
    return float((links["length"] / links["free_speed"]).sum())


@pytest.mark.parametrize("seed", SEEDS)
def test_ways_are_those_of_a_plain_search(seed: int) -> None:
    network = whole(seed)
    graph = turn_graph(network)
    length = numbers(network.links["length"])
    costs = {"length": length, "time": length / numbers(network.links["free_speed"])}
    names = list(network.nodes["node_id"])
    origins: Rows = np.arange(0, len(names), 5)
    for name, cost in costs.items():
        for origin, found in zip(origins.tolist(), shortest(graph, cost, origins), strict=True):
            plain = plain_costs(network, names[origin], name)
            expected = [plain.get(place, np.inf) for place in names]
            assert found == pytest.approx(np.array(expected))


@pytest.mark.parametrize("seed", SEEDS)
def test_every_origin_reaches_every_destination(seed: int) -> None:
    """But for bans over several links, and where turning back is closed."""
    network = whole(seed)
    movements = network.movements
    network = replace(network, movements=movements[movements["via_link_ids"].isna()])
    links = network.links
    leaving = links.groupby("from_node_id")["link_id"].apply(list).to_dict()
    ends = dict(zip(links["link_id"], links["to_node_id"], strict=True))
    closed = banned(network)
    for start in links["link_id"]:
        reached, unfinished = {start}, [start]
        while unfinished:
            one = unfinished.pop()
            onward = {x for x in leaving[ends[one]] if f"{one} {x}" not in closed} - reached
            reached |= onward
            unfinished += onward
        assert reached == set(links["link_id"])


@pytest.mark.parametrize("seed", SEEDS)
def test_joining_keeps_lengths_times_and_every_way(seed: int) -> None:
    before, after = whole(seed), joined(whole(seed))
    assert after.links["length"].sum() == pytest.approx(before.links["length"].sum())
    assert total_time(after) == pytest.approx(total_time(before))
    for origin in after.nodes["node_id"][::4]:
        for cost in ("length", "time"):
            was, now = (plain_costs(network, origin, cost) for network in (before, after))
            for place in after.nodes["node_id"]:
                assert now.get(place, np.inf) == pytest.approx(was.get(place, np.inf))


@pytest.mark.parametrize("seed", SEEDS)
def test_merging_changes_no_way_by_more_than_its_junctions_do(seed: int) -> None:
    """And reaches from everywhere what could be reached before."""
    before = joined(whole(seed))
    after = merge_junctions(before, JunctionSizes(error=15.0), Notes())
    if after is before:
        return  # no junction here is small enough
    merged = after.nodes["merged_node_ids"].notna()
    error = 3 * after.nodes["merge_error"].sum() + 1e-2 * len(after.nodes)
    places = list(after.nodes["node_id"][~merged])
    for origin in places[::3]:
        was, now = (plain_costs(network, origin, "length") for network in (before, after))
        for place in places:
            assert now.get(place, np.inf) == pytest.approx(was.get(place, np.inf), abs=error)


@pytest.mark.parametrize("seed", SEEDS)
def test_the_order_of_rows_does_not_matter(seed: int) -> None:
    options = ReadyOptions(sampled_ways=2000)
    one = make_ready(city(7, seed), options)
    other = make_ready(shuffled(city(7, seed), seed), options)
    for table, same in zip(in_order(one), in_order(other), strict=True):
        pd.testing.assert_frame_equal(table, same)
    places = [net.notes[net.notes["element_id"].notna()] for net in (one, other)]
    said = [set(map(tuple, notes.fillna("").to_numpy())) for notes in places]
    assert said[0] == said[1]


@pytest.mark.parametrize("seed", SEEDS)
def test_joining_and_keeping_twice_changes_nothing(seed: int) -> None:
    once = joined(whole(seed))
    twice = joined(keep_largest_part(once, Notes()))
    for name in ("nodes", "links", "movements"):
        pd.testing.assert_frame_equal(getattr(once, name), getattr(twice, name))


@pytest.mark.parametrize("seed", SEEDS)
def test_the_result_can_be_simulated_and_is_told_of(seed: int) -> None:
    shares = []
    options = ReadyOptions(sampled_ways=2000, u_turns="junctions")
    network = make_ready(city(7, seed), options, progress=lambda _, share: shares.append(share))
    check_network(replace(network, movements=network.movements[:0]))
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (0.0, 1.0)
    topics = set(network.notes["topic"])
    assert {"short links", "largest part", "driving side", "links joined"} <= topics
    ends = network.links.set_index("link_id")[["from_node_id", "to_node_id"]]
    for path in (ban.split() for ban in banned(network)):
        for one, other in pairwise(path):
            assert ends.loc[one, "to_node_id"] == ends.loc[other, "from_node_id"]
    assert len(banned(network)) == len(network.movements)
    lines = network.links.set_index("link_id")["geometry"]
    points = network.nodes.set_index("node_id")["geometry"]
    for link_id, line in lines.items():
        assert line.coords[0] == points[ends.loc[link_id, "from_node_id"]].coords[0]
        assert line.coords[-1] == points[ends.loc[link_id, "to_node_id"]].coords[0]


@pytest.mark.parametrize("seed", SEEDS)
def test_what_was_made_ready_can_be_made_ready_again(seed: int) -> None:
    """Junctions that were merged stay, and ways far enough are still what they were."""
    options = ReadyOptions(sampled_ways=2000)
    once = make_ready(city(7, seed), options)
    twice = make_ready(once, options)
    check_network(replace(twice, movements=twice.movements[:0]))
    if "merged_node_ids" in once.nodes:
        merged = once.nodes.set_index("node_id")["merged_node_ids"].dropna()
        again = twice.nodes.set_index("node_id")["merged_node_ids"].dropna()
        kept = merged.index.intersection(again.index)
        assert (merged[kept] == again[kept]).all()
    changes = twice.notes[twice.notes["note"].str.contains("1 km and more: greatest change")]
    assert (changes["value"].astype(float) < 0.05).all()


def test_every_step_can_be_left_out() -> None:
    steps = ("project", "drop_undrivable", "largest_part", "join", "merge_junctions")
    options = ReadyOptions(**dict.fromkeys(steps, False), u_turns="nowhere", sampled_ways=0)
    network = city(5, 3)
    same = make_ready(network, options)
    for name in ("nodes", "links", "movements"):
        pd.testing.assert_frame_equal(getattr(network, name), getattr(same, name))
