"""What control needs of the engine: a look at the state, and things changed from outside.

All of it happens between two steps: what is changed holds from the step to come.
"""

from __future__ import annotations

import math

from uxsim_geo.engine.calendar import list_for, step_of, unlist
from uxsim_geo.engine.link import platoon_at, see_first
from uxsim_geo.engine.records import Links, Queues, kernel
from uxsim_geo.engine.routes import observe


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
