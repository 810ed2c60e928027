"""When links are full: theory of a queue that grows back over a link, and the engine's own rule."""

from __future__ import annotations

import numpy as np
import pytest
from newell_link import events_of, network_of, result_of, trips_of
from small_networks import across, grid, link, run_streams
from small_networks import network as network_of_rows

from uxsim_geo.analysis.link_states import link_times, link_totals
from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.spillback import _Gaps, times_without_room
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.settings import Settings

Q = 0.8  # capacity of a link of 20 m/s and 0.2 veh/m


@pytest.mark.parametrize("platoon_size", [1, 5])
def test_a_link_is_full_from_when_the_shock_is_at_its_start(platoon_size: int) -> None:
    """0.8 veh/s meet 0.4 veh/s: the shock is -5 m/s, and 200 m back after 40 s."""
    rows = [
        link("in", "a", "b"),
        link("short", "b", "c", 200.0),
        link("out", "c", "d", capacity=Q / 2),
    ]
    result = run_streams(rows, [("a", "d", 0.0, 400.0, Q)], 1400.0, platoon_size)
    states = link_times(result, network_of_rows(rows), bin_s=20.0, links="short")
    # the first is at the end of the short link 50 + 10 s after it has departed
    first = result.events["enter_s"].min() + 60.0
    shock = first + 200 / 5
    share = states["spillback_share"].to_numpy()
    begin, end = states["begin_s"].to_numpy(), states["end_s"].to_numpy()
    slack = 2 * platoon_size / Q * 2
    assert (share[end < shock - slack] == 0).all()
    last = result.events.query("link == 'short'")["enter_s"].max()
    inside = (begin > shock + slack) & (end < last - slack)
    assert inside.sum() > 20
    assert share[inside] == pytest.approx(1.0)
    assert (share[begin > last + 200 / 5 + slack] == 0).all()
    assert link_totals(states)["spillback_share"][0] == pytest.approx(
        (share * (end - begin)).sum() / 1400.0
    )


def test_a_stream_at_capacity_fills_nothing() -> None:
    rows = [link("in", "a", "b"), link("out", "b", "c", 100.0)]
    result = run_streams(rows, [("a", "c", 0.0, 400.0, Q)], 600.0, 5)
    states = link_times(result, network_of_rows(rows), bin_s=60.0)
    assert (states["spillback_share"] == 0).all()


def test_a_locked_link_is_full_to_the_end() -> None:
    # 50 m hold ten vehicles: two platoons, and neither leaves
    network = network_of([{"length": 50.0}])
    rows = [(0, 0, 10.0, np.nan), (1, 0, 30.0, np.nan)]
    trips = trips_of([{"status": "running"}, {"status": "running"}])
    result = result_of(events_of(network, rows), trips, Settings(130.0))
    states = link_times(result, network, bin_s=130.0)
    assert states["spillback_share"].to_numpy() == pytest.approx([100 / 130])


@pytest.mark.parametrize(
    ("jam_density", "length", "platoon_size"),
    # products that are whole on paper, and a hair less in the computer
    [(0.12, 125.0, 5), (0.12, 250.0, 5), (0.11, 500.0, 5), (0.11, 200.0, 2), (0.12, 425.0, 3)],
)
def test_a_link_that_a_whole_number_of_vehicles_fits_on(
    jam_density: float, length: float, platoon_size: int
) -> None:
    rows = [
        link("short", "1", "2", length, jam_density=jam_density),
        link("in", "0", "1", 500.0, jam_density=jam_density),
        link("out", "2", "3", 300.0, capacity=0.2),
    ]
    of = network_of_rows(rows)
    result = run_streams(rows, [("0", "3", 0.0, 1500.0, 0.4)], 2000.0, platoon_size)
    passages = Passages.of(result, of)
    gaps = _Gaps.of(passages, of, result.settings)
    opens = np.maximum(gaps.hole(passages), gaps.exits(passages))
    before = np.flatnonzero(passages.link[1:] == passages.link[:-1])
    assert len(before) > 100
    assert (opens[before] <= passages.enter[before + 1] + 1e-6).all()
    # and the queue lets the next one in just then
    short = before[passages.link[before] == 0]
    assert (opens[short] >= passages.enter[short + 1] - 1e-6).mean() > 0.5


def test_whoever_enters_finds_room() -> None:
    """The engine lets nobody in while a link counts as full, and some in at the very end of it."""
    of = network_of_rows(grid(4, 100.0))
    result = simulate(of, across(4, 25.0, 400.0), Settings(900.0, platoon_size=3))
    passages = Passages.of(result, of)
    closures = times_without_room(passages, of, result.settings)
    assert len(closures.link) > 100
    at_once = 0
    for number, begin, end in zip(*closures, strict=True):
        own = passages.enter[passages.first[number] : passages.first[number + 1]]
        later = own[own > begin + 1e-9]
        if later.size:
            assert later[0] >= end
            at_once += later[0] <= end + 1e-6
    assert at_once > 50
