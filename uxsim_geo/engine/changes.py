"""What control needs of the engine: a look at the state, and things changed from outside.

All of it happens between two steps: what is changed holds from the step to come.
"""

from __future__ import annotations

import math

import numpy as np

from uxsim_geo.engine.calendar import list_for, step_of, unlist
from uxsim_geo.engine.link import platoon_at, see_first
from uxsim_geo.engine.records import Links, Queues, World, kernel
from uxsim_geo.engine.routes import observe, renew_destination, set_costs
from uxsim_geo.engine.trees import grow_tree


@kernel
def sense_state(links: Links, road, standing, waiting):
    """Count the vehicles that stand on every link, and those that wait to enter at every node."""
    clock = links.clock[0]
    time = clock["step"] * clock["step_length"]
    for link in range(clock["links"]):
        vehicles, moving = observe(links, road[link], link, time)
        standing[link] = vehicles - moving
    for origin in range(clock["links"], links.queue.size):
        queue = links.queue[origin]
        waiting[queue["end_node"]] = vehicles_gone_out(links, queue, time) - queue["vehicles_left"]
    return True


@kernel
def vehicles_gone_out(links: Links, queue, time):
    """Count the vehicles of an origin that have left home by a time; it goes on from the last."""
    while queue["next_hole"] < queue["entered"]:
        platoon = platoon_at(links, queue, queue["next_hole"])
        if platoon["enter"] > time:
            break
        queue["next_hole"] += 1
        queue["hole_vehicles"] += platoon["vehicles"]
    return queue["hole_vehicles"]


@kernel
def refresh_queues(w: Queues, changed):
    """List queues anew whose first platoon may now leave earlier, or later, than it could."""
    clock = w.links.clock[0]
    for place in range(changed.size):
        q = changed[place]
        queue = w.links.queue[q]
        see_first(w.links, queue)
        if queue["ready"] < math.inf:
            target = max(step_of(clock, queue["ready"]), clock["step"])
            if queue["listed_step"] > target:  # to be looked at too early does no harm
                unlist(w, q)
            list_for(w, q, target)
    return True


@kernel
def turn_away(w: World, avoided):
    """Take the weight off links that drivers can no longer enter; shape (drivers, links).

    Where no other out-link is left, the cheapest way on by the costs of the last update takes
    its place, which may be the same link: then they wait for it.
    """
    for number in range(w.routes.driver.size):
        has_costs = False
        for place in range(w.routes.destination.size - 1):
            destination = w.routes.destination[place]
            if destination["driver"] != number or not destination["known"]:
                continue
            if strand(w, place, avoided[number]):
                if not has_costs:
                    set_costs(w, number, last_update(w, number))
                    has_costs = True
                grow_tree(w.routes, destination["node"])
                lead_on(w, place, avoided[number])
    return True


@kernel
def strand(w: World, place, avoided):
    """Take away the weights of avoided links; whether some vertex has lost all that it had."""
    stranded = False
    for v in range(w.routes.vertex.size - 1):
        lost = False
        for arc in range(w.routes.vertex[v]["first_out"], w.routes.vertex[v + 1]["first_out"]):
            if avoided[w.routes.arc[arc]["link"]] and w.routes.weight[place, arc] > 0.0:
                w.routes.weight[place, arc] = 0.0
                lost = True
        if lost and weight_from(w, place, v) == 0.0:
            stranded = True
    return stranded


@kernel
def lead_on(w: World, place, avoided):
    """Give vertices that have lost all their weights that of the tree at hand."""
    for v in range(w.routes.vertex.size - 1):
        toward = w.routes.vertex[v]["toward"]
        for arc in range(w.routes.vertex[v]["first_out"], w.routes.vertex[v + 1]["first_out"]):
            if (
                avoided[w.routes.arc[arc]["link"]]
                and toward >= 0
                and weight_from(w, place, v) == 0.0
            ):
                w.routes.weight[place, toward] = 1.0


@kernel
def weight_from(w: World, place, v):
    """Sum the weights of the arcs from vertex v."""
    total = np.float32(0.0)
    for arc in range(w.routes.vertex[v]["first_out"], w.routes.vertex[v + 1]["first_out"]):
        total += w.routes.weight[place, arc]
    return total


@kernel
def last_update(w: World, number):
    """Give the number of the update that these drivers have made last."""
    return max(w.routes.driver[number]["updates"] - 1, 0)


@kernel
def find_ways(w: World):
    """Find the ways to destinations for which somebody is newly bound during a run, at once."""
    for place in range(w.routes.destination.size - 1):
        destination = w.routes.destination[place]
        number = destination["driver"]
        if destination["known"] or destination["given"] or destination["outstanding"] == 0:
            continue
        if w.routes.driver[number]["updates"] > 0:
            set_costs(w, number, last_update(w, number))
            renew_destination(w, place)
    return True
