"""Changes of demand as a whole or of parts of it: scaled, moved in time, replaced, of classes.

All work on tables between places and on demand between nodes alike, and tell the vehicles out of
and into every place before and after.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.demand.demand import Demand
from uxsim_geo.demand.od_table import (
    CLASS,
    TIMES,
    Ends,
    Od,
    OdTable,
    add_of_rows,
    check_od,
    classes_of,
    ends_of,
    ordered,
    totals_report,
    vehicles_of,
    with_notes,
)
from uxsim_geo.demand.rounding import round_keeping_totals
from uxsim_geo.draws import Keys, combine, text_keys
from uxsim_geo.errors import Faults
from uxsim_geo.network.notes import Notes

Booleans = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Where:
    """Which rows are meant: those that fit everything that is given (None: all fit).

    origins, destinations
        places (zones, or nodes in a demand)
    pairs
        of an origin and a destination
    classes
        of drivers; those without a name are ``default``
    between
        two moments, s: rows that start from the first on and before the second
    """

    origins: Collection[str] | None = None
    destinations: Collection[str] | None = None
    pairs: Collection[tuple[str, str]] | None = None
    classes: Collection[str] | None = None
    between: tuple[float, float] | None = None

    def rows(self, table: pd.DataFrame) -> Booleans:
        """Whether each row of a table is meant.

        Raises :class:`uxsim_geo.errors.InputError` for places, pairs and classes that have no
        row, moments that do not ascend, and a table without times where they are asked for.
        """
        faults = Faults("where")
        chosen = np.ones(len(table), bool)
        for name, asked in (("origin", self.origins), ("destination", self.destinations)):
            if asked is not None:
                chosen &= _among(table[name].astype("str"), asked, f"{name}s", faults)
        if self.pairs is not None:
            both = pd.Series(list(zip(table["origin"], table["destination"], strict=True)))
            chosen &= _among(both, self.pairs, "pairs", faults)
        if self.classes is not None:
            names, of_row = classes_of(table)
            of = pd.Series(np.array(names, object)[of_row])
            chosen &= _among(of, self.classes, "classes", faults)
        if self.between is not None:
            chosen &= self._in_time(table, faults)
        faults.raise_if_any()
        return chosen

    def _in_time(self, table: pd.DataFrame, faults: Faults) -> Booleans:
        begin, end = self.between or (0.0, 0.0)
        if not begin < end:
            faults.add(
                "must be an earlier and a later moment, s", column="between", value=self.between
            )
        if not set(TIMES) <= set(table):
            faults.add("the table has no times", column="between")
            return np.zeros(len(table), bool)
        start = table["start_s"].to_numpy(np.float64)
        return (start >= begin) & (start < end)


def _among(values: pd.Series, asked: Collection[object], what: str, faults: Faults) -> Booleans:
    if isinstance(asked, str):
        faults.add("must be several names, in a list", column=what, value=asked)
        return np.zeros(len(values), bool)
    known = set(values)
    for name in asked:
        if name not in known:
            faults.add("no row of the table is of this name", column=what, value=name)
    return values.isin(list(asked)).to_numpy(bool)


#: every row
ALL = Where()


def scale(od: Od, factor: float, where: Where = ALL) -> tuple[Od, pd.DataFrame]:
    """Multiply the vehicles of some rows by a factor (0 takes them out).

    Returns the demand or table, and the report of
    :func:`uxsim_geo.demand.od_table.totals_report`.
    """
    faults = Faults("scale")
    if not 0 <= factor < math.inf:
        faults.add("must be a finite number, 0 or more", column="factor", value=factor)
    faults.raise_if_any()
    chosen = where.rows(od.table)
    vehicles = vehicles_of(od.table)
    table = od.table.assign(vehicles=np.where(chosen, vehicles * factor, vehicles))
    return _changed(od, table[table["vehicles"] > 0], f"multiplied by {factor:g}", chosen)


def shift(od: Od, by_s: float, where: Where = ALL) -> tuple[Od, pd.DataFrame]:
    """Let some rows depart later by ``by_s`` seconds, or earlier if that is below 0.

    Returns as :func:`scale`. Raises :class:`uxsim_geo.errors.InputError` for rows that would
    depart before the start, and for a table without times.
    """
    faults = Faults("shift")
    if not math.isfinite(by_s):
        faults.add("must be a finite number of seconds", column="by_s", value=by_s)
    if not set(TIMES) <= set(od.table):
        faults.add("the table has no times to shift")
    faults.raise_if_any()
    chosen = where.rows(od.table)
    start, end = (od.table[name].to_numpy(np.float64) for name in TIMES)
    early = chosen & (start + by_s < 0)
    what = f"would be before the start, moved by {by_s:g} s"
    add_of_rows(faults, od.table, early, "start_s", what)
    faults.raise_if_any()
    moved = np.where(chosen, start + by_s, start)
    # a moment is the shortest period there is, which is longer at a later time
    until = np.where(chosen, np.maximum(end + by_s, np.nextafter(moved, np.inf)), end)
    table = od.table.assign(start_s=moved, end_s=until)
    return _changed(od, table, f"moved by {by_s:g} s", chosen)


def replace_rows(od: Od, rows: pd.DataFrame, where: Where) -> tuple[Od, pd.DataFrame]:
    """Take the rows that are meant out, and put others in.

    ``rows``: a table with the columns of ``od`` (class may be absent); it may be empty. Returns
    as :func:`scale`. Raises :class:`uxsim_geo.errors.InputError` with every fault of the rows.
    """
    faults = Faults("rows to put in")
    needed = [name for name in od.table.columns if name not in (CLASS, "route")]
    for name in needed:
        if name not in rows:
            faults.add(f"lacks the column {name}")
    faults.raise_if_any()
    rows = rows.astype({"origin": "str", "destination": "str", "vehicles": "float64"})
    check_od(rows.reset_index(drop=True), faults)
    faults.raise_if_any()
    chosen = where.rows(od.table)
    parts = [part for part in (od.table[~chosen], rows[rows["vehicles"] > 0]) if len(part)]
    table = pd.concat(parts) if parts else od.table[~chosen]
    return _changed(od, table, "replaced", chosen)


def split_classes(
    od: Od, shares: Mapping[str, float], where: Where = ALL
) -> tuple[Od, pd.DataFrame]:
    """Part the vehicles of some rows among classes of drivers, by shares that sum to 1.

    Returns as :func:`scale`; totals stay as they are.
    """
    faults = Faults("shares of classes")
    for name, share in shares.items():
        if not 0 <= share <= 1:
            faults.add("must be from 0 to 1", column=name, value=share)
    if abs(math.fsum(shares.values()) - 1) > 1e-9:
        faults.add("the shares must sum to 1", value=math.fsum(shares.values()))
    faults.raise_if_any()
    chosen = where.rows(od.table)
    parts = [od.table[~chosen]]
    for name, share in shares.items():
        part = od.table[chosen]
        part = part.assign(vehicles=vehicles_of(part) * share)
        part[CLASS] = name
        parts.append(part[part["vehicles"] > 0])
    table = pd.concat([part for part in parts if len(part)] or parts[:1])
    told = ", ".join(f"{name} {share:g}" for name, share in shares.items())
    return _changed(od, table, f"parted among classes: {told}", chosen)


def whole_vehicles(od: Od) -> tuple[Od, pd.DataFrame]:
    """Round the vehicles of every row up or down, totals of places and of all kept within one.

    Small pairs of a table with many of them are drawn, each in proportion to its vehicles, by the
    names of its places alone: the same at every seed, and in scenarios that change other pairs as
    alike as the totals allow. So a table has no more rows than vehicles. Returns as :func:`scale`.
    """
    ends = ends_of(od.table)
    whole = round_keeping_totals(
        vehicles_of(od.table), ends.origin, ends.destination, _keys_of_rows(od.table, ends)
    )
    chosen = whole > 0
    table = od.table.assign(vehicles=whole.astype(np.float64))[chosen]
    return _changed(od, table, "rounded to whole vehicles, totals kept", np.ones(len(whole), bool))


@np.errstate(over="ignore")  # hashes overflow by design
def _keys_of_rows(table: pd.DataFrame, ends: Ends) -> Keys:
    """A random identity for every row: its places, class and time."""
    names, classes = text_keys(ends.names), classes_of(table)
    keys: Keys = combine(names[ends.origin], names[ends.destination])
    keys = combine(keys, text_keys(classes[0])[classes[1]])
    if TIMES[0] in table:
        keys = combine(keys, table[TIMES[0]].to_numpy(np.float64).view(np.uint64))
    return keys


def _changed(od: Od, table: pd.DataFrame, what: str, chosen: Booleans) -> tuple[Od, pd.DataFrame]:
    """The demand with a new table in its order, a note of the change, and the report."""
    if isinstance(od, Demand) and ("batch" in od.table or len(od.changes)):
        faults = Faults("demand")
        faults.add("change its tables before edits of scenarios, which name their rows, not after")
        faults.raise_if_any()
    report = totals_report(od.table, table)
    notes = Notes()
    before, after = (float(vehicles_of(part).sum()) for part in (od.table, table))
    note = f"rows {what}; vehicles in all {before:.10g} before and {after:.10g} after; value: rows"
    notes.add("changed", note, element="demand", value=int(chosen.sum()))
    table = ordered(table) if isinstance(od, OdTable) else _in_order(table)
    return replace(od, table=table, notes=with_notes(od.notes, notes.table())), report


def _in_order(table: pd.DataFrame) -> pd.DataFrame:
    """A demand as it was, or, where it has no given routes, in natural order."""
    return (table if "route" in table else ordered(table)).reset_index(drop=True)
