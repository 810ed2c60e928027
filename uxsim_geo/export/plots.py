"""Two plots for a first look: the state of the network on a map, and its fundamental diagram.

Figures are made without pyplot: no window, no state shared between figures.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from uxsim_geo.analysis.passages import Floats
from uxsim_geo.export.colours import NEUTRAL, NO_TRAFFIC, SPEED_CLASSES
from uxsim_geo.export.map_plane import MapPlane, round_below
from uxsim_geo.files import replace_when_complete
from uxsim_geo.network.network import Network
from uxsim_geo.network.units import PER_HOUR, PER_KM

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import LineCollection
    from matplotlib.figure import Figure

POINTS_PER_INCH = 72.0
NARROWEST = 0.6  # line width, points
GAP = 0.7  # between the two directions of a road, points
LABELLED_NODES = 60  # more would cover the map
LETTERS_IN_CIRCLE = 3  # of a node's name


def network_state_figure(
    network: Network,
    totals: pd.DataFrame,
    title: str,
    *,
    volume: str = "volume, veh",
    period: str = "over the run",
) -> Figure:
    """Map of the whole run: width is the volume, colour the mean speed relative to free speed.

    ``totals`` comes from :func:`uxsim_geo.analysis.link_states.link_totals`; where its volume or
    its speed are those of something else, ``volume`` and ``period`` say of what. Each link stands
    to the right of its road, so that both directions show. Raises ValueError if the network has
    no geometry.
    """
    from matplotlib.figure import Figure

    plane = MapPlane.of(network)
    x0, y0, x1, y1 = plane.extent
    height = 7.5
    width = float(np.clip(height * (x1 - x0) / (y1 - y0), 4.5, 11.0))
    figure = Figure(figsize=(width + 1.8, height + 0.6), layout="constrained")
    axes = figure.add_subplot()
    axes.set(xlim=(x0, x1), ylim=(y0, y1), aspect="equal", title=title)
    axes.set_axis_off()
    units_per_point = max((x1 - x0) / width, (y1 - y0) / height) / POINTS_PER_INCH
    traffic = _draw_links(axes, network, totals, plane, units_per_point)
    _draw_nodes(axes, network, plane)
    _draw_scale(axes, plane)
    bar = figure.colorbar(traffic, ax=axes, shrink=0.6, pad=0.02, format="%d")
    bar.set_label(f"mean speed {period}, % of free speed")
    if (legend := axes.get_legend()) is not None:
        legend.set_title(volume)
    return figure


def mfd_figure(states: pd.DataFrame, title: str) -> Figure:
    """The network's fundamental diagram: flow against density, one point a time bin.

    ``states`` comes from :func:`uxsim_geo.analysis.network_states.network_states`.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 5.2), layout="constrained")
    axes = figure.add_subplot()
    density, flow = states["density"] * PER_KM, states["flow"] * PER_HOUR
    minutes = (states["begin_s"] + states["end_s"]) / 2 / 60
    axes.plot(density, flow, color=NEUTRAL, linewidth=1.0, zorder=1)
    points = axes.scatter(
        density, flow, c=minutes, cmap="viridis", s=34, edgecolors="black", linewidths=0.4, zorder=2
    )
    axes.set(
        title=title,
        xlabel="density, veh/km per lane",
        ylabel="flow, veh/h per lane",
        xlim=(0, None),
        ylim=(0, None),
    )
    axes.grid(color="#e6e6e6", linewidth=0.6)
    axes.set_axisbelow(True)
    bar = figure.colorbar(points, ax=axes, pad=0.02)
    bar.set_label("minutes after the start (middle of the time bin)")
    return figure


def save_figure(figure: Figure, path: Path) -> None:
    """Write a PNG that depends on nothing but the figure: no program name, no date."""
    with replace_when_complete(path) as temporary:
        figure.savefig(temporary, format="png", dpi=150, metadata={"Software": None})


def _draw_links(
    axes: Axes, network: Network, totals: pd.DataFrame, plane: MapPlane, units_per_point: float
) -> LineCollection:
    """Links to the right of their roads, the slowest on top; empty ones thin and grey below."""
    import shapely
    from matplotlib.collections import LineCollection
    from matplotlib.colors import BoundaryNorm, ListedColormap

    volume = totals["volume"].to_numpy(float)
    widths = _line_widths(volume, plane, units_per_point)
    lines = plane.to_the_right((widths / 2 + GAP / 2) * units_per_point)
    percent = 100 * totals["speed"].to_numpy(float) / network.links["free_speed"].to_numpy(float)
    slowest_last = np.argsort(-percent, kind="stable")
    used = slowest_last[volume[slowest_last] > 0]
    unused = np.flatnonzero(volume == 0)
    paths = [shapely.get_coordinates(line) for line in lines]
    axes.add_collection(
        LineCollection([paths[i] for i in unused], colors=NEUTRAL, linewidths=NARROWEST)
    )
    bounds = [100 * speed.lower for speed in SPEED_CLASSES] + [100.0]
    colours = ListedColormap([speed.colour for speed in SPEED_CLASSES])
    traffic = LineCollection(
        [paths[i] for i in used],
        array=np.minimum(percent[used], 100.0),
        cmap=colours,
        norm=BoundaryNorm(bounds, colours.N),
        linewidths=widths[used],
        capstyle="butt",
    )
    axes.add_collection(traffic)
    widest = float(widths.max(initial=NARROWEST))
    _draw_width_legend(axes, float(volume.max(initial=0)), widest, unused=unused.size > 0)
    return traffic


def _line_widths(volume: Floats, plane: MapPlane, units_per_point: float) -> Floats:
    """Points, linear in volume; the widest a fraction of the usual distance between junctions."""
    import shapely

    usual = float(np.median(shapely.length(plane.lines))) / units_per_point
    widest = float(np.clip(0.2 * usual, 3.5, 8.0))
    return NARROWEST + (widest - NARROWEST) * volume / max(float(volume.max(initial=0)), 1.0)


def _draw_width_legend(axes: Axes, largest: float, widest: float, *, unused: bool) -> None:
    from matplotlib.lines import Line2D

    if largest <= 0:
        return
    top = round_below(largest)
    handles = [
        Line2D([], [], color="#555555", linewidth=NARROWEST + (widest - NARROWEST) * n / largest)
        for n in (top / 5, top / 2, top)
    ]
    labels = [f"{n:,.0f}" for n in (top / 5, top / 2, top)]
    if unused:
        handles.append(Line2D([], [], color=NEUTRAL, linewidth=NARROWEST))
        labels.append(NO_TRAFFIC)
    axes.legend(
        handles,
        labels,
        loc="upper left",
        bbox_to_anchor=(1.0, 1.0),
        frameon=False,
    )


def _draw_nodes(axes: Axes, network: Network, plane: MapPlane) -> None:
    """Names in circles, or above them if long, while there is room; else junctions speak."""
    if len(network.nodes) > LABELLED_NODES:
        return
    from matplotlib.patheffects import withStroke

    halo = [withStroke(linewidth=2.5, foreground="white")]
    names = network.nodes["node_id"].astype(str)
    short = names.str.len().max() <= LETTERS_IN_CIRCLE
    x, y = plane.points.T
    size = 190 if short else 40
    axes.scatter(x, y, s=size, c="white", edgecolors="#555555", linewidths=0.8, zorder=3)
    for name, point in zip(names, plane.points, strict=True):
        axes.annotate(
            name,
            tuple(point),
            xytext=(0, 0 if short else 6),
            textcoords="offset points",
            ha="center",
            va="center" if short else "bottom",
            fontsize=7.5,
            zorder=4,
            path_effects=None if short else halo,
        )


def _draw_scale(axes: Axes, plane: MapPlane) -> None:
    """Scale bar and north below the map, or that there is no scale."""
    x0, _, x1, _ = plane.extent
    bar = plane.scale_bar((x1 - x0) / 4)
    if bar is None:
        text = "schematic: coordinates without a reference system, no scale"
        axes.text(0.0, -0.02, text, transform=axes.transAxes, fontsize=8, va="top")
        return
    length, name = bar
    blended = axes.get_xaxis_transform()
    axes.plot([x0, x0 + length], [-0.02, -0.02], transform=blended, color="black", clip_on=False)
    axes.text(x0 + length / 2, -0.03, name, transform=blended, fontsize=8, ha="center", va="top")
    arrow = {"arrowstyle": "-|>", "color": "black", "linewidth": 1.0, "shrinkA": 0, "shrinkB": 0}
    axes.annotate(
        "",
        xy=(0.97, -0.015),
        xytext=(0.97, -0.05),
        xycoords="axes fraction",
        arrowprops=arrow,
        annotation_clip=False,
    )
    axes.text(0.97, -0.012, "N", transform=axes.transAxes, fontsize=8, ha="center", va="bottom")
