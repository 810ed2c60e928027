"""The QGIS project of a run: what is on its map, and its themes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import pandas as pd

from uxsim_geo.export.columns import LAYERS
from uxsim_geo.export.findings import Findings, extent_of_traffic
from uxsim_geo.export.qgis_parts import Ground, Project
from uxsim_geo.export.qgis_sheet import add_sheet
from uxsim_geo.export.run_description import RunDescription
from uxsim_geo.export.styles import NamedStyle

#: from the top of the map down
ON_MAP = {
    "import_notes": "Point",
    "nodes": "Point",
    "trajectories": "LineStringZM",
    "od_lines": "LineString",
    "link_states": "LineString",
    "links": "LineString",
}

#: name of a theme: layers with the style in which it shows them
THEMES = {
    "in time: speed": {"link_states": "speed", "nodes": "control"},
    "in time: delay": {"link_states": "delay", "nodes": "control"},
    "in time: queue": {"link_states": "queue", "nodes": "control"},
    "in time: flow": {"link_states": "flow", "nodes": "control"},
    "whole run: speed": {"links": "speed", "nodes": "control"},
    "whole run: delay": {"links": "delay", "nodes": "control"},
    "whole run: queue": {"links": "queue", "nodes": "control"},
    "whole run: volume": {"links": "volume", "nodes": "control"},
    "desire lines": {"od_lines": "delay", "links": "roads"},
    "trajectories": {"trajectories": "time lost", "links": "roads"},
    "import notes": {"import_notes": "severity", "links": "roads"},
}


def project_of_run(
    file: str,
    layers: Mapping[str, pd.DataFrame],
    styles: Mapping[str, Sequence[NamedStyle]],
    description: RunDescription,
) -> Project:
    """The project for a file of these layers, which have geometry.

    It opens with links alone: circles of nodes hide short ones.
    """
    there = {name for name, layer in layers.items() if "geometry" in layer.columns}
    there |= {"link_states"} & set(styles)
    return Project(
        file,
        LAYERS,
        styles,
        description,
        Findings.of(layers),
        Ground.of(layers["links"], extent_of_traffic),
        {name: kind for name, kind in ON_MAP.items() if name in there},
        shown=("link_states" if "link_states" in styles else "links",),
        themes=THEMES,
        add_sheet=add_sheet,
    )
