"""Sweeps over a hierarchy against trees of the heap, and both against a plain search.

Either finds all distances, so that what is kept of them is the same to the bit, and so are runs.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from drawn_networks import bans, webs
from hypothesis import given, settings
from hypothesis import strategies as st
from small_networks import across, demand, grid, link, network
from test_engine_order import hash_of, random_case
from test_engine_pieces import controlled_case
from test_engine_trees import plain_distances, some_ways, streets

from uxsim_geo.engine import router as routers
from uxsim_geo.engine import searches
from uxsim_geo.engine.hierarchy import build_hierarchy
from uxsim_geo.engine.records import UNREACHED
from uxsim_geo.engine.router import Router
from uxsim_geo.engine.sharing import room_for
from uxsim_geo.engine.simulation import Simulation, simulate
from uxsim_geo.engine.slots import wanted_lanes
from uxsim_geo.machine import Machine
from uxsim_geo.network.network import Network
from uxsim_geo.network.paths import Paths
from uxsim_geo.settings import Settings

#: λ with which a byte, two bytes and no byte remember the updates; and a logit choice
MEMORIES: dict[str, dict[str, Any]] = {
    "a byte": {"route_update_weight": 0.5},
    "two bytes": {"route_update_weight": 0.3},
    "weights": {"route_update_weight": 0.1},
    "logit": {"route_choice": "logit"},
}


def run_of(net: Network, told: dict[str, Any]) -> Simulation:
    """A run to all nodes, in which nothing has happened yet."""
    nodes = net.nodes["node_id"].tolist()
    rows = [(nodes[place - 1], node, 900.0, 950.0, 5.0) for place, node in enumerate(nodes)]
    run = Simulation(net, demand(*rows), Settings(1000, 5, **told))
    run.router.build()
    return run


def draw_costs(run: Simulation, draws: np.random.Generator, highest: int) -> None:
    """Give links costs of which some are equal; every tenth link is closed."""
    arc, links = run.world.routes.arc, run.world.routes.road.size
    cost = draws.integers(1, 40, links) * (highest // 40)
    cost[draws.random(links) < 0.1] = UNREACHED
    arc["cost"] = np.where(arc["head"] >= 0, cost[arc["link"]], UNREACHED)


def kept(run: Simulation) -> list[bytes]:
    return [run.world.routes.history.tobytes(), run.world.routes.weight.tobytes()]


def renew_by_heap(run: Simulation) -> list[bytes]:
    run.world.routes.destination["wanted"][:-1] = 1
    searches.renew_rest(run.world)
    return kept(run)


def check_sweeps(run: Simulation) -> None:
    """Hold the distances of sweeps to a plain search; what they leave is renewed."""
    routes, h = run.world.routes, run.router.hierarchy
    assert h is not None
    searches.cost_ways(h, routes.arc)
    routes.destination["wanted"][:-1] = 1
    batches, own = wanted_lanes(routes.destination)
    room = room_for(h.place.size)
    for batch, row in zip(batches, own, strict=True):
        room.own[:] = row
        assert searches.renew(run.world, h, batch, room)
        for lane in np.flatnonzero(row >= 0):
            expected = plain_distances(routes, routes.destination["node"][row[lane]])
            found = room.distance[h.place, lane].astype(float)
            found[found >= UNREACHED] = np.inf
            assert found.tolist() == expected.tolist()
    assert not routes.destination["wanted"].any()
    assert routes.destination["known"][:-1].all()


def both_ways(net: Network, memory: str, seed: int) -> None:
    """Renew weights some times by both, with other costs each time."""
    heap, sweeps = run_of(net, MEMORIES[memory]), run_of(net, MEMORIES[memory])
    for update in range(3):
        for run in (heap, sweeps):
            draw_costs(run, np.random.default_rng([seed, update]), 100_000)
        check_sweeps(sweeps)
        assert renew_by_heap(heap) == kept(sweeps)
    assert any(any(part) for part in kept(sweeps))


@pytest.mark.parametrize("memory", MEMORIES)
@settings(max_examples=25, deadline=None)
@given(drawn=webs(1), data=st.data())
def test_sweeps_do_what_trees_do_on_any_network(memory: str, drawn: Any, data: Any) -> None:
    """With parallel links, loops, dead ends, pairs without a way, bans, and closed nodes."""
    links, _ = drawn
    ends = sorted({row["from_node_id"] for row in links} | {row["to_node_id"] for row in links})
    no_through = data.draw(st.lists(st.sampled_from(ends), max_size=2))
    net = network(links, banned=data.draw(bans(links)), no_through=no_through)
    both_ways(net, memory, data.draw(st.integers(0, 99)))


@pytest.mark.parametrize("memory", MEMORIES)
@pytest.mark.parametrize("share", [0.0, 0.1])
def test_sweeps_do_what_trees_do_over_more_than_a_batch(memory: str, share: float) -> None:
    draws = np.random.default_rng(5)
    rows = streets(draws, 9)
    net = network(rows, banned=some_ways(draws, rows, share, 2), no_through=["3,3", "0,5"])
    both_ways(net, memory, 1)


@pytest.mark.parametrize("memory", MEMORIES)
def test_what_is_too_far_for_a_sweep_is_left_to_trees(memory: str) -> None:
    """A road of links that take 27 hours each: beyond 149 hours all is as far as can be told."""
    rows = [link(f"{a}{b}", f"{a}", f"{b}") for a in range(9) for b in (a - 1, a + 1) if 0 <= b < 9]
    rows.append(link("short cut", "0", "4", 500.0))
    heap, sweeps = (run_of(network(rows), MEMORIES[memory]) for _ in range(2))
    for run in (heap, sweeps):
        run.world.routes.arc["cost"] = 100_000_000
        run.world.routes.destination["wanted"][:-1] = 1
    sweeps.router._renew(sweeps.world)
    assert renew_by_heap(heap) == kept(sweeps)
    for run in (heap, sweeps):  # there is a way on from everywhere
        routes = run.world.routes
        slot = routes.destination["slot"][:-1]
        of_memory = routes.history if routes.history.size else routes.weight
        some = np.add.reduceat(of_memory[0][:, slot] > 0, routes.vertex["first_out"][:-1], axis=0)
        node = routes.destination["node"][:-1]
        assert (some[node, np.arange(node.size)] == 0).all()
        assert (some.sum(axis=0) >= 8).all()


@pytest.mark.parametrize("memory", MEMORIES)
def test_destinations_to_which_no_way_is_wanted_are_left_alone(memory: str) -> None:
    net = network(streets(np.random.default_rng(2), 4))
    heap, sweeps = (run_of(net, MEMORIES[memory]) for _ in range(2))
    for update in range(3):
        for run in (heap, sweeps):
            draw_costs(run, np.random.default_rng(update), 100_000)
            run.world.routes.destination["wanted"][update : 9 + update] = 1
        sweeps.router._renew(sweeps.world)
        searches.renew_rest(heap.world)
        assert kept(heap) == kept(sweeps)


def plain_ways(paths: Paths, place: np.ndarray) -> set[tuple[int, int]]:
    """Take vertices away one by one, and join all that were joined to each."""
    near: dict[int, set[int]] = {number: set() for number in range(place.size)}
    for tail, head in zip(paths.tail, paths.head, strict=True):
        if head >= 0 and head != tail:
            near[place[tail]].add(int(place[head]))
            near[place[head]].add(int(place[tail]))
    ways = set()
    for number in range(place.size):
        above = {other for other in near[number] if other > number}
        ways |= {(number, other) for other in above}
        for other in above:
            near[other] |= above - {other}
    return ways


@pytest.mark.parametrize("seed", range(3))
def test_the_ways_are_those_of_an_elimination(seed: int) -> None:
    draws = np.random.default_rng(seed)
    rows = [*streets(draws, 8), link("alone", "x", "y")]
    paths = Paths.of(network(rows, banned=some_ways(draws, rows, 0.1, 2), no_through=["2,2"]))
    h = build_hierarchy(paths)
    assert sorted(h.place.tolist()) == list(range(paths.node.size))
    lower = np.repeat(np.arange(h.place.size), np.diff(h.first)).tolist()
    listed = list(zip(lower, h.upper.tolist(), strict=True))
    assert listed == sorted(plain_ways(paths, h.place))
    for arc, (tail, head) in enumerate(zip(h.tail, h.head, strict=True)):
        way = h.way_of_arc[arc]
        if paths.head[arc] < 0:
            assert way == -1 - h.upper.size
        else:
            assert listed[way if tail < head else -1 - way] == (min(tail, head), max(tail, head))


def always_sweep(self: Router, _destinations: int) -> None:
    if self.hierarchy is None:
        self.build()
    self.most = -1


def never_sweep(_self: Router, _destinations: int) -> None:
    """Leave it to trees."""


def with_all_that_changes_routes(threads: int, case: Any, **told: Any) -> list[str]:
    """Demand that is added, tolls, closures, classes; free-flow times."""
    (net, dem, before), control, classes = case
    changed = replace(before, **told)
    run = Simulation(net, dem, changed, control=control, classes=classes, machine=Machine(threads))
    run.advance(400.0)
    size = int(len(net.nodes) ** 0.5)
    run.add(later(size))
    run.advance(changed.duration)
    result = run.result()
    return [hash_of(result), result.trips.to_json()]


def later(size: int) -> Any:
    """Some more vehicles, also to where nobody has wanted to go before."""
    rows = [(f"0,{a}", f"{b},1", 500.0, 900.0, 7.0) for a in range(size) for b in range(1, size)]
    return demand(*rows)


@pytest.mark.parametrize("memory", MEMORIES)
@pytest.mark.parametrize("seed", range(3))
def test_runs_are_the_same_by_trees_by_sweeps_and_on_any_number_of_threads(
    seed: int, memory: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = controlled_case(seed)
    monkeypatch.setattr(Router, "prepare", never_sweep)
    expected = with_all_that_changes_routes(1, case, **MEMORIES[memory])
    monkeypatch.setattr(Router, "prepare", always_sweep)
    monkeypatch.setattr(routers, "_THREADS_PAY", 0.0)
    for threads in (1, 2, 4):
        assert with_all_that_changes_routes(threads, case, **MEMORIES[memory]) == expected


def test_a_saved_run_goes_on_by_sweeps_as_by_trees(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    net, dem, told = random_case(4)
    expected = hash_of(simulate(net, dem, told))
    run = Simulation(net, dem, told)
    run.advance(700.0)
    run.save(tmp_path / "run.zip")
    monkeypatch.setattr(Router, "prepare", always_sweep)
    resumed = Simulation.resume(tmp_path / "run.zip")
    resumed.advance(told.duration)
    assert hash_of(resumed.result()) == expected


def test_a_hierarchy_is_built_where_it_pays() -> None:
    small = Simulation(network(grid(3)), across(3, 1.0, 100.0), Settings(1000, 5))
    assert small.router.hierarchy is None
    large = Simulation(network(grid(20)), across(20, 0.01, 100.0), Settings(7200, 5))
    assert large.router.hierarchy is not None
    assert 0 < large.router.most < 76
