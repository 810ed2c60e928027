"""Where and when most time is lost: one rule for all pages, sheets, pictures and films of a run.

What counts
    The delay of all vehicles on links, also of those still there at the end: time spent less
    distance driven / free speed (Edie). Waiting to enter the network counts nowhere.
Streets
    All links that are called alike (:func:`uxsim_geo.network.street_names.street_names`: by name,
    else by the road's number, else by the link's id), wherever they lie.
Order
    Most time lost first, to a thousandth of a veh·s; of equal ones that whose first link comes
    first in the table.
Unit
    One for all streets of a run: the largest of veh·h, veh·min and veh·s that the worst one
    reaches.
Least
    A street counts if one decimal of that unit, and one of its percentage, show more than 0.
Worst bin
    The first in which time is lost nearly as fast as ever, to one in a thousand: a gridlock
    stays as bad.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd

from uxsim_geo.analysis.edie import ratio
from uxsim_geo.analysis.state_grid import StateGrid
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.network.network import Network
from uxsim_geo.network.street_names import street_names
from uxsim_geo.network.units import TIMES

#: what one decimal of a unit, or of a percentage, shows as more than 0
LEAST = 0.05

#: what is told of less than that
NONE = "none"

#: as fast as ever, nearly
NEARLY = 0.999

#: junctions that never lose so much of what the worst one loses in a bin are left out
LEAST_JUNCTION = 0.015

#: from here on numbers are told without a decimal
LARGE = 1000


@dataclass(frozen=True)
class Unit:
    """Of time that vehicles lose, by its length in s."""

    name: str
    seconds: float

    @classmethod
    def of(cls, largest: float) -> Unit:
        """The largest unit that an amount (veh·s) reaches."""
        units = [cls(f"veh·{name}", TIMES[name]) for name in ("h", "min", "s")]
        return next((unit for unit in units if largest >= unit.seconds), units[-1])

    def text(self, lost: float) -> str:
        """An amount (veh·s) with the unit."""
        value = lost / self.seconds
        return f"{value:,.{0 if value >= LARGE else 1}f} {self.name}"


def in_words(lost: float) -> str:
    """An amount of lost time (veh·s) that stands alone, in the unit that suits it."""
    return Unit.of(lost).text(lost) if lost >= LEAST else NONE


class Street(NamedTuple):
    """Links that are called alike, on which time was lost.

    name; links (rows); lost (veh·s); share (of all time lost on links); bin (in which it lost
    most); link (row on which most was lost).
    """

    name: str
    links: Integers
    lost: float
    share: float
    bin: int
    link: int


@dataclass(frozen=True)
class LostTime:
    """Time lost on links.

    names
        of the streets of the links
    delay
        veh·s, shape (links, bins)
    begin, end
        of the bins, s
    """

    names: pd.Series
    delay: Floats
    begin: Floats
    end: Floats

    @classmethod
    def of(cls, links: pd.DataFrame, states: StateGrid) -> LostTime:
        """On all links of a table, in its order."""
        return cls(street_names(links), states.values("delay"), states.begin, states.end)

    @property
    def in_bins(self) -> Floats:
        """By all vehicles in each bin, veh·s."""
        total: Floats = self.delay.sum(axis=0)
        return total

    @property
    def worst_bin(self) -> int:
        """In which the whole network loses most."""
        return self._worst(self.in_bins)

    @property
    def unit(self) -> Unit:
        """In which the streets of this run are told."""
        _, lost = self._streets()
        return Unit.of(float(lost.max(initial=0.0)))

    def streets(self, most: int) -> list[Street]:
        """Those that count, in their order, ``most`` at most."""
        street, lost = self._streets()
        whole, of_link = float(lost.sum()), self.delay.sum(axis=1)
        least = max(LEAST * self.unit.seconds, LEAST / 100 * whole)
        order = np.argsort(-np.round(lost, 3), kind="stable")
        found = []
        for number in order[lost[order] >= least][:most]:
            links = np.flatnonzero(street == number)
            worst = links[np.argmax(np.round(of_link[links], 3))]
            name, share = str(self.names.iloc[links[0]]), float(lost[number]) / whole
            bin_ = self._worst(self.delay[links].sum(axis=0))
            found.append(Street(name, links, float(lost[number]), share, bin_, int(worst)))
        return found

    def _streets(self) -> tuple[Integers, Floats]:
        """The number of each link's street, in order of first links, and what was lost on each."""
        street, known = pd.factorize(self.names)
        lost = np.bincount(street, self.delay.sum(axis=1), minlength=len(known)).astype(float)
        return street.astype(np.int64), lost

    def _worst(self, lost: Floats) -> int:
        rate = lost / (self.end - self.begin)
        return int(np.argmax(rate >= NEARLY * rate.max()))


class StreetState(NamedTuple):
    """All links of a street in its worst bin.

    speed (m/s, and relative to free speed), queue (m; the longest on one link at the end of a bin)
    """

    speed: float
    relative: float
    queue: float


def states_of(streets: Sequence[Street], states: StateGrid) -> list[StreetState]:
    """How slow each was when most time was lost, and how long its queues grew at any time."""
    sums = [
        np.array([values[street.links, street.bin].sum() for street in streets])
        for values in map(states.values, ("distance", "time", "delay"))
    ]
    queues = states.values("queue_length")
    longest = [float(queues[street.links].max()) for street in streets]
    speed, slowness = ratio(sums[0], sums[1]), ratio(sums[2], sums[1])
    told = zip(speed.tolist(), (1.0 - slowness).tolist(), longest, strict=True)
    return [StreetState(*one) for one in told]


class Junctions(NamedTuple):
    """Nodes before which time is lost: a city's map shows circles there, but no short links.

    nodes (rows of the nodes table), links (for every link the place of its end in ``nodes``, −1:
    not among them), largest (delay of one bin, veh·s)
    """

    nodes: Integers
    links: Integers
    largest: float


def junctions(network: Network, delay: Floats) -> Junctions:
    """Nodes by the delay (veh·s, links × bins) on the links that lead to them."""
    rows = pd.Index(network.nodes["node_id"].astype(str))
    end = rows.get_indexer(pd.Index(network.links["to_node_id"].astype(str)))
    sums = np.zeros((len(rows), delay.shape[1]))
    np.add.at(sums, end, delay)
    worst = sums.max(axis=1)
    largest = float(worst.max(initial=0.0))
    nodes = np.flatnonzero(worst > LEAST_JUNCTION * largest)
    place = np.full(len(rows), -1, np.int64)
    place[nodes] = np.arange(len(nodes))
    return Junctions(nodes, place[end], largest)
