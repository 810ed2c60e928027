"""The sheet that all maps are drawn on: axes of equal scales, scale bar, legend and colour bar.

Everything has its place in inches, so that the size of a map unit on paper is known before
anything is drawn: lines of both directions of a road can stand side by side without a gap or an
overlap, on 24 links and on 20,000.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from uxsim_geo.analysis.types import Floats
from uxsim_geo.export.colours import NEUTRAL, SPEED_CLASSES
from uxsim_geo.export.map_plane import MapPlane, round_below
from uxsim_geo.network.driving_side import DrivingSide
from uxsim_geo.network.network import Network

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import BoundaryNorm, ListedColormap
    from matplotlib.figure import Figure

POINTS_PER_INCH = 72.0
LONGER_SIDE = (7.5, 11.0)  # of the map, inches: the more crowded, the larger
SHORTEST = (3.2, 4.2)  # width and height of the map, inches: room for what stands beside
LEFT, BOTTOM, TOP, SIDE = 0.2, 0.6, 0.55, 1.95  # around the map, inches
BAR = (0.45, 0.18, 0.5)  # colour bar: beside the map and its width, inches; its height, of the map
NORTH = (3.0, 13.0, 35.0)  # below the map: N, tip and tail of its arrow, points
ROOM = 8.0  # between two junctions of a map that may stay small, points
THINNEST = 0.4  # line of a used link on a crowded map, points
LABELLED_NODES = 60  # more would cover the map
LETTERS_IN_CIRCLE = 3  # of a node's name
INK = "#555555"


@dataclass(frozen=True)
class MapSheet:
    """A figure with the axes of a map.

    plane
        the network in plane coordinates
    units_per_point
        map units in a typographic point, of which an inch has 72
    usual
        distance between two junctions, the median of the links, points
    driving_side
        the side of their road that links are drawn on
    """

    figure: Figure
    axes: Axes
    plane: MapPlane
    units_per_point: float
    usual: float
    driving_side: DrivingSide = "right"

    @classmethod
    def of(cls, network: Network, title: str, driving_side: DrivingSide = "right") -> MapSheet:
        """Lay out an empty map; raises ValueError if the network has no geometry."""
        plane = MapPlane.of(network)
        return replace(cls.around(plane, title, plane.extent), driving_side=driving_side)

    @classmethod
    def around(
        cls, plane: MapPlane, title: str, extent: tuple[float, float, float, float]
    ) -> MapSheet:
        """Lay out an empty map of an extent: least x and y, greatest x and y, in map units."""
        import shapely
        from matplotlib.figure import Figure

        x0, y0, x1, y1 = extent
        longer = max(x1 - x0, y1 - y0)
        usual = float(np.nanmedian(shapely.length(plane.lines))) / longer * POINTS_PER_INCH
        side = float(np.clip(ROOM / max(usual, 1e-9), *LONGER_SIDE))
        width, height = (
            max(side * size / longer, least)
            for size, least in zip((x1 - x0, y1 - y0), SHORTEST, strict=True)
        )
        sheet = (LEFT + width + SIDE, BOTTOM + height + TOP)
        figure = Figure(figsize=sheet)
        axes = figure.add_axes(
            (LEFT / sheet[0], BOTTOM / sheet[1], width / sheet[0], height / sheet[1])
        )
        # the map fills its axes: a narrow one gets room at both sides
        half = np.array([width, height]) / 2 * (longer / side)
        x, y = (x0 + x1) / 2, (y0 + y1) / 2
        axes.set(xlim=(x - half[0], x + half[0]), ylim=(y - half[1], y + half[1]))
        axes.set_aspect("equal")
        axes.set_axis_off()
        axes.set_title(title, loc="left", wrap=True)
        return cls(figure, axes, plane, longer / side / POINTS_PER_INCH, usual * side)

    @property
    def widest(self) -> float:
        """Of all lines, points: a quarter of the usual distance between junctions."""
        return float(np.clip(0.25 * self.usual, 1.6, 8.0))

    @property
    def narrowest(self) -> float:
        """Line of a link that is used, points."""
        return float(np.clip(0.02 * self.usual, THINNEST, 0.8))

    @property
    def thin(self) -> float:
        """Line of a road without traffic, points."""
        return 0.75 * self.narrowest

    def beside(self, widths: Floats) -> npt.NDArray[Any]:
        """Lines of the links so far to their side that ``widths`` (points) leave a gap between."""
        gap = np.clip(0.03 * self.usual, 0.15, 0.7)
        return self.plane.beside((widths + gap) / 2 * self.units_per_point, self.driving_side)

    def draw_roads(self, lines: npt.NDArray[Any]) -> None:
        """Draw shapely lines thin and grey below everything else."""
        from matplotlib.collections import LineCollection

        style: dict[str, Any] = {"colors": NEUTRAL, "linewidths": self.thin, "zorder": 1}
        self.axes.add_collection(LineCollection(points_of(lines), **style))

    def draw_scale(self) -> None:
        """Draw scale bar and north below the map, or say that there is no scale."""
        axes = self.axes
        x0, x1 = axes.get_xlim()
        bar = self.plane.scale_bar((x1 - x0) / 4)
        if bar is None:
            text = "schematic: coordinates without a reference system, no scale"
            axes.text(0.0, -0.01, text, transform=axes.transAxes, fontsize=8, va="top")
            return
        length, name = bar
        line: dict[str, Any] = {"color": "black", "clip_on": False, "solid_capstyle": "butt"}
        across = axes.get_xaxis_transform()
        axes.plot([x0, x0 + length], [-0.012, -0.012], transform=across, linewidth=1.5, **line)
        axes.text(x0 + length / 2, -0.02, name, transform=across, fontsize=8, ha="center", va="top")
        self._draw_north()

    def _draw_north(self) -> None:
        """An arrow and its N below the map's right end, on no line of the map."""
        axes = self.axes
        height = axes.get_position().height * self.figure.get_size_inches()[1] * POINTS_PER_INCH
        letter, tip, tail = (-points / height for points in NORTH)
        style: dict[str, Any] = {"xycoords": "axes fraction", "annotation_clip": False}
        arrow = {"arrowstyle": "-|>", "color": "black", "linewidth": 1.0}
        arrow |= {"shrinkA": 0, "shrinkB": 0}
        axes.annotate("", (0.97, tip), (0.97, tail), arrowprops=arrow, **style)
        axes.annotate("N", (0.97, letter), fontsize=8, ha="center", va="top", **style)

    def colour_bar(self, artist: ScalarMappable, label: str, **style: Any) -> None:
        """Draw what the colours mean beside the lower half of the map."""
        width = self.figure.get_size_inches()[0]
        box = self.axes.get_position()
        left = box.x1 + BAR[0] / width
        axes = self.figure.add_axes((left, box.y0, BAR[1] / width, BAR[2] * box.height))
        bar = self.figure.colorbar(artist, cax=axes, **style)
        bar.set_label(label)

    def legend(self, handles: Sequence[Artist], labels: Sequence[str], title: str) -> None:
        """Draw a legend beside the top of the map."""
        self.axes.legend(
            handles,
            labels,
            title=title,
            loc="upper left",
            bbox_to_anchor=(1.0, 1.0),
            frameon=False,
            alignment="left",
        )

    def note(self, text: str) -> None:
        """Write a few short lines beside the middle of the map."""
        self.axes.text(1.02, BAR[2] + 0.03, text, transform=self.axes.transAxes, fontsize=8)

    @property
    def names_nodes(self) -> bool:
        """Whether there is room for the names of all nodes."""
        return len(self.plane.points) <= LABELLED_NODES

    def draw_nodes(self, network: Network) -> None:
        """Names of nodes while there is room; else junctions speak for themselves."""
        if self.names_nodes:
            draw_named_nodes(self.axes, network, self.plane, self.units_per_point)


def draw_named_nodes(
    axes: Axes, network: Network, plane: MapPlane, units_per_point: float, widest: float = 14.0
) -> None:
    """Nodes with names in circles of at most ``widest`` points, or above them if they are long."""
    from matplotlib.patheffects import withStroke

    names = network.nodes["node_id"].astype(str)
    short = names.str.len().max() <= LETTERS_IN_CIRCLE
    wide = _circle(plane, units_per_point, widest) if short else 6.0
    font, up = (0.52 * wide, 0.0) if short else (0.54 * widest, 6.0)
    halo = None if short else [withStroke(linewidth=2.5, foreground="white")]
    x, y = plane.points.T
    axes.scatter(x, y, s=wide**2, c="white", edgecolors=INK, linewidths=0.8, zorder=3)
    style: dict[str, Any] = {"ha": "center", "va": "center_baseline" if short else "bottom"}
    style |= {"fontsize": font, "zorder": 4, "path_effects": halo}
    place: dict[str, Any] = {"xytext": (0, up), "textcoords": "offset points"}
    for name, point in zip(names, plane.points, strict=True):
        axes.annotate(name, tuple(point), **place, **style)


def _circle(plane: MapPlane, units_per_point: float, widest: float) -> float:
    """Diameter of a node's circle, points: the nearest two do not overlap, if names fit in."""
    import shapely

    points = shapely.points(np.unique(plane.points, axis=0))
    if len(points) < 2:
        return widest
    apart = shapely.STRtree(points).query_nearest(points, exclusive=True, return_distance=True)[1]
    nearest = apart.min() / units_per_point
    return float(np.clip(nearest - 1.0, 0.75 * widest, widest))


def in_words(number: int, what: str) -> str:
    """A number of things: 1 vehicle, 2 vehicles."""
    return f"{number:,} {what}{'' if number == 1 else 's'}"


def legend_steps(values: Floats) -> Floats:
    """Up to three round numbers that show how wide lines are; of whole numbers no parts of one."""
    largest = float(values.max(initial=0.0))
    if largest <= 0:
        return np.empty(0)
    top = round_below(largest)
    steps = np.array([top / 5, top / 2, top])
    return steps[steps >= 1] if (values == np.rint(values)).all() else steps


def points_of(lines: npt.NDArray[Any]) -> list[Floats]:
    """Coordinates of shapely lines, one array of shape (points, 2) a line."""
    import shapely

    points, line = shapely.get_coordinates(lines, return_index=True)
    return np.split(points, np.searchsorted(line, np.arange(1, len(lines))))


def speed_scale() -> tuple[ListedColormap, BoundaryNorm]:
    """The colours of percent of free speed, in the classes that all pictures share."""
    from matplotlib.colors import BoundaryNorm, ListedColormap

    bounds = [100 * speed.lower for speed in SPEED_CLASSES] + [100.0]
    colours = ListedColormap([speed.colour for speed in SPEED_CLASSES])
    return colours, BoundaryNorm(bounds, colours.N)
