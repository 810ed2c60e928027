"""``comparison.gpkg``: the differences of a study as layers, with styles and a project."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from uxsim_geo.analysis.comparison.quantities import TRIPS
from uxsim_geo.export.columns import LINK, NODES, Layer
from uxsim_geo.export.comparison.changes import (
    SHARES,
    Shown,
    shown_in_time,
    shown_of_links,
)
from uxsim_geo.export.comparison.columns import CHANGED, EXISTS, OF_ALL, OF_SCENARIO, titled_for
from uxsim_geo.export.comparison.layers import (
    LinkTimes,
    links_layer,
    od_layer,
    tables_of_all,
)
from uxsim_geo.export.comparison.project import project_of
from uxsim_geo.export.comparison.study import Scenario, Study, comparison_of, short_names
from uxsim_geo.export.comparison.styles import link_styles, od_style
from uxsim_geo.export.geopackage import Contents, write_contents
from uxsim_geo.export.geopackage_states import InTime
from uxsim_geo.export.layers import nodes_layer
from uxsim_geo.export.page.quantities import round_breaks
from uxsim_geo.export.styles import NamedStyle, plain_style

#: columns of links that the views in time repeat
OF_LINK = tuple(column.name for column in (*LINK, EXISTS, CHANGED))


def write_comparison_geopackage(path: Path, study: Study) -> None:
    """Write all that a study found; the same study gives the same bytes.

    Layers as :mod:`..columns` says, links, link_times, link_states and od for each scenario. Tables
    alone where the base has no geometry. The file replaces an existing one when it is complete.
    """
    write_contents(path, contents_of(path.name, study), study.about)


def contents_of(file: str, study: Study) -> Contents:
    """Layers with their words, styles and project."""
    layers: dict[str, Any] = {"nodes": nodes_layer(study.base)}
    words: dict[str, Layer] = {"nodes": NODES}
    styles: dict[str, list[NamedStyle]] = {"nodes": [plain_style("nodes", NODES)]}
    in_time, groups = [], {}
    found = _Styles(study)
    for entry, short in zip(
        study.compared, short_names(e.name for e in study.compared), strict=True
    ):
        names = {part: f"{part}_{short}" for part in OF_SCENARIO}
        words |= {names[part]: titled_for(layer, entry.name) for part, layer in OF_SCENARIO.items()}
        layers |= _layers(study, entry, names)
        styles |= found.of(names, words)
        tables = (f"link_time_values_{short}", f"time_bins_{short}")
        views = (names["link_times"], names["link_states"])
        in_time.append(InTime(names["links"], *tables, *views, OF_LINK))
        groups[entry.name] = list(names.values())
    layers |= tables_of_all(study)
    words |= OF_ALL
    styles |= {name: [plain_style(name, layer)] for name, layer in OF_ALL.items()}
    project = None
    if "geometry" in study.base.links and groups:
        project = project_of(file, study, layers, words, styles, groups)
    types = {name: "LineString" for names in groups.values() for name in names}
    return Contents(layers, words, styles, in_time, project, types)


def _layers(study: Study, entry: Scenario, names: Mapping[str, str]) -> dict[str, Any]:
    return {
        names["links"]: links_layer(study.base, entry),
        names["link_times"]: LinkTimes(comparison_of(entry), study.about.origin),
        names["od"]: od_layer(study.base, entry),
    }


class _Styles:
    """Styles of all scenarios, with the same classes."""

    def __init__(self, study: Study) -> None:
        self.side = study.about.driving_side
        self.links = [
            *shown_of_links(study, relative=False),
            *shown_of_links(study, relative=True),
        ]
        self.states = shown_in_time(study)
        delay = next(quantity for quantity in TRIPS if quantity.name == "delay_veh_h")
        changes = [comparison_of(entry).od["delay_veh_h_difference"] for entry in study.compared]
        sizes = pd.concat(changes).abs() if changes else pd.Series(dtype=float)
        self.od = Shown(delay, False, round_breaks(sizes[sizes > 0].to_numpy(float), SHARES))

    def of(
        self, names: Mapping[str, str], words: Mapping[str, Layer]
    ) -> dict[str, list[NamedStyle]]:
        links, times, states, od = (names[part] for part in OF_SCENARIO)
        return {
            links: link_styles(words[links], self.links, self.side, in_time=False),
            times: [plain_style(times, words[times])],
            states: link_styles(words[states], self.states, self.side, in_time=True),
            od: [od_style(words[od], self.od, self.side)],
        }
