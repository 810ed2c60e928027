"""Nodes against the rules of the incremental node model, worked out by hand.

Where a rule decides, times are compared to rounding. Where lots are drawn, each is a Bernoulli
trial of known chance, and shares are compared to four standard deviations: with some fifty such
comparisons, a right engine would fail one of them with one seed in three hundred.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from small_networks import Q, Stream, demand, entries, exits, link, network, on_link, run_streams

from uxsim_geo.engine.simulation import simulate
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

EXACT = 1e-9

sizes = pytest.mark.parametrize("size", [1, 5, 10])


def four_sigma(share: float, trials: int) -> float:
    """Four standard deviations of the share of successes in so many trials."""
    return float(4 * np.sqrt(share * (1 - share) / trials))


def merge_of(priorities: Sequence[float], platoons: int, size: int) -> Result:
    """A saturated merge of one link a priority, "in0", "in1", …, for so many platoons."""
    links = [
        link(f"in{number}", f"{number}", "m", merge_priority=priority)
        for number, priority in enumerate(priorities)
    ]
    end = platoons * size / Q
    streams = [(f"{number}", "z", 0.0, end, Q) for number in range(len(priorities))]
    return run_streams([*links, link("out", "m", "z")], streams, end, size)


@sizes
@pytest.mark.parametrize("priorities", [(1, 1), (1, 2), (1, 10), (1, 100), (10, 1), (1, 2, 3)])
def test_a_saturated_merge_shares_by_priority(priorities: tuple[int, ...], size: int) -> None:
    result = merge_of(priorities, 3000, size)
    assert np.diff(entries(result, "out")) == pytest.approx(size / Q, rel=EXACT)
    went = [exits(result, f"in{number}").size for number in range(len(priorities))]
    passed = sum(went)
    assert passed > 2900
    for count, priority in zip(went, priorities, strict=True):
        share = priority / sum(priorities)
        assert count / passed == pytest.approx(share, abs=four_sigma(share, passed))


def test_lots_are_drawn_anew_for_every_opening() -> None:
    """How many go in a row from one link is geometric: at 1:1 half of the runs are of one."""
    result = merge_of((1, 1), 3000, 5)
    events = result.events.dropna(subset="exit_s").sort_values("exit_s")
    links = events["link"].astype(str).to_numpy()
    went = links[links != "out"]
    begins = np.flatnonzero(np.r_[True, went[1:] != went[:-1], True])
    runs = np.diff(begins)
    assert runs.size / went.size == pytest.approx(0.5, abs=four_sigma(0.5, went.size))
    for length in (1, 2, 3):
        share = 0.5**length
        found = np.mean(runs == length)
        assert found == pytest.approx(share, abs=four_sigma(share, runs.size))


@sizes
@pytest.mark.parametrize("flow", [0.1, 0.3, 0.5])
def test_a_merge_gives_the_rest_to_the_other_link(flow: float, size: int) -> None:
    """One goes before the other and needs less than there is: it waits for one place at most."""
    links = [
        link("first", "1", "3", merge_priority=1e9),
        link("second", "2", "3"),
        link("out", "3", "4"),
    ]
    end = 400.0 * size
    streams = [("1", "4", 0.0, end, flow), ("2", "4", 0.0, end, Q)]
    result = run_streams(links, streams, end, size)
    delay = exits(result, "first") - entries(result, "first")[: exits(result, "first").size] - 50
    assert delay.max() <= size / Q + EXACT
    merged = entries(result, "out")
    assert np.diff(merged) == pytest.approx(size / Q, rel=EXACT)
    second = exits(result, "second")
    assert second.size * size == pytest.approx((Q - flow) * (end - 50), abs=2 * size)


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
    assert passed["1"] / passed.sum() == pytest.approx(0.5, abs=four_sigma(0.5, lots))


@sizes
def test_a_merge_without_a_rival_needs_no_priority(size: int) -> None:
    links = [link("a", "1", "3", merge_priority=1e-6), link("b", "2", "3"), link("c", "3", "4")]
    result = run_streams(links, [("1", "4", 0.0, 100.0, 2.0)], 600, size)
    assert np.diff(entries(result, "c")) == pytest.approx(size / Q, rel=EXACT)


@sizes
def test_a_diverge_gives_both_branches_the_pace_of_the_slower(size: int) -> None:
    """Every other platoon wants the narrow branch of 0.1; those behind it wait, wherever to."""
    links = [
        link("in", "1", "2", 2000),
        link("narrow", "2", "3", capacity=0.1),
        link("wide", "2", "4"),
    ]
    pairs = 20
    end = 2 * pairs * size / 0.6
    streams: list[Stream] = [("1", "3", 0.0, end, 0.3), ("1", "4", 0.0, end, 0.3)]
    result = run_streams(links, streams, 1000.0 * size, size)
    assert (result.trips["status"] == "completed").all()
    number = np.arange(pairs)
    first = size / 0.3 + 2000 / 20
    assert entries(result, "narrow") == pytest.approx(first + number * size / 0.1, abs=1e-6)
    behind = first + number * size / 0.1 + size / Q
    assert entries(result, "wide") == pytest.approx(behind, abs=1e-6)
    in_link = on_link(result, "in")["exit_s"].to_numpy()
    assert (np.diff(in_link) > 0).all()


@sizes
def test_a_diverge_holds_those_behind_a_blocked_platoon(size: int) -> None:
    """The branch takes 100 vehicles and one platoon beyond it; then all wait, wherever to."""
    links = [
        link("in", "1", "2"),
        link("open", "2", "3"),
        link("shut", "2", "4", 500),
        link("stop", "4", "5", capacity=1e-6),
    ]
    streams: list[Stream] = [("1", "3", 0.0, 1000.0, 0.3), ("1", "5", 0.0, 1000.0, 0.3)]
    result = run_streams(links, streams, 3000, size)
    taken = 100 // size + 1  # on the branch and on the link beyond it
    assert entries(result, "stop").size == 1
    assert entries(result, "shut").size == taken
    assert entries(result, "open").size == taken + 1  # each has one before it, the blocked too


@sizes
def test_origins_are_first_in_first_out(size: int) -> None:
    """The second to leave home has a free road, but the first stands in the door."""
    links = [link("a", "1", "2", 50), link("stop", "2", "3", capacity=1e-4), link("b", "1", "4")]
    streams: list[Stream] = [("1", "3", 0.0, 50.0, 2.0), ("1", "4", 60.0, 70.0, 1.0)]
    result = run_streams(links, streams, 3000, size)
    late = result.trips[result.trips["destination"] == "4"]
    assert (late["status"] == "waiting").all()
    assert len(late) == 10 / size
    assert (result.trips["status"] == "running").sum() == 10 // size  # who could enter "a"


@sizes
def test_origins_go_before_links_for_the_same_opening(size: int) -> None:
    links = [link("a", "1", "2", merge_priority=1e6), link("b", "2", "3")]
    streams: list[Stream] = [("1", "3", 0.0, 500.0, Q), ("2", "3", 100.0, 101.0, 50.0)]
    result = run_streams(links, streams, 2000, size)
    from_two = result.trips[result.trips["origin"] == "2"]["enter_s"].to_numpy()
    assert from_two[0] < 101 + 2 * size / Q
    assert np.diff(from_two) == pytest.approx(size / Q, rel=EXACT)


@sizes
def test_trips_end_in_mid_network_at_the_pace_of_their_own_link(size: int) -> None:
    """Only their link's exit holds them: neither the crowd that starts there nor the full road."""
    links = [
        link("a", "1", "2", 2000, capacity=0.5),
        link("b", "2", "3", 50),
        link("stop", "3", "4", capacity=1e-6),
    ]
    streams: list[Stream] = [("1", "2", 0.0, 300.0, 1.0), ("2", "4", 0.0, 1.0, 100.0)]
    result = run_streams(links, streams, 1000, size)
    to_two = result.trips[result.trips["destination"] == "2"]
    assert (to_two["status"] == "completed").all()
    taken = (to_two["arrive_s"] - to_two["enter_s"]).to_numpy()
    assert taken == pytest.approx(100, abs=1e-6)
    assert np.diff(to_two["arrive_s"]) == pytest.approx(size / 0.5, rel=EXACT)


@sizes
def test_trips_that_end_wait_behind_those_that_cannot_go_on(size: int) -> None:
    links = [link("a", "1", "2"), link("b", "2", "3", 50), link("stop", "3", "4", capacity=1e-6)]
    streams: list[Stream] = [("1", "4", 0.0, 50.0, 0.8), ("1", "2", 60.0, 100.0, 0.5)]
    result = run_streams(links, streams, 1000, size)
    to_two = result.trips[result.trips["destination"] == "2"]
    assert len(to_two) == 20 / size
    assert (to_two["status"] == "running").all()


@sizes
def test_trips_without_a_way_are_aborted_and_hold_up_nobody(size: int) -> None:
    links = [link("a", "1", "2"), link("b", "3", "1")]
    streams: list[Stream] = [("1", "3", 0.0, 10.0, 2.0), ("1", "2", 20.0, 30.0, 2.0)]
    trips = run_streams(links, streams, 600, size).trips
    half = len(trips) // 2
    assert (trips["status"] == ["aborted"] * half + ["completed"] * half).all()
    assert trips["enter_s"][:half].isna().all()
    assert trips["free_time_s"][:half].isna().all()
    assert trips["enter_s"][half] == trips["depart_s"][half]


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


@sizes
def test_gridlock_is_told_from_a_long_queue(size: int) -> None:
    """A ring in which everybody waits for the next link, and a queue before a narrow link."""
    ring = [link(f"r{i}", f"{i}", f"{(i + 1) % 4}", 100) for i in range(4)]
    doors = [link(f"d{i}", f"in{i}", f"{i}", 100) for i in range(4)]
    rows = tuple((f"in{i}", f"{(i + 3) % 4}", 0.0, 100.0, 300.0) for i in range(4))
    locked = simulate(network(ring + doors), demand(*rows), Settings(3000, size))
    assert locked.locked_vehicles > 0
    queue = [link("a", "1", "2"), link("b", "2", "3", capacity=1e-4)]
    waiting = simulate(network(queue), demand(("1", "3", 0, 10, 500)), Settings(1000, size))
    assert waiting.locked_vehicles == 0
