"""Links against kinematic wave theory with the triangular diagram, worked out by hand.

A link as `link` makes it has u = 20 m/s, κ = 0.2 veh/m and, at τ = 1 s, waves of w = 5 m/s and
Q = 0.8 veh/s per lane. A lane that carries the flow q holds q/u veh/m where it runs freely and
κ − q/w where it queues.

The engine solves a single stream without discretisation: platoon k passes wherever and whenever
the theory has its first vehicle pass. So times are compared to rounding (EXACT), and what is read
off them to one platoon: Δn in counts, Δn over the flow in times.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from small_networks import (
    Q,
    Row,
    Stream,
    demand,
    entries,
    exits,
    link,
    network,
    on_link,
    run_streams,
)

from uxsim_geo.control import LinkCapacity, NodeCapacity
from uxsim_geo.control.site import Measure
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.settings import Settings

U, W, KAPPA = 20.0, 5.0, 0.2
EXACT = 1e-9  # relative, or s where times are compared

sizes = pytest.mark.parametrize("size", [1, 5, 10])
lane_numbers = pytest.mark.parametrize("lanes", [1, 2, 3])


@sizes
def test_a_free_trip_takes_the_free_flow_time(size: int) -> None:
    net = network([link("a", "1", "2", 730), link("b", "2", "3", 410, free_speed=7.0)])
    result = simulate(
        net, demand(("1", "3", 0, 3600, 43)), Settings(duration=5000, platoon_size=size)
    )
    taken = result.trips["arrive_s"] - result.trips["enter_s"]
    assert taken.to_numpy() == pytest.approx(730 / 20 + 410 / 7, abs=EXACT)
    assert result.trips["free_time_s"].to_numpy() == pytest.approx(730 / 20 + 410 / 7, abs=EXACT)
    assert (result.trips["status"] == "completed").all()
    assert result.trips["distance_m"].to_numpy() == pytest.approx(1140, rel=EXACT)


@sizes
@pytest.mark.parametrize(
    ("road", "reaction_time", "capacity"),
    [
        ({}, 1.0, 0.8),  # 20 · 0.2 / (1 + 20 · 1 · 0.2)
        ({"lanes": 2}, 1.0, 1.6),
        ({"lanes": 3}, 1.0, 2.4),
        ({"free_speed": 10.0}, 1.0, 2 / 3),
        ({"free_speed": 5.0, "lanes": 2}, 1.0, 1.0),
        ({"jam_density": 0.1}, 1.0, 2 / 3),
        ({}, 2.0, 4 / 9),
        ({"capacity": 0.3}, 1.0, 0.3),
        ({"capacity": 0.9, "lanes": 2}, 1.0, 0.9),
        ({"capacity": 5.0}, 1.0, 0.8),  # no more than the diagram's
    ],
)
def test_a_link_takes_and_gives_its_capacity(
    road: Row, reaction_time: float, capacity: float, size: int
) -> None:
    crowd = [("1", "2", 0.0, 300.0, 2 * capacity)]
    result = run_streams(
        [link("a", "1", "2") | road], crowd, 1e5, size, reaction_time=reaction_time
    )
    assert len(exits(result, "a")) == len(result.trips) >= 17
    assert np.diff(entries(result, "a")) == pytest.approx(size / capacity, rel=EXACT)
    assert np.diff(exits(result, "a")) == pytest.approx(size / capacity, rel=EXACT)


#: what the road before and the narrow link are like; flow that arrives and flow that passes
BOTTLENECKS = {
    "speed": ({}, {"free_speed": 6.0}, 0.7, 6 / 11),  # 6 · 0.2 / (1 + 6 · 0.2)
    "capacity": ({}, {"capacity": 0.3}, 0.6, 0.3),
    "jam density": ({}, {"jam_density": 0.05}, 0.8, 0.5),  # 20 · 0.05 / (1 + 20 · 0.05)
    "two lanes to one": ({"lanes": 2}, {}, 1.2, 0.8),
    "three lanes to one": ({"lanes": 3}, {}, 1.5, 0.8),
    "speed on three lanes": ({"lanes": 3}, {"lanes": 3, "free_speed": 5.0}, 2.1, 1.5),
    "capacity on two lanes": ({"lanes": 2}, {"lanes": 2, "capacity": 0.5}, 1.0, 0.5),
    "a short narrow link": ({}, {"length": 13.0, "capacity": 0.5}, 0.7, 0.5),
}


@sizes
@pytest.mark.parametrize("name", BOTTLENECKS)
def test_a_bottleneck_delays_by_its_queue(name: str, size: int) -> None:
    """Behind q − c the delay grows by Δn/c − Δn/q from platoon to platoon, the queue with it."""
    before, narrow, flow, capacity = BOTTLENECKS[name]
    links = [
        link("before", "1", "2", 4000) | before,
        link("narrow", "2", "3") | narrow,
        link("after", "3", "4", lanes=3),
    ]
    result = run_streams(links, [("1", "4", 0.0, 300.0, flow)], 3000, size)
    number = np.arange(len(result.trips))
    first = size / flow + 4000 / U  # when the first platoon reaches the narrow link
    left = exits(result, "before")
    assert left == pytest.approx(first + number * size / capacity, abs=EXACT)
    assert np.diff(exits(result, "narrow")) == pytest.approx(size / capacity, rel=EXACT)
    delay = left - entries(result, "before") - 4000 / U
    assert delay == pytest.approx(number * size * (1 / capacity - 1 / flow), abs=EXACT)
    waiting = size * (number.size - np.sum(left <= 300 + 4000 / U))  # all have arrived there
    assert waiting == pytest.approx((flow - capacity) * 300, abs=size)


#: what lets only so much (veh/s) pass from b2 to the next link: measures of control, or none
LIMITS: dict[str, Callable[[float], list[Measure]]] = {
    "capacity of the next link": lambda _: [],
    "exit": lambda rate: [LinkCapacity(["b2"], exit=rate)],
    "entry": lambda rate: [LinkCapacity(["narrow"], entry=rate)],
    "node": lambda rate: [NodeCapacity(["3"], rate)],
}


def shock_speed(flow: float, capacity: float) -> float:
    """Speed (m/s) at which the end of a queue moves back over one lane: jump of flow / density."""
    return (flow - capacity) / ((KAPPA - capacity / W) - flow / U)


@sizes
@lane_numbers
@pytest.mark.parametrize(("flow", "capacity"), [(0.6, 0.2), (0.8, 0.4), (0.4, 0.1)])
@pytest.mark.parametrize("limit", LIMITS)
def test_a_queue_spills_back_over_three_links(
    limit: str, flow: float, capacity: float, lanes: int, size: int
) -> None:
    """Platoon k passes the point x at the later of free flow and the wave from the narrow place."""
    links = [link(f"b{i}", f"{i}", f"{i + 1}", 500, lanes=lanes) for i in range(3)]
    links += [link("narrow", "3", "4", lanes=lanes)]
    control = LIMITS[limit](capacity * lanes)
    if not control:
        links[-1]["capacity"] = capacity * lanes
    stream = [("0", "4", 0.0, 2000.0, flow * lanes)]
    result = run_streams(links, stream, 3000, size, control=control)
    first = size / (flow * lanes) + 1500 / U
    found_shocks = []
    for place, link_id in enumerate(("b0", "b1", "b2", "narrow")):
        passed = entries(result, link_id)
        back = 1500.0 - 500 * place  # m to the narrow link
        number = np.arange(passed.size)
        free = (number + 1) * size / (flow * lanes) + 500 * place / U
        ahead = number * size - lanes * KAPPA * back  # vehicles through the narrow link by then
        queued = np.where(ahead >= 0, first + ahead / (capacity * lanes) + back / W, 0.0)
        assert passed == pytest.approx(np.maximum(free, queued), abs=1e-6)
        found_shocks.append(passed[passed > free + 1e-6][0])
    wait = size / (capacity * lanes) + 1e-6  # between two platoons in the queue
    speed = shock_speed(flow, capacity)
    for place, found in enumerate(found_shocks[:3]):
        assert found == pytest.approx(first + (1500 - 500 * place) / speed, abs=wait)


@sizes
@lane_numbers
def test_a_full_link_holds_its_jam_density(lanes: int, size: int) -> None:
    """A link of 203 vehicles a lane before a shut one fills with as many whole platoons."""
    links = [
        link("a", "1", "2", lanes=lanes),
        link("full", "2", "3", 1015, lanes=lanes),
        link("stop", "3", "4", lanes=lanes, capacity=1e-4),
    ]
    result = run_streams(links, [("1", "4", 0.0, 1200.0, 1.0 * lanes)], 1500, size)
    held = on_link(result, "full")["exit_s"].isna().sum() * size
    assert held == 203 * lanes // size * size


@sizes
@lane_numbers
def test_a_standing_queue_discharges_at_capacity(lanes: int, size: int) -> None:
    """A crowd at node 2 goes before those on the link; then the starting wave runs back at w."""
    links = [link("a", "1", "2", lanes=lanes), link("b", "2", "3", lanes=lanes)]
    full = Q * lanes
    streams: list[Stream] = [("2", "3", 0.0, 250.0, 2 * full), ("1", "3", 0.0, 500.0, full)]
    result = run_streams(links, streams, 3000, size)
    began = size / (2 * full) + 500.0  # 250 s of twice the capacity need 500 s
    number = np.arange(len(exits(result, "a")))
    assert number.size == 400 * lanes / size
    assert exits(result, "a") == pytest.approx(began + number * size / full, abs=1e-6)
    entered = entries(result, "a")
    stored = 200 * lanes // size
    assert entered[:stored] == pytest.approx((number[:stored] + 1) * size / full, abs=1e-6)
    wave = began + 1000 / W  # reaches the start of the link
    assert entered[stored:] == pytest.approx(wave + number[: -stored or None] * size / full)


@sizes
@lane_numbers
def test_a_moving_queue_discharges_at_capacity(lanes: int, size: int) -> None:
    """Platoons that start at node 2 take every other place on link b, a hundred times.

    They are ready half a headway before the places 22, 24, … 220, counted from the first.
    """
    links = [link("a", "1", "2", 500, lanes=lanes), link("b", "2", "3", lanes=lanes)]
    headway = size / (Q * lanes)
    first = headway + 500 / U
    begin = first + 19.5 * headway
    streams: list[Stream] = [
        ("2", "3", begin, begin + 200 * headway, Q * lanes / 2),
        ("1", "3", 0.0, 400 * headway, Q * lanes),
    ]
    result = run_streams(links, streams, 700 * headway + 500, size)
    places = np.setdiff1d(np.arange(500), np.arange(22, 221, 2))[:400]
    left, entered = exits(result, "a"), entries(result, "a")
    assert left == pytest.approx(first + places * headway, abs=1e-6)
    stored = 100 * lanes // size
    holes = left[:-stored] + 500 / W
    free = (np.arange(stored, 400) + 1) * headway
    assert entered[stored:] == pytest.approx(np.maximum(holes, free), abs=1e-6)
    assert np.sum(holes > free + 1e-6) >= 50  # the queue did reach back to the start


@sizes
@lane_numbers
def test_a_queue_dissolves_after_the_peak(lanes: int, size: int) -> None:
    """600 s of 0.6, then 0.1, before 0.3: it is gone after 600 (0.6 − 0.1) / (0.3 − 0.1) s."""
    peak, after, capacity = 0.6 * lanes, 0.1 * lanes, 0.3 * lanes
    links = [
        link("a", "1", "2", 4000, lanes=lanes),
        link("b", "2", "3", lanes=lanes, capacity=capacity),
    ]
    streams: list[Stream] = [("1", "3", 0.0, 600.0, peak), ("1", "3", 600.0, 3000.0, after)]
    result = run_streams(links, streams, 4000, size)
    at_end = entries(result, "a") + 4000 / U
    delay = exits(result, "a") - at_end
    number = np.arange(delay.size)
    expected = np.maximum(at_end[0] + number * size / capacity - at_end, 0.0)
    assert delay == pytest.approx(expected, abs=1e-6)
    cleared = at_end[(delay < 1e-6) & (number > 0)][0]
    # the platoons stand in rows of Δn: the first leaves, and the next arrives, one row late
    assert cleared - 4000 / U == pytest.approx(600 * 0.5 / 0.2, abs=size / peak + size / after)
    area = 180 * lanes * 1500 / 2  # veh s between the curves of a queue of 180 a lane, 1,500 s
    assert delay.sum() * size == pytest.approx(area, abs=size * 1500)


@sizes
@pytest.mark.parametrize("length", [10, 12.5, 17.3, 40, 49, 50, 99, 100])
def test_short_links_keep_time_and_capacity(length: float, size: int) -> None:
    """Twenty links that hold from 0.2 to 20 platoons each."""
    short = [link(f"s{i}", f"{i + 2}", f"{i + 3}", length) for i in range(20)]
    links = [link("first", "1", "2"), *short, link("last", "22", "23")]
    result = run_streams(links, [("1", "23", 0.0, 100.0 * size, 2 * Q)], 2000.0 + 200 * size, size)
    taken = result.trips["arrive_s"] - result.trips["enter_s"]
    assert taken.to_numpy() == pytest.approx((2000 + 20 * length) / U, abs=1e-6)
    assert np.diff(exits(result, "last")) == pytest.approx(size / Q, rel=EXACT)


def test_a_smaller_platoon_takes_its_own_share_of_the_time() -> None:
    """7 vehicles are platoons of 5 and 2: the headway behind each is its own size over Q."""
    net = network([link("a", "1", "2"), link("b", "2", "3")])
    rows = (("1", "2", 0.0, 0.001, 7.0), ("1", "3", 1.0, 1.001, 5.0))
    result = simulate(net, demand(*rows), Settings(duration=200))
    assert result.trips["vehicles"].tolist() == [5, 2, 5]
    entered = result.trips["enter_s"].to_numpy()
    assert np.diff(entered) == pytest.approx([5 / Q, 2 / Q])
    assert np.diff(exits(result, "a")) == pytest.approx([5 / Q, 2 / Q])


def test_a_smaller_platoon_takes_its_own_share_of_the_road() -> None:
    """A link of 200 vehicles holds as many, however they come."""
    links = [link(f"from{i}", f"{i}", "a") for i in range(40)]
    links += [link("full", "a", "b"), link("stop", "b", "c", 40.0, capacity=1e-6)]
    rows = [(f"{i}", "c", 0.0, 100.0, 7.0 + i % 3) for i in range(40)]
    result = simulate(network(links), demand(*rows), Settings(duration=4000))
    there = on_link(result, "full")
    held = result.trips["vehicles"].to_numpy()[there.loc[there["exit_s"].isna(), "vehicle"]]
    assert set(held) > {2, 5}
    assert 200 - 5 < held.sum() <= 200
