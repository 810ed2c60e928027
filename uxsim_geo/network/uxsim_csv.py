"""The three tables in which UXsim's users keep a scenario, nodes, links and demand, row by row.

Columns are found by their names in the first line, or by their places if that line holds values
already: ``name,x,y``; ``name,start,end,length,u,kappa,merge_priority``;
``orig,dest,start_t,end_t,q``. Columns after those are optional (``number_of_lanes``,
``capacity_out`` and ``capacity_in`` of links, ``volume`` of demand) or passed over. Text may be
UTF-8, with or without a byte-order mark, or Shift_JIS; lines may end in a comma.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from uxsim_geo.errors import Faults
from uxsim_geo.network.text import read_bytes


@dataclass(frozen=True)
class Column:
    """One column: its name in the file, the argument it becomes, and what it may hold.

    text
        a name; otherwise a finite number, at least ``least``, or more than it if ``above``
    needed
        False: the column may be absent and its cells empty
    """

    name: str
    argument: str
    text: bool = False
    needed: bool = True
    least: float = -math.inf
    above: bool = False


class Row(NamedTuple):
    """A row that could be read: where it stands, and the arguments it gives."""

    line: int
    values: dict[str, Any]


class ScenarioRows(NamedTuple):
    """The rows of the three files."""

    nodes: list[Row]
    links: list[Row]
    demand: list[Row]


NODES = (
    Column("name", "name", text=True),
    Column("x", "x"),
    Column("y", "y"),
)
LINKS = (
    Column("name", "name", text=True),
    Column("start", "start_node", text=True),
    Column("end", "end_node", text=True),
    Column("length", "length", least=0.0, above=True),
    Column("u", "free_flow_speed", needed=False, least=0.0, above=True),
    Column("kappa", "jam_density", needed=False, least=0.0, above=True),
    Column("merge_priority", "merge_priority", needed=False, least=0.0, above=True),
    Column("number_of_lanes", "number_of_lanes", needed=False, least=1.0),
    Column("capacity_out", "capacity_out", needed=False, least=0.0),
    Column("capacity_in", "capacity_in", needed=False, least=0.0),
)
DEMAND = (
    Column("orig", "orig", text=True),
    Column("dest", "dest", text=True),
    Column("start_t", "t_start", least=0.0),
    Column("end_t", "t_end", least=0.0),
    Column("q", "flow", needed=False, least=0.0),
    Column("volume", "volume", needed=False, least=0.0),
)


def read_uxsim_rows(
    nodes: Path,
    links: Path,
    demand: Path | None,
    known: tuple[Collection[str], Collection[str]] = ((), ()),
    end: float | None = None,
) -> ScenarioRows:
    """Read the three files; ``known`` are the names of nodes and links that are there already.

    ``demand`` may be None: there is none. ``end`` of the simulation, s: nobody may depart later;
    None: it is not known.

    Raises :class:`uxsim_geo.errors.InputError` with all that is wrong in any of them.
    """
    known_nodes, known_links = known
    faults = Faults()
    rows = []
    for path, columns in ((nodes, NODES), (links, LINKS), (demand, DEMAND)):
        own = Faults(str(path))
        rows.append((own, [] if path is None else _read_table(path, columns, own)))
    (node_faults, node_rows), (link_faults, link_rows), (demand_faults, demand_rows) = rows
    names = _add_repeated(node_faults, node_rows, known_nodes)
    _add_repeated(link_faults, link_rows, known_links)
    if not node_faults.found:
        _add_unknown(link_faults, link_rows, ("start_node", "end_node"), LINKS, names)
        _add_unknown(demand_faults, demand_rows, ("orig", "dest"), DEMAND, names)
    _add_demand_faults(demand_faults, demand_rows, end)
    for own, _ in rows:
        faults.extend(own)
    faults.raise_if_any()
    return ScenarioRows(node_rows, link_rows, demand_rows)


def _read_table(path: Path, columns: tuple[Column, ...], faults: Faults) -> list[Row]:
    cells = list(_cells(path, faults))
    if not cells:
        if not faults.found:
            faults.add("is empty: is it the right file?")
        return []
    places, headed = _places(cells[0][1], columns)
    for column in columns:
        if column.needed and column.name not in places:
            found = ", ".join(cells[0][1])
            faults.add(f"lacks the column {column.name}", line=cells[0][0], value=found)
    if faults.found:
        return []
    return [_row(line, row, columns, places, faults) for line, row in cells[headed:]]


def _cells(path: Path, faults: Faults) -> Iterator[tuple[int, list[str]]]:
    """Yield the lines that hold anything, with their numbers."""
    text = _text(path, faults)
    if text is None:
        return
    reader = csv.reader(text.splitlines())
    try:
        for row in reader:
            stripped = [cell.strip() for cell in row]
            if any(stripped):
                yield reader.line_num, stripped
    except csv.Error as error:
        faults.add(f"is no table of commas: {error}", line=reader.line_num + 1)


def _text(path: Path, faults: Faults) -> str | None:
    data = read_bytes(path, faults)
    if data is None:
        return None
    # cp932 is Shift_JIS as systems write it; hardly any Japanese text in it is valid UTF-8
    for encoding in ("utf-8-sig", "cp932"):
        try:
            return data.decode(encoding)
        except UnicodeDecodeError as error:
            line, byte = data[: error.start].count(b"\n") + 1, data[error.start]
    faults.add(f"is text neither in UTF-8 nor in Shift_JIS (byte 0x{byte:02x})", line=line)
    return None


def _places(first: list[str], columns: tuple[Column, ...]) -> tuple[dict[str, int], bool]:
    """Find where each column stands, and whether the first line says so."""
    names = {column.name for column in columns}
    numbers = {column.name for column in columns if not column.text}
    if not numbers & set(first):
        return {column.name: place for place, column in enumerate(columns) if place < len(first)}, (
            False
        )
    places = {name: place for place, name in enumerate(first) if name in names}
    for place, column in enumerate(columns):
        # a column by another name counts where UXsim, which goes by places, would read it
        if column.needed and place < len(first) and first[place] not in names:
            places.setdefault(column.name, place)
    return places, True


def _row(
    line: int,
    row: list[str],
    columns: tuple[Column, ...],
    places: dict[str, int],
    faults: Faults,
) -> Row:
    values: dict[str, Any] = {}
    for column in columns:
        place = places.get(column.name, len(row))
        cell = row[place] if place < len(row) else ""
        if cell:
            values[column.argument] = _value(cell, column, line, faults)
        elif column.needed:
            faults.add("needs a value", line=line, column=column.name)
    return Row(line, values)


def _value(cell: str, column: Column, line: int, faults: Faults) -> str | float:
    if column.text:
        return cell
    try:
        number = float(cell)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        faults.add("must be a finite number", line=line, column=column.name, value=cell)
    elif number < column.least or (column.above and number == column.least):
        what = f"must be {'above ' if column.above else ''}{column.least:g}"
        faults.add(
            what + ("" if column.above else " or more"), line=line, column=column.name, value=cell
        )
    elif column.name == "number_of_lanes" and number % 1:
        faults.add("must be a whole number", line=line, column=column.name, value=cell)
    return number


def _add_repeated(faults: Faults, rows: list[Row], known: Collection[str]) -> set[str]:
    """Note names that stand twice or are in the world already; gives all names."""
    names = set(known)
    for line, values in rows:
        name = values.get("name")
        if name in names:
            faults.add(
                "the name is taken already: each needs its own",
                line=line,
                column="name",
                value=name,
            )
        elif name is not None:
            names.add(name)
    return names


def _add_unknown(
    faults: Faults,
    rows: list[Row],
    arguments: tuple[str, str],
    columns: tuple[Column, ...],
    names: set[str],
) -> None:
    heading = {column.argument: column.name for column in columns}
    for line, values in rows:
        for argument in arguments:
            name = values.get(argument)
            if name is not None and name not in names:
                faults.add("there is no such node", line=line, column=heading[argument], value=name)


def _add_demand_faults(faults: Faults, rows: list[Row], last: float | None) -> None:
    for line, values in rows:
        if not {"flow", "volume"} & set(values):
            faults.add("needs a value, or the column volume one", line=line, column="q")
        if {"flow", "volume"} <= set(values):
            what = "give either this or q"
            faults.add(what, line=line, column="volume", value=values["volume"])
        if last is not None and values.get("t_start", 0.0) > last:
            what = f"is after the end of the simulation, {last:g} s: raise tmax, or leave it out"
            faults.add(what, line=line, column="start_t", value=f"{values['t_start']:g}")
        if values.get("orig") == values.get("dest") and "orig" in values:
            what = "must be another node than orig"
            faults.add(what, line=line, column="dest", value=values["dest"])
        start, end = values.get("t_start", math.nan), values.get("t_end", math.nan)
        if end <= start:
            what = f"must be later than start_t, {start:g}"
            faults.add(what, line=line, column="end_t", value=f"{end:g}")
