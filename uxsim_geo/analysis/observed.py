"""How well a simulation agrees with observed counts and travel times.

With simulated values M and observed values C of N observations:

    mean error = Σ (M − C) / N      RMSE = √(Σ (M − C)² / N)      relative RMSE = RMSE / mean of C
    R² = 1 − Σ (M − C)² / Σ (C − mean of C)²

R² tells how much of the differences between observations the simulation explains as it stands,
without a fitted line, and is below 0 where their mean alone would do better. For hourly volumes,
in veh/h, the GEH statistic weighs absolute and relative differences together:

    GEH = √(2 (M − C)² / (M + C))

Guidance on assignment models asks for a GEH under 5 on 85 % of the links (Department for
Transport, Transport Analysis Guidance unit M3.1: Highway Assignment Modelling).
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
import pandas as pd

from uxsim_geo.analysis.edie import ratio
from uxsim_geo.analysis.groups import Groups
from uxsim_geo.analysis.observations import (
    COUNT,
    INTERVAL,
    LINK,
    PAIR,
    TRAVEL_TIME,
    add_of_rows,
    check_observations,
)
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.demand.count_adjustment import geh
from uxsim_geo.errors import Faults

HOUR = 3600.0

#: a GEH under this counts as agreement
AGREES = 5.0

#: the end of an interval may miss the edge of a bin by the rounding of a decimal fraction, s
EDGE = 1e-6


class Comparison(NamedTuple):
    """Observations beside what was simulated, and the figures of their agreement.

    table
        one row an observation, in the order given
    figures
        of all observations that have a simulated value: ``compared`` (their number), mean_error,
        rmse (with their unit in the name), relative_rmse, r_squared, and for counts
        share_under_geh_5; NaN where not defined
    """

    table: pd.DataFrame
    figures: dict[str, float]


def compare_counts(
    observed: pd.DataFrame,
    states: pd.DataFrame,
    *,
    at: Literal["entries", "exits"] = "entries",
) -> Comparison:
    """Compare counts with the vehicles that entered (or left) the links in those intervals.

    ``observed``: link_id, start_s, end_s, vehicles, as
    :func:`uxsim_geo.analysis.observations.read_counts` reads them. ``states``: the links by time
    bins, as :func:`uxsim_geo.analysis.link_states.states_of_passages` gives them; every interval
    must begin and end with a bin. The table has link_id, start_s, end_s, observed_vehicles,
    simulated_vehicles, observed_flow_vph, simulated_flow_vph, geh; the figures are of the flows,
    in veh/h, so that intervals of all lengths count alike.

    Raises :class:`uxsim_geo.errors.InputError` with all observations that are wrong, of a link
    that is not there, or of an interval that the bins do not make up.
    """
    check_observations(observed, LINK, COUNT).raise_if_any()
    _check_columns(states, (*LINK, "begin_s", "end_s", at))
    simulated = _sums(observed, states, LINK, {at: states[at].to_numpy(float)})[at]
    counted = observed[COUNT].to_numpy(float)
    hours = (observed["end_s"] - observed["start_s"]).to_numpy(float) / HOUR
    flows = counted / hours, simulated / hours
    table = observed[[*LINK, *INTERVAL]].reset_index(drop=True)
    table = table.assign(
        observed_vehicles=counted,
        simulated_vehicles=simulated,
        observed_flow_vph=flows[0],
        simulated_flow_vph=flows[1],
        geh=geh(*flows),
    )
    figures = _figures(*flows, unit="vph")
    figures["share_under_geh_5"] = float(np.mean(table["geh"] < AGREES))
    return Comparison(table, figures)


def compare_travel_times(observed: pd.DataFrame, simulated: pd.DataFrame) -> Comparison:
    """Compare travel times of links, or of pairs of nodes, with the simulated ones.

    ``observed``: as :func:`uxsim_geo.analysis.observations.read_travel_times` reads them.
    ``simulated``: for links, the links by time bins, whose times are of those who left in the
    interval; for pairs, what
    :func:`uxsim_geo.analysis.skims.skims` gives, whose times are of those who departed in it and
    completed. Means over several bins are weighted by vehicles. The table has
    the observed columns, vehicles (simulated, behind the mean) and simulated_travel_time_s, NaN
    where there were none; the figures leave those out.

    Raises :class:`uxsim_geo.errors.InputError` with all observations that are wrong, of a link or
    pair that is not there, or of an interval that the bins do not make up.
    """
    keys = LINK if "link_id" in observed else PAIR
    names = (
        ("experienced_travel_time", "exits")
        if keys == LINK
        else ("experienced_travel_time_completed_only_s", "vehicles_completed")
    )
    check_observations(observed, keys, TRAVEL_TIME).raise_if_any()
    _check_columns(simulated, (*keys, "begin_s", "end_s", *names))
    time, vehicles = (simulated[name].to_numpy(float) for name in names)
    sums = _sums(
        observed,
        simulated,
        keys,
        {"time": np.nan_to_num(time) * vehicles, "vehicles": vehicles},
    )
    mean = ratio(sums["time"], sums["vehicles"])
    table = observed[[*keys, *INTERVAL]].reset_index(drop=True)
    table = table.assign(
        observed_travel_time_s=observed[TRAVEL_TIME].to_numpy(float),
        simulated_travel_time_s=mean,
        vehicles=sums["vehicles"],
    )
    return Comparison(table, _figures(observed[TRAVEL_TIME].to_numpy(float), mean, unit="s"))


def _figures(observed: Floats, simulated: Floats, *, unit: str) -> dict[str, float]:
    has_both = ~np.isnan(simulated)
    observed, error = observed[has_both], (simulated - observed)[has_both]
    compared = len(error)
    if not compared:
        nothing = (f"mean_error_{unit}", f"rmse_{unit}", "relative_rmse", "r_squared")
        return {"compared": 0, **dict.fromkeys(nothing, np.nan)}
    mean, squares = float(observed.mean()), float((error**2).sum())
    spread = float(((observed - mean) ** 2).sum())
    rmse = np.sqrt(squares / compared)
    return {
        "compared": compared,
        f"mean_error_{unit}": float(error.mean()),
        f"rmse_{unit}": float(rmse),
        "relative_rmse": float(rmse / mean) if mean > 0 else np.nan,
        "r_squared": 1 - squares / spread if spread > 0 else np.nan,
    }


def _sums(
    observed: pd.DataFrame,
    simulated: pd.DataFrame,
    keys: tuple[str, ...],
    values: dict[str, Floats],
) -> dict[str, Floats]:
    """Sums of columns of the simulated table over each observation's key and interval."""
    names = [pd.Categorical(simulated[key]) for key in keys]
    groups = Groups.of(*(name.codes.astype(np.int64) for name in names))
    known = pd.MultiIndex.from_arrays(
        [name.categories.astype(str)[at] for name, at in zip(names, groups.keys, strict=True)]
    )
    begin, end = (simulated[name].to_numpy(float) for name in ("begin_s", "end_s"))
    edges = np.unique(np.concatenate((begin, end)))
    row = known.get_indexer(pd.MultiIndex.from_frame(observed[list(keys)].astype(str)))
    first, last = (_edges_of(observed[name].to_numpy(float), edges) for name in INTERVAL)
    _check_places(observed, keys, (row, first, last), edges)
    size = (len(known), len(edges))
    cell = groups.number * len(edges) + np.searchsorted(edges, begin) + 1

    def between(column: Floats) -> Floats:
        sums = np.bincount(cell, column, minlength=size[0] * size[1]).reshape(size)
        until = np.cumsum(sums, axis=1, dtype=np.float64)
        total: Floats = until[row, last] - until[row, first]
        return total

    return {name: between(column) for name, column in values.items()}


def _edges_of(times: Floats, edges: Floats) -> Integers:
    """Which edge each moment is; -1: none."""
    place = np.clip(np.searchsorted(edges, times - EDGE), 0, len(edges) - 1)
    return np.where(np.abs(edges[place] - times) <= EDGE, place, -1).astype(np.int64)


def _check_places(
    observed: pd.DataFrame,
    keys: tuple[str, ...],
    places: tuple[Integers, Integers, Integers],
    edges: Floats,
) -> None:
    faults = Faults(observed.attrs.get("source", "observed"))
    row, first, last = places
    unknown = "there is nothing of this name in the simulated table"
    add_of_rows(faults, observed, row < 0, keys[0], unknown)
    bins = f"must begin or end a simulated bin; they lie from {edges[0]:g} to {edges[-1]:g} s"
    step = f", the first up to {edges[1]:g} s" if len(edges) > 1 else ""
    for place, column in ((first, "start_s"), (last, "end_s")):
        add_of_rows(faults, observed, place < 0, column, bins + step)
    faults.raise_if_any()


def _check_columns(simulated: pd.DataFrame, columns: tuple[str, ...]) -> None:
    faults = Faults("simulated")
    for column in columns:
        if column not in simulated:
            faults.add(f"lacks the column {column}: is it a table by time bin, of links or pairs?")
    faults.raise_if_any()
