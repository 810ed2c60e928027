"""Where the vehicles, or some of them, are at chosen moments: at home, on the road, arrived."""

from __future__ import annotations

import numpy.typing as npt
import pandas as pd

from uxsim_geo.analysis.network_states import trip_ends, vehicle_counts
from uxsim_geo.analysis.samples import checked_moments
from uxsim_geo.analysis.subsets import chosen_vehicles
from uxsim_geo.result import Result


def vehicles_over_time(
    result: Result, times: npt.ArrayLike, *, vehicles: npt.ArrayLike | None = None
) -> pd.DataFrame:
    """How many vehicles wait, run, have completed or given up their trips at each moment.

    ``times`` are s after the start, from 0 to the end of the simulation, in any order; ``vehicles``
    rows of the trips (None: all). Columns as of
    :func:`uxsim_geo.analysis.network_states.vehicle_counts`, and demanded: all vehicles, whenever
    they depart. One row a moment, in the order given; departed = waiting + running + completed +
    aborted.

    Raises :class:`uxsim_geo.errors.InputError` if ``times`` is empty or leaves the simulation, or
    if ``vehicles`` is empty or not among the trips.
    """
    moments = checked_moments(times, result.settings.duration)
    chosen = chosen_vehicles(result.trips, vehicles)
    trips = result.trips[chosen].reset_index(drop=True)
    counts = vehicle_counts(trips, trip_ends(result)[chosen], moments)
    counts.insert(1, "demanded", float(trips["vehicles"].sum()))
    return counts
