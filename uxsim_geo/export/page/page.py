"""``report.html``: the whole run in one file, which any browser shows without a network.

Map with a time slider, links by several quantities, curves, streets with most delay, trips between
zones, notes of the import. Its numbers lie packed in the file (:mod:`.packing`), MapLibre GL JS
draws the map, and its own scripts are the files beside this module.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from uxsim_geo.analysis.od import od_table
from uxsim_geo.analysis.state_grid import StateGrid, States
from uxsim_geo.analysis.summary import summary
from uxsim_geo.export.page.bottlenecks import bottlenecks
from uxsim_geo.export.page.document import Tables, document, link_columns
from uxsim_geo.export.page.headlines import headlines, times_in_words
from uxsim_geo.export.page.levels import first_of_merged, levels
from uxsim_geo.export.page.libraries import maplibre
from uxsim_geo.export.page.over_time import over_time
from uxsim_geo.export.page.packing import packed_json, packed_lines, packed_rows
from uxsim_geo.export.page.places import Places
from uxsim_geo.export.page.rows import fact_rows, note_rows, worst_rows
from uxsim_geo.export.page.worst_places import worst_places
from uxsim_geo.export.page.zones import zones
from uxsim_geo.export.run_description import RunDescription
from uxsim_geo.files import replace_when_complete
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result

TEMPLATE = "report.html.jinja"
STYLE = "report.css"

#: in the order in which they build on one another
SCRIPTS = ("data.js", "charts.js", "layers.js", "map.js", "details.js", "trips.js", "report.js")


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
    library = maplibre()
    grid = StateGrid.of_all(run.states, run.network)
    places = Places.of(run.network)
    tables = _tables(run, grid, places)
    edges = tables.network.edges
    return _rendered(
        about=about,
        library=library,
        headlines=headlines(
            summary(run.result, run.network), tables.network, tables.places, about.start
        ),
        worst=worst_rows(tables.places, edges, about.start),
        merged_min=None if len(edges) > len(grid.begin) else f"{np.diff(edges).max() / 60:g}",
        notes=note_rows(about.notes),
        times=times_in_words(about.start),
        facts=fact_rows(about.information),
        parts=_parts(run, about, tables, places),
    )


def _tables(run: Run, grid: StateGrid, places: Places) -> Tables:
    first = first_of_merged(grid)
    od = od_table(run.result, run.network)
    return Tables(
        levels(grid, run.network, first),
        over_time(grid, run.result, first),
        worst_places(grid, run.network, first),
        bottlenecks(grid, run.network, first),
        zones(run.network, places.points, od, on_earth=places.on_earth),
        grid.values("entries").sum(axis=1),
    )


def _parts(run: Run, about: RunDescription, tables: Tables, places: Places) -> dict[str, str]:
    """What the scripts unpack, by the id of its tag."""
    content = document(tables, places, about.start)
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


def _rendered(**values: Any) -> str:
    """The template with everything in it; what is not marked as safe is escaped."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    library = values.pop("library")
    folder = files("uxsim_geo.export.page")
    own = {name: (folder / name).read_text(encoding="utf-8") for name in (STYLE, *SCRIPTS)}
    environment = Environment(
        loader=PackageLoader("uxsim_geo.export.page", ""),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template(TEMPLATE).render(
        styles=[library.style, own[STYLE]],
        scripts=[library.script, *(own[name] for name in SCRIPTS)],
        **values,
    )
