"""Priorities at merges."""

from __future__ import annotations

import math
from dataclasses import dataclass

from uxsim_geo.control.scheduled import scheduled_rule
from uxsim_geo.control.site import Chosen, Claim, Rule, Site, check_period
from uxsim_geo.control.timetable import Timetable, check_timetable
from uxsim_geo.errors import Faults


@dataclass(frozen=True)
class MergePriority:
    """Where links compete for the next one, each gets a share as its priority among theirs.

    priority
        weight above 0, of each of the links
    """

    links: Chosen
    priority: Timetable
    begin: float = 0.0
    end: float = math.inf

    def rules(self, site: Site, faults: Faults) -> list[Rule]:
        """Return the rule that sets the priorities."""
        check_period(self.begin, self.end, site.duration, faults)
        links = site.links(self.links, faults)
        if not check_timetable(self.priority, "priority", site.duration, faults, above=0.0):
            return []
        name = f"merge priority of {site.name_links(links)}"
        claim = Claim("merge_priority", links)
        return [scheduled_rule(name, claim, self.priority, (self.begin, self.end))]
