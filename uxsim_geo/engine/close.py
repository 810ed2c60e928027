"""The end of a run: what is still on the road, and whether it can ever move again."""

from __future__ import annotations

import math

from uxsim_geo.engine.link import advance_wave, opening, platoon_at, position
from uxsim_geo.engine.records import World, kernel


@kernel
def write_remaining(w: World):
    """Write events without an exit for the platoons still on links, and the metres gone there.

    False: the buffer is full; call again once it has room. It must hold the fullest link.
    """
    clock = w.clock[0]
    while clock["swept"] < clock["links"]:
        queue = w.queue[clock["swept"]]
        if clock["events"] + queue["entered"] - queue["left"] > w.event.size:
            return False
        write_link(w, clock["swept"])
        clock["swept"] += 1
    return True


@kernel
def write_link(w: World, link):
    """Write the platoons on one link."""
    clock, queue, road = w.clock[0], w.queue[link], w.road[link]
    exited, ahead = queue["left"] - 1, 0.0
    for number in range(queue["left"], queue["entered"]):
        platoon = platoon_at(w, queue, number)
        exited, ahead = advance_wave(w, queue, road, exited, ahead, clock["end"])
        metres, _ = position(w, link, number, exited, ahead, clock["end"])
        w.trip[platoon["trip"]]["covered"] = metres
        event = w.event[clock["events"]]
        event["trip"], event["link"] = platoon["trip"], link
        event["enter"], event["exit"] = platoon["enter"], math.nan
        clock["events"] += 1
        ahead += platoon["vehicles"]


@kernel
def find_locked(w: World):
    """Mark the links from which no move can ever happen again unless routes change.

    On them the first platoon can only choose links that are full until somebody leaves, and that
    are themselves marked: the largest such set, found by taking away what does not belong.
    """
    clock = w.clock[0]
    for link in range(clock["links"]):
        w.queue[link]["locked"] = w.queue[link]["left"] < w.queue[link]["entered"]
    changed = True
    while changed:
        changed = False
        for link in range(clock["links"]):
            if w.queue[link]["locked"] and may_move(w, w.queue[link]):
                w.queue[link]["locked"] = 0
                changed = True
    clock["vehicles_locked"] = 0
    for link in range(clock["links"]):
        queue = w.queue[link]
        if queue["locked"]:
            clock["vehicles_locked"] += int(queue["vehicles_entered"] - queue["vehicles_left"])


@kernel
def may_move(w: World, queue):
    """Whether the first platoon of a queue has a way on that is open or may open."""
    platoon, v = platoon_at(w, queue, queue["left"]), queue["end_node"]
    ways = False
    for link in range(w.node[v]["first_out"], w.node[v + 1]["first_out"]):
        if w.weight[platoon["destination"], link] > 0.0:
            ways = True
            closed = opening(w, link, platoon["vehicles"]) == math.inf
            if not (closed and w.queue[link]["locked"]):
                return True
    return not ways or w.destination_node[platoon["destination"]] == v
