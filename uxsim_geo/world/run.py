"""A scenario that is being simulated: the simulation, and how elements act on it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from uxsim_geo.control.traffic import Traffic
    from uxsim_geo.demand.demand import Demand
    from uxsim_geo.engine.simulation import Simulation
    from uxsim_geo.result import Result
    from uxsim_geo.world.links import Link
    from uxsim_geo.world.nodes import Node
    from uxsim_geo.world.world import World


class Run:
    """The simulation of a scenario.

    Elements stand in it by their ``id``, which is their row in the tables.
    """

    def __init__(self, simulation: Simulation, world: World) -> None:
        self.simulation = simulation
        self._world = world
        self._lanes = [link.number_of_lanes for link in world.LINKS]
        self._built = simulation.levers.copy()
        self._priced: dict[int, Link] = {}
        self._moved: dict[int, Node] = {}
        self._traffic: Traffic | None = None
        self._result: Result | None = None
        for link in world.LINKS:
            self.write_link(link)
        for node in world.NODES:
            self.write_node(node)

    @property
    def time(self) -> float:
        """Where the simulation stands, s after the start."""
        return float(self.simulation.time)

    @property
    def traffic(self) -> Traffic:
        """The state now."""
        if self._traffic is None:
            self._traffic = self.simulation.traffic
        return self._traffic

    @property
    def result(self) -> Result:
        """Events and trips up to now."""
        if self._result is None:
            self._result = self.simulation.result()
        return self._result

    def add(self, demand: Demand) -> None:
        """Let more vehicles depart."""
        if len(demand.table):
            self.simulation.add(demand)
            self._forget()

    def next_stop(self, step_end: float) -> float:
        """Give the time until which nothing is to be done: that step's end, or later, s."""
        world = self._world
        if self._priced or world._functions or world.user_function is not None:
            return step_end
        changes = (node.next_phase_change for node in self._moved.values())
        return max(step_end, min(changes, default=math.inf))

    def advance(self, until: float) -> None:
        """Go on in one piece, under the prices and moved signals of its beginning."""
        levers, time = self.simulation.levers, self.time
        for link in self._priced.values():
            levers.toll[link.id] = link.get_toll(time)
        for node in self._moved.values():
            levers.phase[node.id] = node.signal_phase
        self.simulation.advance(until)
        self._forget()
        for element, function in list(self._world._functions.items()):
            function(element)
        if self._world.user_function is not None:
            self._world.user_function(self._world)

    def lanes_built(self, link: Link) -> int:
        """How many lanes a link had at the start."""
        return self._lanes[link.id]

    def speed_built(self, link: Link) -> float:
        """The free speed of a link at the start, m/s."""
        return float(self._built.speed_limit[link.id])

    def write_link(self, link: Link) -> None:
        """Let a link be as its attributes say, from now on."""
        levers, place = self.simulation.levers, link.id
        share = link.number_of_lanes / self._lanes[place]
        for lever, built, told in (
            (levers.exit_capacity, self._built.exit_capacity, link.capacity_out),
            (levers.entry_capacity, self._built.entry_capacity, link.capacity_in),
        ):
            own = float(built[place]) * share
            lever[place] = own if told is None else min(own, told)
        levers.speed_limit[place] = link.free_flow_speed
        levers.merge_priority[place] = link.merge_priority
        if link.congestion_pricing is not None:
            self._priced[place] = link
        else:
            self._priced.pop(place, None)
            levers.toll[place] = link.route_choice_penalty

    def follow_clock(self, node: Node) -> None:
        """Let a signal show what its clock says, which no longer follows its plan."""
        if node.inlinks:  # else there is nothing that it could hold
            self._moved[node.id] = node

    def has_moved(self, node: Node) -> bool:
        """Whether a signal no longer follows its plan."""
        return node.id in self._moved

    def write_node(self, node: Node) -> None:
        """Let a node be as its attributes say, from now on."""
        told = node.flow_capacity
        self.simulation.levers.node_capacity[node.id] = math.inf if told is None else told

    def vehicles_and_speed(self) -> tuple[float, float]:
        """Vehicles on all links now, and their mean speed, m/s; NaN where there are none."""
        count = self.traffic.count
        total = float(count.sum())
        return total, float((count * self.traffic.speed).sum()) / total if total else math.nan

    def _forget(self) -> None:
        self._traffic = self._result = None
