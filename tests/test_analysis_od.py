"""Tables of trips by pair: worked out by hand, and in agreement with the trips of a run."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest
from drives import Drive, crowded_grid, result_of
from small_networks import grid, link, network

from uxsim_geo.analysis.groups import Groups
from uxsim_geo.analysis.od import od_table
from uxsim_geo.analysis.summary import summary
from uxsim_geo.errors import InputError
from uxsim_geo.result import Result

#: a to c over b, 1 km each at 20 m/s; from c back to a
ROAD = network([link("ab", "a", "b"), link("bc", "b", "c"), link("ca", "c", "a")])
NAN = np.nan


def every_fate() -> Result:
    """To c: 110 s, 150 s, running, waiting, aborted, and one that departs too late."""
    drives = [
        Drive("a", "c", 0.0, [("ab", 10.0, 60.0), ("bc", 60.0, 110.0)],
              free_time_s=100.0, toll=1.0),
        Drive("c", "a", 30.0, [("ca", 30.0, 80.0)], vehicles=2),
        Drive("a", "c", 50.0, [("ab", 60.0, 130.0), ("bc", 130.0, 200.0)], vehicles=1,
              free_time_s=100.0, toll=4.0, driver_class="heavy"),
        Drive("a", "c", 120.0, [("ab", 120.0, 170.0), ("bc", 170.0, NAN)], "running", rest_m=200.0),
        Drive("a", "c", 130.0, [("ab", 130.0, 190.0)], "aborted", 2),
        Drive("a", "c", 140.0, (), "waiting", 3),
        Drive("a", "c", 200.5, (), "waiting", 4),
    ]  # fmt: skip
    return result_of(ROAD, drives, 200.0)


def test_one_pair_of_every_fate() -> None:
    table = od_table(every_fate(), ROAD)
    assert list(zip(table["origin"], table["destination"], strict=True)) == [("a", "c"), ("c", "a")]
    row = table.iloc[0]
    counts = {"demanded": 20, "departed": 16, "completed": 6, "unfinished": 8, "aborted": 2}
    for name, vehicles in counts.items():
        assert row[f"vehicles_{name}"] == vehicles, name
    # five at 110 s and one at 150 s
    assert row["experienced_travel_time_completed_only_s"] == pytest.approx((5 * 110 + 150) / 6)
    percentiles = [
        row[f"experienced_travel_time_p{p}_completed_only_s"] for p in ("05", "50", "95")
    ]
    assert percentiles == [110.0, 110.0, 150.0]
    assert row["delay_completed_only_s"] == pytest.approx((5 * 10 + 50) / 6)
    assert row["distance_completed_only_m"] == 2000.0
    assert row["toll_completed_only"] == pytest.approx((5 * 1 + 4) / 6)
    # running 80 s, aborted after 60 s, waiting 60 s
    so_far = 5 * 110 + 150 + 5 * 80 + 2 * 60 + 3 * 60
    assert row["travel_time_so_far_s"] == pytest.approx(so_far / 16)
    # the running ones have driven 1,200 m, 60 s at free flow; the aborted ones 50 s
    assert row["total_delay_so_far_veh_s"] == pytest.approx(5 * 10 + 50 + 5 * 20 + 2 * 10 + 3 * 60)
    assert row["delay_so_far_s"] == pytest.approx(row["total_delay_so_far_veh_s"] / 16)


def test_slices_of_departure_and_who_departs_after_the_end() -> None:
    table = od_table(every_fate(), ROAD, bin_s=130.0)
    assert table["begin_s"].tolist() == [0.0, 130.0, 200.0, 0.0]
    assert table["end_s"].tolist() == [130.0, 200.0, np.inf, 130.0]
    assert table["vehicles_demanded"].tolist() == [11.0, 5.0, 4.0, 2.0]
    assert table["vehicles_departed"].tolist() == [11.0, 5.0, 0.0, 2.0]
    # nobody has completed: no number, not a nought
    assert table.loc[1:2, "experienced_travel_time_completed_only_s"].isna().all()
    assert table.loc[1:2, "experienced_travel_time_p50_completed_only_s"].isna().all()
    assert table["delay_so_far_s"].isna().tolist() == [False, False, True, False]


def test_who_departs_at_the_very_end_is_in_the_last_slice() -> None:
    last = result_of(ROAD, [Drive("a", "c", 200.0, (), "waiting")], 200.0)
    table = od_table(last, ROAD, bin_s=100.0)
    assert table[["begin_s", "end_s"]].to_numpy().tolist() == [[100.0, 200.0]]
    assert table["vehicles_departed"].tolist() == [5.0]


def test_classes_stand_apart_and_a_subset_stands_alone() -> None:
    table = od_table(every_fate(), ROAD, by_class=True)
    assert table["class"].tolist() == ["default", "heavy", "default"]
    assert table["experienced_travel_time_completed_only_s"].tolist() == [110.0, 150.0, 50.0]
    alone = od_table(every_fate(), ROAD, vehicles=[2])
    assert alone["vehicles_demanded"].tolist() == [1.0]
    assert alone["experienced_travel_time_completed_only_s"].tolist() == [150.0]


@pytest.mark.parametrize("options", [{}, {"bin_s": 111.0}, {"bin_s": 1e4}, {"by_class": True}])
def test_pairs_add_up_to_the_trips_and_to_the_summary(options: dict[str, Any]) -> None:
    network_, result = crowded_grid()
    table, trips = od_table(result, network_, **options), result.trips
    figures = summary(result, network_)
    for name in ("demanded", "departed", "completed"):
        assert table[f"vehicles_{name}"].sum() == figures[f"vehicles_{name}"], name
    running_or_waiting = figures["vehicles_running"] + figures["vehicles_waiting"]
    assert table["vehicles_unfinished"].sum() == running_or_waiting
    assert table["total_delay_so_far_veh_s"].sum() == pytest.approx(figures["total_delay_veh_s"])
    time = table["travel_time_so_far_s"].fillna(0) * table["vehicles_departed"]
    assert time.sum() == pytest.approx(figures["total_travel_time_veh_s"])
    completed = table["experienced_travel_time_completed_only_s"].fillna(0)
    total = ((trips["arrive_s"] - trips["depart_s"]) * trips["vehicles"]).sum()
    assert (completed * table["vehicles_completed"]).sum() == pytest.approx(total)
    mean = figures["completed"]["average_delay_s"] * figures["vehicles_completed"]
    delay = table["delay_completed_only_s"].fillna(0) * table["vehicles_completed"]
    assert delay.sum() == pytest.approx(mean)


@pytest.mark.parametrize("seed", range(5))
def test_percentiles_are_those_of_numpy_s_weighted_quantile(seed: int) -> None:
    random = np.random.default_rng(seed)
    number, weights = random.integers(0, 7, 200), random.integers(0, 6, 200).astype(float)
    values = np.where(weights > 0, random.normal(size=200), NAN)
    groups = Groups.of(number)
    for percent, found in zip((3, 50, 97), groups.percentiles(values, weights, (3, 50, 97)),
                              strict=True):  # fmt: skip
        for key, value in zip(groups.keys[0], found, strict=True):
            own = (number == key) & (weights > 0)
            wanted = np.quantile(
                values[own], percent / 100, weights=weights[own], method="inverted_cdf"
            )
            assert value == wanted


def test_a_percentile_on_the_edge_of_a_share_is_the_lower_value() -> None:
    times = np.arange(60, dtype=float)
    groups = Groups.of(np.zeros(60, np.int64))
    for percent in range(5, 100, 5):
        (found,) = groups.percentiles(times, np.ones(60), (percent,))
        # percent of 60 is a whole number, the rank of the value, counted from 1
        assert found[0] == percent * 60 // 100 - 1, percent


def test_the_pairs_of_nobody_make_an_empty_table() -> None:
    nobody = result_of(ROAD, [Drive("a", "c", 0.0, (), "waiting")], 10.0)
    empty = Result(nobody.log, nobody.trips.iloc[:0], nobody.settings, 0.0, 0)
    assert od_table(empty, ROAD, bin_s=5.0).empty


@pytest.mark.parametrize("bin_s", [0.0, -1.0, NAN, np.inf, 1e-5])
def test_a_wrong_bin_is_refused(bin_s: float) -> None:
    with pytest.raises(InputError, match="bin_s"):
        od_table(every_fate(), ROAD, bin_s=bin_s)


@pytest.mark.parametrize(
    ("vehicles", "message"),
    [([], "names nobody"), ([0, 7, -1], r"0 to 6 \(found '-1, 7'\)"), ([0.5], "whole numbers")],
)
def test_a_wrong_subset_is_refused(vehicles: list[float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        od_table(every_fate(), ROAD, vehicles=vehicles)


def test_the_result_of_another_network_is_refused() -> None:
    with pytest.raises(InputError, match="another run"):
        od_table(every_fate(), network(grid(2)))
    same_nodes = network([link("x", "a", "b"), link("y", "b", "c"), link("z", "c", "a")])
    with pytest.raises(InputError, match="its links are not those"):
        od_table(every_fate(), same_nodes)


def test_rows_follow_the_tables_whatever_the_order_of_the_trips() -> None:
    _, result = crowded_grid()
    table = od_table(result, crowded_grid()[0], bin_s=300.0)
    keys = [table["origin"].cat.codes, table["destination"].cat.codes, table["begin_s"]]
    assert pd.DataFrame(dict(enumerate(keys))).apply(tuple, axis=1).is_monotonic_increasing
