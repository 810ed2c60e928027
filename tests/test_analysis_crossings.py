"""When platoons are at a place: the inverse of where they are at a time."""

from __future__ import annotations

import numpy as np
import pytest
from newell_link import events_of, network_of, random_link, result_of, trips_of
from small_networks import link, network, run_streams

from uxsim_geo.analysis.crossings import times_at
from uxsim_geo.analysis.passages import Passages
from uxsim_geo.control.speed_limits import SpeedLimit
from uxsim_geo.settings import Settings

LINKS = [
    {"length": 1000.0, "free_speed": 20.0, "lanes": 1, "jam_density": 0.2, "tau": 1.0},
    {"length": 400.0, "free_speed": 15.0, "lanes": 2, "jam_density": 0.15, "tau": 1.0},
    {"length": 60.0, "free_speed": 10.0, "lanes": 1, "jam_density": 0.2, "tau": 0.5},
]
END = 150.0

#: begin and end (s), speed (m/s)
LIMITS = [(40.0, 120.0, 8.0), (200.0, 260.0, 15.0), (350.0, 380.0, 5.0)]


def passages_on(road: dict[str, float], seed: int) -> Passages:
    """Platoons on two links alike until :data:`END`, where some are still under way."""
    row = {name: value for name, value in road.items() if name != "tau"}
    two, rows, sizes = network_of([row, row]), [], []
    for number in (0, 1):
        for e, s, n in zip(*random_link(seed + number, road), strict=True):
            if e < END:
                rows.append((len(sizes), number, e, s if s <= END else np.nan))
                sizes.append({"vehicles": n})
    settings = Settings(END, reaction_time=road["tau"])
    return Passages.of(result_of(events_of(two, rows), trips_of(sizes), settings), two)


def drawn_places(passages: Passages, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rows = np.repeat(np.arange(len(passages.link)), 20)
    shares = np.random.default_rng(seed).uniform(0, 1, len(rows))
    return rows, shares * passages.geometry.length[passages.link[rows]]


def assert_inverse(passages: Passages, rows: np.ndarray, places: np.ndarray) -> None:
    times = times_at(passages, rows, places)
    come = np.isfinite(times)
    assert come.any()
    assert not come.all()  # the case is worth the test
    there = passages.positions(rows[come], times[come])
    assert there == pytest.approx(places[come], abs=1e-6)
    # not a moment too late, as of one who has stood there
    earlier = np.maximum(times[come] - 1e-3, passages.enter[rows[come]])
    moved = times[come] - earlier > 0
    before = passages.positions(rows[come], earlier)
    assert (before < places[come])[moved].all()
    at_the_end = passages.positions(rows[~come], np.full((~come).sum(), passages.end))
    assert (at_the_end < places[~come]).all()


@pytest.mark.parametrize("road", LINKS)
@pytest.mark.parametrize("seed", [0, 10])
def test_a_platoon_is_at_a_place_when_it_comes_there(road: dict[str, float], seed: int) -> None:
    passages = passages_on(road, seed)
    assert_inverse(passages, *drawn_places(passages, seed))


def test_so_it_is_where_speed_limits_change() -> None:
    rows = [
        link("in", "a", "b", 200.0),
        link("road", "b", "c"),
        link("out", "c", "d", capacity=0.4),
    ]
    limits = [SpeedLimit(["road"], speed, begin=begin, end=end) for begin, end, speed in LIMITS]
    streams = [("a", "d", 0.0, 500.0, 0.6)]
    result = run_streams(rows, streams, 600.0, 2, control=limits)
    passages = Passages.of(result, network(rows))
    assert passages.held_by is not None
    assert_inverse(passages, *drawn_places(passages, 3))


def test_ends_of_a_link_are_entry_and_exit() -> None:
    passages = passages_on(LINKS[0], 5)
    rows = np.arange(len(passages.link))
    start = times_at(passages, rows, np.zeros(len(rows)))
    assert start == pytest.approx(passages.enter)
    out = np.isfinite(passages.exit)
    end = times_at(passages, rows, passages.geometry.length[passages.link])
    assert (end[out] <= passages.exit[out] + 1e-9).all()
