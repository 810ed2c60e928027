"""Adjust demand to counts on links.

Given are the shares p_ij of the vehicles of row j that are counted in observation i. Sought are
the vehicles x_j that bring v_i = Σ_j p_ij x_j near to the counts c_i and stay near to the seed s:

    F(x) = ½ Σ_i (v_i − c_i)² / max(c_i, 1)  +  ½ ρ Σ_j (x_j − s_j)² / s_j

Counts and seed are weighed as Poisson numbers are, by their variance; ρ says how much a vehicle
of the seed counts beside one that was counted. Each iteration goes down the gradient, scaled by
the seed, g_j = s_j ∂F/∂x_j (Spiess 1990), combined with the step before to the least F over both
(so it is the method of conjugate gradients until a bound is met). F never rises; rows that no
count sees stay as they are.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Generic, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.demand.od_table import (
    Od,
    add_of_rows,
    totals_report,
    vehicles_of,
    with_notes,
)
from uxsim_geo.errors import Faults
from uxsim_geo.network.notes import Notes

Floats = npt.NDArray[np.float64]

COUNT_COLUMNS = ("link_id", "start_s", "end_s", "vehicles")
HOUR = 3600.0


@dataclass(frozen=True)
class AdjustOptions:
    """How to adjust.

    seed_weight
        ρ, 0 or more; 0: the seed is only where the search begins
    most_change
        no row becomes more than so many times its seed, or less than that part of it
    iterations
        at most
    tolerance
        stop when F falls by less than this part of itself
    """

    seed_weight: float = 0.1
    most_change: float = 10.0
    iterations: int = 100
    tolerance: float = 1e-5

    def __post_init__(self) -> None:
        faults = Faults("options of the adjustment")
        for name, wrong, what in (
            ("seed_weight", not 0 <= self.seed_weight < math.inf, "a finite number, 0 or more"),
            ("most_change", not 1 < self.most_change < math.inf, "a finite number above 1"),
            ("iterations", self.iterations < 1, "1 or more"),
            ("tolerance", not 0 <= self.tolerance < 1, "from 0 to below 1"),
        ):
            if wrong:
                faults.add(f"must be {what}", column=name, value=getattr(self, name))
        faults.raise_if_any()


@dataclass(frozen=True)
class Adjusted(Generic[Od]):
    """Adjusted demand, and how well it fits.

    od
        with a note on the adjustment
    iterations
        one row an iteration, the seed first: iteration, objective (F), misfit (Σ (v − c)² /
        max(c, 1)), rmse (vehicles), mean_geh, share_under_geh_5 (of hourly flows), vehicles
        (of the demand)
    counts
        one row a count: link_id, start_s, end_s, counted, seed, adjusted (vehicles), geh_seed,
        geh_adjusted, why (text: it is not fitted)
    report
        as :func:`uxsim_geo.demand.od_table.totals_report`
    """

    od: Od
    iterations: pd.DataFrame
    counts: pd.DataFrame
    report: pd.DataFrame


def adjust_to_counts(
    od: Od, shares: Any, counts: pd.DataFrame, options: AdjustOptions | None = None
) -> Adjusted[Od]:
    """Adjust a demand, or a table between places, to counts.

    ``counts``: link_id, start_s, end_s, vehicles. ``shares``: a matrix, sparse or not, of shape
    (counts, rows of the table): the part of the vehicles of each row that each count sees, 0 to
    1, or more where they pass twice;
    :func:`uxsim_geo.analysis.link_shares.link_shares` makes it from a run.

    Raises :class:`uxsim_geo.errors.InputError` with every fault of counts and shares.
    """
    from scipy.sparse import csr_array

    options = options or AdjustOptions()
    shares = csr_array(shares, dtype=np.float64)
    _check(od.table, shares, counts)
    seed = vehicles_of(od.table)
    problem = _Problem.of(shares, counts["vehicles"].to_numpy(np.float64), seed, options)
    hours = (counts["end_s"] - counts["start_s"]).to_numpy(np.float64) / HOUR
    found = [seed]
    step = np.zeros(len(seed))
    for _ in range(options.iterations):
        following = problem.improved(found[-1], step)
        if following is None:
            break
        found.append(following)
        step = found[-1] - found[-2]
        before, after = (problem.objective(vehicles) for vehicles in found[-2:])
        if before - after <= options.tolerance * before:
            break
    fit = pd.DataFrame([_fit(problem, vehicles, hours) for vehicles in found])
    fit.insert(0, "iteration", np.arange(len(fit)))
    table = od.table.assign(vehicles=found[-1])
    notes = Notes()
    _note(problem, fit, notes)
    new = replace(od, table=table, notes=with_notes(od.notes, notes.table()))
    compared = _compared(problem, counts, (seed, found[-1]), hours)
    return Adjusted(new, fit, compared, totals_report(od.table, table))


def _check(table: pd.DataFrame, shares: Any, counts: pd.DataFrame) -> None:
    faults = Faults(str(counts.attrs.get("source", "counts")))
    for name in COUNT_COLUMNS:
        if name not in counts:
            faults.add(f"lacks the column {name}: it needs {', '.join(COUNT_COLUMNS)}")
    if shares.shape != (len(counts), len(table)):
        what = f"must be of the shape (counts, rows of the demand), {(len(counts), len(table))}"
        faults.add(what, column="shares", value=shares.shape)
    if not (np.isfinite(shares.data).all() and (shares.data >= 0).all()):
        faults.add("must be finite and not negative", column="shares")
    if (vehicles_of(table) <= 0).any():
        faults.add("rows of the demand without vehicles cannot be adjusted", column="vehicles")
    faults.raise_if_any()
    start, end, counted = (counts[name].to_numpy(np.float64) for name in COUNT_COLUMNS[1:])
    for wrong, name, what in (
        (~np.isfinite(start), "start_s", "must be a number of seconds"),
        (~(np.isfinite(end) & (end > start)), "end_s", "must be later than start_s"),
        (
            ~(np.isfinite(counted) & (counted >= 0)),
            "vehicles",
            "must be a finite number, 0 or more",
        ),
    ):
        add_of_rows(faults, counts, wrong, name, what)
    faults.raise_if_any()


class _Problem(NamedTuple):
    """What is minimised, between bounds."""

    shares: Any  # (counts, rows), sparse
    counted: Floats
    weight: Floats  # of each count; 0: nobody passes, it cannot be fitted
    seed: Floats
    lower: Floats
    upper: Floats
    pull: float  # ρ

    @classmethod
    def of(cls, shares: Any, counted: Floats, seed: Floats, options: AdjustOptions) -> _Problem:
        passed = np.asarray(shares.sum(axis=1)).ravel() > 0
        weight = np.where(passed, 1.0 / np.maximum(counted, 1.0), 0.0)
        lower, upper = seed / options.most_change, seed * options.most_change
        return cls(shares, counted, weight, seed, lower, upper, options.seed_weight)

    def volumes(self, vehicles: Floats) -> Floats:
        return np.asarray(self.shares @ vehicles, np.float64)

    def objective(self, vehicles: Floats) -> float:
        apart = self.volumes(vehicles) - self.counted
        moved = vehicles - self.seed
        return 0.5 * float(
            (self.weight * apart**2).sum() + self.pull * (moved**2 / self.seed).sum()
        )

    def gradient(self, vehicles: Floats) -> Floats:
        apart = self.volumes(vehicles) - self.counted
        slope = self.shares.T @ (self.weight * apart)
        return np.asarray(slope + self.pull * (vehicles - self.seed) / self.seed, np.float64)

    def improved(self, vehicles: Floats, step: Floats) -> Floats | None:
        """Vehicles of a lower objective; None where there are none to be found."""
        gradient = self.gradient(vehicles)
        down = self._inside(vehicles, -self.seed * gradient)
        if not down.any():
            return None
        now = self.objective(vehicles)
        for directions in ((down, self._inside(vehicles, step)), (down,)):
            move = self._best(gradient, [one for one in directions if one.any()])
            for _ in range(40):
                following = np.clip(vehicles + move, self.lower, self.upper)
                if self.objective(following) < now:
                    return following
                move = move / 2
        return None

    def _inside(self, vehicles: Floats, direction: Floats) -> Floats:
        """A direction without what leads out of the bounds."""
        out = ((vehicles <= self.lower) & (direction < 0)) | (
            (vehicles >= self.upper) & (direction > 0)
        )
        return np.where(out, 0.0, direction)

    def _best(self, gradient: Floats, directions: list[Floats]) -> Floats:
        """The move to the least objective along some directions, bounds aside.

        With the matrix D of directions: D y, (Dᵀ H D) y = −Dᵀ ∇F, and H the second derivatives.
        """
        matrix = np.stack(directions)
        # directions of one length, lest the small one be lost
        matrix = matrix / np.sqrt((matrix**2 / self.seed).sum(axis=1, keepdims=True))
        passed = np.stack([self.volumes(one) for one in matrix])
        curvature = (passed * self.weight) @ passed.T
        curvature += self.pull * ((matrix / self.seed) @ matrix.T)
        lengths = np.linalg.lstsq(curvature, -matrix @ gradient, rcond=1e-12)[0]
        return np.asarray(lengths @ matrix, np.float64)


def _fit(problem: _Problem, vehicles: Floats, hours: Floats) -> dict[str, float]:
    volumes = problem.volumes(vehicles)
    apart = volumes - problem.counted
    stray = geh(problem.counted / hours, volumes / hours)
    some = len(apart) > 0
    return {
        "objective": problem.objective(vehicles),
        "misfit": float((apart**2 / np.maximum(problem.counted, 1.0)).sum()),
        "rmse": float(np.sqrt((apart**2).mean())) if some else math.nan,
        "mean_geh": float(stray.mean()) if some else math.nan,
        "share_under_geh_5": float((stray < 5.0).mean()) if some else math.nan,
        "vehicles": float(vehicles.sum()),
    }


def geh(observed_vph: Floats, simulated_vph: Floats) -> Floats:
    """The GEH statistic of hourly volumes, √(2 (M − C)² / (M + C)); 0 where both are 0."""
    both = observed_vph + simulated_vph
    apart = 2 * (simulated_vph - observed_vph) ** 2
    return np.sqrt(np.divide(apart, both, out=np.zeros(len(both)), where=both > 0))


def _compared(
    problem: _Problem, counts: pd.DataFrame, both: tuple[Floats, Floats], hours: Floats
) -> pd.DataFrame:
    table = counts[list(COUNT_COLUMNS[:3])].reset_index(drop=True)
    table["counted"] = problem.counted
    for name, vehicles in zip(("seed", "adjusted"), both, strict=True):
        table[name] = problem.volumes(vehicles)
    for name in ("seed", "adjusted"):
        volumes = table[name].to_numpy(np.float64)
        table[f"geh_{name}"] = geh(problem.counted / hours, volumes / hours)
    unseen = problem.weight == 0
    table["why"] = pd.Series(np.where(unseen, "no row of the demand passes here", ""), dtype="str")
    return table


def _note(problem: _Problem, fit: pd.DataFrame, notes: Notes) -> None:
    first, last = fit.iloc[0], fit.iloc[-1]
    note = (
        f"adjusted to {len(problem.counted)} counts in {len(fit) - 1} iterations: "
        f"RMSE {first['rmse']:.6g} to {last['rmse']:.6g} vehicles, "
        f"mean GEH {first['mean_geh']:.4g} to {last['mean_geh']:.4g}; value: vehicles in all"
    )
    notes.add("counts", note, element="demand", value=repr(float(last["vehicles"])))
    unseen = int((problem.weight == 0).sum())
    if unseen:
        note = "counts that no row of the demand passes, which cannot be fitted; value: counts"
        notes.add("counts", note, element="demand", severity="warning", value=unseen)
    seen = np.asarray(problem.shares.sum(axis=0)).ravel() > 0
    left = float(problem.seed[~seen].sum())
    if left > 0:
        note = "vehicles of rows that no count sees: left as they are; value: vehicles"
        notes.add("counts", note, element="demand", value=repr(left))
