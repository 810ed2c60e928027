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
from uxsim_geo.engine.trees import FARTHEST, grow_tree

_STANDSTILL = 0.01  # of the free speed: what a link counts where all stand


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
    return np.int32(min(max(seconds * 1000.0 + 0.5, 1.0), float(FARTHEST)))


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
        grow_tree(routes, routes.destination[destination]["node"])
        add_up_free_times(w)
        first, last = routes.destination[destination], routes.destination[destination + 1]
        for place in range(first["first_trip"], last["first_trip"]):
            trip = w.log.trip[w.log.trips_by_destination[place]]
            begin = routes.node[trip["from_node"]]["first_vertex"]
            trip["free_time"] = routes.vertex[begin]["free_time"]
    return True


@kernel
def add_up_free_times(w: World):
    """Set the free-flow time of every vertex to the target of the tree at hand; inf: no way."""
    routes = w.routes
    for v in range(routes.vertex.size):
        vertex = routes.vertex[v]
        vertex["free_time"] = np.inf if vertex["distance"] > 0 else 0.0
    for v in range(routes.vertex.size - 1):
        add_up_free_time(w, v)


@kernel
def add_up_free_time(w: World, v):
    """Set the free-flow times of a vertex and of those on its way that have none yet.

    The heap, which the search has done with, holds the vertices between.
    """
    routes, size = w.routes, 0
    while routes.vertex[v]["free_time"] == np.inf and routes.vertex[v]["toward"] >= 0:
        arc = routes.vertex[v]["toward"]
        routes.heap[size] = v
        size += 1
        v = routes.arc[arc]["head"]
    on = routes.vertex[v]["free_time"]
    while size > 0:
        size -= 1
        vertex = routes.vertex[routes.heap[size]]
        on += w.links.queue[routes.arc[vertex["toward"]]["link"]]["free_time"]
        vertex["free_time"] = on
