"""Factors that give a table the totals wanted out of and into every place.

Searched are a_i and b_j such that T_ij = a_i b_j t_ij has the totals O_i and D_j:

    a_i = O_i / Σ_j b_j t_ij,   b_j = D_j / Σ_i a_i t_ij,   in turn until both hold

The result is the one with these totals that is nearest to the seed t in information; ratios
T_ij T_kl / (T_il T_kj) are those of the seed (Furness 1965; Deming and Stephan 1940).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from uxsim_geo.demand.od_table import Ends
from uxsim_geo.errors import Faults
from uxsim_geo.network.notes import Notes

Floats = npt.NDArray[np.float64]

#: sums of totals that differ by less are equal, as parts of their size
EQUAL = 1e-9


#: totals that no table has never come nearer: given up where so many iterations gain no more
STALLED_AFTER = 25
LEAST_GAIN = 1e-3


@dataclass(frozen=True)
class BalanceOptions:
    """How to balance.

    keep
        which totals hold where the sums of those out and in differ; the others are multiplied:
        ``out``, ``in``, ``mean`` (both, to the mean of the sums), or ``fault``
    tolerance
        balanced when no total is off by more than this part of itself
    iterations
        at most
    """

    keep: Literal["out", "in", "mean", "fault"] = "out"
    tolerance: float = 1e-6
    iterations: int = 1000

    def __post_init__(self) -> None:
        faults = Faults("options of the balancing")
        if self.keep not in ("out", "in", "mean", "fault"):
            faults.add("must be out, in, mean or fault", column="keep", value=self.keep)
        if not 0 < self.tolerance < 1:
            faults.add("must be above 0 and below 1", column="tolerance", value=self.tolerance)
        if self.iterations < 1:
            faults.add("must be 1 or more", column="iterations", value=self.iterations)
        faults.raise_if_any()


class Fitted(NamedTuple):
    """The numbers of a balanced table.

    vehicles
        one a row of the table; shape (rows,)
    wanted
        totals out and in that were fitted, those that nothing can meet left out; (places,) each
    worst
        the greatest part by which any of these totals was off after each iteration
    """

    vehicles: Floats
    wanted: tuple[Floats, Floats]
    worst: list[float]


def equal_sums(
    totals: tuple[Floats, Floats], options: BalanceOptions, faults: Faults, notes: Notes
) -> tuple[Floats, Floats]:
    """Totals out and in with the same sum."""
    out, into = (math.fsum(side.tolist()) for side in totals)
    if abs(out - into) <= EQUAL * max(out, into):
        return totals
    told = f"the totals out sum to {out:.10g}, those in to {into:.10g}"
    if options.keep == "fault" or not min(out, into) > 0:
        faults.add(f"{told}: they must be equal, or keep must say which hold")
        return totals
    equal = _to_one_sum(totals, options)
    note = f"{told}; multiplied to the same sum; value: vehicles"
    value = repr(float(equal[0].sum()))
    notes.add("unequal totals", note, element="demand", severity="warning", value=value)
    return equal


def fit_totals(
    seed: Floats, ends: Ends, wanted: tuple[Floats, Floats], options: BalanceOptions
) -> Fitted:
    """Multiply the rows of a seed until their totals are those wanted.

    Totals of places from (to) which the seed leads to no place with a total cannot be met; they
    are taken out, and the other side is multiplied to the sum that remains. Where parts of the
    table that nothing connects have other sums out than in, the rest is never met: then the last
    table is given, when iterations no longer gain.
    """
    out, into = _to_one_sum(_that_can_be_met(seed, ends, wanted), options)
    size = len(ends.names)
    vehicles = np.where((out[ends.origin] > 0) & (into[ends.destination] > 0), seed, 0.0)
    worst: list[float] = []
    for _ in range(options.iterations):
        for place, goal in ((ends.origin, out), (ends.destination, into)):
            now = np.bincount(place, vehicles, minlength=size)
            vehicles = vehicles * np.divide(goal, now, out=np.zeros(size), where=now > 0)[place]
        worst.append(_worst(ends.totals(vehicles), (out, into)))
        if worst[-1] <= options.tolerance or _is_stalled(worst):
            break
    return Fitted(vehicles, (out, into), worst)


def _is_stalled(worst: list[float]) -> bool:
    """Whether iterations no longer bring totals nearer to those wanted."""
    if len(worst) <= STALLED_AFTER:
        return False
    return worst[-1] > (1 - LEAST_GAIN) * worst[-1 - STALLED_AFTER]


def _worst(now: tuple[Floats, Floats], goals: tuple[Floats, Floats]) -> float:
    parts = [
        np.abs(have - goal)[goal > 0] / goal[goal > 0]
        for have, goal in zip(now, goals, strict=True)
    ]
    return float(np.concatenate(parts).max(initial=0.0))


def _that_can_be_met(
    seed: Floats, ends: Ends, wanted: tuple[Floats, Floats]
) -> tuple[Floats, Floats]:
    out, into = wanted
    while True:
        rows = (seed > 0) & (out[ends.origin] > 0) & (into[ends.destination] > 0)
        has = ends.totals(rows.astype(np.float64))
        met = np.where(has[0] > 0, out, 0.0), np.where(has[1] > 0, into, 0.0)
        if all(np.array_equal(*sides) for sides in zip(met, (out, into), strict=True)):
            break
        out, into = met
    return out, into


def _to_one_sum(totals: tuple[Floats, Floats], options: BalanceOptions) -> tuple[Floats, Floats]:
    """The totals multiplied such that both sides have the sum that ``keep`` says."""
    out, into = (math.fsum(side.tolist()) for side in totals)
    if out == into or not min(out, into) > 0:
        return totals
    goal = {"in": into, "mean": (out + into) / 2}.get(options.keep, out)
    return totals[0] * (goal / out), totals[1] * (goal / into)
