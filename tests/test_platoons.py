from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.stats import kstest
from small_networks import demand

from uxsim_geo.demand.platoons import make_platoons
from uxsim_geo.demand.rounding import round_keeping_totals
from uxsim_geo.draws import combine, text_keys, unit
from uxsim_geo.settings import Settings

SETTINGS = Settings(duration=7200)


def rounded(table: np.ndarray, seed: int = 0) -> np.ndarray:
    rows, columns = np.indices(table.shape).reshape(2, -1)
    keys = np.arange(table.size, dtype=np.uint64) + np.uint64(1000 * seed)
    whole = round_keeping_totals(table.ravel(), rows, columns, keys)
    return whole.reshape(table.shape)


def parts_of(table: np.ndarray) -> int:
    """How many parts rows and columns make that fractions hold together."""
    rows, columns = np.nonzero(np.abs(table - np.rint(table)) > 1e-9)
    size = sum(table.shape)
    graph = coo_array((np.ones(rows.size), (rows, columns + table.shape[0])), shape=(size, size))
    _, part = connected_components(graph, directed=False)
    return np.unique(part[rows]).size


@settings(derandomize=True, deadline=None, max_examples=300)
@example(np.array([[0.0, 1.5, 0.0], [1.25, 0.0, 0.0]]))
@given(
    st.tuples(st.integers(1, 8), st.integers(1, 8)).flatmap(
        lambda shape: arrays(float, shape, elements=st.floats(0, 30).map(lambda x: round(x, 3)))
    )
)
def test_rounding_holds_every_total_within_one(table: np.ndarray) -> None:
    whole = rounded(table)
    assert (np.abs(whole - table) < 1).all()
    for axis in (0, 1):
        assert (np.abs(whole.sum(axis) - table.sum(axis)) < 1 + 1e-6).all()
    # the sum of all: within one for each part that nothing ties to the others
    assert abs(whole.sum() - table.sum()) < max(parts_of(table), 1) + 1e-6


def test_rounding_goes_up_as_often_as_the_fraction_says() -> None:
    table = np.array([[0.2, 0.5, 0.3], [0.7, 0.1, 0.9], [2.4, 0.0, 1.0]])
    mean = np.mean([rounded(table, seed) for seed in range(2000)], axis=0)
    assert mean == pytest.approx(table, abs=4 * 0.5 / np.sqrt(2000))


def test_many_small_pairs_lose_nothing() -> None:
    """300 × 300 pairs of a third of a vehicle each."""
    table = np.random.default_rng(0).random((300, 300)) * 0.66
    whole = rounded(table)
    assert set(np.unique(whole)) == {0, 1}
    for axis in (0, 1, None):
        assert (np.abs(whole.sum(axis) - table.sum(axis)) < 1 + 1e-6).all()


def test_every_vehicle_is_kept_and_the_last_platoon_is_smaller() -> None:
    platoons = make_platoons(demand(("1", "2", 0, 100, 23.0), ("1", "3", 0, 100, 2.0)), SETTINGS)
    sizes = {
        end: platoons.vehicles[platoons.node_ids[platoons.destination] == end] for end in ("2", "3")
    }
    assert sorted(sizes["2"]) == [3, 5, 5, 5, 5]
    assert sizes["3"].tolist() == [2]
    assert platoons.vehicles[np.lexsort((platoons.number, platoons.destination))][4] == 3


def test_departures_follow_the_slices_in_their_shares() -> None:
    rows = (("1", "2", 0.0, 600.0, 3000.0), ("1", "2", 600.0, 900.0, 6000.0))
    platoons = make_platoons(demand(*rows), SETTINGS)
    assert (np.diff(platoons.depart) >= 0).all()
    before = platoons.vehicles[platoons.depart < 600].sum()
    assert before == pytest.approx(3000, abs=5)
    count = np.searchsorted(platoons.depart, [150, 300, 450, 600, 700, 800, 900])
    assert count * 5 == pytest.approx([750, 1500, 2250, 3000, 5000, 7000, 9000], abs=5)


def test_departures_are_spread_over_their_shares_at_random() -> None:
    platoons = make_platoons(demand(("1", "2", 0.0, 1000.0, 5000.0)), SETTINGS)
    within = platoons.depart % 1.0
    assert kstest(within, "uniform").pvalue > 0.001


def test_truncation_cuts_every_row_and_departs_when_a_platoon_has_come_together() -> None:
    """As in UXsim: 7.92 vehicles over 4800 s make one platoon of 5 at 5 / 7.92 of the time."""
    settings = Settings(duration=7200, demand_rounding="truncate")
    rows = (("1", "2", 0.0, 4800.0, 7.92), ("1", "2", 0.0, 4800.0, 2.4))
    platoons = make_platoons(demand(*rows), settings)
    assert platoons.vehicles.tolist() == [5]
    assert platoons.depart == pytest.approx([4800 * 5 / 7.92])
    whole = make_platoons(demand(("1", "2", 0.0, 1000.0, 0.1 * 100)), settings)
    assert whole.depart == pytest.approx([500.0, 1000.0])


def test_draws_of_a_pair_do_not_depend_on_other_pairs_nor_on_their_order() -> None:
    row, other = ("1", "2", 0.0, 900.0, 40.0), ("7", "1", 0.0, 900.0, 35.0)
    alone = make_platoons(demand(row), SETTINGS)
    for rows in ((row, other), (other, row)):
        both = make_platoons(demand(*rows), SETTINGS)
        same = both.node_ids[both.origin] == "1"
        assert (both.depart[same] == alone.depart).all()
        assert (both.key[same] == alone.key).all()
    seeds = [make_platoons(demand(row), Settings(7200, seed=seed)).depart for seed in (0, 1)]
    assert (seeds[0] != seeds[1]).all()


def test_opposite_pairs_draw_differently() -> None:
    platoons = make_platoons(demand(("1", "2", 0, 9, 5.0), ("2", "1", 0, 9, 5.0)), SETTINGS)
    assert platoons.key[0] != platoons.key[1]


def test_hashes_are_spread_evenly() -> None:
    keys = text_keys(str(i) for i in range(20000))
    assert pd.Series(keys).is_unique
    with np.errstate(over="ignore"):
        for counter in (0, 1, 2**40):
            assert kstest(unit(combine(keys, np.uint64(counter))), "uniform").pvalue > 0.001
