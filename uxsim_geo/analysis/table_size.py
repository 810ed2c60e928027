"""How large tables may become: who asks for more is told so before memory is taken."""

from __future__ import annotations

import math

from uxsim_geo.errors import Faults

#: rows of a table of cells or skims, moments of vehicles, states of links; more take several GB
MOST_CELLS = 20_000_000
MOST_SKIMS = 20_000_000
MOST_SAMPLES = 50_000_000
MOST_STATES = 50_000_000

#: bins, or moments, of a simulation: more than anybody looks at
MOST_BINS = 1_000_000


def check_rows(rows: float, most: int, column: str, instead: str, value: object = None) -> None:
    """Raise :class:`uxsim_geo.errors.InputError` for more than ``most`` rows.

    ``column`` is the argument at fault, ``instead`` says what to choose in its place.
    """
    faults = Faults()
    if rows > most:
        what = f"makes {rows:,.0f} rows: {instead} ({most:,} rows are the most)"
        faults.add(what, column=column, value=value)
    faults.raise_if_any()


def shortest_step(duration: float, most: int) -> float:
    """The least length, s, of which at most so many fill a duration, to three digits upwards."""
    exact = duration / most
    digit = 10.0 ** (math.floor(math.log10(exact)) - 2)
    return float(f"{math.ceil(exact / digit * (1 - 1e-12)) * digit:.3g}")
