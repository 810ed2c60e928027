"""Lanes, speeds and capacities that do not fit those of the same road before and after.

Every link is held against the one that goes straight on as it and the one that it goes straight on
as (:mod:`uxsim_geo.network.straight_on`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from uxsim_geo.network.incidence import Ends, Flags, Floats, Rows, Turns
from uxsim_geo.network.rows import numbers
from uxsim_geo.network.straight_on import StraightOn

#: lanes: changes by so many are doubted
JUMP = 2

#: m: shorter pieces are doubted where they have fewer lanes than the road on both sides
SHORT_PIECE = 100.0

#: m: shorter pieces may well be wider, for those who turn at the next junction
WIDENING = 150.0

#: m: longer pieces may well have another limit than the road on both sides, as between villages
LONG_PIECE = 500.0

#: factors between speeds of one road: of values given, and of one assumed between those given
SPEEDS, ASSUMED_SPEED = 1.8, 1.4

#: a capacity below this share of those before and after is doubted
CAPACITY = 0.5

#: rounding of factors: a speed read in mph is still 1.8 times another
DECIMALS = 6


@dataclass(frozen=True)
class Road:
    """The links, how they meet, and which one goes on as which."""

    links: pd.DataFrame
    ends: Ends
    turns: Turns
    on: StraightOn

    def number(self, column: str) -> Floats:
        """A column as numbers."""
        return numbers(self.links[column])

    def given(self, column: str) -> Flags:
        """Whether the source gave the value; where nothing is said of that, it did."""
        source = f"{column}_source"
        if source not in self.links:
            return np.ones(len(self.links), dtype=bool)
        return np.asarray(self.links[source] == "given", dtype=bool)

    def turning(self) -> Flags:
        """Whether lanes of a link are known to be for turning."""
        if "turn_lanes" not in self.links:
            return np.zeros(len(self.links), dtype=bool)
        return np.asarray(self.links["turn_lanes"].notna(), dtype=bool)

    def sides(self, rows: Rows) -> tuple[Rows, Rows]:
        """Rows of the links before and after those of ``rows``, which have both."""
        return self.on.before[rows], self.on.after[rows]


def narrow_pieces(road: Road) -> Rows:
    """Links with fewer lanes than the road before and after: assumed between given, or short.

    A piece between lanes for turning is not short: roads are wider before junctions.
    """
    rows = road.on.between
    before, after = road.sides(rows)
    lanes, given = road.number("lanes"), road.given("lanes")
    narrow = lanes[rows] < np.minimum(lanes[before], lanes[after])
    assumed = ~given[rows] & given[before] & given[after]
    turning = road.turning()
    plain = ~(turning[rows] | turning[before] | turning[after])
    short = given[rows] & plain & (road.number("length")[rows] < SHORT_PIECE)
    return np.asarray(rows[narrow & (assumed | short)])


def lane_jumps(road: Road) -> Rows:
    """Links that go on with lanes more or fewer by two: one of them assumed, or lost on the way.

    Given lanes are no jump where other links at the node bring or take the difference, nor where
    the wider one is short; assumed ones are none beside a short piece with lanes for turning.
    """
    rows = np.flatnonzero(road.on.after >= 0)
    after = road.on.after[rows]
    lanes, given, length = road.number("lanes"), road.given("lanes"), road.number("length")
    jump = np.abs(lanes[rows] - lanes[after]) >= JUMP
    wider = np.where(lanes[rows] > lanes[after], rows, after)
    short = length[wider] < WIDENING
    one_assumed = (given[rows] != given[after]) & ~(short & road.turning()[wider])
    balance = _unbalanced(road, rows, after)
    lost = given[rows] & given[after] & ~short & balance
    return np.asarray(rows[jump & (one_assumed | lost)])


def _unbalanced(road: Road, rows: Rows, after: Rows) -> Flags:
    """Whether lanes begin or end at the node also with all that others bring or take."""
    lanes = road.number("lanes")
    straight = ~road.turns.back & ~road.turns.banned
    before, onward = road.turns.before[straight], road.turns.after[straight]
    leaving = np.bincount(before, weights=lanes[onward], minlength=len(lanes))[rows]
    arriving = np.bincount(onward, weights=lanes[before], minlength=len(lanes))[after]
    ending = lanes[rows] - leaving >= JUMP
    beginning = lanes[after] - arriving >= JUMP
    return np.asarray(ending | beginning)


def odd_speeds(road: Road) -> Rows:
    """Links much faster, or much slower, than the road both before and after: assumed or short."""
    rows = road.on.between
    before, after = road.sides(rows)
    speed, given = road.number("free_speed"), road.given("free_speed")
    low, high = (edge(speed[before], speed[after]) for edge in (np.minimum, np.maximum))
    factor = np.round(np.maximum(low / speed[rows], speed[rows] / high), DECIMALS)
    odd = factor >= np.where(given[rows], SPEEDS, ASSUMED_SPEED)
    told = given[before] & given[after]
    told &= ~given[rows] | (road.number("length")[rows] < LONG_PIECE)
    return np.asarray(rows[told & odd])


def bottlenecks(road: Road) -> Rows:
    """Links whose given capacity is less than half of those given before and after."""
    rows = road.on.between
    before, after = road.sides(rows)
    capacity = road.number("capacity")
    with np.errstate(invalid="ignore"):
        low = capacity[rows] < CAPACITY * np.minimum(capacity[before], capacity[after])
    return np.asarray(rows[low])
