"""Faults in the rows of a table, told in one line a kind: how many rows, and which."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import pandas as pd

from uxsim_geo.errors import Faults

#: so many rows are named in a message; the rest are counted
NAMED_ROWS = 5


def add_missing_columns(faults: Faults, table: pd.DataFrame, required: Iterable[str]) -> bool:
    """Note each required column that ``table`` lacks; True if there is any."""
    missing = [column for column in required if column not in table.columns]
    for column in missing:
        present = ", ".join(map(str, table.columns)) or "none"
        faults.add(f"lacks the column {column} (columns here: {present})")
    return bool(missing)


def add_rows(
    faults: Faults,
    wrong: np.ndarray | pd.Series,
    what: str,
    *,
    ids: pd.Series | None = None,
    advice: str = "",
) -> None:
    """Note the rows where ``wrong`` (boolean, one a row) holds, if any.

    ``what`` follows "3 rows have"; with ``ids`` (one a row) the rows are named by them,
    otherwise by their number, counted from 1. ``advice`` says what to do about it.
    """
    rows = np.flatnonzero(np.asarray(wrong, dtype=bool))
    if not len(rows):
        return
    if ids is None:
        named = [str(row + 1) for row in rows[:NAMED_ROWS]]
        place = "row" if len(rows) == 1 else "rows"
    else:
        named = [str(ids.iloc[row]) for row in rows[:NAMED_ROWS]]
        place = str(ids.name)
    have = "1 row has" if len(rows) == 1 else f"{len(rows)} rows have"
    faults.add(f"{have} {what} ({place} {listed(named, len(rows))}){advice and ': '}{advice}")


def listed(names: Sequence[str], total: int) -> str:
    """The names with commas between them, and how many of ``total`` are not named."""
    rest = total - len(names)
    return ", ".join(names) + (f" and {rest} more" if rest > 0 else "")


def is_among(values: pd.Series | pd.Index, known: pd.Series | pd.Index) -> np.ndarray:
    """Which of the ids in ``values`` occur in ``known``; boolean, one a value.

    Ten times as fast as ``isin`` on columns of text.
    """
    return np.asarray(pd.Index(known).unique().get_indexer(pd.Index(values)) >= 0)


def not_text(column: pd.Series) -> np.ndarray:
    """Where a column of ids has something other than text, such as a number; null is not meant."""
    if pd.api.types.infer_dtype(column, skipna=True) in {"string", "empty"}:
        return np.zeros(len(column), dtype=bool)
    text = np.array([isinstance(value, str) for value in column], dtype=bool)
    return np.asarray(~text & ~lacking(column), dtype=bool)


def numbers(column: pd.Series) -> np.ndarray:
    """The column as float64; what is not a number becomes NaN."""
    return np.asarray(pd.to_numeric(column, errors="coerce"), dtype=np.float64)


def whole_where_possible(values: np.ndarray) -> np.ndarray:
    """The same as int64 where all are whole numbers, otherwise (some null or broken) float64."""
    whole = bool(np.isfinite(values).all()) and not (values % 1).any()
    return values.astype(np.int64) if whole else values


def count_within(values: np.ndarray) -> np.ndarray:
    """Number the occurrences of every value (integers) from 0, in their order; int64."""
    order = np.argsort(values, kind="stable")
    ordered = values[order]
    first = np.searchsorted(ordered, ordered, side="left")
    number = np.empty_like(order)
    number[order] = np.arange(order.size) - first
    return number


def lacking(column: pd.Series) -> np.ndarray:
    """Where a text column has nothing: null, empty or blank."""
    text = column.astype("str").str.strip()
    return np.asarray(column.isna() | (text == ""), dtype=bool)


def count(number: int, thing: str) -> str:
    """``1 row`` or ``3 rows``."""
    return f"{number} {thing}" if number == 1 else f"{number} {thing}s"
