"""Rows of a signal table: what they must agree on, and the signals that they make."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import pandas as pd

from uxsim_geo.control.signals import Phase, Signal
from uxsim_geo.errors import Faults

#: columns of a signal table, in their order
COLUMNS = (
    "node_id",
    "phase",
    "link_id",
    "green_s",
    "all_red_s",
    "offset_s",
    "cycle_s",
    "source",
)

#: the columns that hold a number of s, and the field of a row that each is
NUMBERS = {"green_s": "green", "all_red_s": "all_red", "offset_s": "offset", "cycle_s": "cycle"}

SOURCES = ("assumed", "given")

_SAME = 1e-6  # s: a cycle that misses the sum by no more was rounded by hand or machine


class SignalRow(NamedTuple):
    """One link in one phase at one node; times in s, NaN where the row does not say."""

    node_id: str
    phase: int
    link_id: str | None
    green: float
    all_red: float
    offset: float
    cycle: float
    source: str


def rows_of_signals(signals: Iterable[Signal]) -> list[SignalRow]:
    """Signals as rows of a table, which says ``given`` of them; their periods are not kept."""
    return [
        SignalRow(
            signal.node_id,
            number,
            link_id,
            phase.duration,
            signal.all_red,
            signal.offset,
            signal.cycle,
            "given",
        )
        for signal in signals
        for number, phase in enumerate(signal.phases, start=1)
        for link_id in (phase.links or (None,))
    ]


def table_of(rows: Sequence[SignalRow]) -> pd.DataFrame:
    """The rows as a table with columns :data:`COLUMNS`."""
    types = dict.fromkeys(COLUMNS, "str") | {"phase": "int64"} | dict.fromkeys(NUMBERS, "float64")
    columns = zip(*rows, strict=True) if rows else [()] * len(COLUMNS)
    return pd.DataFrame(
        {
            name: pd.Series(list(values), dtype=types[name])
            for name, values in zip(COLUMNS, columns, strict=True)
        }
    )


def rows_of(table: pd.DataFrame) -> list[SignalRow]:
    """The rows of a table that has the columns :data:`COLUMNS`."""
    found = [table[name].tolist() for name in COLUMNS]
    empty = table["link_id"].isna().tolist()
    rows = [SignalRow(*values) for values in zip(*found, strict=True)]
    return [
        row._replace(link_id=None) if lacks else row for row, lacks in zip(rows, empty, strict=True)
    ]


def complete(rows: Sequence[SignalRow], lines: Sequence[int], faults: Faults) -> list[SignalRow]:
    """Fill what rows leave out from others of their phase or node, and note where they disagree.

    A phase has one green and one all-red time (0 where no row says), a node one offset (0) and one
    cycle (the sum). ``lines`` names the rows in faults. Looked at: the numbers, phases that are
    not 1, 2, 3 …, phases without green, links twice in a phase, nodes no phase of which has a
    link, and cycles that are not the sum of their parts.
    """
    numbered = list(zip(rows, lines, strict=True))
    _add_number_faults(numbered, faults)
    found = list(rows)
    for places in _places_of_nodes(rows).values():
        own = [numbered[place] for place in places]
        _add_link_faults(own, faults)
        _add_gap_faults(own, faults)
        for place, row in zip(places, _complete_node(own, faults), strict=True):
            found[place] = row
    return found


def signals_of_rows(rows: Sequence[SignalRow]) -> list[Signal]:
    """A signal for each node, in the order in which the nodes first stand there.

    Rows are as :func:`complete` gives them. Where phases have different all-red times, each such
    time is a phase of its own in which nobody has green.
    """
    return [_signal([rows[place] for place in own]) for own in _places_of_nodes(rows).values()]


Numbered = Sequence[tuple[SignalRow, int]]


def _places_of_nodes(rows: Iterable[SignalRow]) -> dict[str, list[int]]:
    places: dict[str, list[int]] = {}
    for place, row in enumerate(rows):
        places.setdefault(row.node_id, []).append(place)
    return places


def _signal(rows: Sequence[SignalRow]) -> Signal:
    first = {row.phase: row for row in reversed(rows)}
    phases: list[Phase] = []
    all_reds = {row.all_red for row in rows}
    common = all_reds.pop() if len(all_reds) == 1 else 0.0
    for number in sorted(first):
        links = (row.link_id for row in rows if row.phase == number)
        named = tuple(link_id for link_id in links if link_id is not None)
        phases.append(Phase(first[number].green, named))
        if first[number].all_red > common:
            phases.append(Phase(first[number].all_red, ()))
    return Signal(rows[0].node_id, tuple(phases), offset=rows[0].offset, all_red=common)


def _add_number_faults(rows: Numbered, faults: Faults) -> None:
    for row, line in rows:
        if not (row.green > 0 and row.green < math.inf) and not math.isnan(row.green):
            what = "must be a finite number above 0: a phase without green is no phase"
            faults.add(what, line=line, column="green_s", value=f"{row.green:g}")
        if not 0 <= row.all_red < math.inf and not math.isnan(row.all_red):
            what = "must be a finite number of 0 or more"
            faults.add(what, line=line, column="all_red_s", value=f"{row.all_red:g}")
        for column, value in (("offset_s", row.offset), ("cycle_s", row.cycle)):
            if math.isinf(value):
                faults.add("must be a finite number", line=line, column=column, value=f"{value:g}")


def _add_link_faults(rows: Numbered, faults: Faults) -> None:
    """Note links that stand twice in a phase, and a node that holds none."""
    seen: dict[tuple[int, str | None], int] = {}
    for row, line in rows:
        before = seen.setdefault((row.phase, row.link_id), line)
        if before != line:
            what = f"stands in phase {row.phase} of node {row.node_id} on line {before} too"
            faults.add(what, line=line, column="link_id", value=row.link_id or "")
    if all(row.link_id is None for row, _ in rows):
        row, line = rows[0]
        what = "no phase of the node names a link, so the signal would hold nobody"
        faults.add(what, line=line, column="node_id", value=row.node_id)


def _add_gap_faults(rows: Numbered, faults: Faults) -> None:
    present = {row.phase for row, _ in rows}
    for expected, number in enumerate(sorted(present), start=1):
        if number != expected:
            line = next(line for row, line in rows if row.phase == number)
            what = f"phases count from 1 without gaps, but node {rows[0][0].node_id} has no phase "
            faults.add(f"{what}{expected}", line=line, column="phase", value=number)
            return


def _complete_node(rows: Numbered, faults: Faults) -> list[SignalRow]:
    """The rows of one node with all that they leave out."""
    filled: list[SignalRow] = [row for row, _ in rows]
    greens: dict[int, float] = {}
    all_reds: dict[int, float] = {}
    for number in sorted({row.phase for row in filled}):
        own = [(row, line) for row, line in rows if row.phase == number]
        place = f"phase {number} of node {own[0][0].node_id}"
        greens[number] = _agreed(own, "green_s", place, faults)
        red = _agreed(own, "all_red_s", place, faults)
        all_reds[number] = 0.0 if math.isnan(red) else red
        if math.isnan(greens[number]):
            what = f"no row gives {place} a green"
            faults.add(what, line=own[0][1], column="green_s", value="")
    place = f"node {rows[0][0].node_id}"
    offset = _agreed(rows, "offset_s", place, faults)
    offset = 0.0 if math.isnan(offset) else offset
    cycle = _agreed(rows, "cycle_s", place, faults)
    parts = math.fsum([*greens.values(), *all_reds.values()])
    if abs(cycle - parts) > _SAME:
        line = next(line for row, line in rows if not math.isnan(row.cycle))
        what = (
            f"greens and all-red times of {place} sum to {parts:.10g}: mend them, or leave it out"
        )
        faults.add(what, line=line, column="cycle_s", value=f"{cycle:.10g}")
    cycle = parts if math.isnan(cycle) else cycle
    return [
        row._replace(
            green=greens[row.phase], all_red=all_reds[row.phase], offset=offset, cycle=cycle
        )
        for row in filled
    ]


def _agreed(rows: Numbered, column: str, place: str, faults: Faults) -> float:
    """The value that all rows give which give one; NaN where none does."""
    said = [(getattr(row, NUMBERS[column]), line) for row, line in rows]
    given = [(value, line) for value, line in said if not math.isnan(value)]
    if not given:
        return math.nan
    first, where = given[0]
    for value, line in given[1:]:
        if value != first:
            what = f"{place} has {first:.10g} on line {where}: all its rows must say the same"
            faults.add(what, line=line, column=column, value=f"{value:.10g}")
    return float(first)
