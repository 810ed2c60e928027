"""Tolls: fixed, by time of day, or by how full a link is."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from uxsim_geo.control.levers import Levers
from uxsim_geo.control.scheduled import scheduled_rule
from uxsim_geo.control.site import (
    Chosen,
    Claim,
    Rule,
    Site,
    check_density,
    check_interval,
    check_number,
    check_period,
)
from uxsim_geo.control.timetable import Timetable, check_timetable
from uxsim_geo.control.traffic import Traffic
from uxsim_geo.errors import Faults


@dataclass(frozen=True)
class Toll:
    """Each of some links costs an amount on entry, in the currency of the value of time."""

    links: Chosen
    amount: Timetable
    begin: float = 0.0
    end: float = math.inf

    def rules(self, site: Site, faults: Faults) -> list[Rule]:
        """Return the rule that sets the toll."""
        check_period(self.begin, self.end, site.duration, faults)
        links = site.links(self.links, faults)
        if not check_timetable(self.amount, "amount", site.duration, faults):
            return []
        name = f"toll on {site.name_links(links)}"
        return [scheduled_rule(name, Claim("toll", links), self.amount, (self.begin, self.end))]


@dataclass(frozen=True)
class CongestionToll:
    """A toll that rises while a link is fuller than wanted, and falls while it is emptier.

    At each call, for each link by itself, p ← p + g (k − k*), kept within the limits: the toll
    stays where it is once the link is as full as wanted. It begins at the lowest amount.

    target_density
        k*, veh/m of the whole link
    gain
        g, currency per veh/m: how far the toll moves at a call
    min_amount, max_amount
        currency: limits of the toll
    interval
        s between two calls
    """

    links: Chosen
    target_density: float
    gain: float
    max_amount: float
    min_amount: float = 0.0
    interval: float = 300.0
    begin: float = 0.0
    end: float = math.inf

    def rules(self, site: Site, faults: Faults) -> list[Rule]:
        """Return the rule that adjusts the tolls; their state is the toll in force."""
        check_period(self.begin, self.end, site.duration, faults)
        check_interval(self.interval, site, faults)
        check_number(self.gain, "gain", faults, above=0.0)
        check_number(self.min_amount, "min_amount", faults)
        check_number(self.max_amount, "max_amount", faults, above=self.min_amount)
        claim = Claim("toll", site.links(self.links, faults))
        check_density(self.target_density, site, claim.positions, faults)

        def act(traffic: Traffic, levers: Levers) -> None:
            excess = traffic.density[claim.positions] - self.target_density
            toll = np.maximum(levers.toll[claim.positions], self.min_amount) + self.gain * excess
            claim.write(levers, np.clip(toll, self.min_amount, self.max_amount))

        name = f"congestion toll on {site.name_links(claim.positions)}"
        period = (self.begin, self.end)
        return [Rule(name, act, (claim,), *period, self.interval, felt_at=claim.positions)]
