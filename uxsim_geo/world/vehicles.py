"""Vehicles as scripts handle them: platoons, and what has become of them."""

from __future__ import annotations

from collections.abc import Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import pandas as pd

from uxsim_geo.errors import Faults
from uxsim_geo.world import options
from uxsim_geo.world.links import Link
from uxsim_geo.world.nodes import Node

if TYPE_CHECKING:
    from uxsim_geo.world.building import Scenario

#: of a trip -> as UXsim's users know it
STATES = {"waiting": "wait", "running": "run", "completed": "end", "aborted": "abort"}

#: names that UXsim's users may look for, and what there is instead
INSTEAD = MappingProxyType(
    {
        "links_avoid": "a route is given as a whole: addVehicle(..., route=[...])",
        "links_prefer": "a route is given as a whole: addVehicle(..., route=[...])",
        "log_x": "analyzer.vehicles_to_pandas() has all places and speeds",
        "log_v": "analyzer.vehicles_to_pandas() has all places and speeds",
        "user_function": "give one to World, which can look at its VEHICLES",
        "v": "analyzer.vehicles_to_pandas() has all places and speeds; link.speed is a mean",
        "x": "analyzer.vehicles_to_pandas() has all places and speeds",
    }
)


class Vehicle:
    """A platoon: from one node to another, at a moment of its own.

    name
        its row of ``result.trips``; of those added by themselves as it was given, or ``added-0``
    orig, dest, departure_time
        both nodes; s
    user_attribute
        for the script
    """

    __slots__ = ("W", "_row", "departure_time", "dest", "name", "orig", "user_attribute")

    def __init__(
        self, world: Scenario, name: str, ends: tuple[Node, Node], departure_time: float
    ) -> None:
        self.W = world
        self.name = name
        self.orig, self.dest = ends
        self.departure_time = departure_time
        self.user_attribute: Any = None
        self._row: int | None = None

    @classmethod
    def of_row(cls, world: Scenario, row: int) -> Vehicle:
        """The platoon of a row of the trips."""
        trip = world.result.trips.iloc[row]
        ends = world.get_node(trip["origin"]), world.get_node(trip["destination"])
        vehicle = cls(world, str(row), ends, float(trip["depart_s"]))
        vehicle._row = row
        return vehicle

    def __repr__(self) -> str:
        return f"<Vehicle {self.name}>"

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(options.absent("Vehicle", name, dir(type(self)), INSTEAD))

    def __setattr__(self, name: str, value: object) -> None:
        try:
            object.__setattr__(self, name, value)
        except AttributeError:
            what = options.absent("Vehicle", name, (), INSTEAD)
            raise AttributeError(f"{what}; data of your own belong into user_attribute") from None

    @property
    def row(self) -> int | None:
        """Its row of ``result.trips``; None before the simulation knows of it."""
        return self._row

    @property
    def state(self) -> str:
        """``home``, ``wait`` (to enter the network), ``run``, ``end`` or ``abort``."""
        trip = self._trip()
        if trip is None or trip["depart_s"] > self.W.TIME:
            return "home"
        return STATES[trip["status"]]

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
    def distance_traveled(self) -> float:
        """How far it has come on the network, m."""
        trip = self._trip()
        return 0.0 if trip is None else float(trip["distance_m"])

    @property
    def links(self) -> list[Link]:
        """The links that it has entered so far, in their order."""
        return [self.W.get_link(str(name)) for name in self._entries()["link"]]

    @property
    def link(self) -> Link | None:
        """The link it is on now; None where it is on none."""
        return self.links[-1] if self.state == "run" else None

    def traveled_route(self) -> tuple[list[Link], list[float]]:
        """Return the links it has entered, and when, s; at the end its arrival, -1 until then."""
        arrival = self.arrival_time
        times = [float(time) for time in self._entries()["enter_s"]]
        return self.links, [*times, -1.0 if arrival is None else arrival]

    def _entries(self) -> pd.DataFrame:
        """Its rows of the events, in the order in which it entered the links."""
        row = self.row
        if row is None:
            return pd.DataFrame(columns=["link", "enter_s"])
        events = self.W.result.events
        return events[events["vehicle"] == row].sort_values("enter_s", kind="stable")

    def _trip(self) -> pd.Series[Any] | None:
        """Return its row of the trips; None before the simulation knows of it."""
        row = self.row
        return None if row is None else self.W.result.trips.iloc[row]


class AddedVehicle(Vehicle):
    """A platoon that was added by itself."""

    __slots__ = ("_place", "_route")

    def __init__(
        self, world: Scenario, name: str, ends: tuple[Node, Node], departure_time: float, place: int
    ) -> None:
        super().__init__(world, name, ends, departure_time)
        self._route: tuple[Link, ...] | None = None
        self._place = place

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
    def row(self) -> int | None:
        """Its row of ``result.trips``; None before the simulation knows of it."""
        if self._row is None and self.W._run is not None and self not in self.W._new_vehicles:
            self._row = self._find_row()
        return self._row

    def _find_row(self) -> int | None:
        from uxsim_geo.world.scenario import end_of_moment

        trips = self.W.result.trips
        own = trips[
            (trips["origin"] == self.orig.name)
            & (trips["destination"] == self.dest.name)
            & (trips["depart_s"] >= self.departure_time)
            & (trips["depart_s"] <= end_of_moment(self.departure_time))
        ].sort_values("number")
        if own.empty:
            return None
        # demand that departs in the same moment has the lower numbers
        return int(own["vehicle"].iloc[self._place - self.W.twins(self)])
