"""Speed limits, fixed or by time of day."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from uxsim_geo.control.scheduled import check_binds, scheduled_rule
from uxsim_geo.control.site import Chosen, Claim, Floats, Rule, Site, check_period
from uxsim_geo.control.timetable import Timetable, check_timetable
from uxsim_geo.errors import Faults


@dataclass(frozen=True)
class SpeedLimit:
    """Those who enter some links drive no faster than a limit, in m/s, nor than the free speed."""

    links: Chosen
    speed: Timetable
    begin: float = 0.0
    end: float = math.inf

    def rules(self, site: Site, faults: Faults) -> list[Rule]:
        """Return the rule that sets the limit."""
        check_period(self.begin, self.end, site.duration, faults)
        links = site.links(self.links, faults)
        if not check_timetable(self.speed, "speed", site.duration, faults, above=0.0):
            return []
        free = site.free_speed[links]
        check_binds(self.speed, "speed", free, "m/s", faults)

        def no_faster(limit: float) -> Floats:
            return np.minimum(free, limit)

        name = f"speed limit on {site.name_links(links)}"
        claim = Claim("speed_limit", links)
        return [scheduled_rule(name, claim, self.speed, (self.begin, self.end), no_faster)]
