"""Time an update of the routes, part by part; fails where sweeps do not use vector instructions.

python benchmarks/routes.py [--runs N] [--destinations N] [NETWORK] takes a grid of 60 × 60 nodes,
or a folder with the tables of a network (``RUN/network``). It prints the least ms of CPU time of
each part on one thread, of wall time on one and on all threads, and how long one tree of the heap
takes. Exit status 1: a sweep takes more than 0.3 ns for a lane of a way, or of an arc.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
from bans import grid_network

from uxsim_geo.demand.demand import Demand
from uxsim_geo.engine import searches
from uxsim_geo.engine.records import LANES
from uxsim_geo.engine.simulation import Simulation
from uxsim_geo.machine import Machine, cores
from uxsim_geo.network.files import read_network
from uxsim_geo.network.network import Network
from uxsim_geo.settings import Settings

MOST_NS = 0.3  # of a sweep, for a lane of a way or an arc
TREES = 20  # of the heap, that are timed together


def prepared(network: Network, destinations: int) -> Simulation:
    """A run before its first update, with a hierarchy."""
    draws = np.random.default_rng(2)
    ends = np.unique(network.links["to_node_id"])
    ends = draws.choice(ends, min(destinations, ends.size), replace=False)
    columns = {"origin": np.roll(ends, 1), "destination": ends, "vehicles": 5.0}
    table = pd.DataFrame(columns).assign(start_s=900.0, end_s=1000.0)
    told = Settings(1000.0, 5, route_noise=0.3)
    run = Simulation(network, Demand(table), told, machine=Machine(cores()))
    if run.router.hierarchy is None:
        run.router.build()
    run.advance(told.step)
    return run


def least(task: Callable[[], object], runs: int, clock: Callable[[], float]) -> float:
    """The least time of some runs, ms."""
    times = []
    for _ in range(runs):
        started = clock()
        task()
        times.append(1000.0 * (clock() - started))
    return min(times)


def want(run: Simulation, number: int) -> None:
    """Want the ways to so many destinations, those that have none yet beside those that have."""
    run.world.routes.destination["wanted"][:-1] = 0
    run.world.routes.destination["wanted"][: min(number, run.world.routes.destination.size - 1)] = 1


def main() -> int:
    """Time it all, and print a line for each part."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=10, help="runs of each part (default 10)")
    parser.add_argument("--destinations", type=int, default=1790, help="(default 1790)")
    parser.add_argument("network", nargs="?", type=Path, help="folder of a network's tables")
    told = parser.parse_args()
    network = grid_network() if told.network is None else read_network(told.network)
    run = prepared(network, told.destinations)
    return report(run, told.runs)


def report(run: Simulation, runs: int) -> int:
    """Print how long the parts take; gives the exit status."""
    world, router, count = run.world, run.router, run.world.routes.destination.size - 1
    h = router.hierarchy
    assert h is not None
    print(f"{h.place.size} vertices, {h.tail.size} arcs, {count} destinations")
    print(f"hierarchy: {h.upper.size} ways, {h.triangles} triangles")
    print(f"history: {world.routes.history.nbytes / 1e6:.0f} MB")

    def costs() -> None:
        world.routes.driver["observe_step"] = world.routes.driver["update_step"] = 0
        searches.update(world, 0, -1)

    def renew() -> None:
        want(run, count)
        router._renew(world)

    def heap() -> None:
        want(run, TREES)
        searches.renew_rest(world)

    cpu, wall = time.process_time, time.perf_counter
    batches = -(-count // LANES)
    threads, router.threads = router.threads, 1
    parts = {
        "look at the traffic, set costs": least(costs, runs, cpu),
        "cost ways": least(lambda: searches.cost_ways(h, world.routes.arc), runs, cpu),
        "renew all weights": least(renew, runs, cpu),
        "the same, wall time": least(renew, runs, wall),
    }
    router.threads = threads
    parts[f"the same, {threads} threads"] = least(renew, runs, wall)
    parts["a tree of the heap"] = least(heap, max(runs // 4, 1), cpu) / TREES
    parts["free-flow times of trips"] = least(lambda: router.give_free_times(world), 2, wall)
    for name, ms in parts.items():
        print(f"{name:<32} {ms:9.3f} ms")
    sweeps = parts["renew all weights"] - parts["cost ways"]
    ns = 1e6 * sweeps / (batches * LANES * (h.upper.size + h.tail.size))
    print(f"{'a sweep, a lane of a way or an arc':<32} {ns:9.3f} ns; at most {MOST_NS} is right")
    return int(ns > MOST_NS)


if __name__ == "__main__":
    sys.exit(main())
