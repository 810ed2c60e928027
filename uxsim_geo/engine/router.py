"""The search for routes, by whatever is quickest: trees of a heap, or sweeps over a hierarchy.

Both find the same distances, and so the same weights, to the bit. A tree takes as long as the
network is large; a sweep serves 64 destinations at once, in far less time than 64 trees, but first
the hierarchy has to be built, and to be told the costs at every update. Batches are shared among
threads; no result depends on how.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from uxsim_geo.engine import searches
from uxsim_geo.engine.hierarchy import build_hierarchy
from uxsim_geo.engine.records import LANES, Hierarchy, Lanes, World
from uxsim_geo.engine.sharing import room_for, share_out
from uxsim_geo.engine.slots import wanted_lanes
from uxsim_geo.network.paths import Ints, Paths
from uxsim_geo.settings import Settings

# What things take, in ns as measured on one core of 2025. Nothing but the time depends on them.
_TREE_PER_VERTEX = 50.0
_WAY_PER_BATCH = 8.0
_ARC_PER_BATCH = 6.0
_PER_TRIANGLE = 4.0
_CALLS = 50_000.0
_BUILDING = 2e6
_BUILDING_PER_VERTEX = 3_000.0
_THREADS_PAY = 1e6

_ALL = 2**62  # more than any number of destinations


@dataclass
class Router:
    """Finds the routes of a run.

    passes
        how often the ways to all destinations will be looked for
    threads
        how many batches may be worked on at once
    """

    paths: Paths
    passes: float
    threads: int
    hierarchy: Hierarchy | None = None
    most: int = _ALL  # so many trees of the heap are not slower than sweeps
    _rooms: list[Lanes] = field(default_factory=list)

    def prepare(self, destinations: int) -> None:
        """Build the hierarchy if that pays for so many destinations."""
        vertices = self.paths.node.size
        if self.hierarchy is None and vertices > 1:
            by_heap = self.passes * destinations * vertices * _TREE_PER_VERTEX
            if by_heap > _BUILDING + vertices * _BUILDING_PER_VERTEX:
                self.build()

    def build(self) -> None:
        """Build the hierarchy."""
        self.hierarchy = build_hierarchy(self.paths)
        self.most = self._break_even()

    def _break_even(self) -> int:
        """Return how many trees of the heap take as long as sweeps do for as many destinations."""
        h = self.hierarchy
        assert h is not None
        batch = self._ns_of_batch()
        tree = self.paths.node.size * _TREE_PER_VERTEX
        start = _CALLS + h.triangles * _PER_TRIANGLE
        if batch >= tree * LANES:
            return _ALL
        batches = np.ceil(start / (tree * LANES - batch))  # with so many, sweeps are quicker
        return int(min((start + batches * batch) / tree, batches * LANES))

    def _ns_of_batch(self) -> float:
        h = self.hierarchy
        assert h is not None
        return h.up.size * _WAY_PER_BATCH + h.tail.size * _ARC_PER_BATCH

    def start(self, world: World) -> None:
        """Have ready what finds the routes: compiles it, where that has to be done."""
        searches.update(world, -1, self.most)
        if self.hierarchy is not None and (world.routes.destination["slot"] >= 0).any():
            searches.renew(world, self._costed(world), 0, self._rooms_for(1)[0])

    @property
    def rank(self) -> Ints:
        """By which nodes are best ordered to be put into batches; shape (nodes,)."""
        first = self.paths.first[:-1]
        return first if self.hierarchy is None else self.hierarchy.place[first]

    def update(self, world: World, step: int) -> None:
        """Let the drivers whose time it is look at the traffic, and choose their routes anew."""
        with np.errstate(all="ignore"):  # hashes overflow by design; matters without the JIT only
            while searches.update(world, step, self.most) >= 0:
                self._renew(world)

    def introduce(self, world: World) -> None:
        """Find the ways to destinations for which somebody is newly bound."""
        with np.errstate(all="ignore"):
            while searches.introduce(world, self.most) >= 0:
                self._renew(world)

    def _renew(self, world: World) -> None:
        """Renew the weights of destinations to which ways are wanted, by the costs at hand."""
        h = self._costed(world)
        table = world.routes.destination
        batch, own = wanted_lanes(table)
        rooms = self._rooms_for(len(own))
        share_out(rooms, own, lambda room, row: searches.renew(world, h, batch[row], room))
        if table["wanted"].any():  # what is too far for a sweep
            searches.renew_rest(world)

    def turn_away(self, world: World, avoided: npt.NDArray[np.uint8]) -> None:
        """Take the weight off links that drivers can no longer enter; shape (drivers, links).

        Where no other out-link is left, the cheapest way on by the costs of the last update takes
        its place.
        """
        for number, links in enumerate(avoided):
            with np.errstate(all="ignore"):
                stranded = searches.find_stranded(world, number, links)
            if stranded > self.most:
                self._lead_on(world, links)
            if stranded:
                searches.lead_rest(world.routes, links)

    def _lead_on(self, world: World, links: npt.NDArray[np.uint8]) -> None:
        """Give vertices that have no weights left those of the cheapest way on, by sweeps."""
        h, routes = self._costed(world), world.routes
        _, own = wanted_lanes(routes.destination)
        rooms = self._rooms_for(1)  # a thread, since all use the same vertices
        share_out(rooms, own, lambda room, _: searches.lead(routes, h, room, links))

    def give_free_times(self, world: World) -> None:
        """Give every trip the free-flow time of its fastest route, s; inf where there is none."""
        searches.price_free(world)
        own, alike = self._by_node(world.routes.destination[:-1])
        left = list(range(len(own)))
        if (own >= 0).sum() > self.most:
            h = self._costed(world)
            rooms = self._rooms_for(len(own), ways=True)
            left = share_out(rooms, own, lambda room, _: searches.time_free(world, h, room, alike))
        if left:
            room = room_for(self.paths.node.size, ways=True)
            share_out([room], own[left], lambda room, _: searches.time_rest(world, room, alike))

    def _by_node(
        self, table: npt.NDArray[np.void]
    ) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.int32]]:
        """Put one destination of every node into a lane; also gives the next at the same node."""
        order = np.argsort(self.rank[table["node"]], kind="stable")
        begins = np.diff(table["node"][order], prepend=-1) != 0
        alike = np.full(table.size, -1, np.int32)
        alike[order[:-1][~begins[1:]]] = order[1:][~begins[1:]]
        first = order[begins]
        own = np.full(-(-first.size // LANES) * LANES, -1, np.int32)
        own[: first.size] = first
        return own.reshape(-1, LANES), alike

    def _costed(self, world: World) -> Hierarchy:
        """Return the hierarchy, with the costs that arcs have now."""
        assert self.hierarchy is not None
        searches.cost_ways(self.hierarchy, world.routes.arc)
        return self.hierarchy

    def _rooms_for(self, batches: int, *, ways: bool = False) -> list[Lanes]:
        """Return a room for each thread that is worth its start."""
        pays = batches * self._ns_of_batch() > _THREADS_PAY
        number = min(self.threads, batches) if pays else 1
        if ways:
            return [room_for(self.paths.node.size, ways=True) for _ in range(number)]
        while len(self._rooms) < number:
            self._rooms.append(room_for(self.paths.node.size))
        return self._rooms[:number]


def passes_in(settings: Settings, drivers: npt.NDArray[np.void]) -> float:
    """Return about how often ways to all destinations will be looked for in a run."""
    return 2.0 + settings.duration / float(drivers["interval"].min())
