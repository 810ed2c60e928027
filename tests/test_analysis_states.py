"""Link and network states: identities that must hold, and figures worked out by hand."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from newell_link import events_of, network_of, random_link, result_of, trips_of

from uxsim_geo.analysis.link_states import link_times, link_totals
from uxsim_geo.analysis.network_states import network_states, trip_ends, vehicle_counts
from uxsim_geo.network.network import Network
from uxsim_geo.settings import Settings

LINK = {"length": 400.0, "free_speed": 15.0, "lanes": 2, "jam_density": 0.15, "tau": 1.0}


def two_random_links(duration: float) -> tuple[Network, pd.DataFrame, pd.DataFrame]:
    """Unconnected links with 40 platoons each, cut off at the end of the simulation."""
    row = {name: value for name, value in LINK.items() if name != "tau"}
    network = network_of([row, row])
    rows, sizes = [], []
    for link in (0, 1):
        enter, leave, size = random_link(link, LINK)
        for e, s, n in zip(enter, leave, size, strict=True):
            if e < duration:
                rows.append((len(sizes), link, e, s if s <= duration else np.nan))
                sizes.append({"vehicles": n})
    return network, events_of(network, rows), trips_of(sizes)


@pytest.mark.parametrize("bin_s", [1.0, 7.3, 60.0, 1000.0])
def test_time_distance_and_vehicles_are_conserved(bin_s: float) -> None:
    duration = 200.0
    network, events, trips = two_random_links(duration)
    states = link_times(result_of(events, trips, Settings(duration)), network, bin_s=bin_s)
    vehicles = trips["vehicles"].to_numpy()[events["vehicle"]]
    on_link = events["exit_s"].fillna(duration) - events["enter_s"]
    left = events["exit_s"].notna()
    assert events["exit_s"].isna().any()
    assert states["time"].sum() == pytest.approx((vehicles * on_link).sum())
    assert states["entries"].sum() == vehicles.sum()
    assert states["exits"].sum() == vehicles[left].sum()
    whole = link_times(result_of(events, trips, Settings(duration)), network, bin_s=duration)
    for column in ("distance", "time", "delay", "entries", "exits"):
        by_link = states.groupby("link_id", observed=False)[column].sum()
        assert by_link.to_numpy() == pytest.approx(whole[column].to_numpy()), column


@pytest.mark.parametrize("bin_s", [7.3, 60.0])
def test_flow_is_density_times_speed_and_jam_density_is_the_limit(bin_s: float) -> None:
    network, events, trips = two_random_links(200.0)
    states = link_times(result_of(events, trips, Settings(200.0)), network, bin_s=bin_s)
    moving = states[states["time"] > 0]
    assert moving["flow"].to_numpy() == pytest.approx(moving["density"] * moving["speed"])
    assert (states["density"] <= 2 * 0.15 + 1e-9).all()
    assert (moving["speed"] <= 15 + 1e-9).all()
    assert states.loc[states["time"] == 0, "speed"].isna().all()
    assert (states["delay"] >= 0).all()


def test_a_vehicle_counts_in_the_bins_it_drives_through() -> None:
    # 1 km at 20 m/s from 40 s: 400 m in the first minute, 600 m and the exit in the second
    network = network_of([{}])
    events = events_of(network, [(0, 0, 40.0, 90.0)])
    states = link_times(
        result_of(events, trips_of([{"vehicles": 2}]), Settings(150)), network, bin_s=60.0
    )
    assert states["begin_s"].tolist() == [0, 60, 120]
    assert states["end_s"].tolist() == [60, 120, 150]
    assert states["distance"].to_numpy() == pytest.approx([800, 1200, 0])
    assert states["time"].to_numpy() == pytest.approx([40, 60, 0])
    assert states["entries"].tolist() == [2, 0, 0]
    assert states["exits"].tolist() == [0, 2, 0]
    assert states["flow"].to_numpy() == pytest.approx([800 / 60e3, 1200 / 60e3, 0])
    assert states["experienced_travel_time"].to_numpy()[1] == pytest.approx(50)
    assert states["queue"].tolist() == [0, 0, 0]
    assert states["delay"].to_numpy() == pytest.approx([0, 0, 0])


def test_a_queue_is_those_behind_free_flow_and_reaches_back_by_their_room() -> None:
    # both stand at the end of the bin: heads at 1000 m and 975 m, the last platoon takes 15 m
    network = network_of([{}])
    rows = [(0, 0, 0.0, 100.0), (1, 0, 10.0, 106.25), (2, 0, 45.0, 112.5)]
    trips = trips_of([{}, {"vehicles": 3}, {}])
    states = link_times(
        result_of(events_of(network, rows), trips, Settings(180)), network, bin_s=60.0
    )
    assert states["queue"].tolist() == [5 + 3, 0, 0]
    assert states["queue_length"].tolist() == pytest.approx([40, 0, 0])
    # in the first minute the first loses 10 s at the exit; the second, due at 975 m at 58.75 s,
    # loses 1.25 s; the third, 45 m short of its place in the queue, nothing
    assert states["delay"].to_numpy()[0] == pytest.approx(5 * 10 + 3 * 1.25)
    assert states["delay"].sum() == pytest.approx(5 * 50 + 3 * 46.25 + 5 * 17.5)
    totals = link_totals(states)
    assert totals["queue"].tolist() == [8]
    assert totals["queue_length"].tolist() == pytest.approx([40])


def test_times_on_an_edge_belong_to_the_bin_that_begins_and_the_last_bin_keeps_its_end() -> None:
    network = network_of([{}])
    events = events_of(network, [(0, 0, 60.0, 120.0)])
    states = link_times(result_of(events, trips_of([{}]), Settings(120)), network, bin_s=60.0)
    assert states["entries"].tolist() == [0, 5]
    assert states["exits"].tolist() == [0, 5]
    assert states["time"].tolist() == [0, 300]


def test_no_events_give_empty_links() -> None:
    network = network_of([{}, {}])
    states = link_times(
        result_of(events_of(network, []), trips_of([]), Settings(100)), network, bin_s=60.0
    )
    assert len(states) == 4
    assert (states[["flow", "density", "queue", "delay", "entries"]] == 0).all(axis=None)
    assert link_totals(states)["speed"].isna().all()
    assert network_states(states, network)["speed"].isna().all()


def test_link_totals_are_the_sums_over_the_run() -> None:
    network, events, trips = two_random_links(200.0)
    totals = link_totals(link_times(result_of(events, trips, Settings(200.0)), network, bin_s=7.3))
    whole = link_times(result_of(events, trips, Settings(200.0)), network, bin_s=200.0)
    assert totals["link_id"].tolist() == network.links["link_id"].tolist()
    assert totals["volume"].to_numpy() == pytest.approx(whole["entries"])
    for column in ("speed", "experienced_travel_time", "delay"):
        assert totals[column].to_numpy() == pytest.approx(whole[column].to_numpy())


def test_the_network_averages_over_its_lane_length() -> None:
    # 1 km of one lane carries the vehicles, 500 m of four lanes are empty: 3 km of lanes
    network = network_of([{}, {"length": 500.0, "lanes": 4}])
    events = events_of(network, [(0, 0, 0.0, 50.0)])
    states = link_times(result_of(events, trips_of([{}]), Settings(120)), network, bin_s=60.0)
    mfd = network_states(states, network)
    assert mfd["flow"].to_numpy() == pytest.approx([5 * 1000 / (3000 * 60), 0])
    assert mfd["density"].to_numpy() == pytest.approx([5 * 50 / (3000 * 60), 0])
    assert mfd["speed"].to_numpy()[0] == pytest.approx(20)


def test_vehicles_are_counted_where_they_are() -> None:
    network = network_of([{}])
    events = events_of(network, [(0, 0, 5.0, 55.0), (1, 0, 20.0, np.nan), (2, 0, 30.0, 80.0)])
    trips = trips_of(
        [
            {"depart_s": 0.0, "enter_s": 5.0, "arrive_s": 55.0},
            {"depart_s": 10.0, "enter_s": 20.0, "status": "running", "vehicles": 3},
            {"depart_s": 10.0, "enter_s": 30.0, "status": "aborted", "vehicles": 2},
            {"depart_s": 40.0, "status": "waiting", "vehicles": 1},
            {"depart_s": 40.0, "status": "aborted", "vehicles": 4},
            {"depart_s": 999.0, "status": "waiting", "vehicles": 1},
        ]
    )
    ends = trip_ends(result_of(events, trips, Settings(999.0)))
    counts = vehicle_counts(trips, ends, np.array([0.0, 15.0, 30.0, 55.0, 90.0]))
    assert counts["departed"].tolist() == [5, 10, 10, 15, 15]
    assert counts["waiting"].tolist() == [5, 5, 0, 1, 1]
    assert counts["running"].tolist() == [0, 5, 10, 5, 3]
    assert counts["completed"].tolist() == [0, 0, 0, 5, 5]
    assert counts["aborted"].tolist() == [0, 0, 0, 4, 6]


def test_states_of_some_links_are_those_rows_of_the_whole() -> None:
    network, events, trips = two_random_links(200.0)
    result = result_of(events, trips, Settings(200.0))
    whole = link_times(result, network, bin_s=60.0)
    for link in ("link 0", "link 1"):
        own = whole[whole["link_id"] == link].reset_index(drop=True)
        pd.testing.assert_frame_equal(link_times(result, network, bin_s=60.0, links=link), own)


def test_states_of_some_vehicles_add_up_and_feel_all_others() -> None:
    network, events, trips = two_random_links(200.0)
    result = result_of(events, trips, Settings(200.0))
    some = np.arange(0, len(trips), 3)
    rest = np.setdiff1d(np.arange(len(trips)), some)
    whole, *parts = (
        link_times(result, network, bin_s=45.0, vehicles=rows) for rows in (None, some, rest)
    )
    for column in ("entries", "exits", "distance", "time", "flow", "density", "delay", "queue"):
        both = parts[0][column] + parts[1][column]
        assert both.to_numpy() == pytest.approx(whole[column].to_numpy()), column
    reach = np.maximum(parts[0]["queue_length"], parts[1]["queue_length"])
    assert reach.to_numpy() == pytest.approx(whole["queue_length"].to_numpy())
    assert parts[0]["spillback_share"].equals(whole["spillback_share"])


def test_any_grid_of_times_holds_what_lies_in_it() -> None:
    network, events, trips = two_random_links(200.0)
    result = result_of(events, trips, Settings(200.0))
    fine = link_times(result, network, bin_s=10.0)
    edges = [30.0, 50.0, 140.0]
    table = link_times(result, network, bin_s=edges)
    assert table["begin_s"].tolist() == [30.0, 50.0] * 2
    for begin, end in ((30.0, 50.0), (50.0, 140.0)):
        inside = fine[(fine["begin_s"] >= begin) & (fine["end_s"] <= end)]
        sums = inside.groupby("link_id", observed=False)
        own = table[table["begin_s"] == begin]
        for column in ("distance", "time", "delay", "entries", "exits"):
            assert own[column].to_numpy() == pytest.approx(sums[column].sum().to_numpy()), column
        assert own["queue"].tolist() == sums["queue"].last().tolist()


def test_instantaneous_time_is_length_over_speed_and_volume_over_capacity_a_share() -> None:
    network, events, trips = two_random_links(200.0)
    states = link_times(result_of(events, trips, Settings(200.0)), network, bin_s=40.0)
    expected = np.where(states["speed"].isna(), 400 / 15, 400 / np.maximum(states["speed"], 0.15))
    assert states["instantaneous_travel_time"].to_numpy() == pytest.approx(expected)
    capacity = 2 * 15 * 0.15 / (1 + 15 * 0.15)
    share = states["flow"].to_numpy() / capacity
    assert states["volume_to_capacity"].to_numpy() == pytest.approx(share)
    assert share.max() > 0.4
