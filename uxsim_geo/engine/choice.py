"""The out-link that the first platoon of a queue chooses, by the weights B of its destination."""

from __future__ import annotations

import numpy as np

from uxsim_geo.engine.history import weight_at
from uxsim_geo.engine.random import CHOICE, draw
from uxsim_geo.engine.records import ARRIVE, DEAD_END, NOTHING, World, kernel, spliced


@kernel
def choose(w: World, q, step):
    """Draw the out-link of the first platoon of queue q by the weights B of its destination.

    A blocked platoon draws again in every step. `since_step` is the first step of an unbroken run
    of one and the same outcome: no move may be earlier, or platoons would move in their past. A
    platoon that never had but one out-link has always wanted that.
    """
    queue = w.links.queue[q]
    destination = queue["destination"]
    before, unbroken = queue["choice"], queue["chosen_step"] == step - 1
    queue["chosen_step"] = step
    if w.routes.destination[destination]["node"] == queue["end_node"]:
        queue["choice"] = ARRIVE
        return
    if w.routes.destination[destination]["given"]:
        want(w, queue, w.routes.given[first_trip(w, queue)["route"]])
        queue["since_step"] = -1
        return
    options = draw_arc(w, queue, step)
    if options <= 1 and before == NOTHING:
        queue["since_step"] = -1
    elif queue["choice"] != before or (options > 1 and not unbroken):
        queue["since_step"] = step


@kernel
def first_trip(w: World, queue):
    """Give the trip of the first platoon of a queue."""
    return w.log.trip[queue["trip"]]


@spliced
def draw_arc(w: World, queue, step):
    """Draw the arc of a first platoon that chooses; gives how many it has to choose from."""
    clock, first = w.links.clock[0], w.routes.vertex[queue["vertex"]]["first_out"]
    arcs = w.routes.vertex[queue["vertex"] + 1]["first_out"] - first
    slot = w.routes.destination[queue["destination"]]["slot"]
    trail = first_trip(w, queue)["trail"] if clock["no_cycles"] else -1
    while True:
        options, place = add_up_weights(w, first, arcs, slot, trail)
        if options > 0 or trail < 0:
            break
        trail = -1  # it has been everywhere: then that does not count
    if options > 1:
        if clock["deterministic"]:
            place = heaviest(w, first, arcs, slot, trail)
        else:
            chance = draw(w.log.key[queue["trip"]], queue["key"], CHOICE, step)
            place = min(place, pick(w, arcs, chance * w.routes.passed[arcs - 1]))
    want(w, queue, first + place if options > 0 else np.int64(DEAD_END))
    return options


@kernel
def want(w: World, queue, arc):
    """Note over which arc the first platoon of a queue is to go on; DEAD_END: over none."""
    queue["arc"] = arc
    queue["choice"] = w.routes.arc[arc]["link"] if arc >= 0 else DEAD_END


@kernel
def weight_of(w: World, slot, arc, trail):
    """Give the weight of an arc for a trip that has left this trail; none where it would return."""
    weight = weight_at(w.routes, slot, arc)
    if trail >= 0 and weight > 0.0 and was_visited(w, w.routes.arc[arc]["head"], trail):
        return 0.0
    return weight


@kernel
def was_visited(w: World, v, trail):
    """Whether vertex v is in the trail."""
    while trail >= 0:
        if w.routes.trail[trail]["vertex"] == v:
            return True
        trail = w.routes.trail[trail]["before"]
    return False


@kernel
def may_choose(w: World, queue, arc):
    """Whether the first platoon of a queue may choose this arc, in this step or a later."""
    destination = w.routes.destination[queue["destination"]]
    if destination["given"]:
        return w.routes.given[first_trip(w, queue)["route"]] == arc
    return weight_at(w.routes, destination["slot"], arc) > 0.0


@kernel
def add_up_weights(w: World, first, arcs, slot, trail):
    """Sum the weights from the first arc to each; how many have any, and the place of the last."""
    total, options, last = 0.0, 0, 0
    for place in range(arcs):
        weight = weight_of(w, slot, first + place, trail)
        total += weight
        w.routes.passed[place] = total
        options += weight > 0.0
        last = place if weight > 0.0 else last
    return options, last


@kernel
def pick(w: World, arcs, mark):
    """Give the place of the arc in whose share of the summed weights the mark lies."""
    place = 0
    for other in range(arcs):  # without branches: nobody could foresee them
        place += w.routes.passed[other] <= mark
    return place


@kernel
def heaviest(w: World, first, arcs, slot, trail):
    """Give the place of the arc of most weight, of several the first."""
    picked, most = 0, 0.0
    for place in range(arcs):
        weight = weight_of(w, slot, first + place, trail)
        if weight > most:
            picked, most = place, weight
    return picked
