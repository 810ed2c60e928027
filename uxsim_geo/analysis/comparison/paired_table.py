"""One table of a pair of runs after the other, row by row: into means, intervals and p values."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from uxsim_geo.analysis.comparison.inference import (
    SIGNIFICANCE,
    adjusted_p,
    half_width,
    p_value,
)
from uxsim_geo.analysis.comparison.moments import PairedMoments
from uxsim_geo.analysis.comparison.quantities import (
    ABSENT_IS_NOBODY,
    KEYS,
    QUANTITIES,
    Quantity,
)
from uxsim_geo.analysis.types import Booleans, Floats

SIDES = ("base", "scenario")


class Statistics(NamedTuple):
    """Of one quantity in every row of a table; NaN where undefined."""

    base: Floats
    scenario: Floats
    difference: Floats
    half_width: Floats
    p: Floats
    seeds: Floats

    @property
    def relative(self) -> Floats:
        """Difference / base, NaN unless the base is above 0."""
        nothing = np.full(len(self.base), np.nan)
        relative: Floats = np.divide(self.difference, self.base, out=nothing, where=self.base > 0)
        return relative

    def columns(self, name: str, *, adjusted: bool) -> dict[str, Any]:
        """By the names that a table of differences has; ``adjusted``: by the number of tests."""
        columns: dict[str, Any] = {
            f"{name}_base": self.base,
            f"{name}_scenario": self.scenario,
            f"{name}_difference": self.difference,
            f"{name}_low": self.difference - self.half_width,
            f"{name}_high": self.difference + self.half_width,
            f"{name}_relative": self.relative,
            f"{name}_p": self.p,
        }
        if adjusted:
            among_all = adjusted_p(self.p)
            significant = pd.array(among_all <= SIGNIFICANCE, dtype="boolean")
            significant[np.isnan(among_all)] = pd.NA
            columns |= {f"{name}_adjusted_p": among_all, f"{name}_significant": significant}
        return columns | {f"{name}_seeds": self.seeds.astype(np.int64)}


def statistics_of(moments: PairedMoments) -> list[Statistics]:
    """Statistics of every column (quantity), over the rows."""
    both = moments.difference.count > 0
    base = np.where(both, moments.base.mean, moments.base_alone.known_mean)
    scenario = np.where(both, moments.scenario.mean, moments.scenario_alone.known_mean)
    difference = moments.difference
    width, p = half_width(difference), p_value(difference)
    found = np.stack((base, scenario, difference.known_mean, width, p, difference.count))
    return [Statistics(*found[:, :, column]) for column in range(base.shape[1])]


class PairedTable:
    """A table of both sides over all pairs so far: which rows there are, and their moments.

    Rows are known by the columns :data:`uxsim_geo.analysis.comparison.quantities.KEYS`; they keep
    the order in which they first came up, the base's before the scenario's.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.keys = list(KEYS[name])
        self.quantities: tuple[Quantity, ...] = QUANTITIES[name]
        self.absent_is_nobody = name in ABSENT_IS_NOBODY
        self.rows = pd.MultiIndex.from_arrays([[] for _ in self.keys], names=self.keys)
        self.has: dict[str, Booleans] = {side: np.zeros(0, bool) for side in SIDES}
        self.moments = PairedMoments.of_nothing(0, len(self.quantities))

    def add(self, base: pd.DataFrame, scenario: pd.DataFrame) -> None:
        """Take in the table of a pair of runs."""
        indices = [pd.MultiIndex.from_frame(table[self.keys]) for table in (base, scenario)]
        for index in indices:
            self._make_room(index)
        sides = [
            self._values(table, index, side)
            for table, index, side in zip((base, scenario), indices, SIDES, strict=True)
        ]
        self.moments.add(*sides)

    def table(self, *, adjusted: bool = True) -> pd.DataFrame:
        """Keys, in which run a row exists, and the columns of all quantities."""
        columns: dict[str, Any] = dict(self.rows.to_frame(index=False))
        if not self.absent_is_nobody:
            columns["exists"] = self._exists()
        every = zip(self.quantities, statistics_of(self.moments), strict=True)
        for quantity, statistics in every:
            columns |= statistics.columns(quantity.name, adjusted=adjusted)
        return pd.DataFrame(columns)

    def _make_room(self, index: pd.MultiIndex) -> None:
        """Add the rows that have not come up before."""
        if index.equals(self.rows):
            return
        new = index[self.rows.get_indexer(index) < 0]
        if not len(new):
            return
        self.rows = self.rows.append(new) if len(self.rows) else new
        adds_up = np.array([quantity.adds_up for quantity in self.quantities])
        self.moments.grow(len(self.rows), adds_up & self.absent_is_nobody)
        more = np.zeros(len(new), bool)
        self.has = {side: np.concatenate((had, more)) for side, had in self.has.items()}

    def _values(self, table: pd.DataFrame, index: pd.MultiIndex, side: str) -> Floats:
        """The quantities of a run's table in the rows of this one."""
        values = np.full((len(self.rows), len(self.quantities)), np.nan)
        if self.absent_is_nobody:
            values[:, [quantity.adds_up for quantity in self.quantities]] = 0.0
        row = self.rows.get_indexer(index)
        values[row] = table[[quantity.name for quantity in self.quantities]].to_numpy(float)
        self.has[side][row] = True
        return values

    def _exists(self) -> pd.Series:
        base, scenario = (self.has[side] for side in SIDES)
        words = np.where(base & scenario, "both", np.where(base, "base", "scenario"))
        return pd.Series(words, dtype="str")
