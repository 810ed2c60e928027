"""UXsim's CSV files, nodes, links and demand, to network and demand tables, and back."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from uxsim_geo.demand.demand import DEMAND_COLUMNS, Demand
from uxsim_geo.errors import Faults
from uxsim_geo.network.csv_table import write_csv_table
from uxsim_geo.network.exact import float_text
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.uxsim_csv import Row, read_uxsim_rows
from uxsim_geo.network.uxsim_tables import (
    Cells,
    UxsimCsvOptions,
    inverses,
    link_cells,
    network_of_rows,
    node_cells,
    note_lost,
    note_rounded,
)

FILES = {"nodes": "nodes.csv", "links": "links.csv", "demand": "demand.csv"}


class Written(NamedTuple):
    """The files that were written, and in the form of import notes what has no place in them."""

    paths: list[Path]
    notes: pd.DataFrame


def read_uxsim_csv(
    nodes: Path, links: Path, demand: Path | None, options: UxsimCsvOptions | None = None
) -> tuple[Network, Demand]:
    """Read UXsim's three files; without a file of demand nobody travels.

    Columns and encodings are those of :mod:`uxsim_geo.network.uxsim_csv`. Raises
    :class:`uxsim_geo.errors.InputError` with all that is wrong in any of them.
    """
    rows = read_uxsim_rows(nodes, links, demand)
    _raise_if_closed(links, rows.links)
    network = network_of_rows(rows.nodes, rows.links, options or UxsimCsvOptions())
    return network, _demand(rows.demand)


def _raise_if_closed(path: Path, rows: list[Row]) -> None:
    faults = Faults(str(path))
    for line, values in rows:
        for name in ("capacity_out", "capacity_in"):
            if values.get(name) == 0:
                what = "must be above 0: nothing could pass; leave the link out"
                faults.add(what, line=line, column=name, value="0")
    faults.raise_if_any()


def _demand(rows: list[Row]) -> Demand:
    """One row a row of the file that sends anybody: flow (veh/s) times its period, or volume."""
    notes = Notes()
    told = [row.values for row in rows]
    columns = {
        "origin": [values["orig"] for values in told],
        "destination": [values["dest"] for values in told],
        "start_s": [values["t_start"] for values in told],
        "end_s": [values["t_end"] for values in told],
        "vehicles": [
            values["volume"]
            if "volume" in values
            else values["flow"] * (values["t_end"] - values["t_start"])
            for values in told
        ],
    }
    kinds = {"origin": "str", "destination": "str"}
    kinds |= dict.fromkeys(DEMAND_COLUMNS[2:], "float64")
    table = pd.DataFrame(columns).astype(kinds)
    empty = table["vehicles"] == 0
    if empty.any():
        note = "rows without a vehicle were left out"
        notes.add("empty rows", note, element="demand", value=int(empty.sum()))
    return Demand(table[~empty].reset_index(drop=True), notes.table())


def write_uxsim_csv(network: Network, demand: Demand, folder: Path) -> Written:
    """Write nodes.csv, links.csv and demand.csv into ``folder`` (made if absent).

    What the files have no place for, such as banned turns, is told in the notes returned; lanes
    and capacities stand in columns that UXsim itself passes over. Raises
    :class:`uxsim_geo.errors.InputError` with all that cannot be written, before anything is.
    """
    notes = Notes()
    faults = Faults("tables to be written for UXsim")
    tables: dict[str, Cells] = {
        "nodes": node_cells(network, faults),
        "links": link_cells(network, faults, notes),
        "demand": _demand_cells(demand.table, faults, notes),
    }
    faults.raise_if_any()
    note_lost(network, notes)
    for name in demand.table.columns.difference(list(DEMAND_COLUMNS), sort=False):
        told = int(demand.table[name].notna().sum())
        if told:
            what = f"the column {name}: UXsim's files have no place for it; value: rows"
            notes.add("not written", what, element="demand", severity="warning", value=told)
    folder.mkdir(parents=True, exist_ok=True)
    paths = [write_csv_table(folder / FILES[name], cells) for name, cells in tables.items()]
    return Written(paths, notes.table())


def _demand_cells(table: pd.DataFrame, faults: Faults, notes: Notes) -> Cells:
    values = {name: table[name].to_numpy(np.float64) for name in DEMAND_COLUMNS[2:]}
    start, end, vehicles = values.values()
    if not np.isfinite(np.array([start, end, vehicles])).all() or not (end > start).all():
        faults.add("rows of the demand need finite vehicles, and an end_s after their start_s")
        return {}
    period = (end - start).tolist()
    flow, rounded = inverses(
        vehicles.tolist(), (vehicles / (end - start)).tolist(), lambda q, row: q * period[row]
    )
    note_rounded(notes, "q", rounded)
    return {
        "orig": table["origin"].tolist(),
        "dest": table["destination"].tolist(),
        "start_t": list(map(float_text, start.tolist())),
        "end_t": list(map(float_text, end.tolist())),
        "q": list(map(float_text, flow)),
    }
