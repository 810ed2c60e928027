"""Classes of colour of a picture in space and time, and the bar that explains them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.export.colours import SPEED_CLASSES
from uxsim_geo.export.space_time.choice import Choice
from uxsim_geo.export.space_time.look import Look

#: of densities, from few vehicles to a jam: as matplotlib's inferno backwards, without its ends
DENSITIES = ("#fbb61a", "#ed6925", "#bc3754", "#781c6d", "#320a5e")


@dataclass(frozen=True)
class Scale:
    """Even classes from 0 to ``top`` with their colours (#rrggbb); title with the unit."""

    title: str
    top: float
    colours: tuple[str, ...]

    @classmethod
    def of(cls, look: Look, choice: Choice) -> Scale:
        """Speeds have the colours of all pictures; densities end at a jam."""
        if look.colour == "speed":
            colours = tuple(speed.colour for speed in SPEED_CLASSES)
            return cls("speed, % of free speed", 100.0, colours)
        most = float(choice.jam[choice.links].max(initial=0.0)) or float(choice.jam.max())
        top = round_above(most, len(DENSITIES))
        return cls("density, veh/km per lane", top, DENSITIES)

    def classes(self, values: Floats) -> Integers:
        """The class of each value; −1 where there is none."""
        count = len(self.colours)
        number = np.minimum(np.nan_to_num(values) * count / self.top, count - 1)
        return np.where(np.isnan(values), -1, number).astype(np.int64)

    def labels(self) -> list[str]:
        """The figures between classes, from 0 on."""
        count = len(self.colours)
        return [f"{self.top * number / count:g}" for number in range(count + 1)]

    def rgb(self) -> Floats:
        """Colours from 0 to 255, shape (classes, 3)."""
        return np.array([[int(c[i : i + 2], 16) for i in (1, 3, 5)] for c in self.colours], float)


def round_above(value: float, steps: int) -> float:
    """The least multiple of ``steps`` round numbers that is not below ``value`` (> 0)."""
    power = 10.0 ** np.floor(np.log10(value / steps))
    # rounding of the quotient may not make a step larger
    fits = (step * power for step in (1.0, 2.0, 2.5, 4.0, 5.0, 10.0, 20.0))
    return float(next(steps * step for step in fits if steps * step >= value * (1 - 1e-9)))
