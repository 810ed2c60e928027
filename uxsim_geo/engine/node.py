"""A node: which platoon moves next, and where to (the incremental node model, Seo 2023).

In every step the first platoon of each in-link chooses an out-link. The time of its move is the
latest of: it is ready, the out-link opens, the step began in which it first chose that out-link.
The earliest move is made first, until none is left in the step.
"""

from __future__ import annotations

import math

from uxsim_geo.engine.link import (
    enter,
    has_place,
    leave,
    next_green,
    opening,
    opening_bound,
    platoon_at,
)
from uxsim_geo.engine.random import CHOICE, MERGE, draw
from uxsim_geo.engine.records import (
    ABORTED,
    ARRIVE,
    COMPLETED,
    DEAD_END,
    RUNNING,
    World,
    kernel,
)


@kernel
def visit(w: World, v, step):
    """Make all moves over node v that can be made before the step ends.

    False: a buffer is full, and the same visit has to be made again once it has room; what has
    been done until then stands.
    """
    clock = w.links.clock[0]
    horizon = min((step + 1) * clock["step_length"], clock["end"])
    start, stop = w.routes.node[v]["first_in"], w.routes.node[v + 1]["first_in"]
    for place in range(start, stop):
        consider(w, w.routes.into[place], step, horizon)
    while True:
        winner = earliest(w, start, stop, horizon)
        if winner < 0:
            break
        if not has_room(w, winner):
            return False
        taken, time = w.links.queue[winner]["choice"], w.links.queue[winner]["feasible"]
        move(w, winner, step)
        consider(w, winner, step, horizon)
        renew_rivals(w, v, taken, time)
    for place in range(start, stop):
        wait(w, w.routes.into[place], step, horizon)
    return True


@kernel
def consider(w: World, q, step, horizon):
    """Work out when the first platoon of queue q could move; inf: not in this step."""
    queue = w.links.queue[q]
    queue["feasible"] = math.inf
    if queue["ready"] < horizon:
        if queue["chosen_step"] != step:
            choose(w, q, step)
        queue["feasible"] = time_of_move(w, queue)


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


@kernel
def time_of_move(w: World, queue):
    """Time from which the first platoon of a queue can make the move it has chosen."""
    if queue["choice"] < 0:
        return queue["ready"]
    vehicles = platoon_at(w.links, queue, queue["left"])["vehicles"]
    time = max(queue["ready"], opening(w.links, queue["choice"], vehicles))
    time = max(time, queue["since_step"] * w.links.clock[0]["step_length"])
    return next_green(w.links, queue, time)


@kernel
def earliest(w: World, start, stop, horizon):
    """Give the queue whose first platoon moves next, -1 if none can before the step ends."""
    winner = -1
    for place in range(start, stop):
        q = w.routes.into[place]
        if w.links.queue[q]["feasible"] < horizon and (winner < 0 or goes_before(w, q, winner)):
            winner = q
    return winner


@kernel
def goes_before(w: World, q, other):
    """Whether queue q moves before the other: by time, then by merge priority.

    Rivals for the same opening draw lots −ln(1−U) n/α; the smallest is that of a link with
    probability α / Σα, whoever else takes part. The vehicles n of the platoons weigh in so that
    links share the flow by priority, whatever the sizes. Origins go before links.
    """
    mine, theirs = w.links.queue[q], w.links.queue[other]
    if mine["feasible"] != theirs["feasible"]:
        return mine["feasible"] < theirs["feasible"]
    if mine["choice"] != theirs["choice"] or mine["choice"] < 0:
        return False
    links = w.links.clock[0]["links"]
    if q >= links or other >= links:
        return q >= links
    return lot(w, mine) < lot(w, theirs)


@kernel
def lot(w: World, queue):
    """Draw the lot of the first platoon of a queue for the opening it waits for."""
    platoon = platoon_at(w.links, queue, queue["left"])
    chance = draw(platoon["key"], queue["key"], MERGE, queue["lost"])
    return -math.log(1.0 - chance) * platoon["vehicles"] / queue["merge_priority"]


@kernel
def has_room(w: World, q):
    """Whether the buffers have room for the move of queue q."""
    choice = w.links.queue[q]["choice"]
    if w.links.clock[0]["events"] == w.log.event.size:
        return False
    return choice < 0 or has_place(w.links, choice)


@kernel
def move(w: World, q, step):
    """Move the first platoon of queue q to where it goes; it leaves a row in the events."""
    queue, clock = w.links.queue[q], w.links.clock[0]
    platoon = platoon_at(w.links, queue, queue["left"])
    trip, choice, time = w.log.trip[platoon["trip"]], queue["choice"], queue["feasible"]
    if choice >= 0:
        if enter(w.links, choice, platoon, time):
            await_arrival(w, choice, step)
        if trip["status"] != RUNNING:
            trip["status"] = RUNNING
            trip["enter"] = time
            clock["vehicles_running"] += platoon["vehicles"]
    else:
        end_trip(w, platoon, choice, time)
    if q < clock["links"]:
        event = w.log.event[clock["events"]]
        event["trip"], event["link"] = platoon["trip"], q
        event["enter"], event["exit"] = platoon["enter"], time
        clock["events"] += 1
    leave(w.links, q, time)


@kernel
def end_trip(w: World, platoon, choice, time):
    """End a trip at its destination, or where there is no way on."""
    trip, clock = w.log.trip[platoon["trip"]], w.links.clock[0]
    vehicles = platoon["vehicles"]
    if trip["status"] == RUNNING:
        clock["vehicles_running"] -= vehicles
    w.routes.destination[platoon["destination"]]["outstanding"] -= vehicles
    if choice == ARRIVE:
        trip["status"] = COMPLETED
        trip["arrive"] = time
        clock["vehicles_completed"] += vehicles
    else:
        trip["status"] = ABORTED


@kernel
def renew_rivals(w: World, v, taken, time):
    """Work out again when those can move who wait for an out-link that has just been entered."""
    if taken < 0:
        return
    for place in range(w.routes.node[v]["first_in"], w.routes.node[v + 1]["first_in"]):
        rival = w.links.queue[w.routes.into[place]]
        if rival["feasible"] < math.inf and rival["choice"] == taken:
            if rival["feasible"] == time:
                rival["lost"] += 1
            rival["feasible"] = time_of_move(w, rival)


@kernel
def wait(w: World, q, step, horizon):
    """List queue q in the calendar for the step in which its first platoon is to be seen next."""
    queue, clock = w.links.queue[q], w.links.clock[0]
    if queue["ready"] == math.inf or queue["listed_step"] >= 0:
        return
    target = step_of(clock, queue["ready"])
    if queue["ready"] < horizon:
        target = step + 1
        if clock["sleep"]:
            queue["due"] = sleep_until(w, queue)
            target = step_of(clock, queue["due"])
    list_for(w, q, max(target, step + 1))


@kernel
def sleep_until(w: World, queue):
    """Time before which a blocked platoon cannot move, whatever it draws until then.

    That is when the first of its out-links can open, and no later than the next update of routes.
    Rounding must not make it too late: it is put a hair too early.
    """
    platoon, v = platoon_at(w.links, queue, queue["left"]), queue["end_node"]
    update = w.links.clock[0]["update_step"] * w.links.clock[0]["step_length"]
    bound = update
    for link in range(w.routes.node[v]["first_out"], w.routes.node[v + 1]["first_out"]):
        if w.routes.weight[platoon["destination"], link] > 0.0:
            opens, _ = opening_bound(w.links, link, platoon["vehicles"])
            bound = min(bound, opens)
    bound = next_green(w.links, queue, max(queue["ready"], bound * (1.0 - 1e-11)))
    return min(bound, update)


@kernel
def await_arrival(w: World, q, step):
    """See to it that the first platoon of link q is looked at when it is ready."""
    queue = w.links.queue[q]
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
def list_for(w: World, q, step):
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
def mark(w: World, v):
    """Mark a node to be visited in this step."""
    if w.calendar.pending[v] == 0:
        w.calendar.pending[v] = 1
        w.links.clock[0]["pending"] += 1
