"""Demand of GMNS folders, in and out.

The specification has no table of demand. Its users write zones and trips, as ``o_zone_id``,
``d_zone_id`` and ``volume``; that is read here, under the other names that occur too. What is
written says more: the nodes and the times of each row, so that it reads back as the same table.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd

from uxsim_geo.control.signals import Signal
from uxsim_geo.demand.demand import DEMAND_COLUMNS, Demand
from uxsim_geo.demand.loading import (
    add_zone_faults,
    between_zones,
    over_time,
    zone_nodes,
    zone_trips_at_nodes,
)
from uxsim_geo.demand.profile import TripsOptions
from uxsim_geo.errors import Faults
from uxsim_geo.network.csv_table import (
    CsvTable,
    add_cell_faults,
    id_cells,
    is_missing,
    number_column,
    read_csv_table,
)
from uxsim_geo.network.gmns_columns import (
    blank_of,
    cells_of,
    column_type,
    extra_columns,
    in_order,
    read_described,
)
from uxsim_geo.network.gmns_nodes import add_reference_faults
from uxsim_geo.network.gmns_tables import GmnsUnits, read_if_there, table_path
from uxsim_geo.network.gmns_write import Cells, columns_table, gmns_tables, write_tables
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.rows import is_among

UnknownZones = Literal["fault", "drop"]
ZoneNodes = Literal["all", "own"]

#: names under which the zones and the trips are found
NAMES = {
    "origin_zone": ("o_zone_id", "orig_zone_id", "from_zone_id", "orig_taz", "o_zone", "origin"),
    "destination_zone": ("d_zone_id", "dest_zone_id", "to_zone_id", "dest_taz", "d_zone", "dest"),
    "trips": ("volume", "total", "trips", "demand", "vehicles"),
}

#: of what is written here: node ids and s after the start
NODES, TIMES = ("o_node_id", "d_node_id"), ("start_s", "end_s")

ROUTE = "uxsim_route"


def read_gmns_demand(
    folder: Path,
    network: Network,
    options: TripsOptions | None = None,
    *,
    unknown_zones: UnknownZones = "fault",
    zone_nodes: ZoneNodes = "all",
) -> Demand:
    """Read demand.csv of a GMNS folder into demand between nodes of ``network``.

    Trips between zones depart within the period of ``options`` and start and end at all nodes of
    their zones in even parts, or where ``zone_nodes`` is ``own`` at the node that has the zone's
    id, if there is one. Trips of zones that the network has not are a fault, or left out and noted
    (``unknown_zones`` drop). A table that names nodes and times, as this library writes it, is read
    as it stands and needs no options.

    Raises :class:`uxsim_geo.errors.InputError` with all that is wrong in the table.
    """
    faults = Faults(str(table_path(folder, "demand")))
    table = read_csv_table(table_path(folder, "demand"), faults)
    faults.raise_if_any()
    assert table is not None, "a table that cannot be read is a fault"
    if all(name in table for name in (*NODES, *TIMES)):
        return _between_nodes(folder, table, network, faults)
    notes = Notes()
    cells = _between_named_zones(table, faults)
    if options is None:
        what = "does not say when its trips depart: state the period (demand_period_s)"
        faults.add(what)
    loaded = _loaded(network) if zone_nodes == "own" else network
    if unknown_zones == "drop" and not faults.found:
        cells = _without_unknown(cells, loaded, notes)
    add_zone_faults(cells, loaded, faults)
    faults.raise_if_any()
    assert options is not None, "options that are missing are a fault"
    at_nodes = zone_trips_at_nodes(between_zones(cells, options, notes), loaded, notes)
    return Demand(over_time(at_nodes, options), notes.table())


def _between_named_zones(table: CsvTable, faults: Faults) -> pd.DataFrame:
    """origin_zone, destination_zone (text), trips and line; empty cells of trips are 0."""
    found: dict[str, str] = {}
    for name, names in NAMES.items():
        there = [one for one in names if one in table]
        if len(there) != 1:
            which = f"only one of {', '.join(there)}" if there else f"one of {', '.join(names)}"
            what = f"must have {which} (columns here: {', '.join(table.columns)})"
            faults.add(what, line=1)
        found[name] = there[0] if there else ""
    columns: dict[str, pd.Series] = {}
    for name in ("origin_zone", "destination_zone"):
        ids = id_cells(table, found[name])
        missing = np.array([one is None for one in ids], dtype=bool)
        if found[name]:
            add_cell_faults(faults, table, missing, found[name], "needs a zone")
        columns[name] = pd.Series(ids, dtype="str").fillna("")
    trips = number_column(table, found["trips"], faults)
    what = "trips must not be negative"
    add_cell_faults(faults, table, trips < 0, found["trips"], what)
    return pd.DataFrame({**columns, "trips": np.nan_to_num(trips), "line": table.lines})


def _loaded(network: Network) -> Network:
    """The network with only the node of its own id for each zone, where there is such a node."""
    nodes = network.nodes
    own = nodes.loc[nodes["node_id"] == nodes["zone_id"], "zone_id"]
    other = is_among(nodes["zone_id"], own) & (nodes["node_id"] != nodes["zone_id"]).to_numpy()
    return Network(nodes.assign(zone_id=nodes["zone_id"].where(~other)), network.links)


def _without_unknown(cells: pd.DataFrame, network: Network, notes: Notes) -> pd.DataFrame:
    known = np.ones(len(cells), dtype=bool)
    for end in ("origin", "destination"):
        zones = zone_nodes(network, end)[f"{end}_zone"]
        known &= is_among(cells[f"{end}_zone"], zones)
    lost = float(cells.loc[~known, "trips"].sum())
    if lost > 0:
        note = "trips of zones at no node of the network were left out; value: trips"
        notes.add("unknown zones", note, element="demand", severity="warning", value=repr(lost))
    return cells[known].reset_index(drop=True)


def _between_nodes(folder: Path, table: CsvTable, network: Network, faults: Faults) -> Demand:
    """The table that was written; columns beside the known ones as uxsim_columns.csv says."""
    known = pd.Series(network.nodes["node_id"], name="node_id")
    columns: dict[str, object] = {}
    for name, file_name in zip(DEMAND_COLUMNS[:2], NODES, strict=True):
        ids = id_cells(table, file_name)
        missing = np.array([one is None for one in ids], dtype=bool)
        add_cell_faults(faults, table, missing, file_name, "needs a node")
        add_reference_faults(table, file_name, known, faults)
        columns[name] = pd.Series(ids, dtype="str")
    for name, file_name in zip(DEMAND_COLUMNS[2:], (*TIMES, "volume"), strict=True):
        columns[name] = number_column(table, file_name, faults)
        missing = np.array([is_missing(cell) for cell in table.cells(file_name)], dtype=bool)
        add_cell_faults(faults, table, missing, file_name, "needs a value")
    own = read_if_there(folder, "uxsim_columns", faults)
    described = read_described(own, faults).get("demand", [])
    others = [one for one in described if one.file_column not in columns and one.column != "route"]
    used = {*NODES, *TIMES, "volume", "o_zone_id", "d_zone_id", ROUTE}
    more = extra_columns(table, used, others, faults)
    if ROUTE in table:
        more["route"] = _routes(table, faults)
    faults.raise_if_any()
    demand = pd.DataFrame(columns).join(more)
    return Demand(in_order(demand, DEMAND_COLUMNS, described))


def _routes(table: CsvTable, faults: Faults) -> pd.Series:
    routes: list[tuple[str, ...] | None] = []
    for cell, line in zip(table.cells(ROUTE), table.lines, strict=True):
        try:
            route = json.loads(cell) if cell else None
        except (json.JSONDecodeError, RecursionError):
            route = 0
        fits = isinstance(route, list) and all(isinstance(one, str) for one in route)
        if route is not None and not fits:
            what = 'must be link ids as ["a", "b"], or empty'
            faults.add(what, line=line, column=ROUTE, value=cell)
        routes.append(tuple(route) if isinstance(route, list) and fits else None)
    return pd.Series(routes, dtype=object)


def write_gmns(
    network: Network,
    demand: Demand | None,
    folder: Path,
    *,
    signals: Sequence[Signal] = (),
    units: GmnsUnits = GmnsUnits(),  # noqa: B008 -- a tuple of two words
) -> list[Path]:
    """Write a network, its demand and signal plans as GMNS into ``folder`` (made if absent).

    Returns the paths written; read_gmns_network, :func:`read_gmns_demand` and read_gmns_signals
    make the same tables of them. Raises :class:`uxsim_geo.errors.InputError` with all that cannot
    be written, before anything is.
    """
    tables = gmns_tables(network, signals, units)
    if demand is not None:
        tables["demand"], described = _demand_cells(demand, network)
        known = tables["uxsim_columns"]
        more = columns_table(described)
        tables["uxsim_columns"] = {name: [*known[name], *more[name]] for name in known}
    return write_tables(tables, folder)


def _demand_cells(demand: Demand, network: Network) -> tuple[Cells, list[tuple[str, ...]]]:
    table = demand.table
    faults = Faults("demand to be written as GMNS")
    missing = [name for name in DEMAND_COLUMNS if name not in table]
    for name in missing:
        faults.add(f"there is no column {name}")
    faults.raise_if_any()
    zone = network.nodes.set_index("node_id").get("zone_id")
    cells: Cells = {}
    for name, end in (("o_zone_id", "origin"), ("d_zone_id", "destination")):
        zones = table[end].map(zone) if zone is not None else pd.Series([None] * len(table))
        cells[name] = cells_of(zones)
    places = dict(zip(DEMAND_COLUMNS, (*NODES, *TIMES, "volume"), strict=True))
    described: list[tuple[str, ...]] = []
    for name in ("vehicles", *(one for one in table.columns if one != "vehicles")):
        place = places.get(name, f"uxsim_{name}")
        cells[place] = _route_cells(table[name]) if name == "route" else cells_of(table[name])
    for name in table.columns:
        kind = "str" if name == "route" else column_type(table[name])
        if kind is None:
            what = f"values of the type {table[name].dtype} cannot be written"
            faults.add(what, column=name)
        blank = "null" if name == "route" else blank_of(table[name])
        described.append(("demand", name, places.get(name, f"uxsim_{name}"), str(kind), blank))
    faults.raise_if_any()
    return cells, described


def _route_cells(routes: Sequence[object] | pd.Series) -> list[str]:
    return [
        json.dumps(list(route), ensure_ascii=False) if isinstance(route, (tuple, list)) else ""
        for route in routes
    ]
