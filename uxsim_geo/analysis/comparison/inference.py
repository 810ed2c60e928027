"""Intervals and tests of differences.

Of n differences with mean m and variance s², the paired t statistic and the 95 % interval are

    t = m / (s / √n)        m ± t(0.975, n − 1) · s / √n

Had the runs not been paired, the half width would follow from the variances a and b of both sides,
over n runs each (Welch 1947):

    t(0.975, f) √(a/n + b/n)        f = (n − 1) (a + b)² / (a² + b²)
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from uxsim_geo.analysis.comparison.moments import Moments, PairedMoments
from uxsim_geo.analysis.types import Floats

CONFIDENCE = 0.95

#: share of false discoveries that is accepted among all rows called significant
SIGNIFICANCE = 0.05


def half_width(moments: Moments) -> Floats:
    """Half width of the 95 % interval of the mean; NaN of fewer than two values."""
    from scipy.stats import t

    freedom = _freedom(moments)
    width: Floats = t.ppf(0.5 + CONFIDENCE / 2, freedom) * _error(moments)
    return width


def half_width_of_mean(values: Iterable[float]) -> float:
    """Half width of the 95 % interval of the mean of some values.

    NaN are left out; NaN of fewer than two values.
    """
    moments = Moments.of_nothing(1, 1)
    for value in values:
        moments.add(np.array([[value]]))
    return float(half_width(moments)[0, 0])


def p_value(moments: Moments) -> Floats:
    """Two-sided p of the t test that the mean is 0.

    1 where all values are 0; NaN of fewer than two.
    """
    from scipy.stats import t

    error = _error(moments)
    # without any spread every mean but 0 is beyond doubt
    far = np.where(moments.mean == 0, 0.0, np.inf)
    spread = error > 0
    statistic = np.divide(np.abs(moments.mean), error, out=far, where=spread)
    p: Floats = np.where(np.isnan(error), np.nan, 2 * t.sf(statistic, _freedom(moments)))
    return p


def unpaired_half_width(moments: PairedMoments) -> Floats:
    """What the half width of the difference would be if base and scenario were independent runs."""
    from scipy.stats import t

    freedom = _freedom(moments.base)
    base, scenario = (side.squares / freedom for side in (moments.base, moments.scenario))
    sum_, squares = base + scenario, base**2 + scenario**2
    effective = np.divide(freedom * sum_**2, squares, out=freedom.copy(), where=squares > 0)
    error = np.sqrt(sum_ / moments.base.count)
    width: Floats = t.ppf(0.5 + CONFIDENCE / 2, effective) * error
    return width


def adjusted_p(p: Floats) -> Floats:
    """P values by Benjamini and Hochberg (1995), for many rows looked at together.

    Among the rows in which they are at most q, a share of at most q is there by chance. Those that
    are NaN stay so and do not count. Of m values in ascending order the i-th becomes the least of
    m p / j over all j ≥ i.
    """
    known = np.flatnonzero(~np.isnan(p))
    descending = known[np.argsort(-p[known], kind="stable")]
    rank = np.arange(len(known), 0, -1)
    result = np.full(len(p), np.nan)
    result[descending] = np.minimum.accumulate(np.minimum(p[descending] * len(known) / rank, 1.0))
    return result


def _freedom(moments: Moments) -> Floats:
    """Degrees of freedom, NaN where there are none."""
    return np.where(moments.count > 1, moments.count - 1, np.nan)


def _error(moments: Moments) -> Floats:
    """Standard error of the mean, NaN of fewer than two values."""
    count = np.maximum(moments.count, 1.0)
    error: Floats = np.sqrt(moments.squares / (_freedom(moments) * count))
    return error
