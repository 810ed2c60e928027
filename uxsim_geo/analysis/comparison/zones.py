"""What pairs of zones add up to at either end of the trips."""

from __future__ import annotations

import pandas as pd

from uxsim_geo.analysis.comparison.quantities import TRIPS

ENDS = ("origin", "destination")


def zones_of_pairs(pairs: pd.DataFrame) -> pd.DataFrame:
    """Trips that start, and those that end, in every zone.

    ``pairs`` are the zone_pairs of :class:`uxsim_geo.analysis.comparison.measured.Measured`.
    Columns: end, zone, and the same quantities: sums, and means over the departed vehicles.
    """
    sums = [quantity.name for quantity in TRIPS if quantity.adds_up]
    means = [quantity.name for quantity in TRIPS if not quantity.adds_up]
    weighted = pairs.assign(
        **{name: (pairs[name] * pairs["departed_veh"]).fillna(0.0) for name in means}
    )
    tables = []
    for end in ENDS:
        table = weighted.groupby(f"{end}_zone", sort=False)[sums + means].sum().reset_index()
        departed = table["departed_veh"].where(table["departed_veh"] > 0)
        for name in means:
            table[name] = table[name] / departed
        table = table.rename(columns={f"{end}_zone": "zone"})
        table.insert(0, "end", pd.Series([end] * len(table), dtype="str"))
        tables.append(table)
    return pd.concat(tables, ignore_index=True)[["end", "zone", *(q.name for q in TRIPS)]]
