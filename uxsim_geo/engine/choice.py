"""The out-link that the first platoon of a queue chooses, by the weights B of its destination."""

from __future__ import annotations

from uxsim_geo.engine.link import platoon_at
from uxsim_geo.engine.random import CHOICE, draw
from uxsim_geo.engine.records import ARRIVE, DEAD_END, World, kernel


@kernel
def choose(w: World, q, step):
    """Draw the out-link of the first platoon of queue q by the weights B of its destination.

    A blocked platoon draws again in every step. `since_step` is the first step of an unbroken run
    of one and the same outcome: no move may be earlier, or platoons would move in their past. A
    platoon with one out-link only has always wanted that.
    """
    queue = w.links.queue[q]
    platoon = platoon_at(w.links, queue, queue["left"])
    destination = platoon["destination"]
    before, unbroken = queue["choice"], queue["chosen_step"] == step - 1
    queue["chosen_step"] = step
    if w.routes.destination[destination]["node"] == queue["end_node"]:
        queue["choice"] = ARRIVE
        return
    total, options, only = add_up_weights(w, queue["end_node"], destination)
    if options <= 1:
        queue["choice"] = only
        queue["since_step"] = -1
        return
    chance = draw(platoon["key"], queue["key"], CHOICE, step)
    queue["choice"] = pick(w, queue["end_node"], destination, chance * total)
    if not (unbroken and queue["choice"] == before):
        queue["since_step"] = step


@kernel
def add_up_weights(w: World, v, destination):
    """Sum the weights of the out-links of node v; how many have any, and the last of them."""
    total, options, only = 0.0, 0, DEAD_END
    for link in range(w.routes.node[v]["first_out"], w.routes.node[v + 1]["first_out"]):
        weight = w.routes.weight[destination, link]
        if weight > 0.0:
            total += weight
            options += 1
            only = link
    return total, options, only


@kernel
def pick(w: World, v, destination, mark):
    """Give the out-link in whose share of the summed weights the mark lies."""
    picked, passed = DEAD_END, 0.0
    for link in range(w.routes.node[v]["first_out"], w.routes.node[v + 1]["first_out"]):
        weight = w.routes.weight[destination, link]
        if weight > 0.0:
            picked = link
            passed += weight
            if mark < passed:
                break
    return picked
