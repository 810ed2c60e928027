"""movement.csv to banned turns: at nodes that occur in it, what it does not list is banned."""

from __future__ import annotations

import numpy as np
import pandas as pd

from uxsim_geo.network.both_ways import REVERSE
from uxsim_geo.network.csv_table import CsvTable, id_cells, is_missing
from uxsim_geo.network.gmns_nodes import add_id_faults, add_reference_faults
from uxsim_geo.network.gmns_reading import Reading
from uxsim_geo.network.gmns_uses import are_allowed
from uxsim_geo.network.network import MOVEMENT_COLUMNS
from uxsim_geo.network.rows import is_among

#: columns of movement.csv that would change a simulation, and that this one does not know
IGNORED = ("penalty", "capacity")

REFERENCES = {"node_id": "node", "ib_link_id": "link", "ob_link_id": "link"}


def add_movement_faults(reading: Reading) -> None:
    """Note movements between what is not there, or does not meet at their node."""
    table = reading.tables.get("movement")
    if table is None:
        return
    faults = reading.faults["movement"]
    add_id_faults(table, "mvmt_id", faults)
    for name, of in REFERENCES.items():
        known = pd.Series(id_cells(reading.tables[of], f"{of}_id"), dtype="str", name=f"{of}_id")
        add_reference_faults(table, name, known, faults)
        for cell, line in zip(table.cells(name), table.lines, strict=True):
            if is_missing(cell):
                faults.add("needs a value", line=line, column=name)
    _add_meeting_faults(reading, table)


def _add_meeting_faults(reading: Reading, table: CsvTable) -> None:
    """The inbound link must end at the node, the outbound one begin there (or be undirected)."""
    links = reading.links
    ids = [id_cells(links, name) for name in ("link_id", "from_node_id", "to_node_id")]
    two_way = [cell.strip().lower() in ("0", "false", "no") for cell in links.cells("directed")]
    ends_of = {row[0]: row[1:] for row in zip(*ids, two_way, strict=True)}
    known = set(id_cells(reading.nodes, "node_id")) - {None}
    for name, side, verb in (("ib_link_id", 1, "end"), ("ob_link_id", 0, "begin")):
        places = zip(id_cells(table, name), id_cells(table, "node_id"), table.lines, strict=True)
        for link_id, node_id, line in places:
            ends = ends_of.get(link_id)
            if link_id is None or node_id not in known or ends is None:
                continue
            if node_id not in (ends[:2] if ends[2] else (ends[side],)):
                what = f"does not {verb} at node {node_id}"
                reading.faults["movement"].add(what, line=line, column=name, value=link_id)


def read_movements(reading: Reading, links: pd.DataFrame) -> pd.DataFrame:
    """Banned turns, in the order of their from-links and to-links."""
    table = reading.tables.get("movement")
    if table is None:
        return pd.DataFrame({name: pd.Series(dtype="str") for name in MOVEMENT_COLUMNS})
    listed = pd.DataFrame({name: pd.Series(id_cells(table, name)) for name in REFERENCES})
    turns = turns_at(pd.Index(listed["node_id"]), links)
    allowed = listed[are_allowed(table, reading.options)]
    banned = turns[~is_among(_pairs(turns), _allowed_pairs(allowed, links))]
    _note_movements(reading, table, banned, turns)
    return banned.reset_index(drop=True).astype("str")


def turns_at(nodes: pd.Index, links: pd.DataFrame) -> pd.DataFrame:
    """Every pair of links that meet at one of the nodes, in the order of their rows."""
    sides = []
    for side, end in (("from_link_id", "to_node_id"), ("to_link_id", "from_node_id")):
        own = links[["link_id", end]].set_axis([side, "node_id"], axis=1)
        sides.append(own.assign(row=np.arange(len(links)))[is_among(own["node_id"], nodes)])
    turns = sides[0].merge(sides[1], on="node_id", suffixes=("_in", "_out"))
    turns = turns.sort_values(["row_in", "row_out"], kind="stable", ignore_index=True)
    return turns[list(MOVEMENT_COLUMNS)]


def _pairs(turns: pd.DataFrame) -> pd.MultiIndex:
    return pd.MultiIndex.from_frame(turns[["from_link_id", "to_link_id"]])


def _allowed_pairs(allowed: pd.DataFrame, links: pd.DataFrame) -> pd.MultiIndex:
    """Listed turns, each also in the opposite directions of undirected links that it may mean."""
    own = links[["link_id", "source_id", "from_node_id", "to_node_id"]]
    own = own.assign(file_id=own["link_id"].str.removesuffix(REVERSE))
    own["file_id"] = own["file_id"].where(own["file_id"] == own["source_id"], own["link_id"])
    inbound = own[["file_id", "to_node_id", "link_id"]]
    inbound = inbound.set_axis(["ib_link_id", "node_id", "from_link_id"], axis=1)
    outbound = own[["file_id", "from_node_id", "link_id"]]
    outbound = outbound.set_axis(["ob_link_id", "node_id", "to_link_id"], axis=1)
    known = allowed.astype("str").merge(inbound, on=["ib_link_id", "node_id"])
    known = known.merge(outbound, on=["ob_link_id", "node_id"])
    return _pairs(known)


def _note_movements(
    reading: Reading, table: CsvTable, banned: pd.DataFrame, turns: pd.DataFrame
) -> None:
    if len(banned):
        note = "at nodes where movement.csv lists turns, all others are banned; value: turns"
        reading.notes.add("banned turns", note, value=len(banned))
    for name in IGNORED:
        stated = sum(not is_missing(cell) for cell in table.cells(name))
        if stated:
            note = f"the {name} of a movement is not simulated; value: rows"
            reading.notes.add("movements", note, severity="warning", value=stated)
    left = turns.groupby("from_link_id")["to_link_id"].size()
    closed = banned.groupby("from_link_id")["to_link_id"].size()
    ends = closed[closed == left.reindex(closed.index)].index
    order = [link_id for link_id in turns["from_link_id"].drop_duplicates() if link_id in ends]
    note = "movement.csv lists no turn from this link, at a node where it lists others: a dead end"
    reading.notes.warn_each("dead end", note, order, [None] * len(order))
