"""What a QGIS project and its sheet are made of: layers, reference systems, times and texts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any
from xml.etree.ElementTree import Element, SubElement

import pandas as pd

from uxsim_geo.export.columns import Layer
from uxsim_geo.export.findings import Findings
from uxsim_geo.export.qml import plain
from uxsim_geo.export.run_description import RunDescription
from uxsim_geo.export.styles import NamedStyle
from uxsim_geo.network.projection import metres_around


@dataclass(frozen=True)
class Ground:
    """Where a map lies: extent (least x and y, greatest x and y), its CRS, and that of its layers.

    ``crs`` None: undefined. Layers may be in degrees; the map is in metres.
    """

    extent: tuple[float, float, float, float]
    crs: Any
    layer_crs: Any

    @classmethod
    def of(
        cls, links: Any, extent_of: Callable[[Any], tuple[float, float, float, float]]
    ) -> Ground:
        """Of a layer of lines; ``extent_of`` tells the extent from it when it is in metres."""
        own = crs = getattr(links, "crs", None)
        if crs is not None and crs.is_geographic:
            # degrees would stretch the map, the more the further from the equator
            crs = metres_around(links["geometry"])
            links = links.to_crs(crs)
        return cls(extent_of(links), crs, own)


@dataclass(frozen=True)
class Project:
    """What a project shows.

    file
        name of the GeoPackage, in which all layers lie
    words
        of every layer
    styles
        of every layer, the one that it opens with first
    on_map
        names of the layers that have geometry, from the top of the map down, and their kinds
    shown
        layers that are seen when the project is opened
    themes
        layers with the style in which a theme shows them, by the name of the theme
    groups
        layers that lie in groups of the legend, by the name of the group
    add_sheet
        adds a layout to print; None: there is none
    """

    file: str
    words: Mapping[str, Layer]
    styles: Mapping[str, Sequence[NamedStyle]]
    description: RunDescription
    findings: Findings
    ground: Ground
    on_map: Mapping[str, str]
    shown: Sequence[str]
    themes: Mapping[str, Mapping[str, str]]
    groups: Mapping[str, Sequence[str]] = field(default_factory=dict)
    add_sheet: Callable[[Element, Project], None] | None = None

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Of the map when it opens: least x and y, greatest x and y."""
        return self.ground.extent

    @property
    def crs(self) -> Any:
        """Of the map; None: undefined."""
        return self.ground.crs

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
            "name": plain(project.words[name].title),
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
