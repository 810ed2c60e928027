"""Cycle and split: Webster's formula with numbers worked out by hand, and what always holds."""

from __future__ import annotations

from fractions import Fraction

import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from signal_sites import greens_of, junction

from uxsim_geo.errors import InputError
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.signal_options import SignalOptions
from uxsim_geo.network.signal_plans import signal_plans
from uxsim_geo.network.signal_times import assumed_cycle, greens, split, webster_cycle

OPTIONS = SignalOptions()
Q = 2880.0  # veh/h of one lane of `road`, 0.8 veh/s


def volumes(**veh_h: float) -> pd.DataFrame:
    return pd.DataFrame({"link_id": list(veh_h), "volume_veh_h": list(veh_h.values())})


def test_websters_cycle_by_hand() -> None:
    """Y = 0.3 + 0.4, L = 8 s: (12 + 5) / 0.3 = 56.67 s; 49 s of green as 3 to 4."""
    assert webster_cycle([0.3, 0.4], 8.0, OPTIONS) == pytest.approx(17 / 0.3)
    assert greens(17 / 0.3, 8.0, [0.3, 0.4], OPTIONS) == [21, 28]


def test_three_phases_by_hand() -> None:
    """Y = 0.25 + 0.25 + 0.2, L = 12 s: 23 / 0.3 = 76.67 s; 65 s as 5, 5, 4: 23.2, 23.2, 18.6."""
    cycle = webster_cycle([0.25, 0.25, 0.2], 12.0, OPTIONS)
    assert cycle == pytest.approx(76.667, abs=0.001)
    assert greens(cycle, 12.0, [0.25, 0.25, 0.2], OPTIONS) == [23, 23, 19]


@pytest.mark.parametrize(
    ("ratios", "cycle"),
    [([0.0, 0.0], 40.0), ([0.1, 0.1], 40.0), ([0.45, 0.5], 120.0), ([0.5, 0.5], 120.0)],
)
def test_the_cycle_stays_within_its_bounds(ratios: list[float], cycle: float) -> None:
    assert webster_cycle(ratios, 8.0, OPTIONS) == cycle


def test_just_below_capacity_the_formula_still_holds() -> None:
    assert webster_cycle([0.48, 0.48], 8.0, SignalOptions(max_cycle=1000)) == pytest.approx(425)


def test_the_cycle_without_volumes_counts_phases() -> None:
    assert [assumed_cycle(phases, OPTIONS) for phases in (1, 2, 3, 4, 5)] == [40, 60, 90, 120, 120]


def test_green_fills_the_cycle_but_never_beyond_the_longest() -> None:
    long = SignalOptions(all_red=4.4)  # 120 - 8.8 leaves 111.2 s of green: 111 are whole
    assert sum(greens(120.0, 8.8, [1, 1], long)) == 111
    assert sum(greens(60.0, 8.8, [1, 1], long)) == 52
    assert greens(120.0, 60.0, [1] * 15, OPTIONS) == [8] * 15  # the shortest greens go first


@settings(derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    weights=st.lists(st.integers(0, 10_000), min_size=1, max_size=12),
    least=st.integers(1, 30),
    more=st.integers(0, 300),
)
def test_a_split_is_in_proportion_but_for_the_least(
    weights: list[int], least: int, more: int
) -> None:
    """The exact shares, by fractions: largest remainders part from them by less than one."""
    total = least * len(weights) + more
    found = split(total, [float(weight) for weight in weights], least)
    assert sum(found) == total
    assert min(found) >= least
    exact = [Fraction(weight) for weight in weights] if any(weights) else [Fraction(1)] * len(found)
    shares = _water_level(exact, total, least)
    assert all(abs(one - share) < 1 for one, share in zip(found, shares, strict=True))


def _water_level(weights: list[Fraction], total: int, least: int) -> list[Fraction]:
    """The one scale at which the larger of least and scale × weight sum to the total."""
    for floored in range(len(weights)):
        above = sorted(weights)[floored:]
        scale = Fraction(total - least * floored) / sum(above) if sum(above) else Fraction(0)
        shares = [max(Fraction(least), scale * weight) for weight in weights]
        if sum(shares) == total:
            return shares
    return [Fraction(least)] * len(weights)


def test_a_crossing_with_volumes_is_timed_by_webster() -> None:
    """a and c share a phase: the larger of 0.3 and 0.1 counts; b has 0.4 of its two lanes."""
    network = junction([0, 90, 180, 270], lanes=[1, 2, 1, 2])
    counted = volumes(a=0.3 * Q, b=0.4 * 2 * Q, c=0.1 * Q, d=0.0)
    plans = signal_plans(network, volumes=counted)
    assert greens_of(plans) == [21, 28]
    assert plans["cycle_s"].unique().tolist() == [57]
    assert (plans["source"] == "assumed").all()


def test_no_cycle_serves_more_than_capacity() -> None:
    notes = Notes()
    counted = volumes(a=0.8 * Q, b=0.4 * Q, c=0, d=0)
    plans = signal_plans(junction([0, 90, 180, 270]), volumes=counted, notes=notes)
    assert plans["cycle_s"].unique().tolist() == [120]
    assert greens_of(plans) == [75, 37]  # 112 s as 2 to 1
    told = notes.table().set_index("topic")
    assert told.loc["signal overloaded", "value"] == "1.2"


def test_a_link_without_a_volume_leaves_the_node_to_assumption() -> None:
    network, notes = junction([0, 90, 180, 270]), Notes()
    plans = signal_plans(network, volumes=volumes(a=900, b=10, c=900), notes=notes)
    pd.testing.assert_frame_equal(plans, signal_plans(network))
    told = notes.table().set_index("topic")
    assert told.loc["signal without volumes", "value"] == "1"
    assert told.loc["signal without volumes", "element_id"] == "X"


def test_without_volumes_the_larger_road_gets_the_longer_green() -> None:
    lanes = greens_of(signal_plans(junction([0, 90, 180, 270], lanes=[3, 1, 3, 1])))
    assert lanes == [39, 13]  # 52 s as 3 to 1
    classes = ["residential", "primary", "residential", "primary"]
    by_class = greens_of(signal_plans(junction([0, 90, 180, 270], road_class=classes)))
    assert by_class == [12, 40]  # 52 s as 0.3 to 1
    own = SignalOptions(class_loads={"residential": 1.0, "primary": 1.0})
    assert greens_of(signal_plans(junction([0, 90, 180, 270], road_class=classes), own)) == [26, 26]
    capacity = [0.6, 0.2, 0.1, 0.1]
    assert greens_of(signal_plans(junction([0, 90, 180, 270], capacity=capacity))) == [39, 13]


def test_parallel_links_weigh_as_one_approach() -> None:
    """Two links side by side against one: 52 s as 2 to 1."""
    assert greens_of(signal_plans(junction([0, 8, 90, 180, 270]))) == [35, 17]


def test_a_small_road_gets_the_least_green() -> None:
    classes = ["service", "primary", "service", "primary"]
    plans = signal_plans(junction([0, 90, 180, 270], road_class=classes, lanes=[1, 3, 1, 3]))
    assert greens_of(plans) == [8, 44]


def test_every_fault_of_the_volumes_is_named_at_once() -> None:
    counted = pd.DataFrame(
        {
            "link_id": ["a", "b", "a", "nowhere", "c", "d"],
            "volume_veh_h": [100, -1, 100, 5, "many", 2e6],
        }
    )
    with pytest.raises(InputError) as caught:
        signal_plans(junction([0, 90, 180, 270]), volumes=counted)
    told = str(caught.value)
    assert "1 row has a link_id that the network lacks (link_id nowhere)" in told
    assert "1 row has the link_id of an earlier row (link_id a)" in told
    assert "3 rows have a volume_veh_h that is no number from 0 to 1,000,000" in told
    with pytest.raises(InputError, match="lacks the column volume_veh_h"):
        signal_plans(junction([0, 90]), volumes=pd.DataFrame({"link_id": ["a"]}))


def test_every_fault_of_the_options_is_named_at_once() -> None:
    with pytest.raises(InputError) as caught:
        SignalOptions(
            all_red=-1,
            min_green=7.5,  # type: ignore[arg-type]
            min_cycle=130,
            cycle_per_phase=float("nan"),
            same_direction=91,
            crossings="cars",  # type: ignore[arg-type]
            class_loads={"primary": 0.0},
        )
    columns = [fault.column for fault in caught.value.faults]
    assert columns == [
        "cycle_per_phase",
        "all_red",
        "min_green",
        "min_cycle",
        "same_direction",
        "crossings",
        "class_loads of primary",
    ]
