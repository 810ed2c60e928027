"""What every vehicle did: its route link by link, and its trip in one row."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.analysis.network_states import trip_ends
from uxsim_geo.analysis.subsets import check_links, chosen_vehicles
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.events import COLUMNS
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result

#: columns of the trips that their summary keeps as they are
KEPT = (
    "vehicle",
    "origin",
    "destination",
    "class",
    "number",
    "vehicles",
    "status",
    "depart_s",
    "enter_s",
    "arrive_s",
    "distance_m",
    "free_time_s",
    "toll",
)


def trip_routes(result: Result, *, vehicles: npt.ArrayLike | None = None) -> pd.DataFrame:
    """The links that every vehicle has entered, in the order in which it drove.

    ``vehicles`` are rows of the trips (None: all). One row a link entry, ordered by vehicle and
    then by entry: vehicle, position (of the link in the route, from 0), link (link_id,
    categorical), enter_s, exit_s (NaN while on it at the end). Vehicles that never entered the
    network have no row.

    Raises :class:`uxsim_geo.errors.InputError` if ``vehicles`` is empty or not among the trips.
    """
    chosen = None if vehicles is None else chosen_vehicles(result.trips, vehicles)
    events = result.log.some(*COLUMNS, vehicles=chosen)
    order = driving_order(events["vehicle"])
    vehicle = events["vehicle"][order]
    rows = np.arange(len(vehicle))
    begins = np.concatenate(([True], vehicle[1:] != vehicle[:-1]))[: len(vehicle)]
    first = np.maximum.accumulate(np.where(begins, rows, 0))
    return pd.DataFrame(
        {
            "vehicle": vehicle,
            "position": (rows - first).astype(np.int32),
            "link": pd.Categorical.from_codes(
                events["link"][order], categories=result.log.link_ids
            ),
            "enter_s": events["enter_s"][order],
            "exit_s": events["exit_s"][order],
        }
    )


def trip_summary(
    result: Result, network: Network, *, vehicles: npt.ArrayLike | None = None
) -> pd.DataFrame:
    """One row a trip, in the order of the trips, with what it took so far, per vehicle.

    ``vehicles`` are rows of the trips (None: all). Columns: those of the trips (see
    :class:`uxsim_geo.result.Result`) and

    end_s
        when it arrived or was aborted; NaN while it goes on
    links_entered
        number of links
    origin_wait_s
        time from the wish to depart to the entry into the network
    travel_time_so_far_s
        from the wish to depart to the arrival; of those who wait or run, to the end of the
        simulation; of the aborted, to where they were aborted. Of completed trips this is their
        experienced travel time
    delay_so_far_s
        completed trips: that time minus ``free_time_s``, of the fastest route at free flow; others:
        minus the free-flow time of what they have driven (:func:`free_time_of_the_driven`)

    The last three are NaN for those who wanted to depart after the end. Weighted by ``vehicles``
    they add up to the summary of the run.

    Raises :class:`uxsim_geo.errors.InputError` if ``vehicles`` is empty or not among the trips, or
    if the result is of another network.
    """
    trips, end = result.trips, result.settings.duration
    chosen = chosen_vehicles(trips, vehicles)
    ends = trip_ends(result)
    depart, enter = (trips[name].to_numpy(float) for name in ("depart_s", "enter_s"))
    until = np.where(depart > end, np.nan, np.where(np.isnan(ends), end, ends))
    completed = (trips["status"] == "completed").to_numpy()
    free_time = np.where(
        completed, trips["free_time_s"].to_numpy(float), free_time_of_the_driven(result, network)
    )
    entered = np.zeros(len(trips), np.int32)
    for piece in result.log.pieces("vehicle"):
        entered += np.bincount(piece["vehicle"], minlength=len(trips)).astype(np.int32)
    table = trips[list(KEPT)].assign(
        end_s=ends,
        links_entered=entered,
        origin_wait_s=np.where(np.isnan(enter), until, enter) - depart,
        travel_time_so_far_s=until - depart,
        delay_so_far_s=until - depart - free_time,
    )
    return table[chosen].reset_index(drop=True)


def free_time_of_the_driven(result: Result, network: Network) -> Floats:
    """Free-flow time of what each trip has driven so far, s per vehicle; one entry a trip.

    L/u of the links it has left, and of the link it is on the rest of its distance over u. Free
    flow is that of the links without control.
    """
    check_links(result, network)
    length, speed = (network.links[name].to_numpy(float) for name in ("length", "free_speed"))
    trips = len(result.trips)
    free_time, metres, speed_now = np.zeros(trips), np.zeros(trips), np.full(trips, np.nan)
    for piece in result.log.pieces("vehicle", "link", "exit_s"):
        left = ~np.isnan(piece["exit_s"])
        vehicle, link = piece["vehicle"][left], piece["link"][left]
        np.add.at(free_time, vehicle, (length / speed)[link])
        np.add.at(metres, vehicle, length[link])
        speed_now[piece["vehicle"][~left]] = speed[piece["link"][~left]]
    on_it = np.flatnonzero(~np.isnan(speed_now))
    rest = result.trips["distance_m"].to_numpy(float)[on_it] - metres[on_it]
    # the two distances are sums in different orders
    free_time[on_it] += np.maximum(rest, 0.0) / speed_now[on_it]
    return free_time


def driving_order(vehicle: npt.NDArray[Any]) -> Integers:
    """Rows of events by ``vehicle``, and then by entry.

    They come in the order of the exits, those without an exit last, which every vehicle keeps.
    """
    return np.argsort(vehicle, kind="stable").astype(np.int64, copy=False)
