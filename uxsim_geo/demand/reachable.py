"""Which pairs of nodes a path connects, when some nodes let no traffic through."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.network.network import Network

Ints = npt.NDArray[np.int64]


class SplitGraph(NamedTuple):
    """A network as a graph in which no path passes a node without through traffic.

    Such a node is split in two: links leave the one and enter the other, so that paths can begin
    and end there but not pass.

    ids
        of the nodes; the vertex from which paths of a node begin is its place here
    arrival
        the vertex at which paths to each node end; shape (nodes,)
    tail, head
        vertices at the ends of each link; shape (links,)
    """

    ids: pd.Index[str]
    arrival: Ints
    tail: Ints
    head: Ints

    @property
    def vertices(self) -> int:
        """How many vertices there are room for."""
        return 2 * len(self.ids)


def split_graph(network: Network) -> SplitGraph:
    """The graph of a network."""
    ids = pd.Index(network.nodes["node_id"])
    nodes = len(ids)
    through = np.ones(nodes, dtype=bool)
    if "through_traffic" in network.nodes:
        through = network.nodes["through_traffic"].to_numpy(dtype=bool)
    arrival = np.where(through, np.arange(nodes), np.arange(nodes) + nodes)
    tail = ids.get_indexer(network.links["from_node_id"])
    head = arrival[ids.get_indexer(network.links["to_node_id"])]
    return SplitGraph(ids, arrival, tail.astype(np.int64), head)


def reachable_pairs(network: Network, origin: pd.Series, destination: pd.Series) -> np.ndarray:
    """Whether a path leads from each origin to the destination beside it; boolean, one a pair.

    No path passes a node without through traffic.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import breadth_first_order, connected_components

    ids, arrival, tail, head = split = split_graph(network)
    size = (split.vertices, split.vertices)
    graph = coo_array((np.ones(len(tail)), (tail, head)), shape=size).tocsr()
    _, part = connected_components(graph, connection="strong")
    start = ids.get_indexer(pd.Index(origin))
    end = arrival[ids.get_indexer(pd.Index(destination))]
    connected = np.asarray(part[start] == part[end])
    open_pairs = np.flatnonzero(~connected)
    open_pairs = open_pairs[np.argsort(start[open_pairs], kind="stable")]
    _, first = np.unique(start[open_pairs], return_index=True)
    for from_here in np.split(open_pairs, first[1:]) if len(open_pairs) else ():
        reached = np.zeros(split.vertices, dtype=bool)
        origin_node = start[from_here[0]]
        reached[breadth_first_order(graph, origin_node, return_predecessors=False)] = True
        connected[from_here] = reached[end[from_here]]
    return connected
