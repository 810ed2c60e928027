"""``report.html``: the whole run in one file, which any browser shows without a network.

Map with a time slider, links by several quantities, curves, streets with most delay, trips between
zones, notes of the import. Its numbers lie packed in the file (:mod:`.packing`), MapLibre GL JS
draws the map, and its own scripts are the files beside this module.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from uxsim_geo.analysis.od import od_table
from uxsim_geo.analysis.state_grid import StateGrid, States
from uxsim_geo.analysis.summary import summary
from uxsim_geo.export.clock import Clock
from uxsim_geo.export.lost_time import LostTime, junctions
from uxsim_geo.export.page.document import Tables, document, link_columns
from uxsim_geo.export.page.headlines import changes_in_words, headlines
from uxsim_geo.export.page.levels import first_of_merged, levels
from uxsim_geo.export.page.over_time import OverTime, over_time
from uxsim_geo.export.page.packing import packed_json, packed_lines, packed_rows
from uxsim_geo.export.page.places import Places
from uxsim_geo.export.page.rows import fact_rows, note_rows, street_rows
from uxsim_geo.export.page.template import FOLDER, Template, rendered
from uxsim_geo.export.page.zones import zones
from uxsim_geo.export.run_description import RunDescription
from uxsim_geo.files import replace_when_complete
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result

TEMPLATE = "report.html.jinja"

#: rows of the table of streets where most time is lost
STREETS = 12
STYLE = "report.css"

#: in the order in which they build on one another
SCRIPTS = (
    "data.js",
    "charts.js",
    "layers.js",
    "map.js",
    "details.js",
    "trips.js",
    "map_page.js",
    "report.js",
)


@dataclass(frozen=True)
class Run:
    """A simulated run; ``states`` of all links come from :mod:`..link_states`."""

    network: Network
    result: Result
    states: States


def write_page(path: Path, run: Run, about: RunDescription) -> None:
    """Write the page; it takes its name when it is complete. Errors as of :func:`page`."""
    text = page(run, about)
    with replace_when_complete(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def page(run: Run, about: RunDescription) -> str:
    """The page's text; the same run gives the same text.

    Raises :class:`uxsim_geo.errors.InputError` unless the states are those of all links in all
    bins, and RuntimeError where MapLibre GL JS is not installed.
    """
    grid = StateGrid.of_all(run.states, run.network)
    places, lost = Places.of(run.network), LostTime.of(run.network.links, grid)
    clock = Clock.of(about.start, [*grid.begin, grid.end[-1]])
    whole = over_time(grid, run.result, np.arange(len(grid.begin)))
    tables = _tables(run, grid, lost, whole, places)
    return rendered(
        Template(FOLDER, TEMPLATE, (STYLE,), SCRIPTS),
        about=about,
        headlines=headlines(summary(run.result, run.network), whole, lost, clock),
        changes=changes_in_words(about.changes, clock),
        worst=street_rows(tables.streets, lost, grid, clock),
        merged_min=_merged_minutes(tables, grid),
        notes=note_rows(about.notes),
        times=clock.in_words(),
        facts=fact_rows(about.information),
        parts=_parts(run, about, tables, places, clock),
    )


def _tables(run: Run, grid: StateGrid, lost: LostTime, whole: OverTime, places: Places) -> Tables:
    """In the page's bins; ``whole`` are the figures of the network in those of the report."""
    first = first_of_merged(grid)
    delay = np.add.reduceat(lost.delay, first, axis=1)
    is_merged = len(first) < len(grid.begin)
    od = od_table(run.result, run.network)
    return Tables(
        first,
        levels(grid, run.network, first),
        over_time(grid, run.result, first) if is_merged else whole,
        lost.streets(STREETS),
        lost.worst_bin,
        junctions(run.network, delay),
        zones(run.network, places.points, od),
        grid.values("entries").sum(axis=1),
    )


def _merged_minutes(tables: Tables, grid: StateGrid) -> str | None:
    """How long bins are that were put together, if they were."""
    if len(tables.first) == len(grid.begin):
        return None
    return f"{np.diff(tables.levels.edges).max() / 60:g}"


def _parts(
    run: Run, about: RunDescription, tables: Tables, places: Places, clock: Clock
) -> dict[str, str]:
    """What the scripts unpack, by the id of its tag."""
    content = document(tables, places, clock)
    content["links"] = link_columns(run.network, run.result.settings.reaction_time, tables.volume)
    content["map"] = {"on_earth": places.on_earth, "left": about.driving_side == "left"}
    points, deltas = packed_lines(places.lines)
    return {
        "document": packed_json(content),
        "points": points,
        "places": deltas,
        "density": packed_rows(tables.levels.density),
        "speed": packed_rows(tables.levels.speed),
        "queue": packed_rows(tables.levels.queue),
    }
