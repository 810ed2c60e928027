"""Is this demand fit to be simulated on that network? All that is wrong, told at once."""

from __future__ import annotations

import numpy as np

from uxsim_geo.demand.demand import DEMAND_COLUMNS, Demand
from uxsim_geo.errors import Faults
from uxsim_geo.network.check import AS_TEXT
from uxsim_geo.network.network import Network
from uxsim_geo.network.rows import (
    add_missing_columns,
    add_rows,
    is_among,
    lacking,
    not_text,
    numbers,
)

#: of all rows together; the whole world has about as many
MOST_VEHICLES = 1e9


def check_demand(demand: Demand, network: Network) -> None:
    """Raise :class:`InputError` with every reason why ``demand`` cannot be simulated, or return.

    Looked at: the columns, origins and destinations (nodes of ``network``, different from one
    another), times (finite, 0 <= start_s < end_s) and vehicles (finite, above 0, in all
    at most :data:`MOST_VEHICLES`). A table
    without a row is a demand too: nobody travels.
    """
    faults = Faults("demand")
    if not add_missing_columns(faults, demand.table, DEMAND_COLUMNS):
        _add_end_faults(faults, demand, network)
        _add_time_faults(faults, demand)
        _add_vehicle_faults(faults, demand)
    faults.raise_if_any()


def _add_end_faults(faults: Faults, demand: Demand, network: Network) -> None:
    for article, column in (("an", "origin"), ("a", "destination")):
        values = demand.table[column]
        missing = lacking(values)
        add_rows(faults, missing, f"no {column}")
        wrong = not_text(values)
        what = f"{article} {column} that is not text"
        add_rows(faults, wrong, what, ids=values, advice=AS_TEXT)
        unknown = ~is_among(values, network.nodes["node_id"]) & ~missing & ~wrong
        add_rows(
            faults, unknown, f"{article} {column} that is not a node of the network", ids=values
        )
    origin = demand.table["origin"].astype("str")
    same = np.asarray(origin == demand.table["destination"].astype("str"), dtype=bool)
    same = same & ~lacking(demand.table["origin"])
    add_rows(faults, same, "the same origin and destination", ids=demand.table["origin"])


def _add_time_faults(faults: Faults, demand: Demand) -> None:
    start, end = numbers(demand.table["start_s"]), numbers(demand.table["end_s"])
    for column, values in (("start_s", start), ("end_s", end)):
        add_rows(faults, ~np.isfinite(values), f"a {column} that is not a finite number")
    with np.errstate(invalid="ignore"):
        add_rows(faults, start < 0, "start_s < 0")
        add_rows(faults, end <= start, "end_s <= start_s")


def _add_vehicle_faults(faults: Faults, demand: Demand) -> None:
    vehicles = numbers(demand.table["vehicles"])
    add_rows(faults, ~np.isfinite(vehicles), "vehicles that are not a finite number")
    with np.errstate(invalid="ignore"):
        add_rows(faults, vehicles <= 0, "vehicles <= 0")
    total = float(vehicles[np.isfinite(vehicles)].sum())
    if total > MOST_VEHICLES:
        what = f"{total:g} vehicles in all are more than can be simulated, at most "
        faults.add(f"{what}{MOST_VEHICLES:g}: is the factor of the trips right?")
