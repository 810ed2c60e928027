"""A moving map of vehicles: a dot for every platoon, and the way it came as a fading trail."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.samples import Samples
from uxsim_geo.analysis.trajectories import LinkLines
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.errors import Faults
from uxsim_geo.export.attribution import add_attribution
from uxsim_geo.export.clock import Clock
from uxsim_geo.export.colours import NEUTRAL, SPEED_CLASSES
from uxsim_geo.export.film import (
    MovingMap,
    Progress,
    add_time,
    check_film,
    check_pictures,
    write_film,
)
from uxsim_geo.export.map_sheet import INK, MapSheet, speed_scale
from uxsim_geo.export.trails import trails
from uxsim_geo.network.driving_side import DrivingSide
from uxsim_geo.network.network import Network

if TYPE_CHECKING:
    from matplotlib.collections import LineCollection, PathCollection

TRAIL = 6  # pictures over which the way of a vehicle fades
STRONGEST = 0.7  # opacity of the newest part of a trail


def animate_vehicles(  # noqa: PLR0913 -- what the film looks like, by keyword alone
    network: Network,
    passages: Passages,
    samples: Samples,
    path: Path,
    *,
    frame_ms: float,
    trail: int = TRAIL,
    driving_side: DrivingSide = "right",
    attribution: str = "",
    progress: Progress | None = None,
) -> None:
    """Write a moving map with a picture a moment: a dot for every platoon, and a fading trail.

    ``samples`` say where platoons are at multiples of their interval (those of some vehicles, or
    within some hours, if only they are to be seen). The colour of a dot is its speed from then on,
    relative to free speed, that of a trail its speed until then. A trail is the exact way on the
    lines of the links over the last ``trail`` pictures; 0: none. The ending of ``path`` is .gif or
    .mp4; a picture lasts ``frame_ms``; ``attribution`` is named at its foot; ``progress`` is told
    the share that is done.

    Without any sample the clock runs over the empty roads of the whole simulation.

    Raises :class:`uxsim_geo.errors.InputError` for a film that cannot be written or has too many
    pictures, or for a trail below 0, and ValueError if the network has no geometry.
    """
    check_film(path, frame_ms)
    _check_trail(trail)
    number, moments = _moments(samples, passages.end)
    check_pictures(moments.size, "interval", samples.interval)
    sheet = MapSheet.of(network, "", driving_side)
    roads = sheet.beside(np.full(len(sheet.plane.lines), _dot_size(sheet)))
    sheet.draw_roads(roads)
    sheet.draw_scale()
    add_attribution(sheet.figure, attribution)
    lines = LinkLines.of(roads)
    dots = _dots(sheet)
    places = _places(passages, samples, lines, number, moments.size)
    fading = _trails(sheet)
    rows = np.flatnonzero(np.isin(passages.vehicle, passages.vehicle[samples.row]))
    driven = trails(passages, lines, rows, moments)
    latest: deque[list[Floats]] = deque(maxlen=trail)
    time, clock = add_time(sheet), Clock.of(None, moments)
    if samples.time.size:
        _draw_legend(sheet, passages, trail * samples.interval)
    else:
        sheet.note("nobody on the way")

    def draw(picture: int) -> None:
        latest.append(next(driven))
        _fade(fading, latest, trail)
        offsets, percent = next(places)
        dots.set_offsets(offsets)
        dots.set_array(percent)
        time.set_text(clock.text(moments[picture]))

    film = MovingMap(sheet, (fading, dots, time), draw, moments.size)
    write_film(film, path, frame_ms, progress)


def _check_trail(trail: int) -> None:
    faults = Faults("film")
    if trail < 0:
        faults.add("must be a number of pictures, 0 or more", column="trail", value=trail)
    faults.raise_if_any()


def _moments(samples: Samples, end: float) -> tuple[Integers, Floats]:
    """The number of each sample's picture, and the moments of all, also those without a sample."""
    if not samples.time.size:
        pictures = max(int(np.ceil(end / samples.interval)), 1)
        return np.empty(0, np.int64), np.arange(pictures) * np.float64(samples.interval)
    start = float(samples.time.min())
    number = np.rint((samples.time - start) / samples.interval).astype(np.int64)
    moments: Floats = start + np.arange(int(number.max()) + 1) * np.float64(samples.interval)
    return number, moments


def _places(
    passages: Passages, samples: Samples, lines: LinkLines, number: Integers, pictures: int
) -> Iterator[tuple[Floats, Floats]]:
    """For every picture where platoons are on the map, and their speeds, % of free speed."""
    link = passages.link[samples.row]
    free_speed = passages.geometry.free_speed[link]
    percent = np.minimum(100 * samples.speed / free_speed, 100.0)
    slowest_last = np.lexsort((-percent, number))
    first = np.searchsorted(number[slowest_last], np.arange(pictures + 1))
    for picture in range(pictures):
        here = slowest_last[first[picture] : first[picture + 1]]
        shares = samples.position[here] / passages.geometry.length[link[here]]
        yield np.stack(lines.points(link[here], shares), axis=1), percent[here]


def _dot_size(sheet: MapSheet) -> float:
    """Diameter of a dot, points."""
    return float(np.clip(0.3 * sheet.usual, 1.8, 5.0))


def _dots(sheet: MapSheet) -> PathCollection:
    colours, norm = speed_scale()
    style: dict[str, Any] = {"cmap": colours.with_extremes(bad=NEUTRAL), "norm": norm, "zorder": 4}
    size = _dot_size(sheet) ** 2
    dots = sheet.axes.scatter([], [], s=size, c=[], linewidths=0, plotnonfinite=True, **style)
    sheet.colour_bar(dots, "speed, % of free speed", format="%d")
    return dots


def _trails(sheet: MapSheet) -> LineCollection:
    from matplotlib.collections import LineCollection

    width = 0.55 * _dot_size(sheet)
    lines = LineCollection([], linewidths=width, capstyle="butt", joinstyle="round", zorder=3)
    sheet.axes.add_collection(lines, autolim=False)
    return lines


def _fade(lines: LineCollection, latest: deque[list[Floats]], most: int) -> None:
    """Show the ways driven between the last moments, the older the paler and the lower.

    All ways of one age and class are one line with gaps, so that 20,000 vehicles are few lines.
    """
    from matplotlib.colors import to_rgb

    ways, colours = [], []
    for age in range(len(latest)):  # the oldest first
        opacity = STRONGEST * (age + 1 + most - len(latest)) / most
        for points, speed in zip(latest[age][::-1], SPEED_CLASSES[::-1], strict=True):
            if len(points):
                ways.append(points)
                colours.append((*to_rgb(speed.colour), opacity))
    lines.set_segments(ways)
    lines.set_color(colours)


def _draw_legend(sheet: MapSheet, passages: Passages, faded: float) -> None:
    from matplotlib.lines import Line2D

    most = passages.vehicles.max(initial=0.0)
    style: dict[str, Any] = {"marker": "o", "linestyle": "", "markeredgewidth": 0}
    handles = [Line2D([], [], color=INK, markersize=max(_dot_size(sheet), 3.0), **style)]
    labels = [f"platoon of\nup to {most:,.0f} veh" if most > 1 else "vehicle"]
    if faded > 0:
        handles.append(Line2D([], [], color=INK, linewidth=2.0, alpha=STRONGEST))
        labels.append(f"its way in the\nlast {faded:,.4g} s")
    sheet.legend(handles, labels, "")
