"""Links that follow one another, as the vertical axis of a time-space diagram."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from uxsim_geo.analysis.types import Floats
from uxsim_geo.export.map_sheet import POINTS_PER_INCH

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: when a signal is red: begin and end of each red, s
Reds = Sequence[tuple[float, float]]

LONGEST_TITLE = 80  # letters
NAME = 8.0  # size of a link's name, points
RED = "#c00000"
CROWDED = 20  # links; lines between more of them are thin and grey


def starts_of_links(lengths: Floats) -> Floats:
    """Where each link begins and, last, where the last one ends, m."""
    return np.concatenate(([0.0], np.cumsum(lengths)))


def draw_reds(figure: Figure, lengths: Floats, reds: Sequence[Reds]) -> None:
    """Mark red signals at the ends of links in their time-space diagram.

    ``lengths`` (m) are of the links upwards, ``reds`` for each of them when its signal is red:
    pairs of times, s.
    """
    from matplotlib.collections import LineCollection

    places = starts_of_links(lengths)[1:]
    lines = [
        [(begin, place), (end, place)]
        for place, own in zip(places, reds, strict=True)
        for begin, end in own
    ]
    # not cut off by the frame: the last signal stands on it
    marks = LineCollection(lines, colors=RED, linewidths=2.5, zorder=5, clip_on=False)
    figure.axes[0].add_collection(marks, autolim=False)


def note_nobody(axes: Axes) -> None:
    """Say in the middle of empty axes that they are so because nobody drove."""
    style: dict[str, Any] = {"ha": "center", "va": "center", "color": "#5f5f5f", "zorder": 4}
    style["bbox"] = {"facecolor": "white", "edgecolor": "none", "pad": 2.0}
    axes.text(0.5, 0.5, "nobody drove", transform=axes.transAxes, **style)


def title_of_links(link_ids: Sequence[str]) -> str:
    """Links in their order; of more than fit over the picture, the first and the last."""
    if len(link_ids) == 1:
        return f"link {link_ids[0]}"
    whole = " → ".join(link_ids)
    if len(whole) <= LONGEST_TITLE:
        return whole
    return f"{link_ids[0]} → … → {link_ids[-1]} ({len(link_ids)} links)"


def name_links(axes: Axes, link_ids: Sequence[str], starts: Floats, height: float) -> None:
    """Lines between the links, and beside them as many of their names as there is room for.

    ``starts`` are those of :func:`starts_of_links`, ``height`` is that of the figure, inches.
    """
    if len(link_ids) == 1:
        return
    crowded = len(link_ids) > CROWDED
    for start in starts[1:-1]:
        axes.axhline(
            start, color="#999999" if crowded else "black", linewidth=0.4 if crowded else 0.8
        )
    middles = (starts[:-1] + starts[1:]) / 2
    room = 1.3 * NAME / (0.75 * height * POINTS_PER_INCH) * starts[-1]
    named: list[int] = []
    for link, middle in enumerate(middles):
        if not named or middle - middles[named[-1]] >= room:
            named.append(link)
    names = axes.secondary_yaxis("right")
    names.set_yticks(middles[named], labels=[link_ids[link] for link in named], fontsize=NAME)
    names.tick_params(length=0)
