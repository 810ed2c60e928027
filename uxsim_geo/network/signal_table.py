"""The signal table as a CSV file: written by the rule, edited by people, read with every check.

One row a node, phase and link, columns :data:`uxsim_geo.network.signal_rows.COLUMNS`. An empty
link_id stands for a phase in which nobody drives. Needed are node_id, phase, link_id and green_s;
a number need stand in one row of its phase (green_s, all_red_s) or node (offset_s, cycle_s) only.
"""

from __future__ import annotations

import csv
import difflib
import math
from collections.abc import Container, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from uxsim_geo.control.signals import Signal
from uxsim_geo.errors import Faults
from uxsim_geo.files import replace_when_complete
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.rows import add_missing_columns, add_rows, lacking, numbers
from uxsim_geo.network.signal_rows import (
    COLUMNS,
    NUMBERS,
    SOURCES,
    SignalRow,
    complete,
    rows_of,
    signals_of_rows,
    table_of,
)
from uxsim_geo.network.text import read_lines
from uxsim_geo.network.tntp_rows import number

REQUIRED = ("node_id", "phase", "link_id", "green_s")

Cells = dict[str, str]


def write_signal_table(table: pd.DataFrame, path: Path) -> None:
    """Write a signal table as CSV; :func:`read_signal_table` gives the same table back."""
    with replace_when_complete(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for row in rows_of(table):
            writer.writerow([_as_text(value) for value in row])


def read_signal_table(path: Path, network: Network, *, notes: Notes | None = None) -> pd.DataFrame:
    """Read a signal table (CSV) for a network; columns :data:`COLUMNS`, rows as in the file.

    A row without a source is ``given``. Nodes need not be ``signal`` in the network: the table may
    put signals where the network has none. ``notes`` collects in-links that no phase names, which
    the signals do not hold.

    Raises :class:`uxsim_geo.errors.InputError` with every fault, its line, column and value.
    """
    faults = Faults(str(path))
    lines = _read_cells(path, faults)
    faults.raise_if_any()
    known = _Known.of(network)
    rows = [(_row(cells, line, known, faults), line) for cells, line in lines]
    # a number that cannot be read says nothing on whether the rest of its node fits together
    broken = {cells["node_id"] for (cells, _), (row, _) in zip(lines, rows, strict=True) if not row}
    sound = [(row, line) for row, line in rows if row and row.node_id not in broken]
    found = complete([row for row, _ in sound], [line for _, line in sound], faults)
    faults.raise_if_any()
    if notes is not None:
        _note_free_links(found, network, notes)
    return table_of(found)


def signals_of_table(table: pd.DataFrame) -> list[Signal]:
    """The signals that ``simulate`` takes as control, in the order of their first rows.

    Raises :class:`uxsim_geo.errors.InputError` where rows disagree, naming them by their number
    from 1; whether the ids fit the network is checked when the signals are bound to it.
    """
    faults = Faults("signal table")
    if not add_missing_columns(faults, table, COLUMNS):
        table = _typed(table, faults)
    faults.raise_if_any()
    own = Faults("signal table, row")
    rows = complete(rows_of(table), range(1, len(table) + 1), own)
    own.raise_if_any()
    return signals_of_rows(rows)


def _typed(table: pd.DataFrame, faults: Faults) -> pd.DataFrame:
    """The table with numbers for numbers and text for ids, as people may have changed them."""
    phase = numbers(table["phase"])
    whole = np.isfinite(phase) & (phase >= 1) & (phase % 1 == 0)
    add_rows(faults, ~whole, "a phase that is no whole number from 1 on", ids=table["node_id"])
    add_rows(faults, lacking(table["node_id"]), "no node_id")
    columns: dict[str, pd.Series] = {
        "phase": pd.Series(np.where(whole, phase, 1), table.index).astype("int64")
    }
    for name in NUMBERS:
        values = numbers(table[name])
        wrong = np.asarray(table[name].notna(), dtype=bool) & np.isnan(values)
        add_rows(faults, wrong, f"a {name} that is not a number", ids=table["node_id"])
        columns[name] = pd.Series(values, table.index)
    for name in ("node_id", "link_id"):
        columns[name] = table[name].astype("str")
    return table.assign(**columns)


def _as_text(value: object) -> str:
    """Numbers by the shortest text that gives them back; whole ones without a point."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return str(int(value))
    return repr(value) if isinstance(value, float) else str(value)


@dataclass(frozen=True)
class _Known:
    """What the rows of a table may name: nodes, and links with the node that each ends at."""

    nodes: set[str]
    ends: dict[str, str]

    @classmethod
    def of(cls, network: Network) -> _Known:
        """Those of a network."""
        ends = zip(network.links["link_id"], network.links["to_node_id"], strict=True)
        return cls(set(network.nodes["node_id"]), dict(ends))


def _read_cells(path: Path, faults: Faults) -> list[tuple[Cells, int]]:
    """Column to text of every row, all columns there, and the line it stands on."""
    text = read_lines(path, faults)
    if text is None:
        return []
    reader = csv.reader((f"{line}\n" for line in text), strict=True)
    found: list[tuple[Cells, int]] = []
    header: list[str] = []
    try:
        for row in reader:
            if not any(cell.strip() for cell in row):
                continue
            if not header:
                header = [cell.strip() for cell in row]
                _add_header_faults(header, reader.line_num, faults)
                if faults.found:
                    break
            elif len(row) == len(header):
                named = dict(zip(header, row, strict=True))
                found.append((dict.fromkeys(COLUMNS, "") | named, reader.line_num))
            else:
                what = f"the row has {len(row)} values under {len(header)} names"
                faults.add(what, line=reader.line_num, value=",".join(row))
    except csv.Error as error:
        faults.add(f"is not a CSV table: {error}", line=reader.line_num)
    return found


def _add_header_faults(header: list[str], line: int, faults: Faults) -> None:
    if len(header) == 1 and (";" in header[0] or "\t" in header[0]):
        faults.add("separate the columns by commas", line=line, value=header[0])
        return
    for name in REQUIRED:
        if name not in header:
            faults.add(f"lacks the column {name}", line=line, value=",".join(header))
    for name in sorted({name for name in header if header.count(name) > 1}):
        faults.add("the column stands there more than once", line=line, column=name)
    for name in header:
        if name not in COLUMNS:
            near = difflib.get_close_matches(name, COLUMNS, n=1)
            hint = f"; did you mean {near[0]}?" if near else f"; known are {', '.join(COLUMNS)}"
            faults.add(f"is no column of a signal table{hint}", line=line, column=name)


def _row(cells: Cells, line: int, known: _Known, faults: Faults) -> SignalRow | None:
    """The row, or None and faults where its node or one of its numbers cannot be read."""
    node_id = cells["node_id"] = _id(cells["node_id"], known.nodes)
    link_id = _id(cells["link_id"], known.ends)
    _add_id_faults((node_id, link_id), line, known, faults)
    source = cells["source"].strip() or "given"
    if source not in SOURCES:
        faults.add(f"must be {' or '.join(SOURCES)}", line=line, column="source", value=source)
    phase = _whole(cells["phase"], line, faults)
    times = [_number(cells[name], name, line, faults) for name in NUMBERS]
    if not node_id or not phase or math.inf in times:
        return None
    green, all_red, offset, cycle = times
    return SignalRow(node_id, phase, link_id or None, green, all_red, offset, cycle, source)


def _id(cell: str, known: Container[str]) -> str:
    """An id as it stands there; without blanks about it, unless they belong to it."""
    return cell if cell in known else cell.strip()


def _add_id_faults(ids: tuple[str, str], line: int, known: _Known, faults: Faults) -> None:
    node_id, link_id = ids
    if not node_id:
        faults.add("the row names no node", line=line, column="node_id")
    elif node_id not in known.nodes:
        what = "the network has no such node"
        faults.add(what, line=line, column="node_id", value=node_id)
    if link_id and link_id not in known.ends:
        what = "the network has no such link"
        faults.add(what, line=line, column="link_id", value=link_id)
    elif link_id and node_id in known.nodes and known.ends[link_id] != node_id:
        what = f"the link ends at node {known.ends[link_id]}, not at {node_id}"
        faults.add(what, line=line, column="link_id", value=link_id)


def _whole(cell: str, line: int, faults: Faults) -> int:
    """The phase; 0, with a fault, if it is none."""
    value = number(cell.strip())
    if value is None or not 1 <= value < 1000 or value % 1 != 0:
        what = "must be a whole number from 1 on"
        faults.add(what, line=line, column="phase", value=cell)
        return 0
    return int(value)


def _number(cell: str, column: str, line: int, faults: Faults) -> float:
    """A finite number, NaN where the cell is empty; infinite, with a fault, for anything else."""
    text = cell.strip()
    value = number(text) if text else math.nan
    if value is None or (text and not math.isfinite(value)):
        faults.add("must be a finite number", line=line, column=column, value=cell)
        return math.inf
    return value


def _note_free_links(rows: Sequence[SignalRow], network: Network, notes: Notes) -> None:
    """Say which links end at a signal of the table and are in none of its phases."""
    nodes, named = {row.node_id for row in rows}, {row.link_id for row in rows}
    ends = zip(network.links["link_id"], network.links["to_node_id"], strict=True)
    free = [link_id for link_id, node in ends if node in nodes and link_id not in named]
    note = "ends at a signal none of whose phases names it: it is not held"
    notes.add_each("link beside the signal", note, free)
