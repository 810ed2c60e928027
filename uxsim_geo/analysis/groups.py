"""Sums, means and percentiles of vehicles that belong together: by pair, slice or turn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from uxsim_geo.analysis.edie import ratio
from uxsim_geo.analysis.types import Floats, Integers


@dataclass(frozen=True)
class Groups:
    """Rows of a table by the values of some keys.

    keys
        one array a key: its value in every group; the groups ascend by the first key, then by
        the second …
    number
        which group each row is in; shape (rows,)
    """

    keys: tuple[Integers, ...]
    number: Integers

    @classmethod
    def of(cls, *keys: Integers) -> Groups:
        """Put rows of equal keys, whole numbers from 0, together."""
        size = tuple(int(key.max(initial=0)) + 1 for key in keys)
        found, number = np.unique(np.ravel_multi_index(keys, size), return_inverse=True)
        return cls(np.unravel_index(found, size), number.astype(np.int64, copy=False))

    def __len__(self) -> int:
        return len(self.keys[0])

    def total(self, values: Floats) -> Floats:
        """Sum of the rows' values in every group."""
        sums = np.bincount(self.number, values, minlength=len(self))
        return sums.astype(np.float64, copy=False)

    def mean(self, values: Floats, weights: Floats) -> Floats:
        """Weighted mean in every group, NaN where there is no weight; rows of weight 0 are out."""
        counted = np.where(weights > 0, values, 0.0)
        return ratio(self.total(weights * counted), self.total(weights))

    def deviation(self, values: Floats, weights: Floats) -> Floats:
        """Weighted standard deviation in every group, NaN where there is no weight."""
        mean = self.mean(values, weights)[self.number]
        return np.sqrt(self.mean((values - mean) ** 2, weights))

    def percentiles(
        self, values: Floats, weights: Floats, percents: Sequence[float]
    ) -> list[Floats]:
        """For each of ``percents`` the weighted percentile of every group, NaN without weight.

        The smallest value such that at least p % of the weight has that value or less (the
        inverse of the distribution function). Rows of weight 0 are out.
        """
        rows = np.flatnonzero(weights > 0)
        rows = rows[np.lexsort((values[rows], self.number[rows]))]
        until = np.cumsum(weights[rows])
        ends = np.searchsorted(self.number[rows], np.arange(len(self)), side="right")
        before = np.concatenate(([0.0], until))[np.concatenate(([0], ends[:-1]))]
        weight = np.concatenate(([0.0], until))[ends] - before
        results = []
        for percent in percents:
            # a hair less, lest 0.95 · 60 lie beyond the 57th of 60 by rounding
            wanted = before + weight * (percent / 100 - 1e-12)
            place = np.searchsorted(until, wanted, side="left")
            found = np.full(len(self), np.nan)
            found[weight > 0] = values[rows][place[weight > 0]]
            results.append(found)
        return results
