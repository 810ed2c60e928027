"""The run itself: step after step, the nodes where something can happen."""

from __future__ import annotations

import hashlib
from importlib.resources import files

from uxsim_geo.engine.close import find_locked, write_remaining
from uxsim_geo.engine.node import mark, visit
from uxsim_geo.engine.records import World, compiled, kernel
from uxsim_geo.engine.routes import find_free_flow_times, update_routes

# what `run` is asked to do
PREPARE, ADVANCE, CLOSE = 0, 1, 2


@kernel
def advance(w: World, until_step):
    """Run up to the start of a step; False: a buffer is full, call again once it has room.

    Stopping and going on, at whatever steps, changes nothing in the results.
    """
    clock = w.clock[0]
    while clock["step"] < until_step:
        step = clock["step"]
        if clock["opened_step"] < step:
            if step == clock["update_step"]:
                update_routes(w, step)
            open_step(w, step)
            clock["opened_step"] = step
        if not visit_pending(w, step):
            return False
        clock["step"] += 1
    return True


@kernel
def open_step(w: World, step):
    """Mark the nodes of all queues that the calendar lists for a step."""
    q = w.bucket[step]
    while q >= 0:
        queue = w.queue[q]
        queue["listed_step"] = -1
        mark(w, queue["end_node"])
        q = queue["next"]


@kernel
def visit_pending(w: World, step):
    """Visit the marked nodes, upwards by their number and round again while any is marked.

    The order depends on nothing else, so that what happens in one part of the network cannot
    change it in another.
    """
    clock, v = w.clock[0], -1
    while clock["pending"] > 0:
        v = next_pending(w, v + 1)
        w.pending[v] = 0
        clock["pending"] -= 1
        if not visit(w, v, step):
            mark(w, v)
            return False
    return True


@kernel
def next_pending(w: World, v):
    """Give the first marked node from v upwards, from the first node on where there is none."""
    while v < w.pending.size:
        if v & 7 == 0 and w.pending_words[v >> 3] == 0:
            v += 8
        elif w.pending[v]:
            return v
        else:
            v += 1
    return next_pending_from_start(w)


@kernel
def next_pending_from_start(w: World):
    """Give the first marked node; there must be one."""
    word = 0
    while w.pending_words[word] == 0:
        word += 1
    v = 8 * word
    while not w.pending[v]:
        v += 1
    return v


def _compile_run(sources: str):
    """Compile the one function that Python calls.

    The compiled code is kept on disk under the function and what it encloses. It encloses the
    hash of all kernels' sources, so a change in any of them is seen.
    """

    @compiled
    def run(w, task, until_step):
        if len(sources) == 0:
            return False
        if task == PREPARE:
            find_free_flow_times(w)
            return True
        if task == ADVANCE:
            return advance(w, until_step)
        find_locked(w)
        return write_remaining(w)

    return run


def _hash_of_sources() -> str:
    digest = hashlib.sha256()
    for source in sorted(files(__package__).iterdir(), key=lambda file: file.name):
        if source.name.endswith(".py"):
            digest.update(source.read_bytes())
    return digest.hexdigest()


#: run(world, task, until_step) -> bool; see `advance` and `write_remaining`
run = _compile_run(_hash_of_sources())
