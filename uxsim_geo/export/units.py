"""Tables of the analysis in people's units, with the unit in the name of every column."""

from __future__ import annotations

import pandas as pd

from uxsim_geo.network.units import KMH, PER_HOUR, PER_KM

#: column in SI -> column in people's units, and the factor between them
UNITS: dict[str, tuple[str, float]] = {
    "flow": ("flow_vph", PER_HOUR),
    "density": ("density_vpkm", PER_KM),
    "speed": ("speed_kmh", KMH),
    "distance": ("distance_veh_m", 1.0),
    "time": ("time_veh_s", 1.0),
    "delay": ("delay_veh_s", 1.0),
    "queue": ("queue_veh", 1.0),
    "position": ("position_m", 1.0),
}

#: ends of the names of states per lane
PER_LANE = ("flow", "density")


def in_peoples_units(table: pd.DataFrame, *, per_lane: bool = False) -> pd.DataFrame:
    """The table with the columns of :data:`UNITS` by other names, in other units; others stay.

    ``per_lane``: flow and density are of one lane, and their names say so.
    """
    renamed = {}
    for name in table.columns:
        new, factor = UNITS.get(name, (name, 1.0))
        if per_lane and name in PER_LANE:
            new = f"{new}_per_lane"
        renamed[new] = table[name] if factor == 1.0 else table[name] * factor
    return pd.DataFrame(renamed, copy=False)
