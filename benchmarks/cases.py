"""The cases of the benchmarks, as plain tables that every engine is given alike."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

REPOSITORY = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(REPOSITORY))


class Case(NamedTuple):
    """One case: nodes (node_id, x, y), links, demand (as uxsim_geo's), Δn, duration in s."""

    nodes: pd.DataFrame
    links: pd.DataFrame
    demand: pd.DataFrame
    platoon_size: int
    duration: float


def sioux_falls(platoon_size: int) -> Case:
    """The paper's Sioux Falls, from the shipped data: 37,502 vehicles in two hours."""
    folder = REPOSITORY / "data" / "sioux_falls"
    rows = (folder / "sioux_falls_net.tntp").read_text().split("<END OF METADATA>")[1]
    ends = [line.split()[:2] for line in rows.splitlines() if line.strip()[:1].isdigit()]
    lengths = [line.split()[3] for line in rows.splitlines() if line.strip()[:1].isdigit()]
    links = pd.DataFrame(ends, columns=["from_node_id", "to_node_id"])
    links["link_id"] = links["from_node_id"] + "-" + links["to_node_id"]
    links["length"] = np.array(lengths, float) * 1000
    given = pd.read_csv(folder / "overrides.csv", dtype={"link_id": "str"})
    links = links.merge(given, on="link_id")
    links["capacity"] = np.nan
    ids = sorted(set(links["from_node_id"]), key=int)
    nodes = pd.DataFrame({"node_id": ids, "x": range(len(ids)), "y": 0})
    return Case(nodes, links, _tntp_demand(folder / "sioux_falls_trips.tntp"), platoon_size, 7200)


def _tntp_demand(path: Path) -> pd.DataFrame:
    rows, origin = [], ""
    for line in path.read_text().split("<END OF METADATA>")[1].splitlines():
        if line.startswith("Origin"):
            origin = line.split()[1]
        else:
            pairs = [item.split(":") for item in line.split(";") if ":" in item]
            rows += [(origin, end.strip(), 0.0, 4800.0, 0.104 * float(v)) for end, v in pairs]
    table = pd.DataFrame(rows, columns=["origin", "destination", "start_s", "end_s", "vehicles"])
    return table[(table["vehicles"] > 0) & (table["origin"] != table["destination"])]


def grid(platoon_size: int, size: int = 11) -> Case:
    """The grid of the reference: 60,500 vehicles between opposite sides in an hour."""
    rows, pairs = [], []
    for i in range(size):
        for j in range(size):
            for a, b in ((i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)):
                if 0 <= a < size and 0 <= b < size:
                    rows.append((f"{i},{j}", f"{a},{b}"))
            pairs += [
                (f"0,{i}", f"{size - 1},{j}"),
                (f"{size - 1},{i}", f"0,{j}"),
                (f"{i},0", f"{j},{size - 1}"),
                (f"{i},{size - 1}", f"{j},0"),
            ]
    links = pd.DataFrame(rows, columns=["from_node_id", "to_node_id"])
    links.insert(0, "link_id", links["from_node_id"] + "-" + links["to_node_id"])
    links = links.assign(
        length=1000.0, free_speed=20.0, jam_density=0.2, lanes=1, merge_priority=1.0
    )
    links["capacity"] = np.nan
    demand = pd.DataFrame(pairs, columns=["origin", "destination"])
    demand = demand.assign(start_s=0.0, end_s=3600.0, vehicles=0.035 * 3600)
    nodes = pd.DataFrame({"node_id": [f"{i},{j}" for i in range(size) for j in range(size)]})
    nodes = nodes.assign(x=np.repeat(range(size), size), y=np.tile(range(size), size))
    return Case(nodes, links, demand, platoon_size, 7200)


CASES = {
    "Sioux Falls, Δn 5": lambda: sioux_falls(5),
    "Sioux Falls, Δn 1": lambda: sioux_falls(1),
    "grid 11 × 11, Δn 5": lambda: grid(5),
}
