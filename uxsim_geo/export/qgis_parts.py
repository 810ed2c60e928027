"""What a QGIS project and its sheet are made of: layers, reference systems, times and texts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from xml.etree.ElementTree import Element, SubElement

import pandas as pd

from uxsim_geo.export.columns import LAYERS
from uxsim_geo.export.findings import Findings, extent_of_traffic
from uxsim_geo.export.qml import plain
from uxsim_geo.export.run_description import RunDescription
from uxsim_geo.export.styles import NamedStyle
from uxsim_geo.network.projection import metres_around

#: from the top of the map down
ON_MAP = ("import_notes", "nodes", "trajectories", "od_lines", "link_states", "links")


@dataclass(frozen=True)
class Project:
    """What a project shows.

    file
        name of the GeoPackage, in which all layers lie
    styles
        of every layer, the one that it opens with first
    extent
        of the map when it opens: least x and y, greatest x and y
    crs
        of the map; None: undefined
    layer_crs
        of the layers, which may be degrees; the map is in metres
    on_map
        names of the layers that have geometry, from the top of the map down
    """

    file: str
    styles: Mapping[str, Sequence[NamedStyle]]
    description: RunDescription
    findings: Findings
    extent: tuple[float, float, float, float]
    crs: Any
    layer_crs: Any
    on_map: tuple[str, ...]

    @classmethod
    def of(
        cls,
        file: str,
        layers: Mapping[str, pd.DataFrame],
        styles: Mapping[str, Sequence[NamedStyle]],
        description: RunDescription,
    ) -> Project:
        """The project for a file of these layers, which have geometry."""
        links = layers["links"]
        own = crs = getattr(links, "crs", None)
        if crs is not None and crs.is_geographic:
            # degrees would stretch the map, the more the further from the equator
            crs = metres_around(links["geometry"])
            links = links.to_crs(crs)  # type: ignore[operator]
        extent = extent_of_traffic(links)
        there = {name for name, layer in layers.items() if "geometry" in layer.columns}
        there |= {"link_states"} & set(styles)
        on_map = tuple(name for name in ON_MAP if name in there)
        return cls(file, styles, description, Findings.of(layers), extent, crs, own, on_map)

    @property
    def names(self) -> list[str]:
        """Of all layers, those on the map first."""
        return [*self.on_map, *(name for name in self.styles if name not in self.on_map)]

    def source(self, layer: str) -> str:
        """Where QGIS finds a layer, beside the project."""
        return f"./{self.file}|layername={layer}"


def add_crs(parent: Element, crs: Any) -> None:
    """A reference system; None: undefined."""
    system = SubElement(parent, "spatialrefsys", {"nativeFormat": "Wkt"})
    if crs is None:
        return
    authority = crs.to_authority()
    SubElement(system, "wkt").text = crs.to_wkt()
    SubElement(system, "authid").text = ":".join(authority) if authority else ""


def add_tree_layer(tree: Element, name: str, project: Project, *, shown: bool) -> Element:
    """A layer in a tree, of the project or of a legend."""
    return SubElement(
        tree,
        "layer-tree-layer",
        {
            "id": id_of(name),
            "name": LAYERS[name].title,
            "source": project.source(name),
            "providerKey": "ogr",
            "checked": "Qt::Checked" if shown else "Qt::Unchecked",
            "expanded": "1" if shown else "0",
        },
    )


def id_of(layer: str) -> str:
    """The id of a layer in the project: QGIS gives new ones in place of short ones."""
    return f"uxsim_geo_{layer}"


def in_iso(time: pd.Timestamp) -> str:
    """As QGIS writes times: in UTC."""
    return time.strftime("%Y-%m-%dT%H:%M:%SZ")


def as_label(text: str) -> str:
    """Text in which QGIS finds no expression to evaluate."""
    return plain(text).replace("[%", "[%'[' || '%'%]")
