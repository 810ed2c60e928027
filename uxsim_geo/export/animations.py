"""Moving maps: links by their traffic, or vehicles on their way, as GIF files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from uxsim_geo.analysis.passages import Floats, Passages
from uxsim_geo.analysis.samples import Samples
from uxsim_geo.export.colours import NEUTRAL, SPEED_CLASSES
from uxsim_geo.export.map_plane import MapPlane
from uxsim_geo.files import replace_when_complete
from uxsim_geo.network.network import Network

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROAD = 0.6  # line width of a link without traffic, points
WIDEST = 9.0  # of a link full of vehicles, points
DOT = 26.0  # area of a platoon's dot, square points
DPI = 80
SIZE = 6.0  # of the longer side, inches
EDGE = 0.02  # around the map, of its longer side


def animate_links(network: Network, states: pd.DataFrame, path: Path, frame_ms: float) -> None:
    """Write a GIF of a map with one frame a time bin: width is density, colour speed.

    ``states`` comes from :func:`uxsim_geo.analysis.link_states.link_times`; a link at jam density
    is as wide as a link can be. Raises ValueError if the network has no geometry.
    """
    import shapely
    from matplotlib.collections import LineCollection

    links = network.links
    jam = (links["jam_density"] * links["lanes"]).to_numpy(float)[:, None]
    share = states["density"].to_numpy(float).reshape(len(links), -1) / jam
    speed = states["speed"].to_numpy(float).reshape(len(links), -1)
    percent = 100 * speed / links["free_speed"].to_numpy(float)[:, None]
    begin = states["begin_s"].to_numpy(float)[: share.shape[1]]
    figure, axes, plane = _base(
        network, "width: density, widest at jam density; traffic stands to the right of its road"
    )
    lines = [shapely.get_coordinates(line) for line in plane.to_the_right(_beside(plane))]
    traffic = LineCollection(lines, zorder=2)
    _colour(traffic, figure, axes)
    axes.add_collection(traffic)

    def draw(frame: int) -> None:
        axes.set_title(f"{begin[frame]:,.0f} s")
        traffic.set_array(np.minimum(percent[:, frame], 100.0))
        widths = np.where(share[:, frame] > 0, ROAD + WIDEST * share[:, frame], 0.0)
        traffic.set_linewidth(widths.tolist())

    _write(figure, draw, begin.size, path, frame_ms)


def animate_vehicles(
    network: Network,
    passages: Passages,
    samples: Samples,
    path: Path,
    frame_ms: float,
) -> None:
    """Write a GIF of a map with one frame a moment: a dot for every platoon, colour its speed.

    Raises ValueError if the network has no geometry.
    """
    import shapely

    figure, axes, plane = _base(network, "each dot is a platoon")
    link = passages.link[samples.row]
    lines = plane.to_the_right(_beside(plane))[link]
    share = samples.position / passages.geometry.length[link]
    points = shapely.get_coordinates(shapely.line_interpolate_point(lines, share, normalized=True))
    percent = np.minimum(100 * samples.speed / passages.geometry.free_speed[link], 100.0)
    moments = np.unique(samples.time)
    order = np.argsort(samples.time, kind="stable")
    first = np.searchsorted(samples.time[order], np.append(moments, np.inf))
    dots = axes.scatter([], [], s=DOT, zorder=3, linewidths=0)
    _colour(dots, figure, axes)

    def draw(frame: int) -> None:
        here = order[first[frame] : first[frame + 1]]
        axes.set_title(f"{moments[frame]:,.0f} s")
        dots.set_offsets(points[here])
        dots.set_array(percent[here])

    _write(figure, draw, moments.size, path, frame_ms)


def _base(network: Network, legend: str) -> tuple[Figure, Axes, MapPlane]:
    """Draw the roads in grey."""
    import shapely
    from matplotlib.collections import LineCollection
    from matplotlib.figure import Figure

    plane = MapPlane.of(network)
    x0, y0, x1, y1 = plane.extent
    shape = np.clip(np.array([x1 - x0, y1 - y0]) / max(x1 - x0, y1 - y0), 0.4, 1.0)
    figure = Figure(figsize=(SIZE * shape[0] + 1.2, SIZE * shape[1] + 0.6), dpi=DPI)
    figure.set_layout_engine("constrained")
    axes = figure.add_subplot()
    margin = EDGE * max(x1 - x0, y1 - y0)  # else the widest lines at the edge would be cut
    axes.set(xlim=(x0 - margin, x1 + margin), ylim=(y0 - margin, y1 + margin))
    axes.set(aspect="equal", title=" ")
    axes.set_axis_off()
    roads = [shapely.get_coordinates(line) for line in plane.lines]
    axes.add_collection(LineCollection(roads, colors=NEUTRAL, linewidths=ROAD, zorder=1))
    axes.text(0.0, -0.02, legend, transform=axes.transAxes, fontsize=8, va="top")
    return figure, axes, plane


def _beside(plane: MapPlane) -> Floats:
    """Map units by which traffic stands to the right of its road."""
    x0, y0, x1, y1 = plane.extent
    return np.full(len(plane.lines), 0.03 * max(x1 - x0, y1 - y0) / SIZE)


def _colour(artist: object, figure: Figure, axes: Axes) -> None:
    """Let an artist show speeds in the classes that all pictures share."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import BoundaryNorm, ListedColormap

    assert isinstance(artist, ScalarMappable)
    bounds = [100 * speed.lower for speed in SPEED_CLASSES] + [100.0]
    artist.set_cmap(ListedColormap([speed.colour for speed in SPEED_CLASSES]))
    artist.set_norm(BoundaryNorm(bounds, len(SPEED_CLASSES)))
    bar = figure.colorbar(artist, ax=axes, shrink=0.6, pad=0.02, format="%d")
    bar.set_label("speed, % of free speed")


def _write(
    figure: Figure, draw: Callable[[int], None], frames: int, path: Path, frame_ms: float
) -> None:
    from matplotlib.animation import PillowWriter
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    FigureCanvasAgg(figure)
    writer = PillowWriter(fps=1000.0 / frame_ms)  # type: ignore[arg-type]  # need not be whole
    with (
        replace_when_complete(path) as temporary,
        writer.saving(figure, str(temporary), dpi=DPI),
    ):
        for frame in range(frames):
            draw(frame)
            writer.grab_frame()
