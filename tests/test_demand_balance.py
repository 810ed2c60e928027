"""Balancing to totals: a solution known, odds ratios that stay, and what cannot be met told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from od_files import od, values, write

from uxsim_geo.demand.balance import balance, read_totals
from uxsim_geo.demand.demand import Demand
from uxsim_geo.demand.furness import BalanceOptions
from uxsim_geo.demand.od_table import OdTable
from uxsim_geo.errors import InputError


def totals(*rows: tuple[str, float, float]) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=["place", "out", "in"])


def of_matrix(matrix: np.ndarray) -> OdTable:
    return od(*((f"o{i}", f"d{j}", v) for (i, j), v in np.ndenumerate(matrix) if v > 0))


def sides(out: np.ndarray, into: np.ndarray) -> pd.DataFrame:
    rows = [(f"o{i}", float(v), 0.0) for i, v in enumerate(out)]
    return totals(*rows, *((f"d{j}", 0.0, float(v)) for j, v in enumerate(into)))


def matrix_of(table: OdTable, shape: tuple[int, int]) -> np.ndarray:
    matrix = np.zeros(shape)
    for origin, destination, vehicles in values(table.table, "origin", "destination", "vehicles"):
        matrix[int(str(origin)[1:]), int(str(destination)[1:])] = vehicles
    return matrix


def test_a_solution_that_is_known_is_found() -> None:
    # a seed without preferences gives the product of the totals over their sum
    seed = np.array([[1.0, 2.0], [1.0, 2.0]])
    balanced = balance(of_matrix(seed), sides(np.array([3.0, 6.0]), np.array([3.0, 6.0])))
    assert matrix_of(balanced.od, (2, 2)) == pytest.approx(np.array([[1.0, 2.0], [2.0, 4.0]]))
    # the corners x, 4 − x, 4 − x, 2 + x keep the ratio 2 · 3 / (1 · 1)
    seed = np.array([[2.0, 1.0], [1.0, 3.0]])
    balanced = balance(of_matrix(seed), sides(np.array([4.0, 6.0]), np.array([4.0, 6.0])))
    x = matrix_of(balanced.od, (2, 2))[0, 0]
    # x (2 + x) = 6 (4 − x)², that is 5 x² − 50 x + 96 = 0
    assert x == pytest.approx((50 - np.sqrt(50**2 - 4 * 5 * 96)) / 10, rel=1e-5)
    assert balanced.converged


@settings(deadline=None, max_examples=60, derandomize=True)
@given(
    st.tuples(st.integers(2, 5), st.integers(2, 5)).flatmap(
        lambda shape: st.tuples(
            arrays(float, shape, elements=st.floats(1, 50)),
            arrays(float, shape, elements=st.floats(1, 50)),
        )
    )
)
def test_totals_hold_and_odds_ratios_stay(both: tuple[np.ndarray, np.ndarray]) -> None:
    seed, other = both
    wanted = sides(other.sum(axis=1), other.sum(axis=0))
    balanced = balance(of_matrix(seed), wanted, BalanceOptions(tolerance=1e-10, iterations=20_000))
    assert balanced.converged
    found = matrix_of(balanced.od, seed.shape)
    assert found.sum(axis=1) == pytest.approx(other.sum(axis=1), rel=1e-9)
    assert found.sum(axis=0) == pytest.approx(other.sum(axis=0), rel=1e-9)
    ratio = found / seed
    # a_i b_j: every corner ratio is 1
    assert ratio * ratio[0, 0] == pytest.approx(np.outer(ratio[:, 0], ratio[0]), rel=1e-6)
    deviations = balanced.iterations["worst_deviation"].to_numpy()
    assert deviations[-1] <= 1e-10
    assert balanced.iterations["iteration"].tolist() == list(range(1, len(deviations) + 1))


def test_times_and_classes_of_a_pair_keep_their_parts() -> None:
    columns = "origin destination start_s end_s vehicles class"
    table = od(
        ("a", "b", 0.0, 9.0, 1.0, "car"),
        ("a", "b", 9.0, 18.0, 3.0, "car"),
        ("b", "a", 0.0, 9.0, 2.0, "hgv"),
        columns=columns,
    )
    balanced = balance(table, totals(("a", 8.0, 6.0), ("b", 6.0, 8.0)))
    assert balanced.od.table["vehicles"].tolist() == pytest.approx([2.0, 6.0, 6.0])
    demand = balance(Demand(table.table), totals(("a", 8.0, 6.0), ("b", 6.0, 8.0))).od
    assert isinstance(demand, Demand)


def test_sums_that_differ_are_told_and_one_side_kept() -> None:
    pairs = ("ab", "ba", "ac", "cb", "bc")
    table = od(*((*pair, 1.0) for pair in pairs))
    wanted = totals(("a", 20.0, 5.0), ("b", 10.0, 10.0), ("c", 5.0, 10.0))
    for keep, sum_ in (("out", 35.0), ("in", 25.0), ("mean", 30.0)):
        balanced = balance(table, wanted, BalanceOptions(keep=keep))  # type: ignore[arg-type]
        assert balanced.od.table["vehicles"].sum() == pytest.approx(sum_, rel=1e-5)
        (note,) = balanced.od.notes.query("topic == 'unequal totals'")["note"]
        assert "out sum to 35, those in to 25" in note
    with pytest.raises(InputError, match="out sum to 35, those in to 25: they must be equal"):
        balance(table, wanted, BalanceOptions(keep="fault"))
    report = balance(table, wanted).report
    assert report["out_after"].tolist() == pytest.approx(report["out_wanted"].tolist(), rel=1e-5)
    assert report["why"].str.contains("in: total multiplied to 14").any()


def test_totals_that_nothing_can_meet_are_told() -> None:
    table = od(("a", "b", 1.0), ("b", "a", 3.0), ("c", "c", 0.0))
    wanted = totals(("a", 4.0, 6.0), ("b", 6.0, 4.0), ("c", 5.0, 5.0), ("new", 2.0, 0.0))
    balanced = balance(table, wanted)
    report = balanced.report.set_index("place")
    assert report.index.tolist() == ["a", "b", "c", "new"]
    assert report.loc["c", "out_after"] == 0.0
    assert report.loc["c", "why"].count("no row of the table leads") == 2
    assert report.loc["new", "why"].startswith("out: no row")
    assert report.loc["a", "out_after"] == pytest.approx(4.0)
    assert balanced.converged
    unmet = balanced.od.notes.query("topic == 'totals not met'")["value"].tolist()
    assert unmet == ["12.0"]


def test_a_seed_whose_gaps_leave_no_solution_is_not_called_balanced() -> None:
    # a sends to b alone, which may take 1 only
    table = od(("a", "b", 1.0), ("c", "b", 1.0), ("c", "a", 1.0))
    wanted = totals(("a", 5.0, 9.0), ("b", 0.0, 1.0), ("c", 5.0, 0.0))
    balanced = balance(table, wanted, BalanceOptions(iterations=5000))
    assert not balanced.converged
    # given up once nothing is gained any more, long before the last iteration allowed
    assert len(balanced.iterations) <= 30
    assert balanced.iterations["worst_deviation"].iloc[-1] > 0.1
    note = balanced.od.notes.query("topic == 'balanced'").iloc[0]
    assert note["severity"] == "warning"
    assert note["note"].startswith("NOT balanced after ")


def test_order_of_rows_does_not_matter() -> None:
    generator = np.random.default_rng(1)
    matrix = generator.random((6, 6))
    table, wanted = of_matrix(matrix), sides(matrix.sum(axis=1) * 2, matrix.sum(axis=0) * 2)
    shuffled = balance(table, wanted.sample(frac=1, random_state=3)).od.table
    pd.testing.assert_frame_equal(balance(table, wanted).od.table, shuffled, check_exact=True)


def test_totals_from_a_file(tmp_path: Path) -> None:
    path = write(tmp_path, "totals.csv", "zone,production,attraction\n1,3,4\n2,2.5,1.5\n")
    assert values(read_totals(path)) == [["1", 3.0, 4.0], ["2", 2.5, 1.5]]
    bad = write(tmp_path, "bad.csv", "zone,out,in\n1,3,x\n1,-2,1\n,1,inf\n")
    with pytest.raises(InputError) as raised:
        read_totals(bad)
    assert {(fault.line, fault.column) for fault in raised.value.faults} == {
        *((2, "in"), (3, "place"), (3, "out"), (4, "place"), (4, "in"))
    }


def test_totals_that_are_missing_are_all_told() -> None:
    table = od(("a", "b", 1.0), ("c", "a", 1.0))
    with pytest.raises(InputError) as raised:
        balance(table, totals(("a", 1.0, 1.0)))
    assert [fault.value for fault in raised.value.faults] == ["b", "c"]
    with pytest.raises(InputError, match="lacks the column in"):
        balance(table, totals(("a", 1.0, 1.0)).drop(columns="in"))
    with pytest.raises(InputError) as raised:
        BalanceOptions("both", 0.0, 0)  # type: ignore[arg-type]
    assert len(raised.value.faults) == 3
