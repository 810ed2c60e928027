"""A comparison in sentences: numbers as in the tables, and nothing said that is not known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
from compared import BASE, example_comparison, placed, run

from uxsim_geo.analysis.comparison.comparing import compare
from uxsim_geo.analysis.comparison.comparison import Comparison, Facts
from uxsim_geo.analysis.comparison.words import heading, in_sentences


def with_figure(found: Comparison, figure: str, **values: float) -> Comparison:
    """The comparison with other values of a figure."""
    totals = found.totals.copy()
    for name, value in values.items():
        totals.loc[totals["figure"] == figure, name] = value
    return replace(found, totals=totals)


def test_a_figure_with_unit_interval_percent_sides_and_the_verdict() -> None:
    _, _, found = example_comparison(4)
    rising = {
        "base": 4883.0,
        "scenario": 6797.0,
        "difference": 1914.0,
        "low": 1700.0,
        "high": 2128.0,
        "relative": 1914 / 4883,
        "narrowing": 5.6,
    }
    said = in_sentences(with_figure(found, "total_travel_time_veh_h", **rising))
    assert said[0] == (
        "Total travel time rises by 1,914 veh·h (95 %: 1,700 to 2,128), 39 %, from 4,883 to "
        "6,797 veh·h: worse."
    )
    narrow = "Same seeds in both made the interval of the total travel time 5.6 times as narrow."
    assert narrow in said


def test_what_falls_has_its_interval_in_order_and_what_may_be_chance_its_signs() -> None:
    _, _, found = example_comparison(4)
    values = {"base": 20.0, "scenario": 19.5, "difference": -0.5, "relative": -0.025}
    falling = with_figure(found, "average_speed_kmh", low=-0.7, high=-0.3, **values)
    (speed,) = (line for line in in_sentences(falling) if line.startswith("Mean speed"))
    assert speed == (
        "Mean speed falls by 0.5 km/h (95 %: 0.3 to 0.7), 2.5 %, from 20 to 19.5 km/h: worse."
    )
    chance = with_figure(found, "average_speed_kmh", low=-1.7, high=0.7, **values)
    assert not any(line.startswith("Mean speed") for line in in_sentences(chance))
    first = with_figure(found, "total_travel_time_veh_h", low=-1.7, high=0.7, **values)
    assert in_sentences(first)[0] == (
        "Total travel time changes by −0.5 veh·h (95 %: −1.7 to +0.7), −2.5 %, from 20 to 19.5 "
        "veh·h: this may be chance."
    )


def test_the_heading_says_what_is_compared() -> None:
    said = heading(example_comparison(4)[2])
    assert said == "other way against base, 4 pairs of runs, one a seed, 1,800 s each:"


def test_links_have_their_street_and_those_of_one_network_alone_no_difference() -> None:
    _, _, found = example_comparison(4)
    links = found.links.assign(
        name=found.links["link_id"].map({"ab": "Long Road", "bd": "Bridge"}).astype("str")
    )
    said = in_sentences(replace(found, links=links))
    assert "In the base alone: 1 link (Bridge); no differences are told of them." in said
    assert "In the scenario alone: 1 link (bc); no differences are told of them." in said
    (best,) = (line for line in said if line.startswith("Most delay is saved on "))
    assert best.startswith("Most delay is saved on Long Road −")
    assert " veh·h (95 %: −" in best
    # other links, so another free flow: delay alone would mislead
    assert any(line.startswith("Links, lengths or free speeds differ") for line in said)


def test_of_a_street_with_many_links_one_is_named() -> None:
    _, _, found = example_comparison(1)
    known = found.links["delay_veh_h_difference"].notna()
    links = found.links.assign(name="Main Street")
    links.loc[known, "delay_veh_h_difference"] = [float(number) for number in range(sum(known))]
    (worst,) = (
        line
        for line in in_sentences(replace(found, links=links))
        if line.startswith("Most delay is added")
    )
    assert worst.count("Main Street") == 1


def test_the_time_bin_that_changes_most_is_told_by_the_clock() -> None:
    _, _, found = example_comparison(4)
    times = found.link_times[["begin_s", "end_s"]].drop_duplicates(ignore_index=True)
    table = times.assign(delay_veh_h_difference=np.arange(len(times), dtype=float))
    last = float(times["begin_s"].max())
    total = len(times) * (len(times) - 1) // 2
    told = f"+{len(times) - 1} of +{total} veh·h in the whole run."
    found = replace(found, link_times=table)
    assert (
        f"Delay on links changes most from {last:,.0f} to {last + 300:,.0f} s: {told}"
    ) in in_sentences(found)
    by_clock = in_sentences(found, lambda begin, end: f"{begin:.0f}–{end:.0f}")
    assert any(f"most {last:.0f}–{last + 300:.0f}: {told}" in line for line in by_clock)


def test_one_pair_has_neither_intervals_nor_verdicts() -> None:
    _, _, found = example_comparison(1)
    said = "\n".join(in_sentences(found))
    assert "One pair of runs: differences have no intervals, and no test." in said
    for word in ("95 %", "for sure", "better", "worse", "nan"):
        assert word not in said


def test_no_difference_at_all() -> None:
    same = run(placed(BASE), 0)
    told = "Nothing changes: all figures are equal in the {} of runs."
    assert in_sentences(compare([(same, same)] * 2, Facts())) == [told.format("2 pairs")]
    assert in_sentences(compare([(same, same)], Facts())) == [told.format("pair")]


def test_winners_and_losers_by_their_number_and_hours() -> None:
    _, _, found = example_comparison(4)
    row = {
        "group": "all",
        "name": "",
        "vehicles": 20000.0,
        "gaining_share": 0.0,
        "losing_share": 0.205,
        "little_change_share": 0.795,
        "undetermined_share": 0.0,
        "gaining_share_low": 0.0,
        "gaining_share_high": 0.0,
        "losing_share_low": 0.19,
        "losing_share_high": 0.22,
        "gained_veh_h": 0.0,
        "lost_veh_h": 312.4,
    }
    said = in_sentences(replace(found, trips=pd.DataFrame([row])))
    assert (
        "Of 20,000 vehicles, 0 % arrive noticeably earlier and 20 % (95 %: 19 to 22) noticeably "
        "later, by more than 30 s and 5 % of their trip."
    ) in said
    assert (
        "Those who arrive earlier gain 0 veh·h together, those who arrive later lose 312 veh·h."
    ) in said
