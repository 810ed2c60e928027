"""Paths that obey banned turns, against a plain search over the links driven last."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from drawn_networks import bans
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_paths import Way, best_routes
from small_networks import Row, grid, link, network

from uxsim_geo.demand.reachable import reachable_pairs
from uxsim_geo.network.paths import Paths, banned_paths

Drawn = tuple[list[Row], list[Way], list[str]]


@st.composite
def barred(draw: st.DrawFn) -> Drawn:
    """Up to fourteen links between up to six nodes, banned paths, nodes without through traffic."""
    nodes = draw(st.integers(2, 6))
    links = []
    for number in range(draw(st.integers(1, 14))):
        ends = [str(draw(st.integers(0, nodes - 1))) for _ in range(2)]
        links.append(link(f"l{number}", *ends, length=draw(st.floats(10, 1000))))
    names = sorted({row["from_node_id"] for row in links})
    no_through = draw(st.lists(st.sampled_from(names), max_size=2, unique=True))
    return links, draw(bans(links, most=12)), no_through


@settings(derandomize=True, deadline=None, max_examples=400)
@given(barred())
def test_shortest_paths_are_those_of_a_plain_search(drawn: Drawn) -> None:
    links, banned, no_through = drawn
    net = network(links, no_through=no_through, banned=banned)
    ids = list(net.nodes["node_id"])
    paths = Paths.of(net)
    found = paths.shortest(net.links["length"], np.arange(len(ids)))
    cost = {row["link_id"]: row["length"] for row in links}
    for place, origin in enumerate(ids):
        best = best_routes(links, banned, cost, origin, no_through=no_through)
        expected = [best[node][0] if node in best else np.inf for node in ids]
        assert found[place] == pytest.approx(expected, rel=1e-12)
        there = reachable_pairs(net, pd.Series([origin] * len(ids)), pd.Series(ids))
        assert there.tolist() == [node in best for node in ids]


@settings(derandomize=True, deadline=None, max_examples=100)
@given(barred())
def test_routes_are_driven_up_to_the_first_ban(drawn: Drawn) -> None:
    links, banned, _ = drawn
    net = network(links, banned=banned)
    paths = Paths.of(net)
    row = {one["link_id"]: number for number, one in enumerate(links)}
    cost = {one["link_id"]: one["length"] for one in links}
    for origin in net.nodes["node_id"]:
        for _, route in best_routes(links, [], cost, origin).values():
            if route:
                legal = [
                    not any(route[:size][-len(way) :] == way for way in banned)
                    for size in range(1, len(route) + 1)
                ]
                drivable = legal.index(False) if False in legal else len(route)
                arcs = paths.arcs_along([row[one] for one in route])
                assert [links[paths.link[arc]]["link_id"] for arc in arcs] == [*route[:drivable]]


def test_without_bans_vertices_are_nodes_and_arcs_are_links() -> None:
    net = network(grid(4))
    paths = Paths.of(net)
    assert paths.node.tolist() == list(range(16))
    assert paths.link.size == len(net.links)
    order = np.argsort(paths.start, kind="stable")
    assert (paths.link == order).all()


def test_a_banned_turn_makes_one_vertex_and_no_link() -> None:
    """Who comes by "in" must not go on by "left": that is remembered at node 2, of nobody else."""
    links = [link("in", "1", "2"), link("left", "2", "3"), link("right", "2", "4")]
    paths = Paths.of(network(links, banned=[("in", "left")]))
    assert paths.node.tolist() == [0, 1, 1, 2, 3]
    tail, head, driven = (getattr(paths, name).tolist() for name in ("tail", "head", "link"))
    arcs = list(zip(tail, head, driven, strict=True))
    assert arcs == [(0, 2, 0), (1, 3, 1), (1, 4, 2), (2, -1, 1), (2, 4, 2)]


def test_a_way_over_several_links_is_remembered_link_by_link() -> None:
    links = [link(name, *ends) for name, ends in zip("abcd", ("01", "12", "23", "34"), strict=True)]
    net = network([*links, link("x", "9", "1")], banned=[("a", "b", "c", "d")])
    assert banned_paths(net) == [(0, 1, 2, 3)]
    paths = Paths.of(net)
    assert np.bincount(paths.node).tolist() == [1, 2, 2, 2, 1, 1]
    assert len(paths.arcs_along([0, 1, 2, 3])) == 3
    assert len(paths.arcs_along([4, 1, 2, 3])) == 4


def test_blank_and_missing_via_links_are_none() -> None:
    net = network([link("a", "0", "1"), link("b", "1", "2")], banned=[("a", "b")])
    for text in (None, np.nan, "", " "):
        net.movements["via_link_ids"] = pd.Series([text], dtype="object")
        assert banned_paths(net) == [(0, 1)]
    del net.movements["via_link_ids"]
    assert banned_paths(net) == [(0, 1)]
