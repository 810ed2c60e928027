"""A comparison in sentences: numbers as in the tables, and nothing said that is not known."""

from __future__ import annotations

import pytest
from compared import BASE, example_comparison, placed, run

from uxsim_geo.analysis.comparison.comparing import compare
from uxsim_geo.analysis.comparison.comparison import Facts
from uxsim_geo.analysis.comparison.words import in_sentences, signed


def test_a_figure_with_its_interval_its_sides_and_the_verdict() -> None:
    _, _, found = example_comparison(3)
    row = found.totals.set_index("figure").loc["total_delay_veh_h"]
    said = in_sentences(found)
    assert said[0] == "other way against base, 3 pairs of runs, one a seed, 1,800 s each:"
    (delay,) = [line for line in said if line.startswith("total delay")]
    low, high = signed(row["low"], 2), signed(row["high"], 2)
    assert f"{signed(row['difference'], 2)} veh·h (95 %: {low} to {high})" in delay
    assert f"from {row['base']:.2f} to {row['scenario']:.2f}" in delay
    assert delay.endswith("; better.")  # pairing did not help: nothing is said of it
    (wait,) = [line for line in said if line.startswith("wait to enter")]
    assert "; worse" in wait
    assert "pairing the runs made the interval" in wait
    assert not any(line.startswith("vehicles arrived") for line in said)  # no difference


def test_links_of_one_network_alone_are_told_and_have_no_difference() -> None:
    _, _, found = example_comparison(4)
    said = in_sentences(found)
    assert "In the base alone: 1 link (bd); no differences are told of them." in said
    assert "In the scenario alone: 1 link (bc); no differences are told of them." in said
    (worst, best) = (line for line in said if line.startswith("Most "))
    assert "ea +" in worst
    assert best.startswith("Most less delay: ab −")


def test_one_pair_has_neither_intervals_nor_verdicts() -> None:
    _, _, found = example_comparison(1)
    said = "\n".join(in_sentences(found))
    assert "One pair of runs: differences have no intervals, and no test." in said
    assert "95 %" not in said
    assert "beyond chance" not in said
    assert "better" not in said


def test_no_difference_at_all() -> None:
    same = run(placed(BASE), 0)
    said = in_sentences(compare([(same, same)] * 2, Facts()))
    assert "No figure differs at all." in said
    assert "Delay changes beyond chance on 0 of 6 links (5 % false discoveries among them)." in said


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [(1234.5, 0, "+1,234"), (-0.5, 1, "−0.5"), (0.04, 1, "0.0"), (0.0, 0, "0"), (-1e-9, 2, "0.00")],
)
def test_signs(value: float, digits: int, text: str) -> None:
    assert signed(value, digits) == text
