"""The tree of fastest ways that the engine grows, against a plain search over vertices and arcs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from small_networks import Row, demand, grid, link, network

from uxsim_geo.engine.records import UNREACHED, Routes
from uxsim_geo.engine.simulation import Simulation
from uxsim_geo.settings import Settings

Way = tuple[str, ...]


def streets(draws: np.random.Generator, size: int) -> list[Row]:
    """A grid of links of many lengths, of which every eighth is one way."""
    rows = [row | {"length": draws.integers(50, 400) * 1.0} for row in grid(size)]
    return [row for row in rows if draws.random() > 1 / 8]


def some_ways(draws: np.random.Generator, rows: list[Row], share: float, links: int) -> list[Way]:
    """A share of all paths of so many links."""
    out: dict[str, list[Row]] = {}
    for row in rows:
        out.setdefault(row["from_node_id"], []).append(row)
    ways = [(row,) for row in rows]
    for _ in range(links - 1):
        ways = [(*way, row) for way in ways for row in out.get(way[-1]["to_node_id"], [])]
    return [tuple(row["link_id"] for row in way) for way in ways if draws.random() < share]


def plain_distances(routes: Routes, target: int) -> np.ndarray:
    """The distance of every vertex to a node, by scipy over the arcs that may be driven."""
    vertices = routes.vertex.size - 1
    tail = np.repeat(np.arange(vertices), np.diff(routes.vertex["first_out"]))
    open_ = (routes.arc["head"] >= 0) & (routes.arc["cost"] < UNREACHED)
    least: dict[tuple[int, int], int] = {}
    for arc in np.flatnonzero(open_):
        ends = int(routes.arc["head"][arc]), int(tail[arc])
        least[ends] = min(int(routes.arc["cost"][arc]), least.get(ends, int(UNREACHED)))
    ends = np.array(list(least), np.int64).reshape(-1, 2).T
    graph = csr_array((np.array(list(least.values()), float), ends), shape=(vertices,) * 2)
    own = slice(*routes.node["first_vertex"][target : target + 2])
    found: np.ndarray = dijkstra(graph, indices=np.arange(vertices)[own]).min(axis=0)
    return found


def check_tree(routes: Routes, target: int) -> int:
    """Hold the tree at hand to plain distances; gives how many go another way than their first."""
    vertex, arc = routes.vertex[:-1], routes.arc
    expected = plain_distances(routes, target)
    found = np.where(vertex["distance"] < UNREACHED, vertex["distance"], np.inf)
    assert found.tolist() == expected.tolist()
    led = np.isfinite(expected) & (expected > 0)
    assert ((vertex["toward"] >= 0) == led).all()
    toward = vertex["toward"][led]
    assert (arc["head"][toward] >= 0).all()
    assert (expected[arc["head"][toward]] + arc["cost"][toward] == expected[led]).all()
    assert (toward >= vertex["first_out"][led]).all()
    assert (toward < routes.vertex["first_out"][1:][led]).all()
    first = np.repeat(routes.node["first_vertex"][:-1], np.diff(routes.node["first_vertex"]))
    return int((expected > expected[first]).sum())


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("share", [0.02, 0.1, 0.4])
@pytest.mark.parametrize("links", [2, 3])
def test_every_vertex_goes_the_fastest_way(share: float, links: int, seed: int) -> None:
    draws = np.random.default_rng(seed)
    rows = streets(draws, 12)
    banned = some_ways(draws, rows, 0.05, 2) if links > 2 else []
    banned += some_ways(draws, rows, share, links)
    net = network(rows, banned=banned)
    nodes = net.nodes["node_id"].tolist()
    alone = 0
    for target in (nodes[place] for place in draws.choice(len(nodes), 6, replace=False)):
        other = next(node for node in nodes if node != target)
        told = Settings(1000, 5, route_noise=0.0)
        run = Simulation(net, demand((other, target, 900.0, 950.0, 5.0)), told)
        run.advance(5.0)  # routes are chosen at the start
        alone += check_tree(run.world.routes, nodes.index(target))
    assert alone > 0


def test_a_node_with_more_ways_out_than_there_are_bits() -> None:
    """Forty ways on, all but two of which are banned for who comes by one link or the other."""
    rows = [link("in", "a", "hub"), link("side", "b", "hub"), link("back", "end", "a")]
    for number in range(40):
        rows += [
            link(f"out{number}", "hub", f"{number}", 1000.0 + 10 * number),
            link(f"on{number}", f"{number}", "end", 500.0),
        ]
    banned = [("in", f"out{number}") for number in range(40) if number not in (33, 39)]
    banned += [("side", f"out{number}") for number in range(40) if number not in (0, 38)]
    net = network(rows, banned=banned)
    run = Simulation(net, demand(("a", "end", 900, 950, 5)), Settings(1000, 5, route_noise=0.0))
    run.advance(5.0)
    routes, nodes = run.world.routes, net.nodes["node_id"].tolist()
    assert check_tree(routes, nodes.index("end")) == 1
    own = slice(*routes.node["first_vertex"][nodes.index("hub") : nodes.index("hub") + 2])
    ways = routes.vertex["distance"][own]
    assert sorted(ways.tolist()) == [75_000, 75_000, 75_000 + 33 * 500]
