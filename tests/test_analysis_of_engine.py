"""What the analysis derives from the engine's events agrees with the engine's own trips."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from newell_link import network_of

from uxsim_geo.analysis.link_states import link_times
from uxsim_geo.analysis.network_states import network_states, trip_ends, vehicle_counts
from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.summary import summary
from uxsim_geo.demand.demand import DEMAND_COLUMNS, Demand
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings


@pytest.fixture(scope="module")
def run() -> tuple[Network, Result]:
    """Two lanes and a side road into one lane: a queue that fills the links and waits at home."""
    network = network_of(
        [
            {"link_id": "main", "lanes": 2, "to_node_id": "c"},
            {"link_id": "side", "from_node_id": "b", "to_node_id": "c", "length": 300.0},
            {"link_id": "narrow", "from_node_id": "c", "to_node_id": "d", "free_speed": 10.0},
        ],
        nodes=("a", "b", "c", "d"),
    )
    rows = [("a", "d", 0.0, 900.0, 903.0), ("b", "d", 100.0, 900.0, 307.0)]
    demand = Demand(pd.DataFrame(rows, columns=list(DEMAND_COLUMNS)))
    return network, simulate(network, demand, Settings(1200.0))


def test_distances_and_times_on_links_are_those_of_the_trips(run: tuple[Network, Result]) -> None:
    network, result = run
    trips, end = result.trips, result.settings.duration
    states = link_times(result, network, bin_s=77.0)
    on_links = (trips["arrive_s"].fillna(end) - trips["enter_s"]).fillna(0.0)
    assert set(trips["status"]) == {"completed", "running", "waiting"}
    assert states["time"].sum() == pytest.approx((on_links * trips["vehicles"]).sum())
    driven = (trips["distance_m"] * trips["vehicles"]).sum()
    assert states["distance"].sum() == pytest.approx(driven)
    assert network_states(states, network)["distance"].sum() == pytest.approx(driven)


def test_no_link_holds_more_than_it_can(run: tuple[Network, Result]) -> None:
    network, result = run
    states = link_times(result, network, bin_s=20.0)
    jam = np.repeat(network.links["jam_density"] * network.links["lanes"], 60).to_numpy()
    assert (states["density"] <= jam + 1e-9).all()
    full = states["density"].to_numpy() > 0.6 * jam
    assert full.any()  # the case is worth the test: a queue does fill a link


def test_platoons_keep_their_room_in_the_engine_s_queues(run: tuple[Network, Result]) -> None:
    network, result = run
    passages = Passages.of(result, network)
    for time in np.arange(50.0, 1200.0, 50.0):
        on = np.flatnonzero((passages.enter < time) & (passages.exit > time))
        position = passages.positions(on, np.full(len(on), time))
        follows = np.flatnonzero(np.diff(passages.link[on]) == 0)
        gap = position[follows] - position[follows + 1]
        room = (
            passages.vehicles[on][follows]
            * passages.geometry.space_shift[passages.link[on]][follows]
        )
        entering = position[follows + 1] == 0
        assert (gap[~entering] >= room[~entering] - 1e-6).all()


def test_the_summary_and_the_counts_agree_with_each_other(run: tuple[Network, Result]) -> None:
    network, result = run
    figures = summary(result, network)
    last = vehicle_counts(result.trips, trip_ends(result), np.array([1200.0])).iloc[0]
    for status in ("departed", "waiting", "running", "completed", "aborted"):
        assert figures[f"vehicles_{status}"] == last[status], status
    assert figures["vehicles_demanded"] == 1210
    assert 0 < figures["total_delay_veh_s"] < figures["total_travel_time_veh_s"]
    assert figures["gridlocked"] is False
