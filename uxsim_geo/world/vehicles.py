"""Vehicles that a script adds one by one, and what has become of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from uxsim_geo.errors import Faults
from uxsim_geo.world.links import Link
from uxsim_geo.world.nodes import Node

if TYPE_CHECKING:
    import pandas as pd

    from uxsim_geo.world.building import Scenario

#: of a trip -> as UXsim's users know it
STATES = {"waiting": "wait", "running": "run", "completed": "end", "aborted": "abort"}


class Vehicle:
    """A platoon that was added by itself: from one node to another, at a moment of its own.

    name
        as it was given, or ``added-0`` and so on
    orig, dest, departure_time
        as they were given (departure_time in s)
    """

    __slots__ = ("W", "_place", "_route", "departure_time", "dest", "name", "orig")

    def __init__(
        self, world: Scenario, name: str, ends: tuple[Node, Node], departure_time: float, place: int
    ) -> None:
        self.W = world
        self.name = name
        self.orig, self.dest = ends
        self.departure_time = departure_time
        self._route: tuple[Link, ...] | None = None
        self._place = place

    def __repr__(self) -> str:
        return f"<Vehicle {self.name}>"

    @property
    def moment(self) -> tuple[str, str, float]:
        """Names of both ends, and the departure."""
        return self.orig.name, self.dest.name, self.departure_time

    @property
    def route(self) -> tuple[Link, ...] | None:
        """The links that it must drive; None: it chooses."""
        return self._route

    def enforce_route(self, route: Sequence[Link | str]) -> None:
        """Let it drive these links, which must lead from its origin to its destination.

        Possible until the simulation has gone on after it was added.
        """
        faults = Faults(f"vehicle {self.name}")
        links = tuple(self.W.get_link(link) for link in route)
        nodes = [self.orig, *(link.end_node for link in links)]
        for before, link in zip(nodes, links, strict=False):
            if link.start_node is not before:
                what = f"begins at node {link.start_node.name}, but the route has come to "
                faults.add(f"{what}{before.name}", column="route", value=link.name)
        if nodes[-1] is not self.dest:
            what = f"must end at node {self.dest.name}, but ends at {nodes[-1].name}"
            faults.add(what, column="route", value=[link.name for link in links])
        if self not in self.W._new_vehicles:
            faults.add("can be given only before the simulation goes on", column="route")
        faults.raise_if_any()
        self._route = links

    @property
    def state(self) -> str:
        """``home``, ``wait`` (to enter the network), ``run``, ``end`` or ``abort``."""
        trip = self._trip()
        if trip is None or trip["depart_s"] > self.W.TIME:
            return "home"
        return STATES[trip["status"]]

    @property
    def row(self) -> int | None:
        """Its row of ``result.trips``; None before the simulation knows of it."""
        trip = self._trip()
        return None if trip is None else int(trip["vehicle"])

    @property
    def arrival_time(self) -> float | None:
        """Time at which it arrived, s; None until then."""
        trip = self._trip()
        return float(trip["arrive_s"]) if trip is not None and self.state == "end" else None

    @property
    def travel_time(self) -> float | None:
        """From departure to arrival, s; None until then."""
        arrival = self.arrival_time
        return None if arrival is None else arrival - self.departure_time

    @property
    def links(self) -> list[Link]:
        """The links that it has entered so far, in their order."""
        trip = self._trip()
        if trip is None:
            return []
        events = self.W.result.events
        own = events[events["vehicle"] == trip["vehicle"]].sort_values("enter_s", kind="stable")
        return [self.W.get_link(str(name)) for name in own["link"]]

    @property
    def link(self) -> Link | None:
        """The link it is on now; None where it is on none."""
        return self.links[-1] if self.state == "run" else None

    def _trip(self) -> pd.Series[Any] | None:
        """Return its row of the trips; None before the simulation knows of it."""
        if self.W._run is None or self in self.W._new_vehicles:
            return None
        from uxsim_geo.world.scenario import end_of_moment

        trips = self.W.result.trips
        own = trips[
            (trips["origin"] == self.orig.name)
            & (trips["destination"] == self.dest.name)
            & (trips["depart_s"] >= self.departure_time)
            & (trips["depart_s"] <= end_of_moment(self.departure_time))
        ].sort_values("number")
        # demand that departs in the same moment has the lower numbers
        return own.iloc[self._place - self.W.twins(self)] if len(own) else None
