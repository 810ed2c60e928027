"""Plots of a study: intervals of all scenarios, and maps of differences."""

from __future__ import annotations

from dataclasses import replace
from textwrap import shorten, wrap
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.export.comparison.changes import (
    ADDED,
    BETTER,
    EDITED,
    NOT_COMPARED,
    ONLY_BASE,
    ONLY_SCENARIO,
    REMOVED,
    UNKNOWN,
    WORSE,
    Shown,
    class_numbers,
    classes_of,
    significance,
)
from uxsim_geo.export.comparison.extent import LOCAL, changed_part
from uxsim_geo.export.comparison.forest import Panel, panels
from uxsim_geo.export.comparison.study import Scenario, Study, comparison_of, joined_network
from uxsim_geo.export.map_plane import MapPlane
from uxsim_geo.export.map_sheet import INK, MapSheet, points_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

#: letters of a scenario's name on an axis, and of a line of a legend beside a map
LONGEST, WIDEST_LABEL = 26, 18

#: line along an edited link, points
EDGE = 1.2

#: what may be chance, as in the GeoPackage
PERHAPS = 0.3

COLOURS = {"better": BETTER[1], "worse": WORSE[1], "sure": "#1c2126", "perhaps": "#7a838c"}


def literal(text: object) -> str:
    """Text in which matplotlib finds no formula."""
    return str(text).replace("$", r"\$")


def intervals_figure(study: Study) -> Figure:
    """Mean change and 95 % interval of every scenario, a panel a figure (a forest plot)."""
    from matplotlib.figure import Figure

    found = panels(study)
    rows = max((len(found) + 1) // 2, 1)
    height = 0.9 + 0.3 * max((len(panel.intervals) for panel in found), default=1)
    figure = Figure(figsize=(11.0, 0.5 + rows * height), layout="constrained")
    figure.suptitle(
        literal(f"{study.about.name}: changes against {study.base_name}"), x=0.01, ha="left"
    )
    if not found:
        figure.text(0.5, 0.4, "no figure differs in any scenario", ha="center")
    for number, panel in enumerate(found):
        _draw_panel(figure.add_subplot(rows, 2, number + 1), panel)
    return figure


def _draw_panel(axes: Axes, panel: Panel) -> None:
    places = np.arange(len(panel.intervals))[::-1]
    axes.axvline(0.0, color="black", linewidth=0.9)
    for y, one in zip(places, panel.intervals, strict=True):
        style: dict[str, Any] = {"color": COLOURS[one.kind], "linewidth": 1.8}
        if np.isfinite(one.low):
            axes.plot([one.low, one.high], [y, y], marker="|", markersize=8, **style)
        filled = "white" if one.kind == "perhaps" else COLOURS[one.kind]
        axes.plot([one.change], [y], marker="o", markerfacecolor=filled, **style)
        style = {"xycoords": axes.get_yaxis_transform(), "fontsize": 8, "va": "center"}
        axes.annotate(literal(one.words), (1.01, y), annotation_clip=False, **style)
    axes.set_title(literal(panel.title[0].upper() + panel.title[1:]), loc="left", fontsize=10)
    names = [literal(shorten(one.scenario, LONGEST, placeholder="…")) for one in panel.intervals]
    axes.set_yticks(places, names, fontsize=8)
    axes.set(xlim=(panel.ticks[0], panel.ticks[-1]), ylim=(-0.6, len(places) - 0.4))
    axes.set_xlabel(literal(f"change, {panel.unit}"), fontsize=8)
    axes.tick_params(axis="x", labelsize=8)
    axes.grid(axis="x", color="#e6e6e6", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right", "left"]].set_visible(False)


def difference_map_figure(study: Study, entry: Scenario, shown: Shown) -> Figure:
    """Map of what a scenario changes on links over the whole run; of a city, where that is.

    Colour and width say how much, pale colours may be chance. Links of one network alone, edited
    links and those that cannot be compared have looks of their own. Raises ValueError if the base
    has no geometry.
    """
    network = joined_network(study.base, [entry.network])
    links = comparison_of(entry).links.set_index("link_id")
    links = links.reindex(network.links["link_id"].astype(str))
    title = literal(f"{entry.name}: change of {shown.label}")
    values = shown.of(links)
    number = np.where(links["exists"] == "both", class_numbers(values, shown), -2)
    noticeable = (number >= 0) & (number != len(shown.breaks))
    plane, edited = MapPlane.of(network), links["changed"].fillna(False).to_numpy(bool)
    edited = edited & (edited.mean() < LOCAL)
    box = changed_part(plane, np.where(noticeable, np.abs(values), 0.0), edited)
    sheet = MapSheet.around(plane, title, box)
    sheet = replace(sheet, driving_side=study.about.driving_side)
    share = np.sqrt(np.minimum(np.abs(np.nan_to_num(values)) / shown.breaks[-1], 1.0))
    widths = sheet.narrowest + (sheet.widest - sheet.narrowest) * share
    _draw_changes(sheet, number, widths, significance(links, shown), shown)
    _draw_marks(sheet, links, widths)
    sheet.draw_nodes(network)
    sheet.draw_scale()
    _draw_legend(sheet, links, number, shown)
    return sheet.figure


def _draw_changes(
    sheet: MapSheet, number: Integers, widths: Floats, sure: Floats, shown: Shown
) -> None:
    """Links of both networks, the largest changes on top; those that cannot be compared dotted."""
    from matplotlib.collections import LineCollection
    from matplotlib.colors import to_rgba

    unknown = number == -1
    dotted: dict[str, Any] = {"colors": UNKNOWN, "linestyles": ":", "linewidths": sheet.narrowest}
    sheet.axes.add_collection(LineCollection(points_of(sheet.plane.lines[unknown]), **dotted))
    order = np.argsort(widths, kind="stable")
    drawn = order[number[order] >= 0]
    classes = classes_of(shown)
    pale = (sure[drawn] == 0) & (number[drawn] != len(shown.breaks))
    colours = [
        to_rgba(classes[one].colour, PERHAPS if is_pale else 1.0)
        for one, is_pale in zip(number[drawn], pale, strict=True)
    ]
    lines = points_of(sheet.beside(widths)[drawn])
    style: dict[str, Any] = {"colors": colours, "linewidths": widths[drawn], "capstyle": "butt"}
    sheet.axes.add_collection(LineCollection(lines, zorder=2, **style))


def _draw_marks(sheet: MapSheet, links: pd.DataFrame, widths: Floats) -> None:
    """Edited links with a black outer edge, removed ones dashed, added ones gold."""
    from matplotlib.collections import LineCollection

    both = (links["exists"] == "both").to_numpy()
    edited = both & links["changed"].fillna(False).to_numpy(bool)
    wide = 0.7 * sheet.widest
    looks: list[tuple[Any, dict[str, Any]]] = [
        (edited, {"colors": REMOVED, "linewidths": EDGE, "zorder": 3}),
        ((links["exists"] == "base").to_numpy(), {**_REMOVED, "linewidths": wide, "zorder": 3}),
        (
            (links["exists"] == "scenario").to_numpy(),
            {"colors": ADDED, "linewidths": wide, "zorder": 3},
        ),
    ]
    for which, style in looks:
        beside = sheet.beside(np.where(both, 2 * widths + EDGE, wide))[which]
        sheet.axes.add_collection(LineCollection(points_of(beside), capstyle="butt", **style))


_REMOVED: dict[str, Any] = {"colors": REMOVED, "linestyles": (0, (1.2, 0.8))}


def _draw_legend(sheet: MapSheet, links: pd.DataFrame, number: Integers, shown: Shown) -> None:
    """Classes from the largest increase down, and what else is on the map."""
    from matplotlib.lines import Line2D

    wide = min(sheet.widest, 5.0)
    found: list[tuple[Line2D, str]] = [
        (Line2D([], [], color=one.colour, linewidth=wide), one.label)
        for one in reversed(classes_of(shown))
    ]
    there = links["exists"]
    edited = (there == "both") & links["changed"].fillna(False).to_numpy(bool)
    extra: list[tuple[bool, dict[str, Any], str]] = [
        (bool(edited.any()), {"color": REMOVED, "linewidth": EDGE}, EDITED),
        (bool((there == "base").any()), {"color": REMOVED, "linestyle": "--"}, ONLY_BASE),
        (bool((there == "scenario").any()), {"color": ADDED, "linewidth": wide}, ONLY_SCENARIO),
        (bool((number == -1).any()), {"color": UNKNOWN, "linestyle": ":"}, NOT_COMPARED),
    ]
    found += [(Line2D([], [], **style), label) for is_there, style, label in extra if is_there]
    handles, labels = zip(*found, strict=True)
    sheet.legend(
        handles, ["\n".join(wrap(label, WIDEST_LABEL)) for label in labels], f"change, {shown.unit}"
    )
    text = (
        "pale: may be chance"
        if links_known(links, shown)
        else "one pair of runs:\nhow sure is not known"
    )
    sheet.axes.text(1.02, 0.02, text, transform=sheet.axes.transAxes, fontsize=8, color=INK)


def links_known(links: pd.DataFrame, shown: Shown) -> bool:
    """Whether it is known of any link how sure its change is."""
    return bool(np.isfinite(significance(links, shown)).any())
