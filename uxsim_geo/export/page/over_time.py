"""The network as a whole over time: vehicles, speed, and its fundamental diagram."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from uxsim_geo.analysis.edie import ratio
from uxsim_geo.analysis.network_states import trip_ends, vehicle_counts
from uxsim_geo.analysis.state_grid import StateGrid
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.network.units import KMH, PER_HOUR
from uxsim_geo.result import Result


class OverTime(NamedTuple):
    """Figures of all links together in the page's time bins.

    edges (s); accumulation (vehicles on the road, mean of the bin), production (veh·km/h), speed
    (km/h, NaN while nobody drives), speed_ratio (time at free speed / time), queue (vehicles queued
    at the bin's end), running, waiting (vehicles at the bin's end), arrivals (veh/h).
    """

    edges: Floats
    accumulation: Floats
    production: Floats
    speed: Floats
    speed_ratio: Floats
    queue: Floats
    running: Floats
    waiting: Floats
    arrivals: Floats


def over_time(grid: StateGrid, result: Result, first: Integers) -> OverTime:
    """Sum all links; bins that the page puts together are put together here too."""
    edges = np.append(grid.begin[first], grid.end[-1])
    length = np.diff(edges)
    distance, time, delay = (
        np.add.reduceat(grid.values(name).sum(axis=0), first)
        for name in ("distance", "time", "delay")
    )
    last = np.append(first[1:], len(grid.begin)) - 1
    counts = vehicle_counts(result.trips, trip_ends(result), edges)
    return OverTime(
        edges,
        time / length,
        distance / length * PER_HOUR / 1000.0,
        ratio(distance, time) * KMH,
        1.0 - ratio(delay, time),
        grid.values("queue").sum(axis=0)[last],
        counts["running"].to_numpy(float)[1:],
        counts["waiting"].to_numpy(float)[1:],
        np.diff(counts["completed"].to_numpy(float)) / length * PER_HOUR,
    )
