"""Distances from all vertices to 64 nodes at once, over the ways of a hierarchy.

Each node has a lane of a table with a row for every place. A row takes all 64 lanes in one go, as
long as the loop over them is made into vector instructions: it has 32-bit numbers, a fixed length,
and indices that cannot be negative.
"""

from __future__ import annotations

import numpy as np

from uxsim_geo.engine.records import LANES, UNREACHED, Hierarchy, Lanes, Routes, kernel
from uxsim_geo.engine.trees import FARTHEST

_FARTHEST = np.int32(FARTHEST)
# what has not been reached has this bit, which no sum of a distance and a cost has
_UNREACHED_BIT = np.int32(2**30)
_ONE = np.uint64(1)


@kernel
def customise(h: Hierarchy, arc):
    """Set the costs of all ways by those of the arcs: of a shortcut, the least over what it cuts.

    From below up: when it is the turn of a place, its ways cost what they will.
    """
    for way in range(h.up.size):
        h.up[way] = h.down[way] = UNREACHED
    for number in range(arc.size):
        way, cost = h.way_of_arc[number], arc[number]["cost"]
        if way >= 0:
            h.up[way] = min(h.up[way], cost)
        elif -1 - way < h.down.size:
            h.down[-1 - way] = min(h.down[-1 - way], cost)
    for place in range(h.first.size - 1):
        for left in range(h.first[place], h.first[place + 1]):
            cut_short(h, left, h.first[place + 1])
    return True


@kernel
def cut_short(h: Hierarchy, left, last):
    """Lower the costs of the ways from the end of way `left` to those of the ways after it."""
    top = h.first[h.upper[left]]
    up, down = h.up[left], h.down[left]
    for right in range(left + 1, last):
        while h.upper[top] < h.upper[right]:
            top += 1
        if down < UNREACHED and h.up[right] < UNREACHED:
            h.up[top] = min(h.up[top], np.int32(down + h.up[right]), _FARTHEST)
        if up < UNREACHED and h.down[right] < UNREACHED:
            h.down[top] = min(h.down[top], np.int32(up + h.down[right]), _FARTHEST)


@kernel
def sweep(h: Hierarchy, routes: Routes, room: Lanes):
    """Find the distances to the destinations that have a lane; False: some are FARTHEST.

    Which way leads nearer cannot be told from such distances.
    """
    low = begin(h, routes, room)
    climb(h, room.distance, low)
    descend(h, room.distance, room.nearer)
    least = _FARTHEST
    for lane in range(LANES):
        least = min(least, room.nearer[lane])
    return least > 0


@kernel
def begin(h: Hierarchy, routes: Routes, room: Lanes):
    """Put the destinations at distance 0, at all their vertices; gives the lowest place."""
    distance = room.distance
    for place in range(np.uint64(distance.shape[0])):
        for lane in range(LANES):
            distance[place, lane] = _UNREACHED_BIT
    low = np.int64(h.place.size)
    for lane in range(LANES):
        if room.own[lane] >= 0:
            node = routes.destination[room.own[lane]]["node"]
            for v in range(
                routes.node[node]["first_vertex"], routes.node[node + 1]["first_vertex"]
            ):
                distance[h.place[v], lane] = 0
                low = min(low, h.place[v])
    return low


@kernel
def climb(h: Hierarchy, distance, low):
    """Let the targets be known up the hierarchy: over ways that are driven down to them."""
    for place in range(np.uint64(low), np.uint64(distance.shape[0])):
        nearest = _UNREACHED_BIT
        for lane in range(LANES):
            nearest = min(nearest, distance[place, lane])
        if nearest == _UNREACHED_BIT:
            continue
        keep_in_range(distance, place)
        for way in range(np.uint64(h.first[place]), np.uint64(h.first[place + _ONE])):
            cost = h.down[way]
            if cost < UNREACHED:
                upper = np.uint64(h.upper[way])
                for lane in range(LANES):
                    offer = np.int32(cost + distance[place, lane])
                    distance[upper, lane] = min(distance[upper, lane], offer)


@kernel
def descend(h: Hierarchy, distance, nearer):
    """Find the distances from the top down: over ways that are driven up."""
    for lane in range(LANES):
        nearer[lane] = _FARTHEST
    place = np.uint64(distance.shape[0])
    while place > 0:
        place -= _ONE
        for way in range(np.uint64(h.first[place]), np.uint64(h.first[place + _ONE])):
            cost = h.up[way]
            if cost < UNREACHED:
                upper = np.uint64(h.upper[way])
                for lane in range(LANES):
                    offer = np.int32(cost + distance[upper, lane])
                    distance[place, lane] = min(distance[place, lane], offer)
        keep_in_range(distance, place)
        for lane in range(LANES):
            nearer[lane] = min(nearer[lane], distance[place, lane] ^ _FARTHEST)


@kernel
def keep_in_range(distance, place):
    """Bound distances by FARTHEST, those of what has not been reached by that and their bit."""
    for lane in range(LANES):
        own = distance[place, lane]
        distance[place, lane] = min(own, _FARTHEST) | (own & _UNREACHED_BIT)


@kernel
def take_lane(h: Hierarchy, routes: Routes, distance, lane):
    """Take the distances of a lane over to the vertices; ways lead over whatever arc leads nearer.

    `toward` is only asked where distances do not tell.
    """
    for v in range(h.place.size):
        found = distance[h.place[v], lane]
        routes.vertex[v]["distance"] = min(found, UNREACHED)
        routes.vertex[v]["toward"] = -1
