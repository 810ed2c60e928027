"""Time the search for routes with banned turns against that without, on a grid of 60 × 60 nodes.

python benchmarks/bans.py [--runs N] [NETWORK] prints ms of CPU time for an update of the routes to
100 destinations without bans, and with random bans on 0.3, 1 and 5 % of all turns, U-turns among
them; for a folder with the tables of a network (``RUN/network``), with the bans of its own as well.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from cases import grid

from uxsim_geo.demand.demand import Demand
from uxsim_geo.engine.simulation import Simulation
from uxsim_geo.network.files import read_network
from uxsim_geo.network.network import Network
from uxsim_geo.settings import Settings

SHARES = (0.003, 0.01, 0.05)
DESTINATIONS = 100
INTERVAL = 100.0  # s between two updates of routes
UPDATES = 5  # that are timed together
DURATION = 1e6


def grid_network() -> Network:
    """A grid of links of many lengths and speeds."""
    case, draws = grid(60), np.random.default_rng(0)
    links = case.links.assign(
        length=draws.uniform(100, 300, len(case.links)),
        free_speed=draws.choice([8.0, 14.0, 20.0], len(case.links)),
    )
    return Network(case.nodes, links)


def with_bans(network: Network, share: float) -> Network:
    """Ban a share of all turns, drawn at random, in place of the bans that there are."""
    links = network.links[["link_id", "from_node_id", "to_node_id"]]
    turns = links.merge(links, left_on="to_node_id", right_on="from_node_id", suffixes=("", "_to"))
    number = round(share * len(turns))
    chosen = np.random.default_rng(1).choice(len(turns), number, replace=False)
    turns = turns.iloc[np.sort(chosen)]
    columns = {
        "node_id": turns["to_node_id"],
        "from_link_id": turns["link_id"],
        "to_link_id": turns["link_id_to"],
    }
    return replace(network, movements=pd.DataFrame(columns, dtype="str"))


def prepared(network: Network) -> Simulation:
    """A run that does nothing but update routes: everybody leaves home at its very end."""
    draws = np.random.default_rng(2)
    ends = draws.choice(network.nodes["node_id"].to_numpy(), DESTINATIONS, replace=False)
    columns = {"origin": np.roll(ends, 1), "destination": ends, "vehicles": 5.0}
    table = pd.DataFrame(columns).assign(start_s=DURATION - 100, end_s=DURATION)
    told = Settings(DURATION, 5, route_update_interval=INTERVAL, route_noise=0.3)
    return Simulation(network, Demand(table), told)


def time_updates(run: Simulation) -> float:
    """CPU time of one update, s."""
    started = time.process_time()
    run.advance(run.time + UPDATES * INTERVAL)
    return (time.process_time() - started) / UPDATES


def main() -> None:
    """Time all networks in turn, and print the least times and their ratios."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=10, help="runs of each (default 10)")
    parser.add_argument("network", nargs="?", type=Path, help="folder of a network's tables")
    told = parser.parse_args()
    network = grid_network() if told.network is None else read_network(told.network)
    networks = {"no bans": with_bans(network, 0.0)}
    if len(network.movements):
        networks["its own bans"] = network
    networks |= {f"{share:.1%} of turns": with_bans(network, share) for share in SHARES}
    runs = {name: prepared(one) for name, one in networks.items()}
    least = dict.fromkeys(runs, np.inf)
    for _ in range(told.runs):
        for name, run in runs.items():
            least[name] = min(least[name], time_updates(run))
    for name, seconds in least.items():
        routes = runs[name].world.routes
        size = f"{routes.vertex.size - 1} vertices, {routes.arc.size} arcs"
        ratio = seconds / least["no bans"] - 1
        bans = len(networks[name].movements)
        print(f"{name:<14} {1000 * seconds:8.1f} ms {ratio:+7.1%}   {bans} bans, {size}")


if __name__ == "__main__":
    main()
