"""The bare network: where its nodes and links are, how they are called, and which way they lead."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from uxsim_geo.analysis.passages import Floats
from uxsim_geo.export.map_plane import MapPlane
from uxsim_geo.export.map_sheet import LABELLED_NODES, POINTS_PER_INCH, points_of
from uxsim_geo.network.network import Network

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LINK = "#2b6fad"
NODE = (1.0, 6.3)  # diameter of a node's circle, points at least, at most


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
    margin = 0.06 * max(x1 - x0, y1 - y0)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.add_subplot()
    axes.set(xlim=(x0 - margin, x1 + margin), ylim=(y0 - margin, y1 + margin), aspect="equal")
    axes.set_title(title)
    axes.set_axis_off()
    point = max((x1 - x0) / size[0], (y1 - y0) / (size[1] - 0.5)) * 1.12 / POINTS_PER_INCH
    usual = float(np.median(shapely.length(plane.lines))) / point
    lines = plane.to_the_right(np.full(len(plane.lines), np.clip(0.06 * usual, 0.5, 3.5) * point))
    _draw_links(axes, lines, point, usual)
    x, y = plane.points.T
    diameter = float(np.clip(0.2 * usual, *NODE))
    axes.scatter(x, y, s=diameter**2, c="white", edgecolors="#555555", linewidths=0.12 * diameter)
    if font_size > 0 and len(network.nodes) <= LABELLED_NODES:
        _name_nodes(axes, network, plane, font_size)
        # further out than the lines, so that the names of both directions can be read
        beside = plane.to_the_right(np.full(len(lines), 0.95 * font_size * point))
        _name_links(axes, network, beside, 0.75 * font_size)
    return figure


def _draw_links(axes: Axes, lines: npt.NDArray[Any], point: float, usual: float) -> None:
    """Lines and their arrows' heads, in units of the map; ``point`` is a typographic one."""
    from matplotlib.collections import LineCollection, PolyCollection

    width = float(np.clip(0.03 * usual, 0.3, 1.2))
    axes.add_collection(LineCollection(points_of(lines), colors=LINK, linewidths=width, zorder=0.8))
    heads = _heads(lines, float(np.clip(0.15 * usual, 1.6, 7.0)) * point)
    axes.add_collection(PolyCollection(list(heads), facecolors=LINK, linewidths=0, zorder=0.9))


def _heads(lines: npt.NDArray[Any], length: float) -> Floats:
    """Triangles that point along each line, in its middle: no name of a node hides them there."""
    import shapely

    middle, before = (
        shapely.get_coordinates(shapely.line_interpolate_point(lines, share, normalized=True))
        for share in (0.62, 0.58)
    )
    along = middle - before
    norm = np.hypot(*along.T)[:, None]
    along = length * np.divide(along, norm, out=np.zeros_like(along), where=norm > 0)
    across = 0.35 * np.stack([along[:, 1], -along[:, 0]], axis=1)
    heads: Floats = np.stack([middle, middle - along + across, middle - along - across], axis=1)
    return heads


def _name_nodes(axes: Axes, network: Network, plane: MapPlane, font_size: float) -> None:
    """Names above the nodes."""
    from matplotlib.patheffects import withStroke

    halo = [withStroke(linewidth=2.5, foreground="white")]
    place: dict[str, Any] = {"xytext": (0, 5), "textcoords": "offset points"}
    place |= {"ha": "center", "va": "bottom", "fontweight": "bold"}
    for name, point in zip(network.nodes["node_id"].astype(str), plane.points, strict=True):
        axes.annotate(name, tuple(point), fontsize=font_size, zorder=5, path_effects=halo, **place)


def _name_links(
    axes: Axes, network: Network, lines: npt.NDArray[Any], font_size: float
) -> None:
    """Names of links beside them; those of two directions stand apart on their way."""
    import shapely
    from matplotlib.patheffects import withStroke

    halo = [withStroke(linewidth=1.8, foreground="white")]
    points = shapely.get_coordinates(shapely.line_interpolate_point(lines, 0.4, normalized=True))
    style: dict[str, Any] = {"ha": "center", "va": "center", "color": LINK, "zorder": 4}
    for name, (x, y) in zip(network.links["link_id"].astype(str), points, strict=True):
        axes.text(x, y, name, fontsize=font_size, path_effects=halo, **style)
