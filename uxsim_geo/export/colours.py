"""The one scale of colours for speeds, used by map styles, plots and the 3D picture alike.

Blue is free and dark red is standing. The steps differ in lightness as well as in hue, so that
readers with any kind of colour blindness tell them apart, and the middle is dark enough for white
paper.
"""

from __future__ import annotations

from typing import NamedTuple


class SpeedClass(NamedTuple):
    """A range of speed relative to free speed, with its colour."""

    lower: float
    upper: float
    colour: str
    label: str


SPEED_CLASSES = (
    SpeedClass(0.0, 0.2, "#8c0d25", "under 20 % of free speed"),
    SpeedClass(0.2, 0.4, "#e0592a", "20–40 %"),
    SpeedClass(0.4, 0.6, "#f2b84b", "40–60 %"),
    SpeedClass(0.6, 0.8, "#84bcd8", "60–80 %"),
    SpeedClass(0.8, 1.0, "#2b6fad", "80–100 %"),
)

#: of roads without traffic, and of everything that is only there for orientation
NEUTRAL = "#b4b4b4"
NO_TRAFFIC = "no vehicles"
