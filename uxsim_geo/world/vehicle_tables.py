"""What vehicles did, as the tables that UXsim's users know: its columns, our definitions."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
import pandas as pd

from uxsim_geo.analysis.groups import Groups
from uxsim_geo.analysis.network_states import trip_ends
from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.samples import Samples
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result

#: what stands in place of a link's name
WAITING, ENDED, ABORTED = "waiting_at_origin_node", "trip_end", "trip_aborted"

#: in place of a number where there is none
NOWHERE = -1.0


def log_table(
    network: Network, result: Result, passages: Passages, samples: Samples, names: list[str]
) -> pd.DataFrame:
    """One row a platoon and time step, ordered by platoon and time: UXsim's columns.

    t (s), link, x (m from the start of the link), s (m to the platoon ahead on the same link; -1:
    there is none), v (m/s). While a platoon waits at its origin, and once when its trip has ended,
    the link is named so, and x, s and v are -1. ``samples`` are of the time steps, ``names`` those
    of the platoons.
    """
    links = network.links["link_id"].astype(str).to_numpy()
    driving = pd.DataFrame(
        {
            "row": passages.vehicle[samples.row],
            "t": samples.time,
            "link": links[passages.link[samples.row]],
            "x": samples.position,
            "s": _spacings(passages, samples),
            "v": samples.speed,
        }
    )
    table = pd.concat([driving, _at_rest(result, samples.interval)], ignore_index=True)
    table = table.sort_values(["row", "t"], kind="stable", ignore_index=True)
    trips = result.trips.iloc[table["row"].to_numpy()]
    table.insert(0, "name", np.asarray(names, dtype=object)[table["row"].to_numpy()])
    table.insert(1, "dn", trips["vehicles"].to_numpy())
    table.insert(2, "orig", trips["origin"].astype(str).to_numpy())
    table.insert(3, "dest", trips["destination"].astype(str).to_numpy())
    return table.drop(columns="row").astype({"name": "str"})


def _spacings(passages: Passages, samples: Samples) -> Floats:
    """Distance to the platoon ahead, m, where that is on the same link at the moment."""
    ahead = np.maximum(samples.row - 1, 0)
    same = (samples.row > passages.first[passages.link[samples.row]]) & (
        passages.exit[ahead] > samples.time
    )
    spacing = np.full(len(samples.row), NOWHERE)
    there = passages.positions(ahead[same], samples.time[same])
    spacing[same] = there - samples.position[same]
    return spacing


def _at_rest(result: Result, step: float) -> pd.DataFrame:
    """Rows of platoons that wait at their origins, and of the first step after a trip's end."""
    trips, duration = result.trips, result.settings.duration
    steps = int(np.ceil(duration / step - 1e-9))
    ends = trip_ends(result)
    depart, enter = (trips[name].to_numpy(float) for name in ("depart_s", "enter_s"))
    until = np.fmin(np.fmin(enter, ends), duration)
    first, last = (np.ceil(times / step - 1e-9).astype(np.int64) for times in (depart, until))
    waits = np.maximum(np.minimum(last, steps) - first, 0)
    waiting = np.repeat(np.arange(len(trips)), waits)
    before = np.repeat(np.cumsum(waits) - waits - first, waits)
    over = np.flatnonzero(ends <= duration)
    at = np.ceil(ends[over] / step - 1e-9)
    over, at = over[at < steps], at[at < steps]
    aborted = (trips["status"] == "aborted").to_numpy()[over]
    return pd.DataFrame(
        {
            "row": np.concatenate((waiting, over)),
            "t": np.concatenate((np.arange(len(waiting)) - before, at)) * step,
            "link": np.concatenate(
                (np.full(len(waiting), WAITING), np.where(aborted, ABORTED, ENDED))
            ),
            "x": NOWHERE,
            "s": NOWHERE,
            "v": NOWHERE,
        }
    )


def gps_table(trajectories: pd.DataFrame, names: list[str]) -> pd.DataFrame:
    """One row a platoon and moment on a link: name, t (s), x, y (as the nodes), v (m/s).

    ``trajectories`` is what :func:`uxsim_geo.analysis.trajectories.trajectories` gives; places lie
    on the lines of the links.
    """
    return pd.DataFrame(
        {
            "name": np.asarray(names, dtype=object)[trajectories["vehicle"].to_numpy()],
            "t": trajectories["time_s"],
            "x": trajectories["x"],
            "y": trajectories["y"],
            "v": trajectories["speed"],
        }
    ).astype({"name": "str"})


def group_table(
    groups: Mapping[str, Iterable[int]], trips: pd.DataFrame, shortest: Floats
) -> pd.DataFrame:
    """One row a group of platoons: UXsim's columns, and more.

    ``groups`` gives rows of the trips by the group's name, ``trips`` is what
    :func:`uxsim_geo.analysis.trips.trip_summary` gives, ``shortest`` the shortest distance of each
    of them, m. total_trips and completed_trips count platoons, as there; total_vehicles and
    completed_vehicles what drives in them. Means and deviations weigh platoons by their vehicles,
    and are of those that arrived: average_travel_time (s), delay ratio (travel time over that at
    free flow), average_traveled_distance (m), detour ratio (distance over the shortest), speed
    (m/s). average_delay_of_all (s) is of all that have departed, the unfinished up to now.
    """
    members = {name: np.fromiter(rows, np.int64) for name, rows in groups.items()}
    number = np.repeat(np.arange(len(members)), [len(rows) for rows in members.values()])
    row = np.concatenate([*members.values(), np.empty(0, np.int64)])
    own = trips.iloc[row]
    weight = own["vehicles"].to_numpy(float)
    done = weight * (own["status"] == "completed").to_numpy()
    begun = weight * own["travel_time_so_far_s"].notna().to_numpy()
    time, distance = (own[name].to_numpy(float) for name in ("travel_time_so_far_s", "distance_m"))
    with np.errstate(invalid="ignore", divide="ignore"):
        ratios = {
            "delay_ratio": time / own["free_time_s"].to_numpy(float),
            "detour_ratio": distance / shortest[row],
            "speed": distance / time,
        }
    by_group = Groups((np.arange(len(members)),), number)
    return pd.DataFrame(
        {
            "group": list(members),
            "total_trips": _count(by_group, weight),
            "completed_trips": _count(by_group, done),
            "average_travel_time": by_group.mean(time, done),
            "average_delay_ratio": by_group.mean(ratios["delay_ratio"], done),
            "std_delay_ratio": by_group.deviation(ratios["delay_ratio"], done),
            "average_traveled_distance": by_group.mean(distance, done),
            "average_detour_ratio": by_group.mean(ratios["detour_ratio"], done),
            "std_detour_ratio": by_group.deviation(ratios["detour_ratio"], done),
            "average_speed": by_group.mean(ratios["speed"], done),
            "std_speed": by_group.deviation(ratios["speed"], done),
            "total_vehicles": by_group.total(weight),
            "completed_vehicles": by_group.total(done),
            "average_delay_of_all": by_group.mean(own["delay_so_far_s"].to_numpy(float), begun),
        }
    )


def _count(groups: Groups, weight: Floats) -> Integers:
    """Platoons of each group that have a weight."""
    return groups.total((weight > 0).astype(float)).astype(np.int64)
