"""Which vertices a hierarchy joins, found as sparse matrices are factorised.

To take vertices away one after the other, each leaving its neighbours joined, is what elimination
does to a symmetric matrix. `start` and `near` list the neighbours of every vertex: those of v stand
in `near` from start[v] to start[v + 1]. Vertices are numbered in the order in which they go.
"""

from __future__ import annotations

import numpy as np

from uxsim_geo.engine.records import kernel


@kernel
def find_parents(start, near, parent, ancestor):
    """Find to which vertex each is joined that goes next of all above it; -1: to none (Liu 1990).

    `ancestor` is room to work in: the last vertex known above each.
    """
    for v in range(parent.size):
        parent[v] = ancestor[v] = -1
        for place in range(start[v], start[v + 1]):
            below = np.int64(near[place])
            while below >= 0 and below < v:
                above = ancestor[below]
                ancestor[below] = v
                if above < 0:
                    parent[below] = v
                below = above
    return True


@kernel
def number_subtrees(parent, room, number):
    """Number vertices so that all below one come right before it, as close as can be in memory.

    `room` first counts the vertices up to and with each, then is the next number free below it.
    """
    for v in range(parent.size):
        room[v] = 1
    for v in range(parent.size):
        if parent[v] >= 0:
            room[parent[v]] += room[v]
    taken = 0
    for v in range(parent.size - 1, -1, -1):
        size, begin = room[v], taken
        if parent[v] >= 0:
            begin = room[parent[v]]
            room[parent[v]] += size
        else:
            taken += size
        number[v] = begin + size - 1
        room[v] = begin
    return True


@kernel
def list_ways(start, near, parent, reached, end, upper):
    """List to which vertices above each is joined: from below, one more at `end` of its list.

    Vertex v is joined to all that lie between its neighbours below it and v in the tree of
    parents. With no room in `upper` they are only counted, in `end`.
    """
    for v in range(parent.size):
        reached[v] = -1
    for v in range(parent.size):
        reached[v] = v
        for place in range(start[v], start[v + 1]):
            below = np.int64(near[place])
            while below < v and reached[below] != v:
                reached[below] = v
                if upper.size > 0:
                    upper[end[below]] = v
                end[below] += 1
                below = parent[below]
    return True
