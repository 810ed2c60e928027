"""The end of a run: what is still on the road, and whether it can ever move again."""

from __future__ import annotations

import math

import numpy as np

from uxsim_geo.engine.choice import may_choose
from uxsim_geo.engine.link import advance_wave, opening, platoon_at, position
from uxsim_geo.engine.records import World, kernel, spliced


@spliced
def finish_run(w: World):
    """End a run; False: the buffer of events is full, call again once it has room."""
    if w.links.clock[0]["swept"] == 0:  # not when called again
        find_locked(w)
    return write_remaining(w)


@spliced
def write_remaining(w: World):
    """Write events without an exit for the platoons still on links, and the metres gone there.

    False: the buffer is full; call again once it has room. It must hold the fullest link.
    """
    clock = w.links.clock[0]
    while clock["swept"] < clock["links"]:
        queue = w.links.queue[clock["swept"]]
        if clock["events"] + queue["entered"] - queue["left"] > w.log.event.size:
            return False
        write_link(w, clock["swept"])
        clock["swept"] += 1
    return True


@spliced
def write_link(w: World, link):
    """Write the platoons on one link."""
    clock, queue, road = w.links.clock[0], w.links.queue[link], w.routes.road[link]
    exited, ahead = queue["left"] - 1, 0.0
    for number in range(queue["left"], queue["entered"]):
        platoon = platoon_at(w.links, queue, number)
        exited, ahead = advance_wave(w.links, queue, road, exited, ahead, clock["end"])
        metres, _ = position(w.links, queue, road, number, exited, ahead, clock["end"])
        w.log.trip[platoon["trip"]]["covered"] = metres
        event = w.log.event[clock["events"]]
        event["trip"], event["link"] = platoon["trip"], link
        event["enter"], event["exit"] = platoon["enter"], math.nan
        clock["events"] += 1
        ahead += platoon["vehicles"]


@spliced
def find_locked(w: World):
    """Mark the links from which no move can ever happen again unless routes change.

    On them the first platoon can only choose links that are full until somebody leaves, and that
    are themselves marked: the largest such set, found by taking away what does not belong.
    """
    clock = w.links.clock[0]
    for link in range(clock["links"]):
        w.links.queue[link]["locked"] = w.links.queue[link]["left"] < w.links.queue[link]["entered"]
    changed = True
    while changed:
        changed = False
        for link in range(clock["links"]):
            if w.links.queue[link]["locked"] and may_move(w, w.links.queue[link]):
                w.links.queue[link]["locked"] = 0
                changed = True
    clock["vehicles_locked"] = 0
    for link in range(clock["links"]):
        queue = w.links.queue[link]
        if queue["locked"]:
            clock["vehicles_locked"] += int(queue["vehicles_entered"] - queue["vehicles_left"])


@kernel
def may_move(w: World, queue):
    """Whether the first platoon of a queue has a way on that is open or may open."""
    v, ways = queue["vertex"], False
    for arc in range(w.routes.vertex[v]["first_out"], w.routes.vertex[v + 1]["first_out"]):
        if may_choose(w, queue, arc):
            ways, link = True, np.int64(w.routes.arc[arc]["link"])
            closed = opening(w.links, link, queue["vehicles"]) == math.inf
            if not (closed and w.links.queue[link]["locked"]):
                return True
    return not ways or w.routes.destination[queue["destination"]]["node"] == queue["end_node"]
