"""Balance a table between places to given totals out of and into each (Furness)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Generic

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.demand.furness import EQUAL, BalanceOptions, Fitted, equal_sums, fit_totals
from uxsim_geo.demand.od_table import (
    Ends,
    Od,
    add_of_rows,
    ends_of,
    natural_order,
    vehicles_of,
    with_notes,
)
from uxsim_geo.demand.table_files import find_columns, ids_of, numbers_of, read_table_file
from uxsim_geo.errors import Faults
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.rows import lacking

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

TOTALS = ("place", "out", "in")


@dataclass(frozen=True)
class Balanced(Generic[Od]):
    """A balanced table, and how well it fits.

    od
        with a note on how it was balanced
    report
        one row a place, in natural order: place, out_before, out_wanted, out_after, in_before,
        in_wanted, in_after (vehicles), why (text: what was not met, or scaled)
    iterations
        iteration, worst_deviation (the greatest part by which any total is off)
    converged
        whether the tolerance was met
    """

    od: Od
    report: pd.DataFrame
    iterations: pd.DataFrame
    converged: bool


def read_totals(path: Path) -> pd.DataFrame:
    """Read totals of places from CSV or Parquet: place (or zone), out, in (vehicles).

    Raises :class:`uxsim_geo.errors.InputError` with every fault, its line, column and value.
    """
    faults = Faults(str(path))
    table = read_table_file(path, faults)
    faults.raise_if_any()
    assert table is not None, "else there was a fault"
    names: Mapping[str, tuple[str, ...]] = {
        "place": ("place", "zone", "zone_id", "node", "node_id"),
        "out": ("out", "production", "productions", "origins"),
        "in": ("in", "attraction", "attractions", "destinations"),
    }
    found = find_columns(table, names, {}, faults)
    for name in TOTALS:
        if name not in found:
            there = ", ".join(map(str, table.columns))
            faults.add(f"lacks the column {name} (columns here: {there})")
    faults.raise_if_any()
    totals = pd.DataFrame({"place": ids_of(table, found["place"], faults)})
    for name in TOTALS[1:]:
        totals[name] = numbers_of(table, found[name], faults)
    _add_total_faults(totals, faults)
    faults.raise_if_any()
    return totals


def _add_total_faults(totals: pd.DataFrame, faults: Faults) -> None:
    add_of_rows(faults, totals, lacking(totals["place"]), "place", "needs the id of a place")
    again = totals["place"].duplicated().to_numpy(bool)
    add_of_rows(faults, totals, again, "place", "the place stands in an earlier row too")
    for name in TOTALS[1:]:
        values = totals[name].to_numpy(np.float64)
        wrong = ~(np.isfinite(values) & (values >= 0))
        add_of_rows(faults, totals, wrong, name, "must be a finite number of vehicles, 0 or more")


def balance(od: Od, totals: pd.DataFrame, options: BalanceOptions | None = None) -> Balanced[Od]:
    """Balance a table between places, or a demand between nodes, to totals out and in.

    ``totals``: place, out, in (vehicles), for every place of the table; places of no row there
    may be among them, and what they should have cannot be met, which the report tells. Rows of
    all times and classes of a pair are multiplied alike.

    Raises :class:`uxsim_geo.errors.InputError` for totals that are wrong or missing, and for sums
    that differ with ``keep`` fault.
    """
    options = options or BalanceOptions()
    faults, notes = Faults(str(totals.attrs.get("source", "totals"))), Notes()
    ends, asked = _asked(od.table, totals, faults)
    wanted = equal_sums(asked, options, faults, notes)
    faults.raise_if_any()
    seed = vehicles_of(od.table)
    fitted = fit_totals(seed, ends, wanted, options)
    report = _report(ends, seed, asked, fitted)
    converged = fitted.worst[-1] <= options.tolerance
    _note_fit(fitted, report, notes, converged=converged)
    table = od.table.assign(vehicles=fitted.vehicles)
    table = table[table["vehicles"] > 0]
    if table.index.name is None:
        table = table.reset_index(drop=True)
    new = replace(od, table=table, notes=with_notes(od.notes, notes.table()))
    steps = pd.DataFrame({"worst_deviation": fitted.worst})
    steps.insert(0, "iteration", np.arange(1, len(steps) + 1))
    return Balanced(new, report, steps, converged)


def _asked(
    table: pd.DataFrame, totals: pd.DataFrame, faults: Faults
) -> tuple[Ends, tuple[Floats, Floats]]:
    """The ends among all places, and the totals out and in of each; raises if there are faults."""
    for name in TOTALS:
        if name not in totals:
            faults.add(f"lacks the column {name}: it needs {', '.join(TOTALS)}")
    faults.raise_if_any()
    totals = totals.astype({"place": "str"})
    _add_total_faults(totals, faults)
    ends = _with_places(ends_of(table), totals["place"], faults)
    faults.raise_if_any()
    found = totals.set_index("place").reindex(ends.names)
    out, into = (found[name].to_numpy(np.float64) for name in TOTALS[1:])
    return ends, (out, into)


def _with_places(ends: Ends, places: pd.Series[str], faults: Faults) -> Ends:
    """The ends among all places of table and totals; a fault for each without a total."""
    known = set(places)
    for name in ends.names:
        if name not in known:
            faults.add("has no total: every place of the table needs one", value=name)
    names = pd.Index(natural_order(known | set(ends.names)), dtype="str")
    place = names.get_indexer(ends.names).astype(np.int64)
    return Ends(names, place[ends.origin], place[ends.destination])


def _report(ends: Ends, seed: Floats, asked: tuple[Floats, Floats], fitted: Fitted) -> pd.DataFrame:
    before, after = ends.totals(seed), ends.totals(fitted.vehicles)
    columns: dict[str, object] = {"place": ends.names}
    why: list[list[str]] = [[] for _ in ends.names]
    for side, end in enumerate(("out", "in")):
        columns |= {
            f"{end}_before": before[side],
            f"{end}_wanted": asked[side],
            f"{end}_after": after[side],
        }
        lost = (asked[side] > 0) & (fitted.wanted[side] == 0)
        for place in np.flatnonzero(lost).tolist():
            why[place].append(f"{end}: no row of the table leads to or from a place with a total")
        scaled = (fitted.wanted[side] > 0) & ~np.isclose(fitted.wanted[side], asked[side], EQUAL, 0)
        for place in np.flatnonzero(scaled).tolist():
            why[place].append(f"{end}: total multiplied to {fitted.wanted[side][place]:.6g}")
    return pd.DataFrame(columns).assign(why=pd.Series(["; ".join(one) for one in why], dtype="str"))


def _note_fit(fitted: Fitted, report: pd.DataFrame, notes: Notes, *, converged: bool) -> None:
    unmet = sum(
        float(report[f"{end}_wanted"][side == 0].sum())
        for end, side in zip(("out", "in"), fitted.wanted, strict=True)
    )
    if unmet > 0:
        note = "vehicles of totals that no row of the table can meet, out and in; value: vehicles"
        notes.add("totals not met", note, element="demand", severity="warning", value=repr(unmet))
    note = f"balanced to totals in {len(fitted.worst)} iterations; value: share off at most"
    if not converged:
        note = f"NOT balanced after {len(fitted.worst)} iterations; value: share off at most"
    notes.add(
        "balanced",
        note,
        element="demand",
        severity="info" if converged else "warning",
        value=f"{fitted.worst[-1]:.3g}",
    )
