"""Time-space diagrams: the way of every platoon along links that follow one another."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from uxsim_geo.analysis.passages import Floats, Integers, Passages
from uxsim_geo.network.network import Network

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LINE = "#2b6fad"
LONGEST_TITLE = 80  # letters
FEWEST_POINTS = 24  # of a platoon's way over a link; enough for every stop to show


def trajectories_figure(
    network: Network,
    passages: Passages,
    link_ids: Sequence[str],
    duration: float,
    size: tuple[float, float] = (12.0, 4.0),
) -> Figure:
    """Draw the trajectories of all platoons on some links, one after the other upwards.

    ``duration`` is how far the simulation has come, s; ``size`` in inches. A platoon that leaves
    by another link ends there. Raises ValueError if a link is not in the network.
    """
    from matplotlib.collections import LineCollection
    from matplotlib.figure import Figure

    rows = rows_of_links(network, link_ids)
    starts = np.concatenate(([0.0], np.cumsum(passages.geometry.length[rows])))
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.add_subplot()
    for row, start in zip(rows, starts, strict=False):
        lines = _lines(passages, int(row), float(start), duration)
        axes.add_collection(LineCollection(list(lines), colors=LINE, linewidths=0.6))
    axes.set(xlim=(0, duration), ylim=(0, starts[-1]), xlabel="time, s")
    axes.set_ylabel("distance, m")
    axes.set_title(_title(link_ids))
    axes.grid(color="#e6e6e6", linewidth=0.6)
    axes.set_axisbelow(True)
    if len(link_ids) > 1:
        _name_links(axes, link_ids, starts)
    return figure


def _title(link_ids: Sequence[str]) -> str:
    """Links in their order; of more than fit over the picture, the first and the last."""
    if len(link_ids) == 1:
        return f"link {link_ids[0]}"
    whole = " → ".join(link_ids)
    if len(whole) <= LONGEST_TITLE:
        return whole
    return f"{link_ids[0]} → … → {link_ids[-1]} ({len(link_ids)} links)"


def rows_of_links(network: Network, link_ids: Sequence[str]) -> Integers:
    """Rows of some links in the table; raises ValueError where there is none."""
    position = {str(name): row for row, name in enumerate(network.links["link_id"])}
    missing = [name for name in link_ids if name not in position]
    if missing or not link_ids:
        raise ValueError(f"the network has no link {', '.join(missing)}" if missing else "no links")
    return np.array([position[name] for name in link_ids], np.int64)


def _lines(passages: Passages, link: int, start: float, duration: float) -> Floats:
    """Points of the trajectories on a link, shape (passages, points, 2): time, distance."""
    own = np.arange(passages.first[link], passages.first[link + 1])
    end = np.minimum(passages.exit[own], duration)
    share = np.linspace(0.0, 1.0, FEWEST_POINTS)
    times = passages.enter[own, None] + (end - passages.enter[own])[:, None] * share
    rows = np.repeat(own, FEWEST_POINTS)
    place = passages.positions(rows, times.ravel()).reshape(times.shape)
    lines: Floats = np.stack([times, start + place], axis=2)
    return lines


def _name_links(axes: Axes, link_ids: Sequence[str], starts: Floats) -> None:
    for start in starts[1:-1]:
        axes.axhline(start, color="black", linewidth=0.8)
    middles = (starts[:-1] + starts[1:]) / 2
    names = axes.secondary_yaxis("right")
    names.set_yticks(middles, labels=list(link_ids))
    names.tick_params(length=0)
