"""QGIS's XML of styles (QML), element by element: what layers look like and how they are read."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple
from xml.etree.ElementTree import Element, SubElement, indent, tostring

#: a fixed old version: QGIS reads styles of any version before its own
QGIS_VERSION = "3.22.0"

#: of the road on which lines are drawn; none: on its middle, as is fast for lines of many points
Side = Literal["right", "left", "none"]


class ColourClass(NamedTuple):
    """A range of values with its colour and its words in the legend."""

    lower: float
    upper: float
    colour: str
    label: str


class Lines(NamedTuple):
    """How lines are drawn: classes of a value, width in mm (both expressions), side of the road.

    Those with the highest ``above`` (an expression) lie on top.
    """

    value: str
    classes: Sequence[ColourClass]
    width: str
    above: str
    side: Side = "right"
    alpha: float = 1.0


def document() -> Element:
    """An empty style."""
    return Element("qgis", {"version": QGIS_VERSION, "styleCategories": "AllStyleCategories"})


def text_of(root: Element) -> str:
    """The style as a file that QGIS reads."""
    indent(root)
    doctype = "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n"
    return doctype + tostring(root, encoding="unicode")


def plain(text: object) -> str:
    """Text without the control characters that XML cannot hold."""
    return re.sub("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", "\ufffd", str(text))


def show_from_begin_to_end(root: Element) -> None:
    """Temporal settings: mode 2 takes start and end of each feature from two fields."""
    settings = {
        "enabled": "1",
        "mode": "2",
        "startField": "begin",
        "endField": "end",
        "limitMode": "0",
        "durationUnit": "min",
        "fixedDuration": "0",
        "durationField": "",
        "accumulate": "0",
        "startExpression": "",
        "endExpression": "",
    }
    fixed = SubElement(SubElement(root, "temporal", settings), "fixedRange")
    SubElement(fixed, "start")
    SubElement(fixed, "end")


def hide_beyond(root: Element, scale: float) -> None:
    """Show the layer only where the map's scale is 1 : ``scale`` or larger."""
    root.set("hasScaleBasedVisibilityFlag", "1")
    root.set("minScale", f"{scale:g}")
    root.set("maxScale", "0")


def add_lines(root: Element, lines: Lines) -> None:
    """Lines beside their road, coloured by classes of a value."""
    renderer = SubElement(
        root,
        "renderer-v2",
        {
            "type": "graduatedSymbol",
            "attr": lines.value,
            "graduatedMethod": "GraduatedColor",
            "symbollevels": "0",
            "enableorderby": "1",
            "forceraster": "0",
        },
    )
    ranges, symbols = SubElement(renderer, "ranges"), SubElement(renderer, "symbols")
    for number, (lower, upper, colour, label) in enumerate(lines.classes):
        range_ = {"lower": str(lower), "upper": str(upper), "symbol": str(number), "label": label}
        SubElement(ranges, "range", {**range_, "render": "true"})
        _add_line_symbol(symbols, str(number), colour, lines)
    order = SubElement(renderer, "orderby")
    SubElement(order, "orderByClause", {"asc": "1", "nullsFirst": "1"}).text = lines.above


def _add_line_symbol(symbols: Element, name: str, colour: str, lines: Lines) -> None:
    look = LineLook(colour, lines.width, lines.side, lines.alpha)
    _add_line(symbols, name, look)


class LineLook(NamedTuple):
    """How a line is drawn: width in mm, opacity 0 to 100 and room are expressions; dashes in mm.

    ``room`` is left between it and the road, mm: for what lies there.
    """

    colour: str
    width: str
    side: Side = "right"
    alpha: float = 1.0
    opacity: str = ""
    dashes: str = ""
    room: str = "0"


class Rule(NamedTuple):
    """Features that fulfil a condition (an expression), with their words and their look."""

    condition: str
    label: str
    look: LineLook


def add_rules(root: Element, rules: Sequence[Rule], above: str) -> None:
    """Lines by rules: a feature is drawn by all that it fulfils, the first of them below.

    Those with the highest ``above`` (an expression) lie on top.
    """
    kind = {"type": "RuleRenderer", "symbollevels": "0", "enableorderby": "1", "forceraster": "0"}
    renderer = SubElement(root, "renderer-v2", kind)
    top = SubElement(renderer, "rules", {"key": "{rules}"})
    symbols = SubElement(renderer, "symbols")
    for number, rule in enumerate(rules):
        told = {"filter": rule.condition, "label": rule.label, "symbol": str(number)}
        SubElement(top, "rule", {"key": f"{{rule-{number}}}", **told})
        _add_line(symbols, str(number), rule.look)
    order = SubElement(renderer, "orderby")
    SubElement(order, "orderByClause", {"asc": "1", "nullsFirst": "1"}).text = above


def _add_line(symbols: Element, name: str, look: LineLook) -> None:
    symbol = {"type": "line", "name": name, "alpha": f"{look.alpha:g}"}
    layer = SubElement(
        SubElement(symbols, "symbol", symbol),
        "layer",
        {"class": "SimpleLine", "enabled": "1", "pass": "0"},
    )
    properties = {
        "line_color": rgba(look.colour),
        "line_style": "solid",
        "line_width": "0.5",
        "line_width_unit": "MM",
        "offset": "0",
        "offset_unit": "MM",
        "capstyle": "flat",
        "joinstyle": "round",
    }
    if look.dashes:
        properties |= {"use_custom_dash": "1", "customdash": look.dashes, "customdash_unit": "MM"}
    _add_properties(layer, properties)
    # a positive offset lies to the right of the line's direction
    offset = f"0.15 + ({look.width}) / 2"
    if look.room != "0":
        offset = f"{offset} + ({look.room})"
    offsets = {"right": offset, "left": f"-({offset})"}
    told = {"outlineWidth": look.width}
    if look.side in offsets:
        told["offset"] = offsets[look.side]
    if look.opacity:
        told["outlineColor"] = f"set_color_part(@symbol_color, 'alpha', 2.55 * ({look.opacity}))"
    _add_expressions(layer, told)


def add_dots(root: Element, attribute: str, kinds: Sequence[tuple[str, str, str, float]]) -> None:
    """Round dots by kinds: value of the attribute, label, colour, diameter in mm."""
    renderer = SubElement(
        root,
        "renderer-v2",
        {"type": "categorizedSymbol", "attr": attribute, "symbollevels": "0", "enableorderby": "0"},
    )
    categories, symbols = SubElement(renderer, "categories"), SubElement(renderer, "symbols")
    for number, (value, label, colour, size) in enumerate(kinds):
        category = {"value": value, "symbol": str(number), "label": label, "render": "true"}
        SubElement(categories, "category", {**category, "type": "string"})
        symbol = SubElement(
            symbols, "symbol", {"type": "marker", "name": str(number), "alpha": "1"}
        )
        layer = SubElement(symbol, "layer", {"class": "SimpleMarker", "enabled": "1", "pass": "0"})
        properties = {
            "name": "circle",
            "color": rgba(colour),
            "outline_color": rgba("#4d4d4d"),
            "outline_width": "0.2",
            "outline_width_unit": "MM",
            "size": f"{size:g}",
            "size_unit": "MM",
        }
        _add_properties(layer, properties)


def add_labels(
    root: Element, column: str, scale: float | None = None, *, along: bool = True
) -> None:
    """The text of a column, plain, at scales of 1 : ``scale`` and larger.

    It runs ``along`` each line, or stands beside each point.
    """
    labeling = SubElement(root, "labeling", {"type": "simple"})
    settings = SubElement(labeling, "settings", {"calloutType": "simple"})
    style = {
        "fieldName": column,
        "isExpression": "0",
        "allowHtml": "0",
        "fontSize": "8",
        "fontSizeUnit": "Point",
        "textColor": rgba("#333333"),
    }
    text = SubElement(settings, "text-style", style)
    buffer = {"bufferDraw": "1", "bufferSize": "0.8", "bufferSizeUnits": "MM"}
    SubElement(text, "text-buffer", {**buffer, "bufferColor": rgba("#ffffff")})
    # 3: along curves, flags 9: on the line, following its orientation on the map; 6: around a point
    placement = (
        {"placement": "3", "placementFlags": "9"} if along else {"placement": "6", "dist": "1"}
    )
    SubElement(settings, "placement", placement)
    rendering = {"drawLabels": "1", "mergeLines": "1" if along else "0"}
    if scale is not None:
        rendering |= {"scaleVisibility": "1", "scaleMin": "0", "scaleMax": f"{scale:g}"}
    SubElement(settings, "rendering", rendering)
    root.set("labelsEnabled", "1")


def add_tip(root: Element, html: str) -> None:
    """What shows when the pointer rests on a feature, where map tips are on."""
    SubElement(root, "mapTip").text = html


def add_aliases(root: Element, titles: Mapping[str, str]) -> None:
    """What columns are called in forms and tables."""
    aliases = SubElement(root, "aliases")
    for index, (column, title) in enumerate(titles.items()):
        SubElement(aliases, "alias", {"field": column, "index": str(index), "name": title})


def _add_properties(layer: Element, properties: Mapping[str, str]) -> None:
    for key, value in properties.items():
        SubElement(layer, "prop", {"k": key, "v": value})


def _add_expressions(layer: Element, expressions: Mapping[str, str]) -> None:
    """Properties that follow from the feature's columns (type 3 is an expression)."""
    defined = SubElement(layer, "data_defined_properties")
    collection = SubElement(defined, "Option", {"type": "Map"})
    SubElement(collection, "Option", {"name": "name", "type": "QString", "value": ""})
    properties = SubElement(collection, "Option", {"name": "properties", "type": "Map"})
    for name, expression in expressions.items():
        property_ = SubElement(properties, "Option", {"name": name, "type": "Map"})
        for key, type_, value in (
            ("active", "bool", "true"),
            ("expression", "QString", expression),
            ("type", "int", "3"),
        ):
            SubElement(property_, "Option", {"name": key, "type": type_, "value": value})
    SubElement(collection, "Option", {"name": "type", "type": "QString", "value": "collection"})


def rgba(colour: str) -> str:
    """#rrggbb in QGIS's way."""
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return f"{red},{green},{blue},255"
