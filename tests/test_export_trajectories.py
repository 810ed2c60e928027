"""Time-space diagrams: lines that are the closed form, with no more points than they need."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_rgba
from newell_link import events_of, network_of, random_link, result_of, trips_of

from uxsim_geo.analysis.passages import Passages
from uxsim_geo.errors import InputError
from uxsim_geo.export import breakpoints
from uxsim_geo.export.breakpoints import EVEN, ways_on_link
from uxsim_geo.export.colours import SPEED_CLASSES
from uxsim_geo.export.trajectories import trajectories_figure
from uxsim_geo.network.network import Network
from uxsim_geo.settings import Settings

LINK = {"length": 1000.0, "free_speed": 20.0, "lanes": 1, "jam_density": 0.2, "tau": 1.0}


def passages_of(
    network: Network,
    rows: list[tuple[int, int, float, float]],
    sizes: Any = None,
    limits: pd.DataFrame | None = None,
) -> Passages:
    vehicles = max(vehicle for vehicle, *_ in rows) + 1
    trips = trips_of([{} if sizes is None else {"vehicles": sizes[v]} for v in range(vehicles)])
    return Passages.of(result_of(events_of(network, rows), trips, Settings(400.0), limits), network)


def random_passages(seed: int, link: dict[str, float]) -> Passages:
    enter, leave, size = random_link(seed, link)
    network = network_of([{name: link[name] for name in link if name != "tau"}])
    rows = [(k, 0, e, s) for k, (e, s) in enumerate(zip(enter, leave, strict=True))]
    return passages_of(network, rows, size)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("duration", [200.0, 1e5])
def test_between_its_points_a_way_is_straight(seed: int, duration: float) -> None:
    passages = random_passages(seed, LINK)
    ways = ways_on_link(passages, 0, duration)
    inside = np.flatnonzero(passages.enter < duration)
    np.testing.assert_array_equal(np.unique(ways.row), inside)
    for row in inside:
        own = ways.row == row
        time, place = ways.time[own], ways.position[own]
        assert time[0] == passages.enter[row]
        assert time[-1] == min(passages.exit[row], duration)
        between = np.linspace(time[0], time[-1], 500)
        expected = passages.positions(np.full(500, row), between)
        np.testing.assert_allclose(np.interp(between, time, place), expected, atol=1e-5)
        bends = np.abs(np.diff(np.diff(place) / np.diff(time)))
        assert (bends > 1.0).all()  # m/s: no point lies on a straight part


def test_who_stops_bends_where_theory_says() -> None:
    # room of 25 m, passed on in 5 s; the first waits at the end until 100 s
    rows = [(0, 0, 0.0, 100.0), (1, 0, 5.0, 120.0)]
    ways = ways_on_link(passages_of(network_of([{}]), rows), 0, 400.0)
    first, second = ways.lines()
    np.testing.assert_allclose(first, [(0, 0), (50, 1000), (100, 1000)])
    expected = [(5, 0), (5 + 975 / 20, 975), (105, 975), (106.25, 1000), (120, 1000)]
    np.testing.assert_allclose(second, expected)


def test_ways_are_cut_where_that_is_asked_for() -> None:
    passages = passages_of(network_of([{}]), [(0, 0, 0.0, 50.0)])
    ways = ways_on_link(passages, 0, 400.0, np.array([0.0, 10.0, 20.0, 50.0, 60.0]))
    np.testing.assert_allclose(ways.lines(500.0), [[(0, 500), (10, 700), (20, 900), (50, 1500)]])


def test_nobody_has_no_way() -> None:
    passages = passages_of(network_of([{}, {}]), [(0, 0, 30.0, np.nan)])
    assert ways_on_link(passages, 1, 400.0).lines() == []
    assert ways_on_link(passages, 0, 20.0).lines() == []


def test_under_a_changing_limit_points_stand_close() -> None:
    limits = pd.DataFrame(
        [(0.0, "link 0", 10.0), (50.0, "link 0", 20.0)],
        columns=["time_s", "link", "speed_limit_m_s"],
    )
    rows = [(0, 0, 0.0, 100.0), (1, 0, 60.0, 120.0)]
    passages = passages_of(network_of([{}]), rows, limits=limits)
    ways = ways_on_link(passages, 0, 400.0, np.linspace(0.0, 120.0, 61))
    np.testing.assert_array_equal(ways.position, passages.positions(ways.row, ways.time))
    # the second drives 20 m/s until it comes up behind the first at 10 m/s, 25 m and 5 s behind
    own = ways.row == 1
    between = np.linspace(60.0, 120.0, 300)
    free, behind = 20 * (between - 60), 10 * (between - 5) - 25
    expected = np.where(between < 105, np.minimum(free, behind), free)
    close = np.interp(between, ways.time[own], ways.position[own])
    assert EVEN >= 20
    assert np.abs(close - np.minimum(expected, 1000))[between < 105].max() < 60 / EVEN * 10


def test_too_many_bends_are_drawn_at_even_times(monkeypatch: pytest.MonkeyPatch) -> None:
    passages = random_passages(1, LINK)
    monkeypatch.setattr(breakpoints, "MOST", 10)
    ways = ways_on_link(passages, 0, 1e5)
    counts = np.bincount(ways.row)
    assert (counts >= 2).all()
    assert 10 < counts.max() <= breakpoints.COARSE + 2
    np.testing.assert_array_equal(ways.position, passages.positions(ways.row, ways.time))


def two_links() -> tuple[Network, Passages]:
    network = network_of([{}, {"from_node_id": "b", "to_node_id": "c"}], nodes=("a", "b", "c"))
    rows = [(0, 0, 0.0, 50.0), (0, 1, 50.0, 100.0), (1, 0, 10.0, 260.0), (1, 1, 260.0, np.nan)]
    return network, passages_of(network, rows)


def test_links_lie_one_above_the_other() -> None:
    network, passages = two_links()
    figure = trajectories_figure(network, passages, ["link 0", "link 1"], 300.0)
    axes = figure.axes[0]
    lower, upper = axes.collections[:2]
    assert lower.get_segments()[0][-1] == pytest.approx((50, 1000))
    assert upper.get_segments()[0][0] == pytest.approx((50, 1000))
    assert upper.get_segments()[1][-1] == pytest.approx((300, 1800))
    assert axes.get_ylim() == (0, 2000)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time, s", "distance, m")


def test_colours_are_those_of_the_mean_speed() -> None:
    network, passages = two_links()
    figure = trajectories_figure(network, passages, ["link 0"], 300.0, by_speed=True)
    lines = figure.axes[0].collections[0]
    lines.update_scalarmappable()
    times = np.array([line[:, 0] for line in lines.get_segments()])
    # the mean over 5 s around a step of 1.25 s
    waiting = (times[:, 0] > 64) & (times[:, 1] < 256)
    driving = times[:, 1] < 46
    assert waiting.sum() >= 150
    slow, fast = (to_rgba(SPEED_CLASSES[number].colour) for number in (0, -1))
    np.testing.assert_allclose(lines.get_colors()[waiting], [slow] * waiting.sum())
    np.testing.assert_allclose(lines.get_colors()[driving], [fast] * driving.sum())
    total = sum(np.diff(line[:, 1]).sum() for line in lines.get_segments())
    assert total == pytest.approx(2000.0)
    assert "% of free speed" in figure.axes[-1].get_ylabel()


def test_names_of_many_links_do_not_cover_one_another() -> None:
    network = network_of([{} for _ in range(60)])
    passages = passages_of(network, [(0, 0, 0.0, 50.0)])
    names = [f"link {number}" for number in range(60)]
    figure = trajectories_figure(network, passages, names, 300.0)
    figure.draw_without_rendering()
    right = figure.axes[0].child_axes[0]
    boxes = [label.get_window_extent() for label in right.get_yticklabels()]
    assert 8 <= len(boxes) < 60
    assert all(above.y0 > below.y1 - 1.0 for below, above in pairwise(boxes))


def test_a_link_that_is_not_there_is_named() -> None:
    network, passages = two_links()
    with pytest.raises(InputError, match=r"none of this name .found 'other'"):
        trajectories_figure(network, passages, ["link 0", "other"], 300.0)
