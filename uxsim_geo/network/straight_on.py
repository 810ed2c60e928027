"""Which link goes on as which: the same road, straight ahead over a node."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from uxsim_geo.network.approach_lengths import STRAIGHT
from uxsim_geo.network.headings import headings_of
from uxsim_geo.network.incidence import Ends, Flags, Floats, Rows, Turns
from uxsim_geo.network.network import Network


@dataclass(frozen=True)
class StraightOn:
    """Row of the link that each goes on as, and of the one that goes on as it; -1: none."""

    after: Rows
    before: Rows

    @property
    def between(self) -> Rows:
        """Rows of links that have both."""
        return np.flatnonzero((self.after >= 0) & (self.before >= 0))


def straight_on(network: Network, ends: Ends, turns: Turns) -> StraightOn:
    """Pair links of one class that share a name or a way of the source, at most 45° apart.

    Of several the straightest is taken, from both sides. Nothing is paired where it is not known
    where links lie, nor over banned turns.
    """
    number = len(ends.start)
    onward, previous = (np.full(number, -1, dtype=np.int64) for _ in range(2))
    headings = headings_of(network)
    if headings.at_start is None or headings.at_end is None:
        return StraightOn(onward, previous)
    start, end = np.array(headings.at_start), np.array(headings.at_end)
    bend = np.abs((start[turns.after] - end[turns.before] + 180.0) % 360.0 - 180.0)
    rows = np.flatnonzero(~turns.banned & ~turns.back & (bend <= STRAIGHT))
    rows = rows[_same_road(network.links, turns.before[rows], turns.after[rows])]
    before, after, bend = turns.before[rows], turns.after[rows], np.round(bend[rows], 6)
    best = _is_least(before, bend) & _is_least(after, bend)
    onward[before[best]] = after[best]
    previous[after[best]] = before[best]
    return StraightOn(onward, previous)


def _is_least(key: Rows, value: Floats) -> Flags:
    """Where a value is the least of all with the same key, and no other one is as low."""
    size = int(key.max(initial=-1)) + 1
    least = np.full(size, np.inf)
    np.minimum.at(least, key, value)
    lowest = value == least[key]
    return np.asarray(lowest & (np.bincount(key[lowest], minlength=size)[key] == 1))


def _same_road(links: pd.DataFrame, before: Rows, after: Rows) -> Flags:
    """Pairs of the same class of which a name or a way is in both."""
    same = np.zeros(len(before), dtype=bool)
    if "road_class" not in links:
        return same
    classes = pd.factorize(links["road_class"])[0]
    alike = (classes[before] == classes[after]) & (classes[before] >= 0)
    for column in ("name", "source_id"):
        if column in links:
            same |= _shared(links[column], before, after, alike & ~same)
    return same


def _shared(column: pd.Series, before: Rows, after: Rows, asked: Flags) -> Flags:
    """Pairs with a text in common; joined links have several, with ``; `` between them."""
    codes, texts = pd.factorize(column)
    one, other = codes[before], codes[after]
    known = asked & (one >= 0) & (other >= 0)
    found = known & (one == other)
    parts = [frozenset(str(text).split("; ")) for text in texts]
    several = np.array([len(part) > 1 for part in parts], dtype=bool)
    open_ = known & ~found
    open_[open_] &= several[one[open_]] | several[other[open_]]
    for row in np.flatnonzero(open_).tolist():
        found[row] = not parts[one[row]].isdisjoint(parts[other[row]])
    return np.asarray(found)
