"""What the page says in words: how bad it was, when, and where."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np

from uxsim_geo.analysis.types import Floats
from uxsim_geo.export.page.over_time import OverTime
from uxsim_geo.export.page.worst_places import WorstPlace
from uxsim_geo.network.units import KMH, TIMES

#: the date of second 0 that stands where nobody gave one
NO_DATE = datetime(2000, 1, 1, tzinfo=UTC)

#: less of the time than this lost, and nobody would speak of congestion
LITTLE = 0.02


def headlines(
    figures: Mapping[str, Any],
    network: OverTime,
    places: Sequence[WorstPlace],
    start: datetime,
) -> list[str]:
    """Sentences from the figures of the run (:func:`uxsim_geo.analysis.summary.summary`)."""
    return [
        *_vehicles(figures),
        *_severity(figures, network),
        *_worst_moment(network, start),
        *_where(places),
    ]


def clock(start: datetime, seconds: float) -> str:
    """What the clock shows so many seconds after the start."""
    moment = start + timedelta(seconds=float(seconds))
    return f"{moment:%H:%M:%S}" if moment.second else f"{moment:%H:%M}"


def times_in_words(start: datetime) -> str:
    """Which times those are that the clock shows."""
    if start == NO_DATE:
        return "Times are counted from the start of the simulation."
    # the libraries' zones have names of many kinds
    zone = f"UTC{start.isoformat()[-6:]}" if start.utcoffset() else "UTC"
    return f"Times are those of {start.day} {start:%B %Y}, {zone}."


def _vehicles(figures: Mapping[str, Any]) -> Iterator[str]:
    departed, completed = figures["vehicles_departed"], figures["vehicles_completed"]
    left = figures["vehicles_running"] + figures["vehicles_waiting"]
    text = f"{departed:,.0f} vehicles departed and {completed:,.0f} arrived"
    if left:
        text += f"; {left:,.0f} were still on the road or waiting to enter it at the end"
    yield text + "."
    if figures["gridlocked"]:
        yield "The network is gridlocked: vehicles wait for one another in a circle."


def _severity(figures: Mapping[str, Any], network: OverTime) -> Iterator[str]:
    total, delay = figures["total_travel_time_veh_s"], figures["total_delay_veh_s"]
    if not total:
        return
    lost = float(np.nansum(network.accumulation * np.diff(network.edges) * _share_lost(network)))
    speed = figures["average_speed_m_s"]
    yield (
        f"{100 * delay / total:.0f} % of all travel time was delay: {lost / TIMES['h']:,.0f} "
        f"vehicle-hours were lost on the links, {max(delay - lost, 0.0) / TIMES['h']:,.0f} by "
        "waiting to enter or on longer routes than the fastest"
        + (f". The mean speed was {speed * KMH:.0f} km/h." if speed is not None else ".")
    )


def _share_lost(network: OverTime) -> Floats:
    """Of the time on the links, the share that driving at free speed would have saved."""
    share: Floats = 1.0 - np.nan_to_num(network.speed_ratio, nan=1.0)
    return share


def _worst_moment(network: OverTime, start: datetime) -> Iterator[str]:
    lost = network.accumulation * _share_lost(network)
    worst = int(lost.argmax())
    ratio = network.speed_ratio[worst]
    if not lost[worst] or ratio > 1.0 - LITTLE:
        yield "Traffic flowed freely throughout."
        return
    begin, end = (clock(start, network.edges[worst + step]) for step in (0, 1))
    yield (
        f"It was worst from {begin} to {end}: {network.accumulation[worst]:,.0f} vehicles on the "
        f"road at {network.speed[worst]:.0f} km/h, {100 * ratio:.0f} % of their free speed, and "
        f"{network.queue[worst]:,.0f} of them queued{_waiting(network.waiting[worst])}."
    )


def _waiting(vehicles: float) -> str:
    return f"; {vehicles:,.0f} more waited to enter" if vehicles >= 1 else ""


def _where(places: Sequence[WorstPlace]) -> Iterator[str]:
    told = [f"{place.name} ({100 * place.share:.0f} %)" for place in places[:3]]
    if told:
        yield "Of the time lost on links, most was lost on " + "; ".join(told) + "."
