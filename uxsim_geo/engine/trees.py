"""The search for the fastest ways from everywhere to a destination."""

from __future__ import annotations

import numpy as np

from uxsim_geo.engine.records import UNREACHED, Routes, kernel, spliced

# what is farther counts as this: behind long queues and closed links there is still a way
FARTHEST = np.int64(2**29 - 1)  # ms
_VERTEX_BITS = 32
_VERTEX_MASK = 2**32 - 1


@kernel
def grow_tree(routes: Routes, target):
    """Find the fastest way from every vertex to the target: `distance`, `toward`, `reached`.

    Dijkstra's algorithm against the direction of travel, with a heap of distance and vertex packed
    into one number. The target, a node, is reached at any of its vertices. Of all vertices of a
    node the first is nearest, since it may take every turn; most others are reached with it, over
    the same link, and only those that must not take that go into the heap by themselves. Gives
    how many have come out of it.
    """
    for v in range(routes.vertex.size):
        routes.vertex[v]["distance"] = UNREACHED
        routes.vertex[v]["toward"] = -1
        routes.vertex[v]["open"] = 0
    size, reached = 0, 0
    for v in range(routes.node[target]["first_vertex"], routes.node[target + 1]["first_vertex"]):
        routes.vertex[v]["distance"] = 0
        size = push(routes.heap, size, v)
    while size > 0:
        packed = routes.heap[0]
        size = pop(routes.heap, size)
        v, distance = packed & _VERTEX_MASK, packed >> _VERTEX_BITS
        if distance > routes.vertex[v]["distance"]:
            continue
        routes.vertex[reached]["reached"] = v
        reached += 1
        last = v + routes.vertex[v]["others"]
        some = last > v and not take_along_all(routes, v, last)
        if some:
            size = take_along_some(routes, v, last, size)
        size = relax(routes, v, last, distance, size, some)
    return reached


@spliced
def take_along_all(routes: Routes, v, last):
    """Reach the others of a node with its first, v, if all can take the same way; False: not so."""
    toward = routes.vertex[v]["toward"]
    if toward >= 0 and routes.arc[toward]["alike"] == 0:
        return False
    for other in range(v + 1, last + 1):
        take_along(routes, v, other)
    return True


@kernel
def take_along(routes: Routes, v, other):
    """Reach another vertex of a node with its first, v, over the same link."""
    first, own = routes.vertex[v], routes.vertex[other]
    if own["distance"] > first["distance"]:
        own["distance"] = first["distance"]
        own["toward"] = own["first_out"] + first["toward"] - first["first_out"]


@spliced
def take_along_some(routes: Routes, v, last, size):
    """Reach those others of a node with its first, v, that can take the same way.

    The rest go into the heap by themselves, now or as soon as a way is offered to them.
    """
    first = routes.vertex[v]
    first["open"] = 1
    for other in range(v + 1, last + 1):
        same = routes.vertex[other]["first_out"] + first["toward"] - first["first_out"]
        if routes.arc[same]["alike"]:
            take_along(routes, v, other)
        elif goes_alone(routes, other):
            size = push(routes.heap, size, packed_label(routes, other))
    return size


@kernel
def packed_label(routes: Routes, v):
    """Pack the distance and the number of a vertex into one number."""
    return (np.int64(routes.vertex[v]["distance"]) << _VERTEX_BITS) | v


@spliced
def goes_alone(routes: Routes, v):
    """Whether there is a nearer way from a vertex over its own arcs than known so far; takes it."""
    own, found = routes.vertex[v], False
    for number in range(own["first_out"], routes.vertex[v + 1]["first_out"]):
        arc = routes.arc[number]
        distance = routes.vertex[arc["head"]]["distance"]
        if arc["cost"] < UNREACHED and distance < UNREACHED:
            offer = min(np.int64(distance) + arc["cost"], FARTHEST)
            if offer < own["distance"]:
                own["distance"] = offer
                own["toward"] = number
                found = True
    return found


@spliced
def relax(routes: Routes, v, last, distance, size, some):
    """Offer the ways over the vertices v to last to those upstream; gives the size of the heap.

    With `some`, only over those of them that are at this distance.
    """
    for place in range(routes.vertex[v]["first_in"], routes.vertex[last + 1]["first_in"]):
        way = routes.incoming[place]
        if some and routes.vertex[way["head"]]["distance"] > distance:
            continue
        start = routes.vertex[way["tail"]]
        offer = min(distance + way["cost"], FARTHEST)
        if way["cost"] < UNREACHED:
            if offer < start["distance"]:
                start["distance"] = offer
                start["toward"] = way["arc"]
                size = push(routes.heap, size, (offer << _VERTEX_BITS) | way["tail"])
            if start["open"] > 0:
                size = offer_to_others(routes, way, offer, size)
    return size


@spliced
def offer_to_others(routes: Routes, way, offer, size):
    """Offer a way to the vertices of a node that have not been reached with its first."""
    first = routes.vertex[way["tail"]]
    for v in range(way["tail"] + 1, way["tail"] + 1 + first["others"]):
        own = routes.vertex[v]
        same = own["first_out"] + way["arc"] - first["first_out"]
        if offer < own["distance"] and routes.arc[same]["alike"]:
            own["distance"] = offer
            own["toward"] = same
            size = push(routes.heap, size, packed_label(routes, v))
    return size


@kernel
def push(heap, size, item):
    """Add an item to a 4-ary heap; gives its new size."""
    place = size
    while place > 0:
        parent = (place - 1) >> 2
        if heap[parent] <= item:
            break
        heap[place] = heap[parent]
        place = parent
    heap[place] = item
    return size + 1


@kernel
def pop(heap, size):
    """Take the smallest item, the first, off a 4-ary heap; gives its new size."""
    size -= 1
    item, place = heap[size], 0
    while True:
        child = 4 * place + 1
        if child >= size:
            break
        smallest = child
        for other in range(child + 1, min(child + 4, size)):
            if heap[other] < heap[smallest]:
                smallest = other
        if heap[smallest] >= item:
            break
        heap[place] = heap[smallest]
        place = smallest
    heap[place] = item
    return size
