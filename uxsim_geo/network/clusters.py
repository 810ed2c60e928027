"""Which nodes are one junction: those tied by short links, by signals or by a small roundabout."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from uxsim_geo.network.chains import parts_of
from uxsim_geo.network.incidence import Ends, Flags, Floats, Rows, rank_of, signals_of_nodes
from uxsim_geo.network.network import Network
from uxsim_geo.network.rows import numbers

#: values of the column junction, the tag of OpenStreetMap, of links on a ring
RINGS = ("roundabout", "circular")


@dataclass(frozen=True)
class JunctionSizes:
    """What is taken for one junction; all in m.

    link
        nodes with a link of at most this length between them
    signal_link
        the same where both nodes have signals
    ring
        roundabouts of at most this length all round; longer ones stay as they are
    extent
        no junction is longer across, from one corner of the box around its nodes to the other
    error
        a junction is left as it is if a way through it would become longer or shorter by more
    """

    link: float = 20.0
    signal_link: float = 35.0
    ring: float = 60.0
    extent: float = 60.0
    error: float = 7.0


def clusters_of(
    network: Network, ends: Ends, points: Floats | None, sizes: JunctionSizes, among: Flags
) -> list[Rows]:
    """Rows of the nodes of each junction of several nodes, in the order of their least ids.

    ``points``: x and y of the nodes in m, None where they are not known; ``among``: nodes that
    may be parts of one. Links are looked at from the shortest to the longest.
    """
    rank = rank_of(network.nodes["node_id"])
    length = numbers(network.links["length"])
    rings, ring_length = _rings(network, ends, length)
    small = rings & (ring_length <= sizes.ring)
    limit = np.full(len(length), sizes.link)
    signals = signals_of_nodes(network)
    limit[signals[ends.start] & signals[ends.end]] = max(sizes.link, sizes.signal_link)
    limit[rings] = 0.0
    wanted = (length <= limit) | small
    wanted &= among[ends.start] & among[ends.end] & (ends.start != ends.end)
    low, high = np.minimum(ends.start, ends.end), np.maximum(ends.start, ends.end)
    rows = np.flatnonzero(wanted)
    least, most = (np.sort(rank[[low[rows], high[rows]]], axis=0))[[0, 1]]
    order = rows[np.lexsort((most, least, np.round(length[rows], 3), ~small[rows]))]
    pairs = np.stack([low[order], high[order]], axis=1)
    boxes = None if points is None else np.concatenate([points, points], axis=1)
    label = _grown(pairs, length[order], boxes, sizes.extent, ends.nodes)
    return _sorted_clusters(label, rank)


def _rings(network: Network, ends: Ends, length: Floats) -> tuple[Flags, Floats]:
    """Whether each link is on a ring, and the length of all links of that ring."""
    on_ring = np.zeros(len(length), dtype=bool)
    if "junction" in network.links:
        on_ring = np.asarray(network.links["junction"].isin(RINGS), dtype=bool)
    part = parts_of(ends.start[on_ring], ends.end[on_ring], ends.nodes)[ends.start]
    total = np.bincount(part, weights=np.where(on_ring, length, 0.0))
    return on_ring, np.where(on_ring, total[part], 0.0)


def _grown(pairs: Rows, length: Floats, boxes: Floats | None, extent: float, nodes: int) -> Rows:
    """Tie the nodes of one pair after the other, as long as the whole stays within the extent.

    Where it is not known where the nodes lie, the lengths of the links that tie them count.
    """
    parent = list(range(nodes))
    box = {} if boxes is None else {n: boxes[n].tolist() for n in np.unique(pairs).tolist()}
    size = dict.fromkeys(np.unique(pairs).tolist(), 0.0)
    for (one, other), added in zip(pairs.tolist(), length.tolist(), strict=True):
        one, other = _root(parent, one), _root(parent, other)
        if one == other:
            continue
        across = size[one] + size[other] + added
        if boxes is not None:
            west, south, east, north = _around(box[one], box[other])
            across = float(np.hypot(east - west, north - south))
        if across > extent:
            continue
        parent[other] = one
        size[one] = across
        if boxes is not None:
            box[one] = [west, south, east, north]
    return np.array([_root(parent, node) for node in range(nodes)], dtype=np.int64)


def _root(parent: list[int], node: int) -> int:
    while parent[node] != node:
        parent[node] = parent[parent[node]]
        node = parent[node]
    return node


def _around(one: list[float], other: list[float]) -> tuple[float, float, float, float]:
    return (
        min(one[0], other[0]),
        min(one[1], other[1]),
        max(one[2], other[2]),
        max(one[3], other[3]),
    )


def _sorted_clusters(label: Rows, rank: Rows) -> list[Rows]:
    """The groups of several nodes, each sorted by id, and by the first id of each."""
    number = np.bincount(label, minlength=len(label))
    rows = np.flatnonzero(number[label] > 1)
    rows = rows[np.lexsort((rank[rows], label[rows]))]
    bounds = np.flatnonzero(np.diff(label[rows], prepend=-1))
    clusters = np.split(rows, bounds[1:]) if len(rows) else []
    return sorted(clusters, key=lambda nodes: int(rank[nodes[0]]))
