"""From tables to the records of the engine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.control.signals import Signal
from uxsim_geo.demand.platoons import Floats, Ints, Platoons
from uxsim_geo.draws import text_keys
from uxsim_geo.engine import records
from uxsim_geo.engine.records import PLATOON, Calendar, Links, Log, Routes, World
from uxsim_geo.network.diagram import effective_capacity
from uxsim_geo.network.network import Network
from uxsim_geo.settings import Settings

_FIRST_RING = 8  # places of a ring at the start; it doubles when it must
_EVENT_BUFFER = 1 << 14  # rows
Records = npt.NDArray[Any]


def build_world(
    network: Network,
    platoons: Platoons,
    settings: Settings,
    signals: Sequence[Signal],
    *,
    sleep: bool,
) -> tuple[World, Ints]:
    """Build all records of a run; also gives the row in the links table of every link."""
    node_ids = pd.Index(network.nodes["node_id"].astype(str))
    table = network.links
    starts = node_ids.get_indexer(pd.Index(table["from_node_id"].astype(str)))
    row_of_link = np.argsort(starts, kind="stable").astype(np.int64)
    links = table.iloc[row_of_link]
    ends = node_ids.get_indexer(pd.Index(links["to_node_id"].astype(str))).astype(np.int64)
    node_of_code = node_ids.get_indexer(pd.Index(platoons.node_ids)).astype(np.int64)
    origins, queue_of_platoon = np.unique(node_of_code[platoons.origin], return_inverse=True)
    destinations, destination = np.unique(node_of_code[platoons.destination], return_inverse=True)

    road = _roads(links, starts[row_of_link], settings)
    queue = _queues(links, road, ends, origins, settings)
    size = settings.platoon_size
    platoon = _fill_origins(queue, platoons, queue_of_platoon, destination, size)
    largest_link = int(np.max(queue["storage"][: len(links)], initial=0.0)) + 1
    steps = int(np.ceil(settings.duration / settings.step - 1e-9))
    pending = np.zeros(-(-len(node_ids) // 8) * 8, np.uint8)
    world = World(
        links=Links(
            clock=_clock(settings, len(links), sleep=sleep),
            queue=queue,
            platoon=platoon,
            green=_greens(queue, links["link_id"].astype(str).tolist(), signals),
        ),
        routes=Routes(
            road=road,
            node=_nodes(network.nodes, starts[row_of_link], queue["end_node"]),
            into=np.argsort(queue["end_node"], kind="stable"),
            destination=_destinations(destinations, destination, platoons.vehicles),
            weight=np.zeros((destinations.size, len(links)), np.float32),
            settled=np.empty(len(node_ids), np.int32),
            heap=np.empty(len(links) + 1, np.int64),
        ),
        calendar=Calendar(np.full(steps, -1, np.int32), pending, pending.view(np.uint64)),
        log=Log(
            trip=_trips(platoons, node_of_code),
            event=np.empty(max(_EVENT_BUFFER, largest_link), records.EVENT),
            trips_by_destination=np.argsort(destination, kind="stable").astype(np.int32),
        ),
    )
    world.links.clock["platoons_used"] = len(links) * _FIRST_RING + platoons.depart.size
    _list_origins(world, len(links))
    return world, row_of_link


def _roads(links: pd.DataFrame, starts: Ints, settings: Settings) -> Records:
    road = np.zeros(len(links), records.ROAD)
    lanes = links["lanes"].to_numpy(np.float64)
    road["length"] = links["length"]
    road["free_speed"] = links["free_speed"]
    road["spacing"] = 1.0 / (lanes * links["jam_density"].to_numpy(np.float64))
    road["lag"] = settings.reaction_time / lanes
    road["from_node"] = starts
    return road


def _queues(
    links: pd.DataFrame, road: Records, ends: Ints, origins: Ints, settings: Settings
) -> Records:
    """Make the queues of links and origins, empty."""
    count = len(links)
    queue = np.zeros(count + origins.size, records.QUEUE)
    link = queue[:count]
    link["free_time"] = road["length"] / road["free_speed"]
    link["hole_time"] = (
        road["length"] * settings.reaction_time * links["jam_density"].to_numpy(np.float64)
    )
    headway = 1.0 / effective_capacity(links, settings.reaction_time)
    link["entry_headway"] = link["exit_headway"] = headway
    link["storage"] = np.maximum(settings.platoon_size, road["length"] / road["spacing"])
    link["merge_priority"] = links["merge_priority"]
    link["key"] = text_keys(links["link_id"].astype(str))
    link["end_node"] = ends
    link["base"] = np.arange(count) * _FIRST_RING
    link["mask"] = _FIRST_RING - 1
    queue["end_node"][count:] = origins
    queue["merge_priority"][count:] = 1.0
    queue["hole"] = -1
    queue["ready"] = queue["feasible"] = queue["due"] = np.inf
    queue["choice"] = records.NOTHING
    queue["chosen_step"] = queue["listed_step"] = queue["next"] = -1
    return queue


def _greens(queue: Records, link_ids: list[str], signals: Sequence[Signal]) -> Records:
    """Put the signals into their links; gives the greens of all of them."""
    position = {link_id: number for number, link_id in enumerate(link_ids)}
    times: list[tuple[float, float]] = []
    for signal in signals:
        for link_id, own in signal.greens().items():
            link = queue[position[link_id]]
            link["cycle"], link["offset"] = signal.cycle, signal.offset
            link["first_green"], link["last_green"] = len(times), len(times) + len(own)
            times += own
    return np.array(times, records.GREEN)


def _fill_origins(
    queue: Records, platoons: Platoons, queue_of_platoon: Ints, destination: Ints, size: int
) -> Records:
    """Put every platoon into the queue of its origin; gives the pool of rings.

    The rings of the origins come last and are never written to: they need not be a power of two
    long, since their mask leaves every number as it is.
    """
    order = np.argsort(queue_of_platoon, kind="stable")
    counts = np.bincount(queue_of_platoon)
    links = queue.size - counts.size
    room = links * _FIRST_RING
    pool = np.empty(room + order.size + _spare_places(queue["storage"][:links], size), PLATOON)
    home = pool[room : room + order.size]
    home["key"] = platoons.key[order]
    home["enter"] = platoons.depart[order]
    home["exit"] = np.nan
    home["trip"] = order
    home["destination"] = destination[order]
    home["vehicles"] = platoons.vehicles[order]
    origin = queue[links:]
    first = np.cumsum(counts) - counts
    origin["base"] = room + first
    origin["mask"] = np.iinfo(np.int64).max
    origin["entered"] = counts
    origin["ready"] = origin["due"] = home["enter"][first]
    return pool


def _spare_places(storage: Floats, size: int) -> int:
    """Count the places that rings take as they grow, should all links fill with full platoons.

    Memory that is never touched costs nothing, and the pool is widened where platoons are smaller.
    """
    longest = np.exp2(np.ceil(np.log2(storage / size + 3)))
    return int(2 * longest.sum())


def _trips(platoons: Platoons, node_of_code: Ints) -> Records:
    trip = np.zeros(platoons.depart.size, records.TRIP)
    trip["depart"] = platoons.depart
    trip["enter"] = trip["arrive"] = np.nan
    trip["from_node"] = node_of_code[platoons.origin]
    trip["status"] = records.WAITING
    return trip


def _nodes(table: pd.DataFrame, starts: Ints, end_nodes: Ints) -> Records:
    node = np.zeros(len(table) + 1, records.NODE)
    numbers = np.arange(len(table) + 1)
    node["first_out"] = np.searchsorted(starts, numbers)
    node["first_in"] = np.searchsorted(np.sort(end_nodes, kind="stable"), numbers)
    node["through"] = 1
    if "through_traffic" in table:
        node["through"][:-1] = table["through_traffic"].to_numpy(bool)
    return node


def _destinations(nodes: Ints, destination: Ints, vehicles: Ints) -> Records:
    """Make the destinations, and one more whose trips would begin where the last one's end."""
    table = np.zeros(nodes.size + 1, records.DESTINATION)
    table["node"][:-1] = nodes
    table["outstanding"][:-1] = np.bincount(destination, vehicles)
    table["first_trip"][1:] = np.cumsum(np.bincount(destination))
    return table


def _clock(settings: Settings, links: int, *, sleep: bool) -> Records:
    clock = np.zeros(1, records.CLOCK)
    clock["seed"] = settings.seed
    clock["step_length"] = settings.step
    clock["end"] = settings.duration
    clock["opened_step"] = -1
    clock["links"] = links
    clock["sleep"] = sleep
    clock["update_interval"] = settings.route_update_interval
    clock["update_weight"] = settings.route_update_weight
    clock["noise"] = settings.route_noise
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
