"""Travel times between zones by the time of departure: skim matrices, in long form."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.analysis.bins import bin_edges, bin_of
from uxsim_geo.analysis.groups import Groups
from uxsim_geo.analysis.link_states import link_times
from uxsim_geo.analysis.state_grid import StateGrid
from uxsim_geo.analysis.subsets import named_rows, names_of, node_rows
from uxsim_geo.analysis.table_size import MOST_SKIMS, check_rows
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.errors import Faults
from uxsim_geo.network.network import Network
from uxsim_geo.network.paths import Paths
from uxsim_geo.result import Result


def skims(
    result: Result,
    network: Network,
    *,
    bin_s: npt.ArrayLike,
    nodes: Iterable[str] | None = None,
    states: pd.DataFrame | None = None,
) -> pd.DataFrame:
    """Travel times between all pairs of zones by slice of departure, s per vehicle.

    ``nodes`` are the node_ids to go between (None: from all where a trip starts to all where one
    ends). ``states`` are the links by time bins of ``bin_s``, as
    :func:`uxsim_geo.analysis.link_states.link_times` gives them (None: found here). One
    row a pair of different nodes and a slice, ordered by origin and destination (in the order of
    the nodes table) and time:

    origin, destination (node_id, categorical), begin_s, end_s
    vehicles_departed, vehicles_completed
        of those who wanted to depart in this slice
    experienced_travel_time_completed_only_s
        mean from the wish to depart to the arrival; NaN where nobody completed
    instantaneous_travel_time_s
        of the path that is fastest if every link is driven at the mean speed (Edie) that it has in
        this slice: at free speed where it is empty, and at least at a hundredth of that
    free_flow_travel_time_s
        of the path that is fastest if every link is driven at its free speed

    Paths obey banned turns, do not pass nodes without through traffic, and know of no closures;
    both times are NaN where no path leads. Waiting to enter the network is a part of the
    experienced time alone.

    Raises :class:`uxsim_geo.errors.InputError` for a wrong bin, unknown or no nodes, a table
    of over 20 million rows, states of other bins, or a result of another network.
    """
    edges = bin_edges(result.settings.duration, bin_s)
    origin, destination = (node_rows(result, network, end) for end in ("origin", "destination"))
    if nodes is None:
        ends = (np.unique(origin), np.unique(destination))
    else:
        ids = pd.Index(network.nodes["node_id"].astype(str))
        ends = (named_rows(nodes, ids, "nodes"),) * 2
    _check_size(ends, edges)
    times = _times_by_slice(result, network, edges, states)
    paths = Paths.of(network)
    free_flow = _fastest(paths, network.links["length"] / network.links["free_speed"], ends)
    instantaneous = np.stack([_fastest(paths, time, ends) for time in times], axis=-1)
    departures = _Departures(origin, destination, ends, edges)
    columns = departures.table(result.trips) | {
        "instantaneous_travel_time_s": instantaneous,
        "free_flow_travel_time_s": np.broadcast_to(free_flow[..., None], instantaneous.shape),
    }
    return _long_form(network, ends, edges, columns)


@dataclass(frozen=True)
class _Departures:
    """Where every trip starts and ends (rows of the nodes), the ends asked for, and the slices."""

    origin: Integers
    destination: Integers
    ends: tuple[Integers, Integers]
    edges: Floats

    def table(self, trips: pd.DataFrame) -> dict[str, Floats]:
        """Counts and experienced time; arrays of the shape (origins, destinations, slices)."""
        size = (*(len(end) for end in self.ends), len(self.edges) - 1)
        depart = trips["depart_s"].to_numpy(float)
        meant = np.isin(self.origin, self.ends[0]) & np.isin(self.destination, self.ends[1])
        meant &= bin_of(depart, self.edges) >= 0
        start, end = (
            np.searchsorted(rows, at[meant])
            for rows, at in zip(self.ends, (self.origin, self.destination), strict=True)
        )
        groups = Groups.of(start, end, bin_of(depart[meant], self.edges))
        chosen = trips[meant]
        vehicles = chosen["vehicles"].to_numpy(float)
        completed = vehicles * (chosen["status"] == "completed").to_numpy()
        time = (chosen["arrive_s"] - chosen["depart_s"]).to_numpy(float)

        def spread(values: Floats, absent: float) -> Floats:
            matrix = np.full(size, absent)
            matrix[groups.keys] = values
            return matrix

        return {
            "vehicles_departed": spread(groups.total(vehicles), 0.0),
            "vehicles_completed": spread(groups.total(completed), 0.0),
            "experienced_travel_time_completed_only_s": spread(
                groups.mean(time, completed), np.nan
            ),
        }


def _fastest(paths: Paths, link_time: npt.ArrayLike, ends: tuple[Integers, Integers]) -> Floats:
    """Least sum of the links' times, s, from each origin to each destination; NaN: no path."""
    origins, destinations = ends
    least = paths.shortest(link_time, origins)[:, destinations]
    found: Floats = np.where(np.isinf(least), np.nan, least)
    return found


def _check_size(ends: tuple[Integers, Integers], edges: Floats) -> None:
    rows = len(ends[0]) * len(ends[1]) * (len(edges) - 1)
    check_rows(rows, MOST_SKIMS, "nodes", "choose fewer nodes, or longer bins")


def _times_by_slice(
    result: Result, network: Network, edges: Floats, states: pd.DataFrame | None
) -> Floats:
    """Time to drive each link at its speed in each slice, s; shape (slices, links)."""
    if states is None:
        states = link_times(result, network, bin_s=edges)
    grid = StateGrid.of_all(states, network)
    if not np.array_equal(grid.begin, edges[:-1]):
        faults = Faults("states")
        faults.add("must be of the time bins of bin_s", column="begin_s")
        faults.raise_if_any()
    return grid.values("instantaneous_travel_time").T


def _long_form(
    network: Network,
    ends: tuple[Integers, Integers],
    edges: Floats,
    columns: dict[str, Floats],
) -> pd.DataFrame:
    """One row a pair of different nodes and a slice, from arrays of that shape."""
    origins, destinations, slices = len(ends[0]), len(ends[1]), len(edges) - 1
    start = np.repeat(ends[0], destinations * slices)
    end = np.tile(np.repeat(ends[1], slices), origins)
    slice_ = np.tile(np.arange(slices), origins * destinations)
    apart = start != end
    names = {
        name: names_of(rows[apart], network.nodes["node_id"])
        for name, rows in (("origin", start), ("destination", end))
    }
    slice_ = slice_[apart]
    times = {"begin_s": edges[slice_], "end_s": edges[slice_ + 1]}
    return pd.DataFrame(
        {**names, **times, **{name: values.ravel()[apart] for name, values in columns.items()}}
    )
