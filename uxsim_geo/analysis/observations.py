"""Observed counts and travel times: read from CSV files, and checked.

The first line names the columns, in any order and no others; then one observation a line, with
commas between the values:

    link_id,start_s,end_s,vehicles                  counts
    link_id,start_s,end_s,travel_time_s             travel times of links
    origin,destination,start_s,end_s,travel_time_s  travel times of pairs of nodes

Times are seconds after the start of the simulation, [start, end).
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from uxsim_geo.errors import Faults
from uxsim_geo.network.text import read_lines

LINK = ("link_id",)
PAIR = ("origin", "destination")
INTERVAL = ("start_s", "end_s")

COUNT = "vehicles"
TRAVEL_TIME = "travel_time_s"


def read_counts(path: Path) -> pd.DataFrame:
    """Read vehicles counted on links: link_id, start_s, end_s, vehicles; the index is the line.

    Raises :class:`uxsim_geo.errors.InputError` with every fault of the file and its line.
    """
    return _read(path, [(*LINK, *INTERVAL, COUNT)])


def read_travel_times(path: Path) -> pd.DataFrame:
    """Read mean travel times of links or of pairs of nodes; the index is the line.

    link_id, or origin and destination, then start_s, end_s, travel_time_s. A time of a link is
    that of those who left it in the interval, one of a pair that of those who departed then.

    Raises :class:`uxsim_geo.errors.InputError` with every fault of the file and its line.
    """
    return _read(path, [(*LINK, *INTERVAL, TRAVEL_TIME), (*PAIR, *INTERVAL, TRAVEL_TIME)])


def check_observations(observed: pd.DataFrame, keys: tuple[str, ...], value: str) -> Faults:
    """What is wrong with observations, wherever they come from.

    ``keys`` are the columns that say what was observed, ``value`` that which says how much:
    vehicles (0 or more) or travel_time_s (above 0).
    """
    faults = Faults(observed.attrs.get("source", "observed"))
    columns = (*keys, *INTERVAL, value)
    for column in (name for name in columns if name not in observed):
        faults.add(f"lacks the column {column}: it needs {', '.join(columns)}")
    if faults.found:
        return faults
    if observed.empty:
        faults.add("holds no observation")
    start, end, amount = (observed[name].to_numpy(float) for name in (*INTERVAL, value))
    least = "0 or more" if value == COUNT else "above 0"
    wrong = ~np.isfinite(amount) | (amount < 0) | ((amount == 0) & (value == TRAVEL_TIME))
    repeated = observed.duplicated([*keys, *INTERVAL]).to_numpy()
    for found, column, what in (
        (~((start >= 0) & np.isfinite(start)), "start_s", "must be a number of seconds, 0 or more"),
        (~((end > start) & np.isfinite(end)), "end_s", "must be later than start_s"),
        (wrong, value, f"must be a number, {least}"),
        (repeated, keys[0], "is observed in this interval already, in an earlier line"),
    ):
        add_of_rows(faults, observed, found, column, what)
    return faults


def add_of_rows(
    faults: Faults, observed: pd.DataFrame, found: np.ndarray, column: str, what: str
) -> None:
    """Add a fault for every row that ``found`` marks, at its line if it was read from a file."""
    for row in np.flatnonzero(found).tolist():
        value = observed[column].iloc[row]
        if observed.index.name == "line":
            faults.add(what, line=int(observed.index[row]), column=column, value=value)
        else:
            faults.add(f"row {row}: {what}", column=column, value=value)


def _read(path: Path, kinds: list[tuple[str, ...]]) -> pd.DataFrame:
    """Read a file whose columns are those of one of ``kinds``."""
    faults = Faults(str(path))
    lines = read_lines(path, faults)
    faults.raise_if_any()
    rows = _rows(lines or [], faults)
    line, heading = next(rows)
    columns = next((kind for kind in kinds if sorted(kind) == sorted(heading)), None)
    if columns is None:
        needed = " or ".join(",".join(kind) for kind in kinds)
        faults.add(
            f"the first line must name the columns {needed}", line=line, value=",".join(heading)
        )
        faults.raise_if_any()
        columns = kinds[0]
    found = [
        (line, [_cell(cell, name, line, faults) for name, cell in zip(heading, row, strict=True)])
        for line, row in rows
        if _is_complete(row, heading, line, faults)
    ]
    faults.raise_if_any()
    index = pd.Index([line for line, _ in found], name="line", dtype="int64")
    table = pd.DataFrame([row for _, row in found], columns=heading, index=index)
    table = table[list(columns)]
    table.attrs["source"] = str(path)
    keys, value = columns[: -len(INTERVAL) - 1], columns[-1]
    check_observations(table, keys, value).raise_if_any()
    return table


def _rows(lines: list[str], faults: Faults) -> Iterator[tuple[int, list[str]]]:
    """Yield the lines that hold anything, with their numbers, split at the commas."""
    reader = csv.reader(lines, strict=True)
    try:
        for row in reader:
            cells = [cell.strip() for cell in row]
            if any(cells):
                yield reader.line_num, cells
    except csv.Error as error:
        faults.add(f"is no table of commas: {error}", line=reader.line_num)


def _is_complete(row: list[str], heading: list[str], line: int, faults: Faults) -> bool:
    if len(row) != len(heading):
        what = f"has {len(row)} values, the first line names {len(heading)} columns"
        faults.add(what, line=line, value=",".join(row))
    return len(row) == len(heading)


def _cell(cell: str, column: str, line: int, faults: Faults) -> str | float:
    if column in (*LINK, *PAIR):
        if not cell:
            faults.add("needs an id", line=line, column=column)
        return cell
    try:
        return float(cell)
    except ValueError:
        faults.add("must be a number", line=line, column=column, value=cell)
        return math.nan
