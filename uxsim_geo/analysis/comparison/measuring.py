"""From a finished run to what it is compared by."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.analysis.areas import Areas, zone_areas
from uxsim_geo.analysis.comparison.corridors import Corridors, corridor_times
from uxsim_geo.analysis.comparison.measured import Measured
from uxsim_geo.analysis.comparison.quantities import (
    LINK_TIMES,
    LINKS,
    TOTALS,
    TRIPS,
    Quantity,
)
from uxsim_geo.analysis.comparison.zones import ENDS, check_zones, zone_pairs
from uxsim_geo.analysis.link_states import link_times, link_totals
from uxsim_geo.analysis.od import od_table
from uxsim_geo.analysis.summary import summary
from uxsim_geo.analysis.trips import trip_summary
from uxsim_geo.network.network import REQUIRED_LINK_COLUMNS, Network
from uxsim_geo.network.units import KMH, PER_HOUR
from uxsim_geo.result import Result

HOUR = 3600.0

#: columns of a run's tables, as the analysis names them, by the name of the quantity and factor
_LINKS = {
    "volume_veh": ("volume", 1.0),
    "time_veh_h": ("time", 1 / HOUR),
    "delay_veh_h": ("delay", 1 / HOUR),
    "speed_kmh": ("speed", KMH),
    "experienced_travel_time_s": ("experienced_travel_time", 1.0),
    "queue_m": ("queue_length", 1.0),
    "flow_vph": ("flow", PER_HOUR),
}
_TRIPS = {
    "demanded_veh": ("vehicles_demanded", 1.0),
    "departed_veh": ("vehicles_departed", 1.0),
    "completed_veh": ("vehicles_completed", 1.0),
    "unfinished_veh": ("vehicles_unfinished", 1.0),
    "travel_time_s": ("travel_time_so_far_s", 1.0),
    "delay_s": ("delay_so_far_s", 1.0),
    "delay_veh_h": ("total_delay_so_far_veh_s", 1 / HOUR),
}


@dataclass(frozen=True)
class MeasureOptions:
    """How a run is measured; runs that are compared must be measured alike.

    bin_s
        length of the time bins, s
    corridors
        name → link_ids in the order in which they are driven; a network that lacks one of them
        does not have the corridor
    zones
        name → node_ids; None: the zones of the network
    """

    bin_s: float = 300.0
    corridors: Corridors = field(default_factory=dict)
    zones: Areas | None = None


def measure(result: Result, network: Network, options: MeasureOptions) -> Measured:
    """Figures and tables of a run, by which it is compared with others.

    Raises :class:`uxsim_geo.errors.InputError` for wrong bins, zones that are empty or name unknown
    nodes, or a result of another network.
    """
    states = link_times(result, network, bin_s=options.bin_s)
    zones = zone_areas(network) if options.zones is None else options.zones
    trips = trip_summary(result, network)
    check_zones(zones, network)
    od = _columns(od_table(result, network), ENDS, TRIPS, _TRIPS)
    return Measured(
        seed=result.settings.seed,
        duration_s=float(result.settings.duration),
        bin_s=float(options.bin_s),
        totals=_totals(summary(result, network), trips, result.settings.duration),
        links=_links(network, states),
        link_times=_columns(states, ("link_id", "begin_s", "end_s"), LINK_TIMES, _LINKS),
        od=od,
        zone_pairs=zone_pairs(od, zones),
        corridors=corridor_times(result, network, options.corridors, states),
        trips=_each_trip(trips, zones, result.settings.duration),
    )


def _totals(figures: Mapping[str, Any], trips: pd.DataFrame, duration: float) -> pd.DataFrame:
    """The figures of the run, in people's units; ``figures`` are those of its summary."""
    departed = trips[trips["depart_s"] <= duration]
    wait = float((departed["vehicles"] * departed["origin_wait_s"]).sum())
    completed, speed = figures["completed"], figures["average_speed_m_s"]
    values = {
        name: figures[name]
        for name in (
            "vehicles_demanded",
            "vehicles_departed",
            "vehicles_completed",
            "vehicles_waiting",
            "vehicles_aborted",
            "gridlocked",
        )
    }
    values |= {
        "vehicles_unfinished": figures["vehicles_running"] + figures["vehicles_waiting"],
        "total_travel_time_veh_h": figures["total_travel_time_veh_s"] / HOUR,
        "total_origin_wait_veh_h": wait / HOUR,
        "total_delay_veh_h": figures["total_delay_veh_s"] / HOUR,
        "completed_average_travel_time_s": completed["average_travel_time_s"],
        "completed_average_delay_s": completed["average_delay_s"],
        "total_distance_veh_km": figures["total_distance_veh_m"] / 1000,
        "average_speed_kmh": None if speed is None else speed * KMH,
        "total_toll": float((departed["vehicles"] * departed["toll"]).sum()),
    }
    names = [quantity.name for quantity in TOTALS]
    numbers = [np.nan if values[name] is None else float(values[name]) for name in names]
    return pd.DataFrame({"figure": pd.Series(names, dtype="str"), "value": numbers})


def _links(network: Network, states: pd.DataFrame) -> pd.DataFrame:
    """What every link is, and what happened on it in the whole run."""
    attributes = network.links[list(REQUIRED_LINK_COLUMNS)].reset_index(drop=True)
    texts = ["link_id", "from_node_id", "to_node_id"]
    figures = _columns(link_totals(states), ("link_id",), LINKS, _LINKS)
    numbers = attributes.drop(columns=texts).astype(float)
    return pd.concat(
        (attributes[texts].astype("str"), numbers, figures.drop(columns="link_id")), axis=1
    )


def _columns(
    table: pd.DataFrame,
    keys: tuple[str, ...],
    quantities: tuple[Quantity, ...],
    names: Mapping[str, tuple[str, float]],
) -> pd.DataFrame:
    """Keys and quantities of a table of the analysis, in people's units and by their names."""
    columns: dict[str, Any] = {
        key: table[key] if key.endswith("_s") else table[key].astype("str") for key in keys
    }
    for quantity in quantities:
        name, factor = names[quantity.name]
        columns[quantity.name] = table[name].to_numpy(float) * factor
    return pd.DataFrame(columns)


def _each_trip(trips: pd.DataFrame, zones: Areas, duration: float) -> pd.DataFrame:
    """What became of every platoon, with what it is known by in other runs."""
    status = trips["status"].astype("str").mask(trips["depart_s"] > duration, "not_departed")
    first_zone: dict[str, str] = {}
    for zone, nodes in zones.items():
        for node in nodes:
            first_zone.setdefault(node, zone)
    columns: dict[str, Any] = {
        name: trips[name].astype("str") for name in ("origin", "destination", "class")
    }
    columns |= {
        "number": trips["number"].astype(np.int64),
        "vehicles": trips["vehicles"].astype(float),
        "status": status,
        "depart_s": trips["depart_s"].astype(float),
        "travel_time_s": trips["travel_time_so_far_s"].astype(float),
        "delay_s": trips["delay_so_far_s"].astype(float),
    }
    for end in ENDS:
        columns[f"{end}_zone"] = columns[end].map(first_zone).astype("str")
    return pd.DataFrame(columns)
