"""How many vehicles made which turn at which node."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.analysis.bins import bin_edges, bin_of
from uxsim_geo.analysis.groups import Groups
from uxsim_geo.analysis.subsets import chosen_vehicles, link_rows, names_of
from uxsim_geo.analysis.trips import driving_order
from uxsim_geo.analysis.types import Booleans, Floats, Integers
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result


def turning_counts(
    result: Result,
    network: Network,
    *,
    bin_s: npt.ArrayLike | None = None,
    vehicles: npt.ArrayLike | None = None,
) -> pd.DataFrame:
    """Vehicles by node, link they came from and link they went to.

    ``vehicles`` are rows of the trips (None: all), ``bin_s`` the length of time bins, s, or their
    edges: moves outside of those do not count. One row a turn that somebody made, ordered by
    node, from_link, to_link (in the order of the network's tables) and time: node (node_id),
    from_link, to_link (link_id; all three categorical) and vehicles; with ``bin_s`` also begin_s
    and end_s of the time bin of the move, that in which from_link was left. The start and the end
    of a trip are no turns.

    Raises :class:`uxsim_geo.errors.InputError` for a wrong bin, if ``vehicles`` is empty or not
    among the trips, or if the result is of another network.
    """
    edges = None if bin_s is None else bin_edges(result.settings.duration, bin_s)
    moves = _moves(result, network, chosen_vehicles(result.trips, vehicles))
    slices = np.zeros(len(moves.time), np.int64) if edges is None else bin_of(moves.time, edges)
    inside = slices >= 0
    node = _end_nodes(network)
    by_node = np.argsort(node, kind="stable")
    keys = (np.argsort(by_node)[moves.from_link], moves.to_link, slices)
    groups = Groups.of(*(key[inside] for key in keys))
    from_link = by_node[groups.keys[0]]
    link_ids = network.links["link_id"]
    table: dict[str, Any] = {
        "node": names_of(node[from_link], network.nodes["node_id"]),
        "from_link": names_of(from_link, link_ids),
        "to_link": names_of(groups.keys[1], link_ids),
    }
    if edges is not None:
        slice_ = groups.keys[2]
        table |= {"begin_s": edges[slice_], "end_s": edges[slice_ + 1]}
    weight = result.trips["vehicles"].to_numpy(float)[moves.vehicle[inside]]
    return pd.DataFrame(table | {"vehicles": groups.total(weight)})


class _Moves(NamedTuple):
    """From one link to the next: arrays of one length.

    vehicle (row of the trips), from_link and to_link (rows of the links), time (s).
    """

    vehicle: Integers
    from_link: Integers
    to_link: Integers
    time: Floats


def _moves(result: Result, network: Network, chosen: Booleans) -> _Moves:
    """All moves of the chosen trips."""
    events = result.events
    link = link_rows(result, network)
    order = driving_order(events)
    vehicle = events["vehicle"].to_numpy(np.int64)[order]
    before = np.flatnonzero((vehicle[1:] == vehicle[:-1]) & chosen[vehicle[1:]])
    came_from, went_to = order[before], order[before + 1]
    time = events["exit_s"].to_numpy(float)[came_from]
    return _Moves(vehicle[before], link[came_from], link[went_to], time)


def _end_nodes(network: Network) -> Integers:
    """The row of the node at which each link ends."""
    ids = pd.Index(network.nodes["node_id"].astype(str))
    return ids.get_indexer(pd.Index(network.links["to_node_id"].astype(str))).astype(np.int64)
