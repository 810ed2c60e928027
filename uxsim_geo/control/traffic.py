"""What control can see: one array a quantity, read only."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import numpy.typing as npt

from uxsim_geo.control.site import Site

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


class Traffic:
    """The state of the network at one moment. Links and nodes stand in the order of their tables.

    site
        ids, lengths and the rest that does not change, and where each id stands
    time
        s after the start
    elapsed
        s since this control was called last; 0 at its first call
    count
        (links,) vehicles on the link
    queue
        (links,) vehicles on the link that stand
    waiting
        (nodes,) vehicles that have left home and wait to enter the network at this node
    phase
        (nodes,) of the signal plan in force, counted from 0; -1: all red, or no signal
    entered, left
        (links,) vehicles since the start of the simulation
    """

    def __init__(self, site: Site, time: float, arrays: dict[str, Floats | Ints]) -> None:
        for array in arrays.values():
            array.flags.writeable = False
        self.site = site
        self.time = time
        self.count: Floats = arrays["count"]
        self.queue: Floats = arrays["queue"]
        self.entered: Floats = arrays["entered"]
        self.left: Floats = arrays["left"]
        self.waiting: Floats = arrays["waiting"]
        self.phase: Ints = arrays["phase"]
        self._speed_limit: Floats = arrays["speed_limit"]
        self._before: Traffic = self

    def since(self, before: Traffic | None) -> Traffic:
        """Return the same state with flows counted from an earlier one."""
        self._before = before or self
        return self

    @property
    def elapsed(self) -> float:
        return self.time - self._before.time

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
        """(links,) m/s, mean of the vehicles on the link; its free speed where there are none."""
        moving = self.count - self.queue
        share = np.divide(moving, self.count, out=np.ones_like(moving), where=self.count > 0)
        return _fixed(self._speed_limit * share)

    @cached_property
    def travel_time(self) -> Floats:
        """(links,) s, instantaneous: length over mean speed, which counts 1 % of free at least."""
        return _fixed(self.site.length / np.maximum(self.speed, 0.01 * self._speed_limit))

    @property
    def inflow(self) -> Floats:
        """(links,) veh/s that have entered since this control was called last."""
        return _fixed((self.entered - self._before.entered) / max(self.elapsed, 1e-9))

    @property
    def outflow(self) -> Floats:
        """(links,) veh/s that have left since this control was called last."""
        return _fixed((self.left - self._before.left) / max(self.elapsed, 1e-9))


def _fixed(array: Floats) -> Floats:
    array.flags.writeable = False
    return array
