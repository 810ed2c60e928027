"""Units to SI without a second rounding, so that what is written in a unit reads back the same.

A number in a file is a decimal fraction, a unit a ratio of whole numbers: their product is exact
until it becomes the nearest float64.
"""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal, localcontext
from fractions import Fraction

import numpy as np
import numpy.typing as npt

from uxsim_geo.network.tntp_rows import number
from uxsim_geo.network.units import Quantity, parse_unit

#: no unit is a finer ratio of whole numbers than this
FINEST = 10**9

#: an exact product is not worth its time beyond these: no length, speed or capacity is as long
LONGEST_TEXT = 64
SMALLEST, LARGEST = 1e-30, 1e30

#: so many digits of a float64 are those of the decimal that it was made of
USUAL_DIGITS = 15

#: digits that tell every float64 from its neighbours after a multiplication
MOST_DIGITS = 40


def exact_factor(unit: str, quantity: Quantity) -> Fraction:
    """What one unit is worth in SI, as a ratio: km/h is 5/18."""
    return Fraction(parse_unit(unit, quantity).factor).limit_denominator(FINEST)


def to_si(
    cells: Sequence[str], values: npt.NDArray[np.float64], factors: Sequence[Fraction]
) -> npt.NDArray[np.float64]:
    """Numbers times their factors, one a row: rounded once. ``values`` are what ``cells`` say."""
    known: dict[tuple[str, Fraction], float] = {}
    found = values.copy()
    for row, (cell, factor) in enumerate(zip(cells, factors, strict=True)):
        if factor != 1 and np.isfinite(values[row]):
            key = (cell, factor)
            if key not in known:
                known[key] = product(cell, factor)
            found[row] = known[key]
    return found


def product(text: str, factor: Fraction) -> float:
    """The float64 nearest to the number that a text is, times a factor."""
    value = number(text)
    assert value is not None, "cells are checked before they are converted"
    text = text.strip()
    # exact numbers with huge exponents would fill the memory
    if len(text) > LONGEST_TEXT or not SMALLEST < abs(value) < LARGEST:
        return value * float(factor)
    return float(Fraction(Decimal(text)) * factor)


def float_text(value: float) -> str:
    """The shortest decimal that reads back as the same float64: 1800, not 1800.0."""
    return repr(value).removesuffix(".0")


def shortest_text(value: float, factor: Fraction) -> str:
    """The shortest decimal, as far as is easily found, that times ``factor`` is ``value`` again."""
    if factor == 1 or not SMALLEST < abs(value) < LARGEST:
        return float_text(value if factor == 1 else value / float(factor))
    exact = Fraction(value) / factor
    text = f"{float(exact):.{USUAL_DIGITS}g}"
    if product(text, factor) == value:
        return text
    with localcontext() as context:
        for digits in range(USUAL_DIGITS + 1, MOST_DIGITS):
            context.prec = digits
            text = str(Decimal(exact.numerator) / Decimal(exact.denominator))
            if product(text, factor) == value:
                return text
    raise AssertionError(f"{value!r} has no text in this unit")
