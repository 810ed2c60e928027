"""What control can see: one array a quantity, read only."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from uxsim_geo.control.site import Site

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

_SLOWEST = 0.01  # of the speed limit: what a link counts at least where all stand


@dataclass(frozen=True)
class Counts:
    """Vehicles that have entered and left every link since the start, at one time."""

    time: float
    entered: Floats
    left: Floats


@dataclass(frozen=True)
class Traffic:
    """The state of the network at one moment. Links and nodes stand in the order of their tables.

    site
        ids, lengths and the rest that does not change, and where each id stands
    time
        s after the start
    count, queue
        (links,) vehicles on the link; those of them that stand
    speed_limit
        (links,) m/s, in force now
    waiting
        (nodes,) vehicles that have left home and wait to enter the network at this node
    phase
        (nodes,) of the signal plan in force, counted from 0; -1: all red, or no signal
    totals, before
        vehicles that have entered and left the links, now and when this control was called last
    """

    site: Site
    time: float
    count: Floats
    queue: Floats
    speed_limit: Floats
    waiting: Floats
    phase: Ints
    totals: Counts
    before: Counts

    @property
    def elapsed(self) -> float:
        """Time since this control was called last, s; 0 at its first call."""
        return self.totals.time - self.before.time

    @cached_property
    def queue_length(self) -> Floats:
        """(links,) m of the link on which vehicles stand."""
        site = self.site
        return _fixed(np.minimum(self.queue / (site.lanes * site.jam_density), site.length))

    @cached_property
    def density(self) -> Floats:
        """(links,) veh/m of the whole link."""
        return _fixed(self.count / self.site.length)

    @cached_property
    def occupancy(self) -> Floats:
        """(links,) density over jam density: the share of the link's room that is taken."""
        return _fixed(self.density / (self.site.lanes * self.site.jam_density))

    @cached_property
    def speed(self) -> Floats:
        """(links,) m/s, mean of the vehicles on the link; the speed limit where there are none."""
        moving = self.count - self.queue
        share = np.divide(moving, self.count, out=np.ones_like(moving), where=self.count > 0)
        return _fixed(self.speed_limit * share)

    @cached_property
    def travel_time(self) -> Floats:
        """(links,) s, instantaneous: length over mean speed, that being 1 % of free at least."""
        return _fixed(self.site.length / np.maximum(self.speed, _SLOWEST * self.speed_limit))

    @cached_property
    def inflow(self) -> Floats:
        """(links,) veh/s that have entered since this control was called last."""
        return _fixed(self._per_second(self.totals.entered - self.before.entered))

    @cached_property
    def outflow(self) -> Floats:
        """(links,) veh/s that have left since this control was called last."""
        return _fixed(self._per_second(self.totals.left - self.before.left))

    def _per_second(self, vehicles: Floats) -> Floats:
        return vehicles / self.elapsed if self.elapsed > 0 else np.zeros_like(vehicles)


def _fixed(array: Floats) -> Floats:
    array.flags.writeable = False
    return array
