"""Bins: the grid of times that tables stand on."""

from __future__ import annotations

import numpy as np
import pytest

from uxsim_geo.analysis.bins import bin_edges, bin_of, cut_at_edges
from uxsim_geo.errors import InputError


@pytest.mark.parametrize(
    ("duration", "bin_s", "edges"),
    [(100, 60, [0, 60, 100]), (0.3, 0.1, [0, 0.1, 0.2, 0.3]), (50, 60, [0, 50])],
)
def test_bins_cover_the_simulation_exactly(
    duration: float, bin_s: float, edges: list[float]
) -> None:
    assert bin_edges(duration, bin_s) == pytest.approx(edges)


def test_edges_may_be_given() -> None:
    assert bin_edges(100.0, [10, 20, 95.5]).tolist() == [10.0, 20.0, 95.5]


@pytest.mark.parametrize(
    ("bin_s", "message"),
    [
        (0.0, "above 0"),
        (-5.0, "above 0"),
        (float("nan"), "above 0"),
        (float("inf"), "finite"),
        (1e-6, "million|1,000,000"),
        ([10.0], "two moments"),
        ([], "two moments"),
        ([[0.0, 1.0]], "two moments"),
        ([0.0, 50.0, 40.0], "ascend"),
        ([0.0, 0.0], "ascend"),
        ([-1.0, 50.0], "between 0 and"),
        ([0.0, 101.0], "between 0 and"),
        ([0.0, float("nan")], "between 0 and"),
    ],
)
def test_what_makes_no_bins_is_refused(bin_s: object, message: str) -> None:
    with pytest.raises(InputError, match=message):
        bin_edges(100.0, bin_s)  # type: ignore[arg-type]


def test_a_moment_is_in_the_bin_that_begins_with_it_and_the_last_keeps_its_end() -> None:
    edges = np.array([10.0, 20.0, 40.0])
    times = np.array([9.9, 10.0, 19.9, 20.0, 40.0, 40.1, np.inf])
    assert bin_of(times, edges).tolist() == [-1, 0, 0, 1, 1, -1, -1]


def test_intervals_are_cut_at_edges_and_lose_what_is_outside() -> None:
    edges = np.array([10.0, 20.0, 40.0])
    begin = np.array([0.0, 0.0, 15.0, 20.0, 40.0, 30.0])
    end = np.array([9.0, 12.0, np.inf, 40.0, 50.0, 30.0])
    parts = cut_at_edges(begin, end, edges)
    assert list(zip(*(array.tolist() for array in parts), strict=True)) == [
        (1, 0, 10.0, 12.0),
        (2, 0, 15.0, 20.0),
        (2, 1, 20.0, 40.0),
        (3, 1, 20.0, 40.0),
    ]
