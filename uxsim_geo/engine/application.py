"""Levers put into effect: what control has changed, written into the records of the engine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from uxsim_geo.control.levers import Levers
from uxsim_geo.control.site import Site
from uxsim_geo.engine.loop import refresh
from uxsim_geo.engine.plans import Plans
from uxsim_geo.engine.population import Drivers
from uxsim_geo.engine.records import Queues, World
from uxsim_geo.engine.router import Router

#: s: what a closed link costs at least, so that it is chosen only where there is no other way
_CLOSED_COST = 86_400.0

#: quantities that say what passes the ends of links
_OF_GATES = {"exit_capacity", "entry_capacity", "exit_closed", "entry_closed", "speed_limit"}

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Records = npt.NDArray[Any]


@dataclass
class Gate:
    """One end of every link, in the order of the engine: what passes it, and when again.

    headway
        s per vehicle
    held
        nobody passes
    opens
        s: where held, when the capacity used so far would let the next one pass
    """

    field: str
    headway: Floats
    held: npt.NDArray[np.bool_]
    opens: Floats

    @classmethod
    def of(cls, field: str, headway: Floats) -> Gate:
        """Describe a gate that is open: ``field`` is entry or exit."""
        return cls(field, headway.copy(), np.zeros(headway.size, bool), np.zeros(headway.size))

    def set(
        self, link: Records, capacity: Floats, closed: npt.NDArray[np.bool_], time: float
    ) -> Ints:
        """Give every link a new capacity (veh/s) at this gate; returns the links that changed.

        Capacity that has gone by since the last passage counts at the rate that was in force.
        """
        held = closed | (capacity <= 0)
        headway = np.divide(1.0, capacity, out=self.headway.copy(), where=capacity > 0)
        changed = np.flatnonzero((headway != self.headway) | (held != self.held))
        if changed.size == 0:
            return changed
        name = f"{self.field}_open"
        opens = np.where(self.held[changed], self.opens[changed], link[name][changed])
        left = np.maximum(opens - time, 0.0)
        ratio = headway[changed] / self.headway[changed]
        opens = np.where(left > 0, time + left * ratio, opens)
        opens = np.where(self.held[changed], np.maximum(opens, time), opens)
        self.headway, self.held = headway, held
        self.opens[changed] = opens
        link[name][changed] = np.where(held[changed], np.inf, opens)
        link[f"{self.field}_headway"][changed] = headway[changed]
        return changed


class Application:
    """Brings the world of the engine in line with the levers.

    applied
        what is in effect now, in the order of the tables
    """

    def __init__(
        self,
        site: Site,
        drivers: Sequence[Drivers],
        plans: Plans,
        row_of_link: Ints,
        levers: Levers,
    ) -> None:
        self.site = site
        self.plans = plans
        self.row_of_link = row_of_link
        self.applied = levers.copy()
        headway = 1.0 / site.capacity[row_of_link]
        self.gates = (Gate.of("entry", headway), Gate.of("exit", headway))
        self._class_of = np.array([one.class_number for one in drivers])
        self._per_currency = np.array([one.toll_factor * one.cost_per_currency for one in drivers])[
            :, None
        ]
        distance = np.array([one.cost_per_metre for one in drivers])[:, None]
        self._distance_cost = distance * site.length[row_of_link]
        self._follows = np.array([one.compliant for one in drivers], float)[:, None]

    def start(self, world: World, levers: Levers, router: Router) -> None:
        """Put in what holds before the first step; ``router`` finds other ways later on."""
        self._router = router
        world.routes.extra[...] = self._extra_costs(levers)

    def apply(
        self, world: World, levers: Levers, changed: set[str], time: float, *, at_once: bool
    ) -> None:
        """Put the quantities that have changed into effect from this time on.

        ``at_once``: nobody knew that something could change now, so that all who are blocked have
        to look again.
        """
        if changed & _OF_GATES:
            self._set_gates(world, levers, time)
        link = world.links.queue[: self.row_of_link.size]
        if "merge_priority" in changed:
            link["merge_priority"] = levers.merge_priority[self.row_of_link]
        if "node_capacity" in changed:
            nodes = self._set_node_capacities(world.routes.node[:-1], levers, time)
            # nobody may leave in the past over a node that was closed or busy then
            _hold_until(world, np.flatnonzero(np.isin(link["end_node"], nodes)), time)
        if changed & {"plan", "phase"}:
            # nor by a green that was not there then
            _hold_until(world, self.plans.put(link, levers, self.applied, time), time)
        if changed & {"toll", "advice", "banned", "entry_closed", "entry_capacity"}:
            self._set_costs(world, levers)
        for quantity in changed:
            setattr(self.applied, quantity, getattr(levers, quantity))
        if at_once:
            _refresh(world, np.arange(world.links.queue.size))

    def _set_gates(self, world: World, levers: Levers, time: float) -> None:
        order, link = self.row_of_link, world.links.queue[: self.row_of_link.size]
        speed = np.minimum(levers.speed_limit, self.site.free_speed)
        limited = speed < self.site.free_speed
        road = world.routes.road
        # of the triangular diagram: 1 / Q = 1 / (m κ u) + τ / m
        most = np.where(
            limited[order], 1.0 / (road["spacing"] / speed[order] + road["lag"]), np.inf
        )
        most = np.minimum(most, self.site.capacity[order])
        road["free_speed"] = speed[order]
        link["free_time"] = road["length"] / speed[order]
        changed = {}
        for gate in self.gates:
            capacity = np.minimum(getattr(levers, f"{gate.field}_capacity")[order], most)
            closed = getattr(levers, f"{gate.field}_closed")[order]
            changed[gate.field] = gate.set(link, capacity, closed, time)
        link["room_for"] = 0
        _refresh(world, changed["exit"])

    def _set_node_capacities(self, node: Records, levers: Levers, time: float) -> Ints:
        """As gates, but that a capacity of inf is a headway of 0. Returns the nodes changed."""
        changed = np.flatnonzero(levers.node_capacity != self.applied.node_capacity)
        capacity, before = levers.node_capacity[changed], self.applied.node_capacity[changed]
        left = np.maximum(node["open"][changed] - time, 0.0)
        # a node that was closed, or had no limit, has nothing left of an earlier headway
        had_limit = (before > 0) & (before < np.inf) & (left < np.inf)
        ratio = np.where(had_limit, before, 0.0) / np.where(capacity > 0, capacity, 1.0)
        left = np.where(had_limit, left, 0.0)
        node["open"][changed] = np.where(capacity > 0, time + left * ratio, np.inf)
        node["headway"][changed] = 1.0 / np.where(capacity > 0, capacity, 1.0)
        return changed

    def _set_costs(self, world: World, levers: Levers) -> None:
        world.routes.extra[...] = self._extra_costs(levers)
        # each by itself: who waits for a closed link must turn away once it is banned
        newly = (self._banned(levers) & ~self._banned(self.applied)) | (
            _closed(levers) & ~_closed(self.applied)
        )
        if newly.any():
            links = np.ascontiguousarray(newly[:, self.row_of_link].astype(np.uint8))
            self._router.turn_away(world, links)

    def _banned(self, levers: Levers) -> npt.NDArray[np.bool_]:
        """Say which links which drivers may not use; shape (drivers, links)."""
        banned: npt.NDArray[np.bool_] = levers.banned[self._class_of]
        return banned

    def _extra_costs(self, levers: Levers) -> Floats:
        """Work out what links cost beside their time, s; shape (drivers, links)."""
        cost = (
            self._per_currency * levers.toll
            + self._follows * levers.advice[self._class_of]
            + _CLOSED_COST * _closed(levers)
        )
        cost = np.where(self._banned(levers), np.inf, cost)
        extra: Floats = cost[:, self.row_of_link] + self._distance_cost
        return extra


def _closed(levers: Levers) -> npt.NDArray[np.bool_]:
    """Say which links nobody can enter; shape (links,)."""
    closed: npt.NDArray[np.bool_] = levers.entry_closed | (levers.entry_capacity <= 0)
    return closed


def _hold_until(world: World, links: Ints, time: float) -> None:
    """Let nobody leave these links before this time, whatever would have let them."""
    exit_open = world.links.queue["exit_open"]
    exit_open[links] = np.maximum(exit_open[links], time)
    _refresh(world, links)


def _refresh(world: World, changed: Ints) -> None:
    refresh(Queues(world.links, world.calendar), changed)
