"""Time-space diagrams: the way of every platoon along links that follow one another."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.subsets import rows_in_order
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.export.breakpoints import Ways, ways_on_link
from uxsim_geo.export.corridor import name_links, note_nobody, starts_of_links, title_of_links
from uxsim_geo.export.map_sheet import speed_scale
from uxsim_geo.network.network import Network

if TYPE_CHECKING:
    from matplotlib.collections import LineCollection
    from matplotlib.figure import Figure

LINE = "#2b6fad"
COLOUR_STEPS = 240  # over the duration
AROUND = 2  # steps before and after over which a speed is taken: platoons stand and drive by turns


def trajectories_figure(  # noqa: PLR0913 -- how it looks, by keyword or by default
    network: Network,
    passages: Passages,
    link_ids: Sequence[str],
    duration: float,
    size: tuple[float, float] = (12.0, 4.0),
    *,
    by_speed: bool = False,
) -> Figure:
    """Draw the trajectories of all platoons on some links, one after the other upwards.

    ``duration`` is how far the simulation has come, s; ``size`` in inches. A platoon that leaves
    by another link ends there. The lines are exact, unless they bend millions of times.
    ``by_speed`` gives them the colours of the speed relative to free speed, the mean over 1/60 of
    the duration: in a queue platoons stand and drive by turns. Raises
    :class:`uxsim_geo.errors.InputError` if a link is not in the network.
    """
    from matplotlib.figure import Figure

    rows = rows_in_order(network, link_ids)
    starts = starts_of_links(passages.geometry.length[rows])
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.add_subplot()
    cuts = np.arange(1, COLOUR_STEPS) * duration / COLOUR_STEPS if by_speed else None
    platoons = int((passages.first[rows + 1] - passages.first[rows]).max())
    style: dict[str, Any] = {"linewidths": float(np.clip(12 / max(platoons, 1) ** 0.5, 0.25, 0.8))}
    for row, start in zip(rows, starts, strict=False):
        ways = ways_on_link(passages, int(row), duration, cuts)
        if cuts is None:
            lines = _plain(ways, float(start), style)
        else:
            lines = _coloured(ways, float(start), passages, cuts, style)
        axes.add_collection(lines)
    if by_speed:
        bar = figure.colorbar(lines, ax=axes, pad=0.01, format="%d")
        bar.set_label("speed, % of free speed")
    axes.set(xlim=(0, duration), ylim=(0, starts[-1]), xlabel="time, s")
    axes.set_ylabel("distance, m")
    axes.set_title(title_of_links(link_ids))
    axes.grid(color="#e6e6e6", linewidth=0.6)
    axes.set_axisbelow(True)
    name_links(axes, link_ids, starts, size[1])
    if not platoons:
        note_nobody(axes)
    return figure


def _plain(ways: Ways, start: float, style: dict[str, Any]) -> LineCollection:
    from matplotlib.collections import LineCollection

    return LineCollection(ways.lines(start), colors=LINE, **style)


def _coloured(
    ways: Ways, start: float, passages: Passages, cuts: Floats, style: dict[str, Any]
) -> LineCollection:
    """Lines from point to point, in the colours of the mean speed around."""
    from matplotlib.collections import LineCollection

    points = np.stack([ways.time, start + ways.position], axis=1)
    here = np.flatnonzero(np.diff(ways.row) == 0)
    colours, norm = speed_scale()
    percent = _percent(ways, here, passages, cuts)
    lines = np.stack([points[here], points[here + 1]], axis=1)
    return LineCollection(list(lines), array=percent, cmap=colours, norm=norm, **style)


def _percent(ways: Ways, here: Integers, passages: Passages, cuts: Floats) -> Floats:
    """Mean speed, % of free speed, of the lines from points ``here``, over some steps around."""
    row, step = ways.row[here], cuts[0]
    middle = (np.searchsorted(cuts, ways.time[here], side="right") + 0.5) * step
    since = np.maximum(middle - AROUND * step, passages.enter[row])
    until = np.minimum(middle + AROUND * step, np.minimum(passages.exit[row], cuts[-1] + step))
    places = passages.positions(np.tile(row, 2), np.concatenate([since, until]))
    driven = places[len(row) :] - places[: len(row)]
    free = (until - since) * passages.geometry.free_speed[passages.link[row]]
    percent: Floats = np.minimum(100 * driven / np.maximum(free, 1e-9), 100.0)
    return percent
