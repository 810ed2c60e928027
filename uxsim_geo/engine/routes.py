"""Route choice: reactive dynamic user optimum with inertia (Seo 2023).

At every update the instantaneous cost of each link is taken, one tree of cheapest routes is made
for every destination that somebody still wants to reach, and B ← (1−λ)B + λ·tree. Drivers of
different classes update at times of their own, from costs of their own.
"""

from __future__ import annotations

import numpy as np

from uxsim_geo.engine.history import remember, remember_lanes, set_whole
from uxsim_geo.engine.link import advance_wave, platoon_at, position
from uxsim_geo.engine.random import NOISE, draw
from uxsim_geo.engine.records import (
    LANES,
    NEVER,
    UNREACHED,
    Hierarchy,
    Lanes,
    Links,
    Routes,
    World,
    kernel,
    spliced,
)
from uxsim_geo.engine.sweep import sweep
from uxsim_geo.engine.trees import FARTHEST, grow_tree, leads_nearer

_STANDSTILL = 0.01  # of the free speed: what a link counts where all stand


@spliced
def update_routes(w: World, step, most):
    """Let all drivers whose time it is look at the traffic, and choose their routes anew.

    Gives the drivers with more than `most` destinations for which ways are wanted, when it comes
    to them: then these have to be found before this is called again. -1: all is done.
    """
    clock = w.links.clock[0]
    earliest = NEVER
    for number in range(w.routes.driver.size):
        driver = w.routes.driver[number]
        while driver["observe_step"] <= step:
            observe_times(w, driver, step * clock["step_length"])
            seen = driver["observations"] * driver["interval"] - driver["delay"]
            driver["observe_step"] = first_step_from(clock, seen)
        while driver["update_step"] <= step:
            set_costs(w, number, driver["updates"])
            driver["updates"] += 1
            next_time = driver["updates"] * driver["interval"]
            driver["update_step"] = first_step_from(clock, next_time)
            if want_ways(w.routes, number) > most:
                return number
            renew_wanted(w)
        earliest = min(earliest, driver["observe_step"], driver["update_step"])
    clock["update_step"] = earliest
    return -1


@kernel
def want_ways(routes: Routes, number):
    """Note that ways are wanted to all destinations that these drivers are still bound for."""
    count = 0
    for place in range(routes.destination.size - 1):
        destination = routes.destination[place]
        if (
            destination["driver"] == number
            and destination["outstanding"] > 0
            and not destination["given"]
        ):
            destination["wanted"] = 1
            count += 1
    return count


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


@kernel
def pass_on_costs(routes: Routes):
    """Let the search for ways know what arcs cost now."""
    for place in range(routes.incoming.size):
        way = routes.incoming[place]
        way["cost"] = routes.arc[way["arc"]]["cost"]


@kernel
def renew_wanted(w: World):
    """Renew the weights B of all destinations to which ways are wanted, by trees of the heap."""
    pass_on_costs(w.routes)
    for place in range(w.routes.destination.size - 1):
        if w.routes.destination[place]["wanted"]:
            grow_tree(w.routes, w.routes.destination[place]["node"])
            renew_destination(w, place)
    return True


@kernel
def renew_destination(w: World, place):
    """Renew the weights B of one destination by the tree at hand."""
    clock, destination = w.links.clock[0], w.routes.destination[place]
    for v in range(w.routes.vertex.size - 1):
        for arc in range(w.routes.vertex[v]["first_out"], w.routes.vertex[v + 1]["first_out"]):
            on_tree = leads_nearer(w.routes, v, arc)
            if clock["logit_spread"] > 0.0:
                spread_arc(w.routes, destination["slot"], v, arc, clock["logit_spread"])
            elif destination["known"]:
                remember(w.routes, destination["slot"], arc, on_tree, clock["update_weight"])
            else:
                set_whole(w.routes, destination["slot"], arc, on_tree)
    destination["known"], destination["wanted"] = 1, 0


@kernel
def renew_lanes(w: World, h: Hierarchy, batch, room: Lanes):
    """Renew the weights B of a batch by a sweep; False: some are too far, nothing is changed."""
    clock, destination = w.links.clock[0], w.routes.destination
    if not sweep(h, w.routes, room):
        return False
    if clock["logit_spread"] > 0.0:
        spread_lanes(w.routes, h, batch, room, clock["logit_spread"])
    else:
        for lane in range(LANES):
            own = room.own[lane]
            room.idle[lane] = 255 if own < 0 else 0
            room.fresh[lane] = 255 if own >= 0 and not destination[own]["known"] else 0
        remember_lanes(w.routes, h, batch, room, clock["update_weight"])
    for lane in range(LANES):
        if room.own[lane] >= 0:
            destination[room.own[lane]]["known"] = 1
            destination[room.own[lane]]["wanted"] = 0
    return True


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
def spread_arc(routes: Routes, slot, v, number, spread):
    """Give an arc that leads nearer the weight exp(−detour / spread), any other none.

    The detour is what the way over the arc costs more than the best from its start (a logit
    choice at every vertex, on the links of Dial 1971 that lead nearer).
    """
    start, arc = routes.vertex[v], routes.arc[number]
    weight = 0.0
    if leads_nearer(routes, v, number):
        weight = 1.0
    elif arc["head"] >= 0 and arc["cost"] < UNREACHED:
        beyond = routes.vertex[arc["head"]]["distance"]
        if beyond < start["distance"]:
            weight = weight_of_detour(beyond + arc["cost"] - start["distance"], spread)
    routes.weight[slot // LANES, number, slot % LANES] = weight


@kernel
def spread_lanes(routes: Routes, h: Hierarchy, batch, room: Lanes, spread):
    """Give the arcs their weights in a logit choice, for all lanes of a batch."""
    for number in range(h.tail.size):
        tail, head, cost = h.tail[number], h.head[number], routes.arc[number]["cost"]
        for lane in range(LANES):
            if room.own[lane] < 0:
                continue
            start, beyond = room.distance[tail, lane], room.distance[head, lane]
            weight = 0.0
            if cost < UNREACHED and beyond < start:
                weight = weight_of_detour(beyond + cost - start, spread)
            routes.weight[batch, number, lane] = weight


@kernel
def weight_of_detour(detour, spread):
    """Weight of a way that costs so many ms more than the best; spread in s."""
    return np.exp(-detour / (1000.0 * spread))
