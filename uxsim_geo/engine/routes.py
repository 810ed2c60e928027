"""Route choice: reactive dynamic user optimum with inertia (Seo 2023).

At every update the instantaneous cost of each link is taken, one tree of fastest routes is made
for every destination that somebody still wants to reach, and B ← (1−λ)B + λ·tree.
"""

from __future__ import annotations

import numpy as np

from uxsim_geo.engine.link import advance_wave, platoon_at, position
from uxsim_geo.engine.random import NOISE, draw
from uxsim_geo.engine.records import Routes, World, kernel

UNREACHED = np.int32(2**29)  # ms, 149 hours; the sum of two fits into 32 bits
_STANDSTILL = 0.01  # of the free speed: what a link counts where all stand
_NODE_BITS = 32
_NODE_MASK = 2**32 - 1


@kernel
def update_routes(w: World, step):
    """Bring the weights B of all destinations up to date with the traffic at this step."""
    clock = w.links.clock[0]
    observe_costs(w, step * clock["step_length"])
    share = clock["update_weight"] if clock["updates"] > 0 else 1.0
    for destination in range(w.routes.destination.size - 1):
        if w.routes.destination[destination]["outstanding"] > 0:
            grow_tree(w.routes, w.routes.destination[destination]["node"])
            blend_tree(w.routes, destination, share)
    clock["updates"] += 1
    next_time = clock["updates"] * clock["update_interval"]
    clock["update_step"] = max(step + 1, int(np.ceil(next_time / clock["step_length"] - 1e-9)))


@kernel
def observe_costs(w: World, time):
    """Set the cost of every link: its length over the mean speed of the vehicles on it, noisy."""
    clock = w.links.clock[0]
    all_vehicles, all_moving = 0.0, 0.0
    for link in range(clock["links"]):
        road = w.routes.road[link]
        vehicles, moving = observe(w, link, time)
        all_vehicles += vehicles
        all_moving += moving * road["free_speed"]
        share = moving / vehicles if vehicles > 0.0 else 1.0
        queue = w.links.queue[link]
        chance = draw(clock["seed"], queue["key"], NOISE, clock["updates"])
        cost = queue["free_time"] / max(share, _STANDSTILL) * (1.0 + clock["noise"] * chance)
        road["cost"] = in_milliseconds(cost)
    clock["mean_speed"] = all_moving / all_vehicles if all_vehicles > 0.0 else np.nan


@kernel
def in_milliseconds(seconds):
    """Round to whole ms, at least 1 (so that every link of a tree brings one nearer)."""
    return np.int32(min(max(seconds * 1000.0 + 0.5, 1.0), float(UNREACHED)))


@kernel
def observe(w: World, link, time):
    """Count the vehicles on a link at this time, and those that move; all move at free speed."""
    queue, road = w.links.queue[link], w.routes.road[link]
    vehicles, moving = 0.0, 0.0
    exited, ahead = queue["left"] - 1, 0.0
    for number in range(queue["left"], queue["entered"]):
        exited, ahead = advance_wave(w.links, queue, road, exited, ahead, time)
        _, stands = position(w.links, queue, road, number, exited, ahead, time)
        size = platoon_at(w.links, queue, number)["vehicles"]
        vehicles += size
        if not stands:
            moving += size
        ahead += size
    return vehicles, moving


@kernel
def grow_tree(routes: Routes, target):
    """Find the fastest way from every node to the target: `distance`, `toward`, `settled`.

    Dijkstra's algorithm against the direction of travel, with a heap of distance and node packed
    into one number. Nodes without through traffic are not passed. Gives the nodes reached.
    """
    for v in range(routes.settled.size):
        routes.node[v]["distance"] = UNREACHED
        routes.node[v]["toward"] = -1
    routes.node[target]["distance"] = 0
    routes.heap[0] = target
    size, settled = 1, 0
    while size > 0:
        packed = routes.heap[0]
        size = pop(routes.heap, size)
        v, distance = packed & _NODE_MASK, packed >> _NODE_BITS
        if distance > routes.node[v]["distance"]:
            continue
        routes.settled[settled] = v
        settled += 1
        if v == target or routes.node[v]["through"]:
            size = relax(routes, v, distance, size)
    return settled


@kernel
def relax(routes: Routes, v, distance, size):
    """Offer the way over this node to the nodes upstream; gives the size of the heap."""
    for place in range(routes.node[v]["first_in"], routes.node[v + 1]["first_in"]):
        link = routes.into[place]
        if link < routes.road.size:  # not the origin
            road = routes.road[link]
            start, offer = routes.node[road["from_node"]], distance + road["cost"]
            if offer < start["distance"]:
                start["distance"] = offer
                start["toward"] = link
                size = push(routes.heap, size, (offer << _NODE_BITS) | road["from_node"])
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


@kernel
def blend_tree(routes: Routes, destination, share):
    """B ← (1−share)B + share·tree, for one destination."""
    keep, add = np.float32(1.0 - share), np.float32(share)
    for link in range(routes.road.size):
        weight = routes.weight[destination, link] * keep
        if routes.node[routes.road[link]["from_node"]]["toward"] == link:
            weight += add
        routes.weight[destination, link] = weight


@kernel
def find_free_flow_times(w: World):
    """Give every trip the free-flow time of its fastest route, s; inf where there is none."""
    routes = w.routes
    for link in range(routes.road.size):
        routes.road[link]["cost"] = in_milliseconds(w.links.queue[link]["free_time"])
    for destination in range(routes.destination.size - 1):
        reached = grow_tree(routes, routes.destination[destination]["node"])
        add_up_free_times(w, reached)
        first, last = routes.destination[destination], routes.destination[destination + 1]
        for place in range(first["first_trip"], last["first_trip"]):
            trip = w.log.trip[w.log.trips_by_destination[place]]
            trip["free_time"] = routes.node[trip["from_node"]]["free_time"]
    return True


@kernel
def add_up_free_times(w: World, reached):
    """Set the free-flow time of every node to the target of the tree at hand; inf: no way."""
    routes = w.routes
    for v in range(routes.settled.size):
        routes.node[v]["free_time"] = np.inf
    routes.node[routes.settled[0]]["free_time"] = 0.0
    for place in range(1, reached):
        node = routes.node[routes.settled[place]]
        queue = w.links.queue[node["toward"]]
        node["free_time"] = routes.node[queue["end_node"]]["free_time"] + queue["free_time"]
