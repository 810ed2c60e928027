"""Tables of the benchmarks' cases, and those that are drawn: grids of any size.

All are plain tables that every engine is given alike, as CSV files (:func:`write_tables`).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

#: what engines are told of a link
LINK_COLUMNS = [
    "link_id",
    "from_node_id",
    "to_node_id",
    "length",
    "lanes",
    "free_speed",
    "jam_density",
    "capacity",
    "merge_priority",
]

BLOCK, CITY_BLOCK = 1000.0, 300.0  # m between two neighbours in a grid


@dataclass(frozen=True)
class Tables:
    """Nodes (node_id, x, y in m), links, demand and banned turns, as uxsim_geo names them."""

    nodes: pd.DataFrame
    links: pd.DataFrame
    demand: pd.DataFrame
    movements: pd.DataFrame = field(default_factory=pd.DataFrame)


def write_tables(tables: Tables, folder: Path) -> None:
    """Write a case's tables into ``folder``, made if absent."""
    folder.mkdir(parents=True, exist_ok=True)
    tables.nodes[["node_id", "x", "y"]].to_csv(folder / "nodes.csv", index=False)
    tables.links[LINK_COLUMNS].to_csv(folder / "links.csv", index=False)
    tables.demand.to_csv(folder / "demand.csv", index=False)
    if len(tables.movements):
        tables.movements.to_csv(folder / "movements.csv", index=False)


def streets(size: int, block: float, lanes: int) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Nodes ``row,column`` of a square grid, and links both ways between them, ``block`` m long."""
    at = np.arange(size * size)
    row, column = at // size, at % size
    names = np.array([f"{i},{j}" for i, j in zip(row, column, strict=True)], dtype=object)
    nodes = pd.DataFrame({"node_id": names, "x": column * block, "y": row * block})
    along, down = at[column < size - 1], at[row < size - 1]
    start = np.concatenate([along, along + 1, down, down + size])
    end = np.concatenate([along + 1, along, down + size, down])
    links = pd.DataFrame({"from_node_id": names[start], "to_node_id": names[end]})
    links.insert(0, "link_id", links["from_node_id"] + "-" + links["to_node_id"])
    links = links.assign(length=block, lanes=lanes, free_speed=20.0, jam_density=0.2)
    return nodes, links.assign(capacity=np.nan, merge_priority=1.0)


def grid(size: int = 11) -> Tables:
    """Trips between opposite sides of a grid in an hour; 11 × 11 have 60,500 vehicles."""
    nodes, links = streets(size, BLOCK, lanes=1)
    one, other = (side.ravel() for side in np.indices((size, size)))
    first, last = np.zeros_like(one), np.full_like(one, size - 1)
    ends = [((first, one), (last, other)), ((one, first), (other, last))]
    pairs = [(a, b) for there, back in ends for a, b in ((there, back), (back, there))]
    names = nodes["node_id"].to_numpy()
    start = np.concatenate([names[a * size + b] for (a, b), _ in pairs])
    end = np.concatenate([names[a * size + b] for _, (a, b) in pairs])
    demand = pd.DataFrame({"origin": start, "destination": end, "start_s": 0.0, "end_s": 3600.0})
    return Tables(nodes, links, demand.assign(vehicles=0.035 * 3600))


def city(size: int, zones: int, vehicles: float, period: float, *, seed: int = 0) -> Tables:
    """Trips between all pairs of zones, nodes of a grid drawn at random, evenly over a period, s.

    Every pair has whole platoons of five, and nearly as many as any other.
    """
    nodes, links = streets(size, CITY_BLOCK, lanes=2)
    draws = np.random.default_rng(seed)
    zone = draws.permutation(nodes["node_id"].to_numpy())[:zones]
    start, end = np.nonzero(~np.eye(zones, dtype=bool))
    least, more = divmod(round(vehicles / 5), start.size)
    platoons = np.full(start.size, least)
    platoons[draws.permutation(start.size)[:more]] += 1
    demand = pd.DataFrame({"origin": zone[start], "destination": zone[end]})
    demand = demand.assign(start_s=0.0, end_s=period, vehicles=5.0 * platoons)
    return Tables(nodes, links, demand[platoons > 0])


def at_home(tables: Tables, destinations: int, departure: float, *, seed: int = 0) -> Tables:
    """The network with nobody on the road: a platoon to each of some nodes, from ``departure``, s.

    An update of the routes to all of these nodes is then all that there is to do before.
    """
    draws = np.random.default_rng(seed)
    ends = draws.permutation(tables.nodes["node_id"].to_numpy())[:destinations]
    demand = pd.DataFrame({"origin": np.roll(ends, 1), "destination": ends})
    demand = demand.assign(start_s=departure, end_s=departure + 100.0, vehicles=5.0)
    return Tables(tables.nodes, tables.links, demand, tables.movements)
