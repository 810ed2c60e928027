"""Where every platoon is at regular moments, and densities by place and time from that."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from uxsim_geo.analysis.passages import Floats, Integers, Passages


@dataclass(frozen=True)
class Samples:
    """Platoons on links at multiples of ``interval`` s; arrays of one length, by passage and time.

    row (of the passages), time (s), position (m from the start of the link), speed (m/s, mean
    until the next moment or the exit: at one moment platoons in a queue either stand or drive).
    """

    interval: float
    row: Integers
    time: Floats
    position: Floats
    speed: Floats

    @classmethod
    def of(cls, passages: Passages, interval: float, duration: float) -> Samples:
        """Look at every passage from its entry on, before its exit and before ``duration``, s."""
        first = np.ceil(passages.enter / interval)
        last = np.ceil(np.minimum(passages.exit, duration) / interval)
        counts = np.maximum(last - first, 0).astype(np.int64)
        row = np.repeat(np.arange(passages.link.size), counts)
        before = np.cumsum(counts) - counts
        number = np.arange(row.size) - before[row]
        time = (first[row] + number) * interval
        position = passages.positions(row, time)
        ahead = np.minimum(np.minimum(interval, duration - time), passages.exit[row] - time)
        driven = passages.positions(row, time + ahead) - position
        speed = np.divide(driven, ahead, out=np.zeros_like(time), where=ahead > 0)
        return cls(interval, row, time, position, speed)

    def where(self, chosen: npt.NDArray[np.bool_]) -> Samples:
        """The samples for which ``chosen`` holds; shape (samples,)."""
        return Samples(
            self.interval,
            self.row[chosen],
            self.time[chosen],
            self.position[chosen],
            self.speed[chosen],
        )


@dataclass(frozen=True)
class Cells:
    """States of one link by time and place; matrices have the shape (times, places).

    time, place
        edges of the cells: s, and m from the start of the link
    density, speed
        veh/m of the whole link; m/s, NaN where nobody was seen
    """

    time: Floats
    place: Floats
    density: Floats
    speed: Floats


def cells_of_link(
    passages: Passages, samples: Samples, link: int, edges: tuple[Floats, Floats]
) -> Cells:
    """Gather the samples of a link (its row) in cells with edges in time (s) and place (m).

    Each sample stands for its platoon's vehicles for one interval: the density is their sum times
    the interval over the area of the cell, exact as the cells grow against the interval.
    """
    time, place = edges
    own = passages.link[samples.row] == link
    vehicles = passages.vehicles[samples.row[own]]
    points = (samples.time[own], np.minimum(samples.position[own], np.nextafter(place[-1], 0.0)))
    seen, _, _ = np.histogram2d(*points, bins=[time, place], weights=vehicles)
    driven, _, _ = np.histogram2d(
        *points, bins=[time, place], weights=vehicles * samples.speed[own]
    )
    area = np.diff(time)[:, None] * np.diff(place)[None, :]
    speed = np.divide(driven, seen, out=np.full(seen.shape, np.nan), where=seen > 0)
    return Cells(time, place, seen * samples.interval / area, speed)
