"""Free-flow times of trips: what the fastest way to the destination takes where nobody else is."""

from __future__ import annotations

import numpy as np

from uxsim_geo.engine.records import LANES, Hierarchy, Lanes, Routes, World, kernel
from uxsim_geo.engine.routes import in_milliseconds, pass_on_costs
from uxsim_geo.engine.sweep import sweep
from uxsim_geo.engine.trees import grow_tree, leads_nearer


@kernel
def price_free_flow(w: World):
    """Let every arc cost its free-flow time."""
    for place in range(w.routes.arc.size):
        arc = w.routes.arc[place]
        if arc["head"] >= 0:
            arc["cost"] = in_milliseconds(w.links.queue[arc["link"]]["free_time"])
    pass_on_costs(w.routes)
    return True


@kernel
def time_lanes(w: World, h: Hierarchy, room: Lanes, alike):
    """Give the trips to a batch of destinations their free-flow times, s; inf: there is no way.

    `alike` is the next destination at the same node, for each; -1: there is none. False: some are
    too far to tell.
    """
    if not sweep(h, w.routes, room):
        return False
    find_ways_on(w.routes, h, room)
    for lane in range(LANES):
        if room.own[lane] >= 0:
            time_trips(w, room, lane, alike)
    return True


@kernel
def time_by_heap(w: World, room: Lanes, alike):
    """Do the same by trees of the heap, from which it can be told however far they are."""
    for lane in range(LANES):
        if room.own[lane] >= 0:
            grow_tree(w.routes, w.routes.destination[room.own[lane]]["node"])
            find_way_on(w.routes, room, lane)
            time_trips(w, room, lane, alike)
    return True


@kernel
def find_ways_on(routes: Routes, h: Hierarchy, room: Lanes):
    """Note over which arc every vertex goes on, for each lane: the first that leads nearer."""
    distance, toward = room.distance, room.toward
    for v in range(np.uint64(h.place.size)):
        for lane in range(LANES):
            toward[v, lane] = -1
        first = routes.vertex[v]["first_out"]
        for arc in range(routes.vertex[v + np.uint64(1)]["first_out"] - 1, first - 1, -1):
            tail, head = np.uint64(h.tail[arc]), np.uint64(h.head[arc])
            cost = routes.arc[arc]["cost"]
            for lane in range(LANES):
                is_on = np.int32(distance[head, lane] + cost) == distance[tail, lane]
                toward[v, lane] = np.int32(arc) if is_on else toward[v, lane]


@kernel
def find_way_on(routes: Routes, room: Lanes, lane):
    """Note over which arc every vertex goes on, by the tree at hand."""
    for v in range(routes.vertex.size - 1):
        room.toward[v, lane] = -1
        first = routes.vertex[v]["first_out"]
        for arc in range(routes.vertex[v + 1]["first_out"] - 1, first - 1, -1):
            if leads_nearer(routes, v, arc):
                room.toward[v, lane] = arc


@kernel
def time_trips(w: World, room: Lanes, lane, alike):
    """Give the trips to the node of a lane their free-flow times."""
    routes, trip = w.routes, w.log.trip
    place = np.int64(room.own[lane])
    node = routes.destination[place]["node"]
    for v in range(room.time.size):
        room.time[v] = -1.0  # not known yet
    for v in range(routes.node[node]["first_vertex"], routes.node[node + 1]["first_vertex"]):
        room.time[v] = 0.0
    while place >= 0:
        first, last = routes.destination[place], routes.destination[place + 1]
        for row in range(first["first_trip"], last["first_trip"]):
            own = trip[w.log.trips_by_destination[row]]
            v = routes.node[own["from_node"]]["first_vertex"]
            if room.time[v] < 0.0:
                add_up_times(w, room, lane, v)
            own["free_time"] = room.time[v]
        place = alike[place]


@kernel
def add_up_times(w: World, room: Lanes, lane, v):
    """Find the free-flow time of a vertex, and of those on its way for which it is not known."""
    size, on = 0, np.inf
    while room.time[v] < 0.0 and room.toward[v, lane] >= 0:
        room.passed[size] = v
        size += 1
        v = np.int64(w.routes.arc[room.toward[v, lane]]["head"])
    if room.time[v] >= 0.0:
        on = room.time[v]
    room.time[v] = on
    while size > 0:
        size -= 1
        v = np.int64(room.passed[size])
        on += w.links.queue[w.routes.arc[room.toward[v, lane]]["link"]]["free_time"]
        room.time[v] = on
