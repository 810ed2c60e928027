"""Route choice against what its rules say, worked out by hand.

B ← (1−λ)B + λ·tree at every update, the first of which sets B = tree; a platoon takes a way with
the chance B. Where chance decides, shares are compared to four standard deviations of their number.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from small_networks import Stream, demand, entries, link, network, on_link, run_streams

from uxsim_geo.engine.simulation import simulate
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

sizes = pytest.mark.parametrize("size", [1, 5, 10])

#: 50 s and 2,000 s between the same two nodes
PARALLEL = [link("short", "1", "2", 1000), link("long", "1", "2", 40000)]


@sizes
def test_the_shorter_of_two_parallel_links_takes_all_below_capacity(size: int) -> None:
    links = [*PARALLEL, link("on", "2", "3")]
    result = run_streams(links, [("1", "3", 0.0, 9000.0, 0.8)], 10000, size)
    assert set(result.events["link"]) == {"short", "on"}
    taken = result.trips["arrive_s"] - result.trips["depart_s"]
    assert taken.to_numpy() == pytest.approx(100, abs=1e-6)


@sizes
def test_the_longer_of_two_parallel_links_is_taken_once_the_short_one_stands(size: int) -> None:
    """It counts 100 times 50 s where all stand; that is seen at the second update, at 600 s."""
    links = [*PARALLEL, link("stop", "2", "3", 50, capacity=1e-6)]
    result = run_streams(links, [("1", "3", 0.0, 2000.0, 0.8)], 4000, size)
    held = 200 // size + 1  # on the short link, and one platoon beyond it
    assert entries(result, "short").size == held
    assert entries(result, "short")[-1] < 600
    drawn = entries(result, "long")
    # λ = ½, and who waits at home draws in every step: 2^-20 that twenty in a row stay
    assert 600 <= drawn[0] <= 600 + 20 * size
    assert drawn.size == 1600 // size - held


def two_ways(size: int, weight: float, **settings: Any) -> Result:
    """Two free ways from 1 to 9; others stop the faster one for good before the second update.

    Those who chose it wait on its first link, which has room for all of them; none waits at
    node 1, so that every platoon draws its way once. Updates are 400 platoons apart.
    """
    first = {"length": 1000.0 * size, "lanes": 20}
    links = [
        link("a1", "1", "2") | first,
        link("a2", "2", "9", 100),
        link("b1", "1", "3") | first,
        link("b2", "3", "9", 300),
        link("stop", "9", "10", 100, capacity=1e-6),
    ]
    interval = 800.0 * size
    streams: list[Stream] = [("2", "10", 0.0, 100.0, 2.0), ("1", "9", 100.0, 5 * interval, 0.5)]
    told = {"route_update_interval": interval, "route_noise": 0.0, "route_update_weight": weight}
    return run_streams(links, streams, 5 * interval, size, **told | settings)


@sizes
@pytest.mark.parametrize("weight", [0.0, 0.2, 0.5, 1.0])
def test_a_new_route_is_taken_up_with_inertia(weight: float, size: int) -> None:
    """n updates after the other way has become the better one, 1 − (1−λ)^n take it."""
    result = two_ways(size, weight)
    old, new = entries(result, "a1"), entries(result, "b1")
    for updates in range(5):
        start, end = updates * 800.0 * size, (updates + 1) * 800.0 * size
        kept = int(np.sum((old >= start) & (old < end)))
        went = int(np.sum((new >= start) & (new < end)))
        share = 1 - (1 - weight) ** updates
        assert kept + went >= 290
        spread = 4 * np.sqrt(share * (1 - share) / (kept + went))
        assert went / (kept + went) == pytest.approx(share, abs=max(spread, 1e-12))


@sizes
@pytest.mark.parametrize(
    ("longer", "chance"),
    [
        # least of 100 (1 + 0.01 U) and T (1 + 0.01 U'); T: the slower one's free-flow time, s
        (101.5, 0.0),  # no noise bridges 1.5 s
        (100.5, 0.125),  # U > 0.5 + U': a triangle of ½ · ½²
        (100.0, 0.5),
    ],
)
def test_unequal_routes_are_shared_by_the_noise_alone(
    longer: float, chance: float, size: int
) -> None:
    """At λ = 1 all of an interval take the way that is the faster one with its noise.

    Both ways are taken where they take the same time to the millisecond, of 1,000 that noise adds.
    """
    links = [link("a", "1", "2", 2000, lanes=3), link("b", "1", "2", 20 * longer, lanes=3)]
    interval, updates = 10.0 * size, 1500
    told = {"route_update_interval": interval, "route_update_weight": 1.0}
    # off the beat of the updates, at which who is just due to leave would count as standing
    stream = [("1", "2", 0.25 * size, updates * interval, 0.4)]
    result = run_streams(links, stream, updates * interval, size, **told)
    in_interval = (on_link(result, "b")["enter_s"] // interval).astype(int)
    used = in_interval.nunique() / updates
    # the slower one is T/100 times as noisy: the triangle is smaller by that
    assert used == pytest.approx(chance, abs=4 * np.sqrt(chance * (1 - chance) / updates) + 1e-12)
    both = set(in_interval) & set((on_link(result, "a")["enter_s"] // interval).astype(int))
    assert len(both) <= 6 if longer == 100.0 else not both  # of 1,500; 1.5 ± 4 · 1.2


@sizes
def test_routes_of_equal_time_are_shared_by_the_noise_alone(size: int) -> None:
    links = [
        link(f"{way}{part}", start, end)
        for way in "abc"
        for part, start, end in ((1, "1", way), (2, way, "9"))
    ]
    interval = 60.0 * size
    told = {"route_update_interval": interval}
    result = run_streams(
        links, [("1", "9", 0.3 * size, 600 * interval, 0.2)], 660 * interval, size, **told
    )
    shares = [len(on_link(result, f"{way}1")) / len(result.trips) for way in "abc"]
    # 600 updates, one of three ways each; λ = ½ only spreads each over those that follow
    assert shares == pytest.approx([1 / 3] * 3, abs=4 * np.sqrt(2 / 9 / 600))


@sizes
def test_without_noise_the_faster_route_takes_all(size: int) -> None:
    """The way of three links is 10 s faster than the one of one link, and 400 m longer."""
    links = [
        link("direct", "1", "4", 1000, free_speed=10.0),
        link("out", "1", "2", 400),
        link("over", "2", "3", 500),
        link("back", "3", "4", 900),
    ]
    stream = [("1", "4", 0.0, 4000.0, 0.6)]
    result = run_streams(links, stream, 5000, size, route_noise=0.0)
    assert set(result.events["link"]) == {"out", "over", "back"}
    assert result.trips["free_time_s"].to_numpy() == pytest.approx(90)


@sizes
def test_the_slower_route_is_taken_only_when_the_fast_one_is_congested(size: int) -> None:
    links = [
        link("fast", "1", "2"),
        link("narrow", "2", "3", 500, capacity=0.2),
        link("slow", "1", "3", 3000),
    ]
    light = simulate(network(links), demand(("1", "3", 0, 3600, 360)), Settings(4000, size))
    assert set(light.events["link"]) == {"fast", "narrow"}
    heavy = simulate(network(links), demand(("1", "3", 0, 3600, 2000)), Settings(4000, size))
    slow = entries(heavy, "slow")
    assert slow.size * size > 250
    assert slow[0] >= 600  # nobody knows before the first update
