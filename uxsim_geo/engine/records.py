"""What the kernels work on: flat records, and the one way in which kernels are compiled.

A *queue* is a link or an origin. Links come first, ordered by the node they end at, so that the
in-links of a node are one short run; origins follow, one for every node where trips begin: a queue
of no length and no limits whose demand is already in it.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from uxsim_geo.compiling import digest_of_sources, entry, inner

# Counting references on every array of the world in every small call costs 13 to 50 times the
# work itself. Kernels allocate nothing and keep nothing, so they go without: `_nrt` is a private
# option of numba, and a test holds that it changes nothing but the time. Divisions follow
# IEEE 754, as numpy's do.
_OPTIONS: dict[str, Any] = {
    "_nrt": "UXSIM_GEO_COUNT_REFERENCES" in os.environ,
    "error_model": "numpy",
}
kernel = inner(forceinline=True, **_OPTIONS)
# For what has one caller and calls much itself: LLVM goes over all that a kernel calls once more
# for each level of calls above it, which is most of the time that compiling takes.
spliced = inner(inline="always", **_OPTIONS)
_SOURCES = digest_of_sources(*sorted(Path(__file__).parent.glob("*.py")))
# what Python calls: functions of a world, or of parts of it, compiled when they are first called
compiled = entry(_SOURCES, "the engine", nogil=True, **_OPTIONS)

#: a platoon in a queue: in a link, or waiting in its origin
PLATOON = np.dtype(
    [
        ("enter", np.float64),  # entered the link (origin: left home), s
        ("exit", np.float64),  # left the link, s; until then: is at its end in free flow
        ("trip", np.int32),  # row of its trip
        ("destination", np.int32),  # position among the destinations
        ("vehicles", np.int32),
        ("vertex", np.int32),  # to which it comes at the end of the link; origin: where it begins
    ],
    align=True,
)

#: a link or an origin, seen from its two ends. What is read together stands together, in one line
#: of a cache (64 bytes) each; all in four of them
QUEUE = np.dtype(
    [
        # what its first platoon wants, and when
        ("ready", np.float64),  # it may leave from here on, s; inf: the queue is empty
        ("feasible", np.float64),  # it can make its move from here on, s
        ("choice", np.int32),  # an out-link, ARRIVE or DEAD_END
        ("arc", np.int32),  # over which it goes on to that link
        ("chosen_step", np.int32),  # when that was last drawn
        ("since_step", np.int32),  # first step of the unbroken run of that draw; -1: always
        ("listed_step", np.int32),  # where it is in the calendar; -1: not listed
        ("next", np.int32),  # listed for the same step
        ("end_node", np.int32),
        ("lost", np.int32),  # openings lost to rivals
        ("vertex", np.int32),  # of the first platoon, as in its record
        ("destination", np.int32),
        ("vehicles", np.int32),
        ("trip", np.int32),
        # its exit, and its platoons, numbered by entry: how many have come and gone
        ("key", np.uint64),  # its random identity
        ("exit_open", np.float64),  # capacity at the exit allows the next exit from here on
        ("exit_headway", np.float64),  # 1 / Q_out, s per vehicle
        ("vehicles_left", np.float64),
        ("base", np.int32),  # where the ring of its platoons lies
        ("mask", np.int32),
        ("left", np.int32),
        ("entered", np.int32),
        ("cycle", np.float64),  # of the signal at its exit, s; 0: there is none
        ("due", np.float64),  # its first platoon certainly leaves no earlier, s
        # its entry
        ("entry_open", np.float64),  # capacity at the entry allows the next entry from here on
        ("entry_headway", np.float64),  # 1 / Q_in, s per vehicle
        ("room", np.float64),  # from here on there is room for `room_for` vehicles, s
        ("room_for", np.int32),  # 0: has to be worked out
        # the last platoon before the exit that lets the next entry in, or -1, found with the room;
        # of an origin: the first not seen to have left home, `hole_vehicles` being before it
        ("next_hole", np.int32),
        ("hole_vehicles", np.float64),  # vehicles up to and with platoon `next_hole`
        ("vehicles_entered", np.float64),
        ("storage", np.float64),  # m κ L, at least a platoon, vehicles
        ("hole_time", np.float64),  # L τ κ, s: a hole travels back over the link
        # the rest
        ("free_time", np.float64),  # L / u, s
        ("merge_priority", np.float64),
        ("credit", np.float64),  # vehicles · Σα that it has let others go before it, without draws
        ("offset", np.float64),  # s: when the first cycle of the signal begins
        ("first_green", np.int32),  # its greens: first_green to last_green in `Links.green`
        ("last_green", np.int32),
        ("hole", np.int32),  # what `next_hole` was for the last entry
        ("locked", np.int32),  # 1: it will never move again
        ("padding", np.float64, 2),  # to the end of the fourth line
    ],
    align=True,
)

#: a link, as its inside and its routes need it
ROAD = np.dtype(
    [
        ("length", np.float64),  # m
        ("free_speed", np.float64),  # m/s
        ("spacing", np.float64),  # 1 / (m κ), m per vehicle
        ("lag", np.float64),  # τ / m, s per vehicle
    ],
    align=True,
)

#: when a link has green, s after the cycle begins: start ≤ t < end
GREEN = np.dtype([("start", np.float64), ("end", np.float64)])

NODE = np.dtype(
    [
        ("headway", np.float64),  # 1 / capacity of the node, s per vehicle; 0: no limit
        ("open", np.float64),  # that capacity allows the next transfer from here on, s
        ("first_in", np.int32),  # its in-links: to the next node's first_in
        ("origin", np.int32),  # its origin, -1: there is none
        ("first_vertex", np.int32),  # its vertices: likewise
    ],
    align=True,
)

#: where a driver is as far as his way on is concerned: a node, for those who may take every turn,
#: and for all who have come along the beginning of a banned path another one at the same node
VERTEX = np.dtype(
    [
        ("distance", np.int32),  # ms to the destination at hand
        ("toward", np.int32),  # next arc on the way there, -1: none
        ("first_out", np.int32),  # its arcs: first_out to the next vertex's first_out
        ("first_in", np.int32),  # the ways that lead here: likewise in `Routes.incoming`
        # bit 1 + i: over its arc i one comes elsewhere than from the first of its node, or nowhere;
        # of the first: from some other. The last bit stands for all arcs from there on
        ("barred", np.int32),
        ("others", np.int16),  # of the first of a node: how many more of it have arcs
        ("open", np.int16),  # 1: some of these may have nearer ways than known so far
    ],
    align=True,
)

#: a way from a vertex over a link; ordered by the vertex where it starts, then by link. The
#: vertices of a node have arcs over the same links, or none
ARC = np.dtype(
    [
        ("link", np.int32),
        ("head", np.int32),  # the vertex to which it leads; -1: it must not be driven
        ("cost", np.int32),  # ms, for the drivers at hand
        # 1: it leads where that of the first vertex of the node leads; of such an arc, 1: all do
        ("alike", np.int32),
    ],
    align=True,
)

#: an arc as the search for ways needs it, ordered by the vertex to which it leads
INCOMING = np.dtype(
    [
        ("arc", np.int32),
        ("tail", np.int32),  # the vertex where it starts
        ("head", np.int32),
        ("cost", np.int32),  # ms, for the drivers at hand
    ],
    align=True,
)

DESTINATION = np.dtype(
    [
        ("outstanding", np.int64),  # vehicles under way to it, or to come
        ("first_trip", np.int64),  # where its trips begin in `Log.trips_by_destination`
        ("node", np.int32),
        ("driver", np.int32),  # who goes there: a row of `Routes.driver`
        ("given", np.int32),  # 1: their routes are given
        ("known", np.int32),  # 1: ways have been looked for
        ("wanted", np.int32),  # 1: ways are to be looked for now
        ("slot", np.int32),  # where its weights are: in which lane of which batch; -1: routes given
    ],
    align=True,
)

#: drivers who see and pay the same, and so choose alike
DRIVER = np.dtype(
    [
        ("key", np.uint64),  # random identity
        ("interval", np.float64),  # between two updates of routes, s
        ("delay", np.float64),  # age of the traffic that they see, s
        ("update_step", np.int64),  # of the next update
        ("observe_step", np.int64),  # of the next look at the traffic; NEVER: they do not look
        ("updates", np.int64),
        ("observations", np.int64),
        ("first_row", np.int64),  # their ring in `Routes.observed`: where it begins,
        ("rows", np.int64),  # and its rows; 0: they go by free-flow times
    ],
    align=True,
)

#: a vertex that a trip has come through, and where in the trail the one before it stands
VISITED = np.dtype([("vertex", np.int32), ("before", np.int32)], align=True)

TRIP = np.dtype(
    [
        ("depart", np.float64),
        ("enter", np.float64),
        ("arrive", np.float64),
        ("free_time", np.float64),  # of the fastest route at free flow, s; inf: there is none
        ("covered", np.float64),  # of the link it is on at the end, m
        ("from_node", np.int32),
        ("status", np.int32),
        ("route", np.int32),  # its next arc in `Routes.given`; -1: it chooses
        ("trail", np.int32),  # the last vertex it came through in `Routes.trail`; -1: none
    ],
    align=True,
)

EVENT = np.dtype(
    [("trip", np.int32), ("link", np.int32), ("enter", np.float64), ("exit", np.float64)],
    align=True,
)

CLOCK = np.dtype(
    [
        ("seed", np.uint64),
        ("step_length", np.float64),  # Δt = τ Δn, s
        ("end", np.float64),  # of the simulation, s
        ("step", np.int64),  # the step under way
        ("until_step", np.int64),  # run up to the start of this one
        ("opened_step", np.int64),  # the last step whose calendar has been read
        ("links", np.int64),
        ("platoons_used", np.int64),  # of the pool of rings
        ("pool_full", np.int64),  # 1: a ring could not grow
        ("trail_used", np.int64),  # of `Routes.trail`
        ("events", np.int64),  # rows in the buffer
        ("pending", np.int64),  # nodes still to be visited in this step
        ("cursor", np.int64),  # the next of them is looked for from here on
        ("vehicles_running", np.int64),
        ("vehicles_completed", np.int64),
        ("is_large", np.int64),  # 1: more than a cache holds
        ("sleep", np.int64),  # 0: blocked platoons try again in every step
        ("swept", np.int64),  # links whose remaining platoons have been written
        ("vehicles_locked", np.int64),
        ("control_step", np.int64),  # until then nothing is changed from outside
        # routes
        ("update_step", np.int64),  # of the next update, or look at the traffic, of any drivers
        ("update_weight", np.float64),
        ("logit_spread", np.float64),  # s; 0: inertia instead
        ("no_cycles", np.int64),  # 1: nobody returns to a vertex
        ("deterministic", np.int64),  # 1: no draws
        ("noise", np.float64),
        ("mean_speed", np.float64),  # of the vehicles on the road at the last update, m/s
    ],
    align=True,
)

# choices that are no link
NOTHING, ARRIVE, DEAD_END = -1, -2, -3

NEVER = np.int64(2**62)  # a step that does not come
LANES = 64  # destinations of a batch, whose weights and distances stand side by side
UNREACHED = np.int32(2**29)  # ms, 149 hours: no way; the sum of two fits into 32 bits

# status of a trip
WAITING, RUNNING, COMPLETED, ABORTED = 0, 1, 2, 3


class Links(NamedTuple):
    """All queues and the platoons in them."""

    clock: np.ndarray  # (1,) CLOCK
    queue: np.ndarray  # (links + origins,) QUEUE
    platoon: np.ndarray  # (pool,) PLATOON: the rings of all queues
    green: np.ndarray  # (greens,) GREEN: of each link in order


class Routes(NamedTuple):
    """How the links hang together, and the ways over them."""

    road: np.ndarray  # (links,) ROAD
    node: np.ndarray  # (nodes + 1,) NODE
    vertex: np.ndarray  # (vertices + 1,) VERTEX
    arc: np.ndarray  # (arcs,) ARC
    incoming: np.ndarray  # (ways,) INCOMING: all but those that are alike
    destination: np.ndarray  # (destinations + 1,) DESTINATION
    history: np.ndarray  # (batches · bytes, arcs, LANES) uint8: when arcs were on trees
    worth: np.ndarray  # (bytes, 256) float64: what a byte of that adds to the weight
    weight: np.ndarray  # (batches, arcs, LANES) float32: where no history is kept, the weights
    driver: np.ndarray  # (drivers,) DRIVER
    observed: np.ndarray  # (rows, links) float64: travel times that drivers have seen, s
    extra: np.ndarray  # (drivers, links) float64: tolls, distance and advice in s; inf: banned
    given: np.ndarray  # (n,) int32: given routes one after the other, arcs
    trail: np.ndarray  # (n,) VISITED
    passed: np.ndarray  # (most arcs of a vertex,) float64: sums of their weights, in a choice
    heap: np.ndarray  # (2 arcs + 2 vertices,) int64


class Hierarchy(NamedTuple):
    """Ways between vertices, by their places in an order (see ``hierarchy``)."""

    place: np.ndarray  # (vertices,) int64: of every vertex
    first: np.ndarray  # (vertices + 1,) int64: where the ways up from each place begin
    upper: np.ndarray  # (ways,) int32: the place to which each leads up; ordered by that
    up: np.ndarray  # (ways,) int32: what it costs to drive it up, ms; UNREACHED: it cannot be
    down: np.ndarray  # (ways,) int32: likewise, down
    # (arcs,) int64: the way that an arc drives up, or -1 - the way that it drives down; of arcs
    # that lead nowhere, or back to where they begin, -1 - ways
    way_of_arc: np.ndarray
    tail: np.ndarray  # (arcs,) int32: the places of the ends of every arc;
    head: np.ndarray  # of arcs that lead nowhere, the same

    @property
    def triangles(self) -> int:
        """How many pairs of ways lead up from the same place."""
        ways = np.diff(self.first)
        return int((ways * (ways - 1) // 2).sum())


class Lanes(NamedTuple):
    """Room in which a thread works on a batch of destinations, each of which has a lane."""

    own: np.ndarray  # (LANES,) int32: the destination of each lane; -1: none
    distance: np.ndarray  # (vertices, LANES) int32: of every place, ms; see `sweep`
    nearer: np.ndarray  # (LANES,) int32: by how much all is nearer than FARTHEST, ms
    fresh: np.ndarray  # (LANES,) uint8: 255 where no way has been looked for before
    idle: np.ndarray  # (LANES,) uint8: 255 where no way is looked for now
    toward: np.ndarray  # (vertices or 0, LANES) int32: the arc over which a vertex goes on
    time: np.ndarray  # (vertices or 0,) float64: of a vertex at free flow, s
    passed: np.ndarray  # (vertices or 0,) int32: vertices on the way


class Calendar(NamedTuple):
    """Which nodes are to be visited when."""

    bucket: np.ndarray  # (steps,) int32: first queue listed for a step, -1: none
    candidate: np.ndarray  # (most in-links and an origin,) int32: who may move in a visit
    pending: np.ndarray  # (nodes, padded to 8) uint8: to be visited in this step
    pending_words: np.ndarray  # the same bytes as uint64


class Log(NamedTuple):
    """What a run leaves behind."""

    trip: np.ndarray  # (trips,) TRIP
    key: np.ndarray  # (trips,) uint64: random identity of the platoon
    event: np.ndarray  # (buffer,) EVENT
    trips_by_destination: np.ndarray  # (trips,) int32


class Queues(NamedTuple):
    """The part of the world that lists queues: to hand over all of it takes time."""

    links: Links
    calendar: Calendar


class World(NamedTuple):
    """All that a run reads and writes.

    Kernels take the part they need: compiling takes time for every array that is handed on.
    """

    links: Links
    routes: Routes
    calendar: Calendar
    log: Log
