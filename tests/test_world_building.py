"""Building a world by code: UXsim's names and defaults, translated, and every slip told at once."""

from __future__ import annotations

import inspect
import math
from typing import Any

import numpy as np
import pytest

from uxsim_geo import InputError, Settings, World

QUIET: dict[str, Any] = {"print_mode": 0, "save_mode": 0, "random_seed": 1}


def two_nodes(**told: Any) -> World:
    world = World(**(QUIET | told))
    world.addNode("a", 0, 0)
    world.addNode("b", 1, 0)
    return world


def test_defaults_are_those_of_uxsim() -> None:
    defaults = {
        name: parameter.default for name, parameter in inspect.signature(World).parameters.items()
    }
    assert list(defaults)[:3] == ["name", "deltan", "reaction_time"]
    expected = {
        "name": "",
        "deltan": 5,
        "reaction_time": 1,
        "tmax": None,
        "duo_update_time": 600,
        "duo_update_weight": 0.5,
        "duo_noise": 0.01,
        "print_mode": 1,
        "save_mode": 1,
        "show_mode": 0,
        "random_seed": None,
    }
    assert expected.items() <= defaults.items()
    world = two_nodes()
    link = world.addLink("l", "a", "b", 1000)
    assert (link.free_flow_speed, link.number_of_lanes, link.merge_priority) == (20, 1, 1)
    assert (link.jam_density, link.capacity_in, link.capacity_out) == (0.2, None, None)
    assert (link.signal_group, link.congestion_pricing) == ((0,), None)


def test_arguments_become_settings() -> None:
    world = World(
        deltan=np.int64(10),  # type: ignore[arg-type]
        reaction_time=1.2,
        tmax=3000,
        duo_update_time=300,
        duo_update_weight=0.25,
        duo_noise=0.02,
        random_seed=7,
        route_choice_update_gradual=True,
        no_cyclic_routing=True,
        hard_deterministic_mode=True,
        demand_rounding="truncate",
        route_choice="logit",
        logit_spread=30.0,
        cpp=True,
        vehicle_logging_timestep_interval=-1,
        print_mode=0,
    )
    world.addNode("a", 0, 0)
    world.addNode("b", 1, 0)
    world.addLink("l", "a", "b", 1000)
    world.finalize_scenario()
    assert world.result.settings == Settings(
        duration=3000,
        platoon_size=10,
        reaction_time=1.2,
        route_update_interval=300,
        route_update_weight=0.25,
        route_noise=0.02,
        seed=7,
        demand_rounding="truncate",
        route_choice="logit",
        logit_spread=30.0,
        no_cycles=True,
        deterministic=True,
        route_update_gradual=True,
    )
    assert (world.DELTAN, world.DELTAT, world.TMAX, world.TSIZE) == (10, 12.0, 3000, 250)


def test_a_seed_is_drawn_once_and_told(capsys: pytest.CaptureFixture[str]) -> None:
    worlds = [World(tmax=10, save_mode=0) for _ in range(2)]
    assert worlds[0].random_seed != worlds[1].random_seed
    seed = worlds[0].random_seed
    worlds[0].addNode("a", 0, 0)
    worlds[0].addNode("b", 0, 0)
    worlds[0].addLink("l", "a", "b", 10)
    worlds[0].finalize_scenario()
    assert worlds[0].random_seed == seed
    assert f"random_seed  {seed}" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("told", "per_lane", "capacity"),
    [
        ({}, 0.2, 2.4),  # 3 lanes of 20·0.2/(1+20·0.2) = 0.8 veh/s
        ({"jam_density": 0.6}, 0.2, 2.4),
        ({"jam_density_per_lane": 0.2}, 0.2, 2.4),
        ({"jam_density": 0.6, "jam_density_per_lane": 0.2}, 0.2, 2.4),
        ({"jam_density": 0.2}, 0.2 / 3, 12 / 7),  # the total of one lane on three
    ],
)
def test_jam_density_is_a_total_or_that_of_a_lane(
    told: dict[str, float], per_lane: float, capacity: float
) -> None:
    link = two_nodes().addLink("l", "a", "b", 1000, number_of_lanes=3, **told)
    assert link.jam_density_per_lane == pytest.approx(per_lane)
    assert link.jam_density == pytest.approx(3 * per_lane)
    assert link.capacity == pytest.approx(capacity)


def test_nodes_and_links_know_one_another() -> None:
    world = two_nodes()
    a, b = world.NODES
    link = world.addLink("l", a, "b", length=1000, attribute="toll road")
    assert (a.outlinks, b.inlinks, a.inlinks) == ({"l": link}, {"l": link}, {})
    assert (link.start_node, link.end_node, link.attribute) == (a, b, "toll road")
    assert world.get_node("a") is a
    assert world.get_link(link) is link
    assert world.get_nearest_node(0.9, 0.1) is b
    assert world.get_nodes_in_area(0, 0, 0.5) == [a]
    assert repr(link) == "<Link l>"


def test_without_tmax_a_run_ends_with_the_half_hour_after_the_next() -> None:
    world = two_nodes()
    world.addLink("l", "a", "b", 1000)
    world.adddemand("a", "b", 0, 2000, 0.1)
    assert (world.TMAX, world.TSIZE) == (None, None)
    world.finalize_scenario()
    assert world.TMAX == 5400
    assert isinstance(world.TMAX, int)
    other = two_nodes()
    other.addLink("l", "a", "b", 1000)
    other.finalize_scenario(tmax=100)
    assert other.TMAX == 100


def faults_of(action: Any) -> list[tuple[Any, Any]]:
    with pytest.raises(InputError) as caught:
        action()
    return [(fault.column, fault.value) for fault in caught.value.faults]


def test_all_slips_of_a_link_at_once() -> None:
    world = two_nodes()
    assert faults_of(
        lambda: world.addLink(
            "l",
            "a",
            "b",
            length=-1,
            free_flow_speed="fast",  # type: ignore[arg-type]
            merge_priority=0,
            number_of_lanes=1.5,  # type: ignore[arg-type]
            jam_density=math.inf,
            signal_group="north",  # type: ignore[arg-type]
            capacity_out=-0.1,
            congestion_pricing=30,  # type: ignore[arg-type]
        )
    ) == [
        ("length", "-1"),
        ("free_flow_speed", "'fast'"),
        ("merge_priority", "0"),
        ("number_of_lanes", 1.5),
        ("jam_density", "inf"),
        ("signal_group", "'north'"),
        ("capacity_out", "-0.1"),
        ("congestion_pricing", "30"),
    ]
    assert world.LINKS == []
    with pytest.raises(InputError, match="contradicts jam_density_per_lane"):
        world.addLink(
            "l", "a", "b", 1, jam_density=0.2, jam_density_per_lane=0.2, number_of_lanes=2
        )


def test_slips_of_nodes_demand_and_world() -> None:
    world = two_nodes(tmax=100)
    assert faults_of(lambda: world.addNode("c", "west", math.nan, signal=[30, 0])) == [  # type: ignore[arg-type]
        ("x", "'west'"),
        ("y", "nan"),
        ("signal", "0"),
    ]
    assert faults_of(lambda: world.addNode("a", 0, 0)) == [("name", "a")]
    assert faults_of(lambda: world.adddemand("a", "a", -5, -5, -2)) == [
        ("t_start", "-5"),
        ("t_end", "-5"),
        ("flow", "-2"),
        ("dest", "a"),
    ]
    with pytest.raises(InputError, match="give either flow in veh/s, or volume"):
        world.adddemand("a", "b", 0, 10)
    with pytest.raises(InputError, match=r"no node of that name.*'z'"):
        world.adddemand("a", "z", 0, 10, 1)
    with pytest.raises(InputError, match="did you mean a"):
        world.get_node("aa")
    assert faults_of(lambda: World(deltan=2.5, duo_update_weight=2, random_seed=-1)) == [  # type: ignore[arg-type]
        ("deltan", 2.5),
        ("duo_update_weight", 2),
        ("random_seed", -1),
    ]
    assert faults_of(lambda: World(route_choice_principle="due")) == [
        ("route_choice_principle", "due")
    ]


def test_what_means_nothing_is_refused_and_not_ignored() -> None:
    with pytest.raises(TypeError, match="no argument delatn; did you mean deltan"):
        World(delatn=5)
    world = two_nodes()
    link = world.addLink("l", "a", "b", 1000)
    with pytest.raises(AttributeError, match="capacity_ou is nothing that it has"):
        link.capacity_ou = 0.5
    with pytest.raises(AttributeError, match="num_vehicles can be read but not set"):
        link.num_vehicles = 3  # type: ignore[misc]
    with pytest.raises(AttributeError, match="length cannot be changed"):
        link.length = 500
    with pytest.raises(AttributeError, match="duo_noise"):
        world.duo_noise = 0.1  # type: ignore[attr-defined]
    with pytest.raises(AttributeError, match="TMAX can be read but not set"):
        world.TMAX = 5  # type: ignore[misc]
    with pytest.raises(AttributeError, match="load_scenario: such files are pickles"):
        world.load_scenario("x")
    with pytest.raises(TypeError, match="object does not support item assignment"):
        world.addNode("s", 0, 0, signal=[30, 60]).signal[0] = 40  # type: ignore[index]
    with pytest.raises(RuntimeError, match="exec_simulation"):
        _ = world.result


def test_a_signal_that_no_phase_of_a_link_fits_is_told_before_the_run() -> None:
    world = two_nodes(tmax=100)
    world.addNode("s", 0, 1, signal=[30, 60])
    world.addLink("as", "a", "s", 100, signal_group=[1, 2])
    world.addLink("bs", "b", "s", 100, signal_group=3)
    assert faults_of(world.exec_simulation) == [
        ("signal_group of link as", 2),
        ("signal_group of link bs", 3),
    ]


def test_after_the_start_nothing_can_be_built() -> None:
    world = two_nodes(tmax=100)
    link = world.addLink("l", "a", "b", 1000, number_of_lanes=2)
    world.exec_simulation(duration_t2=50)
    for action in (
        lambda: world.addNode("c", 0, 0),
        lambda: world.addLink("m", "b", "a", 1000),
        lambda: world.finalize_scenario(tmax=200),
        lambda: setattr(link, "jam_density", 0.3),
        lambda: setattr(link, "signal_group", 1),
        lambda: setattr(link, "number_of_lanes", 3),
        lambda: setattr(link, "free_flow_speed", 25),
        lambda: setattr(world.get_node("b"), "signal", [30, 30]),
        lambda: world.adddemand("a", "b", 40, 60, 1),
        lambda: world.addVehicle("a", "b", 40),
        lambda: world.exec_simulation(until_t=10),
    ):
        with pytest.raises(InputError):
            action()


def test_a_road_that_cannot_be_is_refused_by_the_check_of_networks() -> None:
    world = two_nodes(tmax=100)
    world.addLink("l", "a", "b", 1000, free_flow_speed=200)
    with pytest.raises(InputError, match="free_speed > 150 m/s"):
        world.exec_simulation()
