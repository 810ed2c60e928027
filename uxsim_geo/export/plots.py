"""Two plots for a first look: the state of the network on a map, and its fundamental diagram.

Figures are made without pyplot: no window, no state shared between figures.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from uxsim_geo.analysis.state_grid import StateGrid, check_all_links
from uxsim_geo.analysis.types import Floats
from uxsim_geo.export.colours import NEUTRAL, NO_TRAFFIC
from uxsim_geo.export.corridor import note_nobody
from uxsim_geo.export.map_sheet import INK, MapSheet, legend_steps, points_of, speed_scale
from uxsim_geo.network.driving_side import DrivingSide
from uxsim_geo.network.network import Network
from uxsim_geo.network.units import PER_HOUR, PER_KM

if TYPE_CHECKING:
    from matplotlib.collections import LineCollection
    from matplotlib.figure import Figure


def network_state_figure(  # noqa: PLR0913 -- words and side of the road by keyword alone
    network: Network,
    totals: pd.DataFrame,
    title: str,
    *,
    volume: str = "volume, veh",
    period: str = "over the run",
    driving_side: DrivingSide = "right",
) -> Figure:
    """Map of the whole run: width is the volume, colour the mean speed relative to free speed.

    ``totals`` comes from :func:`uxsim_geo.analysis.link_states.link_totals`; where its volume or
    its speed are those of something else, ``volume`` and ``period`` say of what. Each link stands
    on the ``driving_side`` of its road, so that both directions show; the slowest lie on top.

    Raises ValueError if the network has no geometry, and :class:`uxsim_geo.errors.InputError`
    unless the totals are those of all its links.
    """
    check_all_links(pd.Index(totals["link_id"].astype(str)), network, "totals")
    sheet = MapSheet.of(network, title, driving_side)
    vehicles = totals["volume"].to_numpy(float)
    sheet.draw_roads(sheet.plane.lines[vehicles == 0])
    traffic = _draw_traffic(sheet, network, totals)
    sheet.draw_nodes(network)
    sheet.draw_scale()
    sheet.colour_bar(traffic, f"mean speed {period},\n% of free speed", format="%d")
    _draw_width_legend(sheet, vehicles, volume)
    return sheet.figure


def network_at_time_figure(
    network: Network,
    states: pd.DataFrame,
    time: float,
    title: str,
    driving_side: DrivingSide = "right",
) -> Figure:
    """Map of the time bin in which ``time`` (s) lies, or of the last: width is vehicles on a link.

    ``states`` comes from :func:`uxsim_geo.analysis.link_states.link_times`. Raises ValueError if
    the network has no geometry, and :class:`uxsim_geo.errors.InputError` unless the states are
    those of all its links in all bins.
    """
    StateGrid.of_all(states, network)
    here = states[(states["begin_s"] <= time) & (time < states["end_s"])]
    if here.empty:
        here = states[states["end_s"] == states["end_s"].max()]
    begin, end = here[["begin_s", "end_s"]].iloc[0]
    here = here.assign(volume=here["time"] / (end - begin)).reset_index(drop=True)
    return network_state_figure(
        network,
        here,
        f"{title}: {begin:,.0f} to {end:,.0f} s",
        volume="vehicles on the link",
        period="in this time",
        driving_side=driving_side,
    )


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
    # points at zero stand on the axes, whole
    style: dict[str, Any] = {"cmap": "viridis", "s": 34, "clip_on": False, "zorder": 3}
    style |= {"edgecolors": "black", "linewidths": 0.4}
    points = axes.scatter(density, flow, c=minutes, **style)
    if not density.any():
        note_nobody(axes)
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


def _draw_traffic(sheet: MapSheet, network: Network, totals: pd.DataFrame) -> LineCollection:
    """Links with traffic beside the middle of their roads, the slowest on top."""
    from matplotlib.collections import LineCollection

    volume = totals["volume"].to_numpy(float)
    widths = line_widths(sheet, volume)
    percent = 100 * totals["speed"].to_numpy(float) / network.links["free_speed"].to_numpy(float)
    slowest_last = np.argsort(-percent, kind="stable")
    used = slowest_last[volume[slowest_last] > 0]
    colours, norm = speed_scale()
    traffic = LineCollection(
        points_of(sheet.beside(widths)[used]),
        array=np.minimum(percent[used], 100.0),
        cmap=colours,
        norm=norm,
        linewidths=widths[used],
        # circles of nodes hide the gaps that turns leave; where there are none, round ends do
        capstyle="butt" if sheet.names_nodes else "round",
        zorder=2,
    )
    sheet.axes.add_collection(traffic)
    return traffic


def line_widths(sheet: MapSheet, volume: Floats) -> Floats:
    """Points, linear in volume, up to the widest line that the map has room for."""
    share = volume / max(float(volume.max(initial=0.0)), 1e-9)
    widths: Floats = sheet.narrowest + (sheet.widest - sheet.narrowest) * share
    return widths


def _draw_width_legend(sheet: MapSheet, volume: Floats, title: str) -> None:
    from matplotlib.lines import Line2D

    steps = legend_steps(volume)
    widths = line_widths(sheet, np.append(steps, volume.max(initial=0.0)))[:-1]
    handles = [Line2D([], [], color=INK, linewidth=width) for width in widths]
    labels = [f"{number:,.3g}" if number < 10 else f"{number:,.0f}" for number in steps]
    if (volume == 0).any():
        handles.append(Line2D([], [], color=NEUTRAL, linewidth=sheet.thin))
        labels.append(NO_TRAFFIC)
    sheet.legend(handles, labels, title if len(steps) else "")
    if not len(steps):
        sheet.note("nobody drove")
