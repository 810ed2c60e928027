"""Who gains and who loses, platoon by platoon, worked out by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

from uxsim_geo.analysis.comparison.winner_tables import WinnerTables
from uxsim_geo.analysis.comparison.winners import match_trips

NAN = np.nan


def trips(*rows: dict[str, Any]) -> pd.DataFrame:
    """Platoons 0, 1, 2 … from a to b, of 5 vehicles, that took 100 s, but for what a row says."""
    usual = {
        "origin": "a",
        "destination": "b",
        "class": "default",
        "vehicles": 5.0,
        "status": "completed",
        "depart_s": 0.0,
        "travel_time_s": 100.0,
        "delay_s": 0.0,
        "origin_zone": "A",
        "destination_zone": "B",
    }
    return pd.DataFrame([{"number": number, **usual, **row} for number, row in enumerate(rows)])


def outcome(base: dict[str, Any], scenario: dict[str, Any]) -> str:
    found = match_trips(trips(base), trips(scenario))
    assert len(found) == 1
    return str(found["outcome"].iloc[0])


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        (100.0, 130.0, "little_change"),  # 30 s are not more than 30 s
        (100.0, 130.5, "loses"),
        (100.0, 69.5, "gains"),
        (1000.0, 1045.0, "little_change"),  # more than 30 s, and not more than 5 %
        (1000.0, 1050.5, "loses"),
        (1000.0, 949.5, "gains"),
        (100.0, 100.0, "little_change"),
    ],
)
def test_both_thresholds_must_be_passed(before: float, after: float, expected: str) -> None:
    assert outcome({"travel_time_s": before}, {"travel_time_s": after}) == expected


@pytest.mark.parametrize(
    ("base", "scenario", "expected"),
    [
        # had not arrived after 500 s: it loses, whatever comes
        ({}, {"status": "running", "travel_time_s": 500.0}, "loses"),
        # nor after 110 s: it may yet lose or not
        ({}, {"status": "waiting", "travel_time_s": 110.0}, "undetermined"),
        # had not arrived after 500 s, and now does in 100 s
        ({"status": "running", "travel_time_s": 500.0}, {}, "gains"),
        ({"status": "running", "travel_time_s": 90.0}, {}, "undetermined"),
        # a bound that lies on the wrong side says nothing
        ({"status": "running", "travel_time_s": 90.0}, {"travel_time_s": 300.0}, "undetermined"),
        ({"status": "running"}, {"status": "running"}, "undetermined"),
        ({}, {"status": "aborted", "travel_time_s": 10.0}, "loses"),
        ({"status": "aborted", "travel_time_s": 10.0}, {}, "gains"),
        ({"status": "aborted"}, {"status": "aborted"}, "undetermined"),
        ({}, {"status": "not_departed", "travel_time_s": NAN}, "undetermined"),
    ],
)
def test_unfinished_trips_count_by_what_is_certain(
    base: dict[str, Any], scenario: dict[str, Any], expected: str
) -> None:
    assert outcome(base, scenario) == expected


def test_vehicles_of_one_run_alone_are_told_apart() -> None:
    base = trips({}, {"vehicles": 5.0}, {"origin": "c"})
    scenario = trips({}, {"vehicles": 3.0}, {"class": "lorry"})
    found = match_trips(base, scenario)
    counts = found.groupby("outcome")["vehicles"].sum().to_dict()
    # the second platoon is three in both and two in the base; the third is another one
    assert counts == {"little_change": 8.0, "base_only": 7.0, "scenario_only": 5.0}
    alone = found[found["outcome"] == "scenario_only"].iloc[0]
    assert (alone["status_base"], alone["status_scenario"]) == ("absent", "completed")
    assert np.isnan(alone["change_s"])
    assert np.isnan(alone["travel_time_s_base"])
    larger = match_trips(scenario, base)
    assert larger.groupby("outcome")["vehicles"].sum().to_dict() == {
        "little_change": 8.0,
        "base_only": 5.0,
        "scenario_only": 7.0,
    }


def test_the_order_of_the_rows_does_not_matter() -> None:
    base = trips(*({"travel_time_s": 100.0 + number} for number in range(6)))
    scenario = base.iloc[::-1].reset_index(drop=True)
    assert (match_trips(base, scenario)["change_s"] == 0.0).all()


def sums_of(*pairs: tuple[pd.DataFrame, pd.DataFrame]) -> WinnerTables:
    tables = WinnerTables()
    for base, scenario in pairs:
        tables.add(match_trips(base, scenario))
    return tables


def test_shares_by_everybody_class_and_zone_over_two_pairs() -> None:
    base = trips({}, {}, {"origin_zone": "C", "class": "lorry"}, {"vehicles": 10.0})
    first = base.assign(travel_time_s=[50.0, 160.0, 200.0, 100.0])
    second = base.assign(travel_time_s=[50.0, 100.0, 200.0, 100.0])
    table = sums_of((base, first), (base, second)).trips()
    assert table["group"].unique().tolist() == ["all", "class", "origin_zone", "destination_zone"]
    everybody = table.iloc[0]
    # 25 vehicles: 5 gain in both; 10 lose in the first and 5 in the second
    assert everybody["vehicles"] == 25.0
    assert everybody["gaining_share"] == pytest.approx(0.2)
    assert everybody["losing_share"] == pytest.approx((0.4 + 0.2) / 2)
    assert everybody["little_change_share"] == pytest.approx((0.4 + 0.6) / 2)
    assert everybody["gained_veh_h"] == pytest.approx(5 * 50 / 3600)
    assert everybody["lost_veh_h"] == pytest.approx((5 * 60 + 2 * 5 * 100) / 2 / 3600)
    # two shares, 0.4 and 0.2: mean 0.3, half width t(0.975, 1) · 0.1
    low, high = everybody["losing_share_low"], everybody["losing_share_high"]
    assert (high - low) / 2 == pytest.approx(12.7062 * 0.1, rel=1e-5)
    shares = ["gaining_share", "losing_share", "little_change_share", "undetermined_share"]
    assert table[shares].sum(axis=1).to_numpy() == pytest.approx(1.0)
    lorries = table[(table["group"] == "class") & (table["name"] == "lorry")].iloc[0]
    assert (lorries["vehicles"], lorries["losing_share"]) == (5.0, 1.0)
    zone = table[(table["group"] == "origin_zone") & (table["name"] == "A")].iloc[0]
    assert zone["vehicles"] == 20.0


def test_a_group_that_a_pair_lacks_has_no_vehicles_in_it_and_no_shares() -> None:
    usual, other = trips({}), trips({}, {"class": "lorry"})
    slower = other.assign(travel_time_s=500.0)
    table = sums_of((usual, usual), (other, slower)).trips()
    lorries = table[table["name"] == "lorry"].iloc[0]
    assert lorries["vehicles"] == 2.5
    assert lorries["losing_share"] == 1.0


def test_the_distribution_holds_everybody_who_arrived_in_both() -> None:
    base = trips({}, {}, {}, {"status": "running"})
    scenario = base.assign(travel_time_s=[100.0, 145.0, 5000.0, 900.0])
    tables = sums_of((base, scenario))
    changes = tables.trip_changes()
    assert changes["vehicles"].sum() == 15.0
    assert changes["share"].sum() == pytest.approx(1.0)
    found = changes[changes["vehicles"] > 0]
    assert found["from_s"].tolist() == [-10.0, 30.0, 1800.0]
    assert found["to_s"].tolist() == [10.0, 60.0, np.inf]
    assert tables.trip_statuses().to_dict("list") == {
        "status_base": ["completed", "running"],
        "status_scenario": ["completed", "running"],
        "vehicles": [15.0, 5.0],
    }


def test_nobody_in_common() -> None:
    tables = sums_of((trips({}), trips({"origin": "z"})))
    assert tables.trips().empty
    assert tables.trip_changes()["share"].isna().all()
    assert tables.trip_statuses()["vehicles"].tolist() == [5.0, 5.0]
