"""A link, seen from its two ends (Newell's model for platoons, after Seo 2023).

Platoons are numbered by entry; e is the time a platoon enters, s the time it leaves, n its
vehicles, E and S the vehicles that have entered and left. A platoon that follows one of n vehicles
keeps the headway n / Q, so

    s ≥ e + L/u                     free flow
    s ≥ s' + n' / Q_out             capacity at the exit, behind the platoon s', n'
    e ≥ e' + n' / Q_in              capacity at the entry, behind the platoon e', n'
    e ≥ D(E + n − m κ L) + L τ κ    storage: the hole left by an earlier exit has arrived

with D(c) the time at which c vehicles have left: between two exits it is interpolated, so that a
link may store a fraction of a platoon (a whole number would cost short links half their capacity).
"""

from __future__ import annotations

import math

from uxsim_geo.engine.records import NOTHING, Links, kernel


@kernel
def platoon_at(links: Links, queue, number):
    """Give the record of a platoon of this queue by its number."""
    return links.platoon[queue["base"] + (number & queue["mask"])]


@kernel
def oldest_kept(queue):
    """Number of the first platoon whose exit can still matter to an entry."""
    return max(queue["hole"] - 1, 0)


@kernel
def find_hole(links: Links, queue, vehicles):
    """Find the exit that makes room for so many more vehicles: its number and S with it.

    The number is -1 while there is room without any exit.
    """
    needed = queue["vehicles_entered"] + vehicles - queue["storage"]
    number, reached = queue["hole"], queue["hole_vehicles"]
    while reached < needed:
        number += 1
        reached += platoon_at(links, queue, number)["vehicles"]
    return number, reached, needed


@kernel
def opening(links: Links, q, vehicles):
    """Time from which so many vehicles can enter link q; inf: a hole has yet to leave."""
    queue = links.queue[q]
    time = queue["entry_open"]
    number, reached, needed = find_hole(links, queue, vehicles)
    if needed <= 0.0:
        return time
    if number >= queue["left"]:
        return math.inf
    leaver = platoon_at(links, queue, number)
    gap = leaver["vehicles"] * queue["exit_headway"]
    if number > 0:
        gap = leaver["exit"] - platoon_at(links, queue, number - 1)["exit"]
    hole = leaver["exit"] - (reached - needed) / leaver["vehicles"] * gap
    return max(time, leaver["exit"], hole + queue["hole_time"])


@kernel
def opening_bound(links: Links, q, vehicles):
    """Time before which so many vehicles cannot enter link q, whatever happens until then.

    Where the hole has yet to leave, the first platoon leaves no earlier than it is due and those
    behind it follow at capacity.
    """
    queue = links.queue[q]
    number, reached, needed = find_hole(links, queue, vehicles)
    if needed <= 0.0 or number < queue["left"]:
        return opening(links, q, vehicles)
    own = platoon_at(links, queue, number)["vehicles"]
    ahead = reached - own - queue["vehicles_left"]
    leaves = queue["due"] + ahead * queue["exit_headway"]
    before = leaves - own * queue["exit_headway"]
    if number > 0:
        previous = platoon_at(links, queue, number - 1)
        if number == queue["left"]:
            before = previous["exit"]
        else:
            before = leaves - previous["vehicles"] * queue["exit_headway"]
    share = (reached - needed) / own
    hole = leaves - share * (leaves - before)
    return max(queue["entry_open"], leaves, hole + queue["hole_time"])


@kernel
def look_at_first(links: Links, queue):
    """Set when the first platoon is ready, and forget what the one before it wanted."""
    queue["ready"] = math.inf
    if queue["left"] < queue["entered"]:
        first = platoon_at(links, queue, queue["left"])
        queue["ready"] = max(first["enter"] + queue["free_time"], queue["exit_open"])
    queue["due"] = queue["ready"]
    queue["choice"] = NOTHING
    queue["chosen_step"] = -1
    queue["lost"] = 0


@kernel
def leave(links: Links, q, time):
    """Let the first platoon of queue q leave at this time."""
    queue = links.queue[q]
    platoon = platoon_at(links, queue, queue["left"])
    platoon["exit"] = time
    queue["left"] += 1
    queue["vehicles_left"] += platoon["vehicles"]
    queue["exit_open"] = time + platoon["vehicles"] * queue["exit_headway"]
    look_at_first(links, queue)


@kernel
def enter(links: Links, q, platoon, time):
    """Let a platoon enter link q at this time, behind all others; True: it is the first there."""
    queue = links.queue[q]
    hole, hole_vehicles, _ = find_hole(links, queue, platoon["vehicles"])
    queue["hole"], queue["hole_vehicles"] = hole, hole_vehicles
    place = platoon_at(links, queue, queue["entered"])
    place["key"] = platoon["key"]
    place["trip"] = platoon["trip"]
    place["destination"] = platoon["destination"]
    place["vehicles"] = platoon["vehicles"]
    place["enter"] = time
    place["exit"] = math.nan
    first = queue["left"] == queue["entered"]
    queue["entered"] += 1
    queue["vehicles_entered"] += platoon["vehicles"]
    queue["entry_open"] = time + platoon["vehicles"] * queue["entry_headway"]
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
    free = road["free_speed"] * (time - platoon_at(links, queue, number)["enter"])
    stands_at = road["length"] - road["spacing"] * ahead
    moves_at = math.inf
    if exited >= oldest_kept(queue):
        leaver = platoon_at(links, queue, exited)
        behind = ahead + leaver["vehicles"]
        gone = time - leaver["exit"] - road["lag"] * behind
        moves_at = road["length"] - road["spacing"] * behind + road["free_speed"] * gone
    if stands_at <= min(free, moves_at):
        return max(stands_at, 0.0), True
    return max(min(free, moves_at), 0.0), False
