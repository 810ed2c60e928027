"""The calendar: in which step a queue is looked at next.

A queue stands in it once at most, under the step in which its first platoon becomes ready or, if
that is blocked, in which it can go on at the earliest. Nothing else is touched in a step. To look
at a queue too early does no harm; too late would.
"""

from __future__ import annotations

import math

import numpy as np

from uxsim_geo.engine.choice import may_choose
from uxsim_geo.engine.link import is_origin, next_green, opening_bound
from uxsim_geo.engine.records import Queues, World, kernel


@kernel
def wait(w: World, q, step, horizon):
    """List queue q, after a visit, for the step in which its first platoon is to be seen next."""
    queue, clock = w.links.queue[q], w.links.clock[0]
    if queue["listed_step"] >= 0:
        return
    if queue["ready"] >= horizon:
        await_ready(w, q, step)
    elif clock["sleep"]:
        queue["due"] = sleep_until(w, queue)
        list_for(w, q, max(step_of(clock, queue["due"]), step + 1))
    else:
        list_for(w, q, step + 1)


@kernel
def await_ready(w: World, q, step):
    """List queue q for the step in which its first platoon is ready, a later one than this."""
    if w.links.queue[q]["ready"] < math.inf:
        list_for(w, q, max(step_of(w.links.clock[0], w.links.queue[q]["ready"]), step + 1))


@kernel
def sleep_until(w: World, queue):
    """Time before which a blocked platoon cannot move, whatever it draws until then.

    That is when the first of its out-links can open, and no later than the next update of routes
    or change from outside. Rounding must not make it too late: it is put a hair too early.
    """
    clock, node = w.links.clock[0], w.routes.node[queue["end_node"]]
    latest = min(clock["update_step"], clock["control_step"]) * clock["step_length"]
    bound = latest
    v = queue["vertex"]
    for arc in range(w.routes.vertex[v]["first_out"], w.routes.vertex[v + 1]["first_out"]):
        if may_choose(w, queue, arc):
            link = np.int64(w.routes.arc[arc]["link"])
            opens, _ = opening_bound(w.links, link, queue["vehicles"])
            bound = min(bound, opens)
    if node["headway"] > 0.0 and not is_origin(queue):
        bound = max(bound, node["open"])
    bound = next_green(w.links, queue, max(queue["ready"], bound * (1.0 - 1e-11)))
    return min(bound, latest)


@kernel
def await_arrival(w: World, q, step):
    """See to it that the first platoon of link q is looked at when it is ready."""
    queue = w.links.queue[q]
    if queue["ready"] == math.inf:  # its exit is closed
        return
    target = step_of(w.links.clock[0], queue["ready"])
    if target <= step:
        mark(w, queue["end_node"])
    else:
        list_for(w, q, target)


@kernel
def step_of(clock, time):
    """Give the step i in which a time lies: i Δt ≤ time < (i + 1) Δt, rounded as horizons are."""
    step = int(time / clock["step_length"])
    if time < step * clock["step_length"]:
        return step - 1
    if time >= (step + 1) * clock["step_length"]:
        return step + 1
    return step


@kernel
def list_for(w: World | Queues, q, step):
    """List queue q in the calendar under a step, unless it is listed; none is kept beyond the end.

    It is listed already where a platoon was blocked, was listed for the next step, and left after
    all because its node was visited again in this one. To look too early is no harm.
    """
    queue = w.links.queue[q]
    if step >= w.calendar.bucket.size or queue["listed_step"] >= 0:
        return
    head = w.calendar.bucket[step]
    queue["listed_step"] = step
    queue["next"] = head
    w.calendar.bucket[step] = q


@kernel
def unlist(w: Queues, q):
    """Take queue q out of the calendar."""
    queue = w.links.queue[q]
    step = queue["listed_step"]
    if step < 0:
        return
    if w.calendar.bucket[step] == q:
        w.calendar.bucket[step] = queue["next"]
    else:
        before = w.calendar.bucket[step]
        while w.links.queue[before]["next"] != q:
            before = w.links.queue[before]["next"]
        w.links.queue[before]["next"] = queue["next"]
    queue["listed_step"] = -1


@kernel
def mark(w: World, v):
    """Mark a node to be visited in this step."""
    if w.calendar.pending[v] == 0:
        w.calendar.pending[v] = 1
        w.links.clock[0]["pending"] += 1
