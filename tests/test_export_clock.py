"""Texts of times: one rule for all that is made of a run."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta, timezone
from itertools import pairwise
from zoneinfo import ZoneInfo

import pytest

from uxsim_geo.export.clock import Clock

BERLIN = timezone(timedelta(hours=1))
HOUR, DAY = 3600.0, 86_400.0


def at(hour: int, minute: int = 0, second: int = 0) -> datetime:
    return datetime(2026, 3, 4, hour, minute, second, tzinfo=BERLIN)


@pytest.mark.parametrize(
    ("start", "moments", "seconds", "text"),
    [
        (at(7, 30), (0, 300, 600), 300, "07:35"),
        (at(7, 30), (0, 300, 600), 450, "07:38"),  # to the nearest minute, halves up
        (at(7, 30), (0, 90, 180), 180, "07:33:00"),  # all of a run in the same form
        (at(7, 30, 15), (0, 300), 300, "07:35:15"),
        (at(7, 30), (0, 0.5), 0.5, "07:30:00.5"),
        (at(7, 30), (0, 1 / 3), 1 / 3, "07:30:00.3"),
        (None, (0, 300), 300, "0:05"),
        (None, (0, 90), 3725, "1:02:05"),
        (None, (0, DAY, 2 * DAY), 100 * HOUR, "100:00"),
        (None, (0, 300), 59.96, "0:01"),
        (at(0), (0, DAY), DAY, "24:00"),  # a day that does not pass midnight
        (at(23), (0, 2 * HOUR), 0, "4 Mar 23:00"),
        (at(23), (0, 2 * HOUR), HOUR, "5 Mar 00:00"),
        (at(0), (0, 30 * DAY), 28 * DAY, "1 Apr 00:00"),
    ],
)
def test_times_are_told(
    start: datetime | None, moments: tuple[float, ...], seconds: float, text: str
) -> None:
    assert Clock.of(start, moments).text(seconds) == text


@pytest.mark.parametrize(
    ("hours", "end", "span"),
    [
        ((1, 2), 3, "08:00–09:00"),
        ((16, 17), 17, "23:00–24:00"),
        ((1, 2), 30, "4 Mar 08:00–09:00"),
        ((16, 17), 30, "4 Mar 23:00–24:00"),
        ((16, 18), 30, "4 Mar 23:00–5 Mar 01:00"),
        ((17, 18), 30, "5 Mar 00:00–01:00"),
    ],
)
def test_spans_tell_the_day_once(hours: tuple[int, int], end: int, span: str) -> None:
    clock = Clock.of(at(7), (0.0, end * HOUR))
    assert clock.span(*(hour * HOUR for hour in hours)) == span


def test_a_start_that_looks_like_a_default_is_a_start() -> None:
    assert Clock.of(datetime(2000, 1, 1, tzinfo=UTC), (0, 300)).text(0) == "00:00"
    assert Clock.of(None, (0, 300)).text(0) == "0:00"


def test_the_zone_is_that_of_the_start_all_over_the_run() -> None:
    # summer time begins on 29 March 2026 at 02:00
    start = datetime(2026, 3, 29, 1, 0, tzinfo=ZoneInfo("Europe/Berlin"))
    clock = Clock.of(start, (0, 4 * HOUR))
    assert clock.zone == "UTC+01:00"
    assert clock.text(2 * HOUR) == "03:00"
    west = timezone(timedelta(hours=-3, minutes=-30))
    assert Clock.of(start.replace(tzinfo=west), (0,)).zone == "UTC−03:30"
    assert Clock.of(start.replace(tzinfo=UTC), (0,)).zone == "UTC"
    with pytest.raises(ValueError, match="time zone"):
        Clock.of(start.replace(tzinfo=None), (0,))


def test_words_say_which_times_those_are() -> None:
    assert Clock.of(at(7), (0, HOUR)).in_words() == "Times are those of 4 March 2026, UTC+01:00."
    assert Clock.of(at(23), (0, 2 * HOUR)).in_words() == (
        "Times are in UTC+01:00; the simulation starts on 4 March 2026."
    )
    assert Clock.of(None, (0, HOUR)).in_words().startswith("Times are counted from the start")


@pytest.mark.parametrize(
    ("start", "end", "most", "ticks"),
    [
        (at(7, 10), 2 * HOUR, 7, "07:20 07:40 08:00 08:20 08:40 09:00"),
        (at(7, 10, 30), HOUR, 2, "07:30 08:00"),
        (at(22), 4 * HOUR, 4, "22:00 23:00 5 Mar 01:00 02:00"),
        (at(0), DAY, 4, "00:00 06:00 12:00 18:00 24:00"),
        (at(12), 10 * DAY, 5, "5 Mar 7 Mar 9 Mar 11 Mar 13 Mar"),
        (None, 90.0, 3, "0:00:00 0:00:30 0:01:00 0:01:30"),
        (None, 200.0, 7, "0:00 0:01 0:02 0:03"),
        (None, 90_000.0, 7, "0:00 4:00 8:00 12:00 16:00 20:00 24:00"),
    ],
)
def test_axes_have_round_times(start: datetime | None, end: float, most: int, ticks: str) -> None:
    told = Clock.of(start, (0.0, end)).ticks(most)
    assert " ".join(text for _, text in told) == ticks
    assert all(0 <= time <= end for time, _ in told)
    steps = {later - earlier for (earlier, _), (later, _) in pairwise(told)}
    assert len(steps) == 1
