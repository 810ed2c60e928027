"""What the page's map can show, with the classes and colours of each quantity.

Speed has the classes of all maps of a run. The others go from light to dark on paper, and from
dark to light on a dark ground: what is most stands out on both.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from uxsim_geo.analysis.types import Floats
from uxsim_geo.export.colours import SPEED_CLASSES

#: viridis in five steps, from little to much, on white
RISING = ("#9fd53c", "#36b477", "#25838e", "#3b528b", "#440154")

#: the same on a dark ground
RISING_ON_DARK = ("#46608f", "#2a8a8e", "#3cb878", "#a6d93a", "#fde725")

#: speed classes on a dark ground, from standing to free
SPEED_ON_DARK = ("#ff4f64", "#ff9350", "#ffd479", "#86b9d8", "#4a86bf")

#: shares of the values from :data:`LEAST` on that lie below the first to the fourth break
SHARES = (0.4, 0.7, 0.9, 0.98)

#: less than this is nothing: three seconds of delay, and what rounding leaves of none
LEAST = 0.05


class Quantity(NamedTuple):
    """Something to show: classes are separated by ``breaks``, ascending, in ``unit``."""

    key: str
    label: str
    unit: str
    breaks: tuple[float, ...]
    labels: tuple[str, ...]
    colours: tuple[str, ...]
    colours_on_dark: tuple[str, ...]


def quantities(values: dict[str, Floats]) -> list[Quantity]:
    """All of them; ``values`` of the states that occur serve to choose the breaks of the others.

    Keys are volume (veh/h), density (veh/km), delay (veh·min) and queue (m).
    """
    speed = Quantity(
        "speed",
        "Speed",
        "share of free speed",
        tuple(entry.upper for entry in SPEED_CLASSES[:-1]),
        tuple(entry.label for entry in SPEED_CLASSES),
        tuple(entry.colour for entry in SPEED_CLASSES),
        SPEED_ON_DARK,
    )
    told = (
        ("volume", "Volume", "vehicles per hour"),
        ("density", "Density", "vehicles per km, all lanes"),
        ("delay", "Delay", "vehicle-minutes lost in the time step"),
        ("queue", "Queue", "metres at the end of the time step"),
    )
    return [speed, *(_rising(*names, values[names[0]]) for names in told)]


def _rising(key: str, label: str, unit: str, values: Floats) -> Quantity:
    breaks = round_breaks(values[values >= LEAST])
    labels = (
        f"under {breaks[0]:,g}",
        *(f"{low:,g}–{high:,g}" for low, high in pairwise(breaks)),
        f"{breaks[-1]:,g} and more",
    )
    return Quantity(key, label, unit, breaks, labels, RISING, RISING_ON_DARK)


def round_breaks(values: Floats, shares: Sequence[float] = SHARES) -> tuple[float, ...]:
    """Breaks with one or two digits, ascending, near those shares of values, all positive."""
    wanted = np.quantile(values, shares) if len(values) else np.arange(1.0, len(shares) + 1)
    breaks: list[float] = []
    for value in wanted:
        step = _round(float(value))
        breaks.append(step if not breaks or step > breaks[-1] else _next_round(breaks[-1]))
    return tuple(breaks)


#: mantissas of round numbers
ROUND = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)


def _round(value: float) -> float:
    power = 10.0 ** np.floor(np.log10(value))
    return float(min((m * power for m in (*ROUND, 10.0)), key=lambda step: abs(step - value)))


def _next_round(value: float) -> float:
    power = 10.0 ** np.floor(np.log10(value * (1 + 1e-9)))
    return float(min(m * power for m in (*ROUND, 10.0, 15.0) if m * power > value * (1 + 1e-9)))
