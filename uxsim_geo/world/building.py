"""A scenario under construction: roads, and the demand on them, added by UXsim's names."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from uxsim_geo.errors import Fault, Faults, InputError
from uxsim_geo.network.uxsim_csv import read_uxsim_rows
from uxsim_geo.settings import Settings
from uxsim_geo.world import options, values
from uxsim_geo.world.links import Link
from uxsim_geo.world.nodes import Node
from uxsim_geo.world.roads import Roads
from uxsim_geo.world.scenario import DemandRow
from uxsim_geo.world.vehicles import AddedVehicle, Vehicle

if TYPE_CHECKING:
    from uxsim_geo.result import Result


class Scenario(Roads):
    """What a script has added, and the model parameters it is added under."""

    def __init__(self, settings: Settings, tmax: float | None) -> None:
        super().__init__(settings, tmax)
        self._vehicles: dict[str, AddedVehicle] = {}
        #: added, but not yet known to the simulation
        self._new_demand: list[DemandRow] = []
        self._new_vehicles: list[AddedVehicle] = []
        #: rows of the trips that have been asked for
        self._platoons: dict[int, Vehicle] = {}
        #: vehicles by origin, destination and departure
        self._moments: Counter[tuple[str, str, float]] = Counter()
        self._vehicles_told = 0.0
        #: s: the latest begin, and the latest end, of what was added
        self._last_start = self._last_departure = 0.0

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
        start = self._departure(faults, "t_start", t_start)
        end = values.number(faults, "t_end", t_end)
        if end <= start:
            faults.add(f"must be later than t_start, {start:g}", column="t_end", value=t_end)
        if (flow == -1) == (volume == -1):
            faults.add("give either flow in veh/s, or volume in vehicles")
        name, given = ("volume", volume) if volume != -1 else ("flow", flow)
        amount = values.number(faults, name, given) if given != -1 else 0.0
        if origin is destination:
            faults.add("must be another node than orig", column="dest", value=destination.name)
        faults.raise_if_any()
        vehicles = amount * (end - start if name == "flow" else 1.0)
        if vehicles:
            row = DemandRow(origin.name, destination.name, start, end, vehicles)
            self._new_demand.append(row)
            self._vehicles_told += vehicles
            self._note_departures(start, end)

    def addVehicle(
        self,
        orig: Node | str,
        dest: Node | str,
        departure_time: float,
        name: str | None = None,
        *,
        route: Sequence[Link | str] | None = None,
        user_attribute: Any = None,
        **others: object,
    ) -> AddedVehicle:
        """Let one platoon of ``deltan`` vehicles depart at a time, s.

        ``route``: links that it must drive, from ``orig`` to ``dest``; None: it chooses. Possible
        during a run too. Raises :class:`uxsim_geo.errors.InputError` with all that is wrong, and
        TypeError for other arguments.
        """
        options.refuse_others("addVehicle", others)
        origin, destination = self.get_node(orig), self.get_node(dest)
        label = f"added-{len(self._vehicles)}" if name is None else str(name)
        faults = Faults(f"vehicle {label}")
        time = self._departure(faults, "departure_time", departure_time)
        if label in self._vehicles:
            faults.add("the name is taken already", column="name", value=label)
        if origin is destination:
            faults.add("must be another node than orig", column="dest", value=destination.name)
        faults.raise_if_any()
        moment = (origin.name, destination.name, time)
        vehicle = AddedVehicle(self, label, (origin, destination), time, self._moments[moment])
        vehicle.user_attribute = user_attribute
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
        self._note_departures(time, time)
        return vehicle

    def load_scenario_from_csv(
        self,
        fname_node: str | Path,
        fname_link: str | Path,
        fname_demand: str | Path,
        tmax: float | None = None,
    ) -> None:
        """Add what stands in three CSV files; see :mod:`uxsim_geo.network.uxsim_csv`.

        Raises :class:`uxsim_geo.errors.InputError` with all that is wrong in any of them, and
        adds nothing then.
        """
        paths = (Path(fname_node), Path(fname_link), Path(fname_demand))
        end = self._tmax if tmax is None else tmax
        rows = read_uxsim_rows(*paths, known=(self._nodes, self._links), end=end)
        if tmax is not None:
            self._set_tmax(tmax)
        for _, told in rows.nodes:
            self.addNode(**told)
        for _, told in rows.links:
            self.addLink(**told)
        for _, told in rows.demand:
            self.adddemand(**told)

    def _set_tmax(self, tmax: float) -> None:
        if self._run is not None:
            raise InputError([Fault("cannot be changed once the scenario is final", column="tmax")])
        if tmax < self._last_start:
            what = f"some demand departs from {self._last_start:g} s on, which is later"
            raise InputError([Fault(what, "World", None, "tmax", f"{tmax:g}")])
        self._settings = options.end_at(self._settings, tmax)
        self._tmax = tmax

    @property
    def VEHICLES(self) -> dict[str, Vehicle]:
        """All platoons by name: rows of the trips, and those that were added by themselves.

        Raises RuntimeError while the platoons of the demand are not made.
        """
        if self._run is None and self._new_demand:
            raise RuntimeError(
                "the demand is cut into vehicles by finalize_scenario(): call it before VEHICLES"
            )
        rows = range(0 if self._run is None else len(self.result.trips))
        return self._vehicles_of(rows) | dict(self._vehicles)

    @property
    def VEHICLES_RUNNING(self) -> dict[str, Vehicle]:
        """Those of :attr:`VEHICLES` that are on a link now."""
        return self._vehicles_in(("running",))

    @property
    def VEHICLES_LIVING(self) -> dict[str, Vehicle]:
        """Those of :attr:`VEHICLES` that have not ended their trips, or not begun them."""
        return self._vehicles_in(("running", "waiting"))

    def _vehicles_in(self, states: tuple[str, ...]) -> dict[str, Vehicle]:
        if self._run is None:
            return self.VEHICLES if "waiting" in states else {}
        status = self.result.trips["status"].isin(states)
        return self._vehicles_of(status.to_numpy().nonzero()[0])

    def _vehicles_of(self, rows: Iterable[int]) -> dict[str, Vehicle]:
        """Vehicles of some rows of the trips, each the same object whenever it is asked for."""
        for vehicle in self._vehicles.values():
            if vehicle.row is not None:
                self._platoons[vehicle.row] = vehicle
        for row in map(int, rows):
            if row not in self._platoons:
                self._platoons[row] = Vehicle.of_row(self, row)
        return {self._platoons[row].name: self._platoons[row] for row in map(int, rows)}

    def _departure(self, faults: Faults, name: str, value: float) -> float:
        """Return a time of departure: neither over, nor after the end of the simulation."""
        time = values.number(faults, name, value, least=self.TIME)
        if self._tmax is not None and time > self._tmax:
            what = f"is after the end of the simulation, {self._tmax:g} s: raise tmax"
            faults.add(what, column=name, value=value)
        return time

    def _note_departures(self, first: float, last: float) -> None:
        self._last_start = max(self._last_start, first)
        self._last_departure = max(self._last_departure, last)

    def row_of_vehicle(self, name: str) -> int | None:
        """Return the row of the trips of a vehicle that was added by itself; None: none such."""
        vehicle = self._vehicles.get(name)
        return None if vehicle is None else vehicle.row

    def has_moved(self, node: Node) -> bool:
        """Whether a signal no longer follows the plan that it had at the start."""
        return self._run is not None and self._run.has_moved(node)

    def rows_of_added_vehicles(self) -> dict[str, int]:
        """Rows of the trips of vehicles that were added by themselves, by their names."""
        rows = {name: vehicle.row for name, vehicle in self._vehicles.items()}
        return {name: row for name, row in rows.items() if row is not None}

    def twins(self, vehicle: AddedVehicle) -> int:
        """How many vehicles the simulation knows that share both ends and the departure."""
        coming = sum(other.moment == vehicle.moment for other in self._new_vehicles)
        return self._moments[vehicle.moment] - coming
