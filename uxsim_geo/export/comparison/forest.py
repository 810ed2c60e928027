"""Intervals of all scenarios beside one another (a forest plot), as numbers for a drawing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from uxsim_geo.export.comparison.study import Study, comparison_of
from uxsim_geo.export.comparison.words import NOTHING, change_in_words, is_sure
from uxsim_geo.export.map_plane import round_below

#: figures that have a panel each, if they are there and anything changes in them
PANELS = (
    "total_delay_veh_h",
    "total_travel_time_veh_h",
    "completed_average_travel_time_s",
    "average_speed_kmh",
    "vehicles_completed",
    "vehicles_unfinished",
    "total_distance_veh_km",
    "total_toll",
)


class Interval(NamedTuple):
    """Of one scenario: change, low and high in the panel's unit (NaN: no interval), words, kind.

    kind is ``better``, ``worse``, ``sure`` (neither is better) or ``perhaps``.
    """

    scenario: str
    change: float
    low: float
    high: float
    words: str
    kind: str


class Panel(NamedTuple):
    """A figure: its name, title, unit of the axis, intervals, and the ticks of the axis."""

    figure: str
    title: str
    unit: str
    intervals: list[Interval]
    ticks: list[float]


def panels(study: Study) -> list[Panel]:
    """One a figure; relative changes in percent where the base is not 0 in any scenario."""
    tables = [
        (entry.name, comparison_of(entry).totals.set_index("figure")) for entry in study.compared
    ]
    found = []
    for figure in PANELS:
        rows = [(name, table.loc[figure]) for name, table in tables if figure in table.index]
        if rows and any(abs(row["difference"]) > NOTHING for _, row in rows):
            found.append(_panel(figure, rows))
    return found


def _panel(figure: str, rows: Sequence[tuple[str, Any]]) -> Panel:
    relative = all(abs(row["base"]) > NOTHING for _, row in rows)
    intervals = []
    for name, row in rows:
        factor = 100.0 / abs(row["base"]) if relative else 1.0
        change, low, high = (factor * row[end] for end in ("difference", "low", "high"))
        intervals.append(Interval(name, change, low, high, change_in_words(row), _kind(row)))
    unit = "%" if relative else str(rows[0][1]["unit"])
    return Panel(figure, str(rows[0][1]["title"]), unit, intervals, _ticks(intervals))


def _kind(row: Any) -> str:
    sure = is_sure(row)
    if sure is False or abs(row["difference"]) <= NOTHING:
        return "perhaps"
    if row["better"] == 0:
        return "sure"
    return "better" if row["difference"] * row["better"] > 0 else "worse"


def _ticks(intervals: Sequence[Interval]) -> list[float]:
    """Round values around all intervals and 0."""
    ends = [value for one in intervals for value in one[1:4] if np.isfinite(value)]
    low, high = min(0.0, *ends), max(0.0, *ends)
    step = round_below(max((high - low) / 3, 1e-6))
    first, last = np.floor(low / step - 1e-9), np.ceil(high / step + 1e-9)
    return [float(number * step) for number in np.arange(first, last + 1)]
