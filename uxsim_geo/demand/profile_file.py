"""Time profiles of demand in a CSV or Parquet file, one for all classes or one for each."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from uxsim_geo.control.drivers import DEFAULT
from uxsim_geo.demand.table_files import find_columns, ids_of, numbers_of, read_table_file
from uxsim_geo.errors import Faults

#: what the columns hold, and their names
NAMES = {"until_s": ("until_s", "until"), "share": ("share", "weight"), "class": ("class",)}


def read_profiles(path: Path) -> dict[str, tuple[tuple[float, float], ...]]:
    """Read profiles: until_s, share and, where there are several, class.

    Returns by class (``default`` where the file names none) the pairs (until_s, share) that
    :class:`uxsim_geo.demand.profile.TripsOptions` takes, which checks them: each share of the
    vehicles departs between the time before and its own, s after the start of the period. Rows
    are put in the order of time.

    Raises :class:`uxsim_geo.errors.InputError` with every fault, its line, column and value.
    """
    faults = Faults(str(path))
    table = read_table_file(path, faults)
    faults.raise_if_any()
    assert table is not None, "else there was a fault"
    found = find_columns(table, NAMES, {}, faults)
    for name in ("until_s", "share"):
        if name not in found:
            there = ", ".join(map(str, table.columns))
            faults.add(f"lacks the column {name} (columns here: {there})")
    faults.raise_if_any()
    rows = pd.DataFrame({name: numbers_of(table, found[name], faults) for name in list(NAMES)[:2]})
    faults.raise_if_any()
    names = (
        ids_of(table, found["class"], faults) if "class" in found else pd.Series([""] * len(rows))
    )
    rows["class"] = names.fillna("").replace("", DEFAULT).to_numpy()
    rows = rows.sort_values(["class", "until_s"], kind="stable")
    return {
        str(name): tuple(zip(part["until_s"].tolist(), part["share"].tolist(), strict=True))
        for name, part in rows.groupby("class", sort=True)
    }
