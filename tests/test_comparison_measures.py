"""Measures of a run: they add up, corridors and streets are what was driven, files keep them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from compared import BASE, SCENARIO, example_comparison, placed
from compared import run as run_placed
from drives import Drive, crowded_grid, result_of
from small_networks import link, network

from uxsim_geo.analysis.areas import area_pairs
from uxsim_geo.analysis.comparison.comparing import compare
from uxsim_geo.analysis.comparison.comparison import Facts
from uxsim_geo.analysis.comparison.corridors import check_corridors
from uxsim_geo.analysis.comparison.measured import (
    FACTS,
    TABLES,
    Measured,
    read_measured,
    write_measured,
)
from uxsim_geo.analysis.comparison.measuring import MeasureOptions, measure
from uxsim_geo.analysis.comparison.quantities import TOTALS
from uxsim_geo.analysis.comparison.streets import street_paths
from uxsim_geo.errors import InputError

NAN = np.nan


def figure(measured: Measured, name: str) -> float:
    return float(measured.totals.set_index("figure")["value"][name])


@pytest.fixture(scope="module")
def crowded() -> Measured:
    """Some wait and some drive at the end."""
    of, result = crowded_grid()
    return measure(result, of, MeasureOptions(bin_s=200.0))


def test_time_on_links_and_wait_at_home_are_all_the_time_there_is(crowded: Measured) -> None:
    total = figure(crowded, "total_travel_time_veh_h")
    wait = figure(crowded, "total_origin_wait_veh_h")
    assert wait > 0
    assert crowded.links["time_veh_h"].sum() + wait == pytest.approx(total, rel=1e-9)


def test_delays_of_pairs_links_and_trips_add_up(crowded: Measured) -> None:
    total = figure(crowded, "total_delay_veh_h")
    for table in (crowded.od, crowded.zone_pairs):
        assert table["delay_veh_h"].sum() == pytest.approx(total, rel=1e-9)
    trips = crowded.trips
    by_trip = (trips["vehicles"] * trips["delay_s"]).sum() / 3600
    assert by_trip == pytest.approx(total, rel=1e-9)
    times = crowded.link_times.groupby("link_id", sort=False)["delay_veh_h"].sum()
    assert times.to_numpy() == pytest.approx(crowded.links["delay_veh_h"].to_numpy())


def test_vehicles_of_every_fate_are_all_vehicles(crowded: Measured) -> None:
    counts = [
        figure(crowded, f"vehicles_{name}") for name in ("completed", "unfinished", "aborted")
    ]
    assert sum(counts) == figure(crowded, "vehicles_departed")
    assert crowded.trips["vehicles"].sum() == figure(crowded, "vehicles_demanded")
    assert crowded.od["departed_veh"].sum() == figure(crowded, "vehicles_departed")
    assert crowded.totals["figure"].tolist() == [quantity.name for quantity in TOTALS]


def test_differences_add_up_as_what_they_are_of() -> None:
    """Σ links + those of one network alone + wait at home = change of the total travel time."""
    _, _, found = example_comparison(3)
    totals = found.totals.set_index("figure")["difference"]
    sums = found.links["time_veh_h_difference"].sum()
    alone = found.links.set_index("link_id")
    sums += alone.loc["bc", "time_veh_h_scenario"] - alone.loc["bd", "time_veh_h_base"]
    total = totals["total_travel_time_veh_h"]
    assert sums + totals["total_origin_wait_veh_h"] == pytest.approx(total, rel=1e-9)
    for table in (found.od, found.zone_pairs):
        assert table["delay_veh_h_difference"].sum() == pytest.approx(totals["total_delay_veh_h"])
    zones = found.zones.groupby("end")["delay_veh_h_difference"].sum()
    assert zones.to_numpy() == pytest.approx(totals["total_delay_veh_h"])
    # means of means: every platoon arrives, so that the change of the mean is that of the total
    everybody = found.trips.iloc[0]
    hours = everybody["mean_change_s"] * everybody["vehicles"] / 3600
    assert hours == pytest.approx(total)


def test_files_keep_everything(tmp_path: Path) -> None:
    before = run_placed(placed(BASE), 0)
    names = write_measured(before, tmp_path / "measures")
    assert sorted(names) == sorted(path.name for path in (tmp_path / "measures").iterdir())
    after = read_measured(tmp_path / "measures")
    for name in TABLES:
        pd.testing.assert_frame_equal(getattr(after, name), getattr(before, name))
    assert (after.seed, after.duration_s, after.bin_s) == (0, 1800.0, 300.0)
    found = compare([(before, after)], Facts())
    assert (found.totals["difference"] == 0.0).all()


def test_the_same_measures_are_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a", "b"):
        write_measured(run_placed(placed(SCENARIO), 1), tmp_path / name)
    for path in (tmp_path / "a").iterdir():
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes()


@pytest.mark.parametrize("content", [None, "no json", "{}", '{"format": 0, "seed": 1}'])
def test_files_of_another_version_are_refused(tmp_path: Path, content: str | None) -> None:
    write_measured(run_placed(placed(BASE), 0), tmp_path)
    (tmp_path / FACTS).unlink()
    if content is not None:
        (tmp_path / FACTS).write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match="measure the run again"):
        read_measured(tmp_path)


ROAD = network([link("ab", "a", "b"), link("bc", "b", "c"), link("ca", "c", "a")])


def test_a_corridor_is_timed_by_those_who_drove_all_of_it() -> None:
    drives = [
        Drive("a", "c", 0.0, [("ab", 10.0, 60.0), ("bc", 60.0, 130.0)]),
        Drive("a", "c", 0.0, [("ab", 20.0, 80.0), ("bc", 80.0, 140.0)], vehicles=15),
        # left it on the way, came into it on the way, went round, had not left it at the end
        Drive("a", "b", 0.0, [("ab", 40.0, 90.0)]),
        Drive("b", "c", 0.0, [("bc", 0.0, 50.0)]),
        Drive("b", "b", 0.0, [("bc", 120.0, 170.0), ("ca", 170.0, 220.0), ("ab", 220.0, 270.0)]),
        Drive("a", "c", 0.0, [("ab", 250.0, 300.0), ("bc", 300.0, NAN)], "running"),
        # in the second bin, the whole round and on
        Drive("c", "c", 0.0, [("ca", 250.0, 300.0), ("ab", 310.0, 360.0), ("bc", 360.0, 420.0)]),
    ]
    options = MeasureOptions(300.0, {"way": ["ab", "bc"], "gone": ["ab", "bx"]})
    table = measure(result_of(ROAD, drives, 600.0), ROAD, options).corridors
    assert table["corridor"].tolist() == ["way", "way"]
    assert table["vehicles_veh"].tolist() == [20.0, 5.0]
    expected = [(5 * 120.0 + 15 * 120.0) / 20, 110.0]
    assert table["experienced_travel_time_s"].to_numpy() == pytest.approx(expected)


def test_a_corridor_with_a_link_that_nobody_is_on_has_no_speed() -> None:
    drives = [Drive("a", "c", 0.0, [("ab", 0.0, 50.0), ("bc", 50.0, 150.0)])]
    options = MeasureOptions(300.0, {"way": ["ab", "bc"], "all": ["ab", "bc", "ca"]})
    table = measure(result_of(ROAD, drives, 600.0), ROAD, options).corridors
    assert table["instantaneous_travel_time_s"].tolist()[0] == pytest.approx(150.0)
    assert table["instantaneous_travel_time_s"].isna().tolist() == [False, True, True, True]


def test_no_corridors_are_no_rows_with_all_columns() -> None:
    waits = result_of(ROAD, [Drive("a", "c", 0.0, status="waiting")], 600.0)
    table = measure(waits, ROAD, MeasureOptions()).corridors
    assert len(table) == 0
    assert "vehicles_veh" in table


def test_what_is_no_path_is_told_at_once() -> None:
    with pytest.raises(InputError) as error:
        check_corridors({"a": ["ab", "ca"], "b": ["ab", "xy"], "c": []}, ROAD)
    said = [str(fault) for fault in error.value.faults]
    assert len(said) == 3
    assert "does not begin where link ab ends, at node b" in said[0]
    assert "'xy'" in said[1]


def street(*ends: tuple[str, str], length: float = 500.0) -> list[dict[str, object]]:
    return [link(f"{a}{b}", a, b, length, name="High Street") for a, b in ends]


def test_a_street_has_a_path_for_each_way() -> None:
    both = street(("a", "b"), ("b", "c"), ("c", "b"), ("b", "a"))
    other = link("bx", "b", "x", name="Side Road")
    paths = street_paths(network([*both, other]), " high street ")
    assert paths == {
        "High Street, a to c": ["ab", "bc"],
        "High Street, c to a": ["cb", "ba"],
    }
    assert street_paths(network([other]), "High Street") == {}
    assert street_paths(network([link("ab", "a", "b")]), "High Street") == {}


def test_a_street_that_forks_or_goes_round_has_paths_to_there() -> None:
    fork = street(("a", "b"), ("b", "c"), ("b", "d"), ("c", "e"))
    assert street_paths(network(fork), "High Street") == {
        "High Street, a to b": ["ab"],
        "High Street, b to e": ["bc", "ce"],
        "High Street, b to d": ["bd"],
    }
    ring = street(("a", "b"), ("b", "c"), ("c", "a"))
    assert street_paths(network(ring), "High Street") == {"High Street, a to a": ["ab", "bc", "ca"]}
    stub = [*street(("a", "b")), *street(("x", "y"), length=100.0)]
    assert list(street_paths(network(stub), "High Street")) == ["High Street, a to b"]


def test_zones_are_those_asked_for() -> None:
    drives = [Drive("a", "c", 0.0, [("ab", 0.0, 50.0), ("bc", 50.0, 150.0)])]
    options = MeasureOptions(zones={"west": ["a", "b"], "middle": ["b", "c"]})
    found = measure(result_of(ROAD, drives, 600.0), ROAD, options)
    ends = ["origin_zone", "destination_zone"]
    assert found.zone_pairs[ends].to_numpy().tolist() == [["west", "middle"]]
    assert found.trips[ends].to_numpy().tolist() == [["west", "middle"]]


def test_pairs_of_zones_are_those_of_the_analysis() -> None:
    """Where a node is in several zones too: the plain table of areas says the same."""
    of, result = crowded_grid()
    zones = {"left": ["0,0", "1,0", "2,0"], "top": ["0,0", "0,1", "0,2"], "end": ["4,4", "4,3"]}
    found = measure(result, of, MeasureOptions(300.0, zones=zones)).zone_pairs
    expected = area_pairs(result, of, zones)
    for end in ("origin", "destination"):
        assert found[f"{end}_zone"].tolist() == expected[f"{end}_area"].astype(str).tolist()
    names = {
        "demanded_veh": "vehicles_demanded",
        "unfinished_veh": "vehicles_unfinished",
        "travel_time_s": "travel_time_so_far_s",
        "delay_s": "delay_so_far_s",
    }
    for name, other in names.items():
        assert found[name].to_numpy() == pytest.approx(expected[other].to_numpy(), nan_ok=True)


def test_zones_of_unknown_nodes_or_none_are_refused() -> None:
    waits = result_of(ROAD, [Drive("a", "c", 0.0, status="waiting")], 600.0)
    with pytest.raises(InputError) as error:
        measure(waits, ROAD, MeasureOptions(zones={"east": [], "west": ["a", "z"]}))
    assert [fault.column for fault in error.value.faults] == ["east", "west"]
    assert error.value.faults[1].value == "z"
