"""What a user sees while a run goes on: a bar on a terminal, plain lines in a pipe, or nothing."""

from __future__ import annotations

import logging
import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol, TextIO

from pipeline.lines import readable, show
from uxsim_geo.network.units import KMH

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress as Bar
    from rich.progress import TaskID

    from uxsim_geo.result import Progress


KNOWN_AFTER_S = 5.0  # how long a film takes is guessed from so much of it
WORTH_TELLING_S = 60.0  # whoever waits less need not know


class Watch(Protocol):
    """One who is told how things go."""

    def say(self, text: str) -> None:
        """Take a line about what has been done."""

    def simulated(self, progress: Progress) -> None:
        """Take the state of a simulation under way."""

    def drawn(self, name: str, share: float) -> None:
        """Take how far a film has come, 0 to 1."""

    def counted(self, done: int, of: int) -> None:
        """Take how many runs of a study are done; each has had its line."""


class Silence:
    """For ``--quiet``: nothing is shown."""

    def say(self, text: str) -> None:
        """Pass over it."""

    def simulated(self, progress: Progress) -> None:
        """Pass over it."""

    def drawn(self, name: str, share: float) -> None:
        """Pass over it."""

    def counted(self, done: int, of: int) -> None:
        """Pass over it."""


class Pace:
    """How long films will take yet, if they go on as they have begun.

    ``now`` gives the time in s. The first picture does not count: it waits for what all share.
    """

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self.now = now
        self.first: dict[str, tuple[float, float]] = {}

    def to_go(self, name: str, share: float) -> str:
        """In words, of a film of which a share is done; empty while nobody knows, or if it is soon.

        Nobody knows in the first seconds.
        """
        begin, at_begin = self.first.setdefault(name, (self.now(), share))
        spent = self.now() - begin
        if spent < KNOWN_AFTER_S or share <= at_begin:
            return ""
        left = spent * (1 - share) / (share - at_begin)
        return f"about {_in_words(left)} to go" if left >= WORTH_TELLING_S else ""


class Lines:
    """For pipes and files: one line for each tenth of the simulated time."""

    def __init__(self, stream: TextIO, pace: Pace | None = None) -> None:
        self.stream = stream
        self.tenths_shown = 0
        self.quarters: dict[str, int] = {}
        self.pace = pace or Pace()

    def say(self, text: str) -> None:
        """Write the line."""
        show(text, self.stream)

    def simulated(self, progress: Progress) -> None:
        """Write a line if another tenth has passed."""
        tenths = math.floor(10 * progress.time / progress.duration)
        if tenths > self.tenths_shown:
            self.tenths_shown = tenths
            so_far = f"{progress.time:,.0f} of {progress.duration:,.0f} s"
            self.say(f"  {so_far}, vehicles: {describe(progress)}")

    def drawn(self, name: str, share: float) -> None:
        """Write a line if another quarter of a film is done, and one when it will take long."""
        quarters = math.floor(4 * share)
        before, to_go = self.quarters.get(name), self.pace.to_go(name, share)
        if quarters > (before or 0) or (before is None and to_go):
            self.quarters[name] = quarters
            done = f"  {name}: {25 * quarters or round(100 * share)} %"
            self.say(f"{done}, {to_go}" if to_go else done)

    def counted(self, done: int, of: int) -> None:
        """Pass over it: the lines of the runs say it."""


class Terminal:
    """A bar with simulated time, vehicles on the road and speed, redrawn in place."""

    def __init__(self, bar: Bar, task: TaskID) -> None:
        self.bar = bar
        self.task = task
        self.pace = Pace()

    def say(self, text: str) -> None:
        """Print the line above the bar."""
        self.bar.console.print(readable(text), highlight=False, markup=False, soft_wrap=True)

    def simulated(self, progress: Progress) -> None:
        """Move the bar; it is shown from the first call to the end of the simulation."""
        self.bar.update(
            self.task,
            total=progress.duration,
            completed=progress.time,
            so_far=f"{progress.time:,.0f} of {progress.duration:,.0f} s",
            words=describe(progress),
            visible=progress.time < progress.duration,
        )

    def drawn(self, name: str, share: float) -> None:
        """Move the bar to where a film stands; it goes when the film is done."""
        self.bar.update(
            self.task,
            total=1.0,
            completed=share,
            so_far=f"{100 * share:.0f} %",
            words=", ".join(filter(None, (name, self.pace.to_go(name, share)))),
            visible=share < 1,
        )

    def counted(self, done: int, of: int) -> None:
        """Move the bar; it goes with the last run."""
        self.bar.update(
            self.task,
            total=float(of),
            completed=float(done),
            so_far=f"{done:,} of {of:,}",
            words="runs",
            visible=done < of,
        )


@dataclass(frozen=True)
class Prefixed:
    """Passes on what it is told, with a name before every line.

    warned
        warnings that were passed on: those that are like one of them are not told again
    """

    name: str
    watch: Watch
    warned: set[str] = field(default_factory=set)

    def say(self, text: str) -> None:
        """Pass the lines on."""
        lines = [line for line in text.splitlines() if line not in self.warned]
        self.warned.update(line for line in lines if line.startswith("warning: "))
        if lines:
            self.watch.say("\n".join(f"{self.name}: {line}" for line in lines))

    def simulated(self, progress: Progress) -> None:
        """Pass it on."""
        self.watch.simulated(progress)

    def drawn(self, name: str, share: float) -> None:
        """Pass it on."""
        self.watch.drawn(f"{self.name}: {name}", share)

    def counted(self, done: int, of: int) -> None:
        """Pass it on."""
        self.watch.counted(done, of)


@contextmanager
def watching(*, quiet: bool) -> Iterator[Watch]:
    """Yield the watch that fits: silence, a bar on a terminal, otherwise lines, on stderr.

    It is also told what the library logs, as that the engine must be compiled.
    """
    with _fitting(quiet=quiet) as watch:
        handler, logger = _Passing(watch), logging.getLogger("uxsim_geo")
        logger.addHandler(handler)
        try:
            yield watch
        finally:
            logger.removeHandler(handler)


class _Passing(logging.Handler):
    """Passes what is logged on to a watch."""

    def __init__(self, watch: Watch) -> None:
        super().__init__()
        self.watch = watch

    def emit(self, record: logging.LogRecord) -> None:
        """Pass it on."""
        self.watch.say(record.getMessage())


@contextmanager
def _fitting(*, quiet: bool) -> Iterator[Watch]:
    if quiet:
        yield Silence()
    elif not sys.stderr.isatty():
        yield Lines(sys.stderr)
    else:
        from rich.console import Console

        with bar_on(Console(stderr=True)) as bar:
            task = bar.add_task("", total=1.0, visible=False, so_far="", words="")
            yield Terminal(bar, task)


def bar_on(console: Console) -> Bar:
    """Return a bar between how far it has come and what is going on, in 80 columns."""
    from rich.progress import BarColumn, Progress, TextColumn

    return Progress(
        TextColumn("{task.fields[so_far]}"),
        BarColumn(bar_width=10),
        TextColumn("{task.fields[words]}"),
        console=console,
    )


def _in_words(seconds: float) -> str:
    """A time that is guessed: minutes, of long ones hours."""
    minutes = seconds / 60
    return f"{minutes:.0f} min" if minutes < 90 else f"{minutes / 60:.1f} h"


def describe(progress: Progress) -> str:
    """Say how many vehicles are under way, how fast, and how many have arrived."""
    speed = progress.mean_speed
    at_speed = "" if math.isnan(speed) else f" at {KMH * speed:.0f} km/h"
    return (
        f"{progress.vehicles_running:,} under way{at_speed}, "
        f"{progress.vehicles_completed:,} arrived"
    )
