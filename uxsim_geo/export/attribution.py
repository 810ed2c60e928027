"""Whose data a figure shows, named on it."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

from uxsim_geo.export.map_sheet import INK, POINTS_PER_INCH

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LETTERS = 6.5  # height, points
WIDTH = 0.58  # of a letter, at most on average, of its height
LINE = 1.3  # from line to line, of its height
EDGE = 4.0  # of the paper, points


def add_attribution(figure: Figure, text: str) -> None:
    """Name in small letters at the foot who is to be named; an empty text changes nothing.

    The figure grows downwards by the lines that it takes, so that they cover nothing.
    """
    if not text:
        return
    width, height = figure.get_size_inches()
    letters = int((width * POINTS_PER_INCH - 2 * EDGE) / (WIDTH * LETTERS))
    lines = textwrap.wrap(text, max(letters, 1))
    foot = (len(lines) * LINE * LETTERS + EDGE) / POINTS_PER_INCH
    figure.set_size_inches(width, height + foot)
    _move_up(figure, foot / (height + foot))
    edge = EDGE / POINTS_PER_INCH
    figure.text(
        1 - edge / width,
        edge / (height + foot),
        "\n".join(lines),
        ha="right",
        va="bottom",
        fontsize=LETTERS,
        linespacing=LINE / 1.2,  # matplotlib counts from 1.2 of a letter's height
        color=INK,
        parse_math=False,
    )


def _move_up(figure: Figure, share: float) -> None:
    """Leave a share of the height free at the foot; everything else keeps its size in inches."""
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    engine = figure.get_layout_engine()
    if isinstance(engine, ConstrainedLayoutEngine):
        engine.set(rect=(0.0, share, 1.0, 1.0 - share))
        return
    for axes in figure.axes:
        left, bottom, width, height = axes.get_position(original=True).bounds
        axes.set_position((left, share + bottom * (1 - share), width, height * (1 - share)))
