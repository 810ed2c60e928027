"""Demand as a table: how many vehicles want to go where, when."""

from __future__ import annotations

from dataclasses import dataclass, field

import pandas as pd

#: columns of the demand table, in their order
DEMAND_COLUMNS = ("origin", "destination", "start_s", "end_s", "vehicles")


@dataclass(frozen=True)
class Demand:
    """Vehicles per origin, destination and time slice.

    table
        origin, destination (node_id, text), start_s, end_s (s after the start; departures spread
        evenly over [start_s, end_s)), vehicles (a real number, > 0). A pair may have many rows.
        Two more columns may be there: class (of drivers, text; null: the default) and route (the
        link_ids from origin to destination that all of the row drive; null: they choose).
    notes
        what was dropped or assumed, as in :class:`uxsim_geo.network.network.Network`.
    """

    table: pd.DataFrame
    notes: pd.DataFrame = field(default_factory=pd.DataFrame)
