"""Means and spreads of many quantities at once, over runs that come one after the other.

With the n-th value x of a quantity (Welford 1962, "Note on a method for calculating corrected sums
of squares and products"):

    d = x − m        m ← m + d / n        M ← M + d (x − m)

m is the mean and M the sum of the squared deviations from it, so that the variance is M / (n − 1).
Nothing of a run stays but these three numbers a quantity.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from uxsim_geo.analysis.types import Booleans, Floats

#: differences below this share of the values, or below this many units (veh·h, s, km/h …), come
#: from the order in which sums are taken
ROUNDING = 1e-9


@dataclass
class Moments:
    """Of quantities in rows and columns: count, mean and squares (M above), arrays of one shape."""

    count: Floats
    mean: Floats
    squares: Floats

    @classmethod
    def of_nothing(cls, rows: int, columns: int) -> Moments:
        """Before the first run."""
        return cls(*(np.zeros((rows, columns)) for _ in range(3)))

    def add(self, values: Floats) -> None:
        """Take in the values of a run; NaN where a quantity is undefined in it."""
        defined = ~np.isnan(values)
        self.count += defined
        before = np.where(defined, values - self.mean, 0.0)
        self.mean += before / np.maximum(self.count, 1.0)
        self.squares += before * np.where(defined, values - self.mean, 0.0)

    def grow(self, rows: int, count: Floats) -> None:
        """Add rows whose values were 0 in ``count`` runs so far (an entry a column)."""
        more = rows - len(self.count)
        nothing = np.zeros((more, self.count.shape[1]))
        self.count = np.vstack((self.count, nothing + count))
        self.mean = np.vstack((self.mean, nothing))
        self.squares = np.vstack((self.squares, nothing))

    @property
    def known_mean(self) -> Floats:
        """The mean, NaN where no run had a value."""
        return np.where(self.count > 0, self.mean, np.nan)


@dataclass
class PairedMoments:
    """Of a base, a scenario and their differences.

    base, scenario, difference
        over the pairs in which a quantity is defined in both
    base_alone, scenario_alone
        over all runs in which it is
    pairs
        taken in so far
    """

    base: Moments
    scenario: Moments
    difference: Moments
    base_alone: Moments
    scenario_alone: Moments
    pairs: int = 0

    @classmethod
    def of_nothing(cls, rows: int, columns: int) -> PairedMoments:
        """Before the first pair."""
        base, scenario, difference, alone, other = (
            Moments.of_nothing(rows, columns) for _ in range(5)
        )
        return cls(base, scenario, difference, alone, other)

    def add(self, base: Floats, scenario: Floats) -> None:
        """Take in a pair of runs: values in rows and columns, NaN where undefined."""
        both = ~(np.isnan(base) | np.isnan(scenario))
        self.base.add(np.where(both, base, np.nan))
        self.scenario.add(np.where(both, scenario, np.nan))
        self.difference.add(differences(base, scenario))
        self.base_alone.add(base)
        self.scenario_alone.add(scenario)
        self.pairs += 1

    def grow(self, rows: int, nobody: Booleans) -> None:
        """Add rows that all pairs so far lacked; ``nobody``: the columns that were 0 there."""
        count = self.pairs * nobody.astype(np.float64)
        for moments in (
            self.base,
            self.scenario,
            self.difference,
            self.base_alone,
            self.scenario_alone,
        ):
            moments.grow(rows, count)


def differences(base: Floats, scenario: Floats) -> Floats:
    """Scenario − base; exactly 0 where they differ by the rounding of sums alone."""
    difference = scenario - base
    largest = np.maximum(np.abs(base), np.abs(scenario))
    return np.where(np.abs(difference) <= ROUNDING * (1.0 + largest), 0.0, difference)
