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
from uxsim_geo.network.tntp_rows import number

OWN, FOREIGN = "uxsim_", "gmns_"

TYPES = ("str", "float64", "int64", "bool")

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


def in_order(table: pd.DataFrame, described: Sequence[Described]) -> pd.DataFrame:
    """The columns in the order in which they were described, with texts empty where they were."""
    if not described:
        return table
    empty = {one.column for one in described if one.blank == "empty" and one.column in table}
    table = table.assign(**{name: table[name].fillna("") for name in sorted(empty)})
    order = [one.column for one in described if one.column in table]
    return table[[*order, *(name for name in table if name not in order)]]


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
        return ["" if value != value else repr(value) for value in column.tolist()]
    if column.dtype == np.int64:
        return [str(value) for value in column.tolist()]
    return ["" if pd.isna(value) else str(value) for value in column.tolist()]


def blank_of(column: pd.Series) -> str:
    """What a blank cell of a column means: a null, unless there are empty texts and no null."""
    if column_type(column) != "str" or column.isna().any():
        return BLANKS[0]
    return BLANKS[1] if bool((column == "").any()) else BLANKS[0]
