"""Sums over links × time bins that states follow from: what vehicles drove, spent and lost there.

They are exact: entries and exits come from the events, and positions at the edges of the bins from
the closed form in :mod:`uxsim_geo.analysis.passages`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from uxsim_geo.analysis.bins import bin_of, cut_at_edges
from uxsim_geo.analysis.edie import ratio
from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.pieces import Pieces, Stretches
from uxsim_geo.analysis.spillback import Closures
from uxsim_geo.analysis.types import Booleans, Floats, Integers

#: a vehicle counts as queued when it is further than this behind its free-flow trajectory, m
QUEUED_BEHIND = 1e-3

#: the one sum that is NaN where there is nothing: a mean
EXPERIENCED = "experienced_travel_time"


@dataclass(frozen=True)
class Observed:
    """What is looked at: passages, by whom (whether each trip counts), closures, edges of bins."""

    passages: Passages
    counts: Booleans
    closures: Closures
    edges: Floats

    def sums(self, rows: Integers) -> dict[str, Floats]:
        """Sums over cells of some links, in ascending order; (links · bins,) each."""
        passages, first, last = self.passages, int(rows[0]), int(rows[-1]) + 1
        number = np.full(last - first, -1, np.int64)
        number[rows - first] = np.arange(len(rows))
        grid = _Grid(first, number, len(rows), self.edges)
        there = np.arange(passages.first[first], passages.first[last])
        seen = there[grid.has(passages.link[there]) & self.counts[passages.vehicle[there]]]
        pieces = Pieces.of(passages, Stretches.over_links(passages, seen), self.edges)
        sums = _accumulate(passages, pieces, grid)
        sums |= _count_ends(passages, seen, grid)
        sums |= _queues(passages, pieces, grid)
        return sums | {"full": self._full(grid, slice(first, last))}

    def _full(self, grid: _Grid, links: slice) -> Floats:
        """Time without room, s; closures are in the order of the links."""
        closures = self.closures
        some = slice(*np.searchsorted(closures.link, [links.start, links.stop]))
        parts = cut_at_edges(closures.begin[some], closures.end[some], self.edges)
        link = closures.link[some][parts.interval]
        return grid.add_up(link, parts.bin, parts.end - parts.begin)


@dataclass(frozen=True)
class _Grid:
    """The cells of some links: links first, bins within.

    first (row of the first link), number (of it and the links behind it: which of the grid's links
    each is, -1: none), links, edges (of the bins, s).
    """

    first: int
    number: Integers
    links: int
    edges: Floats

    @property
    def bins(self) -> int:
        return len(self.edges) - 1

    def has(self, link: Integers) -> Booleans:
        """Whether links are some of these."""
        has: Booleans = self.number[link - self.first] >= 0
        return has

    def _cells(self, link: Integers, bin_: Integers) -> tuple[Integers, Integers]:
        """The cell of each pair that is on the grid, and which pairs those are."""
        number = self.number[link - self.first]
        inside = np.flatnonzero((number >= 0) & (bin_ >= 0))
        return number[inside] * self.bins + bin_[inside], inside

    def add_up(self, link: Integers, bin_: Integers, values: Floats) -> Floats:
        cell, inside = self._cells(link, bin_)
        sums = np.bincount(cell, weights=values[inside], minlength=self.links * self.bins)
        return sums.astype(np.float64, copy=False)

    def largest(self, link: Integers, bin_: Integers, values: Floats) -> Floats:
        cell, inside = self._cells(link, bin_)
        result = np.zeros(self.links * self.bins)
        np.maximum.at(result, cell, values[inside])
        return result


def _accumulate(passages: Passages, pieces: Pieces, grid: _Grid) -> dict[str, Floats]:
    """Distance and time of all vehicles per cell, and what was lost against free speed.

    That is the free speed without control: what a limit costs is delay.
    """
    link, vehicles = passages.link[pieces.row], passages.vehicles[pieces.row]
    free_time = pieces.distance / passages.geometry.free_speed[link]
    lost = np.maximum(pieces.time - free_time, 0.0)
    return {
        "distance": grid.add_up(link, pieces.bin, vehicles * pieces.distance),
        "time": grid.add_up(link, pieces.bin, vehicles * pieces.time),
        "delay": grid.add_up(link, pieces.bin, vehicles * lost),
    }


def _count_ends(passages: Passages, seen: Integers, grid: _Grid) -> dict[str, Floats]:
    """Vehicles that entered and left per cell, and how long the leavers had been on the link."""
    link, vehicles = passages.link[seen], passages.vehicles[seen]
    enter, leave = passages.enter[seen], passages.exit[seen]
    left = np.where(np.isinf(leave), enter, leave) - enter
    out = bin_of(leave, grid.edges)
    exits = grid.add_up(link, out, vehicles)
    return {
        "entries": grid.add_up(link, bin_of(enter, grid.edges), vehicles),
        "exits": exits,
        EXPERIENCED: ratio(grid.add_up(link, out, vehicles * left), exits),
    }


def _queues(passages: Passages, pieces: Pieces, grid: _Grid) -> dict[str, Floats]:
    """Vehicles behind their free-flow trajectory at the end of each bin, and how far they reach."""
    free = passages.free_speed[pieces.row] * (pieces.until - passages.enter[pieces.row])
    queued = pieces.cut & (free - pieces.position > QUEUED_BEHIND)
    row, bin_, position = pieces.row[queued], pieces.bin[queued], pieces.position[queued]
    geometry, link = passages.geometry, passages.link[row]
    length, vehicles = geometry.length[link], passages.vehicles[row]
    reach = np.minimum(length, length - position + vehicles * geometry.space_shift[link])
    return {
        "queue": grid.add_up(link, bin_, vehicles),
        "queue_length": grid.largest(link, bin_, reach),
    }
