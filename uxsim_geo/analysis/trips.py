"""What every vehicle did: its route link by link, and its trip in one row."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.analysis.network_states import trip_ends
from uxsim_geo.analysis.subsets import chosen_vehicles, link_rows
from uxsim_geo.analysis.types import Floats, Integers
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
    order = driving_order(result.events)
    if vehicles is not None:
        chosen = chosen_vehicles(result.trips, vehicles)
        order = order[chosen[result.events["vehicle"].to_numpy()[order]]]
    routes = result.events.iloc[order].reset_index(drop=True)
    vehicle = routes["vehicle"].to_numpy()
    rows = np.arange(len(vehicle))
    begins = np.concatenate(([True], vehicle[1:] != vehicle[:-1]))[: len(vehicle)]
    first = np.maximum.accumulate(np.where(begins, rows, 0))
    routes.insert(1, "position", (rows - first).astype(np.int32))
    return routes[["vehicle", "position", "link", "enter_s", "exit_s"]]


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
    ends = trip_ends(result.events, trips)
    depart, enter = (trips[name].to_numpy(float) for name in ("depart_s", "enter_s"))
    until = np.where(depart > end, np.nan, np.where(np.isnan(ends), end, ends))
    completed = (trips["status"] == "completed").to_numpy()
    free_time = np.where(
        completed, trips["free_time_s"].to_numpy(float), free_time_of_the_driven(result, network)
    )
    entered = np.bincount(result.events["vehicle"].to_numpy(), minlength=len(trips))
    table = trips[list(KEPT)].assign(
        end_s=ends,
        links_entered=entered.astype(np.int32),
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
    row, events = link_rows(result, network), result.events
    length, speed = (network.links[name].to_numpy(float)[row] for name in ("length", "free_speed"))
    vehicle = events["vehicle"].to_numpy()
    on_it = np.isnan(events["exit_s"].to_numpy(float))

    def by_trip(values: Floats) -> Floats:
        sums = np.bincount(vehicle[~on_it], values[~on_it], minlength=len(result.trips))
        return sums.astype(np.float64, copy=False)

    free_time = by_trip(length / speed)
    last = vehicle[on_it]
    rest = result.trips["distance_m"].to_numpy(float)[last] - by_trip(length)[last]
    # the two distances are sums in different orders
    free_time[last] += np.maximum(rest, 0.0) / speed[on_it]
    return free_time


def driving_order(events: pd.DataFrame) -> Integers:
    """Rows of the events by vehicle and then by entry.

    They come in the order of the exits, those without an exit last, which every vehicle keeps.
    """
    order = np.argsort(events["vehicle"].to_numpy(), kind="stable")
    return order.astype(np.int64, copy=False)
