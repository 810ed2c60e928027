"""Where two links could be one: nodes that lead from one road to one other, and chains of them.

A node is passed straight if it has two neighbours and every link that arrives from one goes on to
the other: a one-way road, or one with both directions of one length, none beside it. Nothing
may begin, end or be decided there: no signal, zone or ban of going on, and no way to turn round
(at a junction that was several nodes, such as a stub).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from uxsim_geo.network.incidence import Ends, Flags, Rows, Turns
from uxsim_geo.network.network import Network
from uxsim_geo.network.u_turns import merged_before


@dataclass(frozen=True)
class Straight:
    """Nodes that are passed straight, and what goes on to what there.

    at
        whether each node is one; (nodes,)
    onward, previous
        the link that goes on from each link over such a node, the one that comes over such a
        node, -1 where there is none; (links,)
    beside
        the link back along each link where it comes to or from such a node, itself where there is
        none; (links,)
    """

    at: Flags
    onward: Rows
    previous: Rows
    beside: Rows


def straight_of(network: Network, ends: Ends, turns: Turns) -> Straight:
    """Find the nodes that are passed straight."""
    ways_back = np.bincount(ends.end[turns.before[turns.back]], minlength=ends.nodes)
    at = _two_neighbours(ends, ways_back) & ~_needed(network)
    straight = at[ends.end[turns.before]] & (ends.start[turns.before] != ends.end[turns.after])
    held = turns.banned & straight
    at[ends.end[turns.before[held]]] = False
    at[_last_nodes_of_long_bans(network, ends)] = False
    ways_round = turns.back & ~turns.banned & merged_before(network)[ends.end[turns.before]]
    at[ends.end[turns.before[ways_round]]] = False
    of_pair = at[ends.end[turns.before]]
    along, back = straight & of_pair, ~straight & of_pair
    onward = np.full(len(ends.start), -1, dtype=np.int64)
    previous, beside = onward.copy(), np.arange(len(onward))
    onward[turns.before[along]] = turns.after[along]
    previous[turns.after[along]] = turns.before[along]
    beside[turns.before[back]] = turns.after[back]
    beside[turns.after[back]] = turns.before[back]
    return Straight(at, onward, previous, beside)


def _two_neighbours(ends: Ends, ways_back: Rows) -> Flags:
    """Nodes between two others, on two roads of both directions or with one link in and one out.

    A ring with two nodes left on it is no road of both directions: its links are of two roads.
    """
    here = np.concatenate([ends.start, ends.end])
    other = np.concatenate([ends.end, ends.start])
    out = np.repeat([1, 0], len(ends.start))
    pair = here * ends.nodes + other
    _, first = np.unique(pair, return_index=True)
    neighbours = np.bincount(here[first], minlength=ends.nodes)
    _, first = np.unique(2 * pair + out, return_index=True)
    both = np.bincount(here[first], minlength=ends.nodes)
    leaving = np.bincount(ends.start, minlength=ends.nodes)
    arriving = np.bincount(ends.end, minlength=ends.nodes)
    loops = np.bincount(ends.start[ends.start == ends.end], minlength=ends.nodes)
    single = both == leaving + arriving
    return np.asarray(
        (neighbours == 2)
        & single
        & (leaving == arriving)
        & (loops == 0)
        & (ways_back == np.where(leaving == 2, 2, 0)),
        dtype=bool,
    )


def _needed(network: Network) -> Flags:
    """Nodes with a signal, of a zone, or that nobody may pass."""
    nodes = network.nodes
    needed = np.zeros(len(nodes), dtype=bool)
    if "control" in nodes:
        needed |= np.asarray(nodes["control"] == "signal", dtype=bool)
    if "zone_id" in nodes:
        needed |= np.asarray(nodes["zone_id"].notna(), dtype=bool)
    if "through_traffic" in nodes:
        needed |= ~np.asarray(nodes["through_traffic"], dtype=bool)
    return needed


def _last_nodes_of_long_bans(network: Network, ends: Ends) -> Rows:
    """Where the last turn of bans over several links lies: it must stay a turn."""
    movements = network.movements
    if "via_link_ids" not in movements:
        return np.empty(0, dtype=np.int64)
    last = movements["to_link_id"][movements["via_link_ids"].notna()]
    row = {link_id: row for row, link_id in enumerate(network.links["link_id"])}
    rows = [row[link_id] for link_id in last if link_id in row]
    return ends.start[np.asarray(rows, dtype=np.int64)]


def places_in_chains(previous: Rows) -> tuple[Rows, Rows]:
    """First link of each link's chain, and its place there from 0.

    ``previous``: the link before each in its chain, -1 at the first. No chain may be a ring.
    """
    head = np.where(previous < 0, np.arange(len(previous)), previous)
    place = (previous >= 0).astype(np.int64)
    # every round doubles how far back one has looked
    while (head[head] != head).any():
        place = place + place[head]
        head = head[head]
    return head, place


def roads_of(straight: Straight, joined: Flags, ends: Ends) -> Rows:
    """Number of the road that each link is a part of, both directions being one.

    ``joined``: nodes at which roads go on; all of them are passed straight.
    """
    rows = np.arange(len(ends.start))
    going_on = joined[ends.end] & (straight.onward >= 0)
    one = np.concatenate([rows[going_on], rows])
    other = np.concatenate([straight.onward[going_on], straight.beside])
    return parts_of(one, other, len(rows))


def parts_of(one: Rows, other: Rows, number: int) -> Rows:
    """Number of the connected part that each of ``number`` things is in; pairs of them tie."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    ones = np.ones(len(one), dtype=np.int8)
    graph = csr_array((ones, (one, other)), shape=(number, number))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)
