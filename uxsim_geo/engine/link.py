"""A link, seen from its two ends (Newell's model for platoons, after Seo 2023).

Platoons are numbered by entry; e is the time a platoon enters, s the time it leaves, both of its
first vehicle; n its vehicles, E and S the vehicles before it that have entered and left. A platoon
that follows one of n vehicles keeps the headway n / Q, so

    s ≥ e + L/u                 free flow
    s ≥ s' + n' / Q_out         capacity at the exit, behind the platoon s', n'
    e ≥ e' + n' / Q_in          capacity at the entry, behind the platoon e', n'
    e ≥ D(E − m κ L) + L τ κ    storage: the hole left by an earlier exit has arrived

with D(c) the time at which the vehicle leaves that has c vehicles before it. Between the first
vehicles of two platoons it is interpolated, so that a link may store a fraction of a platoon (a
whole number would cost short links half their capacity). None enters before there is room for all
its vehicles.
"""

from __future__ import annotations

import math

from uxsim_geo.engine.records import NOTHING, Links, kernel


@kernel
def platoon_at(links: Links, queue, number):
    """Give the record of a platoon of this queue by its number."""
    return links.platoon[queue["base"] + (number & queue["mask"])]


@kernel
def is_origin(queue):
    """Whether a queue is an origin: it has no length."""
    return queue["storage"] == 0.0


@kernel
def oldest_kept(queue):
    """Number of the first platoon whose exit can still matter to an entry."""
    return max(queue["hole"], 0)


@kernel
def find_exit(links: Links, queue, number, passed, vehicles):
    """Go on from platoon `number` to the first with which so many vehicles have left.

    `passed` vehicles leave up to and with platoon `number`; gives both for the platoon found.
    """
    while passed < vehicles:
        number += 1
        passed += platoon_at(links, queue, number)["vehicles"]
    return number, passed


@kernel
def exit_bound(links: Links, queue, number, before):
    """Time before which platoon `number` cannot leave; that of its exit where it has left.

    `before` vehicles leave before it: the first platoon leaves no earlier than it is due, those
    behind it follow at capacity.
    """
    if number < queue["left"]:
        return platoon_at(links, queue, number)["exit"]
    return queue["due"] + (before - queue["vehicles_left"]) * queue["exit_headway"]


@kernel
def opening_bound(links: Links, q, vehicles):
    """Time before which so many vehicles cannot enter link q, and whether it is certain.

    It is certain where all exits that matter have happened; then the link opens at that time.
    """
    queue = links.queue[q]
    if queue["room_for"] == vehicles:
        return max(queue["entry_open"], queue["room"]), True
    room, certain = room_bound(links, queue, vehicles)
    if certain:
        queue["room"], queue["room_for"] = room, vehicles
    return max(queue["entry_open"], room), certain


@kernel
def room_bound(links: Links, queue, vehicles):
    """Time before which a link has no room for so many more vehicles, and whether it is certain."""
    surplus = queue["vehicles_entered"] - queue["storage"]
    if surplus + vehicles <= 0.0:
        return -math.inf, True
    previous, before = find_exit(links, queue, queue["next_hole"], queue["hole_vehicles"], surplus)
    queue["next_hole"], queue["hole_vehicles"] = previous, before
    number = previous + 1
    leaves = exit_bound(links, queue, number, before)
    hole = leaves + surplus * queue["exit_headway"]
    if previous >= 0:
        own = platoon_at(links, queue, previous)["vehicles"]
        left_before = exit_bound(links, queue, previous, before - own)
        hole = leaves - (before - surplus) / own * (leaves - left_before)
    last, passed = find_exit(links, queue, previous, before, surplus + vehicles)
    if last > number:
        own = platoon_at(links, queue, last)["vehicles"]
        leaves = exit_bound(links, queue, last, passed - own)
    return max(leaves, hole + queue["hole_time"]), max(last, number) < queue["left"]


@kernel
def opening(links: Links, q, vehicles):
    """Time from which so many vehicles can enter link q; inf: a hole has yet to leave."""
    time, certain = opening_bound(links, q, vehicles)
    return time if certain else math.inf


@kernel
def next_green(links: Links, queue, time):
    """Give the first moment from a time on at which the signal of a link shows green.

    The time itself where there is no signal or it is green; inf where it is always red.
    """
    if queue["cycle"] == 0.0 or time == math.inf:
        return time
    begin = queue["offset"] + queue["cycle"] * math.floor((time - queue["offset"]) / queue["cycle"])
    for number in range(queue["first_green"], queue["last_green"]):
        green = links.green[number]
        if time < begin + green["end"]:
            return max(time, begin + green["start"])
    if queue["first_green"] == queue["last_green"]:
        return math.inf
    return begin + queue["cycle"] + links.green[queue["first_green"]]["start"]


@kernel
def look_at_first(links: Links, queue):
    """Set who is first and when it is ready, and forget what the one before it wanted."""
    see_first(links, queue)
    queue["choice"] = NOTHING
    queue["chosen_step"] = -1
    queue["lost"] = 0


@kernel
def see_first(links: Links, queue):
    """Set who is the first platoon of a queue, and when it is ready."""
    queue["ready"] = math.inf
    if queue["left"] < queue["entered"]:
        first = platoon_at(links, queue, queue["left"])
        queue["ready"] = max(first["exit"], queue["exit_open"])
        queue["trip"], queue["vehicles"] = first["trip"], first["vehicles"]
        queue["vertex"], queue["destination"] = first["vertex"], first["destination"]
    queue["due"] = queue["ready"]


@kernel
def leave(links: Links, q, time):
    """Let the first platoon of queue q leave at this time."""
    queue = links.queue[q]
    platoon_at(links, queue, queue["left"])["exit"] = time
    queue["left"] += 1
    queue["vehicles_left"] += queue["vehicles"]
    queue["exit_open"] = time + queue["vehicles"] * queue["exit_headway"]
    look_at_first(links, queue)


@kernel
def enter(links: Links, q, platoon, vertex, time):
    """Let a platoon enter link q at this time, behind all others; True: it is the first there.

    `vertex` is the one to which it comes at the end of the link.
    """
    queue = links.queue[q]
    queue["hole"] = queue["next_hole"]
    place = platoon_at(links, queue, queue["entered"])
    place["trip"] = platoon["trip"]
    place["destination"] = platoon["destination"]
    place["vehicles"] = platoon["vehicles"]
    place["vertex"] = vertex
    place["enter"] = time
    place["exit"] = time + queue["free_time"]
    first = queue["left"] == queue["entered"]
    queue["entered"] += 1
    queue["vehicles_entered"] += platoon["vehicles"]
    queue["entry_open"] = time + platoon["vehicles"] * queue["entry_headway"]
    queue["room_for"] = 0
    if first:
        look_at_first(links, queue)
    return first


@kernel
def has_place(links: Links, q):
    """Whether the ring of link q has a place for one more platoon, grown if need be.

    False: the pool of rings is used up; nothing has changed.
    """
    queue = links.queue[q]
    kept = queue["entered"] - oldest_kept(queue)
    size = queue["mask"] + 1
    if kept < size:
        return True
    clock = links.clock[0]
    base = clock["platoons_used"]
    if base + 2 * size > links.platoon.size:
        clock["pool_full"] = 1
        return False
    for number in range(oldest_kept(queue), queue["entered"]):
        links.platoon[base + (number & (2 * size - 1))] = platoon_at(links, queue, number)
    queue["base"], queue["mask"] = base, 2 * size - 1
    clock["platoons_used"] += 2 * size
    return True


@kernel
def advance_wave(links: Links, queue, road, exited, ahead, time):
    """Find the last exit that is felt at this time by a platoon on the link.

    An exit at s is felt j vehicles further back at s + j τ/m. Starting from platoon `exited` and
    the vehicles `ahead` between it and the one that asks, go back to the exit that is felt (one
    before the oldest kept if none is). Those further back on the link feel the same or an older
    one, so that a walk along the link goes over the exits once.
    """
    while exited >= oldest_kept(queue):
        leaver = platoon_at(links, queue, exited)
        if leaver["exit"] + road["lag"] * (ahead + leaver["vehicles"]) <= time:
            break
        ahead += leaver["vehicles"]
        exited -= 1
    return exited, ahead


@kernel
def position(links: Links, queue, road, number, exited, ahead, time):
    """Where platoon `number` of a link is, m from its start, and whether it stands.

    `exited` and `ahead` are what `advance_wave` gives: the exit felt last, and the vehicles
    between it and this platoon. The platoon is at the least of free flow, the place behind those
    who have not felt any exit yet, and the way gone since that exit was felt.
    """
    platoon = platoon_at(links, queue, number)
    gone_by = (time - platoon["enter"]) / (platoon["exit"] - platoon["enter"])
    free = road["length"] * gone_by
    stands_at = road["length"] - road["spacing"] * ahead
    moves_at = math.inf
    if exited >= oldest_kept(queue):
        leaver = platoon_at(links, queue, exited)
        behind = ahead + leaver["vehicles"]
        gone = time - leaver["exit"] - road["lag"] * behind
        moves_at = road["length"] - road["spacing"] * behind + road["free_speed"] * gone
    if stands_at < min(free, moves_at):
        return max(stands_at, 0.0), True
    return max(min(free, moves_at), 0.0), False
