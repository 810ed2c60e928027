"""What the engine has recorded, as tables."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.demand.platoons import Floats, Ints, Platoons, weighted_counts
from uxsim_geo.engine.records import World

STATUS = ("waiting", "running", "completed", "aborted")

Records = npt.NDArray[Any]


def event_table(events: Records, row_of_link: Ints, link_ids: pd.Index[str]) -> pd.DataFrame:
    """Give the events; links are categories in the order of the links table."""
    return pd.DataFrame(
        {
            "vehicle": events["trip"],
            "link": pd.Categorical.from_codes(row_of_link[events["link"]], categories=link_ids),
            "enter_s": events["enter"],
            "exit_s": events["exit"],
        }
    )


def trip_table(world: World, platoons: Platoons, events: Records, toll: Floats) -> pd.DataFrame:
    """Give the trips, a row a platoon; ``toll`` is what each of its vehicles has paid."""
    trip = world.log.trip
    nodes = pd.Index(platoons.node_ids)
    classes = pd.Index(platoons.class_names)
    status = pd.Categorical.from_codes(trip["status"], categories=pd.Index(STATUS))
    done = events[~np.isnan(events["exit"])]
    metres = world.routes.road["length"][done["link"]]
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
            "distance_m": trip["covered"] + weighted_counts(done["trip"], metres, trip.size),
            "free_time_s": np.where(np.isinf(trip["free_time"]), np.nan, trip["free_time"]),
            "toll": toll,
        }
    )


def tolls_paid(
    events: Records,
    trips: int,
    row_of_link: Ints,
    changes: list[tuple[float, npt.NDArray[np.float64]]],
) -> Floats:
    """Sum what every trip has paid on entering links, by the tolls in force at those times."""
    if not changes:
        return np.zeros(trips)
    times = np.array([time for time, _ in changes])
    tolls = np.stack([toll for _, toll in changes])
    change = np.searchsorted(times, events["enter"], side="right") - 1
    amount = np.where(change >= 0, tolls[change, row_of_link[events["link"]]], 0.0)
    return weighted_counts(events["trip"], amount, trips)


def limit_table(
    changes: list[tuple[float, npt.NDArray[np.float64]]],
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
