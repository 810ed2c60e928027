"""Capacities of links and nodes that are lower for a time, or by time of day."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from uxsim_geo.control.scheduled import check_binds, scheduled_rule
from uxsim_geo.control.site import Chosen, Claim, Rule, Site, as_ids, check_period
from uxsim_geo.control.timetable import Timetable, check_timetable
from uxsim_geo.errors import Faults


@dataclass(frozen=True)
class LinkCapacity:
    """No more than so many vehicles may leave, or enter, each of some links.

    exit, entry
        veh/s of the whole link; one of them, or both. None: as without control
    """

    links: Chosen
    exit: Timetable | None = None
    entry: Timetable | None = None
    begin: float = 0.0
    end: float = math.inf

    def rules(self, site: Site, faults: Faults) -> list[Rule]:
        """Return a rule for each end of the links that is told a capacity."""
        check_period(self.begin, self.end, site.duration, faults)
        links = site.links(self.links, faults)
        if self.exit is None and self.entry is None:
            faults.add("give exit, entry or both, in veh/s", column="exit")
        rules = []
        for side, capacity in (("exit", self.exit), ("entry", self.entry)):
            if capacity is not None and check_timetable(capacity, side, site.duration, faults):
                check_binds(capacity, side, site.capacity[links], "veh/s", faults)
                name = f"{side} capacity of {site.name_links(links)}"
                claim = Claim(f"{side}_capacity", links)
                rules.append(scheduled_rule(name, claim, capacity, (self.begin, self.end)))
        return rules


@dataclass(frozen=True)
class NodeCapacity:
    """No more than so many vehicles may pass each of some nodes: a signal without its phases.

    Trips that begin or end at the node do not count.

    capacity
        veh/s from link to link, all links together
    """

    nodes: Sequence[str]
    capacity: Timetable
    begin: float = 0.0
    end: float = math.inf

    def rules(self, site: Site, faults: Faults) -> list[Rule]:
        """Return the rule, felt on all links that end at the nodes."""
        check_period(self.begin, self.end, site.duration, faults)
        if not self.nodes:
            faults.add("no node of the network is meant", column="nodes")
        found = [site.node(node_id, faults, key="nodes") for node_id in as_ids(self.nodes)]
        nodes = np.concatenate([np.empty(0, np.int64), *found])
        if not check_timetable(self.capacity, "capacity", site.duration, faults):
            return []
        arriving = np.bincount(site.to_node, site.capacity, minlength=len(site.node_ids))
        check_binds(self.capacity, "capacity", arriving[nodes], "veh/s", faults)
        name = f"capacity of {site.name_nodes(nodes)}"
        claim = Claim("node_capacity", nodes)
        rule = scheduled_rule(name, claim, self.capacity, (self.begin, self.end))
        return [replace(rule, felt_at=np.flatnonzero(np.isin(site.to_node, nodes)))]
