"""node.csv to the nodes of a network."""

from __future__ import annotations

import numpy as np
import pandas as pd

from uxsim_geo.errors import Faults
from uxsim_geo.network.csv_table import (
    CsvTable,
    add_cell_faults,
    id_cells,
    is_missing,
    number_column,
)
from uxsim_geo.network.gmns_reading import Reading
from uxsim_geo.network.measure import add_degree_faults, crs_doubt
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.rows import is_among

#: ctrl_type in small letters: what is simulated, and what means nothing (osm2gmns writes 0 and 1)
SIGNALS = ("signal", "signals", "signal_with_rtor", "traffic_signal", "1", "1.0")
NO_CONTROL = ("", "none", "no_control", "uncontrolled", "0", "0.0", "nan")

#: columns in which osm2gmns and its kin say that a node is where a zone's trips begin and end
CENTROID_COLUMNS = ("node_type", "activity_type")
CENTROIDS = ("centroid", "centroid node", "centroid_node")


def read_nodes(reading: Reading) -> pd.DataFrame:
    """node_id, zone_id, control, through_traffic, x, y and line, one row a row of the file."""
    table, faults = reading.nodes, reading.faults["node"]
    nodes = pd.DataFrame({"node_id": pd.Series(id_cells(table, "node_id"), dtype="str")})
    add_id_faults(table, "node_id", faults)
    add_reference_faults(table, "parent_node_id", nodes["node_id"], faults)
    nodes["zone_id"] = pd.Series(id_cells(table, "zone_id"), dtype="str")
    blank = np.array([" " in (zone or "") for zone in id_cells(table, "zone_id")], dtype=bool)
    add_cell_faults(faults, table, blank, "zone_id", "must be one zone, without a blank in it")
    nodes["control"] = pd.Series(_control(table, reading.notes), dtype="str")
    nodes["through_traffic"] = _through_traffic(table, reading.notes, faults)
    for column, name in (("x", "x_coord"), ("y", "y_coord")):
        nodes[column] = number_column(table, name, faults)
        empty = np.array([is_missing(cell) for cell in table.cells(name)], dtype=bool)
        add_cell_faults(faults, table, empty, name, "needs a value")
    if not len(nodes):
        faults.add("has no row")
    places = nodes[["x", "y"]].to_numpy(dtype=np.float64)
    add_degree_faults(places[np.isfinite(places).all(axis=1)], reading.crs, faults)
    doubt = crs_doubt(places, reading.crs)
    if doubt:
        reading.notes.add("doubtful CRS", doubt, severity="warning")
    return nodes.assign(line=table.lines)


def add_id_faults(table: CsvTable, name: str, faults: Faults) -> None:
    """Note rows without an id, and ids that stand on an earlier row."""
    first: dict[str, int] = {}
    for text, line in zip(id_cells(table, name), table.lines, strict=True):
        if text is None:
            faults.add("needs a value", line=line, column=name)
        elif text in first:
            what = f"stands on line {first[text]} too"
            faults.add(what, line=line, column=name, value=text)
        else:
            first[text] = line


def add_reference_faults(table: CsvTable, name: str, known: pd.Series, faults: Faults) -> None:
    """Note ids in a column that are not among those known; empty cells refer to nothing."""
    ids = pd.Series(id_cells(table, name), dtype="str")
    wrong = ids.notna().to_numpy() & ~is_among(ids, known)
    what = f"refers to a {str(known.name).removesuffix('_id')} that is not there"
    add_cell_faults(faults, table, wrong, name, what)


def _control(table: CsvTable, notes: Notes) -> list[str]:
    """Signal or none; signs, which are not simulated, are counted."""
    cells = [cell.strip().lower() for cell in table.cells("ctrl_type")]
    others = sorted({cell for cell in cells if cell not in (*SIGNALS, *NO_CONTROL)})
    for other in others:
        note = f"ctrl_type {other} is not simulated: such nodes have no control; value: nodes"
        notes.add("control", note, element="node", severity="warning", value=cells.count(other))
    return ["signal" if cell in SIGNALS else "none" for cell in cells]


def _through_traffic(table: CsvTable, notes: Notes, faults: Faults) -> np.ndarray:
    """False where trips may only begin and end: as the column says, otherwise at centroids."""
    if "uxsim_through_traffic" in table:
        cells = [cell.strip().lower() for cell in table.cells("uxsim_through_traffic")]
        wrong = np.array([cell not in ("true", "false") for cell in cells], dtype=bool)
        what = "must be true or false"
        add_cell_faults(faults, table, wrong, "uxsim_through_traffic", what)
        return np.array([cell != "false" for cell in cells], dtype=bool)
    centroid = np.zeros(len(table), dtype=bool)
    for name in CENTROID_COLUMNS:
        is_one = [cell.strip().lower() in CENTROIDS for cell in table.cells(name)]
        centroid |= np.array(is_one, dtype=bool)
    if centroid.any():
        note = "nodes of the type centroid: no through traffic; value: nodes"
        notes.add("centroids", note, element="node", value=int(centroid.sum()))
    return ~centroid
