"""QGIS styles (QML) for every layer of the GeoPackage, so that it opens as a map.

Lines stand to the right of their road, so that both directions show; their width is the traffic
and their colour the speed relative to free speed. In time the width is how much of the road is
taken, by vehicles that drive or by vehicles that stand: flow alone would hide a standing queue.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from uxsim_geo.export.colours import NEUTRAL, NO_TRAFFIC, SPEED_CLASSES, SpeedClass

#: a fixed old version: QGIS reads styles of any version before its own
QGIS_VERSION = "3.22.0"
WIDEST, NARROWEST = 2.6, 0.25  # mm

#: severities of notes with their colour and size in mm
NOTES = (("doubt", "#e0592a", 3.2), ("warning", "#f2b84b", 2.6), ("info", "#84bcd8", 1.6))

#: stands for the speed where nobody was, below every speed
NOBODY = -1.0

#: the greater of flow / capacity and density / jam density, an expression over link_states
SHARE_OF_ROAD = (
    'max(coalesce("flow_vph" / "effective_capacity_vph", 0), '
    'coalesce("density_vpkm" / ("jam_density_vpkm_per_lane" * "lanes"), 0))'
)

#: what columns are called in forms and tables; the rest say it by their names
ALIASES = {
    "flow_vph": "flow (veh/h)",
    "density_vpkm": "density (veh/km)",
    "speed_kmh": "speed (km/h)",
    "speed_ratio": "speed / free speed",
    "free_speed_kmh": "free speed (km/h)",
    "experienced_travel_time_s": "experienced travel time (s)",
    "delay_s": "mean delay (s)",
    "delay_veh_s": "total delay (veh·s)",
    "queue_veh": "queue (veh)",
    "queue_m": "queue (m)",
    "volume_veh": "volume (veh)",
    "entries_veh": "entered (veh)",
    "exits_veh": "left (veh)",
    "length_m": "length (m)",
    "capacity_vph": "given capacity (veh/h)",
    "effective_capacity_vph": "effective capacity (veh/h)",
    "jam_density_vpkm_per_lane": "jam density (veh/km per lane)",
}


def share_of_largest(column: str, largest: float) -> str:
    """The expression of a column's share in its largest value, 0 to 1."""
    return f'coalesce("{column}", 0) / {max(largest, 1.0):.6g}'


def traffic_style(columns: Iterable[str], share: str, *, temporal: bool = False) -> str:
    """Lines as wide as the expression ``share`` (0 to 1) says, coloured by speed_ratio.

    Where nobody was, and so no speed is, they are grey, with a label of their own.
    A ``temporal`` style shows each feature between its fields begin and end.
    """
    root = _document()
    if temporal:
        _show_from_begin_to_end(root)
    renderer = SubElement(
        root,
        "renderer-v2",
        {
            "type": "graduatedSymbol",
            "attr": f'coalesce("speed_ratio", {NOBODY:g})',
            "graduatedMethod": "GraduatedColor",
            "symbollevels": "0",
            "enableorderby": "0",
            "forceraster": "0",
        },
    )
    ranges, symbols = SubElement(renderer, "ranges"), SubElement(renderer, "symbols")
    width = f"scale_linear({share}, 0, 1, {NARROWEST}, {WIDEST})"
    # rounding may lift the speed a hair above free speed
    fastest = SPEED_CLASSES[-1]._replace(upper=1.000001)
    nobody = SpeedClass(NOBODY - 0.5, NOBODY + 0.5, NEUTRAL, NO_TRAFFIC)
    for number, (lower, upper, colour, label) in enumerate((*SPEED_CLASSES[:-1], fastest, nobody)):
        SubElement(
            ranges,
            "range",
            {
                "lower": str(lower),
                "upper": str(upper),
                "symbol": str(number),
                "label": label,
                "render": "true",
            },
        )
        _line_symbol(symbols, str(number), colour, width)
    _add_aliases(root, columns)
    return _text(root)


def nodes_style(columns: Iterable[str]) -> str:
    """Small grey dots."""
    root = _document()
    renderer = SubElement(
        root, "renderer-v2", {"type": "singleSymbol", "symbollevels": "0", "enableorderby": "0"}
    )
    _dot_symbol(SubElement(renderer, "symbols"), "0", "#ffffff", 1.6)
    _add_aliases(root, columns)
    return _text(root)


def notes_style(columns: Iterable[str]) -> str:
    """Dots by severity: doubts large, warnings smaller, everything else small."""
    root = _document()
    renderer = SubElement(
        root,
        "renderer-v2",
        {
            "type": "categorizedSymbol",
            "attr": "severity",
            "symbollevels": "0",
            "enableorderby": "0",
            "forceraster": "0",
        },
    )
    categories, symbols = SubElement(renderer, "categories"), SubElement(renderer, "symbols")
    for number, (severity, colour, size) in enumerate(NOTES):
        told = {"value": severity, "symbol": str(number), "label": severity, "render": "true"}
        SubElement(categories, "category", told)
        _dot_symbol(symbols, str(number), colour, size)
    _add_aliases(root, columns)
    return _text(root)


def table_style(columns: Iterable[str]) -> str:
    """Nothing to draw: names of columns with their units."""
    root = _document()
    _add_aliases(root, columns)
    return _text(root)


def _document() -> Element:
    return Element("qgis", {"version": QGIS_VERSION, "styleCategories": "AllStyleCategories"})


def _show_from_begin_to_end(root: Element) -> None:
    """Temporal settings: mode 2 takes start and end of each feature from two fields."""
    temporal = SubElement(
        root,
        "temporal",
        {
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
        },
    )
    fixed = SubElement(temporal, "fixedRange")
    SubElement(fixed, "start")
    SubElement(fixed, "end")


def _dot_symbol(symbols: Element, name: str, colour: str, size: float) -> None:
    symbol = SubElement(symbols, "symbol", {"type": "marker", "name": name, "alpha": "1"})
    layer = SubElement(symbol, "layer", {"class": "SimpleMarker", "enabled": "1", "pass": "0"})
    properties = {
        "name": "circle",
        "color": _rgba(colour),
        "outline_color": _rgba("#4d4d4d"),
        "outline_width": "0.3",
        "outline_width_unit": "MM",
        "size": f"{size:g}",
        "size_unit": "MM",
    }
    _add_properties(layer, properties)


def _line_symbol(symbols: Element, name: str, colour: str, width: str) -> None:
    symbol = SubElement(symbols, "symbol", {"type": "line", "name": name, "alpha": "1"})
    layer = SubElement(symbol, "layer", {"class": "SimpleLine", "enabled": "1", "pass": "0"})
    properties = {
        "line_color": _rgba(colour),
        "line_style": "solid",
        "line_width": "0.5",
        "line_width_unit": "MM",
        "offset": "0.4",
        "offset_unit": "MM",
        "capstyle": "flat",
        "joinstyle": "round",
    }
    _add_properties(layer, properties)
    # a positive offset lies to the right of the line's direction
    _add_expressions(layer, {"outlineWidth": width, "offset": f"0.15 + ({width}) / 2"})


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


def _add_aliases(root: Element, columns: Iterable[str]) -> None:
    aliases = SubElement(root, "aliases")
    for index, column in enumerate(columns):
        alias = ALIASES.get(column, "")
        SubElement(aliases, "alias", {"field": column, "index": str(index), "name": alias})


def _rgba(colour: str) -> str:
    """#rrggbb in QGIS's way."""
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return f"{red},{green},{blue},255"


def _text(root: Element) -> str:
    indent(root)
    doctype = "<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>\n"
    return doctype + tostring(root, encoding="unicode")
