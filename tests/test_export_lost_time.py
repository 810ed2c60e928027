"""Where most time is lost: one rule, and all forms of a run tell the same by it."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from uxsim_geo.export.lost_time import LostTime, Unit, in_words
from uxsim_geo.network.street_names import street_names

EDGES = np.array([0.0, 300.0, 600.0, 700.0])


def lost_on(delay: list[list[float]], **columns: list[str | None]) -> LostTime:
    links = pd.DataFrame({"link_id": [str(row) for row in range(len(delay))], **columns})
    return LostTime(street_names(links), np.array(delay, float), EDGES[:-1], EDGES[1:])


def test_links_called_alike_are_one_street_and_numbers_stand_in_for_names() -> None:
    lost = lost_on(
        [[0, 4000, 0], [0, 0, 900], [7000, 0, 0], [0, 3500, 0], [100, 0, 0]],
        name=["Long Street", None, " ", "Long Street", None],
        ref=["B 3", "A 5", "B 37", None, None],
    )
    streets = lost.streets(10)
    assert [street.name for street in streets] == ["Long Street", "B 37", "A 5"]
    assert [street.lost for street in streets] == [7500.0, 7000.0, 900.0]
    assert streets[0].links.tolist() == [0, 3]
    assert (streets[0].link, streets[0].bin) == (0, 1)
    assert streets[0].share == pytest.approx(7500 / 15_500)
    assert [street.name for street in lost.streets(2)] == ["Long Street", "B 37"]
    # 100 veh·s would be told as 0.0 veh·h
    assert lost.unit.text(100.0) == "0.0 veh·h"


def test_of_equal_streets_that_comes_first_whose_link_does() -> None:
    # sums whose last digits differ by their order are equal all the same
    shares = [0.1, 0.2, 0.3]
    lost = lost_on([[100.0, 0, 0], [*(1e3 * x for x in shares)], [600.0, 0, 0]])
    assert [street.name for street in lost.streets(9)] == ["link 1", "link 2", "link 0"]


def test_a_street_must_have_a_percentage_that_is_told() -> None:
    lost = lost_on([[4e6, 0, 0], [1900.0, 0, 0], [2100.0, 0, 0]])
    assert [street.name for street in lost.streets(9)] == ["link 0", "link 2"]


@pytest.mark.parametrize(
    ("lost", "text"),
    [
        (4_000_000.0, "1,111 veh·h"),
        (3600.0, "1.0 veh·h"),
        (3599.0, "60.0 veh·min"),
        (59.0, "59.0 veh·s"),
        (0.2, "0.2 veh·s"),
        (1e-9, "none"),
        (0.0, "none"),
        (-1e-9, "none"),
    ],
)
def test_amounts_have_units_that_say_something(lost: float, text: str) -> None:
    assert in_words(lost) == text


def test_what_rounding_leaves_of_no_delay_is_no_street() -> None:
    assert lost_on([[1e-12, 0, 0], [0, 0, 0]]).streets(9) == []
    assert Unit.of(0.0).name == "veh·s"


def test_the_worst_bin_is_the_first_in_which_time_is_lost_as_fast_as_ever() -> None:
    assert lost_on([[10.0, 3000.0, 1000.0]]).worst_bin == 1  # 10 veh in both, the last is short
    assert lost_on([[0.0, 2999.0, 1000.0]]).worst_bin == 1  # a gridlock stays as bad
    assert lost_on([[0.0, 2900.0, 1000.0]]).worst_bin == 2
    assert lost_on([[0.0, 0.0, 0.0]]).worst_bin == 0
