"""Positions inside a link against hand-worked numbers, the full minimum and a stepping twin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from newell_link import events_of, network_of, random_link, result_of, trips_of

from uxsim_geo.analysis.cells import space_time_cells
from uxsim_geo.analysis.link_states import link_times
from uxsim_geo.analysis.passages import Passages
from uxsim_geo.errors import InputError
from uxsim_geo.settings import Settings

LINKS = [
    {"length": 1000.0, "free_speed": 20.0, "lanes": 1, "jam_density": 0.2, "tau": 1.0},
    {"length": 400.0, "free_speed": 15.0, "lanes": 2, "jam_density": 0.15, "tau": 1.5},
    {"length": 60.0, "free_speed": 10.0, "lanes": 3, "jam_density": 0.2, "tau": 1.0},
    {"length": 10.0, "free_speed": 10.0, "lanes": 1, "jam_density": 0.2, "tau": 1.0},
]


def passages_on(
    link: dict[str, float], enter: np.ndarray, leave: np.ndarray, size: np.ndarray
) -> Passages:
    row = {name: value for name, value in link.items() if name != "tau"}
    network = network_of([row])
    events = events_of(
        network, [(k, 0, e, s) for k, (e, s) in enumerate(zip(enter, leave, strict=True))]
    )
    trips = trips_of([{"vehicles": n} for n in size])
    return Passages.of(result_of(events, trips, Settings(1e4, reaction_time=link["tau"])), network)


def full_minimum(
    link: dict[str, float], enter: np.ndarray, leave: np.ndarray, size: np.ndarray, k: int, t: float
) -> float:
    """The formula as it is printed: the minimum over every platoon ahead, no search."""
    u, length = link["free_speed"], link["length"]
    x = u * (t - enter[k])
    for a in range(k + 1):
        between = size[a:k].sum()
        later = t - between * link["tau"] / link["lanes"] - leave[a]
        room = between / (link["lanes"] * link["jam_density"])
        x = min(x, length + u * max(0.0, later) - room)
    return min(max(x, 0.0), length)


def test_a_queue_worked_by_hand() -> None:
    # 20 m/s, w = 5 m/s, 5 vehicles a platoon: 25 m and 5 s between trajectories of a queue
    enter = np.array([0.0, 10.0, 20.0])
    leave = np.array([100.0, 106.25, 112.5])  # 5 vehicles / 0.8 veh/s apart
    passages = passages_on(LINKS[0], enter, leave, np.array([5, 5, 5]))
    rows = np.array([0, 0, 0, 1, 1, 1, 2, 2])
    times = np.array([25.0, 60.0, 100.0, 60.0, 105.0, 106.0, 68.0, 71.0])
    expected = [500, 1000, 1000, 975, 975, 995, 950, 950]
    assert passages.positions(rows, times) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("link", LINKS, ids=lambda link: f"{link['length']:.0f} m")
@pytest.mark.parametrize("seed", range(3))
def test_the_search_finds_the_full_minimum(link: dict[str, float], seed: int) -> None:
    enter, leave, size = random_link(seed, link)
    passages = passages_on(link, enter, leave, size)
    for k in range(len(enter)):
        times = np.linspace(enter[k], leave[k], 40)
        found = passages.positions(np.full(40, k), times)
        wanted = [full_minimum(link, enter, leave, size, k, t) for t in times]
        assert found == pytest.approx(wanted, abs=1e-7)


@pytest.mark.parametrize("link", LINKS, ids=lambda link: f"{link['length']:.0f} m")
@pytest.mark.parametrize("seed", range(3))
def test_exact_at_both_ends_and_never_backwards(link: dict[str, float], seed: int) -> None:
    enter, leave, size = random_link(seed, link)
    passages = passages_on(link, enter, leave, size)
    rows = np.arange(len(enter))
    assert (passages.positions(rows, enter) == 0).all()
    assert (passages.positions(rows, leave) == link["length"]).all()
    before = passages.positions(rows, leave - 1e-9)
    assert before == pytest.approx(np.full(len(rows), link["length"]), abs=1e-6)
    for k in rows:
        times = np.linspace(enter[k] - 5, leave[k] + 5, 300)
        x = passages.positions(np.full(300, k), times)
        assert (np.diff(x) >= -1e-9).all()
        assert (np.diff(x) <= link["free_speed"] * np.diff(times) + 1e-9).all()


def test_a_twin_that_steps_the_equation_of_the_paper_agrees() -> None:
    # X(t + Δt, n) = min(X(t, n) + uΔt, X(t, n - Δn) - δΔn), leaders driving on beyond the end
    link = {"length": 500.0, "free_speed": 20.0, "lanes": 1, "jam_density": 0.2, "tau": 1.0}
    step, spacing = 5.0, 25.0
    enter = np.arange(12) * 10.0
    leave = np.maximum(enter + 25, 90.0 + np.arange(12) * 6.25)
    passages = passages_on(link, enter, leave, np.full(12, 5.0))
    x = np.full(12, -np.inf)
    for t in np.arange(0.0, 180.0, step):
        ahead = np.concatenate(([np.inf], x[:-1]))
        driven = np.minimum(x + 20 * step, ahead - spacing)
        held = np.where(t < leave, np.minimum(driven, 500.0), np.maximum(driven, 500.0))
        x = np.where(t <= enter, np.where(t == enter, 0.0, -np.inf), held)
        on_link = np.flatnonzero((enter <= t) & (t < leave))
        found = passages.positions(on_link, np.full(len(on_link), t))
        assert np.abs(found - x[on_link]).max(initial=0) <= 20 * step


def test_platoons_still_on_the_link_queue_behind_one_another() -> None:
    leave = np.array([np.nan, np.nan, np.nan])
    passages = passages_on(LINKS[0], np.array([0.0, 7.0, 14.0]), leave, np.array([5, 2, 5]))
    found = passages.positions(np.arange(3), np.full(3, 500.0))
    assert found == pytest.approx([1000, 975, 965])


def test_links_do_not_feel_each_other_and_any_order_of_questions_will_do() -> None:
    network = network_of([{}, {"length": 500.0}])
    events = events_of(network, [(1, 1, 0.0, 99.0), (0, 0, 3.0, 53.0), (2, 1, 10.0, np.nan)])
    passages = Passages.of(result_of(events, trips_of([{}, {}, {}]), Settings(100)), network)
    assert passages.vehicle.tolist() == [0, 1, 2]
    found = passages.positions(np.array([2, 0, 1]), np.array([90.0, 13.0, 90.0]))
    assert found == pytest.approx([475, 200, 500])


def test_an_event_on_an_unknown_link_is_refused() -> None:
    network = network_of([{}])
    events = events_of(network, [(0, 0, 0.0, 50.0)]).assign(link=pd.Categorical(["elsewhere"]))
    with pytest.raises(ValueError, match="of another run"):
        Passages.of(result_of(events, trips_of([{}]), Settings(100)), network)


def test_passages_of_another_result_are_refused() -> None:
    of = network_of([{}])
    one, other = (
        result_of(events_of(of, [(0, 0, 0.0, leave)]), trips_of([{}]), Settings(100.0))
        for leave in (50.0, 60.0)
    )
    passages = Passages.of(one, of)
    sooner = replace(one, settings=Settings(80.0))
    pd.testing.assert_frame_equal(
        link_times(sooner, of, bin_s=80.0, passages=passages), link_times(sooner, of, bin_s=80.0)
    )
    for ask in (
        lambda: link_times(other, of, bin_s=100.0, passages=passages),
        lambda: space_time_cells(other, of, bin_s=100.0, cell_m=100.0, passages=passages),
    ):
        with pytest.raises(InputError, match="passages: are those of another result"):
            ask()
