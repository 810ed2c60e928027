"""Results as the tables that UXsim's users know: its columns, our definitions.

A platoon counts by its vehicles. A mean over nobody is NaN.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.analysis.network_states import trip_ends
from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.samples import Cells, Samples
from uxsim_geo.network.network import Network
from uxsim_geo.network.paths import Paths
from uxsim_geo.result import Result

Floats = npt.NDArray[np.float64]


def basic_table(figures: dict[str, Any]) -> pd.DataFrame:
    """One row of what :func:`uxsim_geo.analysis.summary.summary` gives.

    ``total_travel_time`` and ``total_delay`` (veh·s) count every vehicle that has departed, the
    unfinished up to now; ``average_travel_time`` and ``average_delay`` (s) those that arrived;
    ``average_delay_of_all`` is total_delay over all that have departed.
    """
    departed = figures["vehicles_departed"]
    completed = figures["completed"]
    return pd.DataFrame(
        {
            "total_trips": [departed],
            "completed_trips": [figures["vehicles_completed"]],
            "total_travel_time": [figures["total_travel_time_veh_s"]],
            "average_travel_time": [completed["average_travel_time_s"]],
            "total_delay": [figures["total_delay_veh_s"]],
            "average_delay": [completed["average_delay_s"]],
            "average_delay_of_all": [
                figures["total_delay_veh_s"] / departed if departed else np.nan
            ],
        }
    ).astype({"average_travel_time": float, "average_delay": float})


def trip_table(result: Result) -> pd.DataFrame:
    """One row a platoon: its ends, departure (s), state, travel time (s), speed and distance (m).

    ``travel_time`` is NaN until it has arrived; ``average_speed`` (m/s) is that of the trip.
    """
    trips = result.trips
    arrived = (trips["status"] == "completed").to_numpy()
    times = trip_ends(result.events, trips) - trips["depart_s"].to_numpy(float)
    travel_time = np.where(arrived, times, np.nan)
    return pd.DataFrame(
        {
            "name": trips["vehicle"].astype(str),
            "dn": trips["vehicles"],
            "orig": trips["origin"].astype(str),
            "dest": trips["destination"].astype(str),
            "departure_time": trips["depart_s"],
            "final_state": trips["status"].astype(str),
            "travel_time": travel_time,
            "average_speed": trips["distance_m"].to_numpy(float) / travel_time,
            "distance_traveled": trips["distance_m"],
        }
    )


def od_table(network: Network, result: Result) -> pd.DataFrame:
    """One row a pair of origin and destination, in the order of the nodes: UXsim's columns.

    Trips are vehicles that have departed; times (s) and distances (m) are of those that arrived.
    """
    trips = result.trips[result.trips["depart_s"] <= result.settings.duration].copy()
    done = trips["status"] == "completed"
    trips["travel_time"] = (trips["arrive_s"] - trips["depart_s"]).where(done)
    trips["distance"] = trips["distance_m"].where(done)
    trips["vehicles_done"] = trips["vehicles"].where(done, 0)
    shortest = _shortest_distances(network, trips["origin"].unique().astype(str))
    rows = []
    for (origin, destination), own in trips.groupby(["origin", "destination"], observed=True):
        mean_time, deviation = weighted_mean(own["travel_time"], own["vehicles_done"])
        mean_distance, distance_deviation = weighted_mean(own["distance"], own["vehicles_done"])
        rows.append(
            {
                "orig": origin,
                "dest": destination,
                "total_trips": own["vehicles"].sum(),
                "completed_trips": own["vehicles_done"].sum(),
                "free_travel_time": own["free_time_s"].iloc[0],
                "average_travel_time": mean_time,
                "stddiv_travel_time": deviation,
                "shortest_distance": shortest.loc[str(origin), str(destination)],
                "average_distance_traveled_per_veh": mean_distance,
                "stddiv_distance_traveled_per_veh": distance_deviation,
            }
        )
    return pd.DataFrame(rows)


def link_table(network: Network, result: Result) -> pd.DataFrame:
    """One row a link, in the order of the table: UXsim's columns.

    ``traffic_volume`` are the vehicles that have left it, ``vehicles_remain`` those on it; times
    (s) are of those that have left; ``delay_ratio`` is mean over free travel time.
    """
    links = network.links
    vehicles = result.trips["vehicles"].to_numpy(float)
    events = result.events.assign(
        vehicles=vehicles[result.events["vehicle"]],
        time=result.events["exit_s"] - result.events["enter_s"],
    )
    left = events["exit_s"].notna()
    place = events["link"].cat.codes.to_numpy()
    size = len(links)

    def total(values: npt.ArrayLike) -> Floats:
        return np.bincount(place, np.asarray(values, float), minlength=size).astype(np.float64)

    volume = total(events["vehicles"].where(left, 0.0))
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = total((events["vehicles"] * events["time"]).where(left, 0.0)) / volume
        apart = events["time"].to_numpy(float) - mean[place]
        variance = total((events["vehicles"] * apart**2).where(left, 0.0)) / volume
    free = (links["length"] / links["free_speed"]).to_numpy(float)
    return pd.DataFrame(
        {
            "link": links["link_id"].to_numpy(),
            "start_node": links["from_node_id"].to_numpy(),
            "end_node": links["to_node_id"].to_numpy(),
            "traffic_volume": volume,
            "vehicles_remain": total(events["vehicles"].where(~left, 0.0)),
            "free_travel_time": free,
            "average_travel_time": mean,
            "stddiv_travel_time": np.sqrt(variance),
            "delay_ratio": mean / free,
            "length": links["length"].to_numpy(float),
        }
    )


def mfd_table(states: pd.DataFrame) -> pd.DataFrame:
    """Density (veh/m per lane) and flow (veh/s per lane) of the network by time bin.

    ``states`` is what :func:`uxsim_geo.analysis.network_states.network_states` gives.
    """
    return pd.DataFrame(
        {"t": states["begin_s"], "network_k": states["density"], "network_q": states["flow"]}
    )


def weighted_mean(values: pd.Series, weights: pd.Series) -> tuple[float, float]:
    """Mean and standard deviation of values, each counted by its weight; NaN for nobody."""
    number, weight = values.to_numpy(float), weights.to_numpy(float)
    number, weight = number[weight > 0], weight[weight > 0]
    if not weight.size:
        return np.nan, np.nan
    mean = float(np.average(number, weights=weight))
    return mean, float(np.sqrt(np.average((number - mean) ** 2, weights=weight)))


def _shortest_distances(network: Network, origins: npt.NDArray[np.str_]) -> pd.DataFrame:
    """Shortest distance over the links from some nodes to all, m; inf where there is no way."""
    ids = pd.Index(network.nodes["node_id"])
    rows = ids.get_indexer(pd.Index(origins))
    distances = Paths.of(network).shortest(network.links["length"], rows)
    return pd.DataFrame(distances, index=pd.Index(origins), columns=ids)


def sample_table(
    network: Network, result: Result, passages: Passages, samples: Samples
) -> pd.DataFrame:
    """One row a platoon and moment on a link, ordered by platoon and time: UXsim's columns.

    t (s), link, x (m from the start of the link), v (m/s).
    """
    vehicle = passages.vehicle[samples.row]
    trips = result.trips.iloc[vehicle]
    table = pd.DataFrame(
        {
            "name": vehicle,
            "dn": trips["vehicles"].to_numpy(),
            "orig": trips["origin"].astype(str).to_numpy(),
            "dest": trips["destination"].astype(str).to_numpy(),
            "t": samples.time,
            "link": network.links["link_id"].to_numpy()[passages.link[samples.row]],
            "x": samples.position,
            "v": samples.speed,
        }
    )
    table = table.sort_values(["name", "t"], kind="stable", ignore_index=True)
    return table.astype({"name": "str"})


def cell_table(link_id: str, cells: Cells) -> pd.DataFrame:
    """One row a cell of a link: UXsim's columns; v is NaN where nobody was."""
    times, places = np.meshgrid(cells.time[:-1], cells.place[:-1], indexing="ij")
    durations, lengths = np.meshgrid(np.diff(cells.time), np.diff(cells.place), indexing="ij")
    return pd.DataFrame(
        {
            "link": link_id,
            "t": times.ravel(),
            "x": places.ravel(),
            "delta_t": durations.ravel(),
            "delta_x": lengths.ravel(),
            "q": (cells.density * np.nan_to_num(cells.speed)).ravel(),
            "k": cells.density.ravel(),
            "v": cells.speed.ravel(),
        }
    )
