"""When the vehicles of an OD table depart: one profile for all, or one for each class."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pandas as pd

from uxsim_geo.demand.od_table import (
    CLASS,
    TIMES,
    OdTable,
    classes_of,
    ordered,
    vehicles_of,
)
from uxsim_geo.demand.profile import TripsOptions
from uxsim_geo.errors import Faults


def in_time(
    od: OdTable, options: TripsOptions, by_class: Mapping[str, TripsOptions] | None = None
) -> OdTable:
    """Give an OD table without times the slices of its period, and multiply by the factor.

    ``by_class`` has the options of classes that depart otherwise than the rest; the class of rows
    that name none is ``default``. What the reader dropped is multiplied too, by the factor of
    ``options``.

    Raises :class:`uxsim_geo.errors.InputError` if the table has times already, and for classes
    that it does not have.
    """
    by_class = by_class or {}
    classes, of_row = classes_of(od.table)
    faults = Faults(od.source)
    if set(TIMES) & set(od.table):
        faults.add("has times of its own already: a period and a profile would contradict them")
    for name in by_class:
        if name not in classes:
            known = ", ".join(classes)
            faults.add(
                f"no vehicles are of this class (there are: {known})", column=CLASS, value=name
            )
    faults.raise_if_any()
    parts = [
        _over_time(od.table[of_row == place], by_class.get(name, options))
        for place, name in enumerate(classes)
    ]
    dropped = od.dropped.assign(vehicles=vehicles_of(od.dropped) * options.factor)
    return replace(od, table=ordered(pd.concat(parts)), dropped=dropped)


def _over_time(table: pd.DataFrame, options: TripsOptions) -> pd.DataFrame:
    """Each row once for every slice of the period."""
    slices = options.slices()
    row = np.repeat(np.arange(len(table)), len(slices))
    parts = [
        np.tile([getattr(part, name) for part in slices], len(table)) for name in (*TIMES, "share")
    ]
    spread = table.iloc[row]
    vehicles = vehicles_of(spread) * options.factor * parts[2]
    return spread.assign(start_s=parts[0], end_s=parts[1], vehicles=vehicles)
