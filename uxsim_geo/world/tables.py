"""Results as the tables that UXsim's users know: its columns, our definitions.

A platoon counts by its vehicles, which are whole ones. A mean over nobody is NaN.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.analysis.cumulative import curves_at
from uxsim_geo.analysis.edie import ratio
from uxsim_geo.analysis.groups import Groups
from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.state_grid import StateGrid
from uxsim_geo.analysis.types import Floats
from uxsim_geo.network.network import Network
from uxsim_geo.network.paths import Paths
from uxsim_geo.result import Result
from uxsim_geo.world.vehicles import STATES

#: of a link: columns of :func:`uxsim_geo.analysis.cumulative.cumulative_curves`
CURVES = ("entries", "virtual_departures", "exits", "queue")


def basic_table(figures: dict[str, Any]) -> pd.DataFrame:
    """One row of what :func:`uxsim_geo.analysis.summary.summary` gives: UXsim's columns, and more.

    ``total_travel_time``, ``total_delay`` (veh·s), ``average_travel_time`` and ``average_delay``
    (s) are of those that have arrived, as there. Of all that have departed, the unfinished up to
    now: ``total_travel_time_of_all``, ``total_delay_of_all`` and ``average_delay_of_all``.
    """
    departed, completed = figures["vehicles_departed"], figures["completed"]
    arrived = figures["vehicles_completed"]
    time, delay = (
        np.nan if completed[name] is None else completed[name]
        for name in ("average_travel_time_s", "average_delay_s")
    )
    return pd.DataFrame(
        {
            "total_trips": [int(departed)],
            "completed_trips": [int(arrived)],
            "total_travel_time": [time * arrived],
            "average_travel_time": [time],
            "total_delay": [delay * arrived],
            "average_delay": [delay],
            "total_travel_time_of_all": [figures["total_travel_time_veh_s"]],
            "total_delay_of_all": [figures["total_delay_veh_s"]],
            "average_delay_of_all": [
                figures["total_delay_veh_s"] / departed if departed else np.nan
            ],
        }
    )


def trip_table(trips: pd.DataFrame, names: list[str]) -> pd.DataFrame:
    """One row a platoon: UXsim's columns, and more.

    ``trips`` is what :func:`uxsim_geo.analysis.trips.trip_summary` gives, ``names`` are those of
    the platoons. ``final_state`` is home, wait, run, end or abort; ``travel_time`` (s) is NaN until
    it has arrived, ``average_speed`` (m/s) that of the trip. Of all that have departed:
    ``travel_time_so_far`` and ``delay_so_far`` (s).
    """
    arrived = (trips["status"] == "completed").to_numpy()
    so_far = trips["travel_time_so_far_s"].to_numpy(float)
    travel_time = np.where(arrived, so_far, np.nan)
    state = trips["status"].astype(str).map(STATES).where(~np.isnan(so_far), "home")
    return pd.DataFrame(
        {
            "name": names,
            "dn": trips["vehicles"],
            "orig": trips["origin"].astype(str),
            "dest": trips["destination"].astype(str),
            "departure_time": trips["depart_s"],
            "final_state": state.astype(str),
            "travel_time": travel_time,
            "average_speed": trips["distance_m"].to_numpy(float) / travel_time,
            "distance_traveled": trips["distance_m"],
            "travel_time_so_far": so_far,
            "delay_so_far": trips["delay_so_far_s"],
        }
    )


def od_table(network: Network, trips: pd.DataFrame, duration: float) -> pd.DataFrame:
    """One row a pair of origin and destination, in the order of the nodes: UXsim's columns.

    ``trips`` is what :func:`uxsim_geo.analysis.trips.trip_summary` gives. Trips are vehicles that
    have departed by ``duration``, s; times (s) and distances (m) are of those that arrived.
    ``average_delay_of_all`` (s) is of all of them, the unfinished up to now.
    """
    trips = trips[trips["depart_s"] <= duration]
    ids = pd.Index(network.nodes["node_id"].astype(str))
    ends = [
        ids.get_indexer(pd.Index(trips[name].astype(str))) for name in ("origin", "destination")
    ]
    groups = Groups.of(*(end.astype(np.int64) for end in ends))
    vehicles = trips["vehicles"].to_numpy(float)
    done = vehicles * (trips["status"] == "completed").to_numpy()
    time, distance, delay, free = (
        trips[name].to_numpy(float)
        for name in ("travel_time_so_far_s", "distance_m", "delay_so_far_s", "free_time_s")
    )
    origin, destination = groups.keys
    starts, row = np.unique(origin, return_inverse=True)
    shortest = shortest_distances(network, ids[starts].to_numpy())
    return pd.DataFrame(
        {
            "orig": ids[origin],
            "dest": ids[destination],
            "total_trips": groups.total(vehicles).astype(np.int64),
            "completed_trips": groups.total(done).astype(np.int64),
            "free_travel_time": groups.mean(free, vehicles),
            "average_travel_time": groups.mean(time, done),
            "stddiv_travel_time": groups.deviation(time, done),
            "shortest_distance": shortest.to_numpy()[row, destination],
            "average_distance_traveled_per_veh": groups.mean(distance, done),
            "stddiv_distance_traveled_per_veh": groups.deviation(distance, done),
            "average_delay_of_all": groups.mean(delay, vehicles),
        }
    )


def link_table(network: Network, result: Result, totals: pd.DataFrame) -> pd.DataFrame:
    """One row a link, in the order of the table: UXsim's columns, and more.

    ``traffic_volume`` are the vehicles that have left it, ``vehicles_remain`` those on it; times
    (s) are of those that have left; ``delay_ratio`` is mean over free travel time. ``totals`` is
    what :func:`uxsim_geo.analysis.link_states.link_totals` gives: ``total_travel_time_of_all`` and
    ``total_delay_of_all`` (veh·s) count those on the link too.
    """
    links, events = network.links, result.events
    vehicles = result.trips["vehicles"].to_numpy(float)[events["vehicle"]]
    time = (events["exit_s"] - events["enter_s"]).to_numpy(float)
    left = np.where(np.isnan(time), 0.0, vehicles)
    place = events["link"].cat.codes.to_numpy()

    def total(values: Floats) -> Floats:
        return np.bincount(place, values, minlength=len(links)).astype(np.float64)

    time = np.nan_to_num(time)
    mean = ratio(total(left * time), total(left))
    variance = ratio(total(left * (time - mean[place]) ** 2), total(left))
    free = (links["length"] / links["free_speed"]).to_numpy(float)
    return pd.DataFrame(
        {
            "link": links["link_id"].to_numpy(),
            "start_node": links["from_node_id"].to_numpy(),
            "end_node": links["to_node_id"].to_numpy(),
            "traffic_volume": total(left).astype(np.int64),
            "vehicles_remain": total(vehicles - left).astype(np.int64),
            "free_travel_time": free,
            "average_travel_time": mean,
            "stddiv_travel_time": np.sqrt(variance),
            "delay_ratio": mean / free,
            "length": links["length"].to_numpy(float),
            "total_travel_time_of_all": totals["time"],
            "total_delay_of_all": totals["delay"],
        }
    )


def mfd_table(states: pd.DataFrame) -> pd.DataFrame:
    """Density (veh/m per lane) and flow (veh/s per lane) of the network by time bin.

    ``states`` is what :func:`uxsim_geo.analysis.network_states.network_states` gives.
    """
    return pd.DataFrame(
        {"t": states["begin_s"], "network_k": states["density"], "network_q": states["flow"]}
    )


def shortest_distances(network: Network, origins: npt.NDArray[np.str_]) -> pd.DataFrame:
    """Shortest distance over the links from some nodes to all, m; inf where there is no way."""
    ids = pd.Index(network.nodes["node_id"])
    rows = ids.get_indexer(pd.Index(origins))
    distances = Paths.of(network).shortest(network.links["length"], rows)
    return pd.DataFrame(distances, index=pd.Index(origins), columns=ids)


def cell_table(cells: pd.DataFrame) -> pd.DataFrame:
    """One row a cell: UXsim's columns; v (m/s) is NaN where nobody was.

    ``cells`` is what :func:`uxsim_geo.analysis.cells.space_time_cells` gives. t (s) and x (m) are
    where a cell begins, delta_t and delta_x how large it is; q in veh/s, k in veh/m.
    """
    return pd.DataFrame(
        {
            "link": cells["link_id"].astype(str),
            "t": cells["begin_s"],
            "x": cells["begin_m"],
            "delta_t": cells["end_s"] - cells["begin_s"],
            "delta_x": cells["end_m"] - cells["begin_m"],
            "q": cells["flow"],
            "k": cells["density"],
            "v": cells["speed"],
        }
    )


def cumulative_table(passages: Passages, steps: pd.DataFrame) -> pd.DataFrame:
    """One row a link and time step, as it begins: UXsim's columns, and more.

    ``steps`` is what :func:`uxsim_geo.analysis.link_states.link_times` gives with steps as bins, of
    all links. ``arrival_count`` and ``departure_count`` are vehicles that have entered and left up
    to then, ``actual_travel_time`` (s) what those took that entered last before and have left,
    ``instantanious_travel_time`` length over the mean speed in the step, free-flow time where there
    is nobody. ``virtual_departure_count`` and ``queue`` are as of
    :func:`uxsim_geo.analysis.cumulative.cumulative_curves`.
    """
    grid = StateGrid.of(steps)
    shape = len(grid.link_ids), len(grid.begin)
    curves = {name: np.empty(shape) for name in (*CURVES, "actual_travel_time")}
    for link in range(len(grid.link_ids)):
        found = curves_at(passages, link, grid.begin)
        for name in CURVES:
            curves[name][link] = found[name]
        curves["actual_travel_time"][link] = _last_travel_times(passages, link, grid.begin)
    table = {name: values.ravel() for name, values in curves.items()}
    return pd.DataFrame(
        {
            "link": np.repeat(grid.link_ids.to_numpy(), shape[1]),
            "t": np.tile(grid.begin, shape[0]),
            "arrival_count": table["entries"].astype(np.int64),
            "departure_count": table["exits"].astype(np.int64),
            "actual_travel_time": table["actual_travel_time"],
            "instantanious_travel_time": steps["instantaneous_travel_time"].to_numpy(),
            "virtual_departure_count": table["virtual_departures"].astype(np.int64),
            "queue": table["queue"].astype(np.int64),
        }
    )


def _last_travel_times(passages: Passages, link: int, times: Floats) -> Floats:
    """Time on the link of those who have left it and entered last up to each moment, s."""
    own = slice(passages.first[link], passages.first[link + 1])
    enter, leave = passages.enter[own], passages.exit[own]
    done = np.isfinite(leave)
    free = passages.geometry.length[link] / passages.geometry.free_speed[link]
    taken = np.concatenate(([free], (leave - enter)[done]))
    last: Floats = taken[np.searchsorted(enter[done], times, side="right")]
    return last
