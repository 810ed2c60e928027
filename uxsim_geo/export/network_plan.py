"""The bare network: where its nodes and links are, how they are called, and which way they lead."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from uxsim_geo.export.map_plane import MapPlane
from uxsim_geo.export.map_sheet import LABELLED_NODES
from uxsim_geo.network.network import Network

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LINK = "#2b6fad"


def network_figure(
    network: Network, title: str, *, size: tuple[float, float] = (6.0, 6.0), font_size: float = 10.0
) -> Figure:
    """Map of the bare network, each link to the right of its road and with an arrow.

    ``size`` in inches; ``font_size`` of names in points: 0 leaves them out, and so does a network
    of more than 60 nodes. Raises ValueError if the network has no geometry.
    """
    import shapely
    from matplotlib.figure import Figure

    plane = MapPlane.of(network)
    x0, y0, x1, y1 = plane.extent
    margin = 0.08 * max(x1 - x0, y1 - y0)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.add_subplot()
    axes.set(xlim=(x0 - margin, x1 + margin), ylim=(y0 - margin, y1 + margin), aspect="equal")
    axes.set_title(title)
    axes.set_axis_off()
    lines = plane.to_the_right(np.full(len(plane.lines), 0.008 * max(x1 - x0, y1 - y0)))
    # in mid-link, where no name of a node hides them
    tails, heads = (
        shapely.get_coordinates(shapely.line_interpolate_point(lines, share, normalized=True))
        for share in (0.6, 0.64)
    )
    arrow = {"arrowstyle": "-|>", "color": LINK, "linewidth": 1.0, "shrinkA": 0, "shrinkB": 0}
    for line, tail, head in zip(lines, tails, heads, strict=True):
        axes.plot(*shapely.get_coordinates(line).T, color=LINK, linewidth=1.0, zorder=1)
        axes.annotate("", xy=tuple(head), xytext=tuple(tail), arrowprops=arrow)
    names = font_size > 0 and len(network.nodes) <= LABELLED_NODES
    x, y = plane.points.T
    axes.scatter(x, y, s=40, c="white", edgecolors="#555555", zorder=3)
    if names:
        # further out than the lines, so that the names of both directions can be read
        beside = plane.to_the_right(np.full(len(lines), 0.025 * max(x1 - x0, y1 - y0)))
        _name_elements(axes, network, plane, beside, font_size)
    return figure


def _name_elements(
    axes: Axes, network: Network, plane: MapPlane, lines: npt.NDArray[Any], font_size: float
) -> None:
    """Names of nodes above them, and of links on them; two directions stand apart on their way."""
    import shapely
    from matplotlib.patheffects import withStroke

    halo = [withStroke(linewidth=2.5, foreground="white")]
    for name, point in zip(network.nodes["node_id"].astype(str), plane.points, strict=True):
        place: dict[str, Any] = {
            "xytext": (0, 6),
            "textcoords": "offset points",
            "ha": "center",
            "va": "bottom",
        }
        axes.annotate(name, tuple(point), fontsize=font_size, zorder=5, path_effects=halo, **place)
    points = shapely.get_coordinates(shapely.line_interpolate_point(lines, 0.34, normalized=True))
    paper = {"boxstyle": "round,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}
    for name, (x, y) in zip(network.links["link_id"].astype(str), points, strict=True):
        style: dict[str, Any] = {
            "ha": "center",
            "va": "center",
            "color": LINK,
            "bbox": paper,
            "zorder": 4,
        }
        axes.text(x, y, name, fontsize=0.8 * font_size, **style)
