"""Perimeter control: how many vehicles may come into a region."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from uxsim_geo.control.levers import Levers
from uxsim_geo.control.scheduled import check_binds, scheduled_rule
from uxsim_geo.control.site import (
    Chosen,
    Claim,
    Floats,
    Ints,
    Rule,
    Site,
    check_interval,
    check_number,
    check_period,
)
from uxsim_geo.control.timetable import Timetable, check_timetable
from uxsim_geo.control.traffic import Traffic
from uxsim_geo.errors import Faults


@dataclass(frozen=True)
class Perimeter:
    """The gates of a region let in a fixed flow, or as much as keeps it from filling up.

    At each call, with n vehicles in the region, n' of them at the call before,
    F ← F − D (n − n') + K (n* − n), kept within limits; it begins at the highest. This is the
    gating law of Keyvan-Ekbatani, Kouvelas, Papamichail and Papageorgiou: Exploiting the
    fundamental diagram of urban networks for feedback-based gating, Transportation Research B 46
    (2012). The flow is shared among the gates by their capacity. Trips that begin inside are not
    held, and a gate holds all who leave it, be their goal inside or not.

    region
        links whose vehicles are counted; gates among them are not
    gates
        None: the links outside of the region that end where one of its links begins
    target_vehicles
        n*, vehicles in the region; a little below the number at which most trips are completed
    flow
        veh/s through all gates together, instead of a target
    gain, damping
        K and D, 1/s. A region that is held fills and empties by what its gates do, so that
        without damping it would swing for ever; with the values given here the error falls to a
        tenth in twelve calls, if they are 60 s apart
    min_flow, max_flow
        veh/s through all gates together; no more than their capacity, which is what None means
    interval
        s between two calls
    """

    region: Chosen
    gates: Chosen | None = None
    target_vehicles: float | None = None
    flow: Timetable | None = None
    gain: float = 5.0 / 3600.0
    damping: float = 20.0 / 3600.0
    min_flow: float = 0.0
    max_flow: float | None = None
    interval: float = 60.0
    begin: float = 0.0
    end: float = math.inf

    def rules(self, site: Site, faults: Faults) -> list[Rule]:
        """Return the rule that sets the exit capacity of the gates."""
        check_period(self.begin, self.end, site.duration, faults)
        region = site.links(self.region, faults, key="region")
        gates = self._gates(site, region, faults)
        inside = np.setdiff1d(region, gates)
        if region.size and not inside.size:
            faults.add("all its links are gates", column="region", value=str(self.region))
        if (self.target_vehicles is None) == (self.flow is None):
            what = "give either target_vehicles or flow"
            faults.add(what, column="target_vehicles", value=self.target_vehicles)
        elif self.flow is not None:
            return self._fixed_rules(self.flow, gates, site, faults)
        else:
            self._check(inside, gates, site, faults)
            return [self._feedback_rule(inside, gates, site)]
        return []

    def _gates(self, site: Site, region: Ints, faults: Faults) -> Ints:
        if self.gates is not None:
            return site.links(self.gates, faults, key="gates")
        leads_in = np.isin(site.to_node, site.from_node[region])
        leads_in[region] = False
        gates = np.flatnonzero(leads_in)
        if region.size and not gates.size:
            faults.add("no link leads into the region from outside; name them", column="gates")
        return gates

    def _fixed_rules(self, flow: Timetable, gates: Ints, site: Site, faults: Faults) -> list[Rule]:
        if not check_timetable(flow, "flow", site.duration, faults):
            return []
        if gates.size:
            check_binds(flow, "flow", site.capacity[gates].sum(keepdims=True), "veh/s", faults)
        share = _shares(site, gates)
        claim = Claim("exit_capacity", gates)
        name = f"perimeter with {site.name_links(gates)} as gates"
        period = (self.begin, self.end)
        return [scheduled_rule(name, claim, flow, period, lambda total: total * share)]

    def _feedback_rule(self, inside: Ints, gates: Ints, site: Site) -> Rule:
        share = _shares(site, gates)
        most = float(site.capacity[gates].sum())
        if self.max_flow is not None:
            most = min(most, self.max_flow)
        target = 0.0 if self.target_vehicles is None else self.target_vehicles
        claim = Claim("exit_capacity", gates)

        def act(traffic: Traffic, levers: Levers) -> None:
            missing = target - traffic.count[inside].sum()
            change = (traffic.inflow - traffic.outflow)[inside].sum() * traffic.elapsed
            flow = min(levers.exit_capacity[gates].sum(), most)
            flow += self.gain * missing - self.damping * change
            claim.write(levers, np.clip(flow, self.min_flow, most) * share)

        name = f"perimeter with {site.name_links(gates)} as gates"
        return Rule(name, act, (claim,), self.begin, self.end, self.interval, felt_at=gates)

    def _check(self, inside: Ints, gates: Ints, site: Site, faults: Faults) -> None:
        check_interval(self.interval, site, faults)
        check_number(self.target_vehicles, "target_vehicles", faults, above=0.0)
        room = float((site.lanes * site.jam_density * site.length)[inside].sum())
        if inside.size and self.target_vehicles is not None and self.target_vehicles >= room:
            what = f"must be below what the region can hold, {room:g} vehicles"
            faults.add(what, column="target_vehicles", value=self.target_vehicles)
        check_number(self.gain, "gain", faults, above=0.0)
        check_number(self.damping, "damping", faults)
        check_number(self.min_flow, "min_flow", faults)
        if self.max_flow is not None:
            check_number(self.max_flow, "max_flow", faults, above=self.min_flow)
        elif gates.size and self.min_flow > site.capacity[gates].sum():
            what = f"is above the capacity of the gates, {site.capacity[gates].sum():g} veh/s"
            faults.add(what, column="min_flow", value=self.min_flow)


def _shares(site: Site, gates: Ints) -> Floats:
    capacity = site.capacity[gates]
    share: Floats = capacity / max(float(capacity.sum()), 1e-9)
    return share
