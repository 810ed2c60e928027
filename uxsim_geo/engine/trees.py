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
    """Find the fastest way from every vertex to the target: `distance` and `toward`.

    Dijkstra's algorithm against the direction of travel, with a heap of distance and vertex packed
    into one number. The target, a node, is reached at any of its vertices. Of all vertices of a
    node the first is nearest, since it may take every turn; most others are reached with it, over
    the same link. Those that must not take that look for a way of their own. They can be left for
    the end where no shorter way leads over them; such nodes are listed at the end of the heap.
    """
    clear_tree(routes)
    size, late = 0, routes.heap.size
    for v in range(routes.node[target]["first_vertex"], routes.node[target + 1]["first_vertex"]):
        routes.vertex[v]["distance"] = 0
        size = push(routes.heap, size, v)
    while size > 0:
        packed = routes.heap[0]
        size = pop(routes.heap, size)
        v, distance = packed & _VERTEX_MASK, packed >> _VERTEX_BITS
        vertex = routes.vertex[v]
        if distance > vertex["distance"]:
            continue
        if vertex["others"] == 0:  # most: LLVM makes a smaller loop of this one
            size = relax(routes, v, v, distance, size, False)
            continue
        last = v + vertex["others"]
        some = is_barred(vertex, vertex)
        if some:
            late, size = take_along_some(routes, v, last, late, size)
        else:
            for other in range(v + 1, last + 1):
                take_along(routes, v, other)
        size = relax(routes, v, last, distance, size, some)
    for place in range(late, routes.heap.size):
        reach_late(routes, routes.heap[place])


@kernel
def leads_nearer(routes: Routes, v, number):
    """Whether an arc from vertex v is on the tree at hand; of several that lead as near, all are.

    Where all is as far as can be told, only the one over which the search came.
    """
    start, arc = routes.vertex[v], routes.arc[number]
    if arc["head"] < 0 or start["distance"] >= UNREACHED or arc["cost"] >= UNREACHED:
        return False
    beyond = np.int64(routes.vertex[arc["head"]]["distance"]) + arc["cost"]
    return beyond == start["distance"] or start["toward"] == number


@spliced
def clear_tree(routes: Routes):
    """Forget the ways to another target."""
    for v in range(routes.vertex.size):
        routes.vertex[v]["distance"] = UNREACHED
        routes.vertex[v]["toward"] = -1
        routes.vertex[v]["open"] = 0


@kernel
def is_barred(first, vertex):
    """Whether a vertex must not take the way of the first of its node, or may not (see `barred`).

    Asked of the first itself: whether that is so for some vertex of the node.
    """
    place = np.int64(first["toward"]) - first["first_out"]
    return (vertex["barred"] >> min(max(place + 1, 0), 31)) & 1 != 0


@kernel
def farther(distance, cost):
    """Give the distance from the other end of a way; UNREACHED: it is closed, or leads nowhere."""
    return min(distance + cost, FARTHEST + (max(distance, cost) >= UNREACHED))


@kernel
def take_along(routes: Routes, v, other):
    """Reach another vertex of a node with its first, v, over the same link."""
    first, own = routes.vertex[v], routes.vertex[other]
    if own["distance"] > first["distance"]:
        own["distance"] = first["distance"]
        own["toward"] = own["first_out"] + first["toward"] - first["first_out"]


@spliced
def take_along_some(routes: Routes, v, last, late, size):
    """Reach those others of a node with its first, v, that can take the same way.

    The rest go alone. What they know by now is the nearest way unless a vertex that has not been
    reached lies on a nearer one. Then the node stays open for what is offered to it, if shorter
    ways may lead over it, or is listed to be looked at late.
    """
    first = routes.vertex[v]
    distance = np.int64(first["distance"])
    known, needed = True, False
    for other in range(v + 1, last + 1):
        own = routes.vertex[other]
        if not is_barred(first, own):
            take_along(routes, v, other)
            continue
        least = go_alone(routes, other, distance)
        sure = least == own["distance"]
        known = known and sure
        if may_shorten(routes, other, least):
            needed = needed or not sure
            size = pass_on(routes, other, size)
    if needed:
        first["open"] = 1
    elif not known:
        late -= 1
        routes.heap[late] = v
    return late, size


@kernel
def go_alone(routes: Routes, v, reached):
    """Find the nearest way from a vertex over its own arcs, as far as distances are known.

    Gives what its distance is at least, if all vertices up to a distance have been `reached`.
    """
    own = routes.vertex[v]
    best, least = np.int64(UNREACHED) << _VERTEX_BITS, np.int64(UNREACHED)
    for number in range(own["first_out"], routes.vertex[v + 1]["first_out"]):
        arc = routes.arc[number]
        distance, cost = np.int64(routes.vertex[arc["head"]]["distance"]), np.int64(arc["cost"])
        best = min(best, farther(distance, cost) << _VERTEX_BITS | number)
        least = min(least, farther(min(distance, reached), cost))
    if best >> _VERTEX_BITS < own["distance"]:
        own["distance"] = best >> _VERTEX_BITS
        own["toward"] = best & _VERTEX_MASK
    return min(least, np.int64(own["distance"]))


@kernel
def may_shorten(routes: Routes, v, least):
    """Whether a shorter way upstream may lead over a vertex that is at `least` so far away.

    Not so if from where its links start it is no farther over other links, for all vertices there.
    """
    for place in range(routes.vertex[v]["first_in"], routes.vertex[v + 1]["first_in"]):
        way = routes.incoming[place]
        start = routes.vertex[way["tail"]]
        if way["cost"] < UNREACHED and (
            farther(least, way["cost"]) < start["distance"] or is_barred(start, start)
        ):
            return True
    return False


@kernel
def pass_on(routes: Routes, v, size):
    """Offer the ways over a vertex that goes alone to those upstream, without waiting for its turn.

    It gets a turn only where there are others to be told of it, too.
    """
    distance = np.int64(routes.vertex[v]["distance"])
    for place in range(routes.vertex[v]["first_in"], routes.vertex[v + 1]["first_in"]):
        way = routes.incoming[place]
        start = routes.vertex[way["tail"]]
        offer = farther(distance, way["cost"])
        if offer < start["distance"]:
            start["distance"] = offer
            start["toward"] = way["arc"]
            size = push(routes.heap, size, (offer << _VERTEX_BITS) | way["tail"])
        elif start["open"] > 0 and distance < UNREACHED:
            return push(routes.heap, size, (distance << _VERTEX_BITS) | v)
    return size


@spliced
def reach_late(routes: Routes, v):
    """Reach the vertices of a node that go alone, now that all they can lead to is known."""
    first = routes.vertex[v]
    for other in range(v + 1, v + 1 + first["others"]):
        if is_barred(first, routes.vertex[other]):
            go_alone(routes, other, FARTHEST)


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
    """Offer a way to the vertices of an open node."""
    first = routes.vertex[way["tail"]]
    for v in range(way["tail"] + 1, way["tail"] + 1 + first["others"]):
        own = routes.vertex[v]
        same = own["first_out"] + way["arc"] - first["first_out"]
        if offer < own["distance"] and routes.arc[same]["alike"]:
            own["distance"] = offer
            own["toward"] = same
            size = pass_on(routes, v, size)
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
