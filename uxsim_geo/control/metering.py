"""Ramp metering: how many vehicles an hour a ramp lets through."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from uxsim_geo.control.levers import Levers
from uxsim_geo.control.scheduled import check_binds, scheduled_rule
from uxsim_geo.control.site import (
    Act,
    Chosen,
    Claim,
    Floats,
    Ints,
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

#: K_R of ALINEA: 70 veh/h for each per cent of occupancy, as veh/s for an occupancy of 1
ALINEA_GAIN = 70.0 / 3600.0 * 100.0


@dataclass(frozen=True)
class Feedback:
    """What ALINEA steers by: r ← r + K (k* − k), kept within limits (Papageorgiou et al. 1991).

    The rate stays where it is once the road is as full as wanted. It begins at the highest.
    Papageorgiou, Hadj-Salem and Blosseville: ALINEA: a local feedback control law for on-ramp
    metering, Transportation Research Record 1320.

    measured
        links on which the density k is taken: vehicles over length of them all. A short piece
        below the merge stands for the detector; a long one answers late
    target_density
        k*, veh/m of the whole link; at or a little below that of capacity, Q / u
    gain
        K, veh/s for each veh/m. None: ALINEA's 70 veh/h for each per cent of occupancy, where
        100 % is the jam density of the whole link: 1.94 / (lanes · κ), which is 9.7 m/s for one
        lane of 0.2 veh/m
    min_rate, max_rate
        veh/s of each metered link; no more than its capacity, which is also what None means
    interval
        s between two calls
    """

    measured: Chosen
    target_density: float
    gain: float | None = None
    min_rate: float = 0.05
    max_rate: float | None = None
    interval: float = 60.0

    def bind(self, claim: Claim, site: Site, faults: Faults) -> Act:
        """Return the function that adjusts the claimed rates; their state is the rate in force."""
        measured = site.links(self.measured, faults, key="measured")
        most = site.capacity[claim.positions]
        if self.max_rate is not None:
            most = np.minimum(most, self.max_rate)
        self._check(site, measured, most, faults)
        length = site.length[measured].sum()
        room = (site.lanes * site.jam_density * site.length)[measured].sum()  # vehicles
        gain = self.gain if self.gain is not None else ALINEA_GAIN * length / max(room, 1e-9)

        def act(traffic: Traffic, levers: Levers) -> None:
            missing = self.target_density - traffic.count[measured].sum() / length
            rate = np.minimum(levers.exit_capacity[claim.positions], most) + gain * missing
            claim.write(levers, np.clip(rate, self.min_rate, most))

        return act

    def _check(self, site: Site, measured: Ints, most: Floats, faults: Faults) -> None:
        check_interval(self.interval, site, faults)
        check_density(self.target_density, site, measured, faults)
        if self.gain is not None:
            check_number(self.gain, "gain", faults, above=0.0)
        check_number(self.min_rate, "min_rate", faults)
        if self.max_rate is not None:
            check_number(self.max_rate, "max_rate", faults, above=self.min_rate)
        elif np.any(most < self.min_rate):
            what = f"is above the capacity of a metered link, {most.min():g} veh/s"
            faults.add(what, column="min_rate", value=self.min_rate)


@dataclass(frozen=True)
class RampMeter:
    """Some links, ramps as a rule, let no more than a rate of vehicles through, each by itself.

    rate
        veh/s of each link
    feedback
        instead of a rate: how it follows the traffic
    """

    links: Chosen
    rate: Timetable | None = None
    feedback: Feedback | None = None
    begin: float = 0.0
    end: float = math.inf

    def rules(self, site: Site, faults: Faults) -> list[Rule]:
        """Return the rule that sets the exit capacity of the links."""
        check_period(self.begin, self.end, site.duration, faults)
        claim = Claim("exit_capacity", site.links(self.links, faults))
        name = f"ramp meter on {site.name_links(claim.positions)}"
        if (self.rate is None) == (self.feedback is None):
            faults.add("give either rate or feedback", column="rate", value=self.rate)
        elif self.feedback is not None:
            act = self.feedback.bind(claim, site, faults)
            interval, links = self.feedback.interval, claim.positions
            return [Rule(name, act, (claim,), self.begin, self.end, interval, felt_at=links)]
        elif self.rate is not None and check_timetable(self.rate, "rate", site.duration, faults):
            check_binds(self.rate, "rate", site.capacity[claim.positions], "veh/s", faults)
            return [scheduled_rule(name, claim, self.rate, (self.begin, self.end))]
        return []
