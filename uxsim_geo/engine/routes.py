"""Route choice: reactive dynamic user optimum with inertia (Seo 2023).

At every update the instantaneous cost of each link is taken, one tree of cheapest routes is made
for every destination that somebody still wants to reach, and B ← (1−λ)B + λ·tree. Drivers of
different classes update at times of their own, from costs of their own.
"""

from __future__ import annotations

import numpy as np

from uxsim_geo.engine.link import advance_wave, platoon_at, position
from uxsim_geo.engine.random import NOISE, draw
from uxsim_geo.engine.records import NEVER, UNREACHED, Links, Routes, World, kernel, spliced

# what is farther counts as this: behind long queues and closed links there is still a way
_FARTHEST = np.int64(2**29 - 1)  # ms
_STANDSTILL = 0.01  # of the free speed: what a link counts where all stand
_NODE_BITS = 32
_NODE_MASK = 2**32 - 1


@spliced
def update_routes(w: World, step):
    """Let all drivers whose time it is look at the traffic, and choose their routes anew."""
    clock = w.links.clock[0]
    clock["update_step"] = NEVER
    for number in range(w.routes.driver.size):
        driver = w.routes.driver[number]
        while driver["observe_step"] <= step:
            observe_times(w, driver, step * clock["step_length"])
            seen = driver["observations"] * driver["interval"] - driver["delay"]
            driver["observe_step"] = first_step_from(clock, seen)
        while driver["update_step"] <= step:
            set_costs(w, number, driver["updates"])
            renew_weights(w, number)
            driver["updates"] += 1
            next_time = driver["updates"] * driver["interval"]
            driver["update_step"] = first_step_from(clock, next_time)
        clock["update_step"] = min(
            clock["update_step"], driver["observe_step"], driver["update_step"]
        )


@spliced
def first_step_from(clock, time):
    """Give the first step that begins at a time or later."""
    return int(np.ceil(time / clock["step_length"] - 1e-9))


@spliced
def observe_times(w: World, driver, time):
    """Note the instantaneous travel time of every link: length over mean speed of who is on it."""
    clock = w.links.clock[0]
    row = driver["first_row"] + driver["observations"] % driver["rows"]
    all_vehicles, all_moving = 0.0, 0.0
    for link in range(clock["links"]):
        vehicles, moving = observe(w.links, w.routes.road[link], link, time)
        all_vehicles += vehicles
        all_moving += moving * w.routes.road[link]["free_speed"]
        share = moving / vehicles if vehicles > 0.0 else 1.0
        w.routes.observed[row, link] = w.links.queue[link]["free_time"] / max(share, _STANDSTILL)
    clock["mean_speed"] = all_moving / all_vehicles if all_vehicles > 0.0 else np.nan
    driver["observations"] += 1


@kernel
def set_costs(w: World, number, update):
    """Set what every link costs these drivers at an update: (1 + noise) time, and the rest."""
    clock, driver = w.links.clock[0], w.routes.driver[number]
    for place in range(w.routes.arc.size):
        arc = w.routes.arc[place]
        if arc["head"] < 0:
            continue
        link = arc["link"]
        queue = w.links.queue[link]
        time = queue["free_time"]
        if driver["rows"] > 0:
            row = driver["first_row"] + update % driver["rows"]
            time = w.routes.observed[row, link]
        chance = draw(driver["key"], queue["key"], NOISE, update)
        cost = time * (1.0 + clock["noise"] * chance) + w.routes.extra[number, link]
        arc["cost"] = in_milliseconds(cost)
    pass_on_costs(w.routes)


@kernel
def pass_on_costs(routes: Routes):
    """Let the search for ways know what arcs cost now."""
    for place in range(routes.incoming.size):
        way = routes.incoming[place]
        way["cost"] = routes.arc[way["arc"]]["cost"]


@spliced
def renew_weights(w: World, number):
    """Renew the weights B of all destinations that these drivers are still bound for."""
    for place in range(w.routes.destination.size - 1):
        destination = w.routes.destination[place]
        if (
            destination["driver"] == number
            and destination["outstanding"] > 0
            and not destination["given"]
        ):
            renew_destination(w, place)


@kernel
def renew_destination(w: World, place):
    """Renew the weights B of one destination by the costs at hand."""
    clock, destination = w.links.clock[0], w.routes.destination[place]
    grow_tree(w.routes, destination["node"])
    if clock["logit_spread"] > 0.0:
        spread_tree(w.routes, place, clock["logit_spread"])
    else:
        blend_tree(w.routes, place, clock["update_weight"] if destination["known"] else 1.0)
    destination["known"] = 1


@kernel
def in_milliseconds(seconds):
    """Round to whole ms, at least 1 (so that every link of a tree brings one nearer); inf stays."""
    if seconds == np.inf:
        return UNREACHED
    return np.int32(min(max(seconds * 1000.0 + 0.5, 1.0), float(_FARTHEST)))


@kernel
def observe(links: Links, road, link, time):
    """Count the vehicles on a link at this time, and those that move; all move at free speed."""
    queue = links.queue[link]
    vehicles, moving = 0.0, 0.0
    exited, ahead = queue["left"] - 1, 0.0
    for number in range(queue["left"], queue["entered"]):
        exited, ahead = advance_wave(links, queue, road, exited, ahead, time)
        _, stands = position(links, queue, road, number, exited, ahead, time)
        size = platoon_at(links, queue, number)["vehicles"]
        vehicles += size
        if not stands:
            moving += size
        ahead += size
    return vehicles, moving


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
        v, distance = packed & _NODE_MASK, packed >> _NODE_BITS
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
    return (np.int64(routes.vertex[v]["distance"]) << _NODE_BITS) | v


@spliced
def goes_alone(routes: Routes, v):
    """Whether there is a nearer way from a vertex over its own arcs than known so far; takes it."""
    own, found = routes.vertex[v], False
    for number in range(own["first_out"], routes.vertex[v + 1]["first_out"]):
        arc = routes.arc[number]
        distance = routes.vertex[arc["head"]]["distance"]
        if arc["cost"] < UNREACHED and distance < UNREACHED:
            offer = min(np.int64(distance) + arc["cost"], _FARTHEST)
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
        offer = min(distance + way["cost"], _FARTHEST)
        if way["cost"] < UNREACHED:
            if offer < start["distance"]:
                start["distance"] = offer
                start["toward"] = way["arc"]
                size = push(routes.heap, size, (offer << _NODE_BITS) | way["tail"])
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


@kernel
def blend_tree(routes: Routes, destination, share):
    """B ← (1−share)B + share·tree, for one destination."""
    keep, add = np.float32(1.0 - share), np.float32(share)
    for arc in range(routes.arc.size):
        routes.weight[destination, arc] *= keep
    for v in range(routes.vertex.size):
        toward = routes.vertex[v]["toward"]
        if toward >= 0:
            routes.weight[destination, toward] += add


@kernel
def spread_tree(routes: Routes, destination, spread):
    """Give arcs that lead nearer the weight exp(−detour / spread), for one destination.

    The detour is what the way over the arc costs more than the best from its start (a logit
    choice at every vertex, on the links of Dial 1971 that lead nearer).
    """
    for v in range(routes.vertex.size - 1):
        start = routes.vertex[v]
        for arc in range(start["first_out"], routes.vertex[v + 1]["first_out"]):
            end, cost = routes.arc[arc]["head"], routes.arc[arc]["cost"]
            weight = 0.0
            if start["toward"] == arc:
                weight = 1.0
            elif cost < UNREACHED and routes.vertex[end]["distance"] < start["distance"]:
                detour = cost + routes.vertex[end]["distance"] - start["distance"]
                weight = np.exp(-detour / (1000.0 * spread))
            routes.weight[destination, arc] = weight


@kernel
def find_free_flow_times(w: World):
    """Give every trip the free-flow time of its fastest route, s; inf where there is none."""
    routes = w.routes
    for place in range(routes.arc.size):
        arc = routes.arc[place]
        if arc["head"] >= 0:
            arc["cost"] = in_milliseconds(w.links.queue[arc["link"]]["free_time"])
    pass_on_costs(routes)
    for destination in range(routes.destination.size - 1):
        reached = grow_tree(routes, routes.destination[destination]["node"])
        add_up_free_times(w, reached)
        first, last = routes.destination[destination], routes.destination[destination + 1]
        for place in range(first["first_trip"], last["first_trip"]):
            trip = w.log.trip[w.log.trips_by_destination[place]]
            begin = routes.node[trip["from_node"]]["first_vertex"]
            trip["free_time"] = routes.vertex[begin]["free_time"]
    return True


@kernel
def add_up_free_times(w: World, reached):
    """Set the free-flow time of every vertex to the target of the tree at hand; inf: no way."""
    routes = w.routes
    for v in range(routes.vertex.size):
        routes.vertex[v]["free_time"] = np.inf
    for place in range(reached):
        first = routes.vertex[place]["reached"]
        for v in range(first, first + 1 + routes.vertex[first]["others"]):
            vertex = routes.vertex[v]
            if vertex["distance"] == routes.vertex[first]["distance"]:
                vertex["free_time"] = 0.0
                if vertex["toward"] >= 0:
                    arc = routes.arc[vertex["toward"]]
                    on = routes.vertex[arc["head"]]["free_time"]
                    vertex["free_time"] = on + w.links.queue[arc["link"]]["free_time"]
