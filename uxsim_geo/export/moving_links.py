"""A moving map of the links: how dense and how fast their traffic is, bin by bin."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from uxsim_geo.analysis.state_grid import StateGrid
from uxsim_geo.analysis.types import Floats
from uxsim_geo.export.attribution import add_attribution
from uxsim_geo.export.clock import Clock
from uxsim_geo.export.film import (
    MovingMap,
    Progress,
    add_time,
    check_film,
    check_pictures,
    write_film,
)
from uxsim_geo.export.map_sheet import INK, MapSheet, points_of, speed_scale
from uxsim_geo.network.driving_side import DrivingSide
from uxsim_geo.network.network import Network

SHOWN_SHARES = (0.2, 0.5, 1.0)  # of jam density, in the legend


def animate_links(  # noqa: PLR0913 -- what the film looks like, by keyword alone
    network: Network,
    states: pd.DataFrame,
    path: Path,
    *,
    frame_ms: float,
    driving_side: DrivingSide = "right",
    attribution: str = "",
    progress: Progress | None = None,
) -> None:
    """Write a moving map with a picture a time bin: width is density, colour speed.

    ``states`` comes from :func:`uxsim_geo.analysis.link_states.link_times`; a link at jam density
    is as wide as a link can be, and the slowest lie on top. The ending of ``path`` is .gif or .mp4;
    a picture lasts ``frame_ms``; ``attribution`` is named at its foot; ``progress`` is told the
    share that is done. Raises
    :class:`uxsim_geo.errors.InputError` for a film that cannot be written or states that are not
    those of all links in all bins, and ValueError if the network has no geometry.
    """
    from matplotlib.collections import LineCollection

    check_film(path, frame_ms)
    grid = StateGrid.of_all(states, network)
    check_pictures(len(grid.begin), "bin_s", float(grid.end[0] - grid.begin[0]))
    sheet = MapSheet.of(network, "", driving_side)
    roads = sheet.beside(np.full(len(sheet.plane.lines), sheet.widest))
    sheet.draw_roads(roads)
    sheet.draw_scale()
    add_attribution(sheet.figure, attribution)
    share, percent = _shares(network, grid)
    begin, end = grid.begin, grid.end
    lines = points_of(roads)
    colours, norm = speed_scale()
    traffic = LineCollection([], cmap=colours, norm=norm, capstyle="butt", zorder=2)
    sheet.axes.add_collection(traffic, autolim=False)
    sheet.colour_bar(traffic, "speed, % of free speed", format="%d")
    _draw_legend(sheet)
    time, clock = add_time(sheet), Clock.of(None, [*begin, *end])

    def draw(number: int) -> None:
        slowest_last = np.argsort(-percent[:, number], kind="stable")
        used = slowest_last[share[slowest_last, number] > 0]
        traffic.set_segments([lines[link] for link in used])
        traffic.set_linewidth(_widths(sheet, share[used, number]).tolist())
        traffic.set_array(percent[used, number])
        time.set_text(clock.span(begin[number], end[number]))

    write_film(MovingMap(sheet, (traffic, time), draw, begin.size), path, frame_ms, progress)


def _shares(network: Network, grid: StateGrid) -> tuple[Floats, Floats]:
    """Density as a share of that of a jam, and percent of free speed; shape (links, bins)."""
    links = network.links
    jam = (links["jam_density"] * links["lanes"]).to_numpy(float)[:, None]
    density, speed = grid.values("density"), grid.values("speed")
    percent = np.minimum(100 * speed / links["free_speed"].to_numpy(float)[:, None], 100.0)
    return np.minimum(density / jam, 1.0), percent


def _widths(sheet: MapSheet, share: Floats) -> Floats:
    return sheet.narrowest + (sheet.widest - sheet.narrowest) * share


def _draw_legend(sheet: MapSheet) -> None:
    from matplotlib.lines import Line2D

    widths = _widths(sheet, np.array(SHOWN_SHARES))
    handles = [Line2D([], [], color=INK, linewidth=width) for width in widths]
    labels = [f"{100 * share:.0f} %" for share in SHOWN_SHARES]
    sheet.legend(handles, labels, "density,\nof jam density")
