"""Run one case with uxsim-geo in this process, and print its figures: FOLDER OPTIONS.

Options: ``seed``.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

from measuring import Told, give, peak_mb, resident_mb, told

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

if TYPE_CHECKING:
    from uxsim_geo.demand.demand import Demand
    from uxsim_geo.network.network import Network
    from uxsim_geo.settings import Settings


def start_up() -> float:
    """Load the library and its compiled code by a run of one platoon; gives the seconds taken."""
    started = time.perf_counter()
    import pandas as pd

    from uxsim_geo.demand.demand import Demand
    from uxsim_geo.engine.simulation import simulate
    from uxsim_geo.network.network import Network
    from uxsim_geo.settings import Settings

    road = {"length": 500.0, "lanes": 1, "free_speed": 20.0, "jam_density": 0.2}
    ends = {"link_id": "ab", "from_node_id": "a", "to_node_id": "b"}
    links = pd.DataFrame([ends | road | {"capacity": float("nan"), "merge_priority": 1.0}])
    trips = {"origin": "a", "destination": "b", "start_s": 0.0, "end_s": 10.0, "vehicles": 5.0}
    nodes = pd.DataFrame({"node_id": ["a", "b"]})
    simulate(Network(nodes, links), Demand(pd.DataFrame([trips])), Settings(100.0, 5))
    return time.perf_counter() - started


def read(folder: Path) -> tuple[Network, Demand]:
    """Read the tables of a case."""
    import pandas as pd

    from uxsim_geo.demand.demand import Demand
    from uxsim_geo.network.network import Network

    names = dict.fromkeys(["node_id", "link_id", "from_node_id", "to_node_id"], "str")
    names |= dict.fromkeys(["origin", "destination"], "str")
    nodes, links, demand = (
        pd.read_csv(folder / f"{table}.csv", dtype=names) for table in ("nodes", "links", "demand")
    )
    banned = folder / "movements.csv"
    if banned.exists():
        return Network(nodes, links, pd.read_csv(banned, dtype="str")), Demand(demand)
    return Network(nodes, links), Demand(demand)


def settings(asked: Told) -> Settings:
    """Settings of the run."""
    from uxsim_geo.settings import Settings

    case = asked.case
    return Settings(
        case["duration"],
        case["platoon_size"],
        route_update_interval=case["route_update_interval"],
        demand_rounding=case["demand_rounding"],
        seed=asked.options["seed"],
    )


def run_whole(asked: Told) -> dict[str, float]:
    """Read, simulate, and have events and trips as tables."""
    from uxsim_geo.engine.simulation import Simulation
    from uxsim_geo.machine import Machine

    started = time.perf_counter()
    network, demand = read(asked.folder)
    how = settings(asked)
    run = Simulation(network, demand, how, machine=Machine(asked.case["threads"]))
    before = time.process_time()
    run.advance(how.duration)
    busy = time.process_time() - before
    result = run.result()
    whole = time.perf_counter() - started
    vehicles = result.trips["vehicles"]
    return {
        "engine_s": run.wall_s,
        "engine_cpu_s": busy,
        "whole_s": whole,
        "entries": len(result.log),
        "vehicles": float(vehicles.sum()),
        "completed": float(vehicles[result.trips["status"] == "completed"].sum()),
    }


def update_routes(asked: Told) -> dict[str, float]:
    """Update the routes again and again, while all are at home: ms of the first, and the median."""
    from uxsim_geo.engine.simulation import Simulation
    from uxsim_geo.machine import Machine

    started = time.perf_counter()
    network, demand = read(asked.folder)
    how = settings(asked)
    run = Simulation(network, demand, how, machine=Machine(asked.case["threads"]))
    ready = time.perf_counter() - started
    taken = []
    for number in range(asked.case["updates"]):
        begun = time.perf_counter()
        run.advance(number * how.route_update_interval + how.step)
        taken.append(1000 * (time.perf_counter() - begun))
    return {"whole_s": ready, "first_update_ms": taken[0], "update_ms": median(taken[1:])}


def main() -> None:
    """Run what the command line says."""
    asked = told()
    start = start_up()
    before = resident_mb()
    figures = update_routes(asked) if asked.case["updates"] else run_whole(asked)
    give(figures | {"start_s": start, "peak_mb": peak_mb(), "run_mb": peak_mb() - before})


if __name__ == "__main__":
    main()
