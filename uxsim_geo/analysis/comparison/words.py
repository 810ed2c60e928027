"""A comparison in sentences, with numbers, units and intervals: wherever it is told in words."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.analysis.comparison.comparison import Comparison
from uxsim_geo.analysis.comparison.link_words import links_in_sentences
from uxsim_geo.analysis.comparison.numbers import (
    NOTHING,
    digits_of,
    is_sure,
    number,
    percent,
    with_interval,
)
from uxsim_geo.analysis.comparison.quantities import EITHER
from uxsim_geo.analysis.comparison.winners import NOTICED

#: figures that are told if they change for sure, or if that is not known; the first always
TOLD = (
    "total_travel_time_veh_h",
    "total_delay_veh_h",
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

#: share of the vehicles that is not worth a word
RARE = 0.0005

#: how many times narrower an interval must be by pairing to say so
WORTH_TELLING = 1.05

#: delay that is not worth a sentence, veh·h
LITTLE = 0.05

#: tells a time bin, of its begin and end, s after the start
Span = Callable[[float, float], str]


def in_sentences(comparison: Comparison, span: Span | None = None) -> list[str]:
    """What the scenario changes, a sentence each, the most important first.

    ``span`` tells time bins (None: in s after the start).
    """
    if is_nothing(comparison):
        pairs = len(comparison.seeds)
        where = "the pair" if pairs == 1 else f"the {pairs} pairs"
        return [f"Nothing changes: all figures are equal in {where} of runs."]
    return [
        *_totals(comparison.totals),
        *_trips(comparison),
        *links_in_sentences(comparison.links),
        *_times(comparison, span or _seconds),
        *comparison.remarks,
    ]


def heading(comparison: Comparison) -> str:
    """What is compared, before the sentences."""
    pairs = len(comparison.seeds)
    runs = "one pair of runs" if pairs == 1 else f"{pairs} pairs of runs, one a seed"
    facts = comparison.facts
    return f"{facts.scenario} against {facts.base}, {runs}, {comparison.duration_s:,.0f} s each:"


def is_nothing(comparison: Comparison) -> bool:
    """Whether every figure and every link is the same."""
    changes = comparison.totals["difference"].fillna(0.0).abs().max()
    links = comparison.links
    delay = links["delay_veh_h_difference"].fillna(0.0).abs().max()
    volume = links["volume_veh_difference"].fillna(0.0).abs().max()
    alone = (links["exists"] != "both").any()
    return bool(max(changes, delay, volume) <= NOTHING and not alone)


def noticed() -> str:
    """From what change on somebody gains or loses."""
    return f"{NOTICED.seconds:g} s and {100 * NOTICED.share:g} %"


def _totals(totals: pd.DataFrame) -> Iterator[str]:
    by_figure = {str(row["figure"]): row for row in totals.to_dict("records")}
    first, *others = (by_figure[name] for name in TOLD)
    yield _total(first)
    for row in others:
        if is_sure(row) is not False and abs(row["difference"]) > NOTHING:
            yield _total(row)
    if first["narrowing"] > WORTH_TELLING:
        times = f"{first['narrowing']:.1f} times as narrow"
        yield f"Same seeds in both made the interval of the {first['title']} {times}."


def _total(row: Mapping[Any, Any]) -> str:
    """As ``Total delay rises by 564 veh·h (95 %: 500 to 628), 12 %, from … to …: worse``."""
    title, unit = _capital(row["title"]), row["unit"]
    if not abs(row["difference"]) > NOTHING:
        return f"{title} stays at {number(row['base'])} {unit}."
    sure, change = is_sure(row), row["difference"]
    verb = "changes" if sure is False else "rises" if change > 0 else "falls"
    flip = -1.0 if verb == "falls" else 1.0
    told = with_interval(flip * change, (flip * row["low"], flip * row["high"]), unit, sure)
    if not math.isnan(row["relative"]):
        told += f", {percent(100 * flip * row['relative'], signed=sure is False)} %"
    base, scenario = (number(row[end], digits=digits_of(change)) for end in ("base", "scenario"))
    return f"{title} {verb} by {told}, from {base} to {scenario} {unit}{_verdict(row)}."


def _verdict(row: Mapping[Any, Any]) -> str:
    sure = is_sure(row)
    if sure is False:
        return ": this may be chance"
    if sure is None or row["better"] == EITHER:
        return ""
    return ": better" if row["better"] * row["difference"] > 0 else ": worse"


def _trips(comparison: Comparison) -> Iterator[str]:
    everybody = comparison.trips[comparison.trips["group"] == "all"]
    if not len(everybody) or not everybody["vehicles"].iloc[0] > 0:
        yield "No vehicle departs in both: nobody can be said to gain or lose."
        return
    row = everybody.iloc[0]
    gain, lose = (_share(row, name) for name in ("gaining", "losing"))
    unknown = percent(100 * row["undetermined_share"])
    rest = f"; of {unknown} % it cannot be said, as one run or both did not see them arrive"
    yield (
        f"Of {row['vehicles']:,.0f} vehicles, {gain} arrive noticeably earlier and {lose} "
        f"noticeably later, by more than {noticed()} of their trip"
        f"{rest if row['undetermined_share'] > RARE else ''}."
    )
    yield (
        f"Those who arrive earlier gain {number(row['gained_veh_h'])} veh·h together, "
        f"those who arrive later lose {number(row['lost_veh_h'])} veh·h."
    )
    yield from _statuses(comparison.trip_statuses)


def _share(row: pd.Series, name: str) -> str:
    share, low, high = (100 * row[f"{name}_share{end}"] for end in ("", "_low", "_high"))
    text = f"{percent(share)} %"
    if math.isnan(low) or share == 0:
        return text
    return f"{text} (95 %: {percent(max(low, 0.0))} to {percent(min(high, 100.0))})"


def _statuses(statuses: pd.DataFrame) -> Iterator[str]:
    arrived = [statuses[f"status_{side}"] == "completed" for side in ("base", "scenario")]
    there = [statuses[f"status_{side}"] != "absent" for side in ("base", "scenario")]
    for side, other, name in ((0, 1, "base"), (1, 0, "scenario")):
        alone = statuses[arrived[side] & ~arrived[other] & there[other]]
        if len(alone):
            vehicles = f"{alone['vehicles'].sum():,.1f}".removesuffix(".0")
            who = "vehicle arrives" if vehicles == "1" else "vehicles arrive"
            yield f"{vehicles} {who} in the {name} alone."


def _times(comparison: Comparison, span: Span) -> Iterator[str]:
    """When delay changes most, of all links together, the way that it changes in the whole."""
    change = comparison.link_times.groupby(["begin_s", "end_s"])["delay_veh_h_difference"].sum()
    total = float(change.sum())
    if len(change) < 2 or abs(total) < LITTLE:
        return
    begin, end = change.index[int(np.argmax(np.sign(total) * change.to_numpy()))]
    most = number(float(change.loc[(begin, end)]), signed=True)
    whole = number(total, signed=True)
    when = f"{span(begin, end)}: {most} of {whole} veh·h in the whole run"
    yield f"Delay on links changes most {when}."


def _seconds(begin: float, end: float) -> str:
    return f"from {begin:,.0f} to {end:,.0f} s"


def _capital(text: str) -> str:
    return text[0].upper() + text[1:]
