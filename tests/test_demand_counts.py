"""Demand adjusted to counts: the truth found again, the fit never worse, a twin that agrees."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from drives import Drive, crowded_grid, result_of
from hypothesis import given, settings
from hypothesis import strategies as st
from od_files import hour, values
from scipy.optimize import lsq_linear
from scipy.sparse import csr_array
from small_networks import across, demand, grid, link, network

from uxsim_geo.analysis.link_shares import link_shares
from uxsim_geo.demand.count_adjustment import AdjustOptions, adjust_to_counts
from uxsim_geo.demand.demand import Demand
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.errors import InputError
from uxsim_geo.settings import Settings

FREE = AdjustOptions(seed_weight=0.0, tolerance=0.0, iterations=300)


def counts(*vehicles: float) -> pd.DataFrame:
    rows = [(f"l{place}", 0.0, 3600.0, count) for place, count in enumerate(vehicles)]
    return pd.DataFrame(rows, columns=["link_id", "start_s", "end_s", "vehicles"])


def seed_of(vehicles: list[float]) -> Demand:
    return Demand(hour(*((f"{i:03}", "z", v) for i, v in enumerate(vehicles))).table)


def test_one_pair_and_one_count_by_hand() -> None:
    # ½ (x − 150)² / 150 + ½ ρ (x − 100)² / 100 is least at (1 + ρ) / (1/150 + ρ/100)
    for weight in (0.0, 0.5, 3.0):
        adjusted = adjust_to_counts(
            seed_of([100.0]), [[1.0]], counts(150.0), AdjustOptions(weight, tolerance=0.0)
        )
        best = (1 + weight) / (1 / 150 + weight / 100)
        assert adjusted.od.table["vehicles"].tolist() == pytest.approx([best], rel=1e-9)
    (row,) = values(adjust_to_counts(seed_of([100.0]), [[0.5]], counts(60.0), FREE).counts)
    assert row[3:6] == [60.0, 50.0, pytest.approx(60.0)]
    assert row[6] == pytest.approx(np.sqrt(2 * 100 / 110))
    assert row[7] == pytest.approx(0.0, abs=1e-6)


def test_the_truth_is_found_where_counts_determine_it() -> None:
    generator = np.random.default_rng(8)
    for _ in range(5):
        shares = np.where(generator.random((14, 8)) < 0.4, generator.random((14, 8)), 0.0)
        shares += np.eye(14, 8) * 0.5
        truth = generator.random(8) * 100 + 20
        seed = truth * np.exp(generator.normal(0, 0.5, 8))
        adjusted = adjust_to_counts(seed_of(seed.tolist()), shares, counts(*(shares @ truth)), FREE)
        assert adjusted.od.table["vehicles"].to_numpy() == pytest.approx(truth, rel=1e-4)
        assert adjusted.iterations["rmse"].iloc[-1] < 1e-3
        assert adjusted.iterations["share_under_geh_5"].iloc[-1] == 1.0


@settings(deadline=None, max_examples=60, derandomize=True)
@given(st.integers(0, 10_000), st.sampled_from([0.0, 0.1, 2.0]))
def test_the_fit_is_never_worse_and_agrees_with_a_solver(number: int, weight: float) -> None:
    generator = np.random.default_rng(number)
    rows, seen = int(generator.integers(1, 9)), int(generator.integers(1, 9))
    shares = np.where(generator.random((seen, rows)) < 0.5, generator.random((seen, rows)), 0.0)
    seed = generator.random(rows) * 90 + 1
    observed = generator.random(seen) * 300
    options = AdjustOptions(weight, most_change=4.0, iterations=500, tolerance=0.0)
    adjusted = adjust_to_counts(
        seed_of(seed.tolist()), csr_array(shares), counts(*observed), options
    )
    fit = adjusted.iterations
    assert (np.diff(fit["objective"]) < 0).all()
    assert fit["misfit"].iloc[-1] <= fit["misfit"].iloc[0] * (1 + 1e-12)
    found = adjusted.od.table["vehicles"].to_numpy()
    assert ((found >= seed / 4 * (1 - 1e-12)) & (found <= seed * 4 * (1 + 1e-12))).all()
    # F is the least squares of these rows below one another
    some = shares.sum(axis=1) > 0
    root = np.sqrt(np.where(some, 1 / np.maximum(observed, 1), 0.0))
    matrix = np.vstack([root[:, None] * shares, np.diag(np.sqrt(weight / seed))])
    wanted = np.concatenate([root * observed, np.sqrt(weight * seed)])
    best = lsq_linear(matrix, wanted, (seed / 4, seed * 4), method="bvls", tol=1e-14)
    lacking = float((root[some] ** 2 * observed[some] ** 2).sum())
    assert fit["objective"].iloc[-1] <= best.cost + 1e-4 * max(best.cost, 1e-3 * lacking)


def test_rows_that_no_count_sees_stay_as_they_are() -> None:
    shares = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    for options in (FREE, AdjustOptions()):
        adjusted = adjust_to_counts(seed_of([10.0, 20.0, 30.0]), shares, counts(15.0, 7.0), options)
        assert adjusted.od.table["vehicles"].tolist()[1:] == [20.0, 30.0]
        assert adjusted.counts["why"].tolist() == ["", "no row of the demand passes here"]
        notes = adjusted.od.notes["value"].tolist()
        assert notes[1:] == ["1", "50.0"]
        assert values(adjusted.report)[-1][:2] == ["z", 0.0]


def test_a_perfect_seed_is_left_alone() -> None:
    adjusted = adjust_to_counts(seed_of([10.0, 20.0]), np.eye(2), counts(10.0, 20.0))
    assert adjusted.od.table["vehicles"].tolist() == [10.0, 20.0]
    assert len(adjusted.iterations) == 1


def test_a_strong_seed_pulls_back() -> None:
    found = [
        adjust_to_counts(seed_of([100.0]), [[1.0]], counts(200.0), AdjustOptions(weight))
        .od.table["vehicles"]
        .iloc[0]
        for weight in (0.0, 0.1, 1.0, 100.0)
    ]
    assert found == sorted(found, reverse=True)
    assert found[0] == pytest.approx(200.0, rel=1e-3)
    assert found[-1] == pytest.approx(100.0, abs=2.0)


def test_faults_of_counts_and_shares() -> None:
    table = counts(1.0, -1.0, np.inf).assign(end_s=[3600.0, 3600.0, 0.0])
    with pytest.raises(InputError) as raised:
        adjust_to_counts(seed_of([1.0]), np.ones((3, 1)), table)
    assert len(raised.value.faults) == 3
    with pytest.raises(InputError, match=r"\(counts, rows of the demand\), \(1, 2\)"):
        adjust_to_counts(seed_of([1.0, 2.0]), np.ones((2, 2)), counts(1.0))
    with pytest.raises(InputError, match="finite and not negative"):
        adjust_to_counts(seed_of([1.0]), [[-1.0]], counts(1.0))
    with pytest.raises(InputError, match="lacks the column start_s"):
        adjust_to_counts(seed_of([1.0]), [[1.0]], counts(1.0).drop(columns="start_s"))
    with pytest.raises(InputError) as raised:
        AdjustOptions(-1.0, 1.0, 0, 1.0)
    assert len(raised.value.faults) == 4


RING = network([link("ab", "a", "b"), link("bc", "b", "c"), link("ca", "c", "a")])


def test_shares_of_a_run_by_hand() -> None:
    drives = [
        Drive("a", "c", 0.0, [("ab", 0, 50), ("bc", 50, 100)], vehicles=4),
        Drive("a", "c", 30.0, [("ab", 30, 80), ("bc", 80, np.nan)], "running", 1),
        Drive("a", "c", 70.0, [("ab", 70, np.nan)], "running", 5),
        Drive("b", "c", 0.0, [("bc", 0, 50), ("ca", 50, 99), ("ab", 99, 150), ("bc", 150, 200)]),
    ]
    asked = demand(
        ("a", "c", 0, 60, 6.0),
        ("a", "c", 60, 120, 5.0),
        ("b", "c", 0, 60, 5.0),
        ("c", "b", 0, 9, 1),
    )
    table = pd.DataFrame(
        [("bc", 0.0, 81.0), ("bc", 0.0, 80.0), ("bc", 0.0, 300.0), ("ab", 60.0, 99.0)],
        columns=["link_id", "start_s", "end_s"],
    ).assign(vehicles=1.0)
    found = link_shares(result_of(RING, drives, 210.0), RING, asked, table).toarray()
    assert found == pytest.approx(
        np.array(
            [
                [1.0, 0.0, 1.0, 0.0],
                [0.8, 0.0, 1.0, 0.0],
                [1.0, 0.0, 2.0, 0.0],  # the last drives round
                [0.0, 1.0, 0.0, 0.0],
            ]
        )
    )


def test_rows_alike_share_and_classes_do_not() -> None:
    drives = [
        Drive("a", "b", 5.0, [("ab", 5, 50)], driver_class="car"),
        Drive("a", "b", 6.0, [], "waiting", driver_class="truck"),
    ]
    rows = demand(*(("a", "b", 0, 60, 5.0) for _ in range(3))).table
    rows = rows.assign(**{"class": ["car", "car", "truck"]})
    table = pd.DataFrame({"link_id": ["ab"], "start_s": [0.0], "end_s": [9.0], "vehicles": [5.0]})
    found = link_shares(result_of(RING, drives, 210.0), RING, Demand(rows), table)
    assert found.toarray().tolist() == [[1.0, 1.0, 0.0]]


def test_shares_times_vehicles_are_the_entries_of_a_run() -> None:
    of, result = crowded_grid()
    asked = across(5, 40, 900.0)
    links = of.links["link_id"].tolist()
    rows = [(one, begin, begin + 200.0, 0.0) for one in links[::3] for begin in (0.0, 200.0, 400.0)]
    table = pd.DataFrame(rows, columns=["link_id", "start_s", "end_s", "vehicles"])
    shares = link_shares(result, of, asked, table)
    entered = result.events.assign(
        vehicles=result.trips["vehicles"].to_numpy()[result.events["vehicle"]]
    )
    expected = [
        entered.query("link == @one and @begin <= enter_s < @end")["vehicles"].sum()
        for one, begin, end, _ in rows
    ]
    assert sum(expected) > 1000
    # pairs occur in several rows, whose trips are those of the pair
    made = result.trips.groupby(["origin", "destination"], observed=True)["vehicles"].sum()
    pairs = list(zip(asked.table["origin"], asked.table["destination"], strict=True))
    repeats = pd.Series(pairs).value_counts()
    per_row = np.array([made[pair] / repeats[pair] for pair in pairs])
    assert shares @ per_row == pytest.approx(expected)


def test_shares_of_another_run_are_refused() -> None:
    of, result = crowded_grid()
    table = pd.DataFrame({"link_id": ["x"], "start_s": [0.0], "end_s": [9.0], "vehicles": [1.0]})
    with pytest.raises(InputError, match=r"there is no such link \(found 'x'\)"):
        link_shares(result, of, across(5, 40, 900.0), table)
    table = table.assign(link_id=of.links["link_id"].iloc[0])
    with pytest.raises(InputError, match="is of no row of the demand"):
        link_shares(result, of, demand(("0,0", "4,4", 0, 900, 5.0)), table)


def test_a_run_is_brought_to_the_counts_of_another() -> None:
    """Counts from a run of the true demand, shares from a run of a seed that is wrong."""
    of, told = network(grid(4)), Settings(3600.0, 1, seed=1)
    truth = across(4, 30, 1800.0)
    generator = np.random.default_rng(6)
    wrong = truth.table["vehicles"] * np.exp(generator.normal(-0.3, 0.5, len(truth.table)))
    seed = Demand(truth.table.assign(vehicles=wrong))
    real = simulate(of, truth, told)
    entries = real.events.groupby("link", observed=False).size().rename("vehicles")
    table = entries.reset_index().rename(columns={"link": "link_id"})
    table = table.assign(start_s=0.0, end_s=3600.0)[["link_id", "start_s", "end_s", "vehicles"]]
    shares = link_shares(simulate(of, seed, told), of, seed, table)
    adjusted = adjust_to_counts(seed, shares, table)
    again = simulate(of, adjusted.od, told)
    driven = again.events.groupby("link", observed=False).size().to_numpy()
    before = (shares @ wrong.to_numpy() - table["vehicles"]).to_numpy()
    after = driven - table["vehicles"].to_numpy()
    assert adjusted.iterations["misfit"].iloc[-1] < 0.05 * adjusted.iterations["misfit"].iloc[0]
    assert np.sqrt((after**2).mean()) < 0.5 * np.sqrt((before**2).mean())


def test_order_of_counts_does_not_matter() -> None:
    generator = np.random.default_rng(2)
    shares, observed = generator.random((6, 4)), generator.random(6) * 100
    order = generator.permutation(6)
    first = adjust_to_counts(seed_of([9.0, 20.0, 5.0, 8.0]), shares, counts(*observed))
    second = adjust_to_counts(
        replace(seed_of([9.0, 20.0, 5.0, 8.0])), shares[order], counts(*observed[order])
    )
    assert second.od.table["vehicles"].to_numpy() == pytest.approx(
        first.od.table["vehicles"].to_numpy(), rel=1e-9
    )
