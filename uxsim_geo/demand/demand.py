"""Demand as a table: how many vehicles want to go where, when."""

from __future__ import annotations

from dataclasses import dataclass, field

import pandas as pd

#: columns of the demand table, in their order
DEMAND_COLUMNS = ("origin", "destination", "start_s", "end_s", "vehicles")


#: columns of what edits do to platoons after they are cut, see :class:`Demand`
CHANGE_COLUMNS = ("row", "edit", "kind", "share", "by_s")


def no_changes() -> pd.DataFrame:
    """The table of changes, without a row."""
    kinds = {"row": "int64", "edit": "int64", "kind": "str", "share": "float64", "by_s": "float64"}
    return pd.DataFrame({name: pd.Series(dtype=kind) for name, kind in kinds.items()})


@dataclass(frozen=True)
class Demand:
    """Vehicles per origin, destination and time slice.

    table
        origin, destination (node_id, text), start_s, end_s (s after the start; departures spread
        evenly over [start_s, end_s)), vehicles (a real number, > 0). A pair may have many rows.
        More columns may be there: class (of drivers, text; null: the default), route (the
        link_ids from origin to destination that all of the row drive; null: they choose) and batch
        (whole number: rows of different batches are cut into platoons apart, those of batch 0 as
        if there were no others; they stand first).
    changes
        what edits do to the platoons of a row once they are cut, so that all others stay as they
        are: row (position in the table), edit (its number, from 1), kind (``stays``: only a share
        of them; ``moved``: a share departs later by by_s), share, by_s (s). All rows of an edit
        are of one kind, share and by_s.
    notes
        what was dropped or assumed, as in :class:`uxsim_geo.network.network.Network`.
    """

    table: pd.DataFrame
    notes: pd.DataFrame = field(default_factory=pd.DataFrame)
    changes: pd.DataFrame = field(default_factory=no_changes)
