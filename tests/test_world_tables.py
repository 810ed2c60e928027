"""Tables of a world by UXsim's names: its columns in its order, and what stands in them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

from uxsim_geo import InputError, World

#: of UXsim 1.15.1
COLUMNS = {
    "basic_to_pandas": "total_trips completed_trips total_travel_time average_travel_time "
    "total_delay average_delay",
    "od_to_pandas": "orig dest total_trips completed_trips free_travel_time average_travel_time "
    "stddiv_travel_time shortest_distance average_distance_traveled_per_veh "
    "stddiv_distance_traveled_per_veh",
    "link_to_pandas": "link start_node end_node traffic_volume vehicles_remain free_travel_time "
    "average_travel_time stddiv_travel_time delay_ratio length",
    "link_traffic_state_to_pandas": "link t x delta_t delta_x q k v",
    "link_cumulative_to_pandas": "link t arrival_count departure_count actual_travel_time "
    "instantanious_travel_time",
    "mfd_to_pandas": "t network_k network_q",
    "vehicles_to_pandas": "name dn orig dest t link x s v",
    "log_vehicles_to_pandas": "name dn orig dest t link x s v",
    "vehicle_trip_to_pandas": "name orig dest departure_time final_state travel_time "
    "average_speed distance_traveled",
    "gps_like_log_to_pandas": "name t x y v",
}


@pytest.fixture(scope="module")
def merge() -> World:
    """Two roads of 1 km into one; at the end some are on their way, some wait at home."""
    world = World(deltan=5, tmax=1200, print_mode=0, save_mode=0, random_seed=0)
    world.addNode("orig1", 0, 0)
    world.addNode("orig2", 0, 2000)
    world.addNode("merge", 1000, 1000)
    world.addNode("dest", 2000, 1000)
    world.addLink("link1", "orig1", "merge", length=1000, free_flow_speed=20)
    world.addLink("link2", "orig2", "merge", length=1000, free_flow_speed=20)
    world.addLink("link3", "merge", "dest", length=1000, free_flow_speed=20)
    world.adddemand("orig1", "dest", 0, 1000, 0.45)
    world.adddemand("orig2", "dest", 400, 1000, 0.6)
    world.adddemand("orig1", "dest", 1150, 1200, 1.0)
    world.addVehicle("orig2", "dest", 1190, name="late")
    world.exec_simulation()
    return world


@pytest.mark.parametrize("name", COLUMNS)
def test_every_table_has_the_columns_that_scripts_rely_on(merge: World, name: str) -> None:
    table = getattr(merge.analyzer, name)()
    wanted = COLUMNS[name].split()
    assert [column for column in table.columns if column in wanted] == wanted
    assert len(table) > 0


def test_basic_figures_are_also_attributes(merge: World) -> None:
    look, row = merge.analyzer, merge.analyzer.basic_to_pandas().iloc[0]
    for name in ("total_travel_time", "average_travel_time", "total_delay", "average_delay"):
        assert getattr(look, name) == row[name]
    assert (look.trip_all, look.trip_completed) == (row["total_trips"], row["completed_trips"])
    driven = merge.result.trips[["vehicles", "distance_m"]].prod(axis=1).sum()
    assert look.total_distance_traveled == pytest.approx(driven)
    assert row["total_travel_time"] == pytest.approx(
        row["completed_trips"] * row["average_travel_time"]
    )
    assert row["total_delay_of_all"] > row["total_delay"]


def test_logs_tell_where_every_platoon_is_at_every_step(merge: World) -> None:
    log = merge.analyzer.vehicles_to_pandas()
    trips = merge.result.trips
    steps = np.arange(0, 1200, 5.0)
    for link in ("link1", "link2", "link3"):
        count = log[log["link"] == link].groupby("t")["dn"].sum().reindex(steps, fill_value=0)
        live = merge.get_link(link)
        on = [live.arrival_count(t) - live.departure_count(t) for t in steps]
        # who leaves at a step is no longer there
        assert np.abs(count.to_numpy() - on).max() <= 5
    waiting = log[log["link"] == "waiting_at_origin_node"]
    times = (trips["enter_s"].fillna(1200.0) - trips["depart_s"]).to_numpy()
    assert len(waiting) * 5 == pytest.approx(times.sum(), abs=5 * len(trips))
    assert (waiting[["x", "s", "v"]] == -1).all(axis=None)
    ended = log[log["link"] == "trip_end"]
    assert ended["name"].is_unique
    assert len(ended) == (trips["arrive_s"] <= 1195).sum()
    assert log.groupby("name")["t"].diff().dropna().unique().tolist() == [5.0]


def test_spacing_is_to_the_platoon_ahead_on_the_same_link(merge: World) -> None:
    log = merge.analyzer.vehicles_to_pandas()
    driving = log[log["x"] >= 0]
    for (link, _), own in list(driving.groupby(["link", "t"]))[::50]:
        order = own.sort_values("x", ascending=False, kind="stable")
        expected = np.append(-1.0, -np.diff(order["x"]))
        assert order["s"].to_numpy() == pytest.approx(expected), link
    inside = driving[(driving["x"] > 0) & (driving["s"] >= 0)]
    assert (inside["s"] >= 5 / 0.2 - 1e-6).all()  # the room of a platoon of five


def test_places_lie_on_the_lines_of_the_links(merge: World) -> None:
    log = merge.analyzer.vehicles_to_pandas()
    driving = log[log["x"] >= 0].reset_index(drop=True)
    gps = merge.analyzer.gps_like_log_to_pandas()
    assert gps[["name", "t"]].equals(driving[["name", "t"]])
    starts = {"link1": (0, 0), "link2": (0, 2000), "link3": (1000, 1000)}
    ends = {"link1": (1000, 1000), "link2": (1000, 1000), "link3": (2000, 1000)}
    for axis, column in enumerate(("x", "y")):
        start = driving["link"].map(lambda link, i=axis: starts[link][i])
        end = driving["link"].map(lambda link, i=axis: ends[link][i])
        expected = start + (end - start) * driving["x"] / 1000
        assert gps[column].to_numpy() == pytest.approx(expected.to_numpy(float)), column


def test_states_of_trips_are_named_as_scripts_know_them(merge: World) -> None:
    table = merge.analyzer.vehicle_trip_to_pandas().set_index("name")
    assert set(table["final_state"]) == {"end", "run", "wait"}
    for name, vehicle in merge.VEHICLES.items():
        assert table.loc[name, "final_state"] == vehicle.state, name
    assert "late" in table.index
    assert table.loc[table["final_state"] != "end", "travel_time"].isna().all()


def test_vehicles_that_have_yet_to_depart_are_at_home() -> None:
    world = World(deltan=1, tmax=600, print_mode=0, save_mode=0, random_seed=0)
    world.addNode("a", 0, 0)
    world.addNode("b", 1, 0)
    world.addLink("ab", "a", "b", 1000)
    world.adddemand("a", "b", 0, 300, 0.1)
    world.exec_simulation(until_t=100)
    states = world.analyzer.vehicle_trip_to_pandas()["final_state"]
    assert (states == "home").sum() == 20


def test_cumulative_tables_are_the_live_counts(merge: World) -> None:
    table = merge.analyzer.link_cumulative_to_pandas().set_index(["link", "t"])
    link2 = merge.get_link("link2")
    for time in (0.0, 500.0, 800.0, 1195.0):
        row = table.loc["link2", time]
        assert row["arrival_count"] == link2.arrival_count(time)
        assert row["departure_count"] == link2.departure_count(time)
        assert row["actual_travel_time"] == pytest.approx(link2.actual_travel_time(time))
        assert row["virtual_departure_count"] - row["departure_count"] == row["queue"]
    assert table.loc["link2", 800.0]["instantanious_travel_time"] > 50
    assert table.loc["link2", 0.0]["instantanious_travel_time"] == 50
    assert len(table) == 3 * 240


def test_areas_are_sets_of_nodes(merge: World) -> None:
    areas = [["orig1", merge.get_node("orig2")], ["merge", "dest"]]
    look = merge.analyzer
    links = look.link_to_pandas().set_index("link")
    table = look.area_to_pandas(areas, ["west", "east"]).set_index("area")
    assert table["n_links"].tolist() == [2, 3]
    assert table.loc["east", "vehicles_remain"] == links["vehicles_remain"].sum()
    entered = merge.result.trips["enter_s"].notna()
    assert table.loc["west", "traffic_volume"] == merge.result.trips["vehicles"][entered].sum()
    sums = links["total_delay_of_all"].sum()
    assert table.loc["east", "total_delay_of_all"] == pytest.approx(sums)
    speed = table.loc["east", "average_speed"] * table.loc["east", "total_travel_time"]
    assert speed == pytest.approx(1000 * links["traffic_volume"].sum())
    inner = look.area_to_pandas(areas, border_include=False)
    assert inner["area"].tolist() == ["area 0", "area 1"]
    assert inner["n_links"].tolist() == [0, 1]
    assert np.isnan(inner["average_speed"][0])
    pairs = look.areas2areas_to_pandas(areas, ["west", "east"])
    assert pairs[["origin_area", "destination_area"]].to_numpy().tolist() == [["west", "east"]]
    basic = look.basic_to_pandas().iloc[0]
    for name in ("total_trips", "completed_trips", "average_travel_time", "average_delay_of_all"):
        assert pairs[name][0] == pytest.approx(basic[name]), name
    assert pairs["average_shortest_distance"][0] == 2000


def test_groups_of_vehicles(merge: World) -> None:
    vehicles = list(merge.VEHICLES.values())
    table = merge.analyzer.vehicle_groups_to_pandas([vehicles, ["late"], []], ["all", "one", "no"])
    basic = merge.analyzer.basic_to_pandas().iloc[0]
    everybody = table.iloc[0]
    assert everybody["total_trips"] == len(merge.result.trips)
    assert everybody["completed_vehicles"] == basic["completed_trips"]
    assert everybody["average_travel_time"] == pytest.approx(basic["average_travel_time"])
    ratio = basic["average_travel_time"] / 100
    assert everybody["average_delay_ratio"] == pytest.approx(ratio)
    assert everybody["average_detour_ratio"] == pytest.approx(1)
    assert everybody["average_delay_of_all"] == pytest.approx(basic["average_delay_of_all"])
    assert table["total_trips"].tolist() == [len(merge.result.trips), 1, 0]
    assert table["average_speed"].isna().tolist() == [False, True, True]


@pytest.mark.parametrize(
    "question",
    [
        lambda look: look.area_to_pandas([["orig1"], ["dest"]], ["same", "same"]),
        lambda look: look.area_to_pandas([["nowhere"]]),
        lambda look: look.area_to_pandas([[]]),
        lambda look: look.area_to_pandas(["orig1", "dest"]),
        lambda look: look.areas2areas_to_pandas("orig1"),
        lambda look: look.time_space_diagram_traj([]),
        lambda look: look.time_space_diagram_density([]),
        lambda look: look.cumulative_curves([]),
        lambda look: look.vehicle_groups_to_pandas([["nobody"]]),
        lambda look: look.vehicle_groups_to_pandas([["1"], ["2"]], ["one"]),
    ],
)
def test_what_is_not_there_is_refused(merge: World, question: Any) -> None:
    with pytest.raises(InputError):
        question(merge.analyzer)


def test_diagrams_of_some_links(merge: World) -> None:
    one = merge.analyzer.mfd_to_pandas(links=["link3"])
    events = merge.result.events
    vehicles = merge.result.trips["vehicles"].to_numpy()[events["vehicle"]]
    time = (events["exit_s"].fillna(1200) - events["enter_s"]) * vehicles
    spent = time[events["link"] == "link3"].sum()
    assert (one["network_k"] * 120 * 1000).sum() == pytest.approx(spent)
    assert isinstance(one, pd.DataFrame)


def test_areas_that_are_nodes_are_told_what_areas_are(merge: World) -> None:
    with pytest.raises(InputError, match="areas: must be a list of lists of nodes"):
        merge.analyzer.area_to_pandas(["orig1", "dest"])


def test_areas_without_trips_have_a_table_of_the_same_columns(merge: World) -> None:
    some = merge.analyzer.areas2areas_to_pandas([["orig1"], ["dest"]])
    none = merge.analyzer.areas2areas_to_pandas([["orig1"], ["orig2"]])
    assert len(none) == 0
    assert list(none.columns) == list(some.columns)


def test_counts_are_whole_numbers(merge: World) -> None:
    look = merge.analyzer
    for table, columns in (
        (look.basic_to_pandas(), "total_trips completed_trips"),
        (look.od_to_pandas(), "total_trips completed_trips"),
        (look.link_to_pandas(), "traffic_volume vehicles_remain"),
        (look.link_cumulative_to_pandas(), "arrival_count departure_count"),
        (look.area_to_pandas([["merge"]]), "traffic_volume vehicles_remain"),
        (look.areas2areas_to_pandas([["orig1"], ["dest"]]), "total_trips completed_trips"),
    ):
        for name in columns.split():
            assert pd.api.types.is_integer_dtype(table[name].dtype), name
