"""A scenario under construction: nodes, links and demand, added by UXsim's names."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from uxsim_geo.errors import Fault, Faults, InputError
from uxsim_geo.settings import Settings
from uxsim_geo.world import values
from uxsim_geo.world.csv_files import read_csv_files
from uxsim_geo.world.elements import Element, unknown
from uxsim_geo.world.links import Link
from uxsim_geo.world.nodes import Node
from uxsim_geo.world.options import end_at
from uxsim_geo.world.scenario import DemandRow
from uxsim_geo.world.values import Pricing
from uxsim_geo.world.vehicles import Vehicle

if TYPE_CHECKING:
    from uxsim_geo.result import Result
    from uxsim_geo.world.run import Run

#: s: a time that lies this little before a step counts as its beginning
ROUNDING = 1e-9


class Scenario:
    """What a script has added, and the model parameters it is added under."""

    def __init__(self, settings: Settings, tmax: float | None) -> None:
        self._settings = settings
        self._tmax = tmax
        self._nodes: dict[str, Node] = {}
        self._links: dict[str, Link] = {}
        self._vehicles: dict[str, Vehicle] = {}
        #: added, but not yet known to the simulation
        self._new_demand: list[DemandRow] = []
        self._new_vehicles: list[Vehicle] = []
        #: vehicles by origin, destination and departure
        self._moments: Counter[tuple[str, str, float]] = Counter()
        #: of links and nodes, called with them at the end of every time step
        self._functions: dict[Element, Callable[[Any], object]] = {}
        self._vehicles_told = 0.0
        self._last_departure = 0.0
        self._run: Run | None = None

    @property
    def DELTAN(self) -> int:
        """Vehicles of a platoon."""
        return self._settings.platoon_size

    @property
    def DELTAT(self) -> float:
        """Length of a time step τΔn, s."""
        return self._settings.step

    @property
    def REACTION_TIME(self) -> float:
        """Reaction time τ, s."""
        return self._settings.reaction_time

    @property
    def TMAX(self) -> float | None:
        """End of the simulation, s; None while it is not known."""
        return self._tmax

    @property
    def TSIZE(self) -> int | None:
        """Time steps from the start to the end; None while the end is not known."""
        return None if self._tmax is None else math.ceil(self._tmax / self.DELTAT - ROUNDING)

    @property
    def TIME(self) -> float:
        """Where the simulation stands, s after the start."""
        return 0.0 if self._run is None else self._run.time

    @property
    def T(self) -> int:
        """Time steps that are over."""
        return int(self.TIME / self.DELTAT + ROUNDING)

    @property
    def NODES(self) -> list[Node]:
        """All nodes, in the order in which they were added."""
        return list(self._nodes.values())

    @property
    def LINKS(self) -> list[Link]:
        """All links, in the order in which they were added."""
        return list(self._links.values())

    @property
    def result(self) -> Result:
        """Events and trips up to now, as :func:`uxsim_geo.simulate` gives them.

        Raises RuntimeError before anything has been simulated.
        """
        if self._run is None:
            raise RuntimeError("nothing has been simulated yet: call exec_simulation() first")
        return self._run.result

    @property
    def random_seed(self) -> int:
        """Seed of every draw, given or drawn."""
        return self._settings.seed

    def addNode(
        self,
        name: str,
        x: float,
        y: float,
        signal: Sequence[float] = (0,),
        signal_offset: float = 0,
        signal_offset_old: float | None = None,
        flow_capacity: float | None = None,
        number_of_lanes: int | None = None,  # noqa: ARG002
        attribute: Any = None,
        user_attribute: Any = None,
        user_function: Callable[[Node], object] | None = None,
    ) -> Node:
        """Add a node.

        signal
            durations of the phases, s; [0]: no signal. Links name theirs by ``signal_group``
        signal_offset, signal_offset_old
            time at which a first cycle begins, s; the cycle less that time, as UXsim had it once
        flow_capacity
            veh/s that may pass from link to link; None: no limit. ``number_of_lanes``, which
            UXsim has for it, changes nothing: passages follow one another at this rate exactly

        Raises :class:`uxsim_geo.errors.InputError` with all that is wrong.
        """
        self._check_new("node", name, self._nodes)
        told = {
            "x": x,
            "y": y,
            "signal": signal,
            "signal_offset": signal_offset,
            "signal_offset_old": signal_offset_old,
            "flow_capacity": flow_capacity,
            "attribute": attribute,
            "user_attribute": user_attribute,
        }
        node = Node(self, str(name), len(self._nodes), told)
        node.user_function = user_function
        self._nodes[node.name] = node
        return node

    def addLink(
        self,
        name: str,
        start_node: Node | str,
        end_node: Node | str,
        length: float,
        free_flow_speed: float = 20,
        jam_density: float | None = None,
        jam_density_per_lane: float | None = None,
        number_of_lanes: int = 1,
        merge_priority: float = 1,
        signal_group: int | Sequence[int] = (0,),
        capacity_out: float | None = None,
        capacity_in: float | None = None,
        congestion_pricing: Pricing | None = None,
        eular_dx: float | None = None,  # noqa: ARG002
        attribute: Any = None,
        user_attribute: Any = None,
        user_function: Callable[[Link], object] | None = None,
    ) -> Link:
        """Add a link.

        length, free_flow_speed
            m, m/s
        jam_density, jam_density_per_lane
            veh/m, of all lanes together, or of one; neither: 0.2 of every lane
        merge_priority
            weight where it competes with other links for an out-link
        signal_group
            the phase, or phases, of the signal at its end in which it has green
        capacity_out, capacity_in
            veh/s that may leave or enter it; None: its own capacity
        congestion_pricing
            function of the time in s: toll for those who enter, in s of travel time

        Raises :class:`uxsim_geo.errors.InputError` with all that is wrong.
        """
        self._check_new("link", name, self._links)
        told = {
            "start_node": self.get_node(start_node),
            "end_node": self.get_node(end_node),
            "length": length,
            "free_flow_speed": free_flow_speed,
            "jam_density": jam_density,
            "jam_density_per_lane": jam_density_per_lane,
            "number_of_lanes": number_of_lanes,
            "merge_priority": merge_priority,
            "signal_group": signal_group,
            "capacity_out": capacity_out,
            "capacity_in": capacity_in,
            "congestion_pricing": congestion_pricing,
            "attribute": attribute,
            "user_attribute": user_attribute,
        }
        link = Link(self, str(name), len(self._links), told)
        link.user_function = user_function
        self._links[link.name] = link
        link.start_node.outlinks[link.name] = link
        link.end_node.inlinks[link.name] = link
        return link

    def adddemand(
        self,
        orig: Node | str,
        dest: Node | str,
        t_start: float,
        t_end: float,
        flow: float = -1,
        volume: float = -1,
    ) -> None:
        """Let vehicles depart evenly over a time, at ``flow`` veh/s or ``volume`` in all.

        Possible during a run too, for times to come. Raises
        :class:`uxsim_geo.errors.InputError` with all that is wrong.
        """
        origin, destination = self.get_node(orig), self.get_node(dest)
        faults = Faults(f"demand from {origin.name} to {destination.name}")
        start = values.number(faults, "t_start", t_start, least=self.TIME)
        end = values.number(faults, "t_end", t_end, above=start)
        name, given = ("volume", volume) if volume != -1 else ("flow", flow)
        if given == -1:
            faults.add("give flow in veh/s, or volume in vehicles")
        amount = values.number(faults, name, given) if given != -1 else 0.0
        if origin is destination:
            faults.add("must be another node than orig", column="dest", value=destination.name)
        faults.raise_if_any()
        vehicles = amount * (end - start if name == "flow" else 1.0)
        if vehicles:
            row = DemandRow(origin.name, destination.name, start, end, vehicles)
            self._new_demand.append(row)
            self._vehicles_told += vehicles
            self._last_departure = max(self._last_departure, end)

    def addVehicle(
        self,
        orig: Node | str,
        dest: Node | str,
        departure_time: float,
        name: str | None = None,
        *,
        route: Sequence[Link | str] | None = None,
    ) -> Vehicle:
        """Let one platoon of ``deltan`` vehicles depart at a time, s.

        ``route``: links that it must drive, from ``orig`` to ``dest``; None: it chooses. Possible
        during a run too. Raises :class:`uxsim_geo.errors.InputError` with all that is wrong.
        """
        origin, destination = self.get_node(orig), self.get_node(dest)
        label = f"added-{len(self._vehicles)}" if name is None else str(name)
        faults = Faults(f"vehicle {label}")
        time = values.number(faults, "departure_time", departure_time, least=self.TIME)
        if label in self._vehicles:
            faults.add("the name is taken already", column="name", value=label)
        if origin is destination:
            faults.add("must be another node than orig", column="dest", value=destination.name)
        faults.raise_if_any()
        moment = (origin.name, destination.name, time)
        vehicle = Vehicle(self, label, (origin, destination), time, self._moments[moment])
        self._new_vehicles.append(vehicle)
        if route is not None:
            try:
                vehicle.enforce_route(route)
            except InputError:
                self._new_vehicles.remove(vehicle)
                raise
        self._vehicles[label] = vehicle
        self._moments[moment] += 1
        self._vehicles_told += self.DELTAN
        self._last_departure = max(self._last_departure, time)
        return vehicle

    def load_scenario_from_csv(
        self,
        fname_node: str | Path,
        fname_link: str | Path,
        fname_demand: str | Path,
        tmax: float | None = None,
    ) -> None:
        """Add what stands in three CSV files; see :mod:`uxsim_geo.world.csv_files`.

        Raises :class:`uxsim_geo.errors.InputError` with all that is wrong in any of them, and
        adds nothing then.
        """
        paths = (Path(fname_node), Path(fname_link), Path(fname_demand))
        rows = read_csv_files(*paths, known=(self._nodes, self._links))
        for _, told in rows.nodes:
            self.addNode(**told)
        for _, told in rows.links:
            self.addLink(**told)
        for _, told in rows.demand:
            self.adddemand(**told)
        if tmax is not None:
            self._set_tmax(tmax)

    def _set_tmax(self, tmax: float) -> None:
        if self._run is not None:
            raise InputError([Fault("cannot be changed once the scenario is final", column="tmax")])
        self._settings = end_at(self._settings, tmax)
        self._tmax = tmax

    def get_node(self, node: Node | str) -> Node:
        """Return a node by its name; raises InputError where there is none."""
        found = self._nodes.get(node.name if isinstance(node, Node) else str(node))
        if found is None or (isinstance(node, Node) and found is not node):
            raise unknown("node", node, list(self._nodes))
        return found

    def get_link(self, link: Link | str) -> Link:
        """Return a link by its name; raises InputError where there is none."""
        found = self._links.get(link.name if isinstance(link, Link) else str(link))
        if found is None or (isinstance(link, Link) and found is not link):
            raise unknown("link", link, list(self._links))
        return found

    def get_nearest_node(self, x: float, y: float) -> Node:
        """Return the node nearest to a place; the first of several."""
        if not self._nodes:
            raise unknown("node", f"nearest to {x:g}, {y:g}", [])
        return min(self._nodes.values(), key=lambda node: math.hypot(node.x - x, node.y - y))

    def get_nodes_in_area(self, x: float, y: float, r: float) -> list[Node]:
        """Return the nodes less than ``r`` from a place."""
        return [node for node in self.NODES if math.hypot(node.x - x, node.y - y) < r]

    def row_of_vehicle(self, name: str) -> int | None:
        """Return the row of the trips of a vehicle that was added by itself; None: none such."""
        vehicle = self._vehicles.get(name)
        return None if vehicle is None else vehicle.row

    def twins(self, vehicle: Vehicle) -> int:
        """How many vehicles the simulation knows that share both ends and the departure."""
        coming = sum(other.moment == vehicle.moment for other in self._new_vehicles)
        return self._moments[vehicle.moment] - coming

    def _check_new(self, kind: str, name: object, known: Iterable[str]) -> None:
        faults = Faults(f"{kind} {name}")
        if self._run is not None:
            faults.add("cannot be added once the scenario is final")
        if str(name) in known:
            faults.add("the name is taken already", column="name", value=name)
        if not str(name).strip():
            faults.add("needs a name", column="name", value=name)
        faults.raise_if_any()
