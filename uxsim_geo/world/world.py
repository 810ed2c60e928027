"""World: scenarios by code, with the names that UXsim's users know.

A thin face. What is added becomes the tables of :mod:`uxsim_geo.network` and
:mod:`uxsim_geo.demand`; :class:`uxsim_geo.engine.simulation.Simulation` simulates them; what a
script sets meanwhile goes through the levers of :mod:`uxsim_geo.control`.
"""

from __future__ import annotations

import copy
import inspect
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from uxsim_geo.errors import Faults
from uxsim_geo.settings import Settings
from uxsim_geo.world import options, printing, values
from uxsim_geo.world.building import Scenario
from uxsim_geo.world.roads import ROUNDING
from uxsim_geo.world.scenario import (
    demand_of,
    demand_of_vehicles,
    links_table,
    nodes_table,
    rounds_of,
    signals_of,
    with_geometry,
)

if TYPE_CHECKING:
    import numpy as np

    from uxsim_geo.export.page.inline import InlinePage
    from uxsim_geo.network.network import Network
    from uxsim_geo.world.analyzer import Analyzer
    from uxsim_geo.world.figures import Figure
    from uxsim_geo.world.run import Run

#: s: without tmax a run ends at a multiple of this, with one more after the last departure
_PERIOD = 1800

#: of the one class of drivers, per hour: it makes tolls seconds of travel time
_VALUE_OF_TIME = 3600.0


class World(Scenario):
    """A scenario and its simulation.

    name
        of the scenario; pictures and tables are saved to the folder ``out<name>``
    deltan, reaction_time, tmax
        Δn, vehicles that move together; τ, s; end of the simulation, s (None: 1,800 to 3,600 s
        after the last departure)
    duo_update_time, duo_update_weight, duo_noise
        route choice: s between two updates, λ, noise of travel times
    print_mode, save_mode, show_mode
        print what happens; save pictures; show them (in notebooks)
    random_seed
        None draws one, which ``random_seed`` then holds
    route_choice_update_gradual, no_cyclic_routing, hard_deterministic_mode, route_choice,
    logit_spread, demand_rounding
        see :class:`uxsim_geo.settings.Settings`
    adjust_node_capacity
        nodes without a flow_capacity let the mean of their largest in- and out-link pass
    eular_dt
        s, time bins of the analyses
    show_progress_deltat
        s between two lines of progress
    user_function
        called with this world at the end of every time step

    Other arguments of UXsim are taken where they make no difference here
    (:data:`uxsim_geo.world.options.WITHOUT_EFFECT`). Raises TypeError for arguments that mean
    nothing, and :class:`uxsim_geo.errors.InputError` with all values that are wrong.
    """

    #: what a script may set at any time
    SETTABLE = frozenset(
        {
            "adjust_node_capacity",
            "name",
            "print_mode",
            "save_mode",
            "show_mode",
            "show_progress_deltat",
            "user_attribute",
            "user_function",
        }
    )

    def __init__(
        self,
        name: str = "",
        deltan: int = 5,
        reaction_time: float = 1,
        tmax: float | None = None,
        duo_update_time: float = 600,
        duo_update_weight: float = 0.5,
        duo_noise: float = 0.01,
        print_mode: int = 1,
        save_mode: int = 1,
        show_mode: int = 0,
        random_seed: int | None = None,
        *,
        route_choice_principle: str = "homogeneous_DUO",
        route_choice_update_gradual: bool = False,
        no_cyclic_routing: bool = False,
        hard_deterministic_mode: bool = False,
        route_choice: options.RouteChoice = "inertia",
        logit_spread: float = Settings.logit_spread,
        demand_rounding: options.Rounding = "conserve",
        adjust_node_capacity: bool = False,
        eular_dt: float = 120,
        show_progress_deltat: float = 600,
        user_attribute: Any = None,
        user_function: Callable[[World], object] | None = None,
        **others: Any,
    ) -> None:
        options.check_others(others, list(inspect.signature(World).parameters))
        options.check_principle(route_choice_principle)
        told = {
            "duration": 1.0 if tmax is None else tmax,
            "platoon_size": deltan,
            "reaction_time": reaction_time,
            "route_update_interval": duo_update_time,
            "route_update_weight": duo_update_weight,
            "route_noise": duo_noise,
            "seed": options.seed_of(random_seed),
            "demand_rounding": demand_rounding,
            "route_choice": route_choice,
            "logit_spread": logit_spread,
            "no_cycles": no_cyclic_routing,
            "deterministic": hard_deterministic_mode,
            "route_update_gradual": route_choice_update_gradual,
        }
        super().__init__(options.settings_of(told), tmax)
        faults = Faults("World")
        self.user_function = values.user_function(faults, user_function)
        self._time_bin = values.number(faults, "eular_dt", eular_dt, above=0.0)
        report = values.number(faults, "show_progress_deltat", show_progress_deltat, above=0.0)
        faults.raise_if_any()
        self.name = name
        self.print_mode, self.save_mode, self.show_mode = print_mode, save_mode, show_mode
        self.user_attribute = user_attribute
        self.adjust_node_capacity = adjust_node_capacity
        self.show_progress_deltat = report
        self._network: Network | None = None
        self._analyzer: Analyzer | None = None
        self._rng: np.random.Generator | None = None

    def __repr__(self) -> str:
        return f"<World {self.name}>"

    def __setattr__(self, name: str, value: object) -> None:
        if name[0] != "_" and name not in self.SETTABLE:
            if hasattr(type(self), name):
                raise AttributeError(f"World: {name} can be read but not set")
            raise AttributeError(
                options.absent("World", name, self.SETTABLE, options.INSTEAD)
                + "; data of your own belong into user_attribute"
            )
        object.__setattr__(self, name, value)

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(options.absent("World", name, dir(type(self)), options.INSTEAD))

    @property
    def analyzer(self) -> Analyzer:
        """Tables, figures and statistics of what has been simulated so far."""
        from uxsim_geo.world.analyzer import Analyzer

        if self._analyzer is None or self._analyzer.source is not self.result:
            self._analyzer = Analyzer(self)
        return self._analyzer

    @property
    def EULAR_DT(self) -> float:
        """Time bins of the analyses, s."""
        return self._time_bin

    @property
    def network(self) -> Network:
        """The network as tables, with points and straight lines for geometry."""
        from uxsim_geo.network.network import Network

        if self._network is None or self._run is None:
            tables = Network(nodes_table(self.NODES), links_table(self.LINKS))
            self._network = with_geometry(tables)
        return self._network

    @property
    def rng(self) -> np.random.Generator:
        """Random numbers for the script, from ``random_seed``; the simulation draws its own."""
        import numpy as np

        if self._rng is None:
            self._rng = np.random.default_rng(self.random_seed)
        return self._rng

    def finalize_scenario(self, tmax: float | None = None) -> None:
        """Make the scenario ready to run; :meth:`exec_simulation` does it where it is not.

        Raises :class:`uxsim_geo.errors.InputError` with all that cannot be simulated.
        """
        if tmax is not None:
            self._set_tmax(tmax)
        if self._run is not None:
            return
        if self._tmax is None:
            self._set_tmax((int(self._last_departure) // _PERIOD + 2) * _PERIOD)
        self._run = self._start()
        self._hand_over(self._run)
        if self.print_mode:
            self.print_scenario_stats()

    def exec_simulation(
        self,
        until_t: float | None = None,
        duration_t: float | None = None,
        duration_t2: float | None = None,
    ) -> int:
        """Simulate until a time, for a duration (by either name), or to the end; all in s.

        Gives 1 when the simulation has come to its end, 0 before. In as many pieces as one likes
        the result is the same, bit for bit.
        """
        self.finalize_scenario()
        assert self._run is not None
        until = self._end_of_piece(until_t, duration_t2 if duration_t2 is not None else duration_t)
        if self.print_mode and self.TIME == 0:
            printing.print_progress_heading()
        while self.TIME < until - ROUNDING:
            self._hand_over(self._run)
            before = self.TIME
            stop = self._run.next_stop((self.T + 1) * self.DELTAT)
            self._run.advance(min(stop, self._next_report(), until))
            if self.print_mode and self._reports(before):
                printing.print_progress(self.TIME, *self._run.vehicles_and_speed())
        return 0 if self.check_simulation_ongoing() else 1

    def check_simulation_ongoing(self) -> bool:
        """Whether the simulation has not come to its end."""
        return self._run is None or not self._run.simulation.finished

    def copy(self) -> World:
        """Return a world with the same scenario, to be changed and simulated by itself.

        Raises TypeError once the scenario is final.
        """
        return copy.deepcopy(self)

    def change_print_mode(self, print_mode: int) -> None:
        """Print what happens, or do not."""
        self.print_mode = print_mode

    def print_scenario_stats(self) -> None:
        """Print what has been added, and how it is simulated."""
        printing.print_scenario(self, self._vehicles_told)

    def show_network(
        self, *, figsize: tuple[float, float] = (6, 6), network_font_size: float = 10, **looks: Any
    ) -> Figure:
        """Draw the network with the names of its nodes and links; size in inches, in points.

        The figure is saved and shown as those of :attr:`analyzer`.
        """
        from uxsim_geo.export.network_plan import network_figure
        from uxsim_geo.world import pictures

        pictures.check_looks(looks)
        title = self.name or "network"
        figure = network_figure(self.network, title, size=figsize, font_size=network_font_size)
        return pictures.finish(self, figure, "network")

    def explore(self, bin_s: float = 300.0) -> InlinePage:
        """Map, curves and tables of the run so far, as the value of a notebook's cell.

        ``bin_s`` is the length of a time step, s; errors as of
        :func:`uxsim_geo.export.page.inline.explore`.
        """
        from uxsim_geo.export.page.inline import explore
        from uxsim_geo.export.run_description import RunDescription

        network, facts = self.network, {"seed": self.random_seed}
        about = RunDescription(None, network.notes, facts, name=self.name or "World")
        return explore(network, self.result, bin_s=bin_s, about=about)

    def _start(self) -> Run:
        """Hand the scenario to the engine."""
        from uxsim_geo.control.drivers import DriverClass
        from uxsim_geo.engine.simulation import Simulation
        from uxsim_geo.network.network import Network
        from uxsim_geo.world.run import Run

        faults = Faults("signals")
        signals = signals_of(self.NODES, faults)
        faults.raise_if_any()
        if self.adjust_node_capacity:
            self._limit_nodes()
        simulation = Simulation(
            Network(nodes_table(self.NODES), links_table(self.LINKS)),
            demand_of(self._new_demand),
            self._settings,
            control=signals,
            classes=[DriverClass(value_of_time=_VALUE_OF_TIME)],
        )
        self._new_demand = []
        return Run(simulation, self)

    def _limit_nodes(self) -> None:
        """Let nodes without a flow_capacity pass the mean of their largest in- and out-link."""
        for node in self.NODES:
            if node.flow_capacity is None and node.inlinks and node.outlinks:
                sides = (node.inlinks.values(), node.outlinks.values())
                node.flow_capacity = sum(max(link.capacity for link in side) for side in sides) / 2

    def _hand_over(self, run: Run) -> None:
        """Give the simulation what has been added since it was looked at last."""
        demand, vehicles = self._new_demand, self._new_vehicles
        self._new_demand, self._new_vehicles = [], []
        if demand:
            run.add(demand_of(demand))
        for alike in rounds_of(vehicles):
            run.add(demand_of_vehicles(alike, self.DELTAN))

    def _end_of_piece(self, until: float | None, duration: float | None) -> float:
        assert self._tmax is not None
        faults = Faults("exec_simulation")
        end = float(self._tmax)
        if until is not None:
            end = values.number(faults, "until_t", until, least=self.TIME)
        elif duration is not None:
            end = self.TIME + values.number(faults, "duration_t2", duration)
        faults.raise_if_any()
        return min(end, self._tmax)

    def _next_report(self) -> float:
        return (self.TIME // self.show_progress_deltat + 1) * self.show_progress_deltat

    def _reports(self, before: float) -> bool:
        every = self.show_progress_deltat
        return self.TIME // every > before // every or not self.check_simulation_ongoing()
