"""What a run is set up with: classes of drivers, given routes, rules of control."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.control.drivers import DriverClass
from uxsim_geo.control.guidance import EnforcedRoute
from uxsim_geo.control.levers import Levers
from uxsim_geo.control.own import OwnControl
from uxsim_geo.control.site import Measure, Site, as_ids
from uxsim_geo.demand.check import check_demand
from uxsim_geo.demand.demand import Demand
from uxsim_geo.demand.platoons import Floats, Ints, Platoons, class_of_rows, make_platoons
from uxsim_geo.draws import ENFORCED, combine, unit
from uxsim_geo.engine.application import Application
from uxsim_geo.engine.arrays import Wishes, order_of_links
from uxsim_geo.engine.binding import bind, site_of
from uxsim_geo.engine.plans import Plans
from uxsim_geo.engine.population import (
    Drivers,
    complete_classes,
    driver_records,
    drivers_of_platoons,
    part_into_drivers,
)
from uxsim_geo.engine.steering import Steering, base_levers
from uxsim_geo.errors import Faults
from uxsim_geo.network.check import check_network
from uxsim_geo.network.network import Network
from uxsim_geo.network.paths import Paths
from uxsim_geo.settings import Settings

Records = npt.NDArray[Any]


@dataclass
class Setting:
    """All of a run that does not change while it goes on, and its control.

    measures
        the measures of control in words, by which they are known again
    row_of_link
        rows of the links table, in the order of the engine
    given
        given routes one after the other, as arcs; they may grow
    """

    settings: Settings
    site: Site
    paths: Paths
    classes: list[DriverClass]
    drivers: list[Drivers]
    measures: list[str]
    enforced: list[EnforcedRoute]
    row_of_link: Ints
    platoons: Platoons
    steering: Steering
    given: Ints

    def driver_records(self) -> Records:
        """Make the records of the drivers."""
        return driver_records(self.drivers, self.classes, self.settings)

    def toll_factors(self, platoons: Platoons) -> Floats:
        """Return what share of a toll every platoon pays; shape (platoons,)."""
        factor = {one.name: one.toll_factor for one in self.classes}
        return np.array([factor[name] for name in platoons.class_names])[platoons.driver_class]

    def check_demand(self, demand: Demand) -> None:
        """Raise where a demand names classes that there are not, or routes that lead nowhere."""
        faults = Faults("demand")
        add_class_faults(demand, self.classes, faults)
        add_route_faults(demand, self.site, self.steering.base, faults)
        faults.raise_if_any()

    def wishes_of(self, platoons: Platoons) -> Wishes:
        """Work out who the drivers of platoons are, and which way they want to go."""
        nodes = np.array([self.site.node_position[name] for name in platoons.node_ids], np.int64)
        driver = drivers_of_platoons(self.drivers, self.classes, platoons)
        routes = list(platoons.routes)
        route = platoons.route.copy()
        with np.errstate(over="ignore"):  # hashes overflow by design
            chance = unit(combine(platoons.key, ENFORCED))
        for enforced in self.enforced:
            meant = self._meant_by(enforced, platoons) & (route < 0)
            route[meant & (chance < enforced.share)] = len(routes)
            chance[meant] -= enforced.share  # the next share is of them all, too
            routes.append(as_ids(enforced.links))
        begin = self._lay_down(routes)
        return Wishes(
            destination=nodes[platoons.destination],
            driver=driver,
            route=np.where(route >= 0, np.append(begin, -1)[route], -1),
            given=self.given,
        )

    def notes(self, platoons: Platoons) -> tuple[str, ...]:
        """Say which enforced routes nobody has been given."""
        return tuple(
            f"enforced route from {one.origin} to {one.destination} never took effect: "
            "nobody whom it is for leaves home there while it is in force"
            for one in self.enforced
            if not self._meant_by(one, platoons).any()
        )

    def _meant_by(self, enforced: EnforcedRoute, platoons: Platoons) -> npt.NDArray[np.bool_]:
        """Say of which platoons a share drives an enforced route."""
        names = platoons.node_ids
        here = (names[platoons.origin] == enforced.origin) & (
            names[platoons.destination] == enforced.destination
        )
        in_time = (platoons.depart >= enforced.begin) & (platoons.depart < enforced.end)
        wanted = as_ids(enforced.classes)
        classes = np.array([not wanted or name in wanted for name in platoons.class_names])
        meant: npt.NDArray[np.bool_] = here & in_time & classes[platoons.driver_class]
        return meant

    def _lay_down(self, routes: Sequence[Sequence[str]]) -> Ints:
        """Add routes to those given; returns where each of them begins."""
        sizes = np.array([len(route) for route in routes], np.int64)
        rows = ([self.site.link_position[link_id] for link_id in route] for route in routes)
        arcs = [arc for route in rows for arc in self.paths.arcs_along(route)]
        begin: Ints = self.given.size + np.cumsum(sizes) - sizes
        self.given = np.concatenate([self.given, np.array(arcs, np.int64)])
        return begin


def set_up(
    network: Network,
    demand: Demand,
    settings: Settings,
    control: Sequence[Measure],
    classes: Sequence[DriverClass],
) -> Setting:
    """Check all that a run is given, and set it up.

    Raises :class:`uxsim_geo.errors.InputError` with all that is wrong with the tables, and once
    these are good, with all that is wrong with classes and control.
    """
    check_network(network)
    check_demand(demand, network)
    faults = Faults()
    class_faults = Faults("classes")
    given, classes = classes, complete_classes(classes, class_faults)
    paths = Paths.of(network)
    site = site_of(network, settings, [one.name for one in classes], paths)
    base = base_levers(site)
    ban_links(given, site, base, class_faults)
    faults.extend(class_faults)
    demand_faults = Faults("demand")
    add_class_faults(demand, classes, demand_faults)
    add_route_faults(demand, site, base, demand_faults)
    faults.extend(demand_faults)
    control_faults = Faults("control")
    rules = bind(control, site, control_faults)
    add_ban_faults(control, site, base, control_faults)
    faults.extend(control_faults)
    faults.raise_if_any()

    row_of_link = order_of_links(paths)
    drivers = part_into_drivers(classes)
    plans = Plans(site, site.plans, np.argsort(row_of_link))
    application = Application(site, drivers, plans, row_of_link, base)
    return Setting(
        settings=settings,
        site=site,
        paths=paths,
        classes=classes,
        drivers=drivers,
        measures=[in_words(one) for one in control],
        enforced=[one for one in control if isinstance(one, EnforcedRoute)],
        row_of_link=row_of_link,
        platoons=make_platoons(demand, settings),
        steering=Steering(site, rules, base, application),
        given=np.empty(0, np.int64),
    )


def in_words(measure: Measure) -> str:
    """Describe a measure with all its values; of one's own function, which has none, the name."""
    if isinstance(measure, OwnControl):
        period = f"from {measure.begin:g} to {measure.end:g} s, every {measure.interval:g} s"
        return f"own control {getattr(measure.function, '__name__', 'unnamed')} {period}"
    return repr(measure)


def ban_links(classes: Sequence[DriverClass], site: Site, levers: Levers, faults: Faults) -> None:
    """Ban the classes from the links that they may not use, and note links that are not there.

    Faults name classes by their number, as line, from 1.
    """
    for number, one in enumerate(classes, start=1):
        if one.banned:
            own = Faults()
            links = site.links(one.banned, own, key="banned")
            faults.add_of_entry(number, own)
            levers.banned[site.class_names.index(one.name), links] = True


def add_class_faults(demand: Demand, classes: Sequence[DriverClass], faults: Faults) -> None:
    """Note classes that the demand names and nobody has described."""
    known = {one.name for one in classes}
    for name in pd.unique(class_of_rows(demand.table)):
        if name not in known:
            what = f"no such class of drivers; there are {', '.join(sorted(known))}"
            faults.add(what, column="class", value=name)


def add_route_faults(demand: Demand, site: Site, base: Levers, faults: Faults) -> None:
    """Note given routes that cannot be driven, or not by their class."""
    if "route" not in demand.table:
        return
    ends = (demand.table[name].astype(str) for name in ("origin", "destination"))
    rows = zip(*ends, demand.table["route"], class_of_rows(demand.table), strict=True)
    for number, (origin, destination, route, name) in enumerate(rows, start=1):
        if isinstance(route, list | tuple | np.ndarray):
            own = Faults()
            way = EnforcedRoute(origin, destination, tuple(map(str, route)))
            way.rules(site, own)
            add_bans_on(replace(way, classes=(name,)), site, base, own)
            for fault in own.found:
                faults.add(fault.what, line=number, column="route", value=fault.value)


def add_ban_faults(control: Sequence[Measure], site: Site, base: Levers, faults: Faults) -> None:
    """Note routes that control enforces on classes that may not use their links."""
    for number, measure in enumerate(control, start=1):
        if isinstance(measure, EnforcedRoute):
            own = Faults()
            add_bans_on(measure, site, base, own)
            faults.add_of_entry(number, own)


def add_bans_on(route: EnforcedRoute, site: Site, base: Levers, faults: Faults) -> None:
    """Note the links of a route that are banned to a class that is to drive it."""
    for name in as_ids(route.classes) or site.class_names:
        for link_id in as_ids(route.links):
            known = name in site.class_names and link_id in site.link_position
            if known and base.banned[site.class_names.index(name), site.link_position[link_id]]:
                what = f"is banned to drivers of class {name}: give them another route"
                faults.add(what, column="links", value=link_id)
