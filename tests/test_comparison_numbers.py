"""Numbers and changes as text."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from uxsim_geo.analysis.comparison.numbers import change_in_words, digits_of, number, percent
from uxsim_geo.analysis.comparison.quantities import LESS


def figure(**other: object) -> pd.Series:
    row = {
        "title": "total delay",
        "unit": "veh·h",
        "better": LESS,
        "base": 200.0,
        "scenario": 224.0,
        "difference": 24.0,
        "low": 20.0,
        "high": 28.0,
    }
    return pd.Series(row | other)


def test_a_change_is_told_with_its_interval_and_unit() -> None:
    assert change_in_words(figure()) == "+12\u00a0% (10 to 14\u00a0%)"
    assert change_in_words(figure(low=np.nan, high=np.nan)) == "+12\u00a0%"
    # nothing to divide by: the unit itself, and no infinite share
    assert change_in_words(figure(base=0.0)) == "+24\u00a0veh·h (20 to 28\u00a0veh·h)"
    assert change_in_words(figure(difference=np.nan)) == "not known"


def test_numbers_have_a_real_minus_and_no_nought_with_a_sign() -> None:
    told = [number(value) for value in (-0.0, -1e-12, -2.345, 1234.5, np.nan, 0.05)]
    assert told == ["0", "0", "−2.35", "1,234", "–", "0.05"]
    assert [percent(value) for value in (12.4, 3.14, 0.04, 0.0)] == ["12", "3.1", "0.04", "0"]


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [(1234.5, 0, "+1,234"), (-0.5, 1, "−0.5"), (0.04, 1, "0"), (0.0, 0, "0"), (-1e-9, 2, "0")],
)
def test_signs_and_digits(value: float, digits: int, text: str) -> None:
    assert number(value, signed=True, digits=digits) == text


def test_as_many_digits_as_show_three() -> None:
    found = [digits_of(value) for value in (-1234.0, 123.0, 12.3, -1.23, 0.123, 0.0, np.nan, 1e-30)]
    assert found == [0, 0, 1, 2, 3, 0, 0, 6]
