"""Points of a sweep: which values several parameters take together.

A grid holds every combination. A Latin hypercube (McKay, Beckman and Conover 1979, "A comparison
of three methods for selecting values of input variables in the analysis of output from a computer
code") parts the range of every parameter into as many strata as there are samples, and takes each
stratum once: few runs cover all ranges evenly.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from uxsim_geo.errors import Faults

#: digits of a drawn value: enough for any parameter, few enough to be written and typed again
DIGITS = 6


@dataclass(frozen=True)
class Range:
    """What a parameter may be: from ``low`` to ``high``, both in its own unit.

    logarithmic
        strata have equal ratios, for parameters that matter by their order of magnitude
    whole
        only whole numbers
    """

    low: float
    high: float
    logarithmic: bool = False
    whole: bool = False

    def at(self, share: float) -> float | int:
        """Return the value at a share, 0 to 1, of the range."""
        if self.whole:
            # every whole number gets an equal part of the range
            return min(math.floor(self._between(self.low, self.high + 1, share)), int(self.high))
        return float(f"{self._between(self.low, self.high, share):.{DIGITS}g}")

    def _between(self, low: float, high: float, share: float) -> float:
        if self.logarithmic:
            return float(low * (high / low) ** share)
        return low + (high - low) * share

    def add_faults(self, faults: Faults, name: str) -> None:
        """Note a range that is none."""
        ends = (self.low, self.high)
        if not all(map(math.isfinite, ends)) or not self.low < self.high:
            faults.add("must be a lower and a higher finite number", column=name, value=ends)
        elif self.logarithmic and self.low <= 0:
            faults.add("a logarithmic range must begin above 0", column=name, value=self.low)
        elif self.whole and any(end % 1 for end in ends):
            faults.add("must begin and end with whole numbers", column=name, value=ends)


def grid_points(values: Mapping[str, Sequence[Any]]) -> list[dict[str, Any]]:
    """Return every combination of the values of each parameter, the last one changing fastest.

    Raises :class:`uxsim_geo.errors.InputError` for a parameter without values, or with one twice.
    """
    faults = Faults("grid")
    for name, of in values.items():
        if not of:
            faults.add("needs at least one value", column=name)
        for number, value in enumerate(of):
            if value in of[:number]:
                faults.add("stands there twice", column=name, value=value)
    faults.raise_if_any()
    return [dict(zip(values, point, strict=True)) for point in itertools.product(*values.values())]


def latin_hypercube(
    ranges: Mapping[str, Range], samples: int, seed: int = 0
) -> list[dict[str, float | int]]:
    """Draw points that take every one of ``samples`` strata of each range once.

    The same seed gives the same points. Raises :class:`uxsim_geo.errors.InputError` with all that
    is wrong with the ranges and their number.
    """
    from scipy.stats import qmc

    faults = Faults("latin_hypercube")
    if samples < 1:
        faults.add("must be 1 or more", column="samples", value=samples)
    if not ranges:
        faults.add("needs at least one range")
    for name, one in ranges.items():
        one.add_faults(faults, name)
    faults.raise_if_any()
    shares = qmc.LatinHypercube(d=len(ranges), rng=seed).random(samples)
    return [
        {name: one.at(float(share)) for (name, one), share in zip(ranges.items(), row, strict=True)}
        for row in shares
    ]
