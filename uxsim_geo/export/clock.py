"""What the clock shows: the texts of all times in pages, sheets, pictures and films.

One rule for all of them:

- With a start the time of day in the zone of the start, ``07:05``; its offset from UTC stays that
  of the start over the whole run. Without one hours and minutes since the start, ``0:05``, which
  go on after 24 h.
- Seconds are shown, ``07:05:30``, where the moments told of a run are not all whole minutes on
  that clock, and tenths, ``07:05:30.5``, where they are not all whole seconds: all texts of a run
  have the same form. Other moments are rounded to it.
- A run that passes midnight tells the day too, ``5 Mar 00:15``. Midnight at the end of a span, or
  of a run of one day, is ``24:00``.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from datetime import datetime, timedelta, timezone

import numpy as np

#: tenths of a second
SECOND, MINUTE, HOUR, DAY = 10, 600, 36_000, 864_000

#: s between two ticks of an axis: parts of a minute for what is shorter than two
TICK_SECONDS = (1, 2, 5, 10, 15, 30)
TICK_MINUTES = (1, 2, 5, 10, 15, 20, 30, 60, 120, 180, 240, 360, 720, 1440)

MONTHS = (
    *("January", "February", "March", "April", "May", "June"),
    *("July", "August", "September", "October", "November", "December"),
)


@dataclass(frozen=True)
class Clock:
    """The clock of a run.

    start
        date and time at 0 s, with its zone; None: nobody told it
    step
        tenths of a second to which times are told: a minute, a second or one tenth
    end
        of the run, s
    """

    start: datetime | None = None
    step: int = MINUTE
    end: float = 0.0

    @classmethod
    def of(cls, start: datetime | None, moments: Iterable[float]) -> Clock:
        """The clock for moments of a run, s after ``start``, the last of which ends it.

        Raises ValueError for a start without a time zone.
        """
        if start is not None:
            offset = start.utcoffset()
            if offset is None:
                raise ValueError(f"start needs a time zone, as UTC: {start.isoformat()}")
            start = start.replace(tzinfo=timezone(offset))
        told = np.fromiter(moments, float)
        shown = 10 * told + _tenth_of_day(start)
        steps = (step for step in (MINUTE, SECOND) if _are_multiples(shown, step))
        return cls(start, next(steps, 1), float(told.max(initial=0.0)))

    @property
    def tells_days(self) -> bool:
        """Whether the run passes midnight, by a clock that knows the time of day."""
        return self.start is not None and self._tenths(self.end) > DAY

    def text(self, seconds: float) -> str:
        """What the clock shows so many seconds after the start."""
        day, tenth = self._day_and_tenth(seconds)
        if self.tells_days:
            return f"{self._day(day)} {self._time(tenth)}"
        return self._time(DAY * day + tenth)

    def span(self, begin: float, end: float) -> str:
        """From when to when; the day once, unless it changes."""
        (first, _), (last, tenth) = self._day_and_tenth(begin), self._day_and_tenth(end)
        if self.tells_days and last == first + 1 and tenth == 0:
            return f"{self.text(begin)}–{self._time(DAY)}"
        until = self._time(tenth) if self.tells_days and first == last else self.text(end)
        return f"{self.text(begin)}–{until}"

    @property
    def zone(self) -> str:
        """Of the time of day, as UTC+01:00; empty without a start."""
        if self.start is None:
            return ""
        offset = self.start.utcoffset() or timedelta()
        hours, minutes = divmod(round(abs(offset).total_seconds() / 60), 60)
        sign = "−" if offset < timedelta() else "+"
        return f"UTC{sign}{hours:02d}:{minutes:02d}" if offset else "UTC"

    def in_words(self) -> str:
        """Which times those are that the clock shows, a sentence."""
        if self.start is None:
            return "Times are counted from the start of the simulation."
        day = f"{self.start.day} {MONTHS[self.start.month - 1]} {self.start.year}"
        if self.tells_days:
            return f"Times are in {self.zone}; the simulation starts on {day}."
        return f"Times are those of {day}, {self.zone}."

    def ticks(self, most: int) -> list[tuple[float, str]]:
        """Round times on the clock for an axis, s after the start, and what stands beside them.

        About ``most`` of them at most. Where the run passes midnight, the day stands there.
        """
        step = _tick_step(self.end, most)
        first = -_tenth_of_day(self.start) / 10 % min(step, 86_400)
        clock = replace(self, step=MINUTE if step % 60 == 0 else SECOND)
        times = np.arange(first, self.end + 1e-6, step).tolist()
        return [(time, clock._tick(time)) for time in times]

    def _tick(self, seconds: float) -> str:
        day, tenth = self._day_and_tenth(seconds)
        if not self.tells_days:
            return self.text(seconds)
        return self._time(tenth) if tenth else self._day(day)

    def _tenths(self, seconds: float) -> int:
        """Since midnight before the start, or since the start where its time is not known."""
        exact = 10 * seconds + _tenth_of_day(self.start)
        return math.floor(exact / self.step + 0.5) * self.step

    def _day_and_tenth(self, seconds: float) -> tuple[int, int]:
        """Days since that of the start, and tenths of a second since midnight."""
        return divmod(self._tenths(seconds), DAY)

    def _day(self, day: int) -> str:
        assert self.start is not None
        date = self.start.date() + timedelta(days=day)
        return f"{date.day} {MONTHS[date.month - 1][:3]}"

    def _time(self, tenths: int) -> str:
        hours = f"{tenths // HOUR}" if self.start is None else f"{tenths // HOUR:02d}"
        text = f"{hours}:{tenths % HOUR // MINUTE:02d}"
        if self.step < MINUTE:
            text += f":{tenths % MINUTE // SECOND:02d}"
        return f"{text}.{tenths % SECOND}" if self.step < SECOND else text


def duration_in_words(seconds: float) -> str:
    """A length of time, in minutes from two of them on, else in seconds."""
    if seconds >= 2 * 60:
        return f"{seconds / 60:,.1f} min"
    return f"{seconds:.{0 if seconds >= 10 else 1}f} s"


def _tenth_of_day(start: datetime | None) -> float:
    if start is None:
        return 0.0
    seconds = 3600 * start.hour + 60 * start.minute + start.second
    return 10 * seconds + start.microsecond / 1e5


def _are_multiples(tenths: np.ndarray, step: int) -> bool:
    return bool((np.abs(tenths - step * np.rint(tenths / step)) < 0.01).all())


def _tick_step(duration: float, most: int) -> float:
    """Seconds between two ticks: round, in such a number that there is room for them."""
    parts = TICK_SECONDS if duration < 120 else ()
    steps = [*parts, *(60 * minutes for minutes in TICK_MINUTES)]
    days = 86_400 * math.ceil(duration / 86_400 / most)
    return next((float(step) for step in steps if duration / step <= most), float(days))
