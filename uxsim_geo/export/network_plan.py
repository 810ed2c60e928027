"""The bare network: where its nodes and links are, how they are called, and which way they lead."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from uxsim_geo.analysis.types import Floats
from uxsim_geo.export.map_plane import MapPlane
from uxsim_geo.export.map_sheet import (
    INK,
    LABELLED_NODES,
    POINTS_PER_INCH,
    draw_named_nodes,
    points_of,
)
from uxsim_geo.network.driving_side import DrivingSide
from uxsim_geo.network.network import Network

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LINK = "#2b6fad"
NODE = (1.0, 6.3)  # diameter of a node without a name, points at least, at most
LETTER = 0.55  # its width, of its height


def network_figure(
    network: Network,
    title: str,
    *,
    size: tuple[float, float] = (6.0, 6.0),
    font_size: float = 10.0,
    driving_side: DrivingSide = "right",
) -> Figure:
    """Map of the bare network, each link on the ``driving_side`` of its road and with an arrow.

    ``size`` in inches; ``font_size`` of names in points: 0 leaves them out, and so does a network
    of more than 60 nodes; a link that is shorter than its name goes without. Raises ValueError if
    the network has no geometry.
    """
    import shapely
    from matplotlib.figure import Figure

    plane = MapPlane.of(network)
    x0, y0, x1, y1 = plane.extent
    margin = 0.03 * max(x1 - x0, y1 - y0)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.add_subplot()
    axes.set(xlim=(x0 - margin, x1 + margin), ylim=(y0 - margin, y1 + margin), aspect="equal")
    axes.set_title(title)
    axes.set_axis_off()
    point = max((x1 - x0) / size[0], (y1 - y0) / (size[1] - 0.5)) * 1.06 / POINTS_PER_INCH
    usual = float(np.median(shapely.length(plane.lines))) / point
    aside = np.full(len(plane.lines), np.clip(0.06 * usual, 0.5, 3.5) * point)
    lines = plane.beside(aside, driving_side)
    _draw_links(axes, lines, point, usual)
    if font_size > 0 and len(network.nodes) <= LABELLED_NODES:
        draw_named_nodes(axes, network, plane, point, 1.4 * font_size)
        # further out than the lines, so that the names of both directions can be read
        beside = plane.beside(np.full(len(lines), 0.9 * font_size * point), driving_side)
        _name_links(axes, network, beside, point, 0.7 * font_size)
    else:
        x, y = plane.points.T
        wide = float(np.clip(0.2 * usual, *NODE))
        axes.scatter(x, y, s=wide**2, c="white", edgecolors=INK, linewidths=0.12 * wide)
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


def _name_links(
    axes: Axes, network: Network, lines: npt.NDArray[Any], point: float, font_size: float
) -> None:
    """Names along the links, upright; those longer than their link are left out."""
    import shapely
    from matplotlib.patheffects import withStroke

    halo = [withStroke(linewidth=1.5, foreground="white")]
    middle, after = (
        shapely.get_coordinates(shapely.line_interpolate_point(lines, share, normalized=True))
        for share in (0.4, 0.45)
    )
    angles = np.degrees(np.arctan2(*(after - middle).T[::-1]))
    angles = (angles + 90.0) % 180.0 - 90.0  # no name stands on its head
    room = shapely.length(lines) / point
    style: dict[str, Any] = {"ha": "center", "va": "center", "color": LINK, "zorder": 4}
    style |= {"rotation_mode": "anchor", "fontsize": font_size, "path_effects": halo}
    names = network.links["link_id"].astype(str)
    for name, (x, y), angle, length in zip(names, middle, angles, room, strict=True):
        if LETTER * font_size * len(name) <= length:
            axes.text(x, y, name, rotation=float(angle), **style)
