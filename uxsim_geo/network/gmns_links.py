"""link.csv to the links of a network, in SI units.

length     as stated, otherwise that of the geometry
lanes      as stated, otherwise the rows of lane.csv, otherwise lanes_where_missing
capacity   of a lane and hour in the file, of the whole link and second here
"""

from __future__ import annotations

from collections import Counter

import numpy as np
import pandas as pd

from uxsim_geo.errors import Faults
from uxsim_geo.network.csv_table import (
    CsvTable,
    add_cell_faults,
    id_cells,
    is_missing,
    number_column,
    text_column,
)
from uxsim_geo.network.exact import exact_factor, to_si
from uxsim_geo.network.gmns_geometry import directions
from uxsim_geo.network.gmns_nodes import add_id_faults, add_reference_faults
from uxsim_geo.network.gmns_reading import Reading
from uxsim_geo.network.gmns_units import factors, stated_unit
from uxsim_geo.network.gmns_uses import are_allowed, road_class_column
from uxsim_geo.network.rows import NAMED_ROWS, count, listed, whole_where_possible
from uxsim_geo.network.units import PER_HOUR, parse_unit

#: cells of the column directed: 1: travel from the from-node to the to-node alone
DIRECTED = {"": True, "nan": True, "1": True, "1.0": True, "true": True, "yes": True}
DIRECTED |= dict.fromkeys(("0", "0.0", "false", "no"), False)

#: by column, the option that states what is assumed where it is empty, and its unit
WHERE_MISSING = {
    "lanes": ("lanes_where_missing", ""),
    "free_speed": ("speed_where_missing", " m/s"),
}

#: veh/h: no lane carries more; a larger number is of a day, or of the whole link
MOST_OF_A_LANE = 3000.0


def add_link_id_faults(reading: Reading, node_id: pd.Series) -> None:
    """Note links without an id, with that of another, or that refer to what is not there."""
    table, faults = reading.links, reading.faults["link"]
    if not len(table):
        faults.add("has no row")
    add_id_faults(table, "link_id", faults)
    for end in ("from_node_id", "to_node_id"):
        missing = np.array([is_missing(cell) for cell in table.cells(end)], dtype=bool)
        add_cell_faults(faults, table, missing, end, "needs a value")
        add_reference_faults(table, end, node_id, faults)
    link_id = pd.Series(id_cells(table, "link_id"), dtype="str", name="link_id")
    add_reference_faults(table, "parent_link_id", link_id, faults)


def read_links(reading: Reading, table: CsvTable) -> pd.DataFrame:
    """The shared columns, and direction (dir_flag) and both_ways; one row a row of ``table``.

    Lengths are NaN where the file has none.
    """
    faults = reading.faults["link"]
    text = {name: id_cells(table, name) for name in ("link_id", "from_node_id", "to_node_id")}
    links = pd.DataFrame({name: pd.Series(ids, dtype="str") for name, ids in text.items()})
    links["length"] = _length(reading, table)
    links["lanes"], lanes_source = _lanes(reading, table)
    links["free_speed"], speed_source = _free_speed(reading, table)
    links["jam_density"] = _own_number(table, "jam_density", reading.options.jam_density, faults)
    links["capacity"] = _capacity(reading, table, links["lanes"].to_numpy())
    priority = np.where(np.isfinite(links["lanes"]), links["lanes"], 1.0)
    links["merge_priority"] = _own_number(table, "merge_priority", priority, faults)
    links["road_class"] = text_column(table.cells(road_class_column(table)))
    links["name"] = text_column(table.cells("name"))
    source = table.cells("uxsim_source_id" if "uxsim_source_id" in table else "link_id")
    links["source_id"] = text_column(source)
    links["lanes_source"] = _source(table, "lanes_source", lanes_source)
    links["free_speed_source"] = _source(table, "free_speed_source", speed_source)
    links["direction"] = directions(reading, table)
    links["both_ways"] = _both_ways(reading, table)
    links["lanes"] = whole_where_possible(links["lanes"].to_numpy())
    return links


def _length(reading: Reading, table: CsvTable) -> np.ndarray:
    faults = reading.faults["link"]
    values = number_column(table, "length", faults)
    add_cell_faults(faults, table, values < 0, "length", "must not be negative")
    unit = stated_unit(reading, table, "length")
    found = to_si(table.cells("length"), values, factors(unit, "length", len(table)))
    return np.where((found > 0) & (reading.options.length_from == "file"), found, np.nan)


def _lanes(reading: Reading, table: CsvTable) -> tuple[np.ndarray, np.ndarray]:
    """Lanes, and where each number comes from: given or assumed."""
    faults = reading.faults["link"]
    lanes = number_column(table, "lanes", faults)
    what = "must be a whole number of lanes, above 0 on a link for motor vehicles"
    add_cell_faults(faults, table, (lanes <= 0) | (lanes % 1 > 0), "lanes", what)
    counted = _lanes_counted(reading, table)
    differs = np.isfinite(lanes) & np.isfinite(counted) & (lanes != counted)
    if differs.any():
        note = (
            "lane.csv has other lanes for motor vehicles than link.csv, which holds; value: links"
        )
        value = int(differs.sum())
        reading.notes.add("lanes differ", note, element="link", severity="warning", value=value)
    lanes = np.where(np.isfinite(lanes), lanes, counted)
    return _with_assumed(reading, table, "lanes", lanes)


def _lanes_counted(reading: Reading, table: CsvTable) -> np.ndarray:
    """Lanes for motor vehicles of each link by lane.csv, NaN where it has none of the link."""
    lanes = reading.tables.get("lane")
    if lanes is None:
        return np.full(len(table), np.nan)
    faults = reading.faults["lane"]
    known = pd.Series(id_cells(reading.links, "link_id"), dtype="str", name="link_id")
    add_id_faults(lanes, "lane_id", faults)
    add_reference_faults(lanes, "link_id", known, faults)
    number_column(lanes, "lane_num", faults)
    allowed = are_allowed(lanes, reading.options)
    counts = Counter(np.array(id_cells(lanes, "link_id"), dtype=object)[allowed].tolist())
    found = [counts.get(link_id, 0) for link_id in id_cells(table, "link_id")]
    return np.array([number or np.nan for number in found], dtype=np.float64)


def _free_speed(reading: Reading, table: CsvTable) -> tuple[np.ndarray, np.ndarray]:
    """Free speed, m/s, and where each comes from: given or assumed."""
    faults = reading.faults["link"]
    values = number_column(table, "free_speed", faults)
    add_cell_faults(faults, table, values <= 0, "free_speed", "must be above 0")
    unit = stated_unit(reading, table, "free_speed")
    speed = to_si(table.cells("free_speed"), values, factors(unit, "speed", len(table)))
    return _with_assumed(reading, table, "free_speed", speed)


def _with_assumed(
    reading: Reading, table: CsvTable, name: str, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The values with what is assumed where there is none, and which are given or assumed.

    Where nothing is to be assumed, every missing value is a fault.
    """
    option, unit = WHERE_MISSING[name]
    cells = table.cells(name)
    missing = np.array([is_missing(cell) for cell in cells], dtype=bool) & ~np.isfinite(values)
    assumed = getattr(reading.options, option)
    if assumed is None:
        _add_missing(reading, table, missing, name, option)
        return values, np.full(len(values), "given", dtype=object)
    ids = [link_id or "" for link_id in np.array(id_cells(table, "link_id"))[missing]]
    note = f"no {name} in the file: {assumed:g}{unit} assumed"
    reading.notes.add_each(f"{name.replace('_', ' ')} assumed", note, ids)
    source = np.where(missing, "assumed", "given").astype(object)
    return np.where(missing, assumed, values), source


def _add_missing(
    reading: Reading, table: CsvTable, missing: np.ndarray, name: str, option: str
) -> None:
    """One fault for all links that lack a value, with what would help."""
    rows = np.flatnonzero(missing).tolist()
    if not rows or reading.is_own:  # a network without the value was written: it has none again
        return
    ids, classes = id_cells(table, "link_id"), table.cells(road_class_column(table))
    named = [str(ids[row]) for row in rows[:NAMED_ROWS]]
    kinds = ", ".join(sorted({classes[row].strip() or "no type" for row in rows})[:NAMED_ROWS])
    reading.faults["link"].add(
        f"{count(len(rows), 'link')} without a value (link_id {listed(named, len(rows))}; of "
        f"{kinds}): state {option}, or leave out their types by leave_out",
        line=table.lines[rows[0]],
        column=name,
    )


def _capacity(reading: Reading, table: CsvTable, lanes: np.ndarray) -> np.ndarray:
    """Of the whole link, veh/s; NaN where the file has none: that of the diagram."""
    faults = reading.faults["link"]
    values = number_column(table, "capacity", faults)
    what = "must be above 0, or empty: nothing could leave the link"
    add_cell_faults(faults, table, values <= 0, "capacity", what)
    text = reading.options.capacity_unit
    factor, per_lane = exact_factor(text, "capacity"), parse_unit(text, "capacity").per_lane
    many = [int(one) if per_lane and np.isfinite(one) else 1 for one in lanes.tolist()]
    capacity = to_si(table.cells("capacity"), values, [factor * one for one in many])
    _note_capacities(reading, capacity * PER_HOUR / lanes)
    return capacity


def _note_capacities(reading: Reading, of_a_lane: np.ndarray) -> None:
    above = of_a_lane > MOST_OF_A_LANE
    if above.any():
        note = (
            f"links with a capacity of more than {MOST_OF_A_LANE:g} veh/h a lane, the largest "
            f"{float(np.nanmax(of_a_lane)):.4g}: is capacity_unit {reading.options.capacity_unit} "
            "right? The simulation holds what the lanes carry, if that is less; value: links"
        )
        value = int(above.sum())
        reading.notes.add("large capacity", note, element="link", severity="warning", value=value)
    empty = int(np.isnan(of_a_lane).sum())
    if empty:
        note = "no capacity in the file: that of the triangular diagram; value: links"
        reading.notes.add("no capacity", note, element="link", value=empty)


def _own_number(
    table: CsvTable, name: str, default: float | np.ndarray, faults: Faults
) -> np.ndarray:
    """A column of uxsim-geo's own, with the default where it is absent or empty."""
    values = number_column(table, f"uxsim_{name}", faults)
    add_cell_faults(faults, table, values <= 0, f"uxsim_{name}", "must be above 0")
    return np.where(np.isnan(values), default, values)


def _source(table: CsvTable, name: str, found: np.ndarray) -> pd.Series:
    cells = table.columns.get(f"uxsim_{name}")
    return pd.Series(found, dtype="str") if cells is None else text_column(cells)


def _both_ways(reading: Reading, table: CsvTable) -> np.ndarray:
    """Whether a link is undirected and hence stands for two."""
    cells = [cell.strip().lower() for cell in table.cells("directed")]
    empty = sum(cell in ("", "nan") for cell in cells)
    if empty:
        note = (
            "directed is absent or empty: links lead from from_node_id to to_node_id; value: rows"
        )
        reading.notes.add("directed", note, element="link", value=empty)
    for cell, line in zip(cells, table.lines, strict=True):
        if cell not in DIRECTED:
            what = "must be 1 (one direction) or 0 (both)"
            reading.faults["link"].add(what, line=line, column="directed", value=cell)
    return np.array([not DIRECTED.get(cell, True) for cell in cells], dtype=bool)
