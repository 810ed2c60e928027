"""Demand that is added while a run goes on."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.demand.demand import Demand
from uxsim_geo.demand.platoons import Ints, Platoons, make_platoons, weighted_counts
from uxsim_geo.engine.arrays import (
    Wishes,
    destinations_of,
    origin_platoons,
    origin_queues,
    set_origins,
    trips_of,
)
from uxsim_geo.engine.history import empty_memory
from uxsim_geo.engine.records import World
from uxsim_geo.engine.slots import give_slots
from uxsim_geo.errors import Faults
from uxsim_geo.network.network import Network
from uxsim_geo.settings import Settings

Records = npt.NDArray[Any]


def platoons_to_add(demand: Demand, settings: Settings, platoons: Platoons, now: float) -> Platoons:
    """Cut more demand into platoons, numbered on from those that there are.

    Raises :class:`uxsim_geo.errors.InputError` for demand that would leave home before now.
    """
    faults = Faults("demand")
    early = demand.table["start_s"].to_numpy(np.float64) < now
    for row in np.flatnonzero(early):
        what = f"begins before the time that the run has come to, {now:g} s"
        faults.add(
            what, line=int(row) + 1, column="start_s", value=demand.table["start_s"].iloc[row]
        )
    faults.raise_if_any()
    return make_platoons(demand, settings, platoons.next_numbers())


def add_platoons(
    world: World, added: Platoons, wishes: Wishes, network: Network, rank: Ints
) -> tuple[World, Ints]:
    """Put platoons into a world that runs; also gives the queues of their origins.

    ``rank`` is by which nodes are best ordered, (nodes,).
    """
    node_ids = pd.Index(network.nodes["node_id"].astype(str))
    node_of_code = node_ids.get_indexer(pd.Index(added.node_ids)).astype(np.int64)
    first_trip, before = world.log.trip.size, _destination_of_trips(world)
    world, destination = _with_destinations(world, wishes, rank)
    outstanding = weighted_counts(
        destination, added.vehicles.astype(float), world.routes.destination.size
    )
    table = world.routes.destination
    # nobody has been bound for these: the ways to them are from long ago
    table["known"][table["outstanding"] == 0] = 0
    table["outstanding"] += outstanding.astype(np.int64)
    trips = np.concatenate([world.log.trip, trips_of(added, node_of_code, wishes)])
    keys = np.concatenate([world.log.key, added.key])
    world = world._replace(
        routes=world.routes._replace(given=wishes.given.astype(np.int32)),
        log=world.log._replace(trip=trips, key=keys),
    )
    world = _with_trips_by_destination(world, np.concatenate([before, destination]))
    node = node_of_code[added.origin]
    vertex = world.routes.node["first_vertex"][node]
    home = origin_platoons(added, destination, vertex, first_trip=first_trip)
    return _with_platoons_at_home(world, home, node)


def _with_destinations(world: World, wishes: Wishes, rank: Ints) -> tuple[World, Ints]:
    """Add the destinations that are new; also gives that of every platoon."""
    routes = world.routes
    wanted, own = destinations_of(wishes, rank.size, routes.driver.size)
    known = {_identity(one): place for place, one in enumerate(routes.destination[:-1])}
    place_of = np.array(
        [known.setdefault(_identity(one), len(known)) for one in wanted[:-1]], np.int64
    )
    new = np.flatnonzero(place_of >= routes.destination.size - 1)
    table = np.concatenate([routes.destination[:-1], wanted[new], routes.destination[-1:]])
    batches, count = give_slots(table[:-1], rank), len(routes.worth)
    history, weight = empty_memory(batches, routes.arc.size, count)
    history[: len(routes.history)] = routes.history
    weight[: len(routes.weight)] = routes.weight
    routes = routes._replace(destination=table, history=history, weight=weight)
    return world._replace(routes=routes), place_of[own]


def _identity(destination: Records) -> tuple[int, int, int]:
    return int(destination["node"]), int(destination["driver"]), int(destination["given"])


def _destination_of_trips(world: World) -> Ints:
    """Return the destination of every trip."""
    counts = np.diff(world.routes.destination["first_trip"])
    destination = np.empty(world.log.trip.size, np.int64)
    destination[world.log.trips_by_destination] = np.repeat(np.arange(counts.size), counts)
    return destination


def _with_trips_by_destination(world: World, destination: Ints) -> World:
    """List all trips by their destinations."""
    table = world.routes.destination
    counts = np.bincount(destination, minlength=table.size - 1)
    table["first_trip"] = np.append(0, np.cumsum(counts))
    order = np.argsort(destination, kind="stable").astype(np.int32)
    return world._replace(log=world.log._replace(trips_by_destination=order))


def _with_platoons_at_home(world: World, home: Records, node: Ints) -> tuple[World, Ints]:
    """Put platoons into the queues of their origins, behind those who leave home earlier."""
    world = _with_origins(world, np.unique(node))
    links = int(world.links.clock["links"][0])
    queue = world.links.queue
    queue_of_node = {int(v): links + place for place, v in enumerate(queue["end_node"][links:])}
    pool, used = world.links.platoon, int(world.links.clock["platoons_used"][0])
    rings = []
    origins = np.array([queue_of_node[int(v)] for v in np.unique(node)], np.int64)
    for q in origins:
        one = queue[q]
        at_home = pool[one["base"] + one["left"] : one["base"] + one["entered"]]
        ring = np.concatenate([at_home, home[node == one["end_node"]]])
        ring = ring[np.argsort(ring["enter"], kind="stable")]
        queue["base"][q], queue["mask"][q] = used - one["left"], np.iinfo(np.int32).max
        queue["entered"][q] = one["left"] + ring.size
        queue["next_hole"][q], queue["hole_vehicles"][q] = one["left"], one["vehicles_left"]
        rings.append(ring)
        used += ring.size
    rings_in_row = np.concatenate(rings)
    start = int(world.links.clock["platoons_used"][0])
    if used > pool.size:
        pool = np.concatenate([pool, np.empty(max(used - pool.size, pool.size), pool.dtype)])
    pool[start:used] = rings_in_row
    world.links.clock["platoons_used"] = used
    return world._replace(links=world.links._replace(platoon=pool)), origins


def _with_origins(world: World, nodes: Ints) -> World:
    """Make origins at the nodes that have none yet."""
    links, routes = world.links, world.routes
    count = int(links.clock["links"][0])
    missing = np.setdiff1d(nodes, links.queue["end_node"][count:])
    if missing.size == 0:
        return world
    queue = np.concatenate([links.queue, origin_queues(missing)])
    node = routes.node.copy()
    set_origins(node, queue, count)
    return world._replace(links=links._replace(queue=queue), routes=routes._replace(node=node))
