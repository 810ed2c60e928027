"""The tables that follow from what a script has added."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import pandas as pd

from uxsim_geo.control.signals import Phase, Signal
from uxsim_geo.demand.demand import Demand
from uxsim_geo.errors import Faults
from uxsim_geo.network.network import Network

if TYPE_CHECKING:
    from uxsim_geo.world.links import Link
    from uxsim_geo.world.nodes import Node
    from uxsim_geo.world.vehicles import AddedVehicle


class DemandRow(NamedTuple):
    """A row of the demand table: node ids, s after the start, vehicles."""

    origin: str
    destination: str
    start_s: float
    end_s: float
    vehicles: float


def nodes_table(nodes: Sequence[Node]) -> pd.DataFrame:
    """Nodes as a table, with the coordinates as columns x and y."""
    return pd.DataFrame(
        {
            "node_id": [node.name for node in nodes],
            "zone_id": [node.name for node in nodes],
            "control": ["signal" if node.cycle_length else "none" for node in nodes],
            "through_traffic": True,
            "x": [node.x for node in nodes],
            "y": [node.y for node in nodes],
        }
    )


def links_table(links: Sequence[Link]) -> pd.DataFrame:
    """Links as a table, without geometry."""
    names = [link.name for link in links]
    return pd.DataFrame(
        {
            "link_id": names,
            "from_node_id": [link.start_node.name for link in links],
            "to_node_id": [link.end_node.name for link in links],
            "length": [link.length for link in links],
            "lanes": [link.number_of_lanes for link in links],
            "free_speed": [link.free_flow_speed for link in links],
            "jam_density": [link.jam_density_per_lane for link in links],
            "capacity": math.nan,
            "merge_priority": [link.merge_priority for link in links],
            "road_class": "",
            "name": names,
            "source_id": names,
            "lanes_source": "given",
            "free_speed_source": "given",
        }
    )


def with_geometry(network: Network) -> Network:
    """The same network with points, and straight lines between them; no reference system."""
    import geopandas as gpd
    import shapely

    place = network.nodes[["x", "y"]].to_numpy(float)
    row = pd.Index(network.nodes["node_id"])
    ends = [row.get_indexer(network.links[side]) for side in ("from_node_id", "to_node_id")]
    lines = shapely.linestrings(np.stack([place[end] for end in ends], axis=1))
    nodes = gpd.GeoDataFrame(
        network.nodes.drop(columns=["x", "y"]), geometry=shapely.points(place), crs=None
    )
    links = gpd.GeoDataFrame(network.links, geometry=lines, crs=None)
    return Network(nodes, links)


def demand_of(rows: Iterable[DemandRow]) -> Demand:
    """Rows as a demand."""
    return Demand(pd.DataFrame(rows, columns=list(DemandRow._fields)))


def demand_of_vehicles(vehicles: Iterable[AddedVehicle], platoon_size: int) -> Demand:
    """Vehicles that were added one by one as a demand: each a platoon, in a moment of its own.

    A demand without other rows of the same pair is cut into just these platoons again, since the
    rows of a pair are taken in the order of time and each holds one platoon.
    """
    rows = [
        {
            "origin": vehicle.orig.name,
            "destination": vehicle.dest.name,
            "start_s": vehicle.departure_time,
            "end_s": end_of_moment(vehicle.departure_time),
            "vehicles": float(platoon_size),
            "route": tuple(link.name for link in vehicle.route) if vehicle.route else None,
        }
        for vehicle in vehicles
    ]
    return Demand(pd.DataFrame(rows, columns=[*DemandRow._fields, "route"]))


def rounds_of(vehicles: Iterable[AddedVehicle]) -> list[list[AddedVehicle]]:
    """Part vehicles such that no two of a part have both ends and the departure in common."""
    rounds: list[list[AddedVehicle]] = []
    met: Counter[tuple[str, str, float]] = Counter()
    for vehicle in vehicles:
        if met[vehicle.moment] == len(rounds):
            rounds.append([])
        rounds[met[vehicle.moment]].append(vehicle)
        met[vehicle.moment] += 1
    return rounds


def end_of_moment(time: float) -> float:
    """The next number after a time: the shortest period that begins then."""
    return float(np.nextafter(time, math.inf))


def signals_of(nodes: Iterable[Node], faults: Faults) -> list[Signal]:
    """Signals from the durations of the nodes and the groups of their in-links, if any."""
    return [_signal(node, faults) for node in nodes if node.cycle_length and node.inlinks]


def _signal(node: Node, faults: Faults) -> Signal:
    for link in node.inlinks.values():
        for group in link.signal_group:
            if group >= len(node.signal):
                what = f"node {node.name} has phases 0 to {len(node.signal) - 1} only"
                place = f"signal_group of link {link.name}"
                faults.add(what, column=place, value=group)
    phases = tuple(
        Phase(duration, _links_of_group(node, group)) for group, duration in enumerate(node.signal)
    )
    return Signal(node.name, phases, offset=node.signal_offset)


def _links_of_group(node: Node, group: int) -> tuple[str, ...]:
    return tuple(name for name, link in node.inlinks.items() if group in link.signal_group)
