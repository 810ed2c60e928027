"""OD tables in CSV and Parquet files: in long form, one row a pair, or as a square matrix."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.demand.od_table import (
    CLASS,
    OD_COLUMNS,
    TIMES,
    OdTable,
    add_of_rows,
    check_od,
    natural_order,
    ordered,
)
from uxsim_geo.demand.points import Points, check_points, points_to_nodes
from uxsim_geo.demand.table_files import find_columns, ids_of, numbers_of, read_table_file
from uxsim_geo.errors import Faults
from uxsim_geo.network.notes import Notes

#: what a column holds, and the names under which files have it, in lower case
NAMES: dict[str, tuple[str, ...]] = {
    "origin": ("origin", "orig", "o", "from", "origin_zone", "o_zone_id", "orig_taz"),
    "destination": ("destination", "dest", "d", "to", "destination_zone", "d_zone_id", "dest_taz"),
    "vehicles": ("vehicles", "trips", "volume", "demand", "total", "ton", "count"),
    "start_s": ("start_s", "start_t", "start"),
    "end_s": ("end_s", "end_t", "end"),
    CLASS: (CLASS, "driver_class", "vehicle_class"),
    "origin_x": ("origin_x", "origin_lon", "o_x", "o_lon"),
    "origin_y": ("origin_y", "origin_lat", "o_y", "o_lat"),
    "destination_x": ("destination_x", "destination_lon", "d_x", "d_lon"),
    "destination_y": ("destination_y", "destination_lat", "d_y", "d_lat"),
}
POINT = ("origin_x", "origin_y", "destination_x", "destination_y")


@dataclass(frozen=True)
class OdColumns:
    """What the columns of a file in long form are called, where it is not one of :data:`NAMES`.

    names
        by what they hold: origin, destination, vehicles, start_s, end_s, class; or in place of
        origin and destination origin_x, origin_y, destination_x, destination_y (points)
    classes
        columns of vehicles by the class of drivers that each is of, for files with one column a
        class; empty: the column vehicles, and its class if there is a column class
    """

    names: Mapping[str, str] = field(default_factory=dict)
    classes: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        faults = Faults("columns")
        for name in self.names:
            if name not in NAMES:
                faults.add(f"must be one of {', '.join(NAMES)}", column="names", value=name)
        if self.classes and {"vehicles", CLASS} & set(self.names):
            faults.add(
                "cannot be given beside classes, whose columns hold vehicles", column="names"
            )
        faults.raise_if_any()


def read_od(
    path: Path, columns: OdColumns | None = None, *, points: Points | None = None
) -> OdTable:
    """Read an OD table in long form from a CSV or Parquet file, by its suffix.

    Columns are found by their names, those not needed are passed over and noted. Rows of the
    same pair, class and time are summed, and a note says how many; rows without vehicles are left
    out. Where the file gives points, ``points`` says in which reference system and on which
    network; each goes to the nearest node.

    Raises :class:`uxsim_geo.errors.InputError` with every fault, its line (CSV) or row (Parquet),
    column and value.
    """
    faults, notes = Faults(str(path)), Notes()
    table = read_table_file(path, faults)
    faults.raise_if_any()
    assert table is not None, "else there was a fault"
    columns = columns or OdColumns()
    found = _places(table, columns, faults, points=points is not None)
    faults.raise_if_any()
    rows = _values(table, found, columns, faults)
    _note_columns(table, found, columns, notes)
    return od_of_rows(rows, faults, notes, points)


def od_of_rows(rows: pd.DataFrame, faults: Faults, notes: Notes, points: Points | None) -> OdTable:
    """An OD table of rows that were read; ``faults`` has their source and what was found so far."""
    access = None
    if points is not None:
        check_points(rows, points, faults)
    check_od(rows, faults)
    faults.raise_if_any()
    if points is not None:
        rows, access = points_to_nodes(rows, points)
    table = ordered(rows[rows["vehicles"] > 0], notes)
    total = repr(float(table["vehicles"].sum()))
    notes.add(
        "vehicles in file", "sum over all rows; value: vehicles", element="demand", value=total
    )
    return OdTable(table, faults.source, notes.table(), access)


def _places(
    table: pd.DataFrame, columns: OdColumns, faults: Faults, *, points: bool
) -> dict[str, str]:
    """The columns of the file by what they hold; faults for those that are needed and absent."""
    found = find_columns(table, NAMES, columns.names, faults)
    needed = [*(POINT if points else OD_COLUMNS[:2])]
    if columns.classes:
        found.pop("vehicles", None)
        found.pop(CLASS, None)
        for name in columns.classes:
            if name not in table:
                faults.add("has no such column of vehicles", column=name)
    else:
        needed.append("vehicles")
    if len(set(TIMES) & set(found)) == 1:
        needed.extend(TIMES)
    for name in needed:
        if name not in found:
            there = ", ".join(map(str, table.columns[:20]))
            faults.add(f"lacks the column {name} (columns here: {there})")
    unneeded = OD_COLUMNS[:2] if points else POINT
    return {name: column for name, column in found.items() if name not in unneeded}


def _values(
    table: pd.DataFrame, found: dict[str, str], columns: OdColumns, faults: Faults
) -> pd.DataFrame:
    """The columns by our names, as text and numbers; one row a pair, time and class."""
    rows = pd.DataFrame(index=table.index)
    for name, column in found.items():
        is_text = name in (*OD_COLUMNS[:2], CLASS)
        rows[name] = (ids_of if is_text else numbers_of)(table, column, faults)
    if CLASS in rows:
        rows[CLASS] = rows[CLASS].replace("", None)
    if not columns.classes:
        return rows
    parts = []
    for column, name in columns.classes.items():
        part = rows.assign(vehicles=numbers_of(table, column, faults))
        part[CLASS] = name
        parts.append(part)
    return pd.concat(parts)


def _note_columns(
    table: pd.DataFrame, found: dict[str, str], columns: OdColumns, notes: Notes
) -> None:
    """Tell which column was taken for what, and which were passed over."""
    taken = {**found, **{f"vehicles of {kind}": name for name, kind in columns.classes.items()}}
    told = ", ".join(f"{what}: {column}" for what, column in taken.items())
    notes.add("columns", "columns of the file and what they hold", element="demand", value=told)
    unused = [str(name) for name in table.columns if name not in taken.values()]
    if unused:
        note, value = "columns of the file that were passed over", ", ".join(unused)
        notes.add("columns passed over", note, element="demand", value=value)


def read_od_matrix(path: Path) -> OdTable:
    """Read a square matrix: the names of columns are destinations, the first column origins.

    CSV or Parquet, by the suffix; the name above the origins is free. Empty cells and zeros are
    no trips. Raises :class:`uxsim_geo.errors.InputError` with every fault, its line or row,
    column and value: origins that stand twice, cells that are no number of vehicles, a matrix
    that is not square (a place that is only an origin, or only a destination).
    """
    faults, notes = Faults(str(path)), Notes()
    table = read_table_file(path, faults, numbers=True)
    faults.raise_if_any()
    assert table is not None, "else there was a fault"
    if len(table.columns) < 2:
        faults.add("has one column only: a matrix has origins and a column for each destination")
    faults.raise_if_any()
    origins = ids_of(table, str(table.columns[0]), faults)
    destinations = np.array([str(name) for name in table.columns[1:]], object)
    _add_side_faults(origins, destinations, faults)
    cells = np.column_stack([_cells(table, name, faults) for name in destinations])
    faults.raise_if_any()
    row, column = np.nonzero(cells)
    rows = pd.DataFrame(
        {
            "origin": origins.array[row],
            "destination": pd.Series(destinations, dtype="str").array[column],
            "vehicles": cells[row, column],
        },
        index=table.index[row],
    )
    return od_of_rows(rows, faults, notes, None)


def _add_side_faults(
    origins: pd.Series[str], destinations: npt.NDArray[np.object_], faults: Faults
) -> None:
    again = origins.duplicated().to_numpy(bool)
    for place, line in zip(origins[again], origins.index[again], strict=True):
        faults.add(f"row {line}: the origin stands in an earlier row too", value=place)
    for place in natural_order(set(origins.dropna()) ^ set(destinations)):
        side = "column" if place in set(origins) else "row"
        faults.add(f"the matrix is not square: this place has no {side}", value=place)


def _cells(table: pd.DataFrame, destination: str, faults: Faults) -> npt.NDArray[np.float64]:
    """The cells of one column, 0 where they are empty."""
    column = table[[destination]]
    empty = column[destination].isna().to_numpy(bool)
    if not pd.api.types.is_numeric_dtype(column[destination].dtype):
        empty = empty | (column[destination] == "").to_numpy(bool)
        column = column.mask(empty[:, None], "0")
    vehicles = np.where(empty, 0.0, numbers_of(column, destination, faults))
    wrong = ~(np.isfinite(vehicles) & (vehicles >= 0))
    if wrong.any():
        what = "must be a finite number of vehicles, 0 or more"
        add_of_rows(faults, column, wrong, destination, what)
    return vehicles
