"""Points of grids and Latin hypercubes."""

from __future__ import annotations

import math

import pytest

from uxsim_geo.errors import InputError
from uxsim_geo.sweeps import Range, grid_points, latin_hypercube


def test_a_grid_holds_every_combination_in_order() -> None:
    assert grid_points({"a": [1, 2], "b": ["x", "y", "z"]}) == [
        {"a": 1, "b": "x"},
        {"a": 1, "b": "y"},
        {"a": 1, "b": "z"},
        {"a": 2, "b": "x"},
        {"a": 2, "b": "y"},
        {"a": 2, "b": "z"},
    ]


@pytest.mark.parametrize("samples", [1, 7, 20])
def test_every_stratum_of_every_range_is_taken_once(samples: int) -> None:
    ranges = {"share": Range(0.0, 1.0), "time": Range(60.0, 600.0), "k": Range(1, 100, True)}
    points = latin_hypercube(ranges, samples, seed=3)
    strata = {
        "share": [point["share"] for point in points],
        "time": [(point["time"] - 60) / 540 for point in points],
        "k": [math.log(point["k"]) / math.log(100) for point in points],
    }
    for shares in strata.values():
        assert sorted(math.floor(share * samples) for share in shares) == list(range(samples))


def test_whole_numbers_are_met_equally_often() -> None:
    points = latin_hypercube({"n": Range(1, 4, whole=True)}, 20)
    values = [point["n"] for point in points]
    assert all(isinstance(value, int) for value in values)
    assert [values.count(n) for n in (1, 2, 3, 4)] == [5, 5, 5, 5]


def test_the_seed_alone_decides() -> None:
    ranges = {"a": Range(0.0, 1.0), "b": Range(0.0, 1.0)}
    assert latin_hypercube(ranges, 9, 4) == latin_hypercube(ranges, 9, 4)
    assert latin_hypercube(ranges, 9, 4) != latin_hypercube(ranges, 9, 5)


def test_all_faults_are_told_at_once() -> None:
    ranges = {
        "back": Range(2.0, 1.0),
        "endless": Range(0.0, math.inf),
        "log": Range(0.0, 1.0, logarithmic=True),
        "half": Range(0.5, 3.0, whole=True),
    }
    with pytest.raises(InputError) as caught:
        latin_hypercube(ranges, 0)
    columns = [fault.column for fault in caught.value.faults]
    assert columns == ["samples", "back", "endless", "log", "half"]
    with pytest.raises(InputError, match="stands there twice"):
        grid_points({"a": [1, 1]})
    with pytest.raises(InputError, match="at least one value"):
        grid_points({"a": []})


def test_the_plot_shows_runs_means_and_intervals() -> None:
    import numpy as np
    import pandas as pd
    from scipy.stats import ttest_1samp

    from uxsim_geo.export.sweep_plots import sweep_figure

    runs = pd.DataFrame(
        {
            "point": [0, 0, 0, 1, 1, 1],
            "simulate.seed": [2.0, 2.0, 2.0, 3.0, 3.0, 3.0],
            "mode": ["slow", "slow", "slow", "fast", "fast", "fast"],
            "delay": [1.0, 2.0, 4.0, 5.0, 5.0, 5.0],
        }
    )
    figure = sweep_figure(runs, ["simulate.seed", "mode"], "delay", label="delay, veh·h", base=3.0)
    numbers, texts = figure.axes
    assert [label.get_text() for label in texts.get_xticklabels()] == ["slow", "fast"]
    assert numbers.get_ylabel() == "delay, veh·h"
    assert numbers.lines[0].get_xydata().tolist()[:3] == [[2.0, 1.0], [2.0, 2.0], [2.0, 4.0]]
    (bars,) = numbers.containers
    low, high = bars.lines[2][0].get_segments()[0][:, 1]
    interval = ttest_1samp([1.0, 2.0, 4.0], 0.0).confidence_interval(0.95)
    assert (low, high) == pytest.approx((interval.low, interval.high))
    assert np.ptp(bars.lines[2][0].get_segments()[1][:, 1]) == 0
