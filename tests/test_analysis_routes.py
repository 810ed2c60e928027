"""Routes and trips one by one, and where the vehicles are over time."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from drives import Drive, crowded_grid, result_of
from small_networks import link, network

from uxsim_geo.analysis.summary import summary
from uxsim_geo.analysis.trips import free_time_of_the_driven, trip_routes, trip_summary
from uxsim_geo.analysis.vehicles_over_time import vehicles_over_time
from uxsim_geo.errors import InputError
from uxsim_geo.result import Result

NAN = np.nan

#: 50 s, 30 s at half the speed, and a short way past b
ROAD = network(
    [
        link("ab", "a", "b"),
        link("bc", "b", "c", 300.0, free_speed=10.0),
        link("ac", "a", "c", 1500.0),
    ]
)


def three_drives() -> Result:
    """The second overtakes the first by another road; the third is on its second link."""
    drives = [
        Drive("a", "c", 0.0, [("ab", 5.0, 90.0), ("bc", 90.0, 130.0)], free_time_s=75.0),
        Drive("a", "c", 2.0, [("ac", 4.0, 79.0)], vehicles=3, free_time_s=75.0),
        Drive("a", "c", 40.0, [("ab", 50.0, 105.0), ("bc", 105.0, NAN)], "running", rest_m=100.0),
        Drive("a", "c", 110.0, (), "waiting", 2),
        Drive("a", "c", 135.0, (), "aborted", 1),
        Drive("a", "c", 150.0, (), "waiting", 1),
    ]
    return result_of(ROAD, drives, 140.0)


def test_routes_are_in_the_order_of_driving() -> None:
    result = three_drives()
    assert result.events["vehicle"].tolist() == [1, 0, 2, 0, 2]  # as the vehicles left the links
    routes = trip_routes(result)
    assert routes["vehicle"].tolist() == [0, 0, 1, 2, 2]
    assert routes["position"].tolist() == [0, 1, 0, 0, 1]
    assert routes["link"].tolist() == ["ab", "bc", "ac", "ab", "bc"]
    assert routes["enter_s"].tolist() == [5.0, 90.0, 4.0, 50.0, 105.0]
    assert routes["exit_s"].isna().tolist() == [False, False, False, False, True]
    assert trip_routes(result, vehicles=[2, 3])["position"].tolist() == [0, 1]
    assert trip_routes(result, vehicles=[3]).empty


def test_a_trip_in_one_row() -> None:
    table = trip_summary(three_drives(), ROAD)
    nan = pytest.approx(NAN, nan_ok=True)
    assert table["links_entered"].tolist() == [2, 1, 2, 0, 0, 0]
    assert table["end_s"].tolist() == [130.0, 79.0, nan, nan, 135.0, nan]
    assert table["origin_wait_s"].tolist() == [5.0, 2.0, 10.0, 30.0, 0.0, nan]
    assert table["travel_time_so_far_s"].tolist() == [130.0, 77.0, 100.0, 30.0, 0.0, nan]
    # the third has driven ab in 50 s and 100 m of bc in 10 s at free flow
    assert table["delay_so_far_s"].tolist() == [55.0, 2.0, 40.0, 30.0, 0.0, nan]
    assert trip_summary(three_drives(), ROAD, vehicles=[2])["vehicle"].tolist() == [2]


def test_routes_of_a_run_hang_together_and_are_as_long_as_the_trips() -> None:
    of, result = crowded_grid()
    routes, trips, links = trip_routes(result), result.trips, of.links.set_index("link_id")
    came_from = links["to_node_id"].loc[routes["link"]].to_numpy()[:-1]
    goes_from = links["from_node_id"].loc[routes["link"]].to_numpy()
    goes_on = routes["position"].to_numpy()[1:] > 0
    assert (came_from[goes_on] == goes_from[1:][goes_on]).all()
    exits, entries = routes["exit_s"].to_numpy()[:-1], routes["enter_s"].to_numpy()[1:]
    assert (exits[goes_on] == entries[goes_on]).all()
    starts = routes[routes["position"] == 0]
    origin = trips["origin"].astype(str).to_numpy()[starts["vehicle"]]
    assert (goes_from[starts.index] == origin).all()
    completed = (trips["status"] == "completed").to_numpy()
    length = links["length"].loc[routes["link"]].to_numpy(float)
    driven = np.bincount(routes["vehicle"], length, minlength=len(trips))
    assert driven[completed] == pytest.approx(trips["distance_m"].to_numpy()[completed])


def test_trips_of_a_run_add_up_to_its_summary() -> None:
    of, result = crowded_grid()
    table, figures = trip_summary(result, of), summary(result, of)
    for column, total in (
        ("travel_time_so_far_s", "total_travel_time_veh_s"),
        ("delay_so_far_s", "total_delay_veh_s"),
    ):
        assert (table[column] * table["vehicles"]).sum() == pytest.approx(figures[total]), column
    assert table["links_entered"].sum() == len(result.events)


def test_nobody_has_driven_faster_than_at_free_flow() -> None:
    of, result = crowded_grid()
    table = trip_summary(result, of)
    on_links = table["travel_time_so_far_s"] - table["origin_wait_s"]
    slower = on_links - free_time_of_the_driven(result, of)
    assert slower.min() > -1e-9
    assert (slower[result.trips["status"] == "running"] > 1.0).any()  # the case is worth it


def test_vehicles_wait_run_and_arrive() -> None:
    counts = vehicles_over_time(three_drives(), [0.0, 3.0, 45.0, 79.0, 120.0, 140.0])
    assert (counts["demanded"] == 17).all()
    assert counts["departed"].tolist() == [5, 8, 13, 13, 15, 16]
    assert counts["waiting"].tolist() == [5, 8, 5, 0, 2, 2]
    assert counts["running"].tolist() == [0, 0, 8, 10, 10, 5]
    assert counts["completed"].tolist() == [0, 0, 0, 3, 3, 8]
    assert counts["aborted"].tolist() == [0, 0, 0, 0, 0, 1]


def test_vehicles_over_time_sum_to_the_demand() -> None:
    of, result = crowded_grid()
    times = np.append(np.arange(0.0, 800.0, 37.0), 800.0)
    counts = vehicles_over_time(result, times)
    states = counts[["waiting", "running", "completed", "aborted"]]
    assert states.sum(axis=1).tolist() == counts["departed"].tolist()
    assert (states >= 0).all(axis=None)
    figures, last = summary(result, of), counts.iloc[-1]
    for status in ("demanded", "departed", "waiting", "running", "completed", "aborted"):
        assert figures[f"vehicles_{status}"] == last[status], status


def test_an_aborted_trip_among_some_ends_where_it_left_its_last_link() -> None:
    drives = [
        Drive("a", "c", 0.0, [("ab", 0.0, 50.0), ("bc", 50.0, 80.0)]),
        Drive("a", "c", 10.0, [("ab", 10.0, 60.0)], "aborted", 2),
    ]
    counts = vehicles_over_time(result_of(ROAD, drives, 90.0), [59.0, 60.0], vehicles=[1])
    assert counts["running"].tolist() == [2.0, 0.0]
    assert counts["aborted"].tolist() == [0.0, 2.0]


def test_parts_of_the_vehicles_make_up_all_of_them() -> None:
    _, result = crowded_grid()
    times = [50.0, 400.0, 799.0]
    odd = np.arange(len(result.trips)) % 2 == 1
    parts = [vehicles_over_time(result, times, vehicles=np.flatnonzero(x)) for x in (odd, ~odd)]
    both = parts[0].drop(columns="time_s") + parts[1].drop(columns="time_s")
    assert both.equals(vehicles_over_time(result, times).drop(columns="time_s"))


@pytest.mark.parametrize("times", [[], [-1.0], [10.0, 140.5], [NAN]])
def test_moments_outside_of_the_run_are_refused(times: npt.ArrayLike) -> None:
    with pytest.raises(InputError, match="times"):
        vehicles_over_time(three_drives(), times)


def test_every_wrong_vehicle_is_named() -> None:
    with pytest.raises(InputError) as error:
        trip_routes(three_drives(), vehicles=[-2, 1, 6, 9])
    (fault,) = error.value.faults
    assert fault.what == "3 of them are no trips: those are 0 to 5"
    assert fault.value == "-2, 6, 9"
