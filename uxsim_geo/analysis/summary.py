"""The figures of a whole run: what ``summary.json`` holds."""

from __future__ import annotations

from typing import Any

import numpy.typing as npt
import pandas as pd

from uxsim_geo.analysis.trips import trip_summary
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result


def summary(
    result: Result, network: Network, *, vehicles: npt.ArrayLike | None = None
) -> dict[str, Any]:
    """Figures of a run, all in vehicles (a platoon counts by its size), SI units.

    ``vehicles`` are rows of the trips that alone count (None: all).

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
        some vehicles, whoever is counted, wait for one another in circles and can never move again

    Raises :class:`uxsim_geo.errors.InputError` if ``vehicles`` is empty or not among the trips, or
    if the result is of another network.
    """
    trips = trip_summary(result, network, vehicles=vehicles)
    departed = trips[trips["depart_s"] <= result.settings.duration]
    completed = departed[departed["status"] == "completed"]
    number = departed["vehicles"]
    counts = {
        f"vehicles_{status}": _whole(number[departed["status"] == status].sum())
        for status in ("completed", "running", "waiting", "aborted")
    }
    travel_time = departed["travel_time_so_far_s"]
    distance = float((number * departed["distance_m"]).sum())
    on_links = float((number * (travel_time - departed["origin_wait_s"])).sum())
    return {
        "vehicles_demanded": _whole(trips["vehicles"].sum()),
        "vehicles_departed": _whole(number.sum()),
        **counts,
        "total_travel_time_veh_s": float((number * travel_time).sum()),
        "total_delay_veh_s": float((number * departed["delay_so_far_s"]).sum()),
        "completed": {
            "average_travel_time_s": _mean(completed, "travel_time_so_far_s"),
            "average_delay_s": _mean(completed, "delay_so_far_s"),
        },
        "total_distance_veh_m": distance,
        "average_speed_m_s": distance / on_links if on_links > 0 else None,
        "gridlocked": result.locked_vehicles > 0,
        "engine_wall_s": result.engine_wall_s,
        "seed": result.settings.seed,
    }


def _mean(trips: pd.DataFrame, column: str) -> float | None:
    values, weights = trips[column], trips["vehicles"]
    total = float(weights.sum())
    return float((values * weights).sum()) / total if total > 0 else None


def _whole(vehicles: Any) -> int | float:
    """A count as an int where it is one."""
    number = float(vehicles)
    return int(number) if number.is_integer() else number
