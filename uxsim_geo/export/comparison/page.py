"""``comparison.html``: a study in one file, which any browser shows without a network.

What was asked, the answer in sentences, intervals of all scenarios, a map of the differences in
time, winners and losers, corridors and pairs, and what the figures rest on.
"""

from __future__ import annotations

from math import isnan
from pathlib import Path
from typing import Any

from uxsim_geo.analysis.comparison.numbers import number
from uxsim_geo.analysis.comparison.words import in_sentences, noticed
from uxsim_geo.export.clock import Clock
from uxsim_geo.export.comparison.document import parts_of
from uxsim_geo.export.comparison.forest import Panel, panels
from uxsim_geo.export.comparison.layers import seeds_in_words
from uxsim_geo.export.comparison.rows import (
    corridor_tables,
    distribution,
    link_rows,
    pair_rows,
    pairing_rows,
    total_rows,
    winner_rows,
    zone_rows,
)
from uxsim_geo.export.comparison.study import Scenario, Study, comparison_of
from uxsim_geo.export.page.rows import fact_rows
from uxsim_geo.export.page.template import Template, rendered
from uxsim_geo.files import replace_when_complete

TEMPLATE = Template(
    "uxsim_geo.export.comparison",
    "comparison.html.jinja",
    ("report.css", "comparison.css"),
    (
        "data.js",
        "charts.js",
        "layers.js",
        "map.js",
        "details.js",
        "differences.js",
        "difference_map.js",
        "map_page.js",
        "comparison.js",
    ),
)


def write_comparison_page(path: Path, study: Study) -> None:
    """Write the page; it takes its name when it is complete. Errors as of :func:`page`."""
    text = page(study)
    with replace_when_complete(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def page(study: Study) -> str:
    """The page's text; the same study gives the same text.

    Raises RuntimeError where MapLibre GL JS is not installed.
    """
    compared = study.compared
    return rendered(
        TEMPLATE,
        about=study.about,
        base_name=study.base_name,
        asked=[_asked(entry) for entry in study.scenarios],
        answers=[_answer(entry, study.clock) for entry in compared],
        panels=[_panel(panel) for panel in panels(study)],
        totals=total_rows(study),
        blocks=[_block(study, entry) for entry in compared],
        pairing=pairing_rows(study),
        failed=study.failed,
        same_seeds=all(a == b for entry in compared for a, b in comparison_of(entry).seeds),
        noticed=noticed(),
        times=study.clock.in_words(),
        facts=fact_rows(study.about.information),
        parts=parts_of(study) if compared else {},
    )


def _answer(entry: Scenario, clock: Clock) -> dict[str, Any]:
    return {"name": entry.name, "sentences": in_sentences(comparison_of(entry), clock.span)}


def _asked(entry: Scenario) -> dict[str, Any]:
    found = entry.comparison
    return {
        "name": entry.name,
        "edits": list(entry.edits),
        "pairs": 0 if found is None else len(found.seeds),
        "seeds": "" if found is None else seeds_in_words(found),
    }


def _block(study: Study, entry: Scenario) -> dict[str, Any]:
    """All tables of one scenario."""
    found = comparison_of(entry)
    return {
        "name": entry.name,
        "links": link_rows(entry),
        "winners": winner_rows(found),
        "distribution": distribution(found),
        "corridors": corridor_tables(found, study.clock),
        "pairs": pair_rows(found),
        "zones": zone_rows(found),
    }


#: of the drawing of a panel, pixels
WIDTH, ROW, TOP, FOOT, LEFT, RIGHT = 300, 24, 4, 24, 18, 18


def _panel(panel: Panel) -> dict[str, Any]:
    """Places of a panel's marks in its drawing."""
    low, high = panel.ticks[0], panel.ticks[-1]

    def x(value: float) -> float | None:
        share = (value - low) / (high - low)
        return None if isnan(value) else round(LEFT + share * (WIDTH - LEFT - RIGHT), 1)

    rows = [
        {
            "scenario": one.scenario,
            "words": one.words,
            "kind": one.kind,
            "y": TOP + ROW * at + ROW / 2,
            "x": x(one.change),
            "low": x(one.low),
            "high": x(one.high),
        }
        for at, one in enumerate(panel.intervals)
    ]
    bottom = TOP + ROW * len(rows)
    return {
        "title": panel.title[0].upper() + panel.title[1:],
        "unit": panel.unit,
        "rows": rows,
        "ticks": [{"x": x(tick), "text": number(tick, signed=True)} for tick in panel.ticks],
        "zero": x(0.0),
        "width": WIDTH,
        "height": bottom + FOOT,
        "bottom": bottom,
        "top": TOP,
    }
