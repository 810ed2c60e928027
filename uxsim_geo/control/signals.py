"""Traffic signals: which in-links of a node may be left when."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from uxsim_geo.control.levers import Levers
from uxsim_geo.control.site import Claim, Ints, Rule, Site, as_ids, check_number, check_period
from uxsim_geo.control.traffic import Traffic
from uxsim_geo.errors import Faults


@dataclass(frozen=True)
class Phase:
    """A part of a cycle: ``duration`` s in which the ``links`` (link_id) have green."""

    duration: float
    links: tuple[str, ...]


@dataclass(frozen=True)
class Signal:
    """A signal plan: a fixed cycle at a node, from ``begin`` to ``end``.

    The phases follow one another, each exactly as long as it says and then ``all_red`` s in which
    nobody has green; the first cycle begins at ``offset`` s, and those before it by repetition.
    In-links of the node that no phase names are not held by the signal, nor are trips that end at
    the node. A node may have several plans, one after the other.
    """

    node_id: str
    phases: tuple[Phase, ...]
    offset: float = 0.0
    all_red: float = 0.0
    begin: float = 0.0
    end: float = math.inf

    @property
    def cycle(self) -> float:
        """Time until the first phase comes again, s."""
        return sum(phase.duration + self.all_red for phase in self.phases)

    def greens(self) -> dict[str, list[tuple[float, float]]]:
        """When each link has green, s after the cycle begins; phases that meet are joined."""
        greens: dict[str, list[tuple[float, float]]] = {}
        begin = 0.0
        for phase in self.phases:
            end = begin + phase.duration
            for link_id in as_ids(phase.links):
                own = greens.setdefault(link_id, [])
                if own and own[-1][1] == begin:
                    own[-1] = (own[-1][0], end)
                else:
                    own.append((begin, end))
            begin = end + self.all_red
        return greens

    def reds(self, link_id: str, until: float) -> list[tuple[float, float]]:
        """When a link has red while this plan is in force, s after the start, up to ``until``.

        Empty for a link that no phase names: this signal does not hold it.
        """
        greens = self.greens().get(link_id, [])
        begin, end = max(self.begin, 0.0), min(self.end, until)
        if not greens or not begin < end:
            return []
        reds, red_from = [], begin
        first = math.floor((begin - self.offset) / self.cycle)
        for number in range(first, math.ceil((end - self.offset) / self.cycle) + 1):
            start = self.offset + number * self.cycle
            for green, over in greens:
                if start + green > red_from:
                    reds.append((red_from, min(start + green, end)))
                red_from = max(red_from, start + over)
        reds.append((red_from, end))
        return [(since, to) for since, to in reds if since < to]

    def rules(self, site: Site, faults: Faults) -> list[Rule]:
        """Return the rule that puts this plan in force."""
        node = site.node(self.node_id, faults)
        self._check_times(faults)
        check_period(self.begin, self.end, site.duration, faults)
        links = self._links(site, faults)
        number = len(site.plans)
        site.plans.append(self)

        def act(_: Traffic, levers: Levers) -> None:
            levers.plan[node] = number

        claims = (Claim("plan", node),)
        name = f"signal at node {self.node_id}"
        return [Rule(name, act, claims, self.begin, self.end, felt_at=links)]

    def _check_times(self, faults: Faults) -> None:
        for phase in self.phases:
            if not 0 < phase.duration < math.inf:
                what = "a phase must last a finite time above 0 s"
                faults.add(what, column="duration", value=phase.duration)
        check_number(self.all_red, "all_red", faults)
        if not math.isfinite(self.offset):
            faults.add("must be a finite time", column="offset", value=self.offset)

    def _links(self, site: Site, faults: Faults) -> Ints:
        """Return the positions of the links that have green at times."""
        if not self.phases:
            faults.add("a signal needs at least one phase", column="phases")
            return np.empty(0, np.int64)
        for number, phase in enumerate(self.phases, start=1):
            ids = as_ids(phase.links)
            for link_id in dict.fromkeys(one for one in ids if ids.count(one) > 1):
                what = f"stands twice in phase {number}"
                faults.add(what, column="phases", value=link_id)
        named = tuple(self.greens())
        if not named:
            faults.add("no phase names a link, so nothing is held", column="phases")
            return np.empty(0, np.int64)
        site.links(named, faults, key="phases")
        for link_id in named:
            self._check_end(link_id, site, faults)
        known = [site.link_position[one] for one in named if one in site.link_position]
        return np.array(sorted(known), np.int64)

    def _check_end(self, link_id: str, site: Site, faults: Faults) -> None:
        if link_id not in site.link_position or self.node_id not in site.node_position:
            return
        end = site.node_ids[site.to_node[site.link_position[link_id]]]
        if end != self.node_id:
            what = f"the link ends at node {end}, not at {self.node_id}"
            faults.add(what, column="phases", value=link_id)
