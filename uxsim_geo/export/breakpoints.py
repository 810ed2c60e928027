"""Where the ways of platoons over a link bend: with these points alone they are drawn exactly.

By the closed form of :mod:`uxsim_geo.analysis.passages` the way of a platoon k consists of straight
lines. It bends where k feels that platoon a ahead of it has left, where it has then closed up to
where it stands until the exit of the next is felt, and where it comes, driving freely, to the place
where it stands for the first time; with C vehicles ahead, n_a in platoon a, free speed u:

    t = s_a + (C_k − C_a) τ/m      t + n_a / (m κ u)      e_k + (L − (C_k − C_a) / (m κ)) / u

Where speed limits change, ways may bend elsewhere too; points at even times then come beside. On
links with millions of bends points at even times stand for all of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.samples import numbered_from
from uxsim_geo.analysis.types import Floats, Integers

EVEN = 24  # points at even times on each way where limits change
MOST = 2_000_000  # bends of a link; beyond, no picture can show them, and memory would run short
COARSE = 100  # points at even times on each way then
STRAIGHT = 1e-6  # a point so near to the line between its neighbours is left out, m
SAME = 1e-6  # points that lie less far apart are one, s


@dataclass(frozen=True)
class Ways:
    """Ways over one link as points, one way after the other; arrays of one length.

    row (of the passages), time (s), position (m from the start of the link).
    """

    row: Integers
    time: Floats
    position: Floats

    def lines(self, start: float = 0.0) -> list[Floats]:
        """Points of each way, shape (points, 2): time, and distance from ``start`` metres on."""
        points = np.stack([self.time, start + self.position], axis=1)
        return np.split(points, np.flatnonzero(np.diff(self.row)) + 1) if len(points) else []


def ways_on_link(
    passages: Passages, link: int, duration: float, cuts: Floats | None = None
) -> Ways:
    """The ways of all platoons over a link (its row), up to ``duration``, s.

    There are points too at the times ``cuts`` (ascending, s), on straight parts as well.
    """
    rows = np.arange(passages.first[link], passages.first[link + 1])
    rows = rows[passages.enter[rows] < duration]
    end = np.minimum(passages.exit[rows], duration)
    of, time = (np.concatenate(x) for x in zip(*_bends(passages, rows, end), strict=True))
    inside = (time > passages.enter[rows][of] + SAME) & (time < end[of] - SAME)
    own, at = _cuts(passages.enter[rows], end, np.empty(0) if cuts is None else cuts)
    every = np.arange(len(rows))
    row = rows[np.concatenate([of[inside], own, every, every])]
    kept = np.repeat([False, True], [int(inside.sum()), len(own) + 2 * len(rows)])
    time = np.concatenate([time[inside], at, passages.enter[rows], end])
    return _sorted_ways(passages, row, time, kept)


def _sorted_ways(
    passages: Passages, row: Integers, time: Floats, kept: npt.NDArray[np.bool_]
) -> Ways:
    """Put points in order; without those at the time of another, or on a straight line."""
    order = np.lexsort((time, row))
    row, time, kept = row[order], time[order], kept[order]
    again = np.zeros(len(row), bool)
    again[1:] = (np.diff(row) == 0) & (np.diff(time) < SAME)
    alone = kept | ~again
    row, time, kept = row[alone], time[alone], kept[alone]
    position = passages.positions(row, time)
    kept = kept | _bent(time, position)
    return Ways(row[kept], time[kept], position[kept])


def _bends(passages: Passages, rows: Integers, end: Floats) -> list[tuple[Integers, Floats]]:
    """Times at which ways may bend, each with the number of its way in ``rows``."""
    if not rows.size:
        return [(np.empty(0, np.int64), np.empty(0))]
    link = passages.link[rows[0]]
    geometry, enter = passages.geometry, passages.enter[rows]
    shift, speed = geometry.time_shift[link], passages.free_speed[rows]
    ahead, exits = passages.ahead[rows], passages.exit[rows]
    felt = exits - ahead * shift
    own = np.arange(len(rows))
    first, after = (np.searchsorted(felt, time - ahead * shift, "right") for time in (enter, end))
    # the first exit that is not felt any more, at last its own, says where a platoon stands
    counts = np.maximum(np.minimum(after, own) + 1 - first, 0)
    if counts.sum() > MOST:
        return [_even(enter, end, COARSE)]
    k, a = np.repeat(own, counts), numbered_from(first, counts)
    between = ahead[k] - ahead[a]
    space = geometry.space_shift[link]
    start = exits[a] + between * shift
    closed_up = start + passages.vehicles[rows][a] * space / speed[k]
    arrived = enter[k] + (geometry.length[link] - between * space) / speed[k]
    times = [(k, start), (k, closed_up), (k, arrived)]
    if passages.held_by is not None:
        times.append(_even(enter, end, EVEN))
    return times


def _even(enter: Floats, end: Floats, points: int) -> tuple[Integers, Floats]:
    """Times at even steps within every way, and the number of the way of each."""
    shares = np.linspace(0.0, 1.0, points + 2)[1:-1]
    times = enter[:, None] + np.outer(end - enter, shares)
    return np.repeat(np.arange(len(enter)), points), times.ravel()


def _cuts(enter: Floats, end: Floats, cuts: Floats) -> tuple[Integers, Floats]:
    """The cuts between entry and end of every way, and the number of the way of each."""
    first = np.searchsorted(cuts, enter, "right")
    counts = np.maximum(np.searchsorted(cuts, end, "left") - first, 0)
    return np.repeat(np.arange(len(enter)), counts), cuts[numbered_from(first, counts)]


def _bent(time: Floats, position: Floats) -> npt.NDArray[np.bool_]:
    """Whether a point lies off the line between its two neighbours in the arrays."""
    off = np.zeros(len(time), bool)
    before, after = np.diff(time)[:-1], np.diff(time)[1:]
    rise_before, rise_after = np.diff(position)[:-1], np.diff(position)[1:]
    area = np.abs(before * rise_after - after * rise_before)
    off[1:-1] = area > STRAIGHT * np.abs(before + after)
    return off
