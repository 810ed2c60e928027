"""The QGIS project of a study: a group of layers a scenario, and a theme a quantity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.export.columns import Layer
from uxsim_geo.export.comparison.study import Study
from uxsim_geo.export.findings import Findings
from uxsim_geo.export.lost_time import LostTime
from uxsim_geo.export.qgis_parts import Ground, Project
from uxsim_geo.export.street_names import street_names
from uxsim_geo.export.styles import NamedStyle

#: of the extent of all links, beyond each side
MARGIN = 0.04


def project_of(  # noqa: PLR0913 -- what a project is made of
    file: str,
    study: Study,
    layers: Mapping[str, Any],
    words: Mapping[str, Layer],
    styles: Mapping[str, Sequence[NamedStyle]],
    groups: Mapping[str, Sequence[str]],
) -> Project:
    """The project for a file of these layers; ``groups`` are the layers of each scenario."""
    first_links, first_times, _, _ = next(iter(groups.values()))
    begin, end = (tuple(layers[first_times].bins[name]) for name in ("begin", "end"))
    themes: dict[str, dict[str, str]] = {}
    for scenario, (links, _, states, od) in groups.items():
        themes |= {f"{scenario}: {style.name}": {links: style.name} for style in styles[links]}
        themes |= {f"in time, {scenario}: {s.name}": {states: s.name} for s in styles[states]}
        themes[f"{scenario}: pairs"] = {od: styles[od][0].name}
    # links over states over pairs: a whole run first
    order = [name for links, _, states, od in groups.values() for name in (links, states, od)]
    on_map = {"nodes": "Point"} | dict.fromkeys(order, "LineString")
    return Project(
        file,
        words,
        styles,
        study.about,
        Findings((), begin, end, _nothing_lost(layers[first_links])),
        Ground.of(layers[first_links], _extent),
        on_map,
        shown=(first_links,),
        themes=themes,
        groups=groups,
    )


def _nothing_lost(links: pd.DataFrame) -> LostTime:
    """Of no meaning: the project of a study has no sheet that tells it."""
    nothing = np.zeros((len(links), 1))
    return LostTime(street_names(links), nothing, np.zeros(1), np.ones(1))


def _extent(links: pd.DataFrame) -> tuple[float, float, float, float]:
    """Of all links that have a place, with a margin."""
    import shapely

    bounds = shapely.total_bounds(links["geometry"].to_numpy())
    if np.isnan(bounds).any():
        return 0.0, 0.0, 1.0, 1.0
    x0, y0, x1, y1 = (float(value) for value in bounds)
    edge = MARGIN * max(x1 - x0, y1 - y0, 1e-9)
    return x0 - edge, y0 - edge, x1 + edge, y1 + edge
