"""Figures of areas, sets of nodes, as the tables that UXsim's users know: its columns, and more."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from uxsim_geo.analysis.areas import links_of_nodes
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result

Areas = Mapping[str, Sequence[str]]

PAIR_COLUMNS = (
    "origin_area",
    "destination_area",
    "total_trips",
    "completed_trips",
    "average_travel_time",
    "average_free_travel_time",
    "average_distance_traveled",
    "average_shortest_distance",
    "average_delay_of_all",
)


def area_table(
    network: Network, result: Result, links: pd.DataFrame, areas: Areas, *, border: bool
) -> pd.DataFrame:
    """One row an area: UXsim's columns, and more.

    ``links`` is what :func:`uxsim_geo.world.tables.link_table` gives, ``areas`` are node_ids by
    name; ``border`` says whether links with one end outside belong to them. traffic_volume are the
    vehicles that have entered a link of the area, once each; vehicles_remain those on its links.
    total_travel_time (veh·s) is of those that have left its links, average_delay what they took
    over free flow, less 1; average_speed (m/s) theirs; vehicle_density traffic_volume over the
    length of the links, veh/m. total_travel_time_of_all and total_delay_of_all (veh·s) count those
    on the links too.
    """
    vehicles = result.trips["vehicles"].to_numpy(float)
    rows = []
    for name, link_ids in links_of_nodes(network, areas, border=border).items():
        own = links[links["link"].astype(str).isin(link_ids)]
        here = result.events["link"].isin(link_ids).to_numpy()
        seen = np.unique(result.events["vehicle"].to_numpy()[here])
        left = own["traffic_volume"].to_numpy(float)
        time = float(np.nansum(left * own["average_travel_time"].to_numpy(float)))
        free = float((left * own["free_travel_time"].to_numpy(float)).sum())
        length, volume = float(own["length"].sum()), int(vehicles[seen].sum())
        rows.append(
            {
                "area": name,
                "n_links": len(own),
                "traffic_volume": volume,
                "vehicles_remain": own["vehicles_remain"].sum(),
                "total_travel_time": time,
                "average_delay": max(time / free - 1, 0.0) if free else np.nan,
                "average_speed": float((left * own["length"]).sum()) / time if time else np.nan,
                "vehicle_density": volume / length if length else np.nan,
                "total_travel_time_of_all": own["total_travel_time_of_all"].sum(),
                "total_delay_of_all": own["total_delay_of_all"].sum(),
            }
        )
    return pd.DataFrame(rows)


def area_pair_table(pairs: pd.DataFrame, areas: Areas) -> pd.DataFrame:
    """One row a pair of areas that has trips, in the order given: UXsim's columns, and more.

    ``pairs`` is what :func:`uxsim_geo.world.tables.od_table` gives. Times (s) and the distance
    driven (m) are means of those that arrived; the free travel time and the shortest distance are
    of all, and so is average_delay_of_all (s), the unfinished up to now.
    """
    rows = []
    for origin, starts in areas.items():
        for destination, ends in areas.items():
            own = pairs[pairs["orig"].isin(starts) & pairs["dest"].isin(ends)]
            if len(own):
                rows.append(_pair_row(own, origin, destination))
    return pd.DataFrame(rows, columns=list(PAIR_COLUMNS))


def _pair_row(own: pd.DataFrame, origin: str, destination: str) -> dict[str, object]:
    def mean(column: str, by: str) -> float:
        weight = own[by].to_numpy(float)
        counted = weight > 0
        if not counted.any():
            return np.nan
        values = own[column].to_numpy(float)[counted]
        return float(np.average(values, weights=weight[counted]))

    return {
        "origin_area": origin,
        "destination_area": destination,
        "total_trips": own["total_trips"].sum(),
        "completed_trips": own["completed_trips"].sum(),
        "average_travel_time": mean("average_travel_time", "completed_trips"),
        "average_free_travel_time": mean("free_travel_time", "total_trips"),
        "average_distance_traveled": mean("average_distance_traveled_per_veh", "completed_trips"),
        "average_shortest_distance": mean("shortest_distance", "total_trips"),
        "average_delay_of_all": mean("average_delay_of_all", "total_trips"),
    }
