"""Lists of trips with their moments of departure: one row a trip, or several vehicles at once.

A trip becomes a row of demand over the shortest period that begins at its moment, so that all of
it departs then. The engine moves platoons of Δn vehicles: with a platoon size of 1 every trip
departs at its own moment; otherwise those of a pair and class that follow one another share a
platoon, which departs at the moment of one of them. A trip between zones with several access
nodes counts with its part at each of their pairs, as every other vehicle does.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.demand.od_files import NAMES, POINT, od_of_rows
from uxsim_geo.demand.od_table import (
    CLASS,
    DROPPED_COLUMNS,
    OdTable,
    add_of_rows,
    nothing_dropped,
)
from uxsim_geo.demand.points import Points
from uxsim_geo.demand.table_files import find_columns, ids_of, numbers_of, read_table_file
from uxsim_geo.errors import Faults
from uxsim_geo.network.notes import Notes

Floats = npt.NDArray[np.float64]

ENDS = ("origin", "destination")

#: what a column of a trip list holds, and the names under which files have it, in lower case
TRIP_NAMES: dict[str, tuple[str, ...]] = {
    **{name: NAMES[name] for name in (*ENDS, *POINT, "vehicles", CLASS)},
    "depart_s": ("depart_s", "departure_s", "depart_time_s", "departure_time_s"),
    "depart": ("depart", "departure", "depart_time", "departure_time", "time", "timestamp"),
}

CLOCK = re.compile(r"(\d{1,3}):([0-5]\d)(?::([0-5]\d(?:\.\d+)?))?")
DATE = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(?::\d\d(?:\.\d+)?)?(Z|[+-]\d\d:?\d\d)?")


@dataclass(frozen=True)
class TripListOptions:
    """What a list of trips does not say itself.

    begin
        the moment at which the simulation starts, as the column ``depart`` writes moments: a time
        of day such as 06:30 or 06:30:00, or a date with it such as 2024-05-14T06:30; not needed
        where the file has seconds after the start (column ``depart_s``)
    outside
        what to do with trips before ``begin`` or not before ``end_s``: ``fault``, or ``drop``,
        which is reported
    end_s
        s after the start; None: trips may depart at any time after it
    names
        of columns, by what they hold, where they are not those of :data:`TRIP_NAMES`
    """

    begin: str | None = None
    outside: Literal["fault", "drop"] = "fault"
    end_s: float | None = None
    names: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        faults = Faults("options of the trip list")
        if self.outside not in ("fault", "drop"):
            faults.add("must be fault or drop", column="outside", value=self.outside)
        if self.end_s is not None and not self.end_s > 0:
            faults.add("must be a number of seconds above 0", column="end_s", value=self.end_s)
        for name in self.names:
            if name not in TRIP_NAMES:
                faults.add(f"must be one of {', '.join(TRIP_NAMES)}", column="names", value=name)
        faults.raise_if_any()


def read_trip_list(
    path: Path, options: TripListOptions | None = None, *, points: Points | None = None
) -> OdTable:
    """Read a list of trips from a CSV or Parquet file, by its suffix.

    Columns: origin and destination (ids), or with ``points`` origin_x, origin_y, destination_x,
    destination_y; depart_s, or depart (see :class:`TripListOptions`); and if there are any
    vehicles (of the row; default 1) and class. A day may go on after midnight as 24:10. Equal
    trips at the same moment are summed.

    Raises :class:`uxsim_geo.errors.InputError` with every fault, its line (CSV) or row (Parquet),
    column and value.
    """
    options = options or TripListOptions()
    faults, notes = Faults(str(path)), Notes()
    table = read_table_file(path, faults)
    faults.raise_if_any()
    assert table is not None, "else there was a fault"
    found = _columns(table, options, faults, points=points is not None)
    faults.raise_if_any()
    rows = pd.DataFrame(index=table.index)
    for name, column in found.items():
        if name not in ("depart", "depart_s"):
            rows[name] = (ids_of if name in (*ENDS, CLASS) else numbers_of)(table, column, faults)
    if CLASS in rows:
        rows[CLASS] = rows[CLASS].replace("", None)
    if "vehicles" not in rows:
        rows["vehicles"] = 1.0
    depart = _departures(table, found, options, faults)
    outside = _outside(table, found, depart, options, faults)
    # of those before the start a fault tells already
    depart = np.maximum(depart, 0.0)
    rows["start_s"], rows["end_s"] = depart, np.nextafter(depart, np.inf)
    od = od_of_rows(rows[~outside], faults, notes, points)
    return replace(od, dropped=_dropped(rows[outside]))


def _columns(
    table: pd.DataFrame, options: TripListOptions, faults: Faults, *, points: bool
) -> dict[str, str]:
    found = find_columns(table, TRIP_NAMES, options.names, faults)
    there = ", ".join(map(str, table.columns[:20]))
    for name in POINT if points else ENDS:
        if name not in found:
            faults.add(f"lacks the column {name} (columns here: {there})")
    if not {"depart", "depart_s"} & set(found):
        faults.add(f"lacks the column depart or depart_s (columns here: {there})")
    elif "depart_s" in found:
        found.pop("depart", None)
    elif options.begin is None:
        what = "the moment at which the simulation starts must be stated, such as 06:30"
        faults.add(what, column="begin")
    return {
        name: column for name, column in found.items() if name not in (ENDS if points else POINT)
    }


def _departures(
    table: pd.DataFrame, found: dict[str, str], options: TripListOptions, faults: Faults
) -> Floats:
    """The moment of every trip, s after the start; 0 where a fault was told of it."""
    if "depart_s" in found:
        depart = numbers_of(table, found["depart_s"], faults)
        what = "must be a finite number of seconds"
        add_of_rows(faults, table, ~np.isfinite(depart), found["depart_s"], what)
        return np.where(np.isfinite(depart), depart, 0.0)
    column, begin = found["depart"], str(options.begin).strip()
    texts = table[column].astype("str").fillna("").to_numpy(object)
    place, values = pd.factorize(texts)
    is_clock = CLOCK.fullmatch(begin) is not None
    if is_clock:
        seconds, start = np.array([_clock(str(value)) for value in values]), _clock(begin)
    else:
        own = DATE.fullmatch(begin)
        zoned = own is not None and own[1] is not None
        seconds, start = _after(_dates(values, zoned=zoned), _dates([begin], zoned=zoned)[0])
    if np.isnan(start):
        what = "must be a time of day such as 06:30, or a date and time such as 2024-05-14T06:30"
        faults.add(what, column="begin", value=begin)
    depart = seconds[place] - start
    kind = "time of day such as 06:30:00" if is_clock else "date and time such as 2024-05-14T06:30"
    what = f"must be a {kind}, as begin is" + (
        "" if is_clock else ", with a time zone if that has one"
    )
    add_of_rows(faults, table, np.isnan(seconds[place]), column, what)
    return np.where(np.isnan(depart), 0.0, depart)


def _clock(text: str) -> float:
    """Seconds after midnight, NaN if the text is no time of day."""
    found = CLOCK.fullmatch(text)
    if not found:
        return float("nan")
    return int(found[1]) * 3600.0 + int(found[2]) * 60.0 + float(found[3] or 0.0)


def _dates(values: Iterable[object], *, zoned: bool) -> pd.DatetimeIndex:
    """Dates with times, with a zone or without as asked; NaT for others."""
    texts = [str(text).strip() for text in values]
    found = [DATE.fullmatch(text) for text in texts]
    fits = np.array([one is not None and (one[1] is not None) == zoned for one in found], bool)
    kept = pd.Series(texts, dtype="str").where(fits)
    return pd.DatetimeIndex(pd.to_datetime(kept, format="ISO8601", utc=True, errors="coerce"))


def _after(moments: pd.DatetimeIndex, begin: pd.Timestamp) -> tuple[Floats, float]:
    """Seconds from the beginning to moments, and 0; NaN for those that are NaT.

    As seconds since 1970 both would be rounded to a quarter of a microsecond.
    """
    start = float("nan") if pd.isna(begin) else 0.0
    since = moments - (pd.Timestamp(0, tz="UTC") if pd.isna(begin) else begin)
    return np.asarray(since.total_seconds(), np.float64), start


def _outside(
    table: pd.DataFrame,
    found: dict[str, str],
    depart: Floats,
    options: TripListOptions,
    faults: Faults,
) -> npt.NDArray[np.bool_]:
    """Which trips are to be dropped since they depart before the start or after the end."""
    column = found.get("depart_s", found.get("depart", ""))
    early = depart < 0
    late = np.zeros(len(depart), bool) if options.end_s is None else depart >= options.end_s
    if options.outside == "drop":
        return early | late
    advice = "leave it out, or drop what is outside"
    what = f"is before the start of the simulation: {advice}; after midnight write 24:10"
    add_of_rows(faults, table, early, column, what)
    add_of_rows(faults, table, late, column, f"is not before the end, {options.end_s} s: {advice}")
    return np.zeros(len(depart), bool)


def _dropped(rows: pd.DataFrame) -> pd.DataFrame:
    """Trips outside the time, as the report lists them; points are named by their coordinates."""
    if rows.empty:
        return nothing_dropped()
    dropped = rows[["vehicles"]].assign(reason="outside the time")
    for end in ENDS:
        at = [f"{end}_x", f"{end}_y"]
        points = () if end in rows else rows[at].itertuples(index=False)
        dropped[end] = rows[end] if end in rows else [f"{x:.9g} {y:.9g}" for x, y in points]
    dropped = dropped[list(DROPPED_COLUMNS)].reset_index(drop=True)
    return dropped.astype({"reason": "str", "origin": "str", "destination": "str"})
