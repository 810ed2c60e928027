"""Tables of differences: what is missing or undefined is null, and what is nothing is 0."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from compared import BASE, example_comparison, placed, run
from drives import Drive, result_of
from small_networks import link, network

from uxsim_geo.analysis.comparison.comparing import compare
from uxsim_geo.analysis.comparison.comparison import Comparison, Facts
from uxsim_geo.analysis.comparison.measured import TABLES, Measured
from uxsim_geo.analysis.comparison.measuring import MeasureOptions, measure
from uxsim_geo.analysis.comparison.quantities import LINKS, QUANTITIES, SUFFIXES
from uxsim_geo.errors import InputError

ROAD = [link("ab", "a", "b"), link("bc", "b", "c"), link("ca", "c", "a")]
NAN = np.nan
BY_ROAD = [("ab", 0.0, 50.0), ("bc", 50.0, 100.0)]


def of_drives(drives: list[Drive], links: list[dict] | None = None) -> Measured:
    of = network(links or ROAD)
    return measure(result_of(of, drives, 600.0), of, MeasureOptions(bin_s=300.0))


def one_pair(base: Measured, scenario: Measured, facts: Facts | None = None) -> Comparison:
    return compare([(base, scenario)], facts or Facts())


def by_link(comparison: Comparison) -> pd.DataFrame:
    return comparison.links.set_index("link_id")


def test_speed_on_a_link_that_nobody_uses_is_unknown_and_its_volume_is_0() -> None:
    base = of_drives([Drive("a", "c", 0.0, BY_ROAD)])
    scenario = of_drives([Drive("a", "b", 0.0, BY_ROAD[:1])])
    row = by_link(one_pair(base, scenario)).loc["bc"]
    assert row[["volume_veh_base", "volume_veh_scenario", "volume_veh_difference"]].tolist() == [
        5.0,
        0.0,
        -5.0,
    ]
    assert row["speed_kmh_base"] == pytest.approx(72.0)
    assert np.isnan(row["speed_kmh_scenario"])
    assert np.isnan(row["speed_kmh_difference"])
    assert np.isnan(row["speed_kmh_relative"])
    assert row["speed_kmh_seeds"] == 0
    unused = by_link(one_pair(base, scenario)).loc["ca"]
    assert unused["volume_veh_difference"] == 0.0
    assert np.isnan(unused["experienced_travel_time_s_difference"])


def test_a_link_of_one_network_alone_has_no_difference_at_all() -> None:
    _, _, found = example_comparison(3)
    links = by_link(found)
    assert links["exists"].to_dict() == {
        **dict.fromkeys(["ab", "ac", "cd", "ea", "de"], "both"),
        "bd": "base",
        "bc": "scenario",
    }
    for name, missing in (("bd", "scenario"), ("bc", "base")):
        row = links.loc[name]
        for quantity in LINKS:
            empty = [missing, "difference", "low", "high", "relative", "p", "adjusted_p"]
            for suffix in (*empty, "significant"):
                assert pd.isna(row[f"{quantity.name}_{suffix}"]), (name, quantity.name, suffix)
            assert row[f"{quantity.name}_seeds"] == 0
    assert links.loc["bd", "volume_veh_base"] > 0
    assert links.loc["bc", "volume_veh_scenario"] == 0.0
    times = found.link_times[found.link_times["link_id"] == "bd"]
    assert (times["exists"] == "base").all()
    assert times["flow_vph_base"].max() > 0
    assert times[["flow_vph_scenario", "flow_vph_difference", "flow_vph_p"]].isna().all(axis=None)
    corridors = found.corridors.set_index("corridor")
    assert (corridors.loc["north", "exists"] == "base").all()
    assert corridors.loc["north", "vehicles_veh_difference"].isna().all()


def test_changed_links_are_those_that_differ_those_of_one_network_and_those_named() -> None:
    links = [*BASE[:-1], {**BASE[-1], "capacity": 0.4}]
    wider = [{**links[0], "lanes": 2}, *links[1:]]
    base, scenario = run(placed(BASE), 0), run(placed(wider), 0)
    found = by_link(one_pair(base, scenario, Facts(changed_links=("ea",))))
    assert found.index[found["changed"]].tolist() == ["ab", "ea", "bd"]
    _, _, other = example_comparison(3)
    assert other.links.loc[other.links["changed"], "link_id"].tolist() == ["bd", "bc"]


def test_capacities_that_nobody_gave_are_no_change() -> None:
    same = one_pair(run(placed(BASE), 0), run(placed(BASE), 0))
    assert not same.links["changed"].any()


def test_pairs_of_nobody_have_0_vehicles_and_no_times() -> None:
    base = of_drives([Drive("a", "c", 0.0, BY_ROAD), Drive("c", "a", 0.0, [("ca", 0.0, 50.0)])])
    scenario = of_drives([Drive("a", "c", 0.0, BY_ROAD), Drive("a", "b", 0.0, BY_ROAD[:1])])
    od = one_pair(base, scenario).od.set_index(["origin", "destination"])
    assert od.index.tolist() == [("a", "c"), ("c", "a"), ("a", "b")]
    assert od["demanded_veh_difference"].tolist() == [0.0, -5.0, 5.0]
    assert od["travel_time_s_difference"].isna().tolist() == [False, True, True]
    assert np.isnan(od.loc[("c", "a"), "travel_time_s_scenario"])


def test_a_pair_that_comes_up_in_a_later_seed_had_nobody_before() -> None:
    usual = of_drives([Drive("a", "c", 0.0, BY_ROAD)])
    other = of_drives([Drive("a", "c", 0.0, BY_ROAD), Drive("a", "b", 0.0, BY_ROAD[:1])])
    od = compare([(usual, usual), (other, usual)], Facts()).od.set_index(["origin", "destination"])
    row = od.loc[("a", "b")]
    assert row["demanded_veh_base"] == 2.5
    assert row["demanded_veh_difference"] == -2.5
    assert row["demanded_veh_seeds"] == 2
    assert row["travel_time_s_base"] == pytest.approx(50.0)
    assert row["travel_time_s_seeds"] == 0


def test_a_zone_is_the_sum_of_its_pairs_and_the_mean_of_its_vehicles() -> None:
    base = of_drives(
        [
            Drive("a", "c", 0.0, BY_ROAD),
            Drive("a", "b", 0.0, [("ab", 20.0, 80.0)], vehicles=15),
            Drive("c", "a", 0.0, [("ca", 0.0, 50.0)]),
        ]
    )
    zones = one_pair(base, base).zones.set_index(["end", "zone"])
    assert zones["demanded_veh_base"].to_dict() == {
        ("origin", "a"): 20.0,
        ("origin", "c"): 5.0,
        ("destination", "b"): 15.0,
        ("destination", "c"): 5.0,
        ("destination", "a"): 5.0,
    }
    mean = zones.loc[("origin", "a"), "travel_time_s_base"]
    assert mean == pytest.approx((5 * 100 + 15 * 80) / 20)


def test_the_same_runs_differ_by_exactly_nothing() -> None:
    runs = [run(placed(BASE), seed) for seed in range(3)]
    again = [run(placed(BASE), seed) for seed in range(3)]
    found = compare(zip(runs, again, strict=True), Facts())
    for name, quantities in QUANTITIES.items():
        table = getattr(found, name)
        for quantity in quantities:
            for suffix in ("difference", "low", "high"):
                known = table[f"{quantity.name}_{suffix}"].dropna()
                assert len(known)
                assert (known == 0.0).all(), (name, quantity.name, suffix)
            assert (table[f"{quantity.name}_p"].dropna() == 1.0).all()
    assert (found.totals["difference"] == 0.0).all()
    assert (found.totals["p"] == 1.0).all()
    assert found.totals["narrowing"].isna().all()
    assert not found.links["delay_veh_h_significant"].fillna(False).any()
    assert found.trips.loc[0, ["gaining_share", "losing_share"]].tolist() == [0.0, 0.0]
    assert (found.each_trip["change_s"] == 0.0).all()


def test_one_seed_has_differences_without_intervals_and_says_so() -> None:
    _, _, found = example_comparison(1)
    total = found.totals.set_index("figure").loc["total_delay_veh_h"]
    assert total["difference"] != 0
    assert total[["low", "high", "half_width", "narrowing", "p"]].isna().all()
    assert found.links["delay_veh_h_significant"].isna().all()
    assert any("One pair" in remark for remark in found.remarks)


def test_columns_are_those_that_are_promised() -> None:
    _, _, found = example_comparison(3)
    for name, quantities in QUANTITIES.items():
        left_out = ("adjusted_p", "significant") if name == "link_times" else ()
        columns = [f"{q.name}_{suffix}" for q in quantities for suffix in SUFFIXES]
        columns = [column for column in columns if not column.endswith(left_out or ("\0",))]
        assert [c for c in getattr(found, name) if c in columns] == columns, name
    assert found.links["volume_veh_significant"].dtype == "boolean"
    assert found.links["changed"].dtype == bool


def test_pairs_are_taken_in_one_after_the_other() -> None:
    """Whoever reads them from files holds one pair at a time."""
    alive: list[int] = []

    def pairs():
        for seed in range(3):
            alive.append(seed)
            yield run(placed(BASE), seed), run(placed(BASE), seed)
            alive.remove(seed)
            assert not alive

    assert len(compare(pairs(), Facts()).seeds) == 3


def test_runs_of_other_bins_or_durations_and_no_runs_are_refused() -> None:
    base = of_drives([Drive("a", "c", 0.0, BY_ROAD)])
    with pytest.raises(InputError, match="time bins of 60 s, the first of 300 s"):
        one_pair(base, replace(base, bin_s=60.0))
    with pytest.raises(InputError, match="ends at 900 s, the first at 600 s"):
        compare([(base, base), (replace(base, duration_s=900.0), base)], Facts())
    with pytest.raises(InputError, match="no runs to compare"):
        compare([], Facts())


def test_comparing_leaves_the_measures_as_they_were() -> None:
    base = of_drives([Drive("a", "c", 0.0, BY_ROAD)])
    before = {name: getattr(base, name).copy() for name in TABLES}
    one_pair(base, base)
    for name, table in before.items():
        pd.testing.assert_frame_equal(getattr(base, name), table)
