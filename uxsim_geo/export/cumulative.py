"""Cumulative curves of a link: vehicles that have entered and left it over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from uxsim_geo.analysis.passages import Floats, Passages
from uxsim_geo.export.trajectories import rows_of_links
from uxsim_geo.network.network import Network

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def cumulative_figure(
    network: Network,
    passages: Passages,
    link_id: str,
    duration: float,
    size: tuple[float, float] = (6.0, 4.0),
) -> Figure:
    """Draw the numbers of vehicles that have entered and left a link, and those on it between.

    ``duration`` is how far the simulation has come, s; ``size`` in inches. Raises ValueError if
    the link is not in the network.
    """
    from matplotlib.figure import Figure

    (link,) = rows_of_links(network, [link_id])
    own = slice(passages.first[link], passages.first[link + 1])
    vehicles, left = passages.vehicles[own], passages.exit[own] <= duration
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.add_subplot()
    for times, counted, label, colour in (
        (passages.enter[own], vehicles, "entered", "#2b6fad"),
        (passages.exit[own][left], vehicles[left], "left", "#e0592a"),
    ):
        moments, total = _curve(times, counted, duration)
        axes.step(moments, total, where="post", color=colour, label=label)
    axes.set(title=f"link {link_id}", xlabel="time, s", ylabel="vehicles since the start")
    axes.set(xlim=(0, duration), ylim=(0, None))
    axes.grid(color="#e6e6e6", linewidth=0.6)
    axes.legend(loc="upper left", frameon=False)
    return figure


def _curve(times: Floats, vehicles: Floats, duration: float) -> tuple[Floats, Floats]:
    order = np.argsort(times, kind="stable")
    total = np.concatenate(([0.0], np.cumsum(vehicles[order])))
    return np.concatenate(([0.0], times[order], [duration])), np.append(total, total[-1])
