"""Running a world: pieces, live values, and what may be changed meanwhile."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest

from uxsim_geo import InputError, World

Q = 0.8  # veh/s: 20·0.2 / (1 + 20·1·0.2)


def line(*, links: dict[str, dict[str, Any]] | None = None, **told: Any) -> World:
    """Two links one after the other, 1 km each, with demand at 0.6 veh/s for 1,000 s."""
    quiet = {"print_mode": 0, "save_mode": 0, "random_seed": 3, "tmax": 2000}
    world = World(**(quiet | told))
    for place, name in enumerate("abc"):
        world.addNode(name, place, 0)
    world.addLink("ab", "a", "b", 1000, **(links or {}).get("ab", {}))
    world.addLink("bc", "b", "c", 1000, **(links or {}).get("bc", {}))
    world.adddemand("a", "c", 0, 1000, 0.6)
    return world


def exits(world: World, link: str) -> np.ndarray:
    events = world.result.events
    return np.sort(events.loc[events["link"] == link, "exit_s"].dropna().to_numpy())


def rate(world: World, link: str, begin: float, end: float) -> float:
    """Vehicles that leave a link per second between the first and the last exit of a time."""
    own = exits(world, link)
    own = own[(own >= begin) & (own <= end)]
    return world.DELTAN * (len(own) - 1) / (own[-1] - own[0])


def merge(**told: Any) -> World:
    """Two origins, a node where they merge, one destination; both want more than the half."""
    quiet = {"print_mode": 0, "save_mode": 0, "random_seed": 0, "tmax": 1800, "deltan": 1}
    node = told.pop("node", {})
    groups = told.pop("groups", (0, 0))
    world = World(**(quiet | told))
    world.addNode("west", 0, 0)
    world.addNode("south", 0, 2)
    world.addNode("merge", 1, 1, **node)
    world.addNode("dest", 2, 1)
    world.addLink("w", "west", "merge", 1000, signal_group=groups[0])
    world.addLink("s", "south", "merge", 1000, signal_group=groups[1])
    world.addLink("out", "merge", "dest", 1000)
    for origin in ("west", "south"):
        world.adddemand(origin, "dest", 0, 1800, Q)
    return world


def same(one: World, other: World) -> None:
    pd.testing.assert_frame_equal(one.result.events, other.result.events, check_exact=True)
    pd.testing.assert_frame_equal(one.result.trips, other.result.trips, check_exact=True)


# pieces ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("piece", [5, 12, 100, 333.3])
def test_in_pieces_as_in_one_go_bit_by_bit(piece: float) -> None:
    whole, pieces = (
        merge(node={"signal": [40, 20]}, deltan=5),
        merge(node={"signal": [40, 20]}, deltan=5),
    )
    assert whole.exec_simulation() == 1
    done = [pieces.exec_simulation(duration_t2=piece)]
    while pieces.check_simulation_ongoing():
        _ = pieces.result, pieces.get_link("w").num_vehicles_queue  # looking changes nothing
        done.append(pieces.exec_simulation(duration_t2=piece))
    assert done == [0] * (len(done) - 1) + [1]
    same(whole, pieces)


def test_functions_and_prices_of_every_step_change_nothing_if_they_do_nothing() -> None:
    plain, watched = line(), line(links={"bc": {"congestion_pricing": lambda _: 0.0}})
    called: list[float] = []
    watched.user_function = lambda world: called.append(world.TIME)
    plain.exec_simulation()
    watched.exec_simulation(until_t=700)
    watched.exec_simulation()
    assert called == [5.0 * (step + 1) for step in range(400)]
    same(plain, watched)


def test_time_and_steps_and_the_end() -> None:
    world = line()
    assert (world.T, world.TIME, world.check_simulation_ongoing()) == (0, 0, True)
    world.exec_simulation(until_t=600)
    assert (world.T, world.TIME) == (120, 600)
    assert world.on_time(600)
    assert world.on_time(602)
    assert not world.on_time(605)
    world.exec_simulation(duration_t=100)
    assert world.TIME == 700
    world.exec_simulation(until_t=9999)
    assert (world.TIME, world.check_simulation_ongoing()) == (2000, False)
    assert world.exec_simulation() == 1


# what is live ------------------------------------------------------------------------------------


def test_live_values_are_those_of_the_events() -> None:
    world = line(links={"bc": {"capacity_out": 0.4}})
    first, second = world.LINKS
    assert (second.num_vehicles, second.speed, second.instant_travel_time()) == (0, 20, 50)
    for until in (300, 600, 1000):
        world.exec_simulation(until_t=until)
        events = world.result.events
        for link in (first, second):
            own = events[events["link"] == link.name]
            there = (own["enter_s"] <= until) & ~(own["exit_s"] < until)
            assert link.num_vehicles == 5 * there.sum()
            assert link.density == pytest.approx(link.num_vehicles / 1000)
            assert 0 <= link.num_vehicles_queue <= link.num_vehicles
            assert link.flow == pytest.approx(link.density * link.speed)
            assert link.instant_travel_time() >= 50
    # 0.2 veh/s have stayed behind for some 900 s
    assert second.num_vehicles > 100
    assert second.num_vehicles_queue > 50
    assert second.speed < 10


def test_vehicles_that_cannot_enter_wait_at_their_node() -> None:
    world = line(links={"ab": {"capacity_in": 0.3}})
    world.exec_simulation(until_t=800)
    # 0.6 veh/s want to enter and 0.3 do: within a platoon on both sides
    assert world.get_node("a").num_vehicles_waiting == pytest.approx(0.3 * 800, abs=15)
    assert world.get_node("b").num_vehicles_waiting == 0


# capacities, lanes, speeds -----------------------------------------------------------------------


def test_three_lanes_carry_what_three_lanes_carry() -> None:
    world = World(print_mode=0, save_mode=0, random_seed=0, tmax=1500)
    for place, name in enumerate("abc"):
        world.addNode(name, place, 0)
    for name, start, end in (("ab", "a", "b"), ("bc", "b", "c")):
        world.addLink(name, start, end, 1000, number_of_lanes=3)
    world.adddemand("a", "c", 0, 1500, 3.0)
    world.exec_simulation()
    assert rate(world, "ab", 200, 1400) == pytest.approx(2.4, rel=1e-9)


@pytest.mark.parametrize("size", [1, 5])
@pytest.mark.parametrize(
    ("links", "carried"),
    [
        ({"ab": {"capacity_out": 0.4}}, 0.4),
        ({"bc": {"capacity_in": 0.4}}, 0.4),
        ({"bc": {"capacity_in": 5.0}}, Q),  # a link takes no more than its own capacity
        ({"bc": {"jam_density": 0.05}}, 0.5),  # 20·0.05 / (1 + 20·0.05)
    ],
)
def test_bottlenecks_carry_what_they_say(
    links: dict[str, dict[str, Any]], carried: float, size: int
) -> None:
    world = line(links=links, deltan=size)
    world.adddemand("a", "c", 0, 1000, 0.6)
    world.exec_simulation()
    assert rate(world, "ab", 300, 1000) == pytest.approx(carried, rel=1e-6)


def test_a_node_passes_its_flow_capacity_and_adjusts_it() -> None:
    world = line()
    world.get_node("b").flow_capacity = 0.25
    world.exec_simulation()
    assert rate(world, "ab", 300, 1000) == pytest.approx(0.25, rel=1e-6)
    adjusted = line(links={"bc": {"number_of_lanes": 2}}, adjust_node_capacity=True)
    adjusted.finalize_scenario()
    assert adjusted.get_node("b").flow_capacity == pytest.approx((0.8 + 1.6) / 2)
    assert adjusted.get_node("a").flow_capacity is None


@pytest.mark.parametrize(
    ("change", "before", "after"),
    [
        (lambda world: setattr(world.get_link("bc"), "capacity_in", 0.2), 0.6, 0.2),
        (lambda world: setattr(world.get_link("ab"), "capacity_out", 0.2), 0.6, 0.2),
        (lambda world: setattr(world.get_node("b"), "flow_capacity", 0.2), 0.6, 0.2),
    ],
)
def test_capacities_hold_from_the_moment_they_are_set(
    change: Any, before: float, after: float
) -> None:
    world = line(deltan=1, duo_noise=0, hard_deterministic_mode=True)
    world.exec_simulation(until_t=500)
    change(world)
    world.exec_simulation()
    assert rate(world, "ab", 100, 495) == pytest.approx(before, rel=0.01)
    assert rate(world, "ab", 510, 1500) == pytest.approx(after, rel=1e-6)


def test_a_capacity_can_be_lifted_again() -> None:
    world = line(links={"ab": {"capacity_out": 0.1}}, deltan=1)
    world.exec_simulation(until_t=500)
    world.get_link("ab").capacity_out = None
    world.exec_simulation()
    assert rate(world, "ab", 100, 500) == pytest.approx(0.1, rel=1e-6)
    assert rate(world, "ab", 520, 700) == pytest.approx(Q, rel=1e-6)


def test_a_closed_lane_takes_its_share_of_the_capacity() -> None:
    world = line(links={name: {"number_of_lanes": 2} for name in ("ab", "bc")})
    world.adddemand("a", "c", 0, 1000, 1.4)
    world.exec_simulation(until_t=500)
    world.get_link("ab").number_of_lanes = 1
    world.exec_simulation()
    assert rate(world, "ab", 200, 500) == pytest.approx(1.6, rel=1e-6)
    assert rate(world, "ab", 520, 1500) == pytest.approx(0.8, rel=1e-6)


def test_a_lower_speed_holds_for_those_who_enter_after() -> None:
    # evenly 1.67 s apart, so that the headway of 1.5 s at the lower speed holds nobody up
    world = line(deltan=1, hard_deterministic_mode=True)
    world.exec_simulation(until_t=500)
    world.get_link("bc").free_flow_speed = 10
    world.exec_simulation()
    events = world.result.events
    own = events[events["link"] == "bc"]
    times = own["exit_s"] - own["enter_s"]
    assert times[own["enter_s"] < 500].to_numpy() == pytest.approx(50)
    assert times[own["enter_s"] >= 500].min() == pytest.approx(100)


def test_merge_priority_shares_the_road_before_and_after_it_is_set() -> None:
    world = merge(tmax=3600)
    for origin in ("west", "south"):
        world.adddemand(origin, "dest", 1800, 3600, Q)
    world.get_link("w").merge_priority = 3
    world.exec_simulation(until_t=1800)
    world.get_link("w").merge_priority = 1 / 3
    world.exec_simulation()
    halves = ((200, 1800), (2000, 3600))
    shares = [
        [np.count_nonzero((exits(world, name) >= a) & (exits(world, name) < b)) for name in "ws"]
        for a, b in halves
    ]
    # 1,280 draws of 3 in 4: one standard deviation is 15.5 vehicles
    assert shares[0][0] / sum(shares[0]) == pytest.approx(0.75, abs=0.04)
    assert shares[1][0] / sum(shares[1]) == pytest.approx(0.25, abs=0.04)


# signals -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("offset", [0, 20])
@pytest.mark.parametrize("size", [1, 5])
def test_signals_run_for_as_long_as_they_say(size: int, offset: float) -> None:
    world = merge(node={"signal": [60, 30], "signal_offset": offset}, groups=(0, [1]), deltan=size)
    world.exec_simulation()
    for name, begin, green in (("w", 0, 60), ("s", 60, 30)):
        moments = (exits(world, name) - offset - begin) % 90
        moments = np.where(moments > 90 - 1e-6, 0.0, moments)
        assert moments.max() <= green + 1e-6
        # saturated: the last platoon of a green leaves within one headway of its end
        assert moments.max() >= green - size / Q
        cycles = (1800 - 90 - 90) / 90
        count = np.count_nonzero((exits(world, name) >= 90) & (exits(world, name) < 1710)) * size
        assert count / cycles == pytest.approx(Q * green, abs=size)


def test_links_of_several_groups_and_the_phase_now() -> None:
    world = merge(node={"signal": [20, 30, 40]}, groups=([0, 2], 1))
    node = world.get_node("merge")
    assert (node.cycle_length, node.signal, world.get_node("dest").signal) == (
        90,
        (20, 30, 40),
        (0,),
    )
    world.exec_simulation(until_t=90 + 25)
    assert (node.signal_phase, node.signal_t) == (1, pytest.approx(5))
    world.exec_simulation()
    own = exits(world, "w") % 90
    assert not ((own > 20 + 1e-6) & (own < 50 - 1e-6)).any()


def test_a_script_holds_phases_as_long_as_it_likes() -> None:
    world = merge(node={"signal": [30, 30]}, groups=(0, 1))
    node = world.get_node("merge")
    while world.check_simulation_ongoing():
        node.signal_phase = 0 if world.TIME < 900 else 1
        node.signal_t = 0
        world.exec_simulation(duration_t2=10)
    assert exits(world, "w").max() <= 900 + 1e-6
    assert exits(world, "s").min() >= 900
    assert rate(world, "w", 200, 900) == pytest.approx(Q, rel=1e-6)


def test_a_moved_cycle_goes_on_from_where_it_was_put() -> None:
    world = merge(node={"signal": [60, 30]}, groups=(0, 1))
    world.exec_simulation(until_t=450)  # begins a cycle
    node = world.get_node("merge")
    node.signal_phase = 1
    node.signal_t = 10
    assert (node.signal_phase, node.signal_t) == (1, pytest.approx(10))
    world.exec_simulation()
    own = exits(world, "w")
    own = own[own > 450 + 1e-6]
    phases = (own - 470) % 90  # 20 s of phase 1 are left, then cycles of 60 and 30 s
    phases = np.where(phases > 90 - 1e-6, 0.0, phases)
    assert phases.max() <= 60 + 1e-6


def test_new_durations_in_the_middle_of_a_run() -> None:
    world = merge(node={"signal": [60, 30]}, groups=(0, 1))
    world.exec_simulation(until_t=900)
    world.get_node("merge").signal = [20, 40]
    world.exec_simulation()
    own = exits(world, "w")
    phases = (own[own > 900 + 1e-6] - 900) % 60
    phases = np.where(phases > 60 - 1e-6, 0.0, phases)
    assert phases.max() <= 20 + 1e-6


def test_a_signal_where_no_link_ends_holds_nobody() -> None:
    world = line()
    lone = line(tmax=2000)
    lone.get_node("a").signal = [30, 60]
    lone.exec_simulation(until_t=100)
    assert (lone.get_node("a").signal_phase, lone.get_node("a").signal_t) == (0, pytest.approx(10))
    lone.get_node("a").signal_phase = 1
    lone.exec_simulation()
    world.exec_simulation()
    same(world, lone)


@pytest.mark.parametrize(
    ("name", "value"), [("signal_phase", 2), ("signal_phase", -1), ("signal_t", 60)]
)
def test_phases_that_are_not_there_are_refused(name: str, value: float) -> None:
    world = merge(node={"signal": [60, 30]}, groups=(0, 1))
    world.exec_simulation(until_t=90)
    with pytest.raises(InputError, match=name):
        setattr(world.get_node("merge"), name, value)
    with pytest.raises(InputError, match="there is no signal here"):
        world.get_node("dest").signal_phase = 0


# tolls, demand, vehicles -------------------------------------------------------------------------


def two_ways(**fast: Any) -> World:
    """A way of 100 s and another of 150 s, far below capacity."""
    world = World(print_mode=0, save_mode=0, random_seed=0, tmax=3600, duo_noise=0, deltan=1)
    for place, name in enumerate("abcd"):
        world.addNode(name, place, place % 2)
    world.addLink("fast", "b", "c", 2000, 20, **fast)
    world.addLink("slow", "b", "c", 3000, 20)
    world.addLink("ab", "a", "b", 100)
    world.addLink("cd", "c", "d", 100)
    world.adddemand("a", "d", 0, 3000, 0.1)
    return world


def users(world: World, link: str, begin: float = 0.0, end: float = 3600.0) -> int:
    events = world.result.events
    own = events[
        (events["link"] == link) & (events["enter_s"] >= begin) & (events["enter_s"] < end)
    ]
    return len(own)


@pytest.mark.parametrize(("toll", "taken"), [(49, "fast"), (51, "slow")])
def test_a_toll_counts_as_seconds_of_travel_time(toll: float, taken: str) -> None:
    world = two_ways(congestion_pricing=lambda _: toll)
    world.exec_simulation()
    assert users(world, taken) == 300
    assert world.result.trips["toll"].sum() == pytest.approx(toll * users(world, "fast"))


def test_a_toll_follows_its_function_of_time_and_may_be_set_later() -> None:
    world = two_ways()
    world.exec_simulation(until_t=1200)
    world.get_link("fast").congestion_pricing = lambda t: 500 if t < 2400 else 0
    assert world.get_link("fast").get_toll(2000) == 500
    world.exec_simulation()
    assert users(world, "slow", 0, 1200) == 0
    assert users(world, "slow", 1200, 2400) > 0
    trips = world.result.trips
    assert trips.loc[trips["enter_s"] < 1100, "toll"].sum() == 0
    paid = users(world, "fast", 1200, 2400) * 500
    assert trips["toll"].sum() == pytest.approx(paid)


def test_a_toll_that_is_no_number_stops_the_run_and_says_where() -> None:
    world = two_ways(congestion_pricing=lambda t: "dear" if t >= 100 else 1)
    with pytest.raises(InputError, match=r"link fast, column congestion_pricing\(100\)"):
        world.exec_simulation()


def test_demand_added_during_the_run_departs_and_arrives() -> None:
    world = line()
    world.exec_simulation(until_t=1200)
    world.adddemand("a", "b", 1300, 1400, volume=33)
    world.exec_simulation()
    trips = world.result.trips
    own = trips[trips["destination"] == "b"]
    assert own["vehicles"].sum() == 33
    assert own["depart_s"].between(1300, 1400).all()
    assert (own["arrive_s"] - own["depart_s"]).min() >= 50
    assert trips.loc[trips["destination"] == "c", "vehicles"].sum() == 600


def test_demand_is_kept_or_cut_to_whole_platoons() -> None:
    for rounding, kept in (("conserve", 608), ("truncate", 605)):
        world = line(demand_rounding=rounding)
        world.adddemand("b", "c", 0, 100, volume=8)
        world.exec_simulation()
        assert world.result.trips["vehicles"].sum() == kept


def test_vehicles_depart_when_they_are_told_and_tell_what_they_did() -> None:
    world = line()
    early = world.addVehicle("a", "c", 1500.5, name="early")
    twin = world.addVehicle("a", "c", 1500.5)
    world.exec_simulation(until_t=1000)
    late = world.addVehicle("b", "c", 1600)
    assert (early.state, early.link, late.state, late.travel_time) == ("home", None, "home", None)
    world.exec_simulation(until_t=1520)
    assert (early.state, early.link, twin.state) == ("run", world.get_link("ab"), "run")
    world.exec_simulation()
    assert early.arrival_time == pytest.approx(1600.5)
    assert twin.travel_time == pytest.approx(100 + 5 / Q)  # one headway behind its twin
    assert late.links == [world.get_link("bc")]
    assert late.travel_time == pytest.approx(50)
    assert world.result.trips["vehicles"].sum() == 600 + 15


def test_a_vehicle_drives_the_route_it_is_given() -> None:
    world = two_ways()
    slow = world.addVehicle("a", "d", 3100, route=["ab", "slow", "cd"])
    free = world.addVehicle("a", "d", 3200)
    free.enforce_route([world.get_link("ab"), "fast", "cd"])
    choosing = world.addVehicle("a", "d", 3100)
    world.exec_simulation()
    names = [[link.name for link in vehicle.links] for vehicle in (slow, free, choosing)]
    assert names == [["ab", "slow", "cd"], ["ab", "fast", "cd"], ["ab", "fast", "cd"]]
    with pytest.raises(InputError, match="only before the simulation goes on"):
        free.enforce_route(["ab", "slow", "cd"])


def test_a_route_must_lead_where_the_trip_goes() -> None:
    world = two_ways()
    with pytest.raises(InputError, match="begins at node c, but the route has come to b"):
        world.addVehicle("a", "d", 10, route=["ab", "cd"])
    with pytest.raises(InputError, match="must end at node d, but ends at b"):
        world.addVehicle("a", "d", 10, route=["ab"])
    assert world.addVehicle("a", "d", 10).name == "added-0"


def test_a_vehicle_elsewhere_changes_nobodys_events() -> None:
    alone, accompanied = merge(), merge()
    for world in (alone, accompanied):
        world.addNode("x", 5, 5)
        world.addNode("y", 6, 5)
        world.addLink("xy", "x", "y", 1000)
    accompanied.addVehicle("x", "y", 300)
    alone.exec_simulation()
    accompanied.exec_simulation(until_t=600)
    accompanied.addVehicle("x", "y", 700)
    accompanied.exec_simulation()
    others = accompanied.result.events
    others = others[others["link"] != "xy"].reset_index(drop=True)
    columns = ["link", "enter_s", "exit_s"]
    assert len(accompanied.result.events) == len(others) + 2
    pd.testing.assert_frame_equal(others[columns], alone.result.events[columns], check_exact=True)


def test_user_functions_of_elements_are_called_with_them() -> None:
    world = line(tmax=50)
    seen: list[tuple[str, float]] = []
    world.get_link("ab").user_function = lambda link: seen.append((link.name, link.num_vehicles))
    world.get_node("b").user_function = lambda node: seen.append((node.name, node.W.TIME))
    world.exec_simulation()
    assert [name for name, _ in seen] == ["ab", "b"] * 10
    assert [value for name, value in seen if name == "b"] == [5.0 * (k + 1) for k in range(10)]
    with pytest.raises(InputError, match="user_function"):
        world.get_node("b").user_function = 5  # type: ignore[assignment]


def test_a_function_may_add_demand_and_act_on_what_it_sees() -> None:
    def control(world: World) -> None:
        if world.on_time(100):
            world.adddemand("a", "b", 150, 200, volume=10)
        link = world.get_link("bc")
        link.capacity_in = 0.1 if link.num_vehicles > 20 else None

    world = line(user_function=control)
    world.exec_simulation()
    assert world.result.trips["vehicles"].sum() == 610
    events = world.result.events
    own = events[events["link"] == "bc"]
    there = [
        5 * np.count_nonzero((own["enter_s"] <= t) & ~(own["exit_s"] <= t)) for t in range(2000)
    ]
    # metered at 20; a step of 5 s lets one platoon in before the function sees it
    assert max(there) <= 25 + 5


def test_the_same_seed_gives_the_same_bytes_and_another_does_not() -> None:
    one, two, other = merge(), merge(), merge(random_seed=1)
    for world in (one, two, other):
        world.exec_simulation()
    same(one, two)
    assert not one.result.events.equals(other.result.events)
