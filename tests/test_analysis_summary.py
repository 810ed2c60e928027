"""The summary's figures, worked out by hand for one trip of every fate."""

from __future__ import annotations

import json

import numpy as np
import pytest
from newell_link import events_of, network_of, trips_of

from uxsim_geo.analysis.summary import summary
from uxsim_geo.events import EventTable
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

KEYS = {
    "vehicles_demanded",
    "vehicles_departed",
    "vehicles_completed",
    "vehicles_running",
    "vehicles_waiting",
    "vehicles_aborted",
    "total_travel_time_veh_s",
    "total_delay_veh_s",
    "completed",
    "total_distance_veh_m",
    "average_speed_m_s",
    "gridlocked",
    "engine_wall_s",
    "seed",
}


def result_of_every_fate() -> Result:
    """Two links of 1 km at 20 m/s in a row; the end is at 200 s."""
    network = network_of([{}, {}])
    events = events_of(
        network,
        [
            (0, 0, 10.0, 60.0),
            (0, 1, 60.0, 120.0),
            (1, 0, 90.0, 160.0),
            (1, 1, 160.0, np.nan),
            (2, 0, 100.0, 170.0),
        ],
    )
    trips = trips_of(
        [
            {"enter_s": 10.0, "arrive_s": 120.0, "distance_m": 2000.0, "free_time_s": 100.0},
            {"depart_s": 80.0, "enter_s": 90.0, "status": "running", "distance_m": 1800.0},
            {"depart_s": 95.0, "enter_s": 100.0, "status": "aborted", "distance_m": 1000.0},
            {"depart_s": 150.0, "status": "waiting", "vehicles": 3},
            {"depart_s": 250.0, "status": "waiting", "vehicles": 2},
        ]
    )
    return Result(EventTable(events), trips, Settings(200.0, seed=7), 0.25, 0)


def test_every_fate_counts_as_it_should() -> None:
    figures = summary(result_of_every_fate(), network_of([{}, {}]))
    assert set(figures) == KEYS
    assert figures["vehicles_demanded"] == 20
    assert figures["vehicles_departed"] == 18
    assert figures["vehicles_completed"] == 5
    assert figures["vehicles_running"] == 5
    assert figures["vehicles_waiting"] == 3
    assert figures["vehicles_aborted"] == 5
    # completed 0–120, running 80–200, aborted 95–170, waiting 150–200
    assert figures["total_travel_time_veh_s"] == 5 * 120 + 5 * 120 + 5 * 75 + 3 * 50
    # the running one has driven 1 km and 40 s at free speed: 90 s of its 120 s were driving
    assert figures["total_delay_veh_s"] == pytest.approx(5 * 20 + 5 * 30 + 5 * 25 + 3 * 50)
    assert figures["completed"] == {"average_travel_time_s": 120.0, "average_delay_s": 20.0}
    assert figures["total_distance_veh_m"] == 5 * (2000 + 1800 + 1000)
    assert figures["average_speed_m_s"] == pytest.approx(4800 / (110 + 110 + 70))
    assert figures["gridlocked"] is False
    assert (figures["seed"], figures["engine_wall_s"]) == (7, 0.25)


def test_nobody_gives_nulls_that_json_can_hold() -> None:
    network = network_of([{}])
    result = Result(EventTable(events_of(network, [])), trips_of([]), Settings(100.0), 0.0, 0)
    figures = summary(result, network)
    assert json.loads(json.dumps(figures, allow_nan=False)) == figures
    assert figures["completed"] == {"average_travel_time_s": None, "average_delay_s": None}
    assert figures["average_speed_m_s"] is None


def test_locked_vehicles_make_a_gridlock() -> None:
    network = network_of([{}, {}])
    free = result_of_every_fate()
    locked = Result(free.log, free.trips, free.settings, free.engine_wall_s, 5)
    assert summary(locked, network)["gridlocked"] is True
