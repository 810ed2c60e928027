"""Rows of the tables that stand in the page as text, also where no script runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from uxsim_geo.analysis.state_grid import StateGrid
from uxsim_geo.export.clock import Clock
from uxsim_geo.export.lost_time import LostTime, Street, states_of
from uxsim_geo.network.network import NOTE_COLUMNS
from uxsim_geo.network.note_words import note_in_words
from uxsim_geo.network.units import KMH

#: from here on numbers are told without decimals
LARGE = 1000

#: less is what rounding leaves of nothing
NOISE = 1e-6

#: a queue that is told as no metre is none
LEAST_QUEUE = 0.5

#: rows of the table of notes; the rest are in the GeoPackage
MOST_NOTES = 200


def street_rows(
    streets: Sequence[Street], lost: LostTime, grid: StateGrid, clock: Clock
) -> list[dict[str, str]]:
    """What the table of streets says of each; all in the bins of the report."""
    states = states_of(streets, grid)
    return [
        {
            "name": street.name,
            "links": f"{len(street.links):,}",
            "lost": lost.unit.text(street.lost),
            "share": f"{100 * street.share:.1f} %",
            "when": clock.span(lost.begin[street.bin], lost.end[street.bin]),
            "speed": f"{state.speed * KMH:.0f} km/h",
            "ratio": f"{100 * state.relative:.0f} %",
            "queue": f"{state.queue:,.0f} m" if state.queue >= LEAST_QUEUE else "none",
        }
        for street, state in zip(streets, states, strict=True)
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
    if isinstance(value, float) and abs(value) < NOISE:
        return "0"
    if isinstance(value, float):
        return f"{value:,.0f}" if abs(value) >= LARGE or value.is_integer() else f"{value:.4g}"
    return str(value) or "none"
