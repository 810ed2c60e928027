"""The run itself: step after step, the nodes where something can happen."""

from __future__ import annotations

from uxsim_geo.engine.calendar import mark
from uxsim_geo.engine.changes import refresh_queues, sense_state
from uxsim_geo.engine.close import finish_run
from uxsim_geo.engine.foresight import call_choices, call_exits, call_queues
from uxsim_geo.engine.node import visit
from uxsim_geo.engine.records import Calendar, World, compiled, spliced


@spliced
def advance(w: World):
    """Run up to the start of step `until_step`; False: a buffer is full, call again with room.

    In a step the marked nodes are visited upwards by their number, and round again while any is
    marked. That order depends on nothing else, so that what happens in one part of the network
    cannot change it in another. Stopping and going on, wherever, changes nothing in the results.
    """
    clock = w.links.clock[0]
    while clock["step"] < clock["until_step"]:
        if clock["opened_step"] < clock["step"]:
            open_step(w, clock["step"])
        while clock["pending"] > 0:
            v = next_pending(w.calendar, clock["cursor"])
            w.calendar.pending[v] = 0
            clock["pending"] -= 1
            clock["cursor"] = v
            if clock["is_large"] and clock["pending"] > 1:
                look_ahead(w, v)
            if not visit(w, v, clock["step"]):
                mark(w, v)
                return False
            clock["cursor"] = v + 1
        clock["step"] += 1
    return True


@spliced
def open_step(w: World, step):
    """Mark the nodes of all queues listed for a step."""
    clock = w.links.clock[0]
    q = w.calendar.bucket[step]
    while q >= 0:
        queue = w.links.queue[q]
        queue["listed_step"] = -1
        mark(w, queue["end_node"])
        q = queue["next"]
    clock["opened_step"] = step
    clock["cursor"] = 0


@spliced
def look_ahead(w: World, v):
    """Have what the next two visits read on its way."""
    clock = w.links.clock[0]
    horizon = (clock["step"] + 1) * clock["step_length"]
    next_one = next_pending(w.calendar, v)
    call_exits(w, next_one, horizon)
    next_one = next_pending(w.calendar, next_one + 1)
    call_choices(w, next_one, horizon)
    call_queues(w, next_pending(w.calendar, next_one + 1))


@spliced
def next_pending(calendar: Calendar, v):
    """Give the first marked node from v upwards and round again; there must be one."""
    while True:
        if v >= calendar.pending.size:
            v = 0
        if v & 7 == 0 and calendar.pending_words[v >> 3] == 0:
            v += 8
        elif calendar.pending[v]:
            return v
        else:
            v += 1


@compiled
def run_until(w):
    """See `advance`."""
    return advance(w)


@compiled
def finish(w):
    """See `finish_run`."""
    return finish_run(w)


@compiled
def sense(links, road, standing, waiting):
    """See `sense_state`."""
    return sense_state(links, road, standing, waiting)


@compiled
def refresh(queues, changed):
    """See `refresh_queues`."""
    return refresh_queues(queues, changed)
