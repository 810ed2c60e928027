"""The figures of a whole run: what ``summary.json`` holds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.analysis.network_states import trip_ends
from uxsim_geo.analysis.passages import Floats, Passages
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result


def summary(network: Network, result: Result) -> dict[str, Any]:
    """Figures of a run, all in vehicles (a platoon counts by its size), SI units.

    Those who wanted to depart after the end are demanded but not departed, and nothing else here
    includes them. ``None`` stands for an average of nobody. Definitions:

    total_travel_time_veh_s
        from the wish to depart to the arrival; for those who wait or run, to the end of the
        simulation; for aborted trips, to where they were aborted
    total_delay_veh_s
        completed trips: travel time minus that of the fastest route at free flow; others: travel
        time minus the free-flow time of what they have driven of their own route so far; free flow
        is that of the links without control, so that what a speed limit costs is delay
    completed
        the same two as averages over the completed trips
    total_distance_veh_m, average_speed_m_s
        distance driven by all, and that divided by the time all spent on the links
    gridlocked
        some vehicles wait for one another in circles and can never move again
    """
    trips = _with_times(network, result)
    departed = trips[trips["depart_s"] <= result.settings.duration]
    completed = departed[departed["status"] == "completed"]
    vehicles = departed["vehicles"]
    counts = {
        f"vehicles_{status}": _whole(vehicles[departed["status"] == status].sum())
        for status in ("completed", "running", "waiting", "aborted")
    }
    distance = float((vehicles * departed["distance_m"]).sum())
    on_links = float((vehicles * departed["time_on_links"]).sum())
    return {
        "vehicles_demanded": _whole(trips["vehicles"].sum()),
        "vehicles_departed": _whole(vehicles.sum()),
        **counts,
        "total_travel_time_veh_s": float((vehicles * departed["travel_time"]).sum()),
        "total_delay_veh_s": float((vehicles * departed["delay"]).sum()),
        "completed": {
            "average_travel_time_s": _mean(completed["travel_time"], completed["vehicles"]),
            "average_delay_s": _mean(completed["delay"], completed["vehicles"]),
        },
        "total_distance_veh_m": distance,
        "average_speed_m_s": distance / on_links if on_links > 0 else None,
        "gridlocked": result.locked_vehicles > 0,
        "engine_wall_s": result.engine_wall_s,
        "seed": result.settings.seed,
    }


def _with_times(network: Network, result: Result) -> pd.DataFrame:
    """The trips with travel_time, delay and time_on_links, s per vehicle, up to the end."""
    trips, end = result.trips, result.settings.duration
    until = np.nan_to_num(trip_ends(result.events, trips), nan=end)
    travel_time = until - trips["depart_s"].to_numpy(float)
    completed = (trips["status"] == "completed").to_numpy()
    free_time = np.where(
        completed, trips["free_time_s"].to_numpy(float), _free_time_so_far(network, result)
    )
    on_links = until - trips["enter_s"].to_numpy(float)
    return trips.assign(
        travel_time=travel_time,
        delay=travel_time - free_time,
        time_on_links=np.nan_to_num(on_links, nan=0.0),
    )


def _free_time_so_far(network: Network, result: Result) -> Floats:
    """Free-flow time of what each platoon has driven until the end, s; one entry a trip."""
    passages = Passages.of(
        network, result.events, result.trips, result.settings, result.speed_limits
    )
    driven = passages.geometry.length[passages.link]
    rows = np.flatnonzero(passages.exit > result.settings.duration)
    driven[rows] = passages.positions(rows, np.full(len(rows), result.settings.duration))
    free_time = driven / passages.geometry.free_speed[passages.link]
    sums = np.bincount(passages.vehicle, weights=free_time, minlength=len(result.trips))
    return sums.astype(np.float64, copy=False)


def _mean(values: pd.Series, weights: pd.Series) -> float | None:
    total = float(weights.sum())
    return float((values * weights).sum()) / total if total > 0 else None


def _whole(vehicles: Any) -> int | float:
    """A count as an int where it is one."""
    number = float(vehicles)
    return int(number) if number.is_integer() else number
