"""Time a reactive signal controller, called every 30 s, on a 10 × 10 grid with 50,000 vehicles.

python benchmarks/control.py [--runs N] prints the engine's time without control, under fixed
signals and under the controller, and the share of the last that control takes.
"""

from __future__ import annotations

import argparse
import statistics
import time

import numpy as np
from cases import grid

from uxsim_geo.control import OwnControl, Phase, Signal
from uxsim_geo.control.levers import Levers
from uxsim_geo.control.site import Measure
from uxsim_geo.control.traffic import Traffic
from uxsim_geo.demand.demand import Demand
from uxsim_geo.engine.simulation import Simulation
from uxsim_geo.network.network import Network
from uxsim_geo.settings import Settings

SIZE = 10


def is_along_row(link_id: str) -> bool:
    """Tell whether a link of the grid, "row,column-row,column", leads along its row."""
    start, end = link_id.split("-")
    return start.split(",")[0] == end.split(",")[0]


def signals(network: Network) -> list[Signal]:
    """Give every node a signal: one phase along the rows, one along the columns."""
    made = []
    for node, links in network.links.groupby("to_node_id")["link_id"]:
        along = tuple(link for link in links if is_along_row(link))
        across = tuple(link for link in links if not is_along_row(link))
        made.append(Signal(str(node), (Phase(30, along), Phase(30, across))))
    return made


class LongestQueueFirst:
    """Gives green to the phase whose links hold more standing vehicles."""

    def __init__(self) -> None:
        self.cell: np.ndarray | None = None

    def __call__(self, traffic: Traffic, levers: Levers) -> None:
        """Set the phase of every node from the queues that lead to it."""
        site = traffic.site
        if self.cell is None:
            phase = [0 if is_along_row(link_id) else 1 for link_id in site.link_ids]
            self.cell = 2 * site.to_node + np.array(phase)
        queues = np.bincount(self.cell, traffic.queue, minlength=2 * len(site.node_ids))
        levers.phase = queues.reshape(-1, 2).argmax(axis=1)


def run_once(network: Network, demand: Demand, control: list[Measure]) -> tuple[float, float]:
    """Run the case; gives the seconds of the run, and those of them that control took."""
    run = Simulation(network, demand, Settings(7200.0, 5), control=control)
    act, spent = run.steering.act, [0.0]

    def timed(*arguments: object) -> None:
        started = time.perf_counter()
        act(*arguments)
        spent[0] += time.perf_counter() - started

    run.steering.act = timed
    run.advance(7200.0)
    return run.wall_s, spent[0]


def main() -> None:
    """Run the three of them in turn, and print medians."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=9, help="runs of each (default 9)")
    runs = parser.parse_args().runs
    case = grid(SIZE)
    network, demand = Network(case.nodes, case.links), Demand(case.demand)
    fixed = signals(network)
    kinds = {
        "without control": list,
        "fixed signals": lambda: fixed,
        "reactive signals": lambda: [*fixed, OwnControl(LongestQueueFirst(), interval=30.0)],
    }
    taken: dict[str, list[tuple[float, float]]] = {kind: [] for kind in kinds}
    for number in range(runs + 1):
        for kind, control in kinds.items():
            figures = run_once(network, demand, control())
            if number:  # the first may compile
                taken[kind].append(figures)
    for kind, figures in taken.items():
        total = statistics.median(whole for whole, _ in figures)
        share = statistics.median(part / whole for whole, part in figures)
        print(f"{kind:<18} {1000 * total:8.1f} ms, of which control {100 * share:4.1f} %")


if __name__ == "__main__":
    main()
