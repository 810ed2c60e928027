"""Which links meet where: the tables of a network as rows of arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.errors import Faults
from uxsim_geo.network.network import Network
from uxsim_geo.network.rows import count_within, numbers

Rows = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]


#: turns of a network, whatever its size; and beyond that for each link
MOST_TURNS = 10_000_000
TURNS_OF_A_LINK = 20


@dataclass(frozen=True)
class Ends:
    """Rows of the nodes at which links start and end; (links,) each, and the number of nodes."""

    start: Rows
    end: Rows
    nodes: int


@dataclass(frozen=True)
class Turns:
    """Pairs of links of which one ends where the other starts; (pairs,) each.

    before, after
        rows of links, sorted by ``before``
    banned
        whether ``movements`` ban the pair, whatever link came before it
    back
        whether the second is the way back along the first
    """

    before: Rows
    after: Rows
    banned: Flags
    back: Flags


@dataclass(frozen=True)
class Grouped:
    """Rows grouped by a number that each has, 0 and up.

    rows
        sorted by their number, as they were among those of one number; (rows,)
    first
        where those of each number begin; (numbers + 1,)
    """

    rows: Rows
    first: Rows

    @classmethod
    def of(cls, number: Rows, numbers: int) -> Grouped:
        """Group rows by their numbers, which are below ``numbers``."""
        rows = np.argsort(number, kind="stable")
        return cls(rows, np.searchsorted(number[rows], np.arange(numbers + 1)))

    def rows_of_one(self, number: int) -> Rows:
        """Rows of one number."""
        return self.rows[self.first[number] : self.first[number + 1]]

    def rows_of(self, some: Rows) -> Rows:
        """Rows of some numbers, those of one number after those of the one before."""
        first, size = self.first[some], self.first[some + 1] - self.first[some]
        before = np.cumsum(size) - size
        rows: Rows = self.rows[np.arange(int(size.sum())) + np.repeat(first - before, size)]
        return rows


def ends_of(network: Network) -> Ends:
    """Rows of the end nodes of each link; ids are taken to be known (see ``check_network``)."""
    ids = pd.Index(network.nodes["node_id"])
    start, end = (
        np.asarray(ids.get_indexer(pd.Index(network.links[column])), dtype=np.int64)
        for column in ("from_node_id", "to_node_id")
    )
    return Ends(start, end, len(ids))


def signals_of_nodes(network: Network) -> Flags:
    """Nodes that have a signal; (nodes,)."""
    if "control" not in network.nodes:
        return np.zeros(len(network.nodes), dtype=bool)
    return np.asarray(network.nodes["control"] == "signal", dtype=bool)


def passed_nodes(network: Network) -> Flags:
    """Nodes of no zone, over which traffic may pass; (nodes,)."""
    nodes = network.nodes
    passed = np.ones(len(nodes), dtype=bool)
    if "zone_id" in nodes:
        passed &= np.asarray(nodes["zone_id"].isna(), dtype=bool)
    if "through_traffic" in nodes:
        passed &= np.asarray(nodes["through_traffic"], dtype=bool)
    return passed


def turns_of(network: Network, ends: Ends) -> Turns:
    """Every pair of links that meet, in the order of the first link's row.

    Raises :class:`uxsim_geo.errors.InputError` where they are so many that it is no road network.
    """
    _check_turns(network, ends)
    leaving = np.argsort(ends.start, kind="stable")
    first = np.searchsorted(ends.start[leaving], np.arange(ends.nodes + 1))
    number = np.diff(first)[ends.end]
    before = np.repeat(np.arange(len(ends.end)), number)
    place = np.arange(len(before)) - np.repeat(np.cumsum(number) - number, number)
    after = leaving[np.repeat(first[ends.end], number) + place]
    banned = np.isin(before * len(ends.end) + after, _plain_bans(network))
    return Turns(before, after, banned, twins_of(network, ends)[before] == after)


def _check_turns(network: Network, ends: Ends) -> None:
    """Refuse nodes at which thousands of links meet: each pair of them is a turn."""
    into, out = (np.bincount(side, minlength=ends.nodes) for side in (ends.end, ends.start))
    turns = into * out
    if turns.sum() <= max(MOST_TURNS, TURNS_OF_A_LINK * len(ends.end)):
        return
    node = int(np.argmax(turns))
    faults = Faults("nodes")
    faults.add(
        f"{turns.sum():,} turns from link to link are more than a road network has: at this node "
        f"{into[node]:,} links end and {out[node]:,} start; are links there several times?",
        column="node_id",
        value=network.nodes["node_id"].iloc[node],
    )
    faults.raise_if_any()


def _plain_bans(network: Network) -> Rows:
    """Row of the first link times the number of links plus row of the second, of each ban."""
    movements = network.movements
    if "via_link_ids" in movements:
        movements = movements[movements["via_link_ids"].isna()]
    ids = pd.Index(network.links["link_id"])
    rows = [ids.get_indexer(pd.Index(movements[f"{end}_link_id"])) for end in ("from", "to")]
    known = (rows[0] >= 0) & (rows[1] >= 0)
    return np.asarray(rows[0][known].astype(np.int64) * len(ids) + rows[1][known])


def twins_of(network: Network, ends: Ends) -> Rows:
    """Row of the link that is the way back along each link, -1 where there is none.

    That is a link between the same nodes the other way, of the same length to the millimetre.
    """
    known = np.nan_to_num(numbers(network.links["length"]))
    length = np.round(known * 1000.0).astype(np.int64)
    low, high = np.minimum(ends.start, ends.end), np.maximum(ends.start, ends.end)
    against = ends.start > ends.end
    order = np.lexsort((rank_of(network.links["link_id"]), against, length, high, low))
    group = np.stack([low, high, length], axis=1)[order]
    new = np.ones(len(order), dtype=bool)
    new[1:] = (group[1:] != group[:-1]).any(axis=1)
    number = np.cumsum(new) - 1
    # where two roads of one length lie side by side, the first link is paired with the first back
    side = against[order].astype(np.int64)
    place = count_within(2 * number + side)
    key = number * (len(order) + 1) + place
    twins = np.full(len(order), -1, dtype=np.int64)
    _, one, other = np.intersect1d(key[side == 0], key[side == 1], return_indices=True)
    ahead, back = order[side == 0][one], order[side == 1][other]
    twins[ahead], twins[back] = back, ahead
    return twins


def rank_of(ids: pd.Series) -> Rows:
    """Place of each id among all, shorter ids first: numbers in text stand in their order.

    What is decided by rank does not depend on the order of the rows.
    """
    text = ids.astype("str")
    order = np.lexsort((text.to_numpy(dtype=object).astype("U"), text.str.len().to_numpy()))
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    return rank


def without(network: Network, dropped: Flags) -> Network:
    """The network without some links, the nodes left without links, and bans that name them."""
    links = network.links[~dropped].reset_index(drop=True)
    used = pd.Index(pd.concat([links["from_node_id"], links["to_node_id"]]).unique())
    nodes = network.nodes[used.get_indexer(pd.Index(network.nodes["node_id"])) >= 0]
    gone = pd.Index(network.links["link_id"][dropped])
    movements = network.movements
    lost = np.zeros(len(movements), dtype=bool)
    for column in ("from_link_id", "to_link_id"):
        lost |= gone.get_indexer(pd.Index(movements[column])) >= 0
    if "via_link_ids" in movements:
        names = set(gone)
        between = movements["via_link_ids"].fillna("").str.split()
        lost |= np.array([not names.isdisjoint(ids) for ids in between], dtype=bool)
    movements = movements[~lost].reset_index(drop=True)
    return Network(nodes.reset_index(drop=True), links, movements, network.notes)
