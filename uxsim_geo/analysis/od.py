"""Trips by origin and destination, by class of drivers and by the time of departure."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.analysis.bins import bin_edges, bin_of
from uxsim_geo.analysis.groups import Groups
from uxsim_geo.analysis.subsets import chosen_vehicles, names_of, node_rows
from uxsim_geo.analysis.trips import trip_summary
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result

#: of experienced travel times
PERCENTS = (5, 50, 95)


def od_table(
    result: Result,
    network: Network,
    *,
    bin_s: npt.ArrayLike | None = None,
    by_class: bool = False,
    vehicles: npt.ArrayLike | None = None,
) -> pd.DataFrame:
    """Trips of every pair that has any, with their times, delays, distances and tolls.

    ``vehicles`` are rows of the trips (None: all), ``bin_s`` the length of the slices, s, or their
    edges, as of :func:`uxsim_geo.analysis.bins.bin_edges`. Rows are ordered by origin and
    destination (in the order of the nodes table), class (in that of its categories) and departure.
    A platoon counts by its vehicles; all but the counts and the total are means per vehicle.
    Columns:

    origin, destination (node_id, categorical)
    class (categorical)
        with ``by_class``
    begin_s, end_s
        with ``bin_s``: the slice of the wish to depart; who wanted to depart after the end of the
        simulation is in a slice of its own, from there to infinity. Edges that do not go from the
        start to the end leave out who wanted to depart before the first or after the last
    vehicles_demanded, vehicles_departed, vehicles_completed, vehicles_unfinished, vehicles_aborted
        the unfinished wait or run at the end; departed are the three together, demanded those
        who wanted to depart after the end too
    experienced_travel_time_completed_only_s, and _p05_, _p50_, _p95_
        from the wish to depart to the arrival: mean and percentiles, the time within which that
        share of the vehicles arrived
    delay_completed_only_s
        that time minus the one of the fastest route at free flow
    distance_completed_only_m, toll_completed_only (currency)
    travel_time_so_far_s, delay_so_far_s
        of all departed, the unfinished up to the end, as in
        :func:`uxsim_geo.analysis.trips.trip_summary`
    total_delay_so_far_veh_s
        its sum over the vehicles; over all pairs that of the run's summary

    Figures of nobody are NaN.

    Raises :class:`uxsim_geo.errors.InputError` for a wrong bin, if ``vehicles`` is empty or not
    among the trips, or if the result is of another network.
    """
    edges = None if bin_s is None else bin_edges(result.settings.duration, bin_s)
    chosen = chosen_vehicles(result.trips, vehicles)
    trips = trip_summary(result, network, vehicles=vehicles)
    slices = _slices(trips, edges, result.settings.duration)
    inside = slices >= 0
    rows, trips, slices = np.flatnonzero(chosen)[inside], trips[inside], slices[inside]
    classes = pd.Categorical(trips["class"])
    keys = [node_rows(result, network, end)[rows] for end in ("origin", "destination")]
    keys += [classes.codes.astype(np.int64)] if by_class else []
    keys += [] if edges is None else [slices]
    groups = Groups.of(*keys)
    ids = network.nodes["node_id"]
    names: dict[str, Any] = {
        "origin": names_of(groups.keys[0], ids),
        "destination": names_of(groups.keys[1], ids),
    }
    if by_class:
        names["class"] = pd.Categorical.from_codes(groups.keys[2], dtype=classes.dtype)
    if edges is not None:
        slice_ = groups.keys[-1]
        names |= {"begin_s": edges[slice_], "end_s": np.append(edges[1:], np.inf)[slice_]}
    return pd.DataFrame(names | od_of_groups(trips, groups, result.settings.duration))


def od_of_groups(trips: pd.DataFrame, groups: Groups, duration: float) -> dict[str, Floats]:
    """The columns of :func:`od_table` from vehicles_demanded on, of any groups of trips.

    ``trips`` are rows of :func:`uxsim_geo.analysis.trips.trip_summary`, ``groups`` says in which
    group each of them is, ``duration`` is that of the simulation, s.
    """
    departed = (trips["depart_s"] <= duration).to_numpy()
    return _counts(trips, departed, groups) | _means(trips, departed, groups)


def _slices(trips: pd.DataFrame, edges: Floats | None, duration: float) -> Integers:
    """The slice of each departure, -1: none; one more than there are for those after the end."""
    depart = trips["depart_s"].to_numpy(float)
    if edges is None:
        return np.zeros(len(depart), np.int64)
    slices = bin_of(depart, edges)
    if edges[-1] < duration:
        return slices
    return np.where(depart > duration, len(edges) - 1, slices)


def _counts(
    trips: pd.DataFrame, departed: npt.NDArray[np.bool_], groups: Groups
) -> dict[str, Floats]:
    vehicles = trips["vehicles"].to_numpy(float)
    unfinished = departed & trips["status"].isin(["waiting", "running"]).to_numpy()
    return {
        "vehicles_demanded": groups.total(vehicles),
        "vehicles_departed": groups.total(vehicles * departed),
        "vehicles_completed": groups.total(vehicles * (trips["status"] == "completed").to_numpy()),
        "vehicles_unfinished": groups.total(vehicles * unfinished),
        "vehicles_aborted": groups.total(
            vehicles * (departed & (trips["status"] == "aborted").to_numpy())
        ),
    }


def _means(
    trips: pd.DataFrame, departed: npt.NDArray[np.bool_], groups: Groups
) -> dict[str, Floats]:
    vehicles = trips["vehicles"].to_numpy(float)
    completed = vehicles * (trips["status"] == "completed").to_numpy()
    time, delay, distance, toll = (
        trips[name].to_numpy(float)
        for name in ("travel_time_so_far_s", "delay_so_far_s", "distance_m", "toll")
    )
    percentiles = groups.percentiles(time, completed, PERCENTS)
    name = "experienced_travel_time"
    return {
        f"{name}_completed_only_s": groups.mean(time, completed),
        **{
            f"{name}_p{percent:02}_completed_only_s": values
            for percent, values in zip(PERCENTS, percentiles, strict=True)
        },
        "delay_completed_only_s": groups.mean(delay, completed),
        "distance_completed_only_m": groups.mean(distance, completed),
        "toll_completed_only": groups.mean(toll, completed),
        "travel_time_so_far_s": groups.mean(time, vehicles * departed),
        "delay_so_far_s": groups.mean(delay, vehicles * departed),
        "total_delay_so_far_veh_s": groups.total(np.where(departed, vehicles * delay, 0.0)),
    }
