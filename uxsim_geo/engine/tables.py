"""What the engine has recorded, as tables."""

from __future__ import annotations

import numpy as np
import pandas as pd

from uxsim_geo.demand.platoons import Floats, Platoons
from uxsim_geo.engine.records import World
from uxsim_geo.events import EventLog

STATUS = ("waiting", "running", "completed", "aborted")


def trip_table(world: World, platoons: Platoons, driven: Floats, toll: Floats) -> pd.DataFrame:
    """Give the trips, a row a platoon, from the metres driven on links left and the tolls paid."""
    trip = world.log.trip
    nodes = pd.Index(platoons.node_ids)
    classes = pd.Index(platoons.class_names)
    status = pd.Categorical.from_codes(trip["status"], categories=pd.Index(STATUS))
    return pd.DataFrame(
        {
            "vehicle": np.arange(trip.size, dtype=np.int32),
            "origin": pd.Categorical.from_codes(platoons.origin, categories=nodes),
            "destination": pd.Categorical.from_codes(platoons.destination, categories=nodes),
            "class": pd.Categorical.from_codes(platoons.driver_class, categories=classes),
            "number": platoons.number.astype(np.int32),
            "depart_s": trip["depart"],
            "enter_s": trip["enter"],
            "arrive_s": trip["arrive"],
            "status": status,
            "vehicles": platoons.vehicles.astype(np.int32),
            "distance_m": trip["covered"] + driven,
            "free_time_s": np.where(np.isinf(trip["free_time"]), np.nan, trip["free_time"]),
            "toll": toll,
        }
    )


def metres_driven(log: EventLog, length: Floats, trips: int) -> Floats:
    """Sum the lengths, m, of the links that every trip has left; shape (trips,)."""
    driven = np.zeros(trips)
    for piece in log.pieces("vehicle", "link", "exit_s"):
        left = ~np.isnan(piece["exit_s"])
        np.add.at(driven, piece["vehicle"][left], length[piece["link"][left]])
    return driven


def tolls_paid(log: EventLog, changes: list[tuple[float, Floats]], trips: int) -> Floats:
    """Sum what every trip has paid on entering links, by the tolls in force at those times."""
    paid = np.zeros(trips)
    if not changes:
        return paid
    times = np.array([time for time, _ in changes])
    tolls = np.stack([toll for _, toll in changes])
    for piece in log.pieces("vehicle", "link", "enter_s"):
        change = np.searchsorted(times, piece["enter_s"], side="right") - 1
        amount = np.where(change >= 0, tolls[change, piece["link"]], 0.0)
        np.add.at(paid, piece["vehicle"], amount)
    return paid


def limit_table(
    changes: list[tuple[float, Floats]],
    free_speed: Floats,
    link_ids: pd.Index[str],
) -> pd.DataFrame:
    """Give the speed limits that were put on links, each from when on."""
    before, rows = free_speed, []
    for time, limits in changes:
        changed = np.flatnonzero(limits != before)
        rows.append(
            pd.DataFrame(
                {
                    "time_s": np.full(changed.size, time),
                    "link": pd.Categorical.from_codes(changed, categories=link_ids),
                    "speed_limit_m_s": limits[changed],
                }
            )
        )
        before = limits
    return pd.concat(rows, ignore_index=True) if rows else pd.DataFrame()
