"""The values of one column of a network, from the rows of any table."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.errors import Faults
from uxsim_geo.network.exact import float_text, product
from uxsim_geo.network.mapped_options import ColumnMapping, Source, factor_of
from uxsim_geo.network.tntp_rows import number

Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Rows:
    """A table under way: its cells, and where its faults go."""

    table: pd.DataFrame
    faults: Faults

    def __len__(self) -> int:
        return len(self.table)

    def add(self, what: str, row: int, column: str, value: object = None) -> None:
        """Note a fault of one row, by the number of its feature."""
        self.faults.add(what, column=f"{column} of feature {row + 1}", value=value)


class Numbers(NamedTuple):
    """One number a row in SI units, NaN where there is none.

    assumed: not given by the cell itself; empty: there is none, which is not told yet
    """

    values: Floats
    assumed: Flags
    empty: Flags


def add_column_faults(rows: Rows, mapping: ColumnMapping, sources: dict[str, Source]) -> None:
    """Note each column that the mapping names and the table lacks, or has twice."""
    present = [str(name) for name in rows.table.columns]
    named = [source.column for source in sources.values() if source.column is not None]
    if mapping.direction is not None and "lanes" in sources:
        named.append(mapping.direction.column)
    named += mapping.keep if "lanes" in sources else ()
    for name in dict.fromkeys(named):
        if name not in present:
            faults = f"lacks the column {name} (columns here: {', '.join(present) or 'none'})"
            rows.faults.add(faults)
        elif present.count(name) > 1:
            rows.faults.add("the column stands there more than once", column=name)


def cell_text(value: object) -> str | None:
    """A cell as text: whole numbers without a point, nothing where it is empty."""
    if value is None or value is pd.NA or value is pd.NaT:
        return None
    if isinstance(value, float) and math.isnan(value):
        return None
    if isinstance(value, (float, np.floating)) and math.isfinite(value) and value % 1 == 0:
        return str(int(value))
    text = str(value).strip()
    return text or None


def texts(rows: Rows, source: Source) -> list[str | None]:
    """One text a row, None where there is none; those of ``values`` in place of the cells."""
    if source.column is None:
        return [str(source.constant)] * len(rows)
    missing = None if source.missing is None else str(source.missing)
    found: list[str | None] = []
    for cell in rows.table[source.column].tolist():
        text = cell_text(cell)
        if source.values and text is not None:
            stands_for = source.values.get(text, source.missing)
            text = None if stands_for is None else str(stands_for)
        found.append(missing if text is None else text)
    return found


def ids(rows: Rows, source: Source, name: str) -> list[str]:
    """One id a row; none is a fault."""
    found = texts(rows, source)
    for row, text in enumerate(found):
        if text is None:
            rows.add("needs a value", row, source.column or name)
    return [text or "" for text in found]


def numbers(rows: Rows, name: str, source: Source, lanes: Floats | None = None) -> Numbers:
    """One number above 0 a row, or NaN where the cell is empty; all else is a fault.

    ``lanes`` are those of each row, for units of one lane.
    """
    factor, per_lane = factor_of(name, source)
    factors = [factor] * len(rows)
    if per_lane and lanes is not None:
        factors = [factor * int(one) if one > 0 else factor for one in lanes.tolist()]
    if source.column is None:
        assert isinstance(source.constant, (int, float)), "constants are checked in the mapping"
        cells: list[object] = [source.constant] * len(rows)
        assumed = np.ones(len(rows), dtype=bool)
    else:
        cells = rows.table[source.column].tolist()
        assumed = np.full(len(rows), bool(source.values))
    values = np.full(len(rows), np.nan)
    empty = np.array([cell_text(cell) is None for cell in cells], dtype=bool)
    for row, cell in enumerate(cells):
        value = _number(rows, row, source, cell)
        if value is None and source.missing is not None:
            value, assumed[row], empty[row] = float(source.missing), True, False
        if value is not None:
            values[row] = _in_si(value, factors[row])
    return Numbers(values, assumed, empty)


def _number(rows: Rows, row: int, source: Source, cell: object) -> float | None:
    """The number in a cell, None where it is empty or means nothing."""
    text = cell_text(cell)
    if text is None:
        return None
    if source.values:
        stands_for = source.values.get(text)
        if stands_for is None and source.missing is None:
            known = ", ".join(map(str, source.values))
            what = f"is none of the values that the mapping knows, {known}"
            rows.add(what, row, str(source.column), text)
        return None if stands_for is None else float(stands_for)
    value = number(text)
    if value is None or not 0 < value < math.inf:
        what = "must be a finite number above 0, or empty"
        rows.add(what, row, source.column or "", text)
        return None
    return value


def _in_si(value: float, factor: Fraction) -> float:
    return value if factor == 1 else product(float_text(float(value)), factor)
