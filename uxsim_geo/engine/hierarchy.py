"""Builds a contraction hierarchy: vertices in an order, and shortcuts between them for all costs.

Vertices are taken away one after the other, from the lowest up, and each leaves its neighbours
joined: a *way* joins two vertices because an arc does, or because both were joined to one that has
gone before them. Then, whatever the arcs cost, a shortest path leads over ways first only up and
then only down (Dibbelt, Strasser and Wagner 2016). How many ways there are is up to the order.
Here it is that of minimum degree, by which sparse matrices are factorised: a factor has entries
where the hierarchy has ways.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from uxsim_geo.engine.records import Hierarchy
from uxsim_geo.engine.searches import list_upper, number_below
from uxsim_geo.network.paths import Ints, Paths

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_HEAVY = 1e9  # of what stands on the diagonal: no reason to take rows in another order


def build_hierarchy(paths: Paths) -> Hierarchy:
    """Build the hierarchy of all vertices of a network."""
    joins = (paths.head >= 0) & (paths.head != paths.tail)
    tail, head, size = paths.tail[joins], paths.head[joins], paths.node.size
    order = _order_of_minimum_degree(_neighbours(tail, head, size))
    parent, number, room = (np.empty(size, np.int64) for _ in range(3))
    near = _neighbours(order[tail], order[head], size)
    number_below(near.indptr, near.indices, parent, room, number)
    parent[number] = np.where(parent >= 0, number[parent], -1)
    place = number[order]

    near = _neighbours(place[tail], place[head], size)
    counts = np.zeros(size, np.int64)
    list_upper(near.indptr, near.indices, parent, room, counts, np.empty(0, np.int32))
    first = np.concatenate([[0], np.cumsum(counts)])
    upper = np.empty(first[-1], np.int32)
    list_upper(near.indptr, near.indices, parent, room, first[:-1].copy(), upper)
    return _with_arcs(paths, place, first, upper)


def _with_arcs(paths: Paths, place: Ints, first: Ints, upper: np.ndarray) -> Hierarchy:
    """Say which way every arc is."""
    size, ways = place.size, upper.size
    tail, head = place[paths.tail], place[np.where(paths.head >= 0, paths.head, paths.tail)]
    codes = np.repeat(np.arange(size), np.diff(first)) * size + upper  # by place, then by upper
    way = np.searchsorted(codes, np.minimum(tail, head) * size + np.maximum(tail, head))
    way = np.where(tail < head, way, -1 - way)
    return Hierarchy(
        place=place,
        first=first,
        upper=upper,
        up=np.empty(ways, np.int32),
        down=np.empty(ways, np.int32),
        way_of_arc=np.where(tail == head, -1 - ways, way),
        tail=tail.astype(np.int32),
        head=head.astype(np.int32),
    )


def _neighbours(tail: Ints, head: Ints, size: int) -> csr_array:
    """List the neighbours of every vertex, whichever way arcs lead."""
    from scipy.sparse import csr_array

    ends = np.concatenate([tail, head]), np.concatenate([head, tail])
    near = csr_array((np.ones(2 * tail.size), ends), shape=(size, size))
    near.sum_duplicates()
    return near


def _order_of_minimum_degree(near: csr_array) -> Ints:
    """Say when it is the turn of every vertex: always of one with fewest neighbours, nearly."""
    from scipy.sparse import csc_array, eye_array
    from scipy.sparse.linalg import splu

    heavy = csc_array(near + _HEAVY * eye_array(near.shape[0]))
    factors = splu(
        heavy,
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    order: Ints = factors.perm_c.astype(np.int64)
    return order
