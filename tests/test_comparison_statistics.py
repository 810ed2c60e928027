"""Means, intervals and tests of differences: against scipy, and by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from uxsim_geo.analysis.comparison.inference import (
    adjusted_p,
    half_width,
    p_value,
    unpaired_half_width,
)
from uxsim_geo.analysis.comparison.moments import Moments, PairedMoments
from uxsim_geo.analysis.comparison.paired_table import statistics_of

NAN = np.nan


def moments_of(*runs: list[float]) -> Moments:
    """Runs with a value a row, in one column."""
    moments = Moments.of_nothing(len(runs[0]), 1)
    for run in runs:
        moments.add(np.array(run)[:, None])
    return moments


def paired(base: np.ndarray, scenario: np.ndarray) -> PairedMoments:
    """Runs as rows, quantities as columns; every quantity a row of one column."""
    moments = PairedMoments.of_nothing(base.shape[1], 1)
    for one, other in zip(base, scenario, strict=True):
        moments.add(one[:, None], other[:, None])
    return moments


def drawn(runs: int) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(5)
    base = random.normal(1000.0, [1.0, 30.0, 400.0], (runs, 3))
    return base, base + random.normal([0.0, 5.0, -60.0], [0.5, 20.0, 100.0], (runs, 3))


@pytest.mark.parametrize("runs", [2, 3, 10, 40])
def test_as_scipys_tests_of_related_and_of_independent_samples(runs: int) -> None:
    base, scenario = drawn(runs)
    moments = paired(base, scenario)
    related = stats.ttest_rel(scenario, base)
    interval = related.confidence_interval(0.95)
    width, mean = half_width(moments.difference)[:, 0], moments.difference.mean[:, 0]
    assert mean - width == pytest.approx(interval.low, rel=1e-9)
    assert mean + width == pytest.approx(interval.high, rel=1e-9)
    assert p_value(moments.difference)[:, 0] == pytest.approx(related.pvalue, rel=1e-8)
    independent = stats.ttest_ind(scenario, base, equal_var=False).confidence_interval(0.95)
    expected = (independent.high - independent.low) / 2
    assert unpaired_half_width(moments)[:, 0] == pytest.approx(expected, rel=1e-9)


def test_three_differences_by_hand() -> None:
    # 1, 2, 6: mean 3, variance (4 + 1 + 9) / 2 = 7; t(0.975, 2) = 4.30265
    moments = moments_of([1.0], [2.0], [6.0])
    assert moments.mean[0, 0] == pytest.approx(3.0)
    assert half_width(moments)[0, 0] == pytest.approx(4.302653 * np.sqrt(7 / 3), rel=1e-6)
    # t = 3 / √(7/3) = 1.963961; of two degrees of freedom p = 1 − t / √(2 + t²)
    t = 3 / np.sqrt(7 / 3)
    assert p_value(moments)[0, 0] == pytest.approx(1 - t / np.sqrt(2 + t * t))


def test_a_large_mean_does_not_swallow_a_small_spread() -> None:
    moments = moments_of([1e9 + 1], [1e9 + 2], [1e9 + 6])
    assert moments.squares[0, 0] == pytest.approx(14.0, rel=1e-6)


def test_differences_of_nothing_are_certain_to_be_none() -> None:
    moments = moments_of([0.0], [0.0], [0.0])
    assert p_value(moments)[0, 0] == 1.0
    assert half_width(moments)[0, 0] == 0.0


def test_equal_differences_leave_no_doubt() -> None:
    moments = moments_of([2.5], [2.5], [2.5])
    assert p_value(moments)[0, 0] == 0.0
    assert half_width(moments)[0, 0] == 0.0


def test_one_pair_has_a_difference_and_no_interval() -> None:
    (found,) = statistics_of(paired(np.array([[10.0, 0.0]]), np.array([[12.0, 0.0]])))
    assert found.difference.tolist() == [2.0, 0.0]
    assert np.isnan(found.half_width).all()
    assert np.isnan(found.p).all()
    assert found.relative[0] == pytest.approx(0.2)
    assert np.isnan(found.relative[1])


def test_pairs_in_which_one_side_is_undefined_do_not_count() -> None:
    base = np.array([[10.0, 1.0, NAN, 5.0], [20.0, NAN, NAN, 7.0], [60.0, 3.0, NAN, NAN]])
    scenario = np.array([[11.0, NAN, 4.0, 6.0], [NAN, 2.0, NAN, 9.0], [63.0, NAN, 8.0, 100.0]])
    (found,) = statistics_of(paired(base, scenario))
    assert found.seeds.tolist() == [2, 0, 0, 2]
    # both sides over the pairs that have both, so that the difference is theirs
    assert found.base[[0, 1, 3]].tolist() == [35.0, 2.0, 6.0]
    assert np.isnan(found.base[2])
    assert found.scenario.tolist() == [37.0, 2.0, 6.0, 7.5]
    assert found.difference[[0, 3]].tolist() == [2.0, 1.5]
    # known on either side, in no pair on both: never 0
    assert np.isnan(found.difference[[1, 2]]).all()
    assert np.isnan(found.p[[1, 2]]).all()


def test_rounding_of_sums_is_no_difference() -> None:
    total = 0.1 + 0.2 + 0.3
    base = np.array([[total, 0.0, 1e6]] * 3)
    scenario = np.array([[0.3 + 0.2 + 0.1, 3e-14, 1e6 + 1.0]] * 3)
    assert base[0, 0] != scenario[0, 0]
    (found,) = statistics_of(paired(base, scenario))
    assert found.difference.tolist() == [0.0, 0.0, 1.0]
    assert found.p.tolist() == [1.0, 1.0, 0.0]


def test_rows_that_come_up_later_were_0_before_or_undefined() -> None:
    moments = PairedMoments.of_nothing(1, 2)
    moments.add(np.array([[1.0, 1.0]]), np.array([[2.0, 2.0]]))
    moments.grow(2, np.array([True, False]))
    moments.add(np.array([[1.0, 1.0], [4.0, 4.0]]), np.array([[2.0, 2.0], [8.0, 8.0]]))
    added_up, mean = statistics_of(moments)
    assert added_up.difference.tolist() == [1.0, 2.0]
    assert added_up.base.tolist() == [1.0, 2.0]
    assert added_up.seeds.tolist() == [2, 2]
    assert mean.difference.tolist() == [1.0, 4.0]
    assert mean.seeds.tolist() == [2, 1]


@given(st.lists(st.floats(0, 1), min_size=1, max_size=40), st.sets(st.integers(0, 39)))
def test_adjusted_p_values_are_scipys_and_skip_what_is_unknown(
    values: list[float], unknown: set[int]
) -> None:
    p = np.array(values)
    p[[place for place in unknown if place < len(p)]] = NAN
    known = ~np.isnan(p)
    found = adjusted_p(p)
    assert np.isnan(found[~known]).all()
    if known.any():
        assert found[known] == pytest.approx(stats.false_discovery_control(p[known]))


def test_adjusted_p_values_by_hand() -> None:
    # ascending 0.01, 0.02, 0.03, 0.5 of four: 0.04, 0.04, 0.04, 0.5
    assert adjusted_p(np.array([0.5, 0.01, 0.03, 0.02])) == pytest.approx([0.5, 0.04, 0.04, 0.04])
    assert adjusted_p(np.array([])).tolist() == []
