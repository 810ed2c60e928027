"""A node: which platoon moves next, and where to (the incremental node model, Seo 2023).

In every step the first platoon of each in-link chooses an out-link. The time of its move is the
latest of: it is ready, the out-link opens, the step began in which it first chose that out-link.
The earliest move is made first, until none is left in the step.
"""

from __future__ import annotations

import math

from uxsim_geo.engine.calendar import await_arrival, await_ready, wait
from uxsim_geo.engine.choice import choose
from uxsim_geo.engine.link import (
    enter,
    has_place,
    is_origin,
    leave,
    next_green,
    opening,
    platoon_at,
)
from uxsim_geo.engine.random import MERGE, draw
from uxsim_geo.engine.records import (
    ABORTED,
    ARRIVE,
    COMPLETED,
    DEAD_END,
    RUNNING,
    World,
    kernel,
    spliced,
)

UNKNOWN = -1.0  # a time that has to be worked out


@spliced
def visit(w: World, v, step):
    """Make all moves over node v that can be made before the step ends.

    False: a buffer is full, and the same visit has to be made again once it has room; what has
    been done until then stands.
    """
    clock = w.links.clock[0]
    horizon = min((step + 1) * clock["step_length"], clock["end"])
    candidates = gather(w, v, step, horizon)
    while True:
        winner = earliest(w, candidates, step, horizon)
        if winner < 0:
            break
        if not has_room(w, winner):
            return False
        taken, time = w.links.queue[winner]["choice"], w.links.queue[winner]["feasible"]
        if clock["deterministic"] and taken >= 0:
            settle_credits(w, winner, candidates)
        move(w, winner, step)
        renew_rivals(w, candidates, taken, time)
    for place in range(candidates):
        wait(w, w.calendar.candidate[place], step, horizon)
    return True


@spliced
def gather(w: World, v, step, horizon):
    """List the queues of node v whose first platoons are ready in this step; gives how many.

    The others are seen to be listed for the steps in which theirs are.
    """
    count, origin = 0, w.routes.node[v]["origin"]
    first, last = w.routes.node[v]["first_in"], w.routes.node[v + 1]["first_in"]
    for place in range(first, last + (origin >= 0)):
        q = place if place < last else origin
        queue = w.links.queue[q]
        w.calendar.candidate[count] = q
        queue["feasible"] = UNKNOWN
        count += queue["ready"] < horizon  # a branch could not be foreseen
        if (queue["listed_step"] < 0) & (horizon <= queue["ready"]) & (queue["ready"] < math.inf):
            await_ready(w, q, step)
    return count


@spliced
def earliest(w: World, candidates, step, horizon):
    """Give the queue whose first platoon moves next, -1 if none can before the step ends."""
    winner = -1
    for place in range(candidates):
        q = w.calendar.candidate[place]
        if w.links.queue[q]["feasible"] == UNKNOWN:
            consider(w, q, step, horizon)
        if w.links.queue[q]["feasible"] < horizon and (winner < 0 or goes_before(w, q, winner)):
            winner = q
    return winner


@spliced
def consider(w: World, q, step, horizon):
    """Work out when the first platoon of queue q could move; inf: not in this step."""
    queue = w.links.queue[q]
    queue["feasible"] = math.inf
    if queue["ready"] < horizon:
        if queue["chosen_step"] != step:
            choose(w, q, step)
        queue["feasible"] = time_of_move(w, queue)


@kernel
def time_of_move(w: World, queue):
    """Time from which the first platoon of a queue can make the move it has chosen."""
    if queue["choice"] == ARRIVE:
        return queue["ready"]
    time = max(queue["ready"], queue["since_step"] * w.links.clock[0]["step_length"])
    if queue["choice"] == DEAD_END:
        return time
    time = max(time, opening(w.links, queue["choice"], queue["vehicles"]))
    node = w.routes.node[queue["end_node"]]
    if node["headway"] > 0.0 and not is_origin(queue):
        time = max(time, node["open"])
    return next_green(w.links, queue, time)


@kernel
def goes_before(w: World, q, other):
    """Whether queue q moves before the other: by time, then by merge priority.

    Rivals for the same opening draw lots −ln(1−U) n/α; the smallest is that of a link with
    probability α / Σα, whoever else takes part. The vehicles n of the platoons weigh in so that
    links share the flow by priority, whatever the sizes. Without draws the link goes that has
    most credit (see `settle_credits`). Origins go before links.
    """
    mine, theirs = w.links.queue[q], w.links.queue[other]
    if mine["feasible"] != theirs["feasible"]:
        return mine["feasible"] < theirs["feasible"]
    if not are_rivals(w, mine, theirs):
        return False
    if is_origin(mine) or is_origin(theirs):
        return is_origin(mine)
    return lot(w, mine) < lot(w, theirs)


@kernel
def lot(w: World, queue):
    """Draw the lot of the first platoon of a queue for the opening it waits for."""
    if w.links.clock[0]["deterministic"]:
        return -(queue["credit"] + queue["merge_priority"] * queue["vehicles"])
    chance = draw(w.log.key[queue["trip"]], queue["key"], MERGE, queue["lost"])
    return -math.log(1.0 - chance) * queue["vehicles"] / queue["merge_priority"]


@kernel
def settle_credits(w: World, winner, candidates):
    """Share the right to an opening without draws: all gain n α, and who takes it pays n Σα.

    n are the vehicles that go, Σα is over all links that could go at the same time. Who has most
    after gaining goes: links take turns, each as often as its priority says, whatever the others.
    """
    taker = w.links.queue[winner]
    vehicles = taker["vehicles"]
    if is_origin(taker):
        return
    for place in range(candidates):
        rival = w.links.queue[w.calendar.candidate[place]]
        same_time = rival["feasible"] == taker["feasible"]
        if same_time and are_rivals(w, taker, rival) and not is_origin(rival):
            rival["credit"] += rival["merge_priority"] * vehicles
            taker["credit"] -= rival["merge_priority"] * vehicles


@kernel
def are_rivals(w: World, queue, other):
    """Whether two queues of a node want the same opening: of a link, or of the node."""
    if queue["choice"] < 0 or other["choice"] < 0:
        return False
    limited = w.routes.node[queue["end_node"]]["headway"] > 0.0
    return limited or queue["choice"] == other["choice"]


@kernel
def has_room(w: World, q):
    """Whether the buffers have room for the move of queue q."""
    choice = w.links.queue[q]["choice"]
    clock = w.links.clock[0]
    if clock["events"] == w.log.event.size:
        return False
    if clock["no_cycles"] and clock["trail_used"] == w.routes.trail.size:
        return False
    return choice < 0 or has_place(w.links, choice)


@kernel
def move(w: World, q, step):
    """Move the first platoon of queue q to where it goes; it leaves a row in the events."""
    queue, clock = w.links.queue[q], w.links.clock[0]
    platoon = platoon_at(w.links, queue, queue["left"])
    choice, time = queue["choice"], queue["feasible"]
    if choice >= 0:
        if enter(w.links, choice, platoon, w.routes.arc[queue["arc"]]["head"], time):
            await_arrival(w, choice, step)
        follow(w, queue, platoon, time)
    else:
        end_trip(w, platoon, choice, time)
    if q < clock["links"]:
        event = w.log.event[clock["events"]]
        event["trip"], event["link"] = platoon["trip"], q
        event["enter"], event["exit"] = platoon["enter"], time
        clock["events"] += 1
    elif choice >= 0:
        set_out(w, platoon, time)
    leave(w.links, q, time)
    queue["feasible"] = UNKNOWN


@kernel
def set_out(w: World, platoon, time):
    """Begin the trip of a platoon that leaves its origin."""
    trip = w.log.trip[platoon["trip"]]
    trip["status"] = RUNNING
    trip["enter"] = time
    w.links.clock[0]["vehicles_running"] += platoon["vehicles"]


@kernel
def follow(w: World, queue, platoon, time):
    """Note what a platoon's way over a node leaves behind: capacity used, its route, its trail."""
    clock, node = w.links.clock[0], w.routes.node[queue["end_node"]]
    if node["headway"] > 0.0 and not is_origin(queue):
        node["open"] = time + platoon["vehicles"] * node["headway"]
    if w.routes.destination[platoon["destination"]]["given"]:
        w.log.trip[platoon["trip"]]["route"] += 1
    if clock["no_cycles"]:
        visited, trip = w.routes.trail[clock["trail_used"]], w.log.trip[platoon["trip"]]
        visited["vertex"], visited["before"] = platoon["vertex"], trip["trail"]
        trip["trail"] = clock["trail_used"]
        clock["trail_used"] += 1


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
def renew_rivals(w: World, candidates, taken, time):
    """Have it worked out again when those can move who wait for the out-link just entered."""
    if taken < 0:
        return
    for place in range(candidates):
        rival = w.links.queue[w.calendar.candidate[place]]
        limited = w.routes.node[rival["end_node"]]["headway"] > 0.0
        if rival["feasible"] == math.inf or rival["choice"] < 0:
            continue
        if rival["choice"] == taken or limited:
            if rival["feasible"] == time:
                rival["lost"] += 1
            rival["feasible"] = UNKNOWN
