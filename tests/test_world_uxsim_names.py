"""What UXsim's own examples ask of a world: copies, vehicles by name, counts, advice."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from uxsim_geo import InputError, World


def faults_of(action: Any) -> list[tuple[Any, Any]]:
    with pytest.raises(InputError) as caught:
        action()
    return [(fault.column, fault.value) for fault in caught.value.faults]


def crossing() -> World:
    world = World(name="first", tmax=900, print_mode=0, save_mode=0, random_seed=3)
    for name, x in (("a", 0), ("b", 1), ("c", 2)):
        world.addNode(name, x, 0, signal=[20, 40] if name == "b" else [0])
    world.addLink("ab", "a", "b", 500, signal_group=[0, 1])
    world.addLink("bc", "b", "c", 500)
    world.adddemand("a", "c", 0, 300, 0.5)
    return world


@pytest.mark.parametrize("copied", [lambda w: w.copy(), lambda w: pickle.loads(pickle.dumps(w))])
def test_a_copy_is_a_world_of_its_own_with_the_same_scenario(
    copied: Callable[[World], World],
) -> None:
    first = crossing()
    second = copied(first)
    second.get_link("bc").capacity_in = 0.2
    assert first.get_link("bc").capacity_in is None
    assert second.get_node("b").inlinks["ab"] is second.get_link("ab")
    assert second.get_node("b").outlinks == {"bc": second.get_link("bc")}
    # links of one world name those of the other, as in UXsim
    assert second.get_link(first.get_link("ab")) is second.get_link("ab")
    third = copied(first)
    for world in (first, second, third):
        world.exec_simulation()
    assert first.result.events.equals(third.result.events)
    assert first.result.trips["arrive_s"].max() < second.result.trips["arrive_s"].max() - 100
    with pytest.raises(TypeError, match="copied before finalize_scenario"):
        copied(first)


def test_a_copy_of_a_large_grid_needs_no_deep_recursion() -> None:
    world = World()
    for number in range(2000):
        world.addNode(str(number), number, 0)
    for number in range(1999):
        world.addLink(f"l{number}", str(number), str(number + 1), 100)
    assert len(world.copy().get_node("1000").inlinks) == 1


def test_demand_after_the_end_is_refused() -> None:
    world = crossing()
    assert faults_of(lambda: world.adddemand("a", "c", 901, 1000, 0.1)) == [("t_start", 901)]
    assert faults_of(lambda: world.addVehicle("a", "c", 901)) == [("departure_time", 901)]
    world.adddemand("a", "c", 800, 1000, 0.1)  # some of it departs in time
    assert faults_of(lambda: world.finalize_scenario(tmax=700)) == [("tmax", "700")]
    world.exec_simulation()
    assert faults_of(lambda: world.adddemand("a", "c", 950, 1000, 0.1)) == [("t_start", 950)]


def test_what_uxsim_has_and_this_has_not_tells_what_there_is_instead() -> None:
    world = crossing()
    for element, name, advice in (
        (world, "load_scenario", "load_scenario_from_csv"),
        (world.get_link("ab"), "u", "free_flow_speed"),
        (world.get_link("ab"), "num_vehicle", "did you mean num_vehicles"),
        (world.get_node("b"), "incoming_vehicles", "num_vehicles_queue"),
        (world.addVehicle("a", "c", 0), "v", "vehicles_to_pandas"),
    ):
        with pytest.raises(AttributeError, match=f"has no {name}.*{advice}"):
            getattr(element, name)
    with pytest.raises(TypeError, match=r"links_prefer: give the whole route"):
        world.addVehicle("a", "c", 0, links_prefer=["ab"])
    with pytest.raises(AttributeError, match="user_function: give one to World"):
        world.addVehicle("a", "c", 0).user_function = print  # type: ignore[attr-defined]
    assert faults_of(lambda: World(tmax="1 h")) == [("tmax", "'1 h'")]  # type: ignore[arg-type]
    assert faults_of(lambda: world.adddemand("a", "c", 0, 9, 1, volume=2)) == [(None, None)]
    assert faults_of(lambda: world.addLink("x", "a", "b", 9, signal_group=None)) == [  # type: ignore[arg-type]
        ("signal_group", "None")
    ]


def test_the_network_is_shown_before_it_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    world = crossing()
    world.save_mode = 1
    texts = {text.get_text() for text in world.show_network(show_id=False).axes[0].texts}
    assert {"a", "b", "c", "ab", "bc"} <= texts
    assert (tmp_path / "outfirst" / "network.png").stat().st_size > 5_000
    assert "ab" not in {t.get_text() for t in world.show_network(network_font_size=0).axes[0].texts}
    with pytest.raises(TypeError, match="no node_sise; did you mean node_size"):
        world.show_network(node_sise=3)
    world.print_scenario_stats()
    assert "3 nodes, 2 links" in capsys.readouterr().out


def test_vehicles_are_there_by_name_and_stay_the_same_objects() -> None:
    world = crossing()
    with pytest.raises(RuntimeError, match="finalize_scenario"):
        _ = world.VEHICLES
    added = world.addVehicle("a", "c", 100, name="mine", user_attribute=7)
    world.finalize_scenario()
    everybody = world.VEHICLES
    assert len(everybody) == 30 + 1
    assert everybody["mine"] is added
    assert added.user_attribute == 7
    assert everybody["4"] is world.VEHICLES["4"]
    departure = everybody["4"].departure_time
    assert 40 <= departure < 50
    assert world.VEHICLES_RUNNING == {}
    assert len(world.VEHICLES_LIVING) == 31
    world.exec_simulation(until_t=120)
    running = world.VEHICLES_RUNNING
    on_links = sum(link.num_vehicles for link in world.LINKS)
    assert on_links == world.DELTAN * len(running) > 0
    assert {vehicle.state for vehicle in running.values()} == {"run"}
    world.exec_simulation()
    assert world.VEHICLES_LIVING == world.VEHICLES_RUNNING == {}
    route, times = world.VEHICLES["4"].traveled_route()
    assert [link.name for link in route] == ["ab", "bc"]
    assert times[0] >= departure
    assert times[-1] == world.VEHICLES["4"].arrival_time
    assert times[-1] == pytest.approx(departure + world.VEHICLES["4"].travel_time)
    assert world.VEHICLES["4"].distance_traveled == 1000


def test_counts_of_a_link_are_those_of_kinematic_waves() -> None:
    world = World(tmax=600, deltan=1, print_mode=0, save_mode=0, random_seed=0)
    for place, name in enumerate("abc"):
        world.addNode(name, place, 0)
    link = world.addLink("ab", "a", "b", 1000, capacity_out=0.4)
    world.addLink("bc", "b", "c", 1000)
    for number in range(100):
        world.addVehicle("a", "c", 2 * number)
    assert link.arrival_count(0) == 0
    assert link.actual_travel_time(0) == 50
    assert link.cum_arrival == [0]
    world.exec_simulation(until_t=150)
    # they enter 2 s apart from 0 s on, and leave 2.5 s apart from 50 s on
    assert link.arrival_count(149) == 75
    assert link.departure_count(149) == 1 + int(99 / 2.5)
    assert link.departure_count(49.9) == 0
    entered, left = np.array(link.cum_arrival), np.array(link.cum_departure)
    assert entered.size == left.size == world.T + 1
    assert entered[-1] - left[-1] == link.num_vehicles
    # number 20 (from 0) enters at 40 s and leaves at 50 + 20·2.5 s
    assert link.actual_travel_time(41) == pytest.approx(100 - 40)
    assert link.instant_travel_time(150) == link.instant_travel_time() > 50
    assert faults_of(lambda: link.instant_travel_time(20)) == [("t", 20)]
    assert isinstance(link.num_vehicles, int)
    assert isinstance(link.num_vehicles_queue, int)


@pytest.mark.parametrize(("penalty", "taken"), [(9, "short"), (11, "long")])
def test_a_penalty_counts_as_seconds_at_all_times(penalty: float, taken: str) -> None:
    world = World(tmax=600, print_mode=0, save_mode=0, random_seed=0, hard_deterministic_mode=True)
    world.addNode("a", 0, 0)
    world.addNode("b", 1, 0)
    world.addLink("long", "a", "b", 1200)
    short = world.addLink("short", "a", "b", 1000)  # 10 s less
    short.route_choice_penalty = penalty
    assert short.get_toll(30) == penalty
    world.adddemand("a", "b", 0, 100, 0.1)
    world.exec_simulation()
    assert set(world.result.events["link"]) == {taken}
    assert faults_of(lambda: setattr(short, "route_choice_penalty", -1)) == [
        ("route_choice_penalty", "-1")
    ]


def test_random_numbers_of_the_script_leave_the_run_alone() -> None:
    one, other = crossing(), crossing()
    assert one.rng.random() == np.random.default_rng(3).random()
    one.exec_simulation()
    other.exec_simulation()
    assert one.result.events.equals(other.result.events)


def test_pictures_say_what_they_cannot_draw() -> None:
    world = crossing()
    world.exec_simulation()
    look = world.analyzer
    assert faults_of(lambda: look.time_space_diagram_traj_links(["bc", "ab"])) == [("link", "ab")]
    assert faults_of(lambda: look.macroscopic_fundamental_diagram(links=[])) == [("links", None)]
    assert faults_of(lambda: look.network("noon")) == [("t", "'noon'")]  # type: ignore[arg-type]
    for name in ("interval", "sample_ratio", "animation_speed_inverse", "speed_coef"):
        asked: dict[str, Any] = {name: 0}
        assert faults_of(lambda asked=asked: look.network_fancy(**asked)) == [(name, "0")]


def test_long_names_of_pictures_stay_apart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    world = World(tmax=100, print_mode=0, name="x")
    for number in range(3):
        world.addNode(str(number), number, 0)
    long = "road " * 40
    world.addLink(f"{long}1", "0", "1", 100)
    world.addLink(f"{long}2", "1", "2", 100)
    world.exec_simulation()
    world.analyzer.time_space_diagram_traj()
    assert len(list((tmp_path / "outx").iterdir())) == 2


def test_titles_of_long_ways_fit_over_their_picture() -> None:
    world = World(tmax=100, print_mode=0, save_mode=0)
    for number in range(13):
        world.addNode(str(number), number, 0)
    names = [f"main road {number}" for number in range(12)]
    for number, name in enumerate(names):
        world.addLink(name, str(number), str(number + 1), 100)
    world.exec_simulation()
    (whole,) = world.analyzer.time_space_diagram_traj_links(names)
    assert whole.axes[0].get_title() == "main road 0 → … → main road 11 (12 links)"
    (part,) = world.analyzer.time_space_diagram_traj_links(names[:2])
    assert part.axes[0].get_title() == "main road 0 → main road 1"


def test_simulate_is_the_engine_s_and_waits_for_it() -> None:
    import inspect

    import uxsim_geo
    from uxsim_geo.engine import simulation

    assert inspect.signature(uxsim_geo.simulate) == inspect.signature(simulation.simulate)
    assert inspect.getdoc(uxsim_geo.simulate) == inspect.getdoc(simulation.simulate)


def test_files_with_lost_demand_add_nothing(tmp_path: Path) -> None:
    paths = [tmp_path / name for name in ("nodes.csv", "links.csv", "demand.csv")]
    paths[0].write_text("name,x,y\na,0,0\nb,1,0\n")
    paths[1].write_text("name,start,end,length\nl,a,b,100\n")
    rows = "a,b,0,100,0.2,\na,b,700,800,0.2,\na,b,0,100,0.2,5\n"
    paths[2].write_text("orig,dest,start_t,end_t,q,volume\n" + rows)
    world = World(tmax=600)
    found = faults_of(lambda: world.load_scenario_from_csv(*paths))
    assert found == [("start_t", "700"), ("volume", 5.0)]
    assert world.NODES == []
    paths[2].write_text("orig,dest,start_t,end_t,q\na,b,0,100,0.2\na,b,700,800,0.2\n")
    world.load_scenario_from_csv(*paths, tmax=900)
    assert world.TMAX == 900
