"""TNTP net files: their rows as a table, and everything in them that cannot be used as a fault."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from uxsim_geo.errors import Faults
from uxsim_geo.network.placeholders import placeholders
from uxsim_geo.network.tntp_options import TntpOptions
from uxsim_geo.network.tntp_rows import (
    TntpRows,
    add_value_faults,
    id_column,
    number,
    number_column,
    read_rows,
    tag_number,
    text_column,
)
from uxsim_geo.network.units import Quantity

#: other names under which the two ends of a link are found
END_NAMES = {
    "init_node": ("init_node", "from", "from_node", "tail", "tail_node"),
    "term_node": ("term_node", "to", "to_node", "head", "head_node"),
}

#: what they are called from here on
ENDS = ["from_node_id", "to_node_id"]

#: columns that hold numbers wherever they occur; others may hold text
NUMBER_COLUMNS = (
    "capacity",
    "length",
    "free_flow_time",
    "b",
    "power",
    "speed",
    "toll",
    "lanes",
    "critical_speed",
)

#: no length, time, speed or capacity is as large as this in any unit
LARGEST = 1e15

#: columns in a unit that the file does not state
QUANTITIES: dict[str, Quantity] = {
    "length": "length",
    "free_flow_time": "time",
    "capacity": "capacity",
    "speed": "speed",
}


@dataclass(frozen=True)
class NetFile:
    """A net file as it is, before any conversion.

    table
        from_node_id, to_node_id (text), the file's other columns under their own names (the
        known ones float64 in the file's units) and line; rows as in the file
    placeholders
        columns among capacity, free_flow_time and speed that hold no measured values
    zones, nodes, links, first_thru_node
        as declared, None where the file is silent
    """

    table: pd.DataFrame
    placeholders: frozenset[str]
    zones: int | None
    nodes: int | None
    links: int | None
    first_thru_node: int | None


def read_net(path: Path, options: TntpOptions, faults: Faults) -> NetFile | None:
    """Read a net file; None, and at least one fault, where nothing can be made of it."""
    rows = read_rows(path, faults, metadata=True)
    if rows is None:
        return None
    tags = ("NUMBER OF ZONES", "NUMBER OF NODES", "NUMBER OF LINKS", "FIRST THRU NODE")
    zones, nodes, links, first_thru_node = (tag_number(rows, tag, faults) for tag in tags)
    used = used_columns(options)
    ends = {end: find_column(rows, end, names, faults) for end, names in END_NAMES.items()}
    for name in used:
        find_column(rows, name, (name,), faults)
    if faults.found:
        return None
    table = _table(rows, {ends["init_node"], ends["term_node"]}, faults)
    table.insert(0, "from_node_id", id_column(rows, ends["init_node"], faults))
    table.insert(1, "to_node_id", id_column(rows, ends["term_node"], faults))
    net = NetFile(table, placeholders(table), zones, nodes, links, first_thru_node)
    _add_value_faults(net, rows, used, faults)
    _add_unit_faults(net, options, used, faults)
    _add_count_faults(net, rows, faults)
    _add_first_thru_node_faults(net, rows, options, faults)
    return net


def used_columns(options: TntpOptions) -> list[str]:
    """The columns that the conversion reads and that must hence be there."""
    used = ["length", "free_flow_time" if options.free_speed_from == "time" else "speed"]
    return [*used, "capacity"] if options.capacity == "file" else used


def find_column(rows: TntpRows, wanted: str, names: tuple[str, ...], faults: Faults) -> str:
    """Under which of ``names`` the file has the column; a fault if under none."""
    for name in names:
        if name in rows.names:
            return name
    present = ", ".join(rows.names)
    faults.add(f"lacks the column {wanted} (columns here: {present})")
    return ""


def _table(rows: TntpRows, ends: set[str], faults: Faults) -> pd.DataFrame:
    columns: dict[str, np.ndarray | pd.Series] = {}
    for place, name in enumerate(rows.names):
        if name in ends:
            continue
        numeric = name in NUMBER_COLUMNS or (
            name != "link_type"
            and all(number(row[place]) is not None for row in rows.rows if row[place])
        )
        read = number_column(rows, name, faults) if numeric else text_column(rows, name)
        columns[name] = read
    return pd.DataFrame({**columns, "line": rows.lines})


def _add_value_faults(net: NetFile, rows: TntpRows, used: list[str], faults: Faults) -> None:
    table = net.table
    for name in [name for name in (*QUANTITIES, "lanes") if name in table]:
        values = np.asarray(table[name], dtype=np.float64)
        add_value_faults(faults, rows, values < 0, name, "must not be negative")
        if name in used:
            what = "is needed here and must be a number, finite and of a sensible size"
            if name == "free_flow_time":
                what += "; or take the column speed by free_speed_from: speed"
            add_value_faults(faults, rows, ~((values < LARGEST) | (values < 0)), name, what)
    if "lanes" in table:
        lanes = np.asarray(table["lanes"], dtype=np.float64)
        what = "must be a number above 0"
        add_value_faults(faults, rows, np.isnan(lanes) | (lanes == 0), "lanes", what)
    if "capacity" in used and "capacity" not in net.placeholders:
        zero = np.asarray(table["capacity"] == 0)
        what = "must not be 0: nothing could leave the link; or set capacity: diagram"
        add_value_faults(faults, rows, zero, "capacity", what)


def _add_unit_faults(net: NetFile, options: TntpOptions, used: list[str], faults: Faults) -> None:
    """A column that is needed has a unit that the file cannot tell: the options must."""
    table = net.table
    for name in used:
        if name in net.placeholders:
            continue
        quantity = QUANTITIES[name]
        unit = options.unit(quantity)
        if unit is None:
            sample = ", ".join(f"{value:g}" for value in table[name].drop_duplicates().iloc[:4])
            faults.add(
                f"the unit of this column must be stated as {quantity}_unit: the format has no "
                f"place for it, and {sample} ... could be anything",
                column=name,
            )
        elif unit.per_lane and "lanes" not in table:
            faults.add(
                "capacity_unit is one of each lane, but the file has no column lanes",
                column=name,
            )


def _add_count_faults(net: NetFile, rows: TntpRows, faults: Faults) -> None:
    if rows.whole and net.links is not None and len(net.table) < net.links:
        faults.add(
            f"{len(net.table)} links are here where the file declares {net.links}: it is cut",
            line=rows.tags["NUMBER OF LINKS"][1],
        )
    if net.nodes is None:
        return
    for column in ENDS:
        # ids above the number of nodes are unknown nodes, unless the ids are no numbering 1..N
        number_of = pd.to_numeric(net.table[column], errors="coerce")
        unknown = np.asarray(number_of > net.nodes)
        if unknown.mean() > 0.5:
            continue
        for index in np.flatnonzero(unknown):
            faults.add(
                f"unknown node: the file declares nodes 1 to {net.nodes}",
                line=rows.lines[index],
                column=column,
                value=net.table[column].iloc[index],
            )


def _add_first_thru_node_faults(
    net: NetFile, rows: TntpRows, options: TntpOptions, faults: Faults
) -> None:
    """Above every node's number it would leave no node with through traffic."""
    highest = pd.to_numeric(pd.concat([net.table[end] for end in ENDS]), errors="coerce").max()
    what = f"is above every node's number, of which the highest is {highest:.0f}"
    if options.first_thru_node is not None:
        if options.first_thru_node > highest:
            faults.add(what, column="first_thru_node", value=options.first_thru_node)
    elif net.first_thru_node is not None and net.first_thru_node > highest:
        value, line = rows.tags["FIRST THRU NODE"]
        what += "; correct it, or state first_thru_node"
        faults.add(what, line=line, column="<FIRST THRU NODE>", value=value)
