"""Which pairs of nodes a path connects, when some nodes let no traffic through."""

from __future__ import annotations

import numpy as np
import pandas as pd

from uxsim_geo.network.network import Network


def reachable_pairs(network: Network, origin: pd.Series, destination: pd.Series) -> np.ndarray:
    """Whether a path leads from each origin to the destination beside it; boolean, one a pair.

    A node without through traffic is split in two: links leave the one and enter the other, so
    that paths can begin and end there but not pass.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import breadth_first_order, connected_components

    ids = pd.Index(network.nodes["node_id"])
    nodes = len(ids)
    through = np.ones(nodes, dtype=bool)
    if "through_traffic" in network.nodes:
        through = network.nodes["through_traffic"].to_numpy(dtype=bool)
    arrival = np.where(through, np.arange(nodes), np.arange(nodes) + nodes)
    tail = ids.get_indexer(network.links["from_node_id"])
    head = arrival[ids.get_indexer(network.links["to_node_id"])]
    graph = coo_array((np.ones(len(tail)), (tail, head)), shape=(2 * nodes, 2 * nodes)).tocsr()
    _, part = connected_components(graph, connection="strong")
    start, end = ids.get_indexer(origin), arrival[ids.get_indexer(destination)]
    connected = np.asarray(part[start] == part[end])
    open_pairs = np.flatnonzero(~connected)
    open_pairs = open_pairs[np.argsort(start[open_pairs], kind="stable")]
    _, first = np.unique(start[open_pairs], return_index=True)
    for from_here in np.split(open_pairs, first[1:]) if len(open_pairs) else ():
        reached = np.zeros(2 * nodes, dtype=bool)
        origin_node = start[from_here[0]]
        reached[breadth_first_order(graph, origin_node, return_predecessors=False)] = True
        connected[from_here] = reached[end[from_here]]
    return connected
