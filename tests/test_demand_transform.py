"""Demand scaled, shifted, replaced and parted: by hand, with totals before and after."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from od_files import od, values

from uxsim_geo.demand.demand import Demand
from uxsim_geo.demand.od_table import OdTable
from uxsim_geo.demand.transform import (
    Where,
    replace_rows,
    scale,
    shift,
    split_classes,
    whole_vehicles,
)
from uxsim_geo.errors import InputError


def table() -> OdTable:
    return od(
        ("1", "2", 0.0, 900.0, 10.0, "default"),
        ("1", "2", 900.0, 1800.0, 20.0, "default"),
        ("2", "1", 0.0, 900.0, 5.0, "truck"),
        ("3", "1", 0.0, 900.0, 1.0, "default"),
        columns="origin destination start_s end_s vehicles class",
    )


WHERE = {
    "everything": (Where(), [20.0, 40.0, 10.0, 2.0]),
    "origins": (Where(origins=["1", "3"]), [20.0, 40.0, 5.0, 2.0]),
    "destinations": (Where(destinations=["1"]), [10.0, 20.0, 10.0, 2.0]),
    "pairs": (Where(pairs=[("1", "2")]), [20.0, 40.0, 5.0, 1.0]),
    "class": (Where(classes=["truck"]), [10.0, 20.0, 10.0, 1.0]),
    "time": (Where(between=(900.0, 901.0)), [10.0, 40.0, 5.0, 1.0]),
    "all of them": (Where(["1"], ["2"], [("1", "2")], ["default"], (0.0, 1.0)), [20.0, 20, 5, 1]),
}


@pytest.mark.parametrize("name", WHERE)
def test_the_rows_meant_are_multiplied(name: str) -> None:
    where, expected = WHERE[name]
    changed, report = scale(table(), 2.0, where)
    assert changed.table["vehicles"].tolist() == expected
    assert report["out_before"].tolist() == [30.0, 5.0, 1.0]
    assert report["out_after"].sum() == sum(expected)
    assert report["in_after"].sum() == sum(expected)
    assert changed.notes["topic"].tolist() == ["changed"]


def test_what_is_multiplied_by_nothing_goes() -> None:
    changed, report = scale(table(), 0.0, Where(origins=["1"]))
    assert changed.table["origin"].tolist() == ["2", "3"]
    assert values(report) == [
        ["1", 30.0, 0.0, 6.0, 6.0],
        ["2", 5.0, 5.0, 30.0, 0.0],
        ["3", 1.0, 1.0, 0.0, 0.0],
    ]


def test_demand_between_nodes_keeps_its_kind_and_its_routes() -> None:
    rows = table().table.reset_index(drop=True)
    demand = Demand(rows.iloc[::-1].assign(route=[("x",), None, None, None]).reset_index(drop=True))
    changed, _ = scale(demand, 2.0, Where(origins=["3"]))
    assert isinstance(changed, Demand)
    assert values(changed.table, "origin", "vehicles", "route")[0] == ["3", 2.0, ("x",)]
    assert values(scale(Demand(rows), 3.0)[0].table, "vehicles") == [[30.0], [60.0], [15.0], [3.0]]


def test_rows_are_moved_in_time() -> None:
    changed, report = shift(table(), 600.0, Where(origins=["1"]))
    assert values(changed.table, "start_s", "end_s") == [
        *([600.0, 1500.0], [1500.0, 2400.0], [0.0, 900.0], [0.0, 900.0])
    ]
    assert report["out_after"].tolist() == report["out_before"].tolist()
    back, _ = shift(changed, -600.0, Where(origins=["1"]))
    assert values(back.table) == values(table().table)
    with pytest.raises(InputError) as raised:
        shift(table(), -1.0)
    assert len(raised.value.faults) == 3
    assert "row 3: would be before the start" in str(raised.value)


def test_a_moment_stays_one_when_it_is_moved() -> None:
    moment = od(
        ("1", "2", 0.0, np.nextafter(0.0, 1.0), 1.0),
        columns="origin destination start_s end_s vehicles",
    )
    (row,) = values(shift(moment, 3600.0)[0].table)
    assert row[2] == 3600.0
    assert row[3] == np.nextafter(3600.0, np.inf)


def test_rows_are_replaced() -> None:
    new = pd.DataFrame({"origin": ["1"], "destination": ["3"], "start_s": [0.0], "end_s": [60.0]})
    changed, report = replace_rows(table(), new.assign(vehicles=7.0), Where(origins=["1"]))
    assert values(changed.table, "origin", "destination", "vehicles", "class") == [
        ["1", "3", 7.0, "default"],
        ["2", "1", 5.0, "truck"],
        ["3", "1", 1.0, "default"],
    ]
    assert values(report)[0] == ["1", 30.0, 7.0, 6.0, 6.0]
    nothing, _ = replace_rows(table(), new.assign(vehicles=7.0).iloc[:0], Where(origins=["1"]))
    assert nothing.table["origin"].tolist() == ["2", "3"]
    with pytest.raises(InputError, match="lacks the column vehicles"):
        replace_rows(table(), new, Where())
    with pytest.raises(InputError, match="row 0: must be a finite number of vehicles"):
        replace_rows(table(), new.assign(vehicles=-7.0), Where())


def test_vehicles_are_parted_among_classes() -> None:
    changed, report = split_classes(table(), {"default": 0.9, "truck": 0.1}, Where(origins=["1"]))
    assert values(changed.table, "origin", "class", "vehicles") == [
        ["1", "default", 9.0],
        ["1", "default", 18.0],
        ["1", "truck", 1.0],
        ["1", "truck", 2.0],
        ["2", "truck", 5.0],
        ["3", "default", 1.0],
    ]
    assert report["out_after"].tolist() == report["out_before"].tolist()
    with pytest.raises(InputError, match="must sum to 1"):
        split_classes(table(), {"default": 0.9})
    with pytest.raises(InputError, match="must be from 0 to 1"):
        split_classes(table(), {"default": 1.1, "truck": -0.1})


def test_places_and_classes_that_are_not_there_are_told_all_at_once() -> None:
    where = Where(["1", "x"], "12", [("2", "3")], ["bus"], (5.0, 5.0))
    with pytest.raises(InputError) as raised:
        scale(table(), 2.0, where)
    found = {(fault.column, str(fault.value)) for fault in raised.value.faults}
    assert found == {
        ("origins", "x"),
        ("destinations", "12"),
        ("pairs", "('2', '3')"),
        ("classes", "bus"),
        ("between", "(5.0, 5.0)"),
    }
    with pytest.raises(InputError, match="finite number, 0 or more"):
        scale(table(), -1.0)
    with pytest.raises(InputError, match="has no times"):
        shift(od(("1", "2", 3.0)), 60.0)
    with pytest.raises(InputError, match="has no times"):
        scale(od(("1", "2", 3.0)), 2.0, Where(between=(0.0, 1.0)))


def many_small_pairs() -> OdTable:
    """300 zones, 90,000 pairs of 0.001 to 0.1 vehicles, 2,300 in all."""
    drawn = np.random.default_rng(5).gamma(0.5, 0.05, (300, 300))
    names = [f"z{number}" for number in range(300)]
    pairs = [(start, end) for start in names for end in names]
    return od(*((*pair, value) for pair, value in zip(pairs, drawn.ravel().tolist(), strict=True)))


def test_rounded_pairs_are_whole_and_keep_the_totals_of_places() -> None:
    before = many_small_pairs()
    after, report = whole_vehicles(before)
    vehicles = after.table["vehicles"].to_numpy()
    assert (vehicles == np.floor(vehicles)).all()
    assert (vehicles > 0).all()
    assert len(after.table) <= vehicles.sum()
    assert abs(vehicles.sum() - before.table["vehicles"].sum()) < 1
    for end in ("out", "in"):
        assert (report[f"{end}_after"] - report[f"{end}_before"]).abs().max() < 1
    assert after.notes["topic"].tolist() == ["changed"]
    again, _ = whole_vehicles(before)
    assert again.table.equals(after.table)


def test_small_pairs_are_drawn_in_proportion_to_their_vehicles() -> None:
    before = many_small_pairs().table
    after = whole_vehicles(many_small_pairs())[0].table
    both = before.merge(after, on=["origin", "destination"], how="left", suffixes=("", "_whole"))
    both = both.fillna({"vehicles_whole": 0.0})
    tenth = pd.qcut(both["vehicles"], 10)
    sums = both.groupby(tenth, observed=True)[["vehicles", "vehicles_whole"]].sum()
    # fluctuations of so many draws, three standard deviations
    assert ((sums["vehicles_whole"] - sums["vehicles"]).abs() < 3 * sums["vehicles"] ** 0.5).all()


def test_pairs_that_are_whole_stay_as_they_are() -> None:
    assert values(whole_vehicles(table())[0].table) == values(table().table)
