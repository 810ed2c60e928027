"""How many vehicles zones send and draw, from what they hold: population, jobs and the like.

Rates come from surveys, and are to be stated. The order of size: persons made 3.4 trips a day in
the USA (2017 National Household Travel Survey, FHWA-PL-18-019: 3.37, with 1.67 persons in a car)
and 3.1 in Germany (Mobilität in Deutschland 2017, 43 % of them as drivers of a car), that is 1 to
2 trips of vehicles a person and day, of which about a tenth fall into the busiest hour: 0.1 to
0.2 vehicles a person and hour. Jobs, shops and schools draw them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.demand.od_table import add_of_rows
from uxsim_geo.errors import Faults
from uxsim_geo.network.rows import lacking

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class TripRates:
    """Vehicles of the period per unit of what zones hold, by the name of its column.

    productions, attractions
        such as {"population": 0.12} and {"jobs": 0.3, "population": 0.02}; sums over all columns
    """

    productions: Mapping[str, float]
    attractions: Mapping[str, float]

    def __post_init__(self) -> None:
        faults = Faults("trip rates")
        for side in ("productions", "attractions"):
            rates: Mapping[str, float] = getattr(self, side)
            if not rates:
                faults.add("names no column of the zones", column=side)
            for name, rate in rates.items():
                if not 0 <= rate < math.inf:
                    what = "must be a finite number, 0 or more"
                    faults.add(what, column=f"{side}, {name}", value=rate)
        faults.raise_if_any()


def trip_ends(zones: pd.DataFrame, rates: TripRates) -> pd.DataFrame:
    """Vehicles that each zone sends and draws: zone, production, attraction.

    ``zones``: the column zone and those that the rates name. Attractions are multiplied to the
    sum of the productions, since only their ratios are known. Raises
    :class:`uxsim_geo.errors.InputError` with every fault of the zones: columns that are absent,
    values that are missing or below 0, zones without name or named twice, all zones empty.
    """
    faults = Faults(str(zones.attrs.get("source", "zones")))
    columns = dict.fromkeys(["zone", *rates.productions, *rates.attractions])
    for name in columns:
        if name not in zones:
            there = ", ".join(map(str, zones.columns[:20]))
            faults.add(f"lacks the column {name} (columns here: {there})")
    faults.raise_if_any()
    add_of_rows(faults, zones, lacking(zones["zone"]), "zone", "needs a name")
    again = zones["zone"].duplicated().to_numpy(bool)
    add_of_rows(faults, zones, again, "zone", "the zone stands in an earlier row too")
    table = pd.DataFrame({"zone": zones["zone"].astype("str").to_numpy()})
    values = {name: amounts(zones, name, faults) for name in columns if name != "zone"}
    faults.raise_if_any()
    for end, side in (("production", rates.productions), ("attraction", rates.attractions)):
        table[end] = sum((values[name] * rate for name, rate in side.items()), np.zeros(len(zones)))
        if not table[end].sum() > 0:
            faults.add(f"no zone has any {end}: are columns and rates right?", column=end)
    faults.raise_if_any()
    table["attraction"] *= table["production"].sum() / table["attraction"].sum()
    return table


def amounts(zones: pd.DataFrame, name: str, faults: Faults) -> Floats:
    """A column of finite numbers, 0 or more; a fault for every cell that is none."""
    values = pd.to_numeric(zones[name], errors="coerce").to_numpy(np.float64, na_value=np.nan)
    wrong = ~(np.isfinite(values) & (values >= 0))
    add_of_rows(faults, zones, wrong, name, "must be a finite number, 0 or more")
    return np.where(wrong, 0.0, values)
