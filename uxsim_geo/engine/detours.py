"""Routes between two updates: for who is newly bound somewhere, and where a link is closed."""

from __future__ import annotations

from uxsim_geo.engine.history import set_whole, weight_at
from uxsim_geo.engine.records import LANES, Hierarchy, Lanes, Routes, World, kernel
from uxsim_geo.engine.routes import pass_on_costs, renew_wanted, set_costs
from uxsim_geo.engine.sweep import sweep, take_lane
from uxsim_geo.engine.trees import grow_tree, leads_nearer


@kernel
def strand(w: World, number, avoided):
    """Take the weight off links that drivers can no longer enter; shape of `avoided`: (links,).

    Gives the number of their destinations to which some vertex has lost all its weights. Ways to
    these are wanted, by the costs of the last update.
    """
    count = 0
    for place in range(w.routes.destination.size - 1):
        destination = w.routes.destination[place]
        if destination["driver"] == number and destination["known"]:
            destination["wanted"] = is_stranded(w.routes, destination["slot"], avoided)
            count += destination["wanted"]
    if count > 0:
        set_costs(w, number, last_update(w, number))
        pass_on_costs(w.routes)
    return count


@kernel
def is_stranded(routes: Routes, slot, avoided):
    """Take away the weights of avoided links; 1: some vertex has lost all that it had."""
    stranded = 0
    for v in range(routes.vertex.size - 1):
        lost = False
        for arc in range(routes.vertex[v]["first_out"], routes.vertex[v + 1]["first_out"]):
            if avoided[routes.arc[arc]["link"]] and weight_at(routes, slot, arc) > 0.0:
                set_whole(routes, slot, arc, False)
                lost = True
        if lost and weight_from(routes, slot, v) == 0.0:
            stranded = 1
    return stranded


@kernel
def lead_on(routes: Routes, place, avoided):
    """Give vertices that have lost all their weights those of the tree at hand.

    That is the cheapest way on, and may be the link that is avoided: then they wait for it.
    """
    destination = routes.destination[place]
    slot = destination["slot"]
    for v in range(routes.vertex.size - 1):
        first, last = routes.vertex[v]["first_out"], routes.vertex[v + 1]["first_out"]
        lost = 0
        for arc in range(first, last):
            lost |= avoided[routes.arc[arc]["link"]]
        if lost and weight_from(routes, slot, v) == 0.0:
            for arc in range(first, last):
                if leads_nearer(routes, v, arc):
                    set_whole(routes, slot, arc, True)
    destination["wanted"] = 0


@kernel
def lead_all_on(routes: Routes, avoided):
    """Lead vertices on to all destinations to which ways are wanted, by trees of the heap."""
    for place in range(routes.destination.size - 1):
        if routes.destination[place]["wanted"]:
            grow_tree(routes, routes.destination[place]["node"])
            lead_on(routes, place, avoided)
    return True


@kernel
def lead_lanes_on(routes: Routes, h: Hierarchy, room: Lanes, avoided):
    """Do the same for the destinations of a batch, by a sweep; False: some are too far."""
    if not sweep(h, routes, room):
        return False
    for lane in range(LANES):
        if room.own[lane] >= 0:
            take_lane(h, routes, room.distance, lane)
            lead_on(routes, room.own[lane], avoided)
    return True


@kernel
def weight_from(routes: Routes, slot, v):
    """Sum the weights of the arcs from vertex v."""
    total = 0.0
    for arc in range(routes.vertex[v]["first_out"], routes.vertex[v + 1]["first_out"]):
        total += weight_at(routes, slot, arc)
    return total


@kernel
def last_update(w: World, number):
    """Give the number of the update that these drivers have made last."""
    return max(w.routes.driver[number]["updates"] - 1, 0)


@kernel
def find_ways(w: World, most):
    """Find the ways to destinations for which somebody is newly bound during a run, at once.

    Gives drivers with more than `most` of them, and -1, as `update_routes` does.
    """
    for number in range(w.routes.driver.size):
        if w.routes.driver[number]["updates"] > 0 and want_new_ways(w.routes, number) > 0:
            set_costs(w, number, last_update(w, number))
            if want_new_ways(w.routes, number) > most:
                return number
            renew_wanted(w)
    return -1


@kernel
def want_new_ways(routes: Routes, number):
    """Note that ways are wanted to the destinations of these drivers that are new."""
    count = 0
    for place in range(routes.destination.size - 1):
        one = routes.destination[place]
        if one["driver"] == number and not one["known"] and not one["given"]:
            one["wanted"] = one["outstanding"] > 0
            count += one["wanted"]
    return count
