"""Read UXsim's three scenario tables, to run its published cases in the tests.

Columns are bound by position; a trailing comma or a further column is passed over. Tables made on
Japanese systems are in cp932 instead of UTF-8.
"""

from __future__ import annotations

import csv
import io
from pathlib import Path

import pandas as pd

from uxsim_geo.demand.demand import Demand
from uxsim_geo.network.network import Network

NODE_FIELDS = ("node_id", "x", "y")
LINK_FIELDS = (
    "link_id",
    "from_node_id",
    "to_node_id",
    "length",
    "free_speed",
    "jam_density",
    "merge_priority",
)
DEMAND_FIELDS = ("origin", "destination", "start_s", "end_s", "flow")


def read_uxsim_network(nodes: Path, links: Path) -> Network:
    """Nodes and links of one lane without geometry; nodes keep UXsim's x and y beside theirs."""
    node_table = _read_table(nodes, NODE_FIELDS, numbers=("x", "y"))
    node_table.insert(1, "zone_id", node_table["node_id"])
    node_table.insert(2, "control", "none")
    node_table.insert(3, "through_traffic", True)
    link_table = _read_table(links, LINK_FIELDS, numbers=LINK_FIELDS[3:])
    link_table.insert(4, "lanes", 1)
    link_table.insert(7, "capacity", float("nan"))
    link_table["road_class"] = ""
    link_table["name"] = link_table["link_id"]
    link_table["source_id"] = link_table["link_id"]
    link_table["lanes_source"] = "assumed"
    link_table["free_speed_source"] = "given"
    return Network(node_table, link_table)


def read_uxsim_demand(path: Path) -> Demand:
    """One row a row of the file: vehicles = flow (veh/s) times the period."""
    table = _read_table(path, DEMAND_FIELDS, numbers=DEMAND_FIELDS[2:])
    table["vehicles"] = table.pop("flow") * (table["end_s"] - table["start_s"])
    return Demand(table)


def _read_table(path: Path, fields: tuple[str, ...], *, numbers: tuple[str, ...]) -> pd.DataFrame:
    rows = [row[: len(fields)] for row in csv.reader(io.StringIO(_text(path))) if row]
    table = pd.DataFrame(rows[1:], columns=list(fields), dtype="str")
    return table.astype(dict.fromkeys(numbers, "float64"))


def _text(path: Path) -> str:
    data = path.read_bytes()
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp932")
