"""Numbers and changes as text: three digits, a real minus, and the interval behind the mean."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import pandas as pd

#: what an exact 0 leaves after rounding
NOTHING = 1e-9

#: digits behind the point, at most
MOST_DIGITS = 6


def number(value: float, *, signed: bool = False, digits: int | None = None) -> str:
    """Three digits or all before the point, with a real minus; a dash for none.

    ``digits``: so many behind the point in their place. Noughts at the end are left out.
    """
    if value is None or not math.isfinite(value):
        return "–"
    size = abs(value)
    if digits is None:
        digits = 0 if size >= 99.95 else 1 if size >= 9.995 else 2 if size >= 0.9995 else 3
    text = f"{size:,.{digits}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    if text == "0":
        return "0"
    return f"{'−' if value < 0 else '+' if signed else ''}{text}"


def percent(value: float, *, signed: bool = False) -> str:
    """Whole percents from 10 on, else one digit after the point; of less than 0.1 one digit."""
    if not math.isfinite(value):
        return number(value)
    size = abs(value)
    rounded = round(value) if size >= 9.95 else round(value, 1) if size >= 0.095 else value
    if 0 < size < 0.095:
        rounded = float(f"{value:.1g}")
    return number(float(rounded), signed=signed)


def digits_of(value: float) -> int:
    """Digits behind the point that show three digits of a number, or all before the point."""
    if value == 0 or not math.isfinite(value):
        return 0
    return min(max(2 - math.floor(math.log10(abs(value))), 0), MOST_DIGITS)


def is_sure(row: Mapping[Any, Any] | pd.Series) -> bool | None:
    """Whether the interval of a figure leaves out 0; None: there is no interval."""
    if math.isnan(row["low"]):
        return None
    return bool(row["low"] > 0 or row["high"] < 0)


def change_in_words(row: Mapping[Any, Any] | pd.Series) -> str:
    """Change with its interval: ``+12 % (10 to 14 %)``, or in its unit where the base is 0."""
    base, unit = row["base"], row["unit"]
    values = [row[name] for name in ("difference", "low", "high")]
    if math.isnan(values[0]):
        return "not known"
    relative = math.isfinite(base) and abs(base) > NOTHING and unit != "share of runs"
    told = percent if relative else number
    if relative:
        unit, values = "%", [100.0 * value / abs(base) for value in values]
    mean = f"{told(values[0], signed=True)}\u00a0{unit}"
    if math.isnan(values[1]):
        return mean
    return f"{mean} ({told(values[1])} to {told(values[2])}\u00a0{unit})"


def with_interval(
    change: float, ends: tuple[float, float], unit: str, sure: bool | None = False
) -> str:
    """A change with its interval, if it has one; with a sign unless it is ``sure``."""
    signed = sure is False
    text = f"{number(change, signed=signed)} {unit}"
    if math.isnan(ends[0]):
        return text
    low, high = (number(end, signed=signed) for end in sorted(ends))
    return f"{text} (95 %: {low} to {high})"
