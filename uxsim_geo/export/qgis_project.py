"""A QGIS project inside the GeoPackage: map, legend, themes, time slider and a sheet to print."""

from __future__ import annotations

import io
import json
import sqlite3
import zipfile
from collections.abc import Mapping
from xml.etree.ElementTree import Element, SubElement, tostring

from uxsim_geo.export.findings import Findings
from uxsim_geo.export.qgis_parts import Project, add_crs, add_tree_layer, as_label, id_of, in_iso
from uxsim_geo.export.qml import QGIS_VERSION, plain


def add_project(database: sqlite3.Connection, project: Project, stamp: str) -> None:
    """Store the project in the table where QGIS looks for it; it is named as the run."""
    database.execute(
        "CREATE TABLE qgis_projects (name TEXT PRIMARY KEY, metadata BLOB, content BLOB)"
    )
    told = json.dumps({"last_modified_time": stamp[:19], "last_modified_user": ""})
    content = _zipped(_document(project)).hex()
    name = project.description.name or "run"
    database.execute("INSERT INTO qgis_projects VALUES (?, ?, ?)", (name, told, content))


def _zipped(root: Element) -> bytes:
    """As QGIS keeps projects; the same project gives the same bytes."""
    doctype = "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n"
    memory = io.BytesIO()
    with zipfile.ZipFile(memory, "w", zipfile.ZIP_DEFLATED) as archive:
        info = zipfile.ZipInfo("run.qgs", (1980, 1, 1, 0, 0, 0))
        info.compress_type, info.create_system = zipfile.ZIP_DEFLATED, 3
        archive.writestr(info, doctype + tostring(root, encoding="unicode"))
    return memory.getvalue()


def _document(project: Project) -> Element:
    title = plain(project.description.name or "run")
    root = Element("qgis", {"version": QGIS_VERSION, "projectname": title})
    SubElement(root, "title").text = title
    add_crs(SubElement(root, "projectCrs"), project.crs)
    _add_tree(root, project)
    layers = SubElement(root, "projectlayers")
    for name in project.names:
        _add_layer(layers, name, project)
    order = SubElement(root, "layerorder")
    for name in project.names:
        SubElement(order, "layer", {"id": id_of(name)})
    _add_properties(SubElement(root, "properties"), project)
    _add_themes(SubElement(root, "visibility-presets"), project)
    layouts = SubElement(root, "Layouts")
    if project.add_sheet is not None:
        project.add_sheet(layouts, project)
    _add_view(root, project)
    _add_time(root, project.findings)
    return root


def _add_tree(root: Element, project: Project) -> None:
    tree = SubElement(root, "layer-tree-group")
    grouped = {name for group in project.groups.values() for name in group}
    for title, names in project.groups.items():
        shown = any(name in project.shown for name in names)
        state = "Qt::Checked" if shown else "Qt::Unchecked"
        group = {"name": plain(title), "checked": state, "expanded": "1" if shown else "0"}
        branch = SubElement(tree, "layer-tree-group", group)
        for name in names:
            add_tree_layer(branch, name, project, shown=name in project.shown)
    for name in project.names:
        if name not in grouped:
            add_tree_layer(tree, name, project, shown=name in project.shown)


def _add_layer(layers: Element, name: str, project: Project) -> None:
    """A layer with its styles: the current one beside its source, the others below."""
    current, *others = project.styles[name]
    spatial = name in project.on_map
    type_ = project.on_map[name] if spatial else "NoGeometry"
    kinds = {"Point": "Point", "NoGeometry": "No geometry"}
    attributes = {"type": "vector", "geometry": kinds.get(type_, "Line"), "wkbType": type_}
    layer = SubElement(layers, "maplayer", attributes | current.root.attrib)
    SubElement(layer, "id").text = id_of(name)
    SubElement(layer, "datasource").text = project.source(name)
    SubElement(layer, "layername").text = plain(project.words[name].title)
    SubElement(layer, "abstract").text = plain(project.words[name].what).replace("`", "")
    SubElement(layer, "attribution").text = plain(project.description.attribution)
    add_crs(SubElement(layer, "srs"), project.ground.layer_crs if spatial else None)
    SubElement(layer, "provider", {"encoding": "UTF-8"}).text = "ogr"
    manager = SubElement(layer, "map-layer-style-manager", {"current": current.name})
    SubElement(manager, "map-layer-style", {"name": current.name})
    for style in others:
        SubElement(manager, "map-layer-style", {"name": style.name}).append(style.root)
    layer.extend(current.root)


def _add_themes(presets: Element, project: Project) -> None:
    for theme, shown in project.themes.items():
        if not set(shown) <= set(project.on_map):
            continue
        preset = SubElement(presets, "visibility-preset", {"name": plain(theme)})
        for layer, style in shown.items():
            SubElement(
                preset,
                "layer",
                {"id": id_of(layer), "style": style, "visible": "1", "expanded": "1"},
            )


def _add_view(root: Element, project: Project) -> None:
    """Where the map opens."""
    view = SubElement(root, "ProjectViewSettings", {"UseProjectScales": "0"})
    sides = dict(zip(("xmin", "ymin", "xmax", "ymax"), map(str, project.extent), strict=True))
    add_crs(SubElement(view, "DefaultViewExtent", sides), project.crs)
    canvas = SubElement(root, "mapcanvas", {"name": "theMapCanvas", "annotationsVisible": "1"})
    extent = SubElement(canvas, "extent")
    for side, value in sides.items():
        SubElement(extent, side).text = value
    add_crs(SubElement(canvas, "destinationsrs"), project.crs)


def _add_time(root: Element, findings: Findings) -> None:
    """The range of the Temporal Controller, and its step, a bin."""
    if not findings.begin:
        return
    seconds = _step(findings)
    step = {"timeStep": f"{seconds:g}", "timeStepUnit": "s"}
    if seconds % 60 == 0:
        step = {"timeStep": f"{seconds / 60:g}", "timeStepUnit": "min"}
    settings = {"frameRate": "2", "cumulativeTemporalRange": "0", **step}
    range_ = SubElement(SubElement(root, "ProjectTimeSettings", settings), "TemporalRange")
    SubElement(range_, "start").text = in_iso(findings.begin[0])
    SubElement(range_, "end").text = in_iso(findings.end[-1])


def _step(findings: Findings) -> float:
    """From bin to bin, s; of a single one what it lasts, a second more than to its end."""
    if len(findings.begin) > 1:
        return float((findings.begin[1] - findings.begin[0]).total_seconds())
    return float((findings.end[0] - findings.begin[0]).total_seconds()) + 1.0


def _add_properties(properties: Element, project: Project) -> None:
    """What the main window shows: the slider, the clock as a title, whose data these are."""
    _add_group(properties, "Paths", {"Absolute": False})
    _add_group(properties, "SpatialRefSys", {"ProjectionsEnabled": 1})
    findings, title = project.findings, as_label(project.description.name or "run")
    if findings.begin:
        controller: dict[str, str | bool | int] = {
            "StartDateTime": in_iso(findings.begin[0]),
            "EndDateTime": in_iso(findings.end[-1]),
            "NavigationMode": 1,  # animated
        }
        _add_group(properties, "TemporalControllerWidget", controller)
        clock = "[% format_date(@map_start_time, 'yyyy-MM-dd HH:mm:ss') %]"
        _add_group(
            properties,
            "TitleLabel",
            {
                "Enabled": True,
                "Placement": 1,
                "Label": f"{title}  {clock} UTC",
                "BackgroundColor": "255,255,255,200",
            },
        )
    _add_group(properties, "ScaleBar", {"Enabled": project.crs is not None, "Placement": 0})
    if project.description.attribution:
        owner = as_label(project.description.attribution)
        _add_group(properties, "CopyrightLabel", {"Enabled": True, "Placement": 3, "Label": owner})


def _add_group(properties: Element, name: str, values: Mapping[str, str | bool | int]) -> None:
    group = SubElement(properties, name)
    kinds = {str: "QString", bool: "bool", int: "int"}
    for key, value in values.items():
        text = str(value).lower() if isinstance(value, bool) else str(value)
        SubElement(group, key, {"type": kinds[type(value)]}).text = text
