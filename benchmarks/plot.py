"""Draws how cost grows: a plot with logarithmic axes for each series."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from figures import figure
from plan import AXES, OURS, UXSIM

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Panel(NamedTuple):
    """What one plot shows: figures over the values of some series."""

    title: str
    label: str  # of the vertical axis
    figure: str
    series: tuple[str, ...]
    slope: float  # of the dashed line, on logarithmic axes


PANELS = (
    Panel("Vehicles", "engine, s", "engine_s", ("vehicles", "network"), 1.0),
    Panel("Cost of a link entry", "ns per link entry", "entry_ns", ("vehicles", "network"), 0.0),
    Panel("Memory", "MB that a run adds", "run_mb", ("vehicles", "network"), 1.0),
    Panel("Links", "engine, s", "engine_s", ("links",), 1.0),
    Panel("Destinations", "engine, s", "engine_s", ("destinations",), 1.0),
    Panel("Platoon size", "engine, s", "engine_s", ("platoon",), -1.0),
    Panel("Threads", "ms an update of routes", "update_ms", ("threads",), -1.0),
)

LABELS = {"vehicles": "on 39,600 links", "network": "on a grid that grows"}
COLOURS = {OURS: "#0072b2", UXSIM: "#d55e00"}
MARKS = ("o", "s")
INK, GUIDE = "#333333", "#999999"


def draw(results: dict[str, Any], path: Path) -> None:
    """Draw all series that have been run into a picture."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    run = {case["series"] for case in results["cases"]}
    panels = [panel for panel in PANELS if run & set(panel.series)]
    rows = -(-len(panels) // 3)
    figure, axes = pyplot.subplots(
        rows, 3, figsize=(12, 3.6 * rows), squeeze=False, layout="constrained"
    )
    for axis, panel in zip(axes.flat, panels, strict=False):
        _draw_panel(axis, panel, results)
    for axis in axes.flat[len(panels) :]:
        axis.set_axis_off()
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper left", ncols=len(labels), frameon=False)
    figure.savefig(path, dpi=100, metadata={"Software": None})
    pyplot.close(figure)


def _draw_panel(axis: Axes, panel: Panel, results: dict[str, Any]) -> None:
    lines = []
    for series, mark in zip(panel.series, MARKS, strict=False):
        for engine, colour in COLOURS.items():
            points = _points(results, series, engine, panel.figure)
            if len(points):
                label = ", ".join(filter(None, [engine, LABELS.get(series)]))
                _draw_line(axis, points, f"{mark}-", colour, label)
                lines.append(points)
    axis.set_xscale("log")
    axis.set_yscale("log")
    if lines:
        _draw_guide(axis, max(lines, key=len), panel.slope)
    first = AXES[panel.series[0]]
    axis.set_xlabel(first.split(",")[0] if len(panel.series) > 1 else first, color=INK)
    axis.set_ylabel(panel.label, color=INK)
    axis.set_title(panel.title, loc="left", fontsize=11)
    axis.grid(visible=True, which="major", linewidth=0.4, color="#dddddd")
    axis.spines[["top", "right"]].set_visible(False)
    _mark(axis, lines)


def _draw_line(axis: Axes, points: np.ndarray, style: str, colour: str, label: str) -> None:
    value, least, middle, most = points.T
    filled = "white" if style.startswith("s") else colour
    axis.errorbar(
        value,
        middle,
        yerr=[middle - least, most - middle],
        fmt=style,
        color=colour,
        markerfacecolor=filled,
        markersize=5,
        linewidth=1.3,
        capsize=2,
        label=label,
    )


def _draw_guide(axis: Axes, points: np.ndarray, slope: float) -> None:
    """Draw a dashed line through the last point as if growth were linear."""
    value, middle = points[:, 0], points[:, 2]
    if len(value) > 1:
        ends = np.array([value[0], value[-1]])
        line = middle[-1] * (ends / value[-1]) ** slope
        axis.plot(ends, line, "--", color=GUIDE, linewidth=0.9, zorder=0)


def _mark(axis: Axes, lines: list[np.ndarray]) -> None:
    """Write plain numbers, and name every value where they are within two decades."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter, NullLocator

    plain = FuncFormatter(lambda value, _: f"{value:,.4g}" if value < 1e4 else f"{value:,.0f}")
    low, high = axis.get_ylim()
    if high / low < 100:
        axis.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    for one in (axis.xaxis, axis.yaxis):
        one.set_major_formatter(plain)
        one.set_minor_formatter(NullFormatter())
    values = sorted({value for points in lines for value in points[:, 0]})
    if values and values[-1] / values[0] < 100:
        axis.set_xticks(values)
        axis.xaxis.set_minor_locator(NullLocator())


def _points(results: dict[str, Any], series: str, engine: str, name: str) -> np.ndarray:
    """Value, least, median and most of a figure, a row a case; by value."""
    rows = []
    for case in results["cases"]:
        if case["series"] == series:
            found = figure(results["runs"], case["key"], engine, name)
            if found:
                rows.append((case["value"], *found[:3]))
    return np.array(sorted(rows)).reshape(-1, 4)
