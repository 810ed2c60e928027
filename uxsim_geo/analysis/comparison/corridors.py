"""Travel times along corridors: paths of links, for those who drove all of them, by time bin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from uxsim_geo.analysis.bins import bin_of
from uxsim_geo.analysis.edie import ratio
from uxsim_geo.analysis.state_grid import StateGrid
from uxsim_geo.analysis.subsets import check_links
from uxsim_geo.analysis.trips import driving_order
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.errors import Faults
from uxsim_geo.events import COLUMNS
from uxsim_geo.network.network import Network
from uxsim_geo.network.rows import count_within
from uxsim_geo.result import Result

#: name of each corridor → its link_ids, in the order in which they are driven
Corridors = Mapping[str, Sequence[str]]


def corridor_times(
    result: Result, network: Network, corridors: Corridors, states: pd.DataFrame
) -> pd.DataFrame:
    """Every corridor of which the network has all links, in every time bin of ``states``.

    ``states`` are all links by time bins, as
    :func:`uxsim_geo.analysis.link_states.link_times` gives them. One row a corridor and bin:
    corridor, begin_s, end_s, and the quantities
    :data:`uxsim_geo.analysis.comparison.quantities.CORRIDORS`. The bin of a vehicle is that in
    which it entered the first link; who had not left the last link at the end of the simulation
    does not count, so that the last bins are of the faster ones.
    """
    grid = StateGrid.of_all(states, network)
    edges = np.append(grid.begin, grid.end[-1])
    ids = pd.Index(network.links["link_id"].astype(str))
    paths = {
        name: ids.get_indexer(pd.Index(link_ids, dtype=object)).astype(np.int64)
        for name, link_ids in corridors.items()
    }
    drives = _Drives(result, network, np.concatenate([np.empty(0, np.int64), *paths.values()]))
    # of a link that nobody is on, closed or not, the speed is not known
    instantaneous = np.where(
        grid.values("time") > 0, grid.values("instantaneous_travel_time"), np.nan
    )
    tables = [_table("", edges, np.zeros((3, 0)))]
    for name, path in paths.items():
        if (path < 0).any():
            continue
        vehicles, time = drives.along(path, edges)
        values = np.stack((vehicles, time, instantaneous[path].sum(axis=0)))
        tables.append(_table(name, edges, values))
    return pd.concat(tables, ignore_index=True)


def check_corridors(corridors: Corridors, network: Network) -> None:
    """Raise :class:`uxsim_geo.errors.InputError` with every corridor that is no path of links."""
    faults = Faults("corridors")
    links = network.links.set_index(network.links["link_id"].astype(str))
    for name, path in corridors.items():
        unknown = [link for link in path if link not in links.index]
        for link in unknown:
            faults.add("the network has no such link", column=name, value=link)
        if not path:
            faults.add("names no link: name one at least", column=name)
        if unknown or not path:
            continue
        ends, starts = links["to_node_id"].loc[list(path)], links["from_node_id"].loc[list(path)]
        for before, after, end, start in zip(path, path[1:], ends, starts[1:], strict=False):
            if end != start:
                what = f"link {after} does not begin where link {before} ends, at node {end}"
                faults.add(what, column=name, value=after)
    faults.raise_if_any()


class _Drives:
    """Entries to some links (rows of the table) by vehicle, in the order in which they were driven.

    place
        of the entry in the whole drive of its vehicle, from 0
    """

    def __init__(self, result: Result, network: Network, links: Integers) -> None:
        check_links(result, network)
        wanted = np.isin(np.arange(len(network.links)), links)
        before = np.zeros(len(result.trips), np.int64)
        parts = []
        for piece in result.log.pieces(*COLUMNS):
            place = before[piece["vehicle"]] + count_within(piece["vehicle"])
            before[piece["vehicle"]] = place + 1
            rows = wanted[piece["link"]]
            parts.append([*(piece[name][rows] for name in COLUMNS), place[rows]])
        nothing = [np.empty(0, kind) for kind in (int, int, float, float, int)]
        vehicle, *columns = (np.concatenate(some) for some in zip(nothing, *parts, strict=True))
        order = driving_order(vehicle)
        self.vehicle = vehicle[order]
        self.link, self.enter, self.exit, self.place = (values[order] for values in columns)
        self.vehicles = result.trips["vehicles"].to_numpy(float)

    def along(self, path: Integers, edges: Floats) -> tuple[Floats, Floats]:
        """Vehicles that drove a path of links (rows) to its end, by bin, and their mean time."""
        first = np.flatnonzero(self.link[: len(self.link) - len(path) + 1] == path[0])
        last = first + len(path) - 1
        follows = self.vehicle[first] == self.vehicle[last]
        follows &= self.place[last] - self.place[first] == len(path) - 1
        for place, link in enumerate(path):
            follows &= self.link[first + place] == link
        first, last = first[follows], last[follows]
        slices = bin_of(self.enter[first], edges)
        counted = ~np.isnan(self.exit[last]) & (slices >= 0)
        first, last, slices = first[counted], last[counted], slices[counted]
        weight = self.vehicles[self.vehicle[first]]
        bins = len(edges) - 1
        number = np.bincount(slices, weight, minlength=bins).astype(np.float64, copy=False)
        time = weight * (self.exit[last] - self.enter[first])
        spent = np.bincount(slices, time, minlength=bins).astype(np.float64, copy=False)
        return number, ratio(spent, number)


def _table(name: str, edges: Floats, values: Floats) -> pd.DataFrame:
    """Rows of one corridor; ``values`` are vehicles and both times by bin, or of no bin at all."""
    bins = values.shape[1]
    return pd.DataFrame(
        {
            "corridor": pd.Series([name] * bins, dtype="str"),
            "begin_s": edges[:bins],
            "end_s": edges[1 : bins + 1],
            "vehicles_veh": values[0],
            "experienced_travel_time_s": values[1],
            "instantaneous_travel_time_s": values[2],
        }
    )
