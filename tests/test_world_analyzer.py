"""Tables and figures of a world, against what can be worked out by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from uxsim_geo import World
from uxsim_geo.errors import InputError


def bottleneck(**told: object) -> World:
    """1 km of road into 1 km that lets 0.4 veh/s in; 0.6 veh/s come for 500 s; a way round."""
    quiet = {"print_mode": 0, "save_mode": 0, "random_seed": 0, "tmax": 1000, "deltan": 1}
    world = World(**(quiet | {"hard_deterministic_mode": True} | told))  # type: ignore[arg-type]
    for place, name in enumerate("abcd"):
        world.addNode(name, place, 0)
    world.addLink("ab", "a", "b", 1000)
    world.addLink("bc", "b", "c", 1000, capacity_in=0.4)
    world.addLink("ad", "a", "d", 600)
    world.addLink("ad long", "a", "d", 900)
    world.adddemand("a", "c", 0, 500, 0.6)
    return world


@pytest.fixture
def done() -> World:
    world = bottleneck()
    world.exec_simulation()
    return world


def test_basic_figures(done: World) -> None:
    row = done.analyzer.basic_to_pandas().iloc[0]
    # number n of 300 departs at n/0.6 and leaves the bottleneck (n - 1)/0.4 after the first
    delays = [(n / 0.4 - n / 0.6) for n in range(300)]
    assert (row["total_trips"], row["completed_trips"]) == (300, 300)
    assert row["average_delay"] == pytest.approx(np.mean(delays), rel=1e-3)
    assert row["average_travel_time"] == pytest.approx(100 + np.mean(delays), rel=1e-3)
    assert row["total_delay"] == pytest.approx(sum(delays), rel=1e-3)
    assert row["average_delay_of_all"] == pytest.approx(row["average_delay"])


def test_delay_of_all_counts_those_on_the_way_and_what_is_done_so_far() -> None:
    world = bottleneck(tmax=2000)
    world.exec_simulation(until_t=400)
    row = world.analyzer.basic_to_pandas().iloc[0]
    assert row["total_trips"] == 240
    assert row["completed_trips"] == pytest.approx(0.4 * 300, abs=2)
    events, trips = world.result.events, world.result.trips
    gone = trips[trips["depart_s"] <= 400]
    assert row["total_travel_time_of_all"] == pytest.approx(
        (gone["arrive_s"].fillna(400) - gone["depart_s"]).sum()
    )
    assert len(events) == 240 + len(events[events["link"] == "bc"])


def test_pairs(done: World) -> None:
    table = done.analyzer.od_to_pandas()
    assert len(table) == 1
    row = table.iloc[0]
    assert (row["orig"], row["dest"], row["total_trips"]) == ("a", "c", 300)
    assert (row["free_travel_time"], row["shortest_distance"]) == (100, 2000)
    assert row["average_distance_traveled_per_veh"] == pytest.approx(2000)
    assert row["stddiv_distance_traveled_per_veh"] == pytest.approx(0, abs=1e-6)
    world = bottleneck()
    world.adddemand("a", "d", 0, 100, 0.1)
    world.exec_simulation()
    other = world.analyzer.od_to_pandas().set_index("dest").loc["d"]
    assert other["shortest_distance"] == 600  # of two links between the same nodes


def test_links(done: World) -> None:
    table = done.analyzer.link_to_pandas().set_index("link")
    assert table.index.tolist() == ["ab", "bc", "ad", "ad long"]
    assert table["traffic_volume"].tolist() == [300, 300, 0, 0]
    assert table["free_travel_time"].tolist() == [50, 50, 30, 45]
    assert table.loc["bc", "delay_ratio"] == pytest.approx(1)
    delays = [(n / 0.4 - n / 0.6) for n in range(300)]
    assert table.loc["ab", "average_travel_time"] == pytest.approx(50 + np.mean(delays), rel=1e-3)
    assert table.loc["ab", "stddiv_travel_time"] == pytest.approx(np.std(delays), rel=1e-2)
    assert np.isnan(table.loc["ad", "average_travel_time"])


def test_trips_and_where_they_were(done: World) -> None:
    trips = done.analyzer.vehicle_trip_to_pandas()
    first = trips.iloc[0]
    assert (first["orig"], first["dest"], first["final_state"]) == ("a", "c", "end")
    assert first["travel_time"] == pytest.approx(100)
    assert first["average_speed"] == pytest.approx(20)
    samples = done.analyzer.vehicles_to_pandas()
    own = samples[(samples["name"] == "0") & (samples["x"] >= 0)]
    assert own["t"].diff().dropna().to_numpy() == pytest.approx(1)
    assert own["x"].to_numpy() == pytest.approx(20 * (own["t"] - first["departure_time"]) % 1000)
    assert own["v"].to_numpy() == pytest.approx(20)
    # as many vehicles at a moment as there are on links
    assert ((samples["t"] == 300) & (samples["x"] >= 0)).sum() == done_at(300)


def done_at(time: float) -> int:
    world = bottleneck()
    world.exec_simulation(until_t=time)
    return int(sum(link.num_vehicles for link in world.LINKS))


def test_the_networks_diagram(done: World) -> None:
    table = done.analyzer.mfd_to_pandas()
    assert table["t"].tolist() == [120.0 * bin_ for bin_ in range(9)]
    events = done.result.events
    time = (events["exit_s"] - events["enter_s"]).sum()
    lane_length = 1000 + 1000 + 600 + 900
    durations = np.append(np.full(8, 120.0), 40.0)
    assert (table["network_k"] * durations).sum() * lane_length == pytest.approx(time)
    assert (table["network_q"] * durations).sum() * lane_length == pytest.approx(300 * 2000)


def test_states_within_links_are_those_of_the_diagram(done: World) -> None:
    table = done.analyzer.link_traffic_state_to_pandas().set_index(["link", "t", "x"])
    # free flow before the queue: 0.6 veh/s at 20 m/s; after the bottleneck 0.4
    assert table.loc[("ab", 240.0, 0.0), "k"] == pytest.approx(0.6 / 20, rel=0.03)
    assert table.loc[("bc", 240.0, 500.0), "k"] == pytest.approx(0.4 / 20, rel=0.03)
    # in the queue flow 0.4 and, w = 1/(τκ) = 5 m/s, density κ - q/w = 0.2 - 0.4/5
    queue = table.loc[("ab", 360.0, 900.0)]
    assert queue["k"] == pytest.approx(0.2 - 0.4 / 5, abs=1 / 100)  # one vehicle on 100 m
    assert queue["q"] == pytest.approx(0.4, rel=0.05)


def test_figures_are_saved_under_names_that_any_system_takes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    world = bottleneck(save_mode=1, name="_x", deltan=5)
    world.exec_simulation()
    look = world.analyzer
    look.time_space_diagram_traj("ad long")
    look.time_space_diagram_density(["ab"])
    look.cumulative_curves(world.get_link("ab"))
    look.plot_vehicle_log(3)
    look.network(300, detailed=1)
    look.network_average()
    look.macroscopic_fundamental_diagram(links=["ab", "bc"], fname="_main")
    path = look.network_fancy(sample_ratio=1, interval=20)
    look.output_data()
    names = {file.name for file in (tmp_path / "out_x").iterdir()}
    pictures = {"tsd_traj_ad_long", "tsd_k_ab", "cumulative_curves_ab", "vehicle_3"}
    pictures |= {"network1_300", "network_average", "mfd_main"}
    tables = {"basic", "od", "mfd", "link", "link_traffic_state", "vehicles"}
    expected = {f"{name}.png" for name in pictures} | {f"data_{name}.csv" for name in tables}
    assert names == expected | {path.name}
    saved = pd.read_csv(tmp_path / "out_x" / "data_link.csv")
    assert saved["traffic_volume"].tolist() == [300, 300, 0, 0]


def test_trajectories_of_a_figure_are_continuous_over_links(done: World) -> None:
    (figure,) = done.analyzer.time_space_diagram_traj_links(["ab", "bc"])
    first, second = figure.axes[0].collections[:2]
    ends = {tuple(np.round(line[-1], 6)) for line in first.get_segments()}
    begins = {tuple(np.round(line[0], 6)) for line in second.get_segments()}
    assert len(begins) == 300
    assert begins == ends


def test_what_is_not_there_is_said(done: World, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(AttributeError, match="no netwrok; did you mean network"):
        _ = done.analyzer.netwrok
    with pytest.raises(TypeError, match="no netowrk_font_size; did you mean network_font_size"):
        done.analyzer.network(0, netowrk_font_size=3)
    with pytest.raises(RuntimeError, match="nothing has been simulated yet"):
        _ = World(print_mode=0).analyzer
    done.analyzer.print_simple_stats()
    assert capsys.readouterr().out == ""
    done.analyzer.print_simple_stats(force_print=True)
    assert "mean delay, completed" in capsys.readouterr().out


def test_red_signals_stand_at_the_ends_of_links_and_diagrams_can_be_cut() -> None:
    world = World(deltan=5, tmax=300, print_mode=0, save_mode=0, random_seed=0)
    world.addNode("a", 0, 0)
    world.addNode("b", 1, 0, signal=[60, 40])
    world.addNode("c", 2, 0)
    world.addLink("ab", "a", "b", 500, signal_group=0)
    world.addLink("bc", "b", "c", 500)
    world.adddemand("a", "c", 0, 200, 0.3)
    world.exec_simulation()
    look = world.analyzer
    for figure in (
        *look.time_space_diagram_traj_links(["ab", "bc"], xlim=(50, 150), ylim=(0, 800)),
        *look.time_space_diagram_state_links(["ab", "bc"], "flow", xlim=(50, 150), ylim=(0, 800)),
    ):
        reds = figure.axes[0].collections[-1].get_segments()
        assert [line.tolist() for line in reds] == [
            [[begin, 500.0], [begin + 40, 500.0]] for begin in (60.0, 160.0, 260.0)
        ]
        assert figure.axes[0].get_xlim() == (50, 150)
        assert figure.axes[0].get_ylim() == (0, 800)
    (without,) = look.time_space_diagram_traj(["ab"], plot_signal=False)
    (with_red,) = look.time_space_diagram_traj(["ab"])
    assert len(with_red.axes[0].collections) == len(without.axes[0].collections) + 1
    with pytest.raises(TypeError, match="xlimit"):
        look.time_space_diagram_traj(["ab"], xlimit=(0, 1))


def test_maps_and_films_of_what_is_not_there_are_refused(done: World, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="column t: must be 1000 or less"):
        done.analyzer.network(5000)
    with pytest.raises(InputError, match="column sample_ratio: must be 1 or less"):
        done.analyzer.network_fancy(sample_ratio=2, file_name=str(tmp_path / "x.gif"))
    assert list(tmp_path.iterdir()) == []
