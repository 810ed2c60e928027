"""Calls into the cache what the next visits will read.

With a city of links and platoons in memory, waiting for it takes most of the time: a visit would
wait for the links that end at a node, then for their platoons, then for the links these may choose.
Nodes are visited in a known order, so that all of it can be on its way before. Nothing is changed.
"""

from __future__ import annotations

import numpy as np

from uxsim_geo.compiling import call_in
from uxsim_geo.engine.records import LANES, World, kernel, spliced

# queues take four lines of a cache: what their first platoons want, their exits, their entries
_EXIT, _ENTRY = 64, 128  # bytes


@kernel
def call_queues(w: World, v):
    """Call in the queues that end at node v, as far as it is looked at who may go."""
    for q in range(w.routes.node[v]["first_in"], w.routes.node[v + 1]["first_in"]):
        call_in(w.links.queue, q, 0)
        call_in(w.links.queue, q, _EXIT)
    if w.routes.node[v]["origin"] >= 0:
        call_in(w.links.queue, w.routes.node[v]["origin"], 0)
        call_in(w.links.queue, w.routes.node[v]["origin"], _EXIT)


@spliced
def call_choices(w: World, v, horizon):
    """Call in what those read and write who may go over node v before this time."""
    origin = w.routes.node[v]["origin"]
    first, last = w.routes.node[v]["first_in"], w.routes.node[v + 1]["first_in"]
    for place in range(first, last + (origin >= 0)):
        q = place if place < last else origin
        if w.links.queue[q]["ready"] < horizon:
            call_platoons(w, w.links.queue[q])
            call_ways(w, w.links.queue[q])


@kernel
def call_platoons(w: World, queue):
    """Call in the first platoon of a queue, and the one behind it."""
    call_in(w.links.platoon, queue["base"] + (queue["left"] & queue["mask"]), 0)
    call_in(w.links.platoon, queue["base"] + ((queue["left"] + 1) & queue["mask"]), 0)
    call_in(w.log.key, np.int64(queue["trip"]), 0)


@kernel
def call_ways(w: World, queue):
    """Call in the links that the first platoon of a queue may choose, and their weights."""
    slot = w.routes.destination[queue["destination"]]["slot"]
    row = slot // LANES * w.routes.worth.shape[0] * w.routes.arc.size
    v = queue["vertex"]
    for arc in range(w.routes.vertex[v]["first_out"], w.routes.vertex[v + 1]["first_out"]):
        call_in(w.routes.history, (row + arc) * LANES + slot % LANES, 0)
        link = np.int64(w.routes.arc[arc]["link"])
        call_in(w.links.queue, link, _EXIT)
        call_in(w.links.queue, link, _ENTRY)


@spliced
def call_exits(w: World, v, horizon):
    """Call in the exits that make room for who may go over node v before this time."""
    for q in range(w.routes.node[v]["first_in"], w.routes.node[v + 1]["first_in"]):
        if w.links.queue[q]["ready"] < horizon:
            call_holes(w, w.links.queue[q]["vertex"])
            break  # others choose among the same links


@kernel
def call_holes(w: World, v):
    """Call in the exits that the next entries to the links from vertex v wait for."""
    for arc in range(w.routes.vertex[v]["first_out"], w.routes.vertex[v + 1]["first_out"]):
        link = w.links.queue[np.int64(w.routes.arc[arc]["link"])]
        call_in(w.links.platoon, link["base"] + ((link["next_hole"] + 1) & link["mask"]), 0)
