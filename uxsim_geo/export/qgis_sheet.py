"""A sheet to print, A4: two maps, when and where time is lost, legend, scale and source."""

from __future__ import annotations

import base64
from typing import NamedTuple
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np
import pandas as pd

from uxsim_geo.export.colours import NEUTRAL, SPEED_CLASSES
from uxsim_geo.export.lost_time import in_words
from uxsim_geo.export.map_plane import round_below
from uxsim_geo.export.qgis_parts import Project, add_tree_layer, as_label, in_iso
from uxsim_geo.export.sheet_times import SheetTimes, streets_in_words
from uxsim_geo.network.measure import distances

PAGE, LEGEND, MAP, PICTURE, LABEL, SCALE_BAR = 65638, 65642, 65639, 65640, 65641, 65646
FONT = "Sans Serif"
WHOLE, WORST = "{whole-run}", "{worst-bin}"


class _Place(NamedTuple):
    """On the page, mm from its upper left corner."""

    x: float
    y: float
    width: float
    height: float


def add_sheet(layouts: Element, project: Project) -> None:
    """The layout "Where and when"; with states in time a second map shows the worst bin."""
    layout = {"name": "Where and when", "units": "mm", "printResolution": "200", "worldFileMap": ""}
    sheet = SubElement(layouts, "Layout", layout)
    _add_item(SubElement(sheet, "PageCollection"), PAGE, _Place(0, 0, 297, 210))
    name, findings = project.description.name or "run", project.findings
    times = SheetTimes.of(project)
    _add_label(sheet, _Place(8, 6, 185, 9), name + times.period, 16, bold=True)
    words = [*findings.words]
    if project.description.information.get("gridlocked") is True:
        words.append("Gridlock: vehicles wait for one another in circles and can never move again.")
    _add_label(sheet, _Place(8, 16, 185, 17), "\n".join(words), 9)
    in_time = bool(findings.begin) and "link_states" in project.styles
    width = 138.0 if in_time else 281.0
    caption = "Whole run. Colour: speed relative to free speed. Width: volume."
    _add_label(sheet, _Place(8, 34, width, 5), caption, 8)
    _add_map(sheet, _Place(8, 39, width, 122), project, "whole run: speed")
    if in_time:
        bin_ = findings.lost.worst_bin
        worst = findings.begin[bin_], findings.end[bin_]
        caption = f"{times.worst} "
        caption += "Width: share of the road that is taken."
        _add_label(sheet, _Place(151, 34, width, 5), caption, 8)
        _add_map(sheet, _Place(151, 39, width, 122), project, "in time: speed", worst)
        _add_label(sheet, _Place(199, 5, 90, 5), "Time lost on links in each bin", 8)
        _add_picture(sheet, _Place(199, 9, 90, 24), _chart(times))
    _add_legend(sheet, _Place(8, 163, 60, 38), project)
    if project.crs is not None:
        _add_scale_bar(sheet, _Place(84, 188, 60, 12), project)
        _add_picture(sheet, _Place(88, 166, 10, 16), _north())
    _add_label(sheet, _Place(151, 163, 138, 40), streets_in_words(times), 9)
    _add_label(sheet, _Place(8, 203, 281, 4), _source(project), 7)


def _source(project: Project) -> str:
    information = project.description.information
    words = {"uxsim_geo_version": "uxsim-geo {}", "seed": "seed {}", "bin_s": "time bins of {:g} s"}
    told = [text.format(information[key]) for key, text in words.items() if key in information]
    return "  ·  ".join(filter(None, [project.description.attribution, *told]))


def _add_item(sheet: Element, type_: int, place: _Place, **more: str) -> Element:
    """An item of the layout, which later ones lie upon."""
    position = f"{place.x:g},{place.y:g},mm"
    attributes = {
        "type": str(type_),
        "uuid": f"{{item-{len(sheet)}}}",
        "position": position,
        "positionOnPage": position,
        "size": f"{place.width:g},{place.height:g},mm",
        "referencePoint": "0",
        "zValue": str(len(sheet)),
        "visibility": "1",
        "opacity": "1",
        "background": "false",
        "frame": "false",
        "outlineWidthM": "0.2,mm",
    }
    item = SubElement(sheet, "LayoutItem", attributes | more)
    SubElement(item, "FrameColor", _colour(120))
    SubElement(item, "BackgroundColor", _colour(255))
    return item


def _colour(grey: int) -> dict[str, str]:
    return {"red": str(grey), "green": str(grey), "blue": str(grey), "alpha": "255"}


def _add_label(
    sheet: Element, place: _Place, text: str, points: float, *, bold: bool = False
) -> None:
    """Plain text: no HTML, and nothing in it is evaluated."""
    told = {"labelText": as_label(text), "htmlState": "0", "halign": "1", "valign": "32"}
    item = _add_item(sheet, LABEL, place, **told, marginX="0", marginY="0")
    SubElement(item, "LabelFont", _font(points, bold=bold))
    SubElement(item, "FontColor", _colour(30))


def _font(points: float, *, bold: bool = False) -> dict[str, str]:
    return {"description": f"{FONT},{points:g},-1,5,{75 if bold else 50},0,0,0,0,0", "style": ""}


def _add_map(
    sheet: Element,
    place: _Place,
    project: Project,
    theme: str,
    time: tuple[pd.Timestamp, pd.Timestamp] | None = None,
) -> None:
    """A map of what a theme shows, as it is at a time."""
    uuid = WHOLE if time is None else WORST
    more = {"uuid": uuid, "followPreset": "true", "followPresetName": theme, "frame": "true"}
    if time is not None:
        begin, end = map(in_iso, time)
        more |= {"isTemporal": "1", "temporalRangeBegin": begin, "temporalRangeEnd": end}
    item = _add_item(sheet, MAP, place, **more, background="true", keepLayerSet="false")
    sides = ("xmin", "ymin", "xmax", "ymax")
    extent = _fitted(project.extent, place.width / place.height)
    SubElement(item, "Extent", {side: str(x) for side, x in zip(sides, extent, strict=True)})
    SubElement(item, "AtlasMap", {"atlasDriven": "0"})


def _fitted(
    extent: tuple[float, float, float, float], ratio: float
) -> tuple[float, float, float, float]:
    """The extent grown to the shape of its frame, width / height."""
    x0, y0, x1, y1 = extent
    half = max(x1 - x0, (y1 - y0) * ratio) / 2
    x, y = (x0 + x1) / 2, (y0 + y1) / 2
    return x - half, y - half / ratio, x + half, y + half / ratio


def _add_legend(sheet: Element, place: _Place, project: Project) -> None:
    more = {"map_uuid": WHOLE, "resizeToContents": "1", "symbolWidth": "8", "symbolHeight": "3"}
    item = _add_item(sheet, LEGEND, place, **more, columnCount="1", boxSpace="0", title="")
    styles = SubElement(item, "styles")
    for name, space in (("title", "0"), ("group", "0"), ("subgroup", "1"), ("symbol", "1")):
        style = SubElement(styles, "style", {"name": name, "alignment": "1", "marginTop": space})
        SubElement(style, "styleFont", _font(8, bold=name == "subgroup"))
    style = SubElement(
        styles, "style", {"name": "symbolLabel", "alignment": "1", "marginLeft": "2"}
    )
    SubElement(style, "styleFont", _font(8))
    layer = add_tree_layer(SubElement(item, "layer-tree-group"), "links", project, shown=True)
    options = SubElement(SubElement(layer, "customproperties"), "Option", {"type": "Map"})
    title = {"name": "legend/title-label", "type": "QString", "value": "Speed on both maps"}
    SubElement(options, "Option", title)


def _add_scale_bar(sheet: Element, place: _Place, project: Project) -> None:
    """Of two parts, each a round length of about 20 mm on the map."""
    metres = _metres_per_mm(project)
    length = round_below(22.0 * metres)
    big = length >= 1000
    more = {
        "mapUuid": WHOLE,
        "style": "Single Box",
        "unitType": "km" if big else "meters",
        "unitLabel": "km" if big else "m",
        "numMapUnitsPerScaleBarUnit": "1",
        "numUnitsPerSegment": f"{length / 1000 if big else length:g}",
        "numSegments": "2",
        "numSegmentsLeft": "0",
        "segmentSizeMode": "0",
        "height": "2",
        "labelBarSpace": "1",
        "boxContentSpace": "0",
    }
    item = _add_item(sheet, SCALE_BAR, place, **more)
    style = {
        "fontFamily": FONT,
        "fontSize": "8",
        "fontSizeUnit": "Point",
        "textColor": "30,30,30,255",
    }
    SubElement(item, "text-style", style)
    SubElement(item, "strokeColor", _colour(30))
    SubElement(item, "fillColor", _colour(30))
    SubElement(item, "fillColor2", _colour(255))


def _metres_per_mm(project: Project) -> float:
    """On the first map, along the middle of its height."""
    x0, y0, x1, y1 = project.extent
    middle = (y0 + y1) / 2
    ends = np.array([[x0, middle]]), np.array([[x1, middle]])
    ratio = 138.0 / 122.0 if project.findings.begin else 281.0 / 122.0
    wide = _fitted(project.extent, ratio)
    grown = (wide[2] - wide[0]) / (x1 - x0)
    return float(distances(*ends, project.crs)[0]) * grown / (ratio * 122.0)


def _add_picture(sheet: Element, place: _Place, svg: Element) -> None:
    """A drawing, inside the project."""
    content = base64.b64encode(tostring(svg)).decode()
    _add_item(
        sheet, PICTURE, place, file=f"base64:{content}", mode="0", resizeMode="0", anchorPoint="0"
    )


def _svg(width: int, height: int) -> Element:
    size = {"width": str(width), "height": str(height), "viewBox": f"0 0 {width} {height}"}
    return Element("svg", {"xmlns": "http://www.w3.org/2000/svg", **size})


def _north() -> Element:
    svg = _svg(50, 80)
    SubElement(svg, "polygon", {"points": "25,2 42,50 25,40 8,50", "fill": "#333333"})
    text = {"x": "25", "y": "76", "font-size": "26", "text-anchor": "middle", "fill": "#333333"}
    SubElement(svg, "text", {**text, "font-family": "sans-serif"}).text = "N"
    return svg


def _chart(times: SheetTimes) -> Element:
    """A bar a bin, the worst in the colour of standing traffic; times of three of them below."""
    svg = _svg(900, 240)
    in_bins, worst = times.findings.lost.in_bins.tolist(), times.findings.lost.worst_bin
    largest, step = max(in_bins), 900 / len(in_bins)
    for number, lost in enumerate(in_bins):
        height = 170 * lost / largest if largest > 0 else 0.0
        colour = SPEED_CLASSES[0].colour if number == worst else NEUTRAL
        bar = {"x": f"{number * step:.2f}", "y": f"{200 - height:.2f}", "fill": colour}
        SubElement(svg, "rect", {**bar, "width": f"{0.9 * step:.2f}", "height": f"{height:.2f}"})
    SubElement(
        svg, "rect", {"x": "0", "y": "200", "width": "900", "height": "2", "fill": "#333333"}
    )
    middle, lost = (worst + 0.5) * step, times.findings.lost
    _write(svg, 0, 234, "start", times.clock.text(0.0))
    _write(svg, 900, 234, "end", times.clock.text(lost.end[-1]))
    if 220 < middle < 680:
        _write(svg, middle, 234, "middle", times.clock.text(lost.begin[worst]))
    _write(svg, min(max(middle, 90), 810), 24, "middle", in_words(largest))
    return svg


def _write(svg: Element, x: float, y: float, anchor: str, text: str) -> None:
    style = {"font-family": "sans-serif", "font-size": "26", "fill": "#333333"}
    SubElement(
        svg, "text", {"x": f"{x:.1f}", "y": f"{y:g}", "text-anchor": anchor, **style}
    ).text = text
