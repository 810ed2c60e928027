"""Where platoons are at chosen moments."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Real

import numpy as np
import numpy.typing as npt

from uxsim_geo.analysis.bins import numbers_of
from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.table_size import MOST_BINS, MOST_SAMPLES, check_rows, shortest_step
from uxsim_geo.analysis.types import Booleans, Floats, Integers
from uxsim_geo.errors import Faults


@dataclass(frozen=True)
class Samples:
    """Platoons on links at some moments; arrays of one length, by passage and time.

    interval (s, what each sample stands for: over which its speed is taken), row (of the passages),
    time (s), position (m from the start of the link), speed (m/s, mean over the interval that
    begins here, up to the exit or the end of the simulation: at one moment platoons in a queue
    either stand or drive; NaN at the very end).
    """

    interval: float
    row: Integers
    time: Floats
    position: Floats
    speed: Floats

    @classmethod
    def of(cls, passages: Passages, interval: float, duration: float) -> Samples:
        """Look at every passage at multiples of ``interval``, s, before ``duration``, s.

        Raises :class:`uxsim_geo.errors.InputError` for an interval that is no finite number above
        0, or so short that there are more than a million moments or 50 million samples.
        """
        check_step("interval", interval, duration)
        moments = np.arange(int(np.ceil(duration / interval))) * np.float64(interval)
        rows, moments = np.arange(passages.link.size), moments[moments < duration]
        samples = int(seen_at(passages, rows, moments)[1].sum())
        check_rows(samples, MOST_SAMPLES, "interval", "take a longer one", interval)
        return cls.at(passages, rows, moments, interval=interval, end=duration)

    @classmethod
    def at(
        cls,
        passages: Passages,
        rows: Integers,
        moments: Floats,
        *,
        interval: float,
        end: float,
    ) -> Samples:
        """Look at some passages (``rows``) at ``moments``, from the entry on and before the exit.

        ``moments`` ascend, s, up to ``end``, that of the simulation.
        """
        first, counts = seen_at(passages, rows, moments)
        row = np.repeat(rows, counts)
        time = moments[numbered_from(first, counts)]
        position = passages.positions(row, time)
        ahead = np.minimum(np.minimum(interval, end - time), passages.exit[row] - time)
        driven = passages.positions(row, time + ahead) - position
        speed = np.divide(driven, ahead, out=np.full_like(time, np.nan), where=ahead > 0)
        # of an instant before the exit, rounding of the two positions could make any speed
        speed = np.minimum(speed, passages.geometry.free_speed[passages.link[row]])
        return cls(interval, row, time, position, speed)

    def of_share(self, passages: Passages, share: float) -> Samples:
        """The samples of a share of the platoons, spread evenly over them as they depart.

        Shown are those at which the sum of shares comes to the next whole number; if none of them
        is on a link at any moment, of a share above 0 the first that is.
        """
        vehicle = passages.vehicle[self.row]
        chosen = is_of_share(vehicle, share)
        if share > 0 and vehicle.size and not chosen.any():
            chosen = vehicle == vehicle.min()
        return self.where(chosen)

    def where(self, chosen: npt.NDArray[np.bool_]) -> Samples:
        """The samples for which ``chosen`` holds; shape (samples,)."""
        return Samples(
            self.interval,
            self.row[chosen],
            self.time[chosen],
            self.position[chosen],
            self.speed[chosen],
        )


def is_of_share(vehicle: Integers, share: float) -> Booleans:
    """Whether each vehicle is one at which the sum of shares comes to the next whole number."""
    chosen: Booleans = np.floor((vehicle + 1) * share) > np.floor(vehicle * share)
    return chosen


def check_step(name: str, step: float, duration: float) -> None:
    """Raise :class:`uxsim_geo.errors.InputError` for a step, s, that is none, or makes too many."""
    faults = Faults()
    if not isinstance(step, Real) or not 0 < step < float("inf"):
        faults.add("must be a finite number of seconds above 0", column=name, value=step)
    elif duration / float(step) > MOST_BINS:
        shortest = shortest_step(duration, MOST_BINS)
        what = f"makes more than {MOST_BINS:,} moments: take {shortest:g} s or more"
        faults.add(what, column=name, value=step)
    faults.raise_if_any()


def checked_moments(times: npt.ArrayLike, duration: float) -> Floats:
    """Moments as an array, s, in the order given; shape (moments,).

    Raises :class:`uxsim_geo.errors.InputError` if there are none, or for each that does not lie
    between 0 and ``duration``.
    """
    moments = np.atleast_1d(numbers_of(times, "times"))
    faults = Faults()
    if moments.size == 0:
        faults.add("is empty: name one moment at least", column="times")
    for moment in moments[~((moments >= 0) & (moments <= duration))]:
        what = f"must lie between 0 and the end of the simulation, {duration:g} s"
        faults.add(what, column="times", value=moment)
    faults.raise_if_any()
    return moments


def seen_at(passages: Passages, rows: Integers, moments: Floats) -> tuple[Integers, Integers]:
    """The first of the ascending ``moments`` (s) in each of some passages, and how many there are.

    A platoon is on a link from its entry on and before its exit.
    """
    first = np.searchsorted(moments, passages.enter[rows], side="left")
    last = np.searchsorted(moments, passages.exit[rows], side="left")
    return first.astype(np.int64), np.maximum(last - first, 0).astype(np.int64)


def numbered_from(first: Integers, counts: Integers) -> Integers:
    """For each ``i`` the ``counts[i]`` whole numbers from ``first[i]`` on, one after the other."""
    before = np.cumsum(counts) - counts
    numbers: Integers = np.arange(counts.sum()) + np.repeat(first - before, counts)
    return numbers
