"""Pairs of places over the pairs of their access nodes, each with its part."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.demand.access import ENDS, Access
from uxsim_geo.demand.demand import DEMAND_COLUMNS
from uxsim_geo.demand.od_table import CLASS, TIMES, Ends, ordered, vehicles_of
from uxsim_geo.demand.reachable import reachable_pairs
from uxsim_geo.errors import Faults
from uxsim_geo.network.network import Network

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Booleans = npt.NDArray[np.bool_]

#: rows of the demand; more would take several GB
MOST_ROWS = 50_000_000

#: why a pair makes no demand; the place of each is its code, that of the first: it makes some
REASONS = ("", "unknown place", "no access node", "intrazonal", "same access node", "no path")
NONE, UNKNOWN, NO_ACCESS, INTRAZONAL, ONE_NODE, UNREACHABLE = range(len(REASONS))


class Pairs(NamedTuple):
    """Pairs of places that have vehicles, and the pairs of nodes that serve each.

    of_row
        the pair of every row of the table; shape (rows,)
    reason, unreached
        why each pair makes no demand, a place in :data:`REASONS`; whether no path leads between
        any of its nodes; shape (pairs,)
    pair, start, end, share
        the pairs of nodes that are used: which pair they serve, both nodes as positions in
        ``nodes``, and their part of it; shape (pairs of nodes,)
    """

    of_row: Ints
    reason: Ints
    unreached: Booleans
    nodes: pd.Index[str]
    pair: Ints
    start: Ints
    end: Ints
    share: Floats

    def spread(self, table: pd.DataFrame) -> pd.DataFrame:
        """The demand table: every row once for each pair of nodes that serves its pair."""
        count = np.bincount(self.pair, minlength=len(self.reason))
        many = count[self.of_row]
        _check_size(int(many.sum()))
        row, within = _runs(many)
        served = (np.cumsum(count) - count)[self.of_row][row] + within
        columns = {
            "origin": _named(self.start[served], self.nodes),
            "destination": _named(self.end[served], self.nodes),
            **{name: table[name].to_numpy(np.float64)[row] for name in TIMES},
            "vehicles": vehicles_of(table)[row] * self.share[served],
        }
        spread = pd.DataFrame(columns)[list(DEMAND_COLUMNS)]
        if CLASS in table:
            spread[CLASS] = table[CLASS].array[row]
        return ordered(spread[spread["vehicles"] > 0]).reset_index(drop=True)


def served_pairs(ends: Ends, access: Access, network: Network, *, keep: bool) -> Pairs:
    """The pairs of a table on a network; ``keep`` those that no path connects.

    A pair of places is served by all pairs of their access nodes that differ and that a path
    connects, in the ratio of the products of their shares.
    """
    places = max(len(ends.names), 1)
    codes, of_row = np.unique(ends.origin * places + ends.destination, return_inverse=True)
    origin, destination = codes // places, codes % places
    nodes = pd.Index(
        pd.concat([access.origins["node"], access.destinations["node"]]).unique(), dtype="str"
    )
    first, second = (_Served.of(access.of(end), ends.names, nodes) for end in ENDS)
    reason = np.where((first.many[origin] * second.many[destination]) == 0, NO_ACCESS, NONE)
    reason[origin == destination] = INTRAZONAL
    known = access.zones.get_indexer(ends.names) >= 0
    reason[~(known[origin] & known[destination])] = UNKNOWN
    pair, start, end, share = _all_pairs_of_nodes(
        (first, second), origin, destination, np.flatnonzero(reason == NONE)
    )
    apart = start != end
    reason[(reason == NONE) & ~_some(pair, apart, len(reason))] = ONE_NODE
    connected = apart.copy()
    connected[apart] = _connected(network, nodes, start[apart], end[apart])
    unreached = (reason == NONE) & ~_some(pair, connected, len(reason))
    used = np.where(unreached[pair], apart, connected) if keep else connected
    if not keep:
        reason[unreached] = UNREACHABLE
    total = np.bincount(pair[used], share[used], minlength=len(reason))
    pair, start, end, share = (values[used] for values in (pair, start, end, share))
    return Pairs(of_row, reason, unreached, nodes, pair, start, end, share / total[pair])


class _Served(NamedTuple):
    """The nodes of every place at one end, in a run: its first, their number, node and share."""

    first: Ints  # (places,)
    many: Ints
    node: Ints  # (nodes of all places,)
    share: Floats

    @classmethod
    def of(cls, table: pd.DataFrame, names: pd.Index[str], nodes: pd.Index[str]) -> _Served:
        place = names.get_indexer(pd.Index(table["zone"], dtype="str"))
        node = nodes.get_indexer(pd.Index(table["node"], dtype="str"))
        order = np.argsort(place, kind="stable")
        order = order[place[order] >= 0]
        many = np.bincount(place[order], minlength=len(names)).astype(np.int64)
        share = table["share"].to_numpy(np.float64)[order]
        return cls(np.cumsum(many) - many, many, node[order].astype(np.int64), share)


def _all_pairs_of_nodes(
    served: tuple[_Served, _Served], origin: Ints, destination: Ints, pairs: Ints
) -> tuple[Ints, Ints, Ints, Floats]:
    """Every pair of nodes of some pairs of places: the pair, both nodes, the product of shares."""
    first, second = served
    width = second.many[destination[pairs]]
    many = first.many[origin[pairs]] * width
    _check_size(int(many.sum()))
    which, within = _runs(many)
    start = first.first[origin[pairs]][which] + within // width[which]
    end = second.first[destination[pairs]][which] + within % width[which]
    return pairs[which], first.node[start], second.node[end], first.share[start] * second.share[end]


def _runs(counts: Ints) -> tuple[Ints, Ints]:
    """Each place as often as ``counts`` says, and the number of its repetition from 0."""
    which = np.repeat(np.arange(len(counts)), counts)
    return which, np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)


def _some(pair: Ints, chosen: Booleans, size: int) -> Booleans:
    """Whether each pair has a pair of nodes among those chosen."""
    some: Booleans = np.bincount(pair[chosen], minlength=size) > 0
    return some


def _connected(network: Network, nodes: pd.Index[str], start: Ints, end: Ints) -> Booleans:
    """Whether a path leads from each node to the other beside it."""
    size = max(len(nodes), 1)
    found, which = np.unique(start * size + end, return_inverse=True)
    ends = (pd.Series(nodes[at]) for at in (found // size, found % size))
    connected: Booleans = reachable_pairs(network, *ends)[which]
    return connected


def _named(codes: Ints, names: pd.Index[str]) -> pd.Series[str]:
    return pd.Series(names.array[codes], dtype="str")


def _check_size(rows: int) -> None:
    faults = Faults()
    if rows > MOST_ROWS:
        faults.add(
            f"the demand would have {rows:,} rows, at most {MOST_ROWS:,} are meant: give zones "
            "fewer access nodes, or the period fewer slices"
        )
    faults.raise_if_any()
