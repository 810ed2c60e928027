"""Columns beside those that GMNS and the network share, in and out.

A column of a GMNS file that means nothing here is kept as ``gmns_`` and its name. A column of the
network that GMNS lacks is written as ``uxsim_`` and its name. uxsim_columns.csv, beside the tables,
says of those written which type each has and in which order they stood, so that they read back as
they were.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from uxsim_geo.errors import Faults
from uxsim_geo.network.csv_table import CsvTable, is_missing, text_column
from uxsim_geo.network.exact import float_text
from uxsim_geo.network.gmns_tables import COLUMNS
from uxsim_geo.network.tntp_rows import number

OWN, FOREIGN = "uxsim_", "gmns_"

TYPES = ("str", "float64", "int64", "bool")

#: columns of the files that the reader makes something of, or that have no meaning here
USED = {
    "node": {
        "node_id",
        "zone_id",
        "ctrl_type",
        "x_coord",
        "y_coord",
        "geometry",
        "uxsim_through_traffic",
    },
    "link": {
        "link_id",
        "name",
        "from_node_id",
        "to_node_id",
        "directed",
        "dir_flag",
        "geometry",
        "geometry_id",
        "facility_type",
        "length",
        "lanes",
        "free_speed",
        "capacity",
        "uxsim_jam_density",
        "uxsim_merge_priority",
        "uxsim_source_id",
        "uxsim_lanes_source",
        "uxsim_free_speed_source",
    },
    "demand": set(),
}

NUMBERS = {"float64": np.dtype(np.float64), "int64": np.dtype(np.int64)}

#: a blank cell of text is a null, or a text without a letter
BLANKS = ("null", "empty")


@dataclass(frozen=True)
class Described:
    """A column as uxsim_columns.csv describes it."""

    column: str
    file_column: str
    type: str
    blank: str


def read_described(table: CsvTable | None, faults: Faults | None) -> dict[str, list[Described]]:
    """The columns by their table; what is no description is a fault."""
    described: dict[str, list[Described]] = {}
    if table is None or faults is None:
        return described
    names = ("table", "column", "file_column", "type", "blank")
    cells = [table.cells(name) for name in names]
    for *row, line in zip(*cells, table.lines, strict=True):
        of, column, file_column, kind, blank = row
        if kind not in (*TYPES, "geometry"):
            faults.add(f"must be one of {', '.join(TYPES)}", line=line, column="type", value=kind)
        elif blank not in BLANKS:
            faults.add(f"must be {' or '.join(BLANKS)}", line=line, column="blank", value=blank)
        else:
            described.setdefault(of, []).append(Described(column, file_column, kind, blank))
    return described


def extra_columns(
    table: CsvTable, used: Collection[str], described: Sequence[Described], faults: Faults
) -> pd.DataFrame:
    """The columns that the reader did not use, under the names and types they have here.

    Columns that nobody described and in which nothing stands are left out; of the others those
    that hold numbers alone become float64, unless they are ids.
    """
    by_file = {one.file_column: one for one in described}
    columns: dict[str, pd.Series] = {}
    for name, cells in table.columns.items():
        if name in used:
            continue
        known = by_file.get(name)
        if known is not None:
            columns[known.column] = _as_described(table, known, faults)
        elif any(map(str.strip, cells)):
            own = name.startswith(OWN)
            new = name.removeprefix(OWN) if own else FOREIGN + name
            columns[new] = _as_it_looks(name, cells)
    for one in described:
        if one.file_column not in table and one.file_column:
            faults.add("lacks a column that uxsim_columns.csv names", column=one.file_column)
    return pd.DataFrame(columns, index=range(len(table)))


def _as_it_looks(name: str, cells: list[str]) -> pd.Series:
    if not name.endswith("_id"):
        values = [float("nan") if is_missing(cell) else number(cell) for cell in cells]
        if all(value is not None for value in values):
            return pd.Series(values, dtype="float64")
    return text_column(cells)


def _as_described(table: CsvTable, known: Described, faults: Faults) -> pd.Series:
    cells = table.cells(known.file_column)
    if known.type == "str":
        return text_column(cells) if known.blank == "null" else pd.Series(cells, dtype="str")
    if known.type == "bool":
        return _checked(table, known, {"true": True, "false": False}, faults)
    values: dict[str, object] = {}
    for cell in set(cells):
        value = number(cell) if cell else float("nan")
        if value is not None:
            values[cell] = value
            if known.type == "int64" and cell.removeprefix("-").isdecimal():
                values[cell] = int(cell)
            elif known.type == "int64":
                del values[cell]
    return _checked(table, known, values, faults)


def _checked(
    table: CsvTable, known: Described, values: dict[str, object], faults: Faults
) -> pd.Series:
    """The value of each cell; a fault where a cell has none, as it was changed since."""
    cells = table.cells(known.file_column)
    for cell, line in zip(cells, table.lines, strict=True):
        if cell not in values:
            what = f"must be of the type {known.type}, as uxsim_columns.csv says"
            faults.add(what, line=line, column=known.file_column, value=cell)
    default = next(iter(values.values()), 0)
    return pd.Series([values.get(cell, default) for cell in cells], dtype=known.type)


def in_order(
    table: pd.DataFrame, shared: Sequence[str], described: Sequence[Described]
) -> pd.DataFrame:
    """The columns as they were described: in their order and types, texts empty where they were.

    Of the ``shared`` columns those that were not there then are left out again.
    """
    if not described:
        return table
    restored = {}
    for one in described:
        if one.column in table and one.blank == "empty":
            restored[one.column] = table[one.column].fillna("")
        elif one.column in table and one.type in NUMBERS:
            restored[one.column] = table[one.column].astype(NUMBERS[one.type])
    order = [one.column for one in described if one.column in table]
    new = [name for name in table if name not in order and name not in shared]
    return table.assign(**restored)[[*order, *new]]


def place_in_file(name: str, of: str, taken: Collection[str]) -> str:
    """Under which name a column without a place of its own is written into a table."""
    plain = name.removeprefix(FOREIGN)
    known = COLUMNS.get(of, ())
    free = plain not in taken and plain not in USED[of]
    if name.startswith(FOREIGN) and free and (plain in known or plain.lower() not in known):
        return plain
    return OWN + name


def column_type(column: pd.Series) -> str | None:
    """The type under which a column can be written; None if there is none."""
    kind = str(column.dtype)
    if kind in TYPES:
        return kind
    if kind in ("string", "object") and all(
        value is None or isinstance(value, str) or value != value for value in column.tolist()
    ):
        return "str"
    return None


def cells_of(column: pd.Series) -> list[str]:
    """A column as cells that read back as the same values."""
    if column.dtype == np.bool_:
        return ["true" if value else "false" for value in column.tolist()]
    if column.dtype == np.float64:
        return ["" if value != value else float_text(value) for value in column.tolist()]
    if column.dtype == np.int64:
        return [str(value) for value in column.tolist()]
    return ["" if pd.isna(value) else str(value) for value in column.tolist()]


def blank_of(column: pd.Series) -> str:
    """What a blank cell of a column means: a null, unless there are empty texts and no null."""
    if column_type(column) != "str" or column.isna().any():
        return BLANKS[0]
    return BLANKS[1] if bool((column == "").any()) else BLANKS[0]
