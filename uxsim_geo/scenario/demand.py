"""Demand with more, fewer, other trips, or at other times; all other trips stay as they are.

Rows of the base stay in the table, so that their platoons are the same. What is added becomes a
batch of its own, what is taken out or moved is a change of platoons, see
:class:`uxsim_geo.demand.demand.Demand`.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.demand.demand import CHANGE_COLUMNS, Demand, no_changes
from uxsim_geo.demand.driven import driven
from uxsim_geo.demand.platoons import class_of_rows
from uxsim_geo.errors import Faults
from uxsim_geo.scenario.changes import Changes

Flags = npt.NDArray[np.bool_]


def scale_demand(
    demand: Demand, chosen: Flags, factor: float, number: int
) -> tuple[Demand, pd.DataFrame]:
    """Let so many times the trips of some rows drive.

    With a factor above 1 those of the base depart when they did, and others come beside them; with
    one below 1 a share of them drives, drawn by who they are. ``chosen``: by row, of which those
    without vehicles do not matter; ``number``: of the edit among those of the demand, from 1.
    Returns the demand and the changes. Raises :class:`uxsim_geo.errors.InputError` for a factor
    that is none.
    """
    if not 0 <= factor < math.inf:
        _refuse("must be a finite number, 0 or more", "factor", factor)
    if factor > 1:
        rows = demand.table[chosen]
        more = rows.assign(vehicles=rows["vehicles"].to_numpy(float) * (factor - 1))
        after = _with_batch(demand, more, number, inherit=np.flatnonzero(chosen))
    else:
        after = _with_change(demand, chosen, number, ("stays", factor, 0.0))
    return after, _changes(demand, after)


def shift_demand(
    demand: Demand, chosen: Flags, by_s: float, share: float, number: int
) -> tuple[Demand, pd.DataFrame]:
    """Let a share of the trips of some rows depart later by ``by_s`` (s), or earlier.

    Who is chosen is drawn by who they are; the others depart when they did. Returns and raises as
    :func:`scale_demand`, also for rows that would depart before the start.
    """
    if not math.isfinite(by_s) or by_s == 0:
        _refuse("must be a finite number of seconds, not 0", "by_s", by_s)
    if not 0 < share <= 1:
        _refuse("must be above 0 and at most 1", "share", share)
    moved = demand.changes[demand.changes["kind"] == "moved"]
    earliest = demand.table["start_s"].to_numpy(float).copy()
    np.add.at(earliest, moved["row"].to_numpy(int), np.minimum(moved["by_s"].to_numpy(float), 0.0))
    early = np.flatnonzero(chosen & (earliest + by_s < 0))
    if len(early):
        one = demand.table.iloc[early[0]]
        what = (
            f"{len(early)} rows of the demand would begin before the start, the first of them from "
            f"{one['origin']} to {one['destination']} at {earliest[early[0]] + by_s:g} s"
        )
        _refuse(what, "by_s", by_s)
    after = _with_change(demand, chosen, number, ("moved", share, by_s))
    return after, _changes(demand, after)


def replace_demand(
    demand: Demand, chosen: Flags, rows: pd.DataFrame | None, number: int
) -> tuple[Demand, pd.DataFrame]:
    """Take the trips of some rows out, and put others in; returns as :func:`scale_demand`.

    ``rows``: a demand table between nodes of the network; None: only take out.
    """
    after = _with_change(demand, chosen, number, ("stays", 0.0, 0.0)) if chosen.any() else demand
    if rows is not None and len(rows):
        after = _with_batch(after, rows, number, inherit=np.empty(0, np.int64))
    return after, _changes(demand, after)


def _refuse(what: str, column: str, value: object) -> None:
    faults = Faults()
    faults.add(what, column=column, value=value)
    faults.raise_if_any()


def _with_change(
    demand: Demand, chosen: Flags, number: int, what: tuple[str, float, float]
) -> Demand:
    kind, share, by_s = what
    if kind == "stays" and share == 1:
        return demand
    rows = np.flatnonzero(chosen)
    new = pd.DataFrame({"row": rows, "edit": number, "kind": kind, "share": share, "by_s": by_s})
    return replace(demand, changes=_joined(demand.changes, new))


def _with_batch(
    demand: Demand, rows: pd.DataFrame, number: int, inherit: npt.NDArray[np.int64]
) -> Demand:
    """Put rows behind the others, as a batch; they undergo the changes of rows they come from."""
    table = demand.table
    if "batch" not in table:
        table = table.assign(batch=0)
    rows = rows.assign(batch=number)
    columns = {}
    for name in dict.fromkeys([*table.columns, *rows.columns]):
        parts = [one[name] if name in one else _nothing(one) for one in (table, rows)]
        columns[name] = pd.concat(parts, ignore_index=True)
    columns["batch"] = columns["batch"].astype(np.int64)
    new = demand.changes[demand.changes["row"].isin(inherit)]
    places = pd.Series(len(table) + np.arange(len(inherit)), index=inherit)
    new = new.assign(row=places.reindex(new["row"]).to_numpy(np.int64))
    return replace(demand, table=pd.DataFrame(columns), changes=_joined(demand.changes, new))


def _nothing(table: pd.DataFrame) -> pd.Series:
    return pd.Series(None, index=table.index, dtype=object)


def _joined(old: pd.DataFrame, new: pd.DataFrame) -> pd.DataFrame:
    """The changes by edit, as a table with its types."""
    parts = [part[list(CHANGE_COLUMNS)] for part in (old, new) if len(part)]
    table = pd.concat(parts, ignore_index=True) if parts else no_changes()
    table = table.astype(dict(no_changes().dtypes))
    return table.sort_values(["edit", "row"], kind="stable").reset_index(drop=True)


def _changes(before: Demand, after: Demand) -> pd.DataFrame:
    """Vehicles by pair, and how much later they depart on average, before and after."""
    changes = Changes()
    both = [_by_pair(demand) for demand in (before, after)]
    names = ("_before", "_after")
    pairs = pd.concat(
        [one.add_suffix(name) for one, name in zip(both, names, strict=True)], axis=1
    ).sort_index()
    for name in ("vehicles", "mean_departure_s"):
        first, second = (pairs[f"{name}_{when}"].to_numpy(float) for when in ("before", "after"))
        differ = np.flatnonzero(~np.isclose(first, second, rtol=1e-9, atol=1e-9, equal_nan=True))
        told = zip(*(np.round(one[differ], 6).tolist() for one in (first, second)), strict=True)
        for (origin, destination, of), values in zip(pairs.index[differ], told, strict=True):
            of_class = "" if of == "default" else f" ({of})"
            changes.add("demand", f"{origin} to {destination}{of_class}", name, *values)
    return changes.table()


def _by_pair(demand: Demand) -> pd.DataFrame:
    table = driven(demand).table
    keys = [table["origin"].astype(str), table["destination"].astype(str)]
    keys.append(pd.Series(class_of_rows(table), index=table.index, name="class").astype(str))
    vehicles = table["vehicles"].astype(float)
    middle = (table["start_s"].astype(float) + table["end_s"].astype(float)) / 2 * vehicles
    both = pd.DataFrame({"vehicles": vehicles, "sum": middle}).groupby(keys).sum()
    mean = both["sum"] / both["vehicles"]
    return pd.DataFrame({"vehicles": both["vehicles"], "mean_departure_s": mean})
