"""Rows of the tables that stand in the page as text, also where no script runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any

import pandas as pd

from uxsim_geo.analysis.types import Floats
from uxsim_geo.export.page.headlines import clock
from uxsim_geo.export.page.worst_places import WorstPlace
from uxsim_geo.network.network import NOTE_COLUMNS
from uxsim_geo.network.note_words import note_in_words

#: from here on numbers are told without decimals
LARGE = 1000

#: rows of the table of notes; the rest are in the GeoPackage
MOST_NOTES = 200


def worst_rows(
    places: Sequence[WorstPlace], edges: Floats, start: datetime
) -> list[dict[str, str]]:
    """What the table of streets says of each place; ``edges`` of the page's bins, s."""
    return [
        {
            "name": place.name,
            "links": f"{place.links:,}",
            "delay": f"{place.delay_veh_h:,.1f}",
            "share": f"{100 * place.share:.1f} %",
            "when": f"{clock(start, edges[place.bin])}–{clock(start, edges[place.bin + 1])}",
            "speed": f"{place.speed_kmh:.0f} km/h",
            "ratio": f"{100 * place.speed_ratio:.0f} %",
            "queue": f"{place.queue_m:,.0f} m",
        }
        for place in places
    ]


def note_rows(notes: pd.DataFrame) -> dict[str, Any]:
    """Notes of the import: warnings, doubts, then the rest.

    topics (severity, topic, how many, the first of them), rows (the first :data:`MOST_NOTES`),
    count (of all)
    """
    text = notes.reindex(columns=list(NOTE_COLUMNS)).astype("string").fillna("")
    text = text.sort_values("severity", key=_rank, kind="stable")
    said = zip(text["note"], text["value"], strict=True)
    text = text.assign(note=[note_in_words(note, value) for note, value in said])
    topics = [
        {
            "severity": rows["severity"].iloc[0],
            "topic": rows["topic"].iloc[0],
            "count": f"{len(rows):,}",
            "first": _with_place(rows.iloc[0]),
        }
        for _, rows in text.groupby(["severity", "topic"], sort=False)
    ]
    return {"topics": topics, "rows": text.head(MOST_NOTES).to_dict("records"), "count": len(text)}


def fact_rows(facts: Mapping[str, object]) -> dict[str, str]:
    """Names in words, values as text."""
    return {name.replace("_", " "): _as_text(value) for name, value in facts.items()}


def _rank(severity: pd.Series) -> pd.Series:
    """Places of severities, the gravest first."""
    return severity.map({"warning": 0, "doubt": 1}).fillna(2)


def _with_place(note: pd.Series) -> str:
    where = f"{note['element']} {note['element_id']}: " if note["element_id"] else ""
    return f"{where}{note['note']}"


def _as_text(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:,.0f}" if abs(value) >= LARGE or value.is_integer() else f"{value:.4g}"
    return str(value)
