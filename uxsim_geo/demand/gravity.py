"""Demand for cities without data: a gravity model from what zones hold and how far they lie.

    T_ij = a_i b_j P_i A_j f(t_ij),   f(t) = t^(−b) e^(−c t),  t in min

P_i are the vehicles that zone i sends in the period, A_j those that zone j draws, t_ij the
free-flow travel time; a_i and b_j make the totals hold (doubly constrained; Wilson 1967), or a_i
alone those sent. With b = 0 the impedance is exponential, with c = 0 a power, else the two
combined (gamma; Tanner 1961).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.demand.free_flow import ZoneTimes
from uxsim_geo.demand.furness import EQUAL, BalanceOptions, Fitted, fit_totals
from uxsim_geo.demand.od_table import Ends, OdTable, add_of_rows, natural_order
from uxsim_geo.demand.trip_ends import amounts
from uxsim_geo.errors import Faults
from uxsim_geo.network.notes import Notes

Floats = npt.NDArray[np.float64]

MINUTE = 60.0


@dataclass(frozen=True)
class Impedance:
    """f(t) = t^(−exponent) e^(−decay_per_min t), t in min.

    exponent
        b; 0: exponential
    decay_per_min
        c, 1/min, 0 or more; 0: a power
    least_s
        shorter times count as so many seconds, so that a power stays finite
    """

    exponent: float = 0.0
    decay_per_min: float = 0.0
    least_s: float = MINUTE

    def __post_init__(self) -> None:
        faults = Faults("impedance")
        if not math.isfinite(self.exponent):
            faults.add("must be a finite number", column="exponent", value=self.exponent)
        if not 0 <= self.decay_per_min < math.inf:
            what = "must be a finite number, 0 or more"
            faults.add(what, column="decay_per_min", value=self.decay_per_min)
        if not 0 < self.least_s < math.inf:
            faults.add("must be a finite number above 0", column="least_s", value=self.least_s)
        faults.raise_if_any()

    def of(self, seconds: Floats) -> Floats:
        """The impedance of travel times, 0 where they are NaN."""
        minutes = np.maximum(seconds, self.least_s) / MINUTE
        with np.errstate(over="ignore", under="ignore"):
            values = minutes**-self.exponent * np.exp(-self.decay_per_min * minutes)
        return np.asarray(np.where(np.isnan(seconds), 0.0, values), np.float64)


@dataclass(frozen=True)
class GravityOptions:
    """What is left to choose.

    constraint
        ``double``: vehicles sent and drawn hold; ``origin``: those sent hold
    intrazonal
        ``none``: everybody leaves the zone; ``half nearest``: trips within a zone take half the
        time to the nearest zone; they are dropped later, when put on a network, and reported
    balance
        tolerance and iterations
    """

    constraint: Literal["double", "origin"] = "double"
    intrazonal: Literal["none", "half nearest"] = "none"
    balance: BalanceOptions = field(default_factory=BalanceOptions)

    def __post_init__(self) -> None:
        faults = Faults("options of the gravity model")
        for name, known in (
            ("constraint", ("double", "origin")),
            ("intrazonal", ("none", "half nearest")),
        ):
            if getattr(self, name) not in known:
                faults.add(f"must be {' or '.join(known)}", column=name, value=getattr(self, name))
        faults.raise_if_any()


class Gravity(NamedTuple):
    """Demand by a gravity model.

    od
        between zones, without times
    report
        one row a zone: zone, production, attraction (scaled to the sum of productions), out, in
        (vehicles), why (text: what could not be sent or drawn)
    figures
        vehicles, mean_time_s (of their free-flow times), intrazonal_share, iterations,
        worst_deviation (the greatest part by which a total is off)
    """

    od: OdTable
    report: pd.DataFrame
    figures: dict[str, float]


def gravity(
    ends: pd.DataFrame,
    times: ZoneTimes,
    impedance: Impedance,
    options: GravityOptions | None = None,
) -> Gravity:
    """Distribute vehicles that zones send and draw by the times between them.

    ``ends``: as :func:`trip_ends` gives them, or zone, production, attraction of one's own.
    Vehicles of zones that reach no zone which draws any, or are reached from none, cannot be
    placed: the report tells. Raises :class:`uxsim_geo.errors.InputError` for zones without times.
    """
    options = options or GravityOptions()
    production, attraction = _in_order(ends, times)
    seconds = _with_intrazonal(times.seconds, options)
    with np.errstate(invalid="ignore", over="ignore"):
        seed = production[:, None] * attraction[None, :] * impedance.of(seconds)
    faults = Faults("impedance")
    if not np.isfinite(seed).all():
        faults.add("is too large for numbers at some times: raise least_s, or lower the exponent")
    faults.raise_if_any()
    origin, destination = np.nonzero(seed)
    places = Ends(times.zones, origin.astype(np.int64), destination.astype(np.int64))
    fitted = _fit(seed[origin, destination], places, (production, attraction), options)
    table = pd.DataFrame(
        {
            "origin": times.zones.array[origin],
            "destination": times.zones.array[destination],
            "vehicles": fitted.vehicles,
        }
    )
    table.index = pd.RangeIndex(1, len(table) + 1, name="row")
    report = _report(places, fitted, (production, attraction), options)
    figures = _figures(places, fitted, seconds)
    notes = Notes()
    _note(report, figures, impedance, notes)
    _note_unbalanced(figures, options, notes)
    od = OdTable(table[table["vehicles"] > 0], "gravity model", notes.table())
    return Gravity(od, report, figures)


def _in_order(ends: pd.DataFrame, times: ZoneTimes) -> tuple[Floats, Floats]:
    """Production and attraction of every zone of the times, 0 of those that have none."""
    faults = Faults("zones")
    named = ends.assign(zone=ends["zone"].astype("str"))
    for zone in natural_order(set(named["zone"]) - set(times.zones)):
        faults.add("there are no times from and to this zone", column="zone", value=zone)
    for name in ("production", "attraction"):
        amounts(named, name, faults)
    again = named["zone"].duplicated().to_numpy(bool)
    add_of_rows(faults, named, again, "zone", "the zone stands in an earlier row too")
    faults.raise_if_any()
    found = named.set_index("zone").reindex(times.zones).fillna(0.0)
    production, attraction = (
        found[name].to_numpy(np.float64) for name in ("production", "attraction")
    )
    drawn = float(attraction.sum())
    return production, attraction * (float(production.sum()) / drawn) if drawn > 0 else attraction


def _with_intrazonal(seconds: Floats, options: GravityOptions) -> Floats:
    """The times with those within a zone, NaN if there are to be no such trips."""
    times = seconds.copy()
    np.fill_diagonal(times, np.nan)
    if options.intrazonal == "half nearest":
        reached = np.where(np.isfinite(times), times, np.inf)
        nearest = np.min(reached, axis=1, initial=np.inf)
        np.fill_diagonal(times, np.where(np.isfinite(nearest), nearest / 2, np.nan))
    return times


def _fit(
    seed: Floats, places: Ends, totals: tuple[Floats, Floats], options: GravityOptions
) -> Fitted:
    production, attraction = totals
    if options.constraint == "double":
        return fit_totals(seed, places, totals, options.balance)
    sums = np.bincount(places.origin, seed, minlength=len(production))
    factor = np.divide(production, sums, out=np.zeros(len(production)), where=sums > 0)
    vehicles = seed * factor[places.origin]
    return Fitted(vehicles, (np.where(sums > 0, production, 0.0), attraction), [0.0])


def _report(
    places: Ends, fitted: Fitted, totals: tuple[Floats, Floats], options: GravityOptions
) -> pd.DataFrame:
    out, into = places.totals(fitted.vehicles)
    production, attraction = totals
    why: list[list[str]] = [[] for _ in places.names]
    for place in np.flatnonzero((production > 0) & (out == 0)).tolist():
        why[place].append("out: reaches no zone that draws vehicles")
    if options.constraint == "double":
        for place in np.flatnonzero((attraction > 0) & (into == 0)).tolist():
            why[place].append("in: no zone that sends vehicles reaches it")
    for end, goal, total in zip(("out", "in"), fitted.wanted, totals, strict=True):
        scaled = (goal > 0) & ~np.isclose(goal, total, EQUAL, 0)
        for place in np.flatnonzero(scaled).tolist():
            why[place].append(f"{end}: multiplied to {goal[place]:.6g}, since others were lost")
    return pd.DataFrame(
        {
            "zone": places.names,
            "production": production,
            "attraction": attraction,
            "out": out,
            "in": into,
            "why": pd.Series(["; ".join(one) for one in why], dtype="str"),
        }
    )


def _figures(places: Ends, fitted: Fitted, seconds: Floats) -> dict[str, float]:
    time = seconds[places.origin, places.destination]
    total = float(fitted.vehicles.sum())
    within = float(fitted.vehicles[places.origin == places.destination].sum())
    return {
        "vehicles": total,
        "mean_time_s": float((fitted.vehicles * time).sum() / total) if total else math.nan,
        "intrazonal_share": within / total if total else math.nan,
        "iterations": float(len(fitted.worst)),
        "worst_deviation": fitted.worst[-1],
    }


def _note(
    report: pd.DataFrame, figures: dict[str, float], impedance: Impedance, notes: Notes
) -> None:
    note = f"f(t) = t^-{impedance.exponent:g} exp(-{impedance.decay_per_min:g} t), t in min"
    told = f"{note}; mean free-flow time {figures['mean_time_s']:.6g} s; value: vehicles"
    notes.add("gravity model", told, element="demand", value=repr(figures["vehicles"]))
    nowhere = (report["production"] > 0) & (report["out"] == 0)
    lost = float(report.loc[nowhere, "production"].sum())
    if lost > 0:
        note = (
            "vehicles of zones that reach no zone that draws any were not placed; value: vehicles"
        )
        notes.add("gravity model", note, element="demand", severity="warning", value=repr(lost))


def _note_unbalanced(figures: dict[str, float], options: GravityOptions, notes: Notes) -> None:
    if figures["worst_deviation"] > options.balance.tolerance:
        note = (
            "NOT balanced: no table has these totals, such as where a zone sends more than all "
            "others draw and nobody may stay in it; value: share off at most"
        )
        value = f"{figures['worst_deviation']:.3g}"
        notes.add("gravity model", note, element="demand", severity="warning", value=value)
