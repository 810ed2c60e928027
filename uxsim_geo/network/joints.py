"""At which nodes of degree two links become one, and at which a change keeps them apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from uxsim_geo.network.chains import Straight, parts_of, places_in_chains, roads_of
from uxsim_geo.network.incidence import Ends, Flags, Floats, Rows


@dataclass(frozen=True)
class Roads:
    """What the choice of nodes looks at.

    kinds
        links of one kind may be joined; (links,)
    length
        m; (links,)
    rank
        place of each node by its id, by which ties are decided; (nodes,)
    """

    straight: Straight
    ends: Ends
    kinds: Rows
    length: Floats
    rank: Rows


def nodes_to_join(roads: Roads, short_piece: float) -> Flags:
    """Nodes at which links become one; (nodes,).

    They do where the kinds are the same before and after in both directions, and at the ends of
    pieces shorter than ``short_piece`` (m) between other kinds: at both ends if the kinds beyond
    are the same, otherwise towards the shorter neighbour. A road that would lead back to its own
    beginning keeps the node nearest its middle, so that no link is a loop.
    """
    straight, ends = roads.straight, roads.ends
    going_on = straight.onward >= 0
    differs = roads.kinds[going_on] != roads.kinds[straight.onward[going_on]]
    changes = np.zeros(ends.nodes, dtype=bool)
    changes[ends.end[going_on][differs]] = True
    changes &= straight.at
    joined = straight.at & ~changes
    while True:
        opened = _one_node_of_rings(roads, joined)
        joined[opened], changes[opened] = False, False
        absorbing = _absorbing(roads, joined, changes, short_piece)
        if not absorbing.any():
            break
        joined |= absorbing
        changes &= ~absorbing
    for node in _middles_of_loops(roads, joined):
        joined[node] = False
    return joined


def _previous(roads: Roads, joined: Flags) -> Rows:
    """The link that comes before each in its chain, -1 at the first."""
    return np.where(joined[roads.ends.start], roads.straight.previous, -1)


def _one_node_of_rings(roads: Roads, joined: Flags) -> Rows:
    """Of each chain without a first link, the node that comes first by id."""
    previous = _previous(roads, joined)
    inner = np.flatnonzero(previous >= 0)
    part = parts_of(inner, previous[inner], len(previous))
    has_first = np.zeros(int(part.max()) + 1, dtype=bool)
    has_first[part[previous < 0]] = True
    ring = np.flatnonzero(~has_first[part])
    order = np.lexsort((roads.rank[roads.ends.start[ring]], part[ring]))
    first = np.flatnonzero(np.diff(part[ring][order], prepend=-1))
    return roads.ends.start[ring[order[first]]]


def _absorbing(roads: Roads, joined: Flags, changes: Flags, short_piece: float) -> Flags:
    """Nodes among ``changes`` at which short pieces are joined to their neighbours now."""
    straight, ends = roads.straight, roads.ends
    road = roads_of(straight, joined, ends)
    total = _lengths(roads, road)
    short = total[road] < short_piece
    at_start = np.flatnonzero(short & (straight.previous >= 0) & changes[ends.start])
    at_end = np.flatnonzero(short & (straight.onward >= 0) & changes[ends.end])
    node = np.concatenate([ends.start[at_start], ends.end[at_end]])
    beyond = np.concatenate([straight.previous[at_start], straight.onward[at_end]])
    piece = road[np.concatenate([at_start, at_end])]
    order = np.lexsort((roads.rank[node], total[road[beyond]], piece))
    towards_shorter = order[np.flatnonzero(np.diff(piece[order], prepend=-1))]
    alike = _between_alike(roads, joined, road, (at_start, at_end))
    found = np.zeros(ends.nodes, dtype=bool)
    found[node[towards_shorter]] = True
    found[node[alike[piece]]] = True
    return found


def _lengths(roads: Roads, road: Rows) -> Floats:
    """Length of each road, m; the mean of both directions where it has them."""
    both = roads.straight.beside != np.arange(len(road))
    twoway = np.zeros(int(road.max()) + 1, dtype=bool)
    twoway[road[both]] = True
    return np.asarray(np.bincount(road, weights=roads.length) / np.where(twoway, 2.0, 1.0))


def _between_alike(roads: Roads, joined: Flags, road: Rows, at: tuple[Rows, Rows]) -> Flags:
    """Of each road, whether the links beyond it are of one kind, in every direction.

    ``at``: the links at whose start, and those at whose end, a change might be passed over.
    """
    at_start, at_end = at
    straight, kinds = roads.straight, roads.kinds
    head, _ = places_in_chains(_previous(roads, joined))
    before = np.full(len(kinds), -1, dtype=np.int64)
    before[at_start] = kinds[straight.previous[at_start]]
    differs = before[head[at_end]] != kinds[straight.onward[at_end]]
    alike = np.zeros(int(road.max()) + 1, dtype=bool)
    alike[road[at_end]] = True
    alike[road[at_end[differs]]] = False
    return alike


def _middles_of_loops(roads: Roads, joined: Flags) -> list[int]:
    """Of each chain that ends where it begins, the inner node nearest its middle."""
    ends = roads.ends
    head, place = places_in_chains(_previous(roads, joined))
    last = np.flatnonzero(~(joined[ends.end] & (roads.straight.onward >= 0)))
    loops = last[ends.start[head[last]] == ends.end[last]]
    order = np.lexsort((place, head))
    found = set()
    for link in loops[place[loops] > 0].tolist():
        chain = order[np.searchsorted(head[order], head[link]) :][: place[link] + 1]
        along = np.cumsum(roads.length[chain])
        off = np.round(np.abs(along[:-1] - along[-1] / 2.0), 3)
        inner = ends.end[chain[:-1]]
        found.add(int(inner[np.lexsort((roads.rank[inner], off))[0]]))
    return sorted(found)
