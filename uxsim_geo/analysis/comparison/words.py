"""A comparison in sentences, with numbers, units and intervals."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.analysis.comparison.comparison import Comparison
from uxsim_geo.analysis.comparison.quantities import EITHER
from uxsim_geo.analysis.comparison.winners import NOTICED

#: figures that are told whenever they differ, in this order; others stand in the table alone
TOLD = (
    "total_delay_veh_h",
    "total_travel_time_veh_h",
    "total_origin_wait_veh_h",
    "completed_average_travel_time_s",
    "average_speed_kmh",
    "total_distance_veh_km",
    "vehicles_demanded",
    "vehicles_completed",
    "vehicles_unfinished",
    "vehicles_aborted",
    "total_toll",
    "gridlocked",
)

#: how much narrower an interval must be by pairing to say so
WORTH_TELLING = 1.05

#: links that are named
MOST_LINKS = 3


def in_sentences(comparison: Comparison) -> list[str]:
    """What the scenario changes, for somebody who reads this alone."""
    return [
        _heading(comparison),
        *comparison.remarks,
        *_totals(comparison.totals),
        *_links(comparison.links),
        *_trips(comparison),
    ]


def _heading(comparison: Comparison) -> str:
    pairs = len(comparison.seeds)
    runs = "one pair of runs" if pairs == 1 else f"{pairs} pairs of runs, one a seed"
    facts = comparison.facts
    return f"{facts.scenario} against {facts.base}, {runs}, {comparison.duration_s:,.0f} s each:"


def _totals(totals: pd.DataFrame) -> Iterator[str]:
    by_figure = {str(row["figure"]): row for row in totals.to_dict("records")}
    for name in TOLD:
        if abs(by_figure[name]["difference"]) > 0:
            yield _total(by_figure[name])
    if not (totals["difference"].fillna(0.0) != 0).any():
        yield "No figure differs at all."


def _total(row: Mapping[Any, Any]) -> str:
    unit = row["unit"]
    digits = _digits(row["difference"])
    parts = [f"{signed(row['difference'], digits)} {unit}"]
    if not math.isnan(row["low"]):
        low, high = (signed(row[name], digits) for name in ("low", "high"))
        parts[0] += f" (95 %: {low} to {high})"
    sides = [f"{row[name]:,.{digits}f}" for name in ("base", "scenario")]
    parts.append(f"from {sides[0]} to {sides[1]}")
    if not math.isnan(row["relative"]):
        parts.append(f"{signed(100 * row['relative'], 1)} %")
    text = f"{row['title']}: {', '.join(parts)}{_verdict(row)}"
    if row["narrowing"] > WORTH_TELLING:
        text += f"; pairing the runs made the interval {row['narrowing']:.1f} times as narrow"
    return f"{text}."


def _verdict(row: Mapping[Any, Any]) -> str:
    if math.isnan(row["p"]):
        return ""
    if not row["low"] * row["high"] > 0:
        return "; this may be chance"
    if row["better"] == EITHER:
        return "; beyond chance"
    return "; better" if row["better"] * row["difference"] > 0 else "; worse"


def _links(links: pd.DataFrame) -> Iterator[str]:
    for side in ("base", "scenario"):
        alone = links.loc[links["exists"] == side, "link_id"].tolist()
        if alone:
            number = f"{len(alone):,} link{'s' if len(alone) > 1 else ''} ({_some(alone)})"
            yield f"In the {side} alone: {number}; no differences are told of them."
    known = links[links["delay_veh_h_difference"].notna()]
    if known["delay_veh_h_p"].notna().any():
        found = known[known["delay_veh_h_significant"].fillna(False).astype(bool)]
        yield (
            f"Delay changes beyond chance on {len(found):,} of {len(known):,} links "
            "(5 % false discoveries among them)."
        )
        known = found
    for word, sign in (("more", 1.0), ("less", -1.0)):
        change = sign * known["delay_veh_h_difference"]
        most = change[change > 0].sort_values(ascending=False, kind="stable").index[:MOST_LINKS]
        named = [_link(row) for row in known.loc[most].to_dict("records")]
        if named:
            yield f"Most {word} delay: {'; '.join(named)}."


def _link(row: Mapping[Any, Any]) -> str:
    difference = row["delay_veh_h_difference"]
    digits = _digits(difference)
    text = f"{row['link_id']} {signed(difference, digits)} veh·h"
    if math.isnan(row["delay_veh_h_low"]):
        return text
    low, high = (signed(row[f"delay_veh_h_{name}"], digits) for name in ("low", "high"))
    return f"{text} (95 %: {low} to {high})"


def _trips(comparison: Comparison) -> Iterator[str]:
    everybody = comparison.trips[comparison.trips["group"] == "all"]
    if not len(everybody):
        yield "No vehicle departs in both: nobody can be said to gain or lose."
        return
    row = everybody.iloc[0]
    shares = [
        f"{_share(row, name)} {verb}" for name, verb in (("gaining", "gain"), ("losing", "lose"))
    ]
    unknown = 100 * row["undetermined_share"]
    rest = f"; of {unknown:.1f} % it cannot be said, as one run or both did not see them arrive"
    yield (
        f"Of {row['vehicles']:,.0f} vehicles in both, {' and '.join(shares)} more than "
        f"{NOTICED.seconds:g} s and {100 * NOTICED.share:g} % of their travel time"
        f"{rest if unknown > 0 else ''}."
    )
    yield from _statuses(comparison.trip_statuses)


def _share(row: pd.Series, name: str) -> str:
    low, high = (100 * row[f"{name}_share_{side}"] for side in ("low", "high"))
    text = f"{100 * row[f'{name}_share']:.1f} %"
    return text if math.isnan(low) else f"{text} (95 %: {max(low, 0):.1f} to {min(high, 100):.1f})"


def _statuses(statuses: pd.DataFrame) -> Iterator[str]:
    arrived = [statuses[f"status_{side}"] == "completed" for side in ("base", "scenario")]
    there = [statuses[f"status_{side}"] != "absent" for side in ("base", "scenario")]
    for side, other, name in ((0, 1, "base"), (1, 0, "scenario")):
        alone = statuses[arrived[side] & ~arrived[other] & there[other]]
        if len(alone):
            number = f"{alone['vehicles'].sum():,.1f}".removesuffix(".0")
            yield f"{number} vehicles arrive in the {name} alone."


def _some(names: list[str]) -> str:
    shown = ", ".join(names[:MOST_LINKS])
    return shown if len(names) <= MOST_LINKS else f"{shown}, …"


def _digits(value: float) -> int:
    """Decimals that show three digits of a number, at least of those before the point."""
    if value == 0 or not np.isfinite(value):
        return 0
    return int(min(max(2 - math.floor(math.log10(abs(value))), 0), 6))


def signed(value: float, digits: int) -> str:
    """A number with its sign, the true minus; 0 without one."""
    text = f"{abs(value):,.{digits}f}"
    if not any(digit in "123456789" for digit in text):
        return text
    return f"+{text}" if value > 0 else f"−{text}"
