"""Columns of tables with more rows: of the same type, wherever it can hold what is new."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd


def longer(column: pd.Series, values: Sequence[Any]) -> pd.Series:
    """Return a column with more values behind; None is nothing, for which integers become floats.

    Truths with nothing among them become objects. The index is the number of the row.
    """
    dtype: Any = column.dtype
    if any(value is None for value in values):
        dtype = {"b": object, "i": np.float64, "u": np.float64}.get(dtype.kind, dtype)
    table: pd.Series = pd.concat([column, pd.Series(list(values), dtype=dtype)], ignore_index=True)
    return table
