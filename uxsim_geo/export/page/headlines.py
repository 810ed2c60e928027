"""What the page says in words: how bad it was, when, and where, and what was done about it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from uxsim_geo.export.clock import Clock
from uxsim_geo.export.lost_time import NONE, LostTime, in_words
from uxsim_geo.export.page.over_time import OverTime
from uxsim_geo.export.run_description import Change
from uxsim_geo.network.units import KMH

#: less of the time than this lost, and nobody would speak of congestion
LITTLE = 0.02

#: of longer lists only so many are told
MOST_STREETS = 3
MOST_CHANGES = 8


def headlines(
    figures: Mapping[str, Any], network: OverTime, lost: LostTime, clock: Clock
) -> list[str]:
    """Sentences from the figures of the run (:func:`uxsim_geo.analysis.summary.summary`).

    ``network`` in the bins of the report, as ``lost``.
    """
    return [
        *_vehicles(figures),
        *_severity(figures, lost),
        *_worst_moment(network, lost, clock),
        *_where(lost),
    ]


def changes_in_words(changes: Sequence[Change], clock: Clock) -> list[str]:
    """What was closed or changed during the run, a sentence each, those first that came first."""
    ordered = sorted(changes, key=lambda change: change.begin)
    told = [f"{_when(one, clock)}: {one.what}, {one.where}." for one in ordered[:MOST_CHANGES]]
    rest = len(changes) - len(told)
    return told + ([f"And {rest:,} more; config.yaml of the run has them all."] if rest else [])


def _when(change: Change, clock: Clock) -> str:
    end = min(change.end, clock.end)
    if change.begin <= 0 and end >= clock.end:
        return "The whole time"
    if math.isinf(change.end):
        return f"From {clock.text(change.begin)} on"
    return clock.span(change.begin, end)


def _vehicles(figures: Mapping[str, Any]) -> Iterator[str]:
    departed, completed = figures["vehicles_departed"], figures["vehicles_completed"]
    left = figures["vehicles_running"] + figures["vehicles_waiting"]
    text = f"{departed:,.0f} vehicles departed and {completed:,.0f} arrived"
    if left:
        text += f"; {left:,.0f} were still on the road or waiting to enter it at the end"
    yield text + "."
    if figures["gridlocked"]:
        yield "The network is gridlocked: vehicles wait for one another in a circle."


def _severity(figures: Mapping[str, Any], lost: LostTime) -> Iterator[str]:
    total, delay = figures["total_travel_time_veh_s"], figures["total_delay_veh_s"]
    if not total:
        return
    share, on_links = 100 * delay / total, float(lost.delay.sum())
    if in_words(delay) == in_words(on_links) == NONE:
        yield "Nobody was delayed."
        return
    told = f"{share:.0f} %" if share >= 0.5 else "Less than 1 %"
    speed = figures["average_speed_m_s"]
    yield (
        f"{told} of all travel time was delay: {in_words(on_links)} on the links, "
        f"{in_words(delay - on_links)} by waiting to enter or on longer routes than the fastest."
        + (f" The mean speed was {speed * KMH:.0f} km/h." if speed is not None else "")
    )


def _worst_moment(network: OverTime, lost: LostTime, clock: Clock) -> Iterator[str]:
    """Means of the worst bin, and how many stood at its end, each in a sentence of its own."""
    worst = lost.worst_bin
    ratio = network.speed_ratio[worst]
    if in_words(lost.in_bins[worst]) == NONE or ratio > 1.0 - LITTLE:
        yield "Traffic flowed freely throughout."
        return
    begin, end = float(lost.begin[worst]), float(lost.end[worst])
    yield (
        f"It was worst from {clock.text(begin)} to {clock.text(end)}: on average "
        f"{_count(network.accumulation[worst])} vehicles were on the road in that time, at "
        f"{network.speed[worst]:.0f} km/h, {100 * ratio:.0f} % of their free speed."
    )
    yield (
        f"At {clock.text(end)}, {_count(network.queue[worst])} of the "
        f"{_count(network.running[worst])} then on the road were queued"
        f"{_waiting(network.waiting[worst])}."
    )


def _count(vehicles: float) -> str:
    """Vehicles, with a decimal where few are no whole number."""
    return f"{vehicles:,.{0 if vehicles >= 10 or abs(vehicles - round(vehicles)) < 0.05 else 1}f}"


def _waiting(vehicles: float) -> str:
    return f"; {vehicles:,.0f} more waited to enter" if vehicles >= 1 else ""


def _where(lost: LostTime) -> Iterator[str]:
    told = [f"{one.name} ({100 * one.share:.0f} %)" for one in lost.streets(MOST_STREETS)]
    if told:
        *first, last = told  # names may hold semicolons
        listed = f"{', '.join(first)} and {last}" if first else last
        yield f"Of the time lost on links, most was lost on {listed}."
