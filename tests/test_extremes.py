"""What is far beyond any road, and still allowed: links, platoons and times at their limits."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from drawn_networks import Extreme, extreme_webs
from hypothesis import example, given, settings
from small_networks import Row, across, demand, exits, grid, link, network, on_link, run_streams
from test_properties import PROPERTIES, every_kind, kinds

from uxsim_geo.control import Phase, Signal
from uxsim_geo.engine.simulation import Simulation, simulate
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

#: s: what rounding may do to times of up to 10⁸ s
HAIR = 1e-6


def test_what_holds_for_every_run_holds_at_the_limits() -> None:
    met = Counter[str]()

    @settings(derandomize=True, deadline=None, max_examples=80)
    @given(extreme_webs())
    @example((*every_kind(10_000), Settings(2e6, 10_000, reaction_time=1.3)))
    def check(drawn: Extreme) -> None:
        links, rows, told = drawn
        result = simulate(network(links), demand(*rows), told)
        for holds in PROPERTIES:
            holds((links, rows), result)
        met.update(kinds((links, rows), result))

    check()
    for kind in ("completed", "running", "waiting", "aborted", "delayed", "full"):
        assert met[kind] > 0, met


def test_links_at_their_limits_take_the_time_of_the_formula() -> None:
    """1 mm, 1,000 km, 0.1 m/s and 100 lanes, each by hand: L/u, and n/Q between platoons."""
    rows = [
        link("millimetre", "0", "1", 1e-3),
        link("far", "1", "2", 1e6, free_speed=100.0),
        link("slow", "2", "3", 10.0, free_speed=0.1),
        link("wide", "3", "4", 1000.0, lanes=100),
    ]
    result = simulate(network(rows), demand(("0", "4", 0.0, 600.0, 50)), Settings(50_000))
    assert (result.trips["status"] == "completed").all()
    free = 1e-3 / 20 + 1e6 / 100 + 10 / 0.1 + 1000 / 20
    assert result.trips["free_time_s"].to_numpy() == pytest.approx(free, abs=HAIR)
    first = result.trips.iloc[0]
    assert first["arrive_s"] - first["enter_s"] == pytest.approx(free, abs=HAIR)
    # 0.1 m/s: Q = 0.1·0.2 / (1 + 0.1·0.2) veh/s, so five vehicles pass in 255 s
    assert np.diff(exits(result, "slow")) == pytest.approx(5 * 1.02 / 0.02, abs=HAIR)
    assert np.diff(exits(result, "wide")) == pytest.approx(5 * 1.02 / 0.02, abs=HAIR)


def test_a_platoon_longer_than_its_links_keeps_time_and_capacity() -> None:
    """1,000 vehicles over ten links of 1 m, which have room for a fifth of one: Q all the same."""
    rows = [link(f"{n}", f"{n}", f"{n + 1}", 1.0) for n in range(10)]
    result = simulate(
        network(rows), demand(("0", "10", 0.0, 100.0, 20_000)), Settings(60_000, 1000)
    )
    gone = exits(result, "9")
    assert gone.size == 20
    # a link that holds one platoon lets the next in when the last has left and its hole come back
    assert np.diff(gone).min() >= 1000 / 0.8 - HAIR
    trips = result.trips
    assert (trips["arrive_s"] - trips["enter_s"]).min() == pytest.approx(10 / 20, abs=HAIR)
    for row in rows:
        passages = on_link(result, row["link_id"])
        assert (passages["enter_s"].to_numpy()[1:] >= passages["exit_s"].to_numpy()[:-1]).all()


def test_ways_longer_than_149_hours_are_found_and_count_as_equally_long() -> None:
    """Costs are whole ms below 2²⁹: what is longer is driven, and takes as long as it takes."""
    rows = [
        link("a", "0", "1", 6e5, free_speed=1.0),  # 167 h
        link("b", "0", "1", 2e6, free_speed=1.0),  # 556 h
        link("on", "1", "2", 1e6, free_speed=1.0),  # 278 h
        link("home", "2", "0", 1.0),
    ]
    pairs = [("0", "1"), ("0", "2"), ("1", "0"), ("2", "1")]
    wanted = demand(*((*pair, 3e6 * k, 3e6 * k + 100, 40.0) for k, pair in enumerate(pairs)))
    result = simulate(network(rows), wanted, Settings(5e7, 40, route_update_interval=1e6))
    trips = result.trips
    assert (trips["status"] == "completed").all()
    lasted = (trips["arrive_s"] - trips["enter_s"]).to_numpy()
    over_either = {6e5, 2e6}
    assert set(lasted[trips["destination"] == "1"].round()) <= {*over_either, 2e6 + 1, 6e5 + 1}
    home = (trips["origin"] == "1").to_numpy()
    assert lasted[home] == pytest.approx(trips["free_time_s"][home].to_numpy(), abs=HAIR)


def irregular_grid(seed: int) -> list[Row]:
    """Streets of which no two are alike, so that no two moves fall on the same moment."""
    random = np.random.default_rng(seed)
    rows = grid(4)
    for row in rows:
        row["length"] = float(random.uniform(50, 900))
        row["free_speed"] = float(random.uniform(6, 22))
        row["lanes"] = int(random.choice([1, 1, 2]))
    return rows


def shifted(offset: float, seed: int) -> Result:
    """A grid full of traffic, all of which begins at an offset; without draws."""
    random = np.random.default_rng([seed, 1])
    everybody = across(4, 50.0, 1200.0)
    table = everybody.table.copy()
    table["start_s"] += offset + random.uniform(0, 50, len(table))
    table["end_s"] += offset + random.uniform(0, 200, len(table))
    told = Settings(offset + 4000.0, deterministic=True, route_update_interval=500.0)
    return simulate(network(irregular_grid(seed)), replace(everybody, table=table), told)


@pytest.mark.parametrize("seed", range(3))
def test_a_million_seconds_later_all_is_the_same(seed: int) -> None:
    at_once, later = shifted(0.0, seed), shifted(1e6, seed)
    assert (later.trips["status"] == at_once.trips["status"]).all()
    moves = [
        one.events.sort_values(["vehicle", "enter_s"], kind="stable") for one in (at_once, later)
    ]
    assert (moves[0]["link"].to_numpy() == moves[1]["link"].to_numpy()).all()
    for column in ("enter_s", "exit_s"):
        difference = moves[1][column].to_numpy() - 1e6 - moves[0][column].to_numpy()
        assert np.nanmax(np.abs(difference)) < HAIR
        assert len(difference) > 2000
    lasted = (at_once.trips["arrive_s"] - at_once.trips["enter_s"]) / at_once.trips["free_time_s"]
    assert lasted.max() > 3  # the case is worth the test: there are queues


def test_the_tenth_day_is_as_the_first() -> None:
    """A peak every day before a signal, with a queue over two links; nothing wears off."""
    day = 86_400.0
    rows = [
        link("in", "0", "1", 700.0, lanes=2),
        link("mid", "1", "2", 433.3),
        link("out", "2", "3", 500.0, free_speed=13.7),
    ]
    red_and_green = Signal("2", (Phase(31.0, ("mid",)), Phase(29.0, ())))
    streams = [("0", "3", k * day + 25_000.3, k * day + 27_000.3, 0.73) for k in range(10)]
    result = run_streams(rows, streams, 10 * day, 5, control=[red_and_green])
    trips = result.trips.assign(day=(result.trips["depart_s"] // day).astype(int))
    assert (trips["status"] == "completed").all()
    times = ["depart_s", "enter_s", "arrive_s"]
    days = [group[times].to_numpy() - number * day for number, group in trips.groupby("day")]
    assert len(days) == 10
    assert len(days[0]) == 292
    for one in days[1:]:
        assert np.abs(one - days[0]).max() < HAIR
    assert (days[0][:, 2] - days[0][:, 1]).max() > 500  # there was a queue


def test_memory_follows_the_demand_and_not_the_room_on_links() -> None:
    """A link of 10,000 km with 100 lanes has room for 10⁹ vehicles, of which 100 are there."""
    rows = [link(f"{n}", f"{n}", f"{n + 1}", 1e7, lanes=100, jam_density=1.0) for n in range(20)]
    run = Simulation(network(rows), demand(("0", "20", 0, 60, 100)), Settings(600, 1))
    held = run.world.links.platoon.nbytes + run.world.log.event.nbytes
    assert held < 10e6


@pytest.mark.parametrize("added", [False, True], ids=["from the start", "added on the way"])
def test_a_link_may_hold_more_platoons_than_any_buffer(added: bool) -> None:
    """20,000 set out within 100 s on a link of 5,000 s, and all are on it at the end."""
    net = network([link("a", "0", "1", 1e5, lanes=100, free_speed=20.0, jam_density=1.0)])
    everybody = demand(("0", "1", 0.0, 100.0, 20_000))
    run = Simulation(net, demand() if added else everybody, Settings(1000, 1, reaction_time=0.01))
    if added:
        run.add(everybody)
    run.advance(1000)
    result = run.result()
    assert (result.trips["status"] == "running").all()
    assert len(result.events) == len(result.trips) == 20_000
    assert result.events["exit_s"].isna().all()
