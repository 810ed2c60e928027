"""Speed limits that change during a run: positions, states and figures follow who drives what."""

from __future__ import annotations

import json
import sqlite3
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from newell_link import events_of, network_of, random_link, result_of, trips_of
from small_networks import demand, link, network, simulate
from small_run import CONFIG, run_small, write_small_run

from uxsim_geo.analysis.link_states import link_times
from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.summary import summary
from uxsim_geo.control import LinkCapacity, SpeedLimit
from uxsim_geo.events import EventTable
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

#: s, of the links of `small_run`
FREE_TIMES = {"1-3": 25.0, "3-4": 50.0, "4-2": 25.0}

KM = {"length": 1000.0, "free_speed": 20.0, "lanes": 1, "jam_density": 0.2, "tau": 1.0}


def limits_of(*rows: tuple[float, str, float]) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=["time_s", "link", "speed_limit_m_s"])


def passages_on_a_kilometre(
    enter: list[float], leave: list[float], limits: pd.DataFrame, size: int = 5
) -> Passages:
    """One lane, 20 m/s, w = 5 m/s: the room of a platoon of 5 is 25 m, and 5 s pass it on."""
    road = network_of([{}])
    rows = [(k, 0, e, s) for k, (e, s) in enumerate(zip(enter, leave, strict=True))]
    trips = trips_of([{"vehicles": size} for _ in rows])
    return Passages.of(result_of(events_of(road, rows), trips, Settings(1e4), limits), road)


def passages_of(road: Network, result: Result) -> Passages:
    return Passages.of(result, road)


def states_of(road: Network, result: Result, bin_s: float) -> pd.DataFrame:
    return link_times(result, road, bin_s=bin_s)


def assert_trajectories_are_sound(passages: Passages, step: float = 0.5) -> None:
    """Within the link, forwards, without a jump, no faster than the road, behind the leader.

    Behind: its room, and as much later as that takes.
    """
    end = np.minimum(passages.exit, 1e4)
    for k in range(len(passages.link)):
        road = passages.link[k]
        length, fastest = passages.geometry.length[road], passages.geometry.free_speed[road]
        times = np.append(np.arange(passages.enter[k], end[k], step), end[k])
        x = passages.positions(np.full(len(times), k), times)
        assert x[0] == 0.0
        assert (x >= 0).all()
        assert (x <= length).all()
        assert (np.diff(x) >= -1e-9).all()
        assert (np.diff(x) <= fastest * np.diff(times) + 1e-6).all(), (k, np.diff(x).max())
        if k > passages.first[road]:
            n = passages.vehicles[k - 1]
            earlier = times - n * passages.geometry.time_shift[road]
            leader = passages.positions(np.full(len(times), k - 1), earlier)
            room = n * passages.geometry.space_shift[road]
            left = earlier >= passages.exit[k - 1]
            assert (x <= np.maximum(leader - room, 0.0) + 1e-6)[~left].all()


def test_whoever_enters_under_a_limit_drives_at_it_and_all_others_do_not() -> None:
    """One vehicle at a time on 1 km, every 125 s: 50 s at 20 m/s, 100 s at 10 m/s."""
    road = network([link("in", "1", "2", 10), link("b", "2", "3")])
    limit = SpeedLimit(["b"], 10.0, begin=300, end=600)
    settings = Settings(1200, 1, demand_rounding="truncate", deterministic=True)
    told = demand(("1", "3", 0.0, 1000.0, 8.0))
    result = simulate(road, told, settings, control=[limit])
    states = states_of(road, result, 10.0)
    states = states[states["link_id"] == "b"]
    events = result.events[result.events["link"] == "b"]
    assert len(events) == 8
    expected = np.full(120, np.nan)
    for enter, leave in zip(events["enter_s"], events["exit_s"], strict=True):
        speed = 10.0 if 300 <= enter < 600 else 20.0
        expected[int(enter // 10) : int(np.ceil(leave / 10 - 1e-9))] = speed
    under_way_at_300 = expected[30]
    assert under_way_at_300 == 20.0  # the case is worth the test: one drives on at its old speed
    assert (expected == 10.0).sum() >= 20
    assert states["speed"].to_numpy() == pytest.approx(expected, nan_ok=True, abs=1e-9)
    assert (states["queue"] == 0).all()


def test_a_run_under_a_limit_reports_it(tmp_path: Path) -> None:
    """A platoon every 30 s drives 1 km at 20 m/s, or at 10 m/s who enters from 300 to 600 s."""
    limit = "{links: [3-4], speed_kmh: 36, begin_s: 300, end_s: 600}"
    control = f"  control:\n    speed_limits: [{limit}]\nreport:\n  bin_s: 30"
    config = CONFIG.replace("report:", control)
    write_small_run(tmp_path, config)
    assert run_small(tmp_path) == 0
    folder = tmp_path / "runs/small"
    with sqlite3.connect(folder / "results.gpkg") as database:
        times = pd.read_sql("select * from link_times", database)
        links = pd.read_sql("select * from links", database)
    times["begin_s"] = times.groupby("link_id").cumcount() * 30.0
    assert (times["speed_kmh"].dropna() <= 72 + 1e-9).all()
    assert (times["speed_ratio"].dropna() <= 1 + 1e-9).all()
    nobody = times["density_vpkm"] == 0
    assert (times["speed_kmh"].isna() == nobody).all()
    always = ["flow_vph", "density_vpkm", "entries_veh", "exits_veh", "queue_veh", "queue_m"]
    assert not times[[*always, "delay_veh_s"]].isna().any(axis=None)
    assert not links[["speed_kmh", "speed_ratio", "delay_s", "delay_veh_s"]].isna().any(axis=None)
    road = times[times["link_id"] == "3-4"].set_index("begin_s")["speed_kmh"]
    assert road[60.0:270.0].to_numpy() == pytest.approx(72.0)
    assert road[360.0:570.0].to_numpy() == pytest.approx(36.0)
    events = pd.read_parquet(folder / "events.parquet")
    lost = 5 * (events["exit_s"] - events["enter_s"] - events["link"].map(FREE_TIMES).astype(float))
    delays = links["delay_veh_s"]
    assert delays.to_numpy() == pytest.approx(lost.groupby(events["link"]).sum()[links["link_id"]])
    assert delays[1] >= 5 * 50 * 9
    waited = 5 * (pd.read_parquet(folder / "trips.parquet")[["enter_s", "depart_s"]] @ [1, -1])
    figures = json.loads((folder / "summary.json").read_text())
    assert figures["total_delay_veh_s"] == pytest.approx(delays.sum() + waited.sum())


def test_delay_is_against_the_road_without_control_and_a_queue_against_the_limit() -> None:
    # under 10 m/s a platoon of 5 takes 100 s instead of 50 s, and stands in no queue
    road = network_of([{}])
    limits = limits_of((0.0, "link 0", 10.0))
    result = result_of(
        events_of(road, [(0, 0, 0.0, 100.0)]), trips_of([{}]), Settings(120.0), limits
    )
    states = link_times(result, road, bin_s=60.0)
    assert states["speed"].to_numpy() == pytest.approx([10, 10])
    assert states["delay"].to_numpy() == pytest.approx([5 * 30, 5 * 20])
    assert states["queue"].tolist() == [0, 0]


def test_the_summary_counts_the_way_of_those_under_way_at_their_own_speed() -> None:
    # 40 s after entering at 10 m/s: 400 m, for which the free road takes 20 s
    road = network_of([{}])
    trips = trips_of([{"enter_s": 0.0, "status": "running", "distance_m": 400.0}])
    events = events_of(road, [(0, 0, 0.0, np.nan)])
    limits = limits_of((0.0, "link 0", 10.0))
    result = Result(EventTable(events), trips, Settings(40.0), 0.0, 0, speed_limits=limits)
    assert summary(result, road)["total_delay_veh_s"] == pytest.approx(5 * 20)


def test_a_limit_counts_from_its_moment_and_the_last_one_set_holds() -> None:
    limits = limits_of((10.0, "link 1", 12.0), (30.0, "link 1", 20.0), (20.0, "link 1", 8.0))
    road = network_of([{}, {}])
    enter = [5.0, 10.0, 19.9, 20.0, 30.0]
    rows = [(k, 1, e, np.nan) for k, e in enumerate(enter)] + [(5, 0, 25.0, np.nan)]
    trips = trips_of([{} for _ in rows])
    passages = Passages.of(result_of(events_of(road, rows), trips, Settings(100), limits), road)
    assert passages.free_speed.tolist() == [20.0, 20.0, 12.0, 12.0, 8.0, 20.0]
    assert passages.held_by is not None
    assert passages.held_by.tolist() == [-1, -1, -1, -1, -1, 4]


def test_the_faster_of_a_pair_stays_behind_the_slower() -> None:
    # the first at 10 m/s from 0 s; the second, free at 20 m/s from 10 s, meets its wake where
    # 20 (t - 10) = 10 (t - 5) - 25: 50 m at 12.5 s. At 105 s it feels the exit, 25 m before the
    # end, and drives those at 20 m/s: out at 106.25 s
    limits = limits_of((0.0, "link 0", 10.0), (5.0, "link 0", 20.0))
    passages = passages_on_a_kilometre([0.0, 10.0], [100.0, 106.25], limits)
    times = np.array([12.0, 12.5, 50.0, 100.0, 105.0, 106.0, 106.25])
    found = passages.positions(np.ones(7, np.int64), times)
    assert found == pytest.approx([40, 50, 425, 925, 975, 995, 1000])
    assert_trajectories_are_sound(passages)


def test_the_slower_of_a_pair_does_not_follow_the_faster() -> None:
    limits = limits_of((5.0, "link 0", 10.0))
    passages = passages_on_a_kilometre([0.0, 10.0], [50.0, 110.0], limits)
    times = np.array([25.0, 60.0, 110.0])
    assert passages.positions(np.ones(3, np.int64), times) == pytest.approx([150, 500, 1000])
    assert passages.positions(np.zeros(1, np.int64), times[:1]) == pytest.approx([500])
    assert_trajectories_are_sound(passages)


def test_those_who_leave_a_queue_after_a_limit_was_lifted_close_up_in_time() -> None:
    # entered at 10 m/s, held until 200 s, discharged at 0.8 veh/s, the capacity at 20 m/s: every
    # 6.25 s, of which 1.25 s are for the 25 m to the next place
    limits = limits_of((0.0, "link 0", 10.0), (150.0, "link 0", 20.0))
    leave = [200.0, 206.25, 212.5, 218.75]
    passages = passages_on_a_kilometre([0.0, 10.0, 20.0, 30.0], leave, limits)
    found = passages.positions(np.full(4, 2), np.array([200.0, 210.0, 211.25, 211.9]))
    assert found == pytest.approx([950, 950, 975, 988])
    assert_trajectories_are_sound(passages)


@pytest.mark.parametrize(
    ("speeds", "red_until"),
    [
        ((20.0, 8.0, 20.0), 0.0),
        ((6.0, 20.0, 12.0), 0.0),
        ((6.0, 20.0, 6.0), 0.0),
        ((6.0, 12.0, 20.0), 0.0),
        ((6.0, 12.0, 20.0), 190.0),
        ((8.0, 8.0, 20.0), 150.0),
    ],
)
def test_a_twin_that_steps_the_equation_of_the_paper_agrees(
    speeds: tuple[float, ...], red_until: float
) -> None:
    # X(t + Δt, n) = min(X(t, n) + u_n Δt, X(t, n - Δn) - δΔn), u_n that of the entry; one vehicle
    # a platoon and Δt = 1 s, so that a step is 20 m at most. Exits keep the headway at which each
    # can close up at its own speed: 1 s and 5 m
    enter = np.arange(36) * 3.0
    own = np.repeat(speeds, 12)
    limits = limits_of(*((36.0 * i, "link 0", speed) for i, speed in enumerate(speeds)))
    leave = np.empty(36)
    for k in range(36):
        previous = leave[k - 1] + 1 + 5 / own[k] if k else 0.0
        leave[k] = max(enter[k] + 1000 / own[k], previous, red_until)
    passages = passages_on_a_kilometre(list(enter), list(leave), limits, size=1)
    assert passages.free_speed.tolist() == own.tolist()
    x, seen = np.full(36, -np.inf), 0
    for t in np.arange(0.0, 350.0):
        on_link = np.flatnonzero((enter < t) & (t < leave))
        ahead = np.concatenate(([np.inf], x[:-1]))
        last = np.where(t > leave, 20.0, own)  # beyond the end nothing holds
        driven = np.minimum(x + last, ahead - 5.0)
        held = np.where(t < leave, np.minimum(driven, 1000.0), np.maximum(driven, 1000.0))
        x = np.where(t <= enter, np.where(t == enter, 0.0, -np.inf), held)
        found = passages.positions(on_link, np.full(len(on_link), t))
        assert np.abs(found - x[on_link]).max(initial=0) <= 20.0 + 1e-9, t
        seen += len(on_link)
    assert seen > 1000


@pytest.mark.parametrize("seed", range(4))
def test_the_engine_s_platoons_drive_soundly_through_changing_limits(seed: int) -> None:
    """A narrow exit that opens and shuts, and limits of random height every 60 s."""
    random = np.random.default_rng(seed)
    road = network([link("a", "1", "2", 600.0, lanes=2), link("b", "2", "3", 400.0)])
    heights = [float(height) for height in random.choice([6.0, 10.0, 15.0, 25.0], 16)]
    timetable = tuple((60.0 * i, height) for i, height in enumerate(heights))
    gate = ((0.0, 0.7), (200.0, 0.15), (350.0, 0.8), (600.0, 0.3), (700.0, 0.8))
    result = simulate(
        road,
        demand(("1", "3", 0.0, 800.0, 431.0)),
        Settings(1000.0, 5, seed=seed),
        control=[SpeedLimit(["a", "b"], timetable), LinkCapacity(["b"], exit=gate)],
    )
    passages = passages_of(road, result)
    left = passages.exit < np.inf
    fastest = passages.geometry.length[passages.link] / passages.free_speed
    assert (passages.exit - passages.enter >= fastest - 1e-9)[left].all()
    assert passages.held_by is not None
    assert (passages.held_by >= 0).any()
    assert_trajectories_are_sound(passages)


@pytest.mark.parametrize("seed", range(2))
def test_a_limit_at_the_free_speed_or_elsewhere_changes_no_bit(seed: int) -> None:
    enter, leave, size = random_link(seed, KM)
    road = network_of([{}, {}])
    rows = [(k, 0, e, s) for k, (e, s) in enumerate(zip(enter, leave, strict=True))]
    events, trips = events_of(road, rows), trips_of([{"vehicles": n} for n in size])
    settings = Settings(300.0)
    plain = link_times(result_of(events, trips, settings), road, bin_s=7.0)
    for limits in (limits_of((0.0, "link 1", 3.0)), limits_of((50.0, "link 0", 20.0))):
        limited = link_times(result_of(events, trips, settings, limits), road, bin_s=7.0)
        pd.testing.assert_frame_equal(limited, plain, check_exact=True)


def test_a_limit_on_an_unknown_link_is_refused() -> None:
    with pytest.raises(ValueError, match="elsewhere"):
        passages_on_a_kilometre([0.0], [50.0], limits_of((0.0, "elsewhere", 10.0)))
