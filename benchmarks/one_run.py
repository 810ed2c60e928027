"""Run one case with one engine in this process, and print its figures as JSON.

python benchmarks/one_run.py CASE ENGINE SEED, with ENGINE one of uxsim-geo, UXsim.
"""

from __future__ import annotations

import importlib.util
import json
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))


def run_uxsim_geo(case: Any, seed: int) -> dict[str, float]:
    """Simulate twice: the first time numba may compile, or load what it has compiled."""
    started = time.perf_counter()
    from uxsim_geo.demand.demand import Demand
    from uxsim_geo.engine.simulation import simulate
    from uxsim_geo.network.network import Network
    from uxsim_geo.settings import Settings

    network, demand = Network(case.nodes, case.links), Demand(case.demand)
    settings = Settings(duration=case.duration, platoon_size=case.platoon_size, seed=seed)
    simulate(network, demand, settings)
    start = time.perf_counter() - started
    result = simulate(network, demand, settings)
    completed = result.trips["status"] == "completed"
    return {
        "engine_s": result.engine_wall_s,
        "start_s": start,
        "entries": len(result.events),
        "completed": int(result.trips.loc[completed, "vehicles"].sum()),
    }


def run_uxsim(case: Any, seed: int) -> dict[str, float]:
    """UXsim's compiled engine, logs of vehicles off."""
    from uxsim import World

    world = World(
        name="",
        deltan=case.platoon_size,
        tmax=case.duration,
        print_mode=0,
        save_mode=0,
        random_seed=seed,
        vehicle_logging_timestep_interval=-1,
        cpp=True,
    )
    for node in case.nodes.itertuples():
        world.addNode(node.node_id, node.x, node.y)
    for link in case.links.itertuples():
        world.addLink(
            link.link_id,
            link.from_node_id,
            link.to_node_id,
            length=link.length,
            free_flow_speed=link.free_speed,
            jam_density=link.jam_density,
            merge_priority=link.merge_priority,
        )
    for row in case.demand.itertuples():
        flow = row.vehicles / (row.end_s - row.start_s)
        world.adddemand(row.origin, row.destination, row.start_s, row.end_s, flow)
    world.finalize_scenario()
    started = time.perf_counter()
    world.exec_simulation()
    took = time.perf_counter() - started
    return {"engine_s": took, "completed": int(world.analyzer.trip_completed)}


ENGINES: dict[str, Callable[[Any, int], dict[str, float]]] = {"uxsim-geo": run_uxsim_geo}
if importlib.util.find_spec("uxsim"):
    ENGINES["UXsim"] = run_uxsim


if __name__ == "__main__":
    from cases import CASES

    case_name, engine, seed = sys.argv[1:]
    figures = ENGINES[engine](CASES[case_name](), int(seed))
    figures["peak_mb"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(json.dumps(figures))
