"""Peak memory of a run, MB, with its events in memory or going to a file, and of its analysis.

python benchmarks/memory.py [--vehicles MILLIONS] [--platoon VEHICLES] [--steps …] runs every step
in a process of its own. The case is a city of 39,600 links and 200 zones, into which a million
vehicles an hour drive: with more vehicles the run is longer, and the streets are as full as ever.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from cases import city
from measuring import peak_mb

if TYPE_CHECKING:
    from uxsim_geo.demand.demand import Demand
    from uxsim_geo.network.network import Network
    from uxsim_geo.settings import Settings

SIZE, ZONES = 100, 200
STEPS = ("in memory", "to a file", "analysis")
BIN = 300.0  # s


def simulate(
    network: Network, demand: Demand, settings: Settings, folder: Path, *, to_file: bool
) -> dict[str, float]:
    """Simulate, and leave the tables in a folder if the events go to a file."""
    from uxsim_geo.engine.simulation import simulate

    before, started = peak_mb(), time.perf_counter()
    events = folder / "events.parquet" if to_file else None
    result = simulate(network, demand, settings, events_file=events)
    took, peak = time.perf_counter() - started, peak_mb()
    if to_file:
        result.trips.to_parquet(folder / "trips.parquet")
    figures = {"before": before, "peak": peak, "s": took, "of engine": result.engine_wall_s}
    return figures | {"entries": len(result.log), "platoons": len(result.trips)}


def analyse(network: Network, settings: Settings, folder: Path) -> dict[str, float]:
    """States of all links in time bins, and the summary, of a run in files."""
    from uxsim_geo.analysis.link_states import link_states
    from uxsim_geo.analysis.summary import summary
    from uxsim_geo.events import EventFile
    from uxsim_geo.result import Result

    before, started = peak_mb(), time.perf_counter()
    log = EventFile(folder / "events.parquet", pd.Index(network.links["link_id"]))
    result = Result(log, pd.read_parquet(folder / "trips.parquet"), settings, 0.0, 0)
    link_states(result, network, bin_s=BIN)
    after_states = peak_mb()
    summary(result, network)
    took = time.perf_counter() - started
    return {"before": before, "states": after_states, "peak": peak_mb(), "s": took}


def one_step(step: str, vehicles: float, platoon: int, folder: Path) -> dict[str, float]:
    """Do one step in this process."""
    from uxsim_geo.demand.demand import Demand
    from uxsim_geo.network.network import Network
    from uxsim_geo.settings import Settings

    period = 3600 * vehicles / 1e6
    tables = city(SIZE, ZONES, vehicles, period)
    network, settings = Network(tables.nodes, tables.links), Settings(period + 3600, platoon)
    if step == "analysis":
        return analyse(network, settings, folder)
    demand = Demand(tables.demand)
    return simulate(network, demand, settings, folder, to_file=step == "to a file")


def main() -> None:
    """Run the steps one after the other, and print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vehicles", type=float, default=1.0, help="millions (default 1)")
    parser.add_argument("--platoon", type=int, default=5, help="vehicles in one (default 5)")
    parser.add_argument("--steps", nargs="+", choices=STEPS, default=STEPS)
    parser.add_argument("--folder", type=Path, help="for the files (default: a temporary one)")
    parser.add_argument("--here", choices=STEPS, help=argparse.SUPPRESS)
    told = parser.parse_args()
    if told.here:
        figures = one_step(told.here, 1e6 * told.vehicles, told.platoon, told.folder)
        print(json.dumps(figures))
        return
    with tempfile.TemporaryDirectory() as temporary:
        folder = ["--folder", str(told.folder or temporary)]
        for step in told.steps:
            command = [sys.executable, *sys.argv, *folder, "--here", step]
            done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
            figures = json.loads(done.stdout.splitlines()[-1])
            words = (f"{name} {value:,.0f}" for name, value in figures.items())
            print(f"{step:<10} {', '.join(words)}", flush=True)


if __name__ == "__main__":
    main()
