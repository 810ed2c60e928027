"""The weights B of arcs, by the bits that say at which of the last updates each was on a tree.

B ← (1−λ)B + λ·tree weighs an arc by λ Σ (1−λ)^k over the updates, k back from the last, at which it
was on the tree, and what came before the first counts as that does. A byte remembers eight updates,
H ← H >> 1 | on the tree << 7, so that the bits of H are worth, from the first to the last, λ,
λ(1−λ), λ(1−λ)², …; the last one is worth all that is left, (1−λ)⁷. At the first update all bits are
set, or none.

That is exact for eight updates; after that all that is older counts as the oldest update that is
remembered. Where that is more than 1 % of the weight two bytes are kept, and where these do not do,
the weights themselves (as for a logit choice, which has no memory). All of it is kept by batches of
64 destinations, arc by arc: what an update reads and writes, and a choice reads, stand together.
"""

from __future__ import annotations

import numpy as np

from uxsim_geo.engine.records import LANES, Hierarchy, Lanes, Routes, kernel

MOST_FORGOTTEN = 0.01
_BITS = 8
_MOST_BYTES = 2
_NEWEST = np.uint8(128)
_ALL = np.uint8(255)
_NONE = np.uint8(0)
_ONE, _SEVEN = np.uint8(1), np.uint8(7)


def bytes_needed(share: float, *, is_logit: bool = False) -> int:
    """How many bytes remember an arc if an update weighs λ = ``share``; 0: keep its weight."""
    for count in range(1, _MOST_BYTES + 1):
        if not is_logit and (1.0 - share) ** (_BITS * count - 1) <= MOST_FORGOTTEN:
            return count
    return 0


def worth_of_bytes(share: float, count: int) -> np.ndarray:
    """What every byte is worth, (count, 256); the first byte holds the last eight updates."""
    back = np.arange(_BITS * count)
    worth = share * (1.0 - share) ** back
    worth[-1:] = (1.0 - share) ** back[-1:]
    newest_first = np.unpackbits(np.arange(256, dtype=np.uint8)[:, None], axis=1)
    return np.ascontiguousarray(worth.reshape(count, _BITS) @ newest_first.T)


def empty_memory(batches: int, arcs: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Make room for the history, and for the weights, of so many batches."""
    history = np.zeros((batches * count, arcs, LANES), np.uint8)
    weight = np.zeros((0 if count else batches, arcs, LANES), np.float32)
    return history, weight


@kernel
def weight_at(routes: Routes, slot, arc):
    """Give the weight of an arc for the destination with this slot."""
    batch, lane, count = slot // LANES, slot % LANES, routes.worth.shape[0]
    if count == 0:
        return np.float64(routes.weight[batch, arc, lane])
    weight = routes.worth[0, routes.history[batch * count, arc, lane]]
    if count > 1:
        weight += routes.worth[1, routes.history[batch * count + 1, arc, lane]]
    return weight


@kernel
def set_whole(routes: Routes, slot, arc, whole):
    """Give an arc all the weight that there is, or (not `whole`) none."""
    batch, lane, count = slot // LANES, slot % LANES, routes.worth.shape[0]
    if count == 0:
        routes.weight[batch, arc, lane] = 1.0 if whole else 0.0
    for row in range(batch * count, batch * count + count):
        routes.history[row, arc, lane] = _ALL if whole else _NONE


@kernel
def remember(routes: Routes, slot, arc, on_tree, share):
    """Renew the weight of an arc that is, or is not, on the new tree; `share` is λ.

    This says once more, of one arc and one destination, what `remember_lanes` does to many.
    """
    batch, lane, count = slot // LANES, slot % LANES, routes.worth.shape[0]
    if count == 0:
        keep, add = np.float32(1.0 - share), np.float32(share if on_tree else 0.0)
        kept = np.float32(routes.weight[batch, arc, lane] * keep)
        routes.weight[batch, arc, lane] = kept + add
        return
    before = on_tree
    for row in range(batch * count, batch * count + count):
        own = routes.history[row, arc, lane]
        routes.history[row, arc, lane] = np.uint8(own >> _ONE) | (_NEWEST if before else _NONE)
        before = own & _ONE == _ONE


@kernel
def remember_lanes(routes: Routes, h: Hierarchy, batch, room: Lanes, share):
    """Renew the weights of all arcs for a batch, by the distances at hand; `share` is λ.

    Lanes that are `fresh` forget what was before, those that are `idle` are left as they are.
    """
    count = routes.worth.shape[0]
    if count == 0:
        blend_lanes(routes, h, batch, room, share)
    elif count == 1:
        shift_byte(routes, h, batch, room)
    else:
        shift_two_bytes(routes, h, 2 * batch, room)


@kernel
def shift_byte(routes: Routes, h: Hierarchy, row, room: Lanes):
    """Put the bit of a new update before the others, in a row of the history."""
    distance, history = room.distance, routes.history
    fresh, idle = room.fresh, room.idle
    for arc in range(np.uint64(h.tail.size)):
        tail, head = np.uint64(h.tail[arc]), np.uint64(h.head[arc])
        cost = routes.arc[arc]["cost"]
        for lane in range(LANES):
            is_on = np.int32(distance[head, lane] + cost) == distance[tail, lane]
            bit = np.uint8(_NEWEST | fresh[lane]) if is_on else _NONE
            before = history[row, arc, lane]
            older = np.uint8(np.uint8(before >> _ONE) & np.uint8(fresh[lane] ^ _ALL))
            history[row, arc, lane] = before if idle[lane] else np.uint8(older | bit)


@kernel
def shift_two_bytes(routes: Routes, h: Hierarchy, row, room: Lanes):
    """Put the bit of a new update before the others, in a row of the history and the next."""
    distance, history = room.distance, routes.history
    fresh, idle = room.fresh, room.idle
    for arc in range(np.uint64(h.tail.size)):
        tail, head = np.uint64(h.tail[arc]), np.uint64(h.head[arc])
        cost = routes.arc[arc]["cost"]
        for lane in range(LANES):
            is_on = np.int32(distance[head, lane] + cost) == distance[tail, lane]
            first, second = history[row, arc, lane], history[row + 1, arc, lane]
            keep = np.uint8(fresh[lane] ^ _ALL)
            older = np.uint8(np.uint8(first << _SEVEN) | np.uint8(second >> _ONE))
            whole = fresh[lane] if is_on else _NONE
            older = np.uint8(np.uint8(older & keep) | whole)
            history[row + 1, arc, lane] = second if idle[lane] else older
            bit = np.uint8(_NEWEST | fresh[lane]) if is_on else _NONE
            newer = np.uint8(np.uint8(np.uint8(first >> _ONE) & keep) | bit)
            history[row, arc, lane] = first if idle[lane] else newer


@kernel
def blend_lanes(routes: Routes, h: Hierarchy, batch, room: Lanes, share):
    """B ← (1−share)B + share·tree, for a batch."""
    distance, weight = room.distance, routes.weight
    fresh, idle = room.fresh, room.idle
    keep, add = np.float32(1.0 - share), np.float32(share)
    none, whole = np.float32(0.0), np.float32(1.0)
    for arc in range(np.uint64(h.tail.size)):
        tail, head = np.uint64(h.tail[arc]), np.uint64(h.head[arc])
        cost = routes.arc[arc]["cost"]
        for lane in range(LANES):
            is_on = np.int32(distance[head, lane] + cost) == distance[tail, lane]
            before = weight[batch, arc, lane]
            new = np.float32(np.float32(before * keep) + (add if is_on else none))
            at_first = whole if is_on else none
            new = at_first if fresh[lane] else new
            weight[batch, arc, lane] = before if idle[lane] else new
