"""Who gains and who loses: every platoon is known in both runs by its identity.

A platoon is known by its origin, destination, class and number within those. Its change is the
travel time in the scenario less that in the base, from the wish to depart to the arrival. It gains
or loses if that is more than a threshold in seconds and more than a share of its time in the base.

Of those who had not arrived at the end of one run, only a bound is known: who arrived in the base
alone took at least so long in the scenario, and loses if even that is beyond the threshold. Where
the bound does not decide, and where neither run saw the end of the trip, it is undetermined. Who
found no way in one run alone loses or gains a whole trip.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd

from uxsim_geo.analysis.types import Booleans, Floats

IDENTITY = ("origin", "destination", "class", "number")

OUTCOMES = ("gains", "loses", "little_change", "undetermined", "base_only", "scenario_only")

ABSENT = "absent"

_GAIN = (np.inf, 1800.0, 900.0, 600.0, 300.0, 120.0, 60.0, 30.0, 10.0)
#: edges of the classes of changes, s
EDGES = (*(-edge for edge in _GAIN), *reversed(_GAIN))


class Threshold(NamedTuple):
    """What somebody notices: a change beyond both, s and share of the time in the base."""

    seconds: float = 30.0
    share: float = 0.05


#: unless somebody asks for another
NOTICED = Threshold()


def match_trips(
    base: pd.DataFrame, scenario: pd.DataFrame, threshold: Threshold = NOTICED
) -> pd.DataFrame:
    """Every platoon of two runs, beside itself.

    ``base`` and ``scenario`` are the trips of
    :class:`uxsim_geo.analysis.comparison.measured.Measured`. Where the two platoons are of
    different sizes, the vehicles that both have are one row, and the others a row of one side
    alone. Columns: those of ``each_trip`` of
    :class:`uxsim_geo.analysis.comparison.comparison.Comparison`, and origin_zone,
    destination_zone.
    """
    both = base.merge(
        scenario, how="outer", on=list(IDENTITY), suffixes=("_base", "_scenario"), sort=False
    )
    vehicles = {side: both[f"vehicles_{side}"].fillna(0.0) for side in ("base", "scenario")}
    common = vehicles["base"].clip(upper=vehicles["scenario"])
    table = pd.DataFrame({name: both[name] for name in IDENTITY})
    for end in ("origin_zone", "destination_zone"):
        table[end] = both[f"{end}_base"].fillna(both[f"{end}_scenario"])
    parts = [_part(table, both, common, ("base", "scenario"))]
    for side, of_side in vehicles.items():
        parts.append(_part(table, both, of_side - common, (side,)))
    found = pd.concat(parts, ignore_index=True)
    found["change_s"] = found["travel_time_s_scenario"] - found["travel_time_s_base"]
    found["outcome"] = pd.Series(_outcomes(found, threshold), dtype="str")
    return found


def _part(
    table: pd.DataFrame, both: pd.DataFrame, vehicles: pd.Series, sides: tuple[str, ...]
) -> pd.DataFrame:
    """Rows of the vehicles that there are in the named runs, and in no other."""
    there = (vehicles > 0).to_numpy()
    part = table[there].assign(vehicles=vehicles[there])
    for name in ("status", "depart_s", "travel_time_s"):
        for side in ("base", "scenario"):
            absent = ABSENT if name == "status" else np.nan
            column = both.loc[there, f"{name}_{side}"]
            part[f"{name}_{side}"] = column if side in sides else absent
    return part


def _outcomes(trips: pd.DataFrame, threshold: Threshold) -> np.ndarray:
    statuses = [trips[f"status_{side}"] for side in ("base", "scenario")]
    arrived, aborted, going = (
        [status.isin(names).to_numpy() for status in statuses]
        for names in (["completed"], ["aborted"], ["waiting", "running"])
    )
    change = trips["change_s"].to_numpy(float)
    noticed = np.maximum(
        threshold.seconds, threshold.share * trips["travel_time_s_base"].to_numpy(float)
    )
    known_better = arrived[1] & (arrived[0] | going[0]) & (change < -noticed)
    known_worse = arrived[0] & (arrived[1] | going[1]) & (change > noticed)
    return np.select(
        [
            (trips["status_scenario"] == ABSENT).to_numpy(),
            (trips["status_base"] == ABSENT).to_numpy(),
            known_better | (aborted[0] & arrived[1]),
            known_worse | (arrived[0] & aborted[1]),
            arrived[0] & arrived[1],
        ],
        ["base_only", "scenario_only", "gains", "loses", "little_change"],
        default="undetermined",
    )


def arrived_in_both(trips: pd.DataFrame) -> Booleans:
    """Which rows of :func:`match_trips` have an exact change."""
    arrived = (trips["status_base"] == "completed") & (trips["status_scenario"] == "completed")
    return arrived.to_numpy()


def distribution(trips: pd.DataFrame) -> Floats:
    """Vehicles by the classes of change from edge to edge, of those who arrived in both."""
    exact = trips[arrived_in_both(trips)]
    number, _ = np.histogram(exact["change_s"], np.array(EDGES), weights=exact["vehicles"])
    return number.astype(np.float64, copy=False)
