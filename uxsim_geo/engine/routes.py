"""Route choice: reactive dynamic user optimum with inertia (Seo 2023).

At every update the instantaneous cost of each link is taken, one tree of fastest routes is made
for every destination that somebody still wants to reach, and B ← (1−λ)B + λ·tree.
"""

from __future__ import annotations

import numpy as np

from uxsim_geo.engine.link import advance_wave, platoon_at, position
from uxsim_geo.engine.random import NOISE, draw
from uxsim_geo.engine.records import World, kernel

UNREACHED = np.int32(2**29)  # ms, 149 hours; the sum of two fits into 32 bits
_STANDSTILL = 0.01  # of the free speed: what a link counts where all stand
_NODE_BITS = 32
_NODE_MASK = 2**32 - 1


@kernel
def update_routes(w: World, step):
    """Bring the weights B of all destinations up to date with the traffic at this step."""
    clock = w.clock[0]
    observe_costs(w, step * clock["step_length"])
    share = clock["update_weight"] if clock["updates"] > 0 else 1.0
    for destination in range(w.destination_node.size):
        if w.outstanding[destination] > 0:
            grow_tree(w, w.destination_node[destination])
            blend_tree(w, destination, share)
    clock["updates"] += 1
    next_time = clock["updates"] * clock["update_interval"]
    clock["update_step"] = max(step + 1, int(np.ceil(next_time / clock["step_length"] - 1e-9)))


@kernel
def observe_costs(w: World, time):
    """Set the cost of every link: its length over the mean speed of the vehicles on it, noisy."""
    clock = w.clock[0]
    all_vehicles, all_moving = 0.0, 0.0
    for link in range(clock["links"]):
        road = w.road[link]
        vehicles, moving = observe(w, link, time)
        all_vehicles += vehicles
        all_moving += moving * road["free_speed"]
        share = moving / vehicles if vehicles > 0.0 else 1.0
        noise = clock["noise"] * draw(clock["seed"], w.queue[link]["key"], NOISE, clock["updates"])
        cost = w.queue[link]["free_time"] / max(share, _STANDSTILL) * (1.0 + noise)
        w.cost[link] = in_milliseconds(cost)
    clock["mean_speed"] = all_moving / all_vehicles if all_vehicles > 0.0 else np.nan


@kernel
def in_milliseconds(seconds):
    """Round to whole ms, at least 1 (so that every link of a tree brings one nearer)."""
    return np.int32(min(max(seconds * 1000.0 + 0.5, 1.0), float(UNREACHED)))


@kernel
def observe(w: World, link, time):
    """Count the vehicles on a link at this time, and those that move; all move at free speed."""
    queue, road = w.queue[link], w.road[link]
    vehicles, moving = 0.0, 0.0
    exited, ahead = queue["left"] - 1, 0.0
    for number in range(queue["left"], queue["entered"]):
        exited, ahead = advance_wave(w, queue, road, exited, ahead, time)
        _, stands = position(w, link, number, exited, ahead, time)
        size = platoon_at(w, queue, number)["vehicles"]
        vehicles += size
        if not stands:
            moving += size
        ahead += size
    return vehicles, moving


@kernel
def grow_tree(w: World, target):
    """Find the fastest way from every node to the target: `distance`, `toward`, `settled`.

    Dijkstra's algorithm against the direction of travel, with a heap of distance and node packed
    into one number. Nodes without through traffic are not passed. Gives the nodes reached.
    """
    w.distance[:] = UNREACHED
    w.toward[:] = -1
    w.distance[target] = 0
    w.heap[0] = target
    size, settled = 1, 0
    while size > 0:
        packed = w.heap[0]
        size = pop(w.heap, size)
        node, distance = packed & _NODE_MASK, packed >> _NODE_BITS
        if distance > w.distance[node]:
            continue
        w.settled[settled] = node
        settled += 1
        if node == target or w.node[node]["through"]:
            size = relax(w, node, distance, size)
    return settled


@kernel
def relax(w: World, node, distance, size):
    """Offer the way over this node to the nodes upstream; gives the size of the heap."""
    links = w.clock[0]["links"]
    for place in range(w.node[node]["first_in"], w.node[node + 1]["first_in"]):
        link = w.into[place]
        if link < links:
            start = w.road[link]["from_node"]
            offer = distance + w.cost[link]
            if offer < w.distance[start]:
                w.distance[start] = offer
                w.toward[start] = link
                size = push(w.heap, size, (offer << _NODE_BITS) | start)
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
def blend_tree(w: World, destination, share):
    """B ← (1−share)B + share·tree, for one destination."""
    keep = np.float32(1.0 - share)
    add = np.float32(share)
    for link in range(w.clock[0]["links"]):
        weight = w.weight[destination, link] * keep
        if w.toward[w.road[link]["from_node"]] == link:
            weight += add
        w.weight[destination, link] = weight


@kernel
def find_free_flow_times(w: World):
    """Give every trip the free-flow time of its fastest route, s; inf where there is none."""
    for link in range(w.clock[0]["links"]):
        w.cost[link] = in_milliseconds(w.queue[link]["free_time"])
    for destination in range(w.destination_node.size):
        target = w.destination_node[destination]
        settled = grow_tree(w, target)
        w.free_time[:] = np.inf
        w.free_time[target] = 0.0
        for place in range(1, settled):
            node = w.settled[place]
            queue = w.queue[w.toward[node]]
            w.free_time[node] = w.free_time[queue["end_node"]] + queue["free_time"]
        for place in range(w.first_trip[destination], w.first_trip[destination + 1]):
            trip = w.trip[w.trips_by_destination[place]]
            trip["free_time"] = w.free_time[trip["from_node"]]
