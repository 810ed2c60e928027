"""Run one case with UXsim's compiled engine in this process, and print its figures: FOLDER OPTIONS.

Options: ``seed``; ``logs``, whether every vehicle's every step is recorded, UXsim's default.
It needs UXsim alone, no part of this project, so that it may stand in an environment of its own.
"""

from __future__ import annotations

import time
from typing import Any

from measuring import Told, give, peak_mb, resident_mb, told

WHOLE = 1 + 1e-9  # by so much flows are raised, lest rounding take the last platoon of a pair


class Timed:
    """UXsim's compiled world, all as it is, with the time that its loop takes."""

    def __init__(self, world: Any) -> None:
        self._world = world
        self.loop_s = self.loop_cpu_s = 0.0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._world, name)

    def main_loop(self, *arguments: float) -> None:
        """Run the loop, and take its time."""
        started, before = time.perf_counter(), time.process_time()
        self._world.main_loop(*arguments)
        self.loop_s += time.perf_counter() - started
        self.loop_cpu_s += time.process_time() - before


def read(asked: Told) -> Any:
    """Make a world of a case's tables."""
    import pandas as pd
    from uxsim import World

    case = asked.case
    names = dict.fromkeys(["node_id", "link_id", "from_node_id", "to_node_id"], "str")
    names.update(dict.fromkeys(["origin", "destination"], "str"))
    nodes, links, demand = (
        pd.read_csv(asked.folder / f"{table}.csv", dtype=names)
        for table in ("nodes", "links", "demand")
    )
    world = World(
        name="",
        deltan=case["platoon_size"],
        tmax=case["duration"],
        duo_update_time=case["route_update_interval"],
        print_mode=0,
        save_mode=0,
        random_seed=asked.options["seed"],
        vehicle_logging_timestep_interval=1 if asked.options["logs"] else -1,
        cpp=True,
    )
    for node in nodes.itertuples():
        world.addNode(node.node_id, node.x, node.y)
    add_links(world, links)
    for row in demand.itertuples():
        flow = WHOLE * row.vehicles / (row.end_s - row.start_s)
        world.adddemand(row.origin, row.destination, row.start_s, row.end_s, flow)
    world.finalize_scenario()
    return world


def add_links(world: Any, links: Any) -> None:
    """Add all links; a capacity that is not given is that of the triangular diagram."""
    for link in links.itertuples():
        given = link.capacity == link.capacity  # not NaN
        world.addLink(
            link.link_id,
            link.from_node_id,
            link.to_node_id,
            length=link.length,
            free_flow_speed=link.free_speed,
            jam_density_per_lane=link.jam_density,
            number_of_lanes=link.lanes,
            merge_priority=link.merge_priority,
            capacity_out=link.capacity if given else None,
        )


def main() -> None:
    """Run what the command line says."""
    started = time.perf_counter()
    import uxsim  # noqa: F401

    asked = told()
    start = time.perf_counter() - started
    before = resident_mb()
    started = time.perf_counter()
    world = read(asked)
    world._cpp_world = timed = Timed(world._cpp_world)
    begun = time.perf_counter()
    world.exec_simulation()
    ended = time.perf_counter()
    peak = peak_mb()
    size = asked.case["platoon_size"]
    entries = float(sum(link.cum_arrival[-1] for link in world.LINKS)) / size
    figures = {
        "engine_s": timed.loop_s,
        "engine_cpu_s": timed.loop_cpu_s,
        "exec_s": ended - begun,
        "whole_s": ended - started,
        "entries": entries,
        "vehicles": float(world.analyzer.trip_all),
        "completed": float(world.analyzer.trip_completed),
    }
    give({**figures, "start_s": start, "peak_mb": peak, "run_mb": peak - before})


if __name__ == "__main__":
    main()
