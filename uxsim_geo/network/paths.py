"""Which way on a path can take from where it has come: nodes and links, less what is banned.

A banned turn is a path of two links, a ban over via links a longer one. A path that has come along
the beginning of a banned path must not go on along the rest of it, so that beginning is remembered
as long as it matters. A *vertex* is a node together with the longest beginning of a banned path
that leads there (Aho and Corasick 1975); most nodes have one vertex, that of no beginning. An *arc*
is a link driven on from a vertex. So links are never doubled, only what is known of who drives
there: where nothing is banned, vertices are nodes and arcs are links.

At a node without through traffic every turn is banned: links end in a vertex without arcs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.network.bans import Way, ban_paths, beginning_after
from uxsim_geo.network.network import Network
from uxsim_geo.network.one_part import is_one_part

if TYPE_CHECKING:
    from scipy.sparse import csr_array

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Paths:
    """All paths of a network that obey its bans, as a graph of vertices and arcs.

    node
        (vertices,) row of the node of each; the vertices of a node follow one another
    first
        (nodes + 1,) the vertex of every node at which paths begin, the first of its vertices; a
        path has come to a node at any of them
    tail, head
        (arcs,) vertices, head -1: this link must not be driven from there; arcs are ordered by
        tail, then by link, and vertices of a node that have any have them over the same links
    link
        (arcs,) row of the link of each
    start, end
        (links,) row of the node at which each link starts, and ends
    """

    node: Ints
    first: Ints
    tail: Ints
    head: Ints
    link: Ints
    start: Ints
    end: Ints

    @classmethod
    def of(cls, network: Network) -> Paths:
        """Find the vertices and arcs of a network that ``check_network`` accepts."""
        ids = pd.Index(network.nodes["node_id"].astype(str))
        start, end = (
            ids.get_indexer(pd.Index(network.links[name].astype(str))).astype(np.int64)
            for name in ("from_node_id", "to_node_id")
        )
        through = np.ones(len(ids), bool)
        if "through_traffic" in network.nodes:
            through = network.nodes["through_traffic"].to_numpy(bool)
        beginnings = _Beginnings(banned_paths(network), end, through)
        own_node = (np.arange(len(ids)), np.flatnonzero(~through), beginnings.node())
        node, first, place = _by_node(np.concatenate(own_node), len(ids))
        vertex_of = dict(
            zip(beginnings.ways, place[place.size - len(beginnings.ways) :].tolist(), strict=True)
        )
        # who comes over a link from where nothing was remembered
        head = np.where(through[end], first[end], first[end] + 1)
        head[[way[0] for way in vertex_of if len(way) == 1]] = [
            vertex for way, vertex in vertex_of.items() if len(way) == 1
        ]
        usual = np.stack([first[start], head, np.arange(start.size)])
        arcs = np.concatenate([usual, beginnings.arcs(vertex_of, start, head)], axis=1)
        tail, head, link = arcs[:, np.lexsort((arcs[2], arcs[0]))]
        return cls(node, first, tail, head, link, start, end)

    def arcs_along(self, route: Sequence[int]) -> list[int]:
        """Return the arcs of a route, up to where it must not be driven on.

        ``route`` are rows of links, each of which starts where the one before it ends.
        """
        arcs: list[int] = []
        vertex = int(self.first[self.start[route[0]]])
        for link in route:
            arc = self._arc_of.get((vertex, link), -1)
            if arc < 0 or self.head[arc] < 0:
                break
            arcs.append(arc)
            vertex = int(self.head[arc])
        return arcs

    def shortest(self, cost: npt.ArrayLike, origins: Ints) -> Floats:
        """Least sum of the links' costs from some nodes to all; inf where no path leads.

        ``cost`` has the shape (links,), the result (origins, nodes).
        """
        from scipy.sparse import csr_array
        from scipy.sparse.csgraph import dijkstra

        graph, edge = self._edges
        least = np.full(graph.nnz, np.inf)
        np.minimum.at(least, edge, np.asarray(cost, float)[self.link[self.head >= 0]])
        weighted = csr_array((least, graph.indices, graph.indptr), shape=graph.shape)
        distances = dijkstra(weighted, indices=self.first[origins])
        nearest: Floats = np.minimum.reduceat(distances, self.first[:-1], axis=1)
        return nearest

    def lead(self, origin: Ints, destination: Ints) -> npt.NDArray[np.bool_]:
        """Say of pairs of nodes, (pairs,) each, whether a path leads from the one to the other."""
        driven = self.head >= 0
        if is_one_part(self.tail[driven], self.head[driven], self.node.size):
            return np.ones(len(origin), bool)
        from scipy.sparse.csgraph import breadth_first_order, connected_components

        graph, _ = self._edges
        _, part = connected_components(graph, connection="strong")
        connected = np.asarray(part[self.first[origin]] == part[self.first[destination]])
        open_pairs = np.flatnonzero(~connected)
        open_pairs = open_pairs[np.argsort(origin[open_pairs], kind="stable")]
        _, first = np.unique(origin[open_pairs], return_index=True)
        for from_here in np.split(open_pairs, first[1:]) if len(open_pairs) else ():
            start = self.first[origin[from_here[0]]]
            reached = np.zeros(self.first.size - 1, bool)
            reached[self.node[breadth_first_order(graph, start, return_predecessors=False)]] = True
            connected[from_here] = reached[destination[from_here]]
        return connected

    @cached_property
    def _arc_of(self) -> dict[tuple[int, int], int]:
        """The arc by its tail and the row of its link."""
        pairs = zip(self.tail.tolist(), self.link.tolist(), strict=True)
        return {pair: arc for arc, pair in enumerate(pairs)}

    @cached_property
    def _edges(self) -> tuple[csr_array, Ints]:
        """The graph for scipy, and the edge of every arc that may be driven.

        Of parallel arcs there is one.
        """
        from scipy.sparse import csr_array

        vertices = self.node.size
        code = (self.tail * vertices + self.head)[self.head >= 0]
        code, edge = np.unique(code, return_inverse=True)
        ends = (code // vertices, code % vertices)
        return csr_array((np.ones(code.size), ends), shape=(vertices, vertices)), edge


def banned_paths(network: Network) -> list[Way]:
    """Return the banned turns and longer banned paths of a network, as rows of links."""
    paths = ban_paths(network.movements)
    if not paths:
        return []
    row = {str(link_id): number for number, link_id in enumerate(network.links["link_id"])}
    return [tuple(row[link_id] for link_id in path) for path in paths]


class _Beginnings:
    """The beginnings of banned paths that have to be remembered, and what must not follow them.

    ways
        rows of links, one after the other; none ends where no traffic goes through anyway
    """

    def __init__(self, banned: list[Way], end: Ints, through: npt.NDArray[np.bool_]) -> None:
        self._banned = set(banned)
        self._end = end
        self._nodes = through.size
        known = {way[:size] for way in banned for size in range(1, len(way))}
        self.ways = sorted(way for way in known if through[end[way[-1]]])
        self._known = set(self.ways)

    def node(self) -> Ints:
        """Return the node to which each of them has come; shape (ways,)."""
        return self._end[np.array([way[-1] for way in self.ways], np.int64)]

    def arcs(self, vertex_of: dict[Way, int], start: Ints, usual: Ints) -> Ints:
        """Find tail, head (-1: banned) and link of the arcs from them; shape (3, arcs).

        ``usual`` is where each link leads, (links,), unless more has to be remembered.
        """
        order = np.argsort(start, kind="stable")
        places = np.searchsorted(start[order], np.arange(self._nodes + 1))
        found = []
        for way, vertex in vertex_of.items():
            node = self._end[way[-1]]
            for link in order[slice(*places[node : node + 2])].tolist():
                behind = beginning_after((*way, link), self._banned, self._known)
                head = -1 if behind is None else vertex_of.get(behind, int(usual[link]))
                found.append((vertex, head, link))
        return np.array(found, np.int64).reshape(-1, 3).T


def _by_node(node: Ints, nodes: int) -> tuple[Ints, Ints, Ints]:
    """Order vertices by node: their nodes then, the first of each, and where every one went."""
    order = np.argsort(node, kind="stable")
    place = np.empty(node.size, np.int64)
    place[order] = np.arange(node.size)
    return node[order], np.searchsorted(node[order], np.arange(nodes + 1)), place
