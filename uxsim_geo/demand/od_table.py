"""OD tables: vehicles between places, before anybody is put on a network.

A place is a zone or a node, known by its id (text). Every source of demand becomes such a table;
:func:`uxsim_geo.demand.od_loading.load_od` makes the demand of a network from it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.control.drivers import DEFAULT
from uxsim_geo.demand.access import Access
from uxsim_geo.demand.demand import DEMAND_COLUMNS, Demand
from uxsim_geo.errors import Faults
from uxsim_geo.network.network import NOTE_COLUMNS
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.rows import lacking

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

#: columns that every OD table has
OD_COLUMNS = ("origin", "destination", "vehicles")

#: and, in this order, those that it may have
TIMES = ("start_s", "end_s")
CLASS = "class"

#: demand that was left out
DROPPED_COLUMNS = ("reason", "origin", "destination", "vehicles")


def nothing_dropped() -> pd.DataFrame:
    """The table of what was dropped, without a row."""
    table = pd.DataFrame({name: pd.Series(dtype="str") for name in DROPPED_COLUMNS})
    return table.astype({"vehicles": "float64"})


def no_notes() -> pd.DataFrame:
    """The table of notes, without a row."""
    return pd.DataFrame({name: pd.Series(dtype="str") for name in NOTE_COLUMNS})


@dataclass(frozen=True)
class OdTable:
    """Vehicles between places.

    table
        origin, destination (text), vehicles (float64, 0 or more) and, where the source has them,
        start_s, end_s (s after the start; departures spread evenly over [start_s, end_s)) and
        class (of drivers, text). The index is the line or the row of the source. Rows are in the
        natural order of origin, destination, class and time, whatever order the source had.
    source
        what messages call it
    notes
        what was dropped or assumed, as in :class:`uxsim_geo.network.network.Network`
    access
        of places that the source ties to nodes itself, such as points; None: it does not
    dropped
        what the reader left out: reason, origin, destination, vehicles
    """

    table: pd.DataFrame
    source: str = "OD table"
    notes: pd.DataFrame = field(default_factory=no_notes)
    access: Access | None = None
    dropped: pd.DataFrame = field(default_factory=nothing_dropped)


#: what can be scaled, balanced and adjusted alike: between places, or between nodes
Od = TypeVar("Od", OdTable, Demand)


class Ends(NamedTuple):
    """Places of a table in natural order, and which of them each row starts and ends at."""

    names: pd.Index[str]
    origin: Ints  # (rows,)
    destination: Ints  # (rows,)

    def totals(self, vehicles: Floats) -> tuple[Floats, Floats]:
        """Vehicles out of and into each place; shape (places,)."""
        size = len(self.names)
        out = np.bincount(self.origin, vehicles, minlength=size)
        into = np.bincount(self.destination, vehicles, minlength=size)
        return out.astype(np.float64), into.astype(np.float64)


def natural_order(names: Iterable[str]) -> list[str]:
    """Names with numbers first, by their value, then the others by their text."""

    def key(name: str) -> tuple[bool, int, str, str]:
        number = name.lstrip("0") if name.isdecimal() and name.isascii() else ""
        is_text = not (name.isdecimal() and name.isascii())
        return is_text, len(number), number, name

    return sorted(names, key=key)


def ends_of(table: pd.DataFrame) -> Ends:
    """The places of a table by number."""
    columns = [table[name].astype("str") for name in ("origin", "destination")]
    codes, found = pd.factorize(pd.concat(columns, ignore_index=True))
    names = pd.Index(natural_order(found), dtype="str")
    place = names.get_indexer(pd.Index(found, dtype="str")).astype(np.int64)[codes]
    origin, destination = np.split(place, 2)
    return Ends(names, origin, destination)


def classes_of(table: pd.DataFrame) -> tuple[list[str], Ints]:
    """The classes of a table in the order of their names, and which of them each row is of."""
    if CLASS not in table:
        return [DEFAULT], np.zeros(len(table), np.int64)
    codes, found = pd.factorize(table[CLASS].astype("str").fillna(DEFAULT))
    names = sorted(found)
    place = np.array([names.index(name) for name in found], np.int64)
    return names, place[codes] if len(codes) else codes.astype(np.int64)


def vehicles_of(table: pd.DataFrame) -> Floats:
    """The vehicles of every row."""
    return np.asarray(table["vehicles"].to_numpy(np.float64))


def ordered(table: pd.DataFrame, notes: Notes | None = None) -> pd.DataFrame:
    """The rows in natural order, those of the same pair, class and time summed to the first.

    With ``notes`` a warning tells of pairs that stood on several rows.
    """
    ends, (classes, of_class) = ends_of(table), classes_of(table)
    times = [table[name].to_numpy(np.float64) for name in TIMES if name in table]
    keys = [ends.origin, ends.destination, of_class, *times]
    # the vehicles come last, so that sums do not depend on the order of the file
    order = np.lexsort((vehicles_of(table), *keys[::-1]))
    known = [name for name in (*DEMAND_COLUMNS, CLASS) if name in table]
    table = table[[*known, *table.columns.difference(known, sort=False)]].iloc[order]
    if CLASS in table:
        table = table.assign(**{CLASS: np.array(classes, object)[of_class[order]]})
        table = table.astype({CLASS: "str"})
    changes = [key[order][1:] != key[order][:-1] for key in keys]
    first = np.ones(len(table), bool)
    first[1:] = np.logical_or.reduce(changes)
    repeated = len(table) - int(first.sum())
    if not repeated:
        return table
    if notes is not None:
        note = "rows of the same pair, class and time as another were added to it; value: rows"
        notes.add("pairs summed", note, element="demand", severity="warning", value=repeated)
    sums = np.add.reduceat(vehicles_of(table), np.flatnonzero(first))
    return table[first].assign(vehicles=sums)


def add_of_rows(
    faults: Faults,
    table: pd.DataFrame,
    wrong: npt.NDArray[np.bool_],
    column: str,
    what: str,
) -> None:
    """Add a fault for every row that ``wrong`` marks, at its line if the index is one."""
    rows = np.flatnonzero(wrong)
    is_line = table.index.name == "line"
    for row in rows[: faults.limit].tolist():
        value, place = table[column].iloc[row], table.index[row]
        if is_line:
            faults.add(what, line=int(place), column=column, value=value)
        else:
            faults.add(f"row {place}: {what}", column=column, value=value)
    faults.more += max(0, len(rows) - faults.limit)


def check_od(table: pd.DataFrame, faults: Faults) -> None:
    """Add every fault of the rows of an OD table: ids, vehicles, times.

    Times on lines that have a fault already are passed over: one of them may be no number.
    """
    told = table.index.isin([fault.line for fault in faults.found])
    for column in (name for name in ("origin", "destination") if name in table):
        add_of_rows(faults, table, lacking(table[column]), column, "needs the id of a place")
    vehicles = vehicles_of(table)
    what = "must be a finite number of vehicles, 0 or more"
    add_of_rows(faults, table, ~(np.isfinite(vehicles) & (vehicles >= 0)), "vehicles", what)
    if not set(TIMES) <= set(table):
        return
    start, end = (table[name].to_numpy(np.float64) for name in TIMES)
    for wrong, column, what in (
        (~(np.isfinite(start) & (start >= 0)), "start_s", "must be a number of seconds, 0 or more"),
        (~told & ~(np.isfinite(end) & (end > start)), "end_s", "must be later than start_s"),
    ):
        add_of_rows(faults, table, wrong, column, what)


def with_notes(first: pd.DataFrame, second: pd.DataFrame) -> pd.DataFrame:
    """The rows of two tables of notes, one behind the other."""
    if first.empty or second.empty:
        return second if first.empty else first
    return pd.concat([first, second], ignore_index=True)


def totals_report(before: pd.DataFrame, after: pd.DataFrame) -> pd.DataFrame:
    """Vehicles out of and into every place before and after a change.

    One row a place of either table, in natural order: place, out_before, out_after, in_before,
    in_after.
    """
    both = ends_of(pd.concat([before[["origin", "destination"]], after[["origin", "destination"]]]))
    cut = len(before)
    tables = []
    for part, table in ((slice(None, cut), before), (slice(cut, None), after)):
        ends = Ends(both.names, both.origin[part], both.destination[part])
        tables.append(ends.totals(vehicles_of(table)))
    (out_before, in_before), (out_after, in_after) = tables
    return pd.DataFrame(
        {
            "place": both.names,
            "out_before": out_before,
            "out_after": out_after,
            "in_before": in_before,
            "in_after": in_after,
        }
    )
