"""The ways that vehicles have driven on the map between the moments of a film.

Between two moments each vehicle has driven a piece of line, over as many links as it came to. What
it looks like follows from the lines of the links; how far it reaches, from the exact positions.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.samples import numbered_from
from uxsim_geo.analysis.trajectories import LinkLines
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.export.colours import SPEED_CLASSES

#: pieces worked on at a time: what lies between takes some hundred MB at most
BLOCK = 500_000


@dataclass(frozen=True)
class Pieces:
    """Parts of the ways on single links, between two moments; arrays of one length.

    row (of the passages), interval (number of the one between two moments), begin and end
    (position on the link, m), time (s spent on it).
    """

    row: Integers
    interval: Integers
    begin: Floats
    end: Floats
    time: Floats


def trails(
    passages: Passages, lines: LinkLines, rows: Integers, moments: Floats
) -> Iterator[list[Floats]]:
    """For every moment the ways driven since the one before, by speed; nothing for the first.

    ``rows`` of the passages are followed on ``lines`` (of all links) at ``moments``, which ascend,
    s. Each item holds one array a class of speed, in their order: points of shape (n, 2), with NaN
    after the way of each vehicle. The speed is the mean one since, relative to free speed.
    """
    classes = len(SPEED_CLASSES)
    yield [np.empty((0, 2)) for _ in SPEED_CLASSES]
    for first, last in _blocks(passages, rows, moments):
        pieces = _pieces(passages, rows, moments[first - 1 : last])
        points, interval, class_ = _ways(passages, lines, pieces)
        cell = interval * classes + class_
        order = np.argsort(cell, kind="stable")
        edges = np.searchsorted(cell[order], np.arange((last - first) * classes + 1))
        cells = [points[order[begin:end]] for begin, end in pairwise(edges)]
        for number in range(0, len(cells), classes):
            yield cells[number : number + classes]


def _blocks(passages: Passages, rows: Integers, moments: Floats) -> Iterator[tuple[int, int]]:
    """Ranges of moments, the first not among them, in which there are not too many pieces."""
    size = len(moments) + 2
    begin = np.searchsorted(moments, passages.enter[rows], side="right")
    after = np.searchsorted(moments, passages.exit[rows], side="left") + 1
    change = np.bincount(begin, minlength=size) - np.bincount(after, minlength=size)
    until = np.cumsum(np.cumsum(change))
    first = 1
    while first < len(moments):
        last = int(np.searchsorted(until, until[first - 1] + BLOCK, side="right"))
        last = min(max(last, first + 1), len(moments))
        yield first, last
        first = last


def _pieces(passages: Passages, rows: Integers, moments: Floats) -> Pieces:
    """Cut the passages at the moments, of which the first and last bound what is asked for."""
    enter, leave = passages.enter[rows], passages.exit[rows]
    seen = (enter < moments[-1]) & (leave > moments[0])
    rows, enter, leave = rows[seen], enter[seen], leave[seen]
    first = np.maximum(np.searchsorted(moments, enter, side="right") - 1, 0)
    last = np.minimum(np.searchsorted(moments, leave, side="left"), len(moments) - 1)
    counts = np.maximum(last - first, 0)
    row, interval = np.repeat(rows, counts), numbered_from(first, counts)
    begin = np.maximum(passages.enter[row], moments[interval])
    end = np.minimum(passages.exit[row], moments[interval + 1])
    places = passages.positions(np.tile(row, 2), np.concatenate([begin, end]))
    return Pieces(row, interval, places[: len(row)], places[len(row) :], end - begin)


def _ways(
    passages: Passages, lines: LinkLines, pieces: Pieces
) -> tuple[Floats, Integers, Integers]:
    """Points of all ways, one after the other, and the interval and the class of each point."""
    row = pieces.row
    order = np.lexsort((passages.enter[row], passages.vehicle[row], pieces.interval))
    row, interval = row[order], pieces.interval[order]
    link, vehicle = passages.link[row], passages.vehicle[row]
    new = np.ones(len(row), bool)
    new[1:] = (vehicle[1:] != vehicle[:-1]) | (interval[1:] != interval[:-1])
    driven = (pieces.end - pieces.begin)[order] / passages.geometry.free_speed[link]
    first = np.flatnonzero(new)
    of_piece = np.cumsum(new) - 1
    class_ = _classes(*(np.add.reduceat(x, first) for x in (driven, pieces.time[order])))[of_piece]
    length = passages.geometry.length[link]
    shares = (pieces.begin[order] / length, pieces.end[order] / length)
    points, counts = _points(lines, link, shares, np.append(new[1:], True))
    return points, np.repeat(interval, counts), np.repeat(class_, counts)


def _classes(free_time: Floats, time: Floats) -> Integers:
    """The class of each speed, free_time / time of what it is at free flow."""
    share = np.divide(free_time, time, out=np.ones(len(time)), where=time > 0)
    lower = np.array([speed.lower for speed in SPEED_CLASSES[1:]])
    return np.searchsorted(lower, share, side="right").astype(np.int64)


def _points(
    lines: LinkLines,
    link: Integers,
    shares: tuple[Floats, Floats],
    is_last: npt.NDArray[np.bool_],
) -> tuple[Floats, Integers]:
    """Points of parts of lines, NaN after those that are the last of a way, and their numbers."""
    after = np.searchsorted(lines.order, 2.0 * link + shares[0], side="right")
    before = np.searchsorted(lines.order, 2.0 * link + shares[1], side="left")
    inner = np.maximum(before - after, 0)
    counts = inner + 2 + is_last
    start = np.cumsum(counts) - counts
    points = np.full((int(counts.sum()), 2), np.nan)
    points[start] = np.stack(lines.points(link, shares[0]), axis=1)
    points[start + inner + 1] = np.stack(lines.points(link, shares[1]), axis=1)
    vertices = numbered_from(after, inner)
    within = numbered_from(start + 1, inner)
    points[within] = np.stack([lines.x[vertices], lines.y[vertices]], axis=1)
    return points, counts
