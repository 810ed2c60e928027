"""How many vehicles made which turn at which node."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.analysis.bins import bin_edges, bin_of
from uxsim_geo.analysis.groups import Groups
from uxsim_geo.analysis.subsets import check_links, chosen_vehicles, names_of
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
    chosen = chosen_vehicles(result.trips, vehicles)
    weight = result.trips["vehicles"].to_numpy(float)
    node = _end_nodes(network)
    by_node = np.argsort(node, kind="stable")
    rank = np.argsort(by_node)
    keys, made = [np.empty((3, 0), np.int64)], [np.empty(0)]
    for moves in _moves(result, network, chosen):
        slices = np.zeros(len(moves.time), np.int64) if edges is None else bin_of(moves.time, edges)
        inside = slices >= 0
        own = (rank[moves.from_link], moves.to_link, slices)
        groups = Groups.of(*(key[inside] for key in own))
        keys.append(np.stack(groups.keys))
        made.append(groups.total(weight[moves.vehicle[inside]]))
    groups = Groups.of(*np.concatenate(keys, axis=1))
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
    return pd.DataFrame(table | {"vehicles": groups.total(np.concatenate(made))})


class _Moves(NamedTuple):
    """From one link to the next: arrays of one length.

    vehicle (row of the trips), from_link and to_link (rows of the links), time (s).
    """

    vehicle: Integers
    from_link: Integers
    to_link: Integers
    time: Floats


def _moves(result: Result, network: Network, chosen: Booleans) -> Iterator[_Moves]:
    """All moves of the chosen trips, by pieces of the events: each ends where a link is entered."""
    check_links(result, network)
    link_before = np.full(len(chosen), -1, np.int64)  # of each trip, as below
    left = np.full(len(chosen), np.nan)
    for piece in result.log.pieces("vehicle", "link", "exit_s"):
        order = driving_order(piece["vehicle"])
        vehicle, link, leave = (piece[name][order] for name in ("vehicle", "link", "exit_s"))
        begins = np.concatenate(([True], vehicle[1:] != vehicle[:-1]))
        came_from = np.where(begins, link_before[vehicle], np.roll(link, 1))
        time = np.where(begins, left[vehicle], np.roll(leave, 1))
        last = np.roll(begins, -1)
        link_before[vehicle[last]], left[vehicle[last]] = link[last], leave[last]
        moved = chosen[vehicle] & (came_from >= 0)
        yield _Moves(*(values[moved] for values in (vehicle, came_from, link, time)))


def _end_nodes(network: Network) -> Integers:
    """The row of the node at which each link ends."""
    ids = pd.Index(network.nodes["node_id"].astype(str))
    return ids.get_indexer(pd.Index(network.links["to_node_id"].astype(str))).astype(np.int64)
