"""What is remembered of updates, against B ← (1−λ)B + λ·tree in plain numbers."""

from __future__ import annotations

import re

import numpy as np
import pytest
from numba import njit
from small_networks import network
from test_engine_sweeps import MEMORIES, draw_costs, run_of
from test_engine_trees import plain_distances, some_ways, streets
from weights import weights_of

from uxsim_geo.engine import searches
from uxsim_geo.engine.history import bytes_needed, shift_byte, worth_of_bytes
from uxsim_geo.engine.records import DESTINATION, UNREACHED, Routes
from uxsim_geo.engine.router import Router
from uxsim_geo.engine.sharing import room_for
from uxsim_geo.engine.simulation import Simulation
from uxsim_geo.engine.slots import give_slots, wanted_lanes
from uxsim_geo.engine.sweep import climb, descend


def plain_tree(routes: Routes, target: int) -> np.ndarray:
    """1 for every arc that leads nearer as fast as can be; shape (arcs,)."""
    distance = plain_distances(routes, target)
    tail = np.repeat(np.arange(distance.size), np.diff(routes.vertex["first_out"]))
    beyond = np.where(routes.arc["head"] >= 0, distance[routes.arc["head"]], np.inf)
    cost = np.where(routes.arc["cost"] < UNREACHED, routes.arc["cost"].astype(float), np.inf)
    on_tree: np.ndarray = np.isfinite(distance[tail]) & (beyond + cost == distance[tail])
    return on_tree.astype(float)


def renew(run: Simulation, by: str) -> None:
    run.world.routes.destination["wanted"][:-1] = 1
    if by == "trees":
        searches.renew_rest(run.world)
    else:
        run.router._renew(run.world)


@pytest.mark.parametrize("by", ["trees", "sweeps"])
@pytest.mark.parametrize(
    ("memory", "exact"),  # for so many updates
    [("a byte", 8), ("two bytes", 16), ("weights", 30)],
)
def test_weights_are_those_of_the_formula(memory: str, exact: int, by: str) -> None:
    """To rounding, for as long as updates are remembered; then up to what the oldest counts."""
    draws = np.random.default_rng(3)
    rows = streets(draws, 6)
    run = run_of(network(rows, banned=some_ways(draws, rows, 0.1, 2)), MEMORIES[memory])
    share = run.settings.route_update_weight
    nodes = run.world.routes.destination["node"][:-1]
    expected: np.ndarray | None = None
    for update in range(30):
        draw_costs(run, draws, 100_000)
        renew(run, by)
        tree = np.stack([plain_tree(run.world.routes, node) for node in nodes])
        expected = tree if expected is None else (1 - share) * expected + share * tree
        error = 1e-6 if memory == "weights" else 1e-12
        if update >= exact:
            error += (1 - share) ** (exact - 1)
        assert np.abs(weights_of(run) - expected).max() <= error
    assert memory == "weights" or np.abs(weights_of(run) - expected).max() > 1e-12


@pytest.mark.parametrize("count", [1, 2])
def test_bytes_are_worth_their_bits(count: int) -> None:
    share = 0.3
    worth = worth_of_bytes(share, count)
    assert worth.shape == (count, 256)
    assert worth[:, 255].sum() == pytest.approx(1.0, rel=1e-15)
    assert (worth[:, 0] == 0).all()
    assert worth[0, 128] == pytest.approx(share)
    assert worth[0, 32] == pytest.approx(share * (1 - share) ** 2)
    assert worth[-1, 1] == pytest.approx((1 - share) ** (8 * count - 1))


@pytest.mark.parametrize(
    ("share", "count"),
    [(1.0, 1), (0.5, 1), (0.483, 1), (0.481, 2), (0.265, 2), (0.264, 0), (0.1, 0), (0.0, 0)],
)
def test_as_many_bytes_are_kept_as_it_takes(share: float, count: int) -> None:
    """1 % is left of (1−λ)^7 at λ = 0.4821, and of (1−λ)^15 at λ = 0.2644."""
    assert bytes_needed(share) == count
    assert bytes_needed(share, is_logit=True) == 0


def test_slots_are_of_the_same_drivers_and_by_rank() -> None:
    table = np.zeros(200, DESTINATION)
    table["slot"] = -1
    table["node"] = np.arange(200)
    table["driver"] = np.arange(200) % 2
    table["given"][::10] = 1
    rank = np.arange(300)[::-1].copy()
    assert give_slots(table, rank) == 4
    chosen = table["given"] == 0
    assert (table["slot"][~chosen] == -1).all()
    assert np.unique(table["slot"][chosen]).size == chosen.sum()
    for driver in (0, 1):
        own = np.flatnonzero(chosen & (table["driver"] == driver))
        assert np.unique(table["slot"][own] // 64).size == 2
        assert (np.diff(table["slot"][own[::-1]]) == 1).all()
    more = np.concatenate([table, table[:150]])
    more["slot"][200:] = -1
    more["given"] = 0
    more["given"][200:300] = 1
    assert give_slots(more, rank) == 4  # there are lanes left
    given = more["slot"][(more["given"] == 0)]
    assert np.unique(given).size == given.size


def test_wanted_destinations_have_their_lanes() -> None:
    table = np.zeros(4, DESTINATION)
    table["slot"] = [130, 5, -1, 64]
    table["wanted"] = [1, 1, 0, 0]
    batches, own = wanted_lanes(table)
    assert batches.tolist() == [0, 2]
    assert own[0, 5] == 1
    assert own[1, 2] == 0
    assert (own >= 0).sum() == 2


def vectors_in(code: str, instruction: str) -> int:
    """How many numbers an instruction takes at once, at most."""
    return max((int(size) for size in re.findall(instruction, code)), default=1)


#: what each loop over the lanes is about, in the language of LLVM
INSTRUCTIONS = {
    "climb": r"smin\.v(\d+)i32",
    "descend": r"smin\.v(\d+)i32",
    "remember": r"icmp eq <(\d+) x i32>",
}


@pytest.mark.parametrize("phase", INSTRUCTIONS)
def test_all_lanes_are_worked_on_by_vector_instructions(phase: str) -> None:
    """Else a sweep takes ten times as long; any processor has room for four numbers at once."""
    run = run_of(network(streets(np.random.default_rng(0), 3)), {})
    h, routes = run.router.hierarchy, run.world.routes
    assert h is not None
    room = room_for(h.place.size)
    options = {"_nrt": False, "error_model": "numpy"}
    if phase == "climb":
        task = njit(**options)(lambda h, room: climb(h, room.distance, 0))
        arguments = (h, room)
    elif phase == "descend":
        task = njit(**options)(lambda h, room: descend(h, room.distance, room.nearer))
        arguments = (h, room)
    else:
        task = njit(**options)(lambda routes, h, room: shift_byte(routes, h, 0, room))
        arguments = (routes, h, room)
    if not hasattr(task, "compile"):
        pytest.skip("there is no compiler")
    task.compile(tuple(map(_type_of, arguments)))
    (code,) = task.inspect_llvm().values()
    assert vectors_in(code, INSTRUCTIONS[phase]) >= 4


def _type_of(value: object) -> object:
    from numba import typeof

    return typeof(value)


def test_a_router_without_destinations_builds_nothing() -> None:
    run = run_of(network(streets(np.random.default_rng(0), 3)), {})
    router = Router(run.setting.paths, 10.0, 1)
    router.prepare(0)
    assert router.hierarchy is None
