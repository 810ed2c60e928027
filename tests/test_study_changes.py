"""Classes of changes, their words, and what is told of a study in sentences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from compared import example_comparison
from shown_study import EVIL, against_itself, study

from uxsim_geo.analysis.comparison.quantities import EITHER, LESS, LINKS, MORE, Quantity
from uxsim_geo.export.comparison.changes import (
    BETTER,
    HARDLY,
    WORSE,
    Shown,
    class_numbers,
    classes_of,
    shown_of_links,
    significance,
)
from uxsim_geo.export.comparison.forest import panels
from uxsim_geo.export.comparison.study import Scenario, joined_network, short_names
from uxsim_geo.export.comparison.words import answer, change_in_words, number, percent


def shown(better: int = LESS) -> Shown:
    return Shown(Quantity("q", "q", "s", "", better), False, (1.0, 5.0, 20.0))


@pytest.mark.parametrize("better", [LESS, EITHER, MORE])
def test_classes_lie_symmetric_about_no_change(better: int) -> None:
    classes = classes_of(shown(better))
    assert [-entry.upper for entry in reversed(classes)] == [entry.lower for entry in classes]
    assert [entry.lower for entry in classes[1:]] == [entry.upper for entry in classes[:-1]]
    assert classes[3].colour == HARDLY
    assert len({entry.colour for entry in classes}) == 7
    assert len({entry.on_dark for entry in classes}) == 7


def test_blue_is_better_whichever_way_that_is() -> None:
    assert [entry.colour for entry in classes_of(shown(LESS))[-3:]] == list(WORSE)
    assert [entry.colour for entry in classes_of(shown(MORE))[-3:]] == list(BETTER)
    assert [entry.colour for entry in classes_of(shown(MORE))[2::-1]] == list(WORSE)


def test_every_change_lies_in_its_class_and_none_is_no_class() -> None:
    values = np.array([-np.pi, 0.0, 1.0, -1.0, 0.999, 5.0, -5.0, 19.9, 20.0, -20.0, 1e9, np.nan])
    found = class_numbers(values, shown())
    for value, at in zip(values, found, strict=True):
        if np.isnan(value):
            assert at == -1
            continue
        entry = classes_of(shown())[at]
        # the break itself belongs to the larger change, on both sides
        assert entry.lower <= value <= entry.upper
        if value in (entry.lower, entry.upper):
            assert abs(value) == min(abs(entry.lower), abs(entry.upper))
    assert class_numbers(-values, shown())[:-1].tolist() == (6 - found[:-1]).tolist()


def test_breaks_are_those_of_all_scenarios_and_there_without_any_change() -> None:
    whole = study()
    alone = replace(whole, scenarios=whole.scenarios[:1])
    assert shown_of_links(whole, relative=False) == shown_of_links(alone, relative=False)
    nothing = replace(whole, scenarios=whole.scenarios[1:2])
    for entry in shown_of_links(nothing, relative=False):
        assert 0 < entry.breaks[0] < entry.breaks[1] < entry.breaks[2]


def test_sure_perhaps_and_not_known_are_three_things() -> None:
    quantity = next(one for one in LINKS if one.name == "delay_veh_h")
    one = Shown(quantity, False, (1.0, 2.0, 3.0))
    known = pd.array([True, False, pd.NA], dtype="boolean")
    table = pd.DataFrame({"delay_veh_h_significant": known})
    assert significance(table, one).tolist()[:2] == [1.0, 0.0]
    assert np.isnan(significance(table, one)[2])
    ends = pd.DataFrame(
        {"delay_veh_h_low": [0.1, -1.0, np.nan], "delay_veh_h_high": [1, 1, np.nan]}
    )
    np.testing.assert_array_equal(significance(ends, one), [1.0, 0.0, np.nan])


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


def test_the_answer_begins_with_the_total_delay_and_its_interval() -> None:
    scenario = study().compared[0]
    totals = example_comparison(4)[2].totals.set_index("figure").loc["total_delay_veh_h"]
    low, high = (100 * abs(totals[end]) / totals["base"] for end in ("high", "low"))
    assert answer(scenario)[0] == (
        f"Total delay falls by 97\u00a0% ({round(low)} to {round(high)}\u00a0%), "
        f"from {totals['base']:.2f} to {totals['scenario']:.3f} veh·h."
    )


def test_one_pair_of_runs_has_no_interval_and_says_so() -> None:
    told = " ".join(answer(study(1).compared[0]))
    assert "One pair of runs" in told
    assert " to " in told  # from ... to ...
    assert "for sure" not in told
    assert "nan" not in told


def test_where_nothing_differs_nothing_is_made_of_it() -> None:
    base, _, _ = example_comparison(2)
    told = answer(Scenario("nothing", [], base, against_itself(2)))
    assert told == ["Nothing changes: all figures are equal in the 2 pairs of runs."]
    shown_alone = replace(study(2), scenarios=study(2).scenarios[1:2])
    assert panels(shown_alone) == []


def test_panels_hold_all_intervals_and_no_change() -> None:
    for panel in panels(study()):
        assert panel.ticks[0] <= 0 <= panel.ticks[-1]
        for one in panel.intervals:
            assert panel.ticks[0] <= one.low <= one.change <= one.high <= panel.ticks[-1]
    delay = panels(study())[0]
    assert [one.kind for one in delay.intervals] == ["better", "perhaps"]
    speed = next(panel for panel in panels(study()) if panel.figure == "average_speed_kmh")
    assert [one.kind for one in speed.intervals] == ["better", "perhaps"]


def test_names_become_short_plain_and_different() -> None:
    names = ["Größe!", "grosse", "Grosse", "日本", "🚗", "", "x" * 99]
    found = short_names(names)
    assert found[:3] == ["grosse", "grosse_2", "grosse_3"]
    assert len(set(found)) == len(names)
    assert all(name.isascii() and len(name) <= 42 for name in [*found, *short_names(EVIL)])


def test_joined_networks_have_each_link_once() -> None:
    base, scenario, _ = example_comparison(1)
    links = joined_network(base, [scenario, scenario]).links
    assert links["link_id"].tolist() == [*base.links["link_id"], "bc"]
    assert joined_network(base, []).links is base.links
