"""What platoons do on parts of links, cut at the edges of time bins: what Edie's sums are made of.

A stretch is the way of one platoon over one part of a link. Cut at the edges of the bins it becomes
pieces, each in one rectangle of space and time. Times and distances of pieces are exact: stretches
begin and end at events or where the closed form says, and so do the cuts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from uxsim_geo.analysis.bins import cut_at_edges
from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.types import Booleans, Floats, Integers


@dataclass(frozen=True)
class Stretches:
    """Ways of platoons over parts of links; arrays of one length.

    row (of the passage), begin and end (m from the start of the link), enter (s), leave (s; inf
    while on it at the end of the simulation).
    """

    row: Integers
    begin: Floats
    end: Floats
    enter: Floats
    leave: Floats

    @classmethod
    def over_links(cls, passages: Passages, rows: Integers) -> Stretches:
        """Some passages, each as one stretch over the whole link."""
        length = passages.geometry.length[passages.link[rows]]
        return cls(rows, np.zeros(len(rows)), length, passages.enter[rows], passages.exit[rows])


@dataclass(frozen=True)
class Pieces:
    """Stretches cut at edges of bins; arrays of one length, by stretch and then by bin.

    stretch (its number), row (of the passage), bin, time (s spent), distance (m driven), until (s,
    end of the piece), position (m from the start of the link, then), cut (True: the platoon is
    still on the stretch when the bin ends).
    """

    stretch: Integers
    row: Integers
    bin: Integers
    time: Floats
    distance: Floats
    until: Floats
    position: Floats
    cut: Booleans

    @classmethod
    def of(cls, passages: Passages, stretches: Stretches, edges: Floats) -> Pieces:
        """Cut stretches at the edges of bins, s; what lies outside the edges is left out."""
        parts = cut_at_edges(stretches.enter, stretches.leave, edges)
        number = parts.interval
        row = stretches.row[number]

        def place(some: Booleans, times: Floats) -> Floats:
            within = stretches.begin[number[some]], stretches.end[number[some]]
            placed: Floats = np.clip(passages.positions(row[some], times[some]), *within)
            return placed

        cut = stretches.leave[number] > parts.end
        until = stretches.end[number]
        until[cut] = place(cut, parts.end)
        since = np.roll(until, 1)
        first = np.concatenate(([True], number[1:] != number[:-1]))[: len(number)]
        since[first] = stretches.begin[number[first]]
        under_way = first & (parts.begin > stretches.enter[number])
        since[under_way] = place(under_way, parts.begin)
        time = parts.end - parts.begin
        return cls(number, row, parts.bin, time, until - since, parts.end, until, cut)
