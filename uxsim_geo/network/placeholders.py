"""Columns that look like data and are none: filled in to complete a file, not measured."""

from __future__ import annotations

import numpy as np
import pandas as pd

#: fewer rows may well agree by chance
ENOUGH_ROWS = 10

#: the longest pattern that is looked for
LONGEST_PATTERN = 10


def placeholders(table: pd.DataFrame) -> frozenset[str]:
    """Which of capacity, free_flow_time and speed are placeholders in a net file's table."""
    found = {
        "capacity": "capacity" in table and _fills_capacity(table["capacity"]),
        "free_flow_time": {"free_flow_time", "length"} <= set(table)
        and _fills_time(table["free_flow_time"], table["length"]),
        "speed": "speed" in table and _fills_speed(table["speed"]),
    }
    return frozenset(name for name, fills in found.items() if fills)


def _fills_capacity(capacity: pd.Series) -> bool:
    """At most 1, and the same, on every link (Barcelona, Winnipeg, Braess)."""
    values = np.asarray(capacity, dtype=np.float64)
    return len(values) > 1 and bool(np.all(values == values[0])) and 0 <= values[0] <= 1


def _fills_time(time: pd.Series, length: pd.Series) -> bool:
    """The same on every link although their lengths differ (0.75 in Hessen)."""
    times, lengths = (np.asarray(column, dtype=np.float64) for column in (time, length))
    if len(times) < ENOUGH_ROWS or np.all(lengths == lengths[0]):
        return False
    return bool(np.all(times == times[0]))


def _fills_speed(speed: pd.Series) -> bool:
    """0 on every link, or a pattern that repeats every few rows (50 80 100 120 30 in Hessen)."""
    values = np.asarray(speed, dtype=np.float64)
    if np.all(values == 0):
        return True
    if len(values) < 2 * LONGEST_PATTERN or np.all(values == values[0]):
        return False
    periods = range(2, LONGEST_PATTERN + 1)
    return any(np.array_equal(values[period:], values[:-period]) for period in periods)


def is_copy(length: pd.Series, time: pd.Series) -> bool:
    """Length and time are the same number on every link: one was copied (Sioux Falls)."""
    return len(length) > 1 and np.array_equal(np.asarray(length), np.asarray(time))
