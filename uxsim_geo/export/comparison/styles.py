"""Styles of ``comparison.gpkg``: colour and width say how much changes, opacity how surely.

Links that one network alone has, edited links, and links that cannot be compared have styles of
their own: none of them looks like a link on which nothing changes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from xml.etree.ElementTree import Element

import numpy as np

from uxsim_geo.analysis.comparison.quantities import Quantity
from uxsim_geo.export import qml
from uxsim_geo.export.columns import Layer
from uxsim_geo.export.comparison.changes import (
    ADDED,
    EDITED,
    NOT_COMPARED,
    ONLY_BASE,
    ONLY_SCENARIO,
    REMOVED,
    UNKNOWN,
    Shown,
    classes_of,
)
from uxsim_geo.export.qml import LineLook, Rule
from uxsim_geo.export.styles import NARROWEST, WIDEST, NamedStyle, tip_of, with_titles

#: what may be chance is drawn so, of 100
PERHAPS = 30

EDGE = "#111111"

#: of lines that cross one another, mm
MANY_WIDEST = 1.4


def link_styles(
    layer: Layer, shown: Sequence[Shown], side: qml.Side, *, in_time: bool
) -> list[NamedStyle]:
    """One a quantity; the first is the default."""
    styles = []
    for one in shown:
        root = with_titles(layer)
        top = _width(one)
        qml.add_rules(root, list(_rules(one, side, in_time=in_time)), top)
        qml.add_labels(root, "name", 12_000)
        qml.add_tip(root, tip_of(_tip_rows([entry.quantity for entry in shown])))
        if in_time:
            qml.show_from_begin_to_end(root)
        styles.append(NamedStyle(one.label, _said(one, in_time=in_time), root))
    return styles


def od_style(layer: Layer, shown: Shown, side: qml.Side) -> NamedStyle:
    """Lines between nodes by the change of their total delay."""
    root: Element = with_titles(layer)
    name = shown.quantity.name
    value = f'"{name}_difference"'
    width = _width(shown, MANY_WIDEST)
    looks = _looks(shown, value, width, side, _opacity(name, in_time=False))
    qml.add_rules(root, [*looks, _unknown(f"{value} is null", side)], width)
    return NamedStyle(shown.label, f"colour and width: {shown.label}", root)


def _rules(shown: Shown, side: qml.Side, *, in_time: bool) -> Iterator[Rule]:
    name = shown.quantity.name
    value = f'"{name}_relative" * 100' if shown.relative else f'"{name}_difference"'
    width, both = _width(shown), "\"exists\" = 'both'"
    # along the outer edge: under a pale line it would darken that
    edge = LineLook(EDGE, "0.5", side, room=width)
    yield Rule(f'{both} and "changed"', EDITED, edge)
    yield from _looks(shown, value, width, side, _opacity(name, in_time=in_time), both)
    yield _unknown(f"{both} and ({value}) is null", side)
    # added beside what is compared: never as a change of 0
    removed = LineLook(REMOVED, "0.9", side, dashes="1.6;1.2")
    yield Rule("\"exists\" = 'base'", ONLY_BASE, removed)
    yield Rule("\"exists\" = 'scenario'", ONLY_SCENARIO, LineLook(ADDED, "1.4", side))


def _looks(  # noqa: PLR0913 -- one class after the other, all alike but for its range
    shown: Shown, value: str, width: str, side: qml.Side, opacity: str, condition: str = "true"
) -> Iterator[Rule]:
    for entry in classes_of(shown):
        least, most = entry.lower, entry.upper
        if least < 0 < most:
            inside = f"abs({value}) < {most:.10g}"
            yield Rule(
                f"{condition} and {inside}",
                _in_unit(entry.label, shown),
                LineLook(entry.colour, width, side),
            )
            continue
        ends = [f"{value} >= {least:.10g}"] if least > 0 else [f"{value} <= {most:.10g}"]
        if least > 0 and np.isfinite(most):
            ends.append(f"{value} < {most:.10g}")
        if most < 0 and np.isfinite(least):
            ends.append(f"{value} > {least:.10g}")
        look = LineLook(entry.colour, width, side, opacity=opacity)
        yield Rule(f"{condition} and {' and '.join(ends)}", _in_unit(entry.label, shown), look)


def _in_unit(label: str, shown: Shown) -> str:
    return f"{label} {shown.unit}"


def _unknown(condition: str, side: qml.Side) -> Rule:
    return Rule(condition, NOT_COMPARED, LineLook(UNKNOWN, f"{NARROWEST}", side, dashes="0.4;0.8"))


def _width(shown: Shown, widest: float = WIDEST) -> str:
    """mm, by the size of the change in its own unit, up to the last break and beyond."""
    top = shown.breaks[-1]
    suffix, factor = ("relative", " * 100") if shown.relative else ("difference", "")
    size = f'abs(coalesce("{shown.quantity.name}_{suffix}", 0)){factor}'
    return f"scale_linear(sqrt(min({size} / {top:.6g}, 1)), 0, 1, {NARROWEST}, {widest:g})"


def _opacity(name: str, *, in_time: bool) -> str:
    """Percent; full where nothing is known, as of one seed."""
    sure = f'("{name}_low" > 0 or "{name}_high" < 0)' if in_time else f'"{name}_significant"'
    known = f'"{name}_low" is null' if in_time else f'"{name}_significant" is null'
    return f"if({known}, 100, if({sure}, 100, {PERHAPS}))"


def _said(shown: Shown, *, in_time: bool) -> str:
    sure = "its 95 % interval holds 0" if in_time else "it may be chance"
    return f"colour and width: change of {shown.label}; pale: {sure}"


def _tip_rows(quantities: Sequence[Quantity]) -> Mapping[str, str]:
    """Both values, the difference and its interval."""
    rows = {}
    for quantity in dict.fromkeys(quantities):
        name = quantity.name
        base, scenario, difference, low, high = (
            f"coalesce(format_number(\"{name}_{end}\", 1), '–')"
            for end in ("base", "scenario", "difference", "low", "high")
        )
        rows[f"{quantity.title}, {quantity.unit}"] = (
            f"{base} || ' → ' || {scenario} || ': ' || {difference} || "
            f"if(\"{name}_low\" is null, '', ' (' || {low} || ' to ' || {high} || ')')"
        )
    return rows
