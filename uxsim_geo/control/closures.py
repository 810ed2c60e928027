"""Closures and incidents: links, or some of their lanes, that cannot be used for a time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from uxsim_geo.control.levers import Levers
from uxsim_geo.control.site import (
    Chosen,
    Claim,
    Ints,
    Rule,
    Site,
    check_number,
    check_period,
)
from uxsim_geo.control.timetable import NUMBER
from uxsim_geo.control.traffic import Traffic
from uxsim_geo.errors import Faults


@dataclass(frozen=True)
class Closure:
    """Nobody may enter some links; or nobody of some classes of drivers.

    on_link
        what those do who are on the links when it begins: ``clear`` them, or ``stay`` until it ends
    classes
        names of the classes that it is for; none: for all
    """

    links: Chosen
    begin: float = 0.0
    end: float = math.inf
    on_link: Literal["clear", "stay"] = "clear"
    classes: tuple[str, ...] = ()

    def rules(self, site: Site, faults: Faults) -> list[Rule]:
        """Return the rule that closes the links; felt on them and on those that lead to them."""
        check_period(self.begin, self.end, site.duration, faults)
        links = site.links(self.links, faults)
        classes = site.classes(self.classes, faults)
        if self.on_link not in ("clear", "stay"):
            faults.add("must be clear or stay", column="on_link", value=self.on_link)
        elif self.on_link == "stay" and self.classes:
            what = "holds all who are on the link: leave out classes, or say clear"
            faults.add(what, column="on_link", value=self.on_link)
        claims = self._claims(links, classes)

        def act(_: Traffic, levers: Levers) -> None:
            for claim in claims:
                claim.write(levers, True)

        name = f"closure of {site.name_links(links)}"
        if self.classes:
            name += f" to {', '.join(site.class_names[number] for number in classes)}"
        leads_there = np.isin(site.to_node, site.from_node[links])
        leads_there[links] = True
        felt_at = np.flatnonzero(leads_there)
        return [Rule(name, act, claims, self.begin, self.end, felt_at=felt_at)]

    def _claims(self, links: Ints, classes: Ints) -> tuple[Claim, ...]:
        if self.classes:
            return (Claim("banned", links, classes),)
        closed = ("entry_closed", "exit_closed") if self.on_link == "stay" else ("entry_closed",)
        return tuple(Claim(quantity, links) for quantity in closed)


@dataclass(frozen=True)
class Incident:
    """Some lanes of some links are blocked at their ends.

    Each link is left at the share of its capacity that its open lanes have; the queue stands on
    all of its lanes.

    lanes_closed
        number of lanes of each of the links; fewer than it has
    """

    links: Chosen
    lanes_closed: int
    begin: float = 0.0
    end: float = math.inf

    def rules(self, site: Site, faults: Faults) -> list[Rule]:
        """Return the rule that lowers the exit capacity."""
        check_period(self.begin, self.end, site.duration, faults)
        claim = Claim("exit_capacity", site.links(self.links, faults))
        links = claim.positions
        check_number(self.lanes_closed, "lanes_closed", faults, above=0.0)
        if not isinstance(self.lanes_closed, NUMBER):
            return []
        if self.lanes_closed % 1 != 0:
            faults.add("must be a whole number", column="lanes_closed", value=self.lanes_closed)
        whole = links[site.lanes[links] <= self.lanes_closed]
        if whole.size:
            what = f"leaves no lane open on {site.name_links(whole)}: close it instead"
            faults.add(what, column="lanes_closed", value=self.lanes_closed)
        share = 1.0 - self.lanes_closed / site.lanes[links]

        def act(_: Traffic, levers: Levers) -> None:
            usual = np.minimum(levers.exit_capacity[links], site.capacity[links])
            claim.write(levers, share * usual)

        name = f"incident on {site.name_links(links)}"
        return [Rule(name, act, (claim,), self.begin, self.end, felt_at=links)]
