"""The engine against what Newell's theory says, worked out by hand."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from small_networks import Q, demand, link, network

from uxsim_geo.engine.simulation import simulate
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

SIZES = (1, 5, 10)


def on_link(result: Result, link_id: str) -> pd.DataFrame:
    return result.events[result.events["link"] == link_id].reset_index(drop=True)


def steady_flow(times: pd.Series, size: int, skip: int = 2) -> float:
    """Flow (veh/s) behind the first few platoons of a stream of full ones."""
    times = times.dropna().to_numpy()[skip:]
    return size * (times.size - 1) / (times[-1] - times[0])


@pytest.mark.parametrize("size", SIZES)
def test_a_free_trip_takes_the_free_flow_time(size: int) -> None:
    net = network([link("a", "1", "2", 730), link("b", "2", "3", 410, free_speed=7.0)])
    result = simulate(
        net, demand(("1", "3", 0, 3600, 40)), Settings(duration=5000, platoon_size=size)
    )
    taken = result.trips["arrive_s"] - result.trips["enter_s"]
    assert taken.to_numpy() == pytest.approx(730 / 20 + 410 / 7, abs=1e-9)
    assert result.trips["free_time_s"].to_numpy() == pytest.approx(730 / 20 + 410 / 7, abs=1e-9)
    assert (result.trips["status"] == "completed").all()
    assert result.trips["distance_m"].to_numpy() == pytest.approx(1140)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize(
    ("narrow", "flow"),
    [
        ({"free_speed": 6.0}, 6 * 0.2 / (1 + 6 * 0.2)),
        ({"capacity": 0.3}, 0.3),
        ({"jam_density": 0.1}, 20 * 0.1 / (1 + 20 * 0.1)),
        ({"length": 13.0, "capacity": 0.5}, 0.5),
    ],
)
def test_a_bottleneck_lets_its_capacity_through(narrow: dict, flow: float, size: int) -> None:
    links = [link("a", "1", "2"), link("b", "2", "3") | narrow, link("c", "3", "4")]
    settings = Settings(duration=2000, platoon_size=size)
    result = simulate(network(links), demand(("1", "4", 0, 1500, 1200)), settings)
    assert steady_flow(on_link(result, "b")["exit_s"], size) == pytest.approx(flow, rel=1e-6)


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("lanes", [1, 2, 3])
def test_lanes_multiply_capacity_and_storage(lanes: int, size: int) -> None:
    links = [
        link("a", "1", "2", lanes=lanes),
        link("b", "2", "3", lanes=lanes),
        link("stop", "3", "4", capacity=1e-4),
    ]
    settings = Settings(duration=1500, platoon_size=size)
    result = simulate(network(links), demand(("1", "4", 0, 1200, 1200.0 * lanes)), settings)
    entries = on_link(result, "a")["enter_s"]
    assert steady_flow(entries[entries < 100], size) == pytest.approx(lanes * Q, rel=1e-6)
    held = on_link(result, "b")["exit_s"].isna().sum() * size
    assert held == pytest.approx(1000 * 0.2 * lanes, abs=size)


@pytest.mark.parametrize("length", [10, 12.5, 17.3, 40, 49, 50, 99, 100])
def test_short_links_keep_time_and_capacity(length: float) -> None:
    short = [link(f"s{i}", f"{i + 2}", f"{i + 3}", length) for i in range(20)]
    links = [link("first", "1", "2"), *short, link("last", "22", "23")]
    settings = Settings(duration=4000, platoon_size=5)
    result = simulate(network(links), demand(("1", "23", 0, 2000, 2000)), settings)
    first = result.trips.iloc[0]
    free = (2000 + 20 * length) / 20
    assert first["arrive_s"] - first["enter_s"] == pytest.approx(free, abs=0.1)
    assert steady_flow(on_link(result, "last")["exit_s"], 5) == pytest.approx(0.8, abs=0.008)


@pytest.mark.parametrize("size", SIZES)
def test_a_queue_spills_back_at_the_speed_of_the_shock(size: int) -> None:
    """Inflow 0.6 against outflow 0.2: the shock runs at (0.6 − 0.2) / (k_queue − k_free)."""
    links = [
        link("meter", "1", "2", 500, capacity=0.6),
        link("b", "2", "3", 500),
        link("narrow", "3", "4", capacity=0.2),
    ]
    settings = Settings(duration=3000, platoon_size=size)
    result = simulate(network(links), demand(("1", "4", 0, 1, 1500)), settings)
    free_density, queue_density = 0.6 / 20, 0.2 - 0.2 / 5  # 5 m/s: the wave speed 1/(τκ)
    shock = (0.6 - 0.2) / (queue_density - free_density)
    entries = on_link(result, "b")["enter_s"].to_numpy()
    slow = entries[1:][np.diff(entries) > 1.1 * size / 0.6]
    begins = entries[0] + 500 / 20  # when the first platoon reaches node 3
    assert slow[0] == pytest.approx(begins + 500 / shock, abs=size / 0.2)
    assert steady_flow(pd.Series(slow), size) == pytest.approx(0.2, rel=1e-6)


@pytest.mark.parametrize("size", SIZES)
def test_a_standing_queue_discharges_at_capacity(size: int) -> None:
    """Everybody wants to leave at once, so that the origin is a queue that discharges."""
    result = simulate(
        network([link("a", "1", "2")]),
        demand(("1", "2", 0, 1, 400)),
        Settings(duration=1000, platoon_size=size),
    )
    assert np.diff(on_link(result, "a")["exit_s"]) == pytest.approx(size / Q)
    assert np.diff(on_link(result, "a")["enter_s"]) == pytest.approx(size / Q)


def test_a_smaller_platoon_takes_its_own_share_of_the_time() -> None:
    """7 vehicles are platoons of 5 and 2: the headway behind each is its own size over Q."""
    net = network([link("a", "1", "2"), link("b", "2", "3")])
    rows = (("1", "2", 0.0, 0.001, 7.0), ("1", "3", 1.0, 1.001, 5.0))
    result = simulate(net, demand(*rows), Settings(duration=200))
    assert result.trips["vehicles"].tolist() == [5, 2, 5]
    entered = result.trips["enter_s"].to_numpy()
    assert np.diff(entered) == pytest.approx([5 / Q, 2 / Q])
    left = on_link(result, "a")["exit_s"].to_numpy()
    assert np.diff(left) == pytest.approx([5 / Q, 2 / Q])


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


@pytest.mark.parametrize("size", [1, 5])
@pytest.mark.parametrize("ratio", [1, 3, 10])
def test_a_merge_shares_by_priority(ratio: int, size: int) -> None:
    links = [
        link("a", "1", "3", merge_priority=float(ratio)),
        link("b", "2", "3"),
        link("c", "3", "4"),
    ]
    settings = Settings(duration=4000, platoon_size=size)
    rows = (("1", "4", 0.0, 3600.0, 3000.0), ("2", "4", 0.0, 3600.0, 3000.0))
    result = simulate(network(links), demand(*rows), settings)
    merged = on_link(result, "c")
    late = merged[merged["enter_s"] > 100]  # both queues stand from then on
    origin = result.trips["origin"].astype(str).to_numpy()[late["vehicle"]]
    share, expected = (origin == "1").mean(), ratio / (ratio + 1)
    deviation = np.sqrt(expected * (1 - expected) / len(late))
    assert share == pytest.approx(expected, abs=3 * deviation)
    assert steady_flow(late["enter_s"].reset_index(drop=True), size) == pytest.approx(Q, rel=1e-6)


@pytest.mark.parametrize("narrow", [np.nan, 0.3])
def test_a_merge_shares_the_vehicles_whatever_the_platoons(narrow: float) -> None:
    """Platoons of 5 against platoons of 2 with priorities 1:1, at capacity and where it spills."""
    ends = range(500)
    links = [link("a", "1", "3"), link("b", "2", "3"), link("c", "3", "4", 300)]
    links += [link("d", "4", "5", 300, capacity=narrow)]
    links += [link(f"to{end}", "5", f"end{end}", 100) for end in ends]
    rows = [("1", "5", 0.0, 50.0, 3000.0), *(("2", f"end{end}", 0.0, 50.0, 2.0) for end in ends)]
    result = simulate(network(links), demand(*rows), Settings(duration=1500))
    merged = on_link(result, "c")
    late = merged.loc[merged["enter_s"] > 150, "vehicle"]
    passed = result.trips.loc[late].groupby("origin", observed=True)["vehicles"].sum()
    lots = len(late)  # each a draw between 5 and 2 vehicles
    assert passed["1"] / passed.sum() == pytest.approx(0.5, abs=3 * 0.5 / np.sqrt(lots))


def test_a_merge_without_a_rival_needs_no_priority() -> None:
    links = [link("a", "1", "3", merge_priority=1e-6), link("b", "2", "3"), link("c", "3", "4")]
    result = simulate(network(links), demand(("1", "4", 0, 100, 200)), Settings(duration=600))
    assert steady_flow(on_link(result, "c")["enter_s"], 5) == pytest.approx(Q, rel=1e-6)


def test_a_diverge_holds_those_behind_a_blocked_platoon() -> None:
    """Half the vehicles want a closed branch; the others wait behind them."""
    links = [
        link("a", "1", "2"),
        link("open", "2", "3"),
        link("shut", "2", "4", 50),
        link("stop", "4", "5", capacity=1e-4),
    ]
    rows = (("1", "3", 0.0, 600.0, 100.0), ("1", "5", 0.0, 600.0, 100.0))
    result = simulate(network(links), demand(*rows), Settings(duration=2000))
    assert len(on_link(result, "shut")) * 5 <= 50 * 0.2 + 5 + 5
    assert len(on_link(result, "open")) < 20
    left = on_link(result, "a").dropna()
    assert left["exit_s"].is_monotonic_increasing
    assert left.sort_values("enter_s")["exit_s"].is_monotonic_increasing


def test_origins_are_first_in_first_out() -> None:
    """The second to leave home has a free road, but the first stands in the door."""
    links = [link("a", "1", "2", 50), link("stop", "2", "3", capacity=1e-4), link("b", "1", "4")]
    rows = (("1", "3", 0.0, 50.0, 100.0), ("1", "4", 60.0, 70.0, 5.0))
    result = simulate(network(links), demand(*rows), Settings(duration=3000))
    last = result.trips.iloc[-1]
    assert last["destination"] == "4"
    assert last["status"] == "waiting"
    assert result.trips["enter_s"].dropna().is_monotonic_increasing


def test_origins_go_before_links_for_the_same_opening() -> None:
    links = [link("a", "1", "2", merge_priority=1e6), link("b", "2", "3")]
    rows = (("1", "3", 0.0, 1.0, 500.0), ("2", "3", 100.0, 101.0, 50.0))
    result = simulate(network(links), demand(*rows), Settings(duration=2000))
    from_two = result.trips[result.trips["origin"] == "2"]
    assert np.diff(from_two["enter_s"]) == pytest.approx(5 / Q)


def test_trips_end_in_mid_network_and_need_only_their_own_exit() -> None:
    """The road behind their node is blocked, which does not concern them."""
    links = [link("a", "1", "2"), link("b", "2", "3", 50), link("stop", "3", "4", capacity=1e-4)]
    rows = (("1", "4", 0.0, 1.0, 15.0), ("1", "2", 200.0, 300.0, 50.0))
    result = simulate(network(links), demand(*rows), Settings(duration=1000))
    to_two = result.trips[result.trips["destination"] == "2"]
    assert (to_two["status"] == "completed").all()
    assert (to_two["arrive_s"] - to_two["enter_s"]).to_numpy() == pytest.approx(50, abs=1e-9)


def test_trips_without_a_way_are_aborted_and_hold_up_nobody() -> None:
    links = [link("a", "1", "2"), link("b", "3", "1")]
    rows = (("1", "3", 0.0, 10.0, 20.0), ("1", "2", 20.0, 30.0, 20.0))
    result = simulate(network(links), demand(*rows), Settings(duration=600))
    assert (result.trips["status"] == ["aborted"] * 4 + ["completed"] * 4).all()
    aborted = result.trips[:4]
    assert aborted["enter_s"].isna().all()
    assert aborted["free_time_s"].isna().all()


def test_nobody_passes_a_node_without_through_traffic() -> None:
    """The way over the centroid is shorter; it may be used to get to the centroid only."""
    links = [
        link("in", "1", "c", 100),
        link("out", "c", "2", 100),
        link("long", "1", "2", 2000),
        link("from", "2", "c", 100),
    ]
    rows = (
        ("1", "2", 0.0, 100.0, 20.0),
        ("1", "c", 0.0, 100.0, 20.0),
        ("c", "2", 0.0, 100.0, 20.0),
    )
    result = simulate(network(links, no_through=["c"]), demand(*rows), Settings(duration=900))
    assert (result.trips["status"] == "completed").all()
    used = {
        pair: set(result.events.loc[result.events["vehicle"].isin(trips["vehicle"]), "link"])
        for pair, trips in result.trips.groupby(["origin", "destination"], observed=True)
    }
    assert used == {("1", "2"): {"long"}, ("1", "c"): {"in"}, ("c", "2"): {"out"}}


def test_the_slower_route_is_taken_only_when_the_fast_one_is_congested() -> None:
    links = [
        link("fast", "1", "2"),
        link("narrow", "2", "3", 500, capacity=0.2),
        link("slow", "1", "3", 3000),
    ]
    light = simulate(network(links), demand(("1", "3", 0, 3600, 360)), Settings(duration=4000))
    assert set(light.events["link"]) == {"fast", "narrow"}
    heavy = simulate(network(links), demand(("1", "3", 0, 3600, 2000)), Settings(duration=4000))
    assert len(on_link(heavy, "slow")) > 50
    first_slow = on_link(heavy, "slow")["enter_s"].min()
    assert first_slow >= 600  # nobody knows before the first update


def test_routes_of_equal_time_are_shared_by_the_noise_alone() -> None:
    links = [
        link(f"{way}{part}", start, end)
        for way in "abc"
        for part, start, end in ((1, "1", way), (2, way, "9"))
    ]
    settings = Settings(duration=40000, route_update_interval=60)
    result = simulate(network(links), demand(("1", "9", 0, 36000, 7200)), settings)
    shares = [len(on_link(result, f"{way}1")) / len(result.trips) for way in "abc"]
    # 600 updates, one of three ways each, remembered for two of them: ± 0.02 of a third
    assert shares == pytest.approx([1 / 3] * 3, abs=4 * np.sqrt(2 / 9 / 600 * 3))


def test_gridlock_is_told_from_a_long_queue() -> None:
    """A ring in which everybody waits for the next link, and a queue before a narrow link."""
    ring = [link(f"r{i}", f"{i}", f"{(i + 1) % 4}", 100) for i in range(4)]
    doors = [link(f"d{i}", f"in{i}", f"{i}", 100) for i in range(4)]
    rows = tuple((f"in{i}", f"{(i + 3) % 4}", 0.0, 100.0, 300.0) for i in range(4))
    locked = simulate(network(ring + doors), demand(*rows), Settings(duration=3000))
    assert locked.locked_vehicles > 0
    queue = [link("a", "1", "2"), link("b", "2", "3", capacity=1e-4)]
    waiting = simulate(network(queue), demand(("1", "3", 0, 10, 500)), Settings(duration=1000))
    assert waiting.locked_vehicles == 0
