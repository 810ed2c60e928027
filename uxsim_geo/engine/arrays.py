"""From tables to the records of the engine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.demand.platoons import Floats, Ints, Platoons
from uxsim_geo.draws import text_keys
from uxsim_geo.engine import records
from uxsim_geo.engine.history import bytes_needed, empty_memory, worth_of_bytes
from uxsim_geo.engine.population import weight_of_update
from uxsim_geo.engine.records import PLATOON, Calendar, Links, Log, Routes, World
from uxsim_geo.engine.router import Router
from uxsim_geo.engine.slots import give_slots
from uxsim_geo.engine.ways import arc_records, incoming_records, vertex_records
from uxsim_geo.network.diagram import effective_capacity, storage
from uxsim_geo.network.network import Network
from uxsim_geo.network.paths import Paths
from uxsim_geo.settings import Settings

_FIRST_RING = 8  # places of a ring at the start; it doubles when it must
_IN_CACHE = 2_000_000  # bytes of queues, to which platoons several times as large belong
_EVENT_BUFFER = 1 << 14  # rows
Records = npt.NDArray[Any]


@dataclass(frozen=True)
class Wishes:
    """Where platoons want to go, as the engine sees it; all shapes are (platoons,).

    destination
        node, among those of the network
    driver
        which drivers they are
    route
        where their given route begins in ``given``, -1: they choose
    given
        (any,) given routes one after the other: arcs
    """

    destination: Ints
    driver: Ints
    route: Ints
    given: Ints

    @property
    def destinations(self) -> int:
        """How many different destinations of the same drivers are chosen ways to."""
        pairs = np.stack([self.driver, self.destination])[:, self.route < 0]
        return int(np.unique(pairs, axis=1).shape[1])


def build_world(
    network: Network,
    platoons: Platoons,
    wishes: Wishes,
    drivers: Records,
    settings: Settings,
    *,
    router: Router,
    sleep: bool,
) -> World:
    """Build all records of a run; links stand in the order of :func:`order_of_links`."""
    paths = router.paths
    node_ids = pd.Index(network.nodes["node_id"].astype(str))
    row_of_link = order_of_links(paths)
    links = network.links.iloc[row_of_link]
    ends = node_ids.get_indexer(pd.Index(links["to_node_id"].astype(str))).astype(np.int64)
    node_of_code = node_ids.get_indexer(pd.Index(platoons.node_ids)).astype(np.int64)
    origins, queue_of_platoon = np.unique(node_of_code[platoons.origin], return_inverse=True)
    destinations, destination = destinations_of(wishes, len(node_ids), drivers.size)
    batches = give_slots(destinations[:-1], router.rank)

    road = _roads(links, settings)
    queue = _queues(links, road, origins, settings)
    queue["end_node"][: len(links)] = ends
    home = origin_platoons(platoons, destination, paths.first[node_of_code[platoons.origin]])
    platoon = _fill_origins(queue, home, queue_of_platoon, settings.platoon_size)
    rows = int(drivers["rows"].sum())
    arc = arc_records(paths, row_of_link)
    incoming = incoming_records(paths, arc)
    worth = worth_of_updates(settings)
    history, weight = empty_memory(batches, arc.size, len(worth))
    world = World(
        links=Links(
            clock=_clock(settings, len(links), sleep=sleep),
            queue=queue,
            platoon=platoon,
            green=np.zeros(0, records.GREEN),
        ),
        routes=Routes(
            road=road,
            node=_nodes(paths, queue, len(links)),
            vertex=vertex_records(paths, arc, incoming),
            arc=arc,
            incoming=incoming,
            destination=_count_trips(destinations, destination, platoons.vehicles),
            history=history,
            worth=worth,
            weight=weight,
            driver=drivers,
            observed=np.zeros((rows, len(links))),
            extra=np.zeros((drivers.size, len(links))),
            given=wishes.given.astype(np.int32),
            trail=np.empty(0, records.VISITED),
            passed=np.empty(int(np.bincount(paths.tail).max(initial=0))),
            heap=np.empty(2 * (arc.size + paths.node.size), np.int64),
        ),
        calendar=_empty_calendar(ends, len(node_ids), settings),
        log=Log(
            trip=trips_of(platoons, node_of_code, wishes),
            key=platoons.key,
            event=np.empty(_EVENT_BUFFER, records.EVENT),
            trips_by_destination=np.argsort(destination, kind="stable").astype(np.int32),
        ),
    )
    world.links.clock["platoons_used"] = len(links) * _FIRST_RING + platoons.depart.size
    world.links.clock["is_large"] = queue.nbytes > _IN_CACHE
    _list_origins(world, len(links))
    return world


def _empty_calendar(end_nodes: Ints, nodes: int, settings: Settings) -> Calendar:
    pending = np.zeros(-(-nodes // 8) * 8, np.uint8)
    most_in = int(np.bincount(end_nodes).max(initial=0))
    return Calendar(
        bucket=np.full(int(np.ceil(settings.duration / settings.step - 1e-9)), -1, np.int32),
        candidate=np.empty(most_in + 1, np.int32),
        pending=pending,
        pending_words=pending.view(np.uint64),
    )


def order_of_links(paths: Paths) -> Ints:
    """Return the rows of the links table in the order of the engine: by the node they end at.

    Links to one node are ordered by the node they start at.
    """
    return np.lexsort((paths.start, paths.end)).astype(np.int64)


def _roads(links: pd.DataFrame, settings: Settings) -> Records:
    road = np.zeros(len(links), records.ROAD)
    lanes = links["lanes"].to_numpy(np.float64)
    road["length"] = links["length"]
    road["free_speed"] = links["free_speed"]
    road["spacing"] = 1.0 / (lanes * links["jam_density"].to_numpy(np.float64))
    road["lag"] = settings.reaction_time / lanes
    return road


def _queues(links: pd.DataFrame, road: Records, origins: Ints, settings: Settings) -> Records:
    """Make the queues of links and origins, empty."""
    count = len(links)
    queue = np.concatenate([_empty_queues(count), origin_queues(origins)])
    link = queue[:count]
    link["free_time"] = road["length"] / road["free_speed"]
    link["hole_time"] = (
        road["length"] * settings.reaction_time * links["jam_density"].to_numpy(np.float64)
    )
    headway = 1.0 / effective_capacity(links, settings.reaction_time)
    link["entry_headway"] = link["exit_headway"] = headway
    link["storage"] = storage(links, settings.platoon_size)
    link["merge_priority"] = links["merge_priority"]
    link["key"] = text_keys(links["link_id"].astype(str))
    link["base"] = np.arange(count) * _FIRST_RING
    link["mask"] = _FIRST_RING - 1
    link["hole"] = link["next_hole"] = -1
    return queue


def origin_queues(nodes: Ints) -> Records:
    """Make the queues of the origins at some nodes, empty."""
    queue = _empty_queues(nodes.size)
    queue["end_node"] = nodes
    queue["merge_priority"] = 1.0
    return queue


def _empty_queues(count: int) -> Records:
    queue = np.zeros(count, records.QUEUE)
    queue["ready"] = queue["feasible"] = queue["due"] = np.inf
    queue["choice"] = records.NOTHING
    queue["chosen_step"] = queue["listed_step"] = queue["next"] = -1
    return queue


def origin_platoons(
    platoons: Platoons, destination: Ints, vertex: Ints, *, first_trip: int = 0
) -> Records:
    """Make the records of platoons at home, where they begin; their trips follow one another."""
    home = np.empty(platoons.depart.size, PLATOON)
    home["enter"] = home["exit"] = platoons.depart
    home["trip"] = first_trip + np.arange(home.size)
    home["destination"] = destination
    home["vehicles"] = platoons.vehicles
    home["vertex"] = vertex
    return home


def _fill_origins(queue: Records, home: Records, queue_of_platoon: Ints, size: int) -> Records:
    """Put every platoon into the queue of its origin; gives the pool of rings.

    The rings of the origins come last and are never written to: they need not be a power of two
    long, since their mask leaves every number as it is.
    """
    order = np.argsort(queue_of_platoon, kind="stable")
    counts = np.bincount(queue_of_platoon)
    links = queue.size - counts.size
    room = links * _FIRST_RING
    most = np.minimum(queue["storage"][:links] / size, order.size)
    pool = np.empty(room + order.size + _spare_places(most), PLATOON)
    pool[room : room + order.size] = home[order]
    origin = queue[links:]
    first = np.cumsum(counts) - counts
    origin["base"] = room + first
    origin["mask"] = np.iinfo(np.int32).max
    origin["entered"] = counts
    of_first = pool[room + first]
    origin["ready"] = origin["due"] = of_first["enter"]
    for name in ("trip", "vehicles", "vertex", "destination"):
        origin[name] = of_first[name]
    return pool


def _spare_places(most: Floats) -> int:
    """Count the places that rings take as they grow, should links fill with so many platoons each.

    Memory that is never touched costs nothing, and the pool is widened where platoons are smaller
    or come to the same link again.
    """
    longest = np.exp2(np.ceil(np.log2(most + 3)))
    return int(2 * longest.sum())


def trips_of(platoons: Platoons, node_of_code: Ints, wishes: Wishes) -> Records:
    """Make the records of trips that have not begun."""
    trip = np.zeros(platoons.depart.size, records.TRIP)
    trip["depart"] = platoons.depart
    trip["enter"] = trip["arrive"] = np.nan
    trip["from_node"] = node_of_code[platoons.origin]
    trip["status"] = records.WAITING
    trip["route"] = wishes.route
    trip["trail"] = -1
    return trip


def _nodes(paths: Paths, queue: Records, links: int) -> Records:
    node = np.zeros(paths.first.size, records.NODE)
    node["first_in"] = np.searchsorted(queue["end_node"][:links], np.arange(node.size))
    node["first_vertex"] = paths.first
    set_origins(node, queue, links)
    return node


def set_origins(node: Records, queue: Records, links: int) -> None:
    """Tell every node its origin."""
    node["origin"] = -1
    node["origin"][queue["end_node"][links:]] = np.arange(links, queue.size)


def destinations_of(wishes: Wishes, nodes: int, drivers: int) -> tuple[Records, Ints]:
    """Make the destinations, each of a node, drivers, and routes given or not; and whose is which.

    There is one more, whose trips would begin where the last one's end.
    """
    is_given = (wishes.route >= 0).astype(np.int64)
    code = (is_given * drivers + wishes.driver) * nodes + wishes.destination
    codes, destination = np.unique(code, return_inverse=True)
    table = np.zeros(codes.size + 1, records.DESTINATION)
    table["slot"] = -1
    table["node"][:-1] = codes % max(nodes, 1)
    table["driver"][:-1] = codes // max(nodes, 1) % drivers
    table["given"][:-1] = codes // max(nodes * drivers, 1)
    return table, destination


def _count_trips(table: Records, destination: Ints, vehicles: Ints) -> Records:
    table["outstanding"][:-1] = np.bincount(destination, vehicles)
    table["first_trip"][1:] = np.cumsum(np.bincount(destination))
    return table


def worth_of_updates(settings: Settings) -> Floats:
    """Return what bytes of the history are worth; without rows where weights are kept instead."""
    share = weight_of_update(settings)
    count = bytes_needed(share, is_logit=settings.route_choice == "logit")
    return worth_of_bytes(share, count)


def _clock(settings: Settings, links: int, *, sleep: bool) -> Records:
    clock = np.zeros(1, records.CLOCK)
    clock["seed"] = settings.seed
    clock["step_length"] = settings.step
    clock["end"] = settings.duration
    clock["opened_step"] = -1
    clock["links"] = links
    clock["sleep"] = sleep
    clock["control_step"] = records.NEVER
    clock["update_weight"] = weight_of_update(settings)
    clock["logit_spread"] = settings.logit_spread if settings.route_choice == "logit" else 0.0
    clock["no_cycles"] = settings.no_cycles
    clock["deterministic"] = settings.deterministic
    clock["noise"] = 0.0 if settings.deterministic else settings.route_noise
    clock["mean_speed"] = np.nan
    return clock


def _list_origins(world: World, links: int) -> None:
    """List every origin in the calendar under the departure of its first platoon."""
    queue, bucket = world.links.queue, world.calendar.bucket
    for q in range(links, queue.size):
        step = int(queue["ready"][q] / world.links.clock["step_length"][0])
        if step < bucket.size:
            queue["listed_step"][q] = step
            queue["next"][q] = bucket[step]
            bucket[step] = q
