"""Control by a function of the user's own."""

from __future__ import annotations

import math
from dataclasses import dataclass

from uxsim_geo.control.site import Act, Rule, Site, check_interval, check_period
from uxsim_geo.errors import Faults


@dataclass(frozen=True)
class OwnControl:
    """A function that sees the traffic and sets the levers, at every interval.

    It claims nothing beforehand, so what it sets stays set when it ends, and no conflict with
    other measures is found before the run.

    function
        called with (:class:`uxsim_geo.control.traffic.Traffic`,
        :class:`uxsim_geo.control.levers.Levers`); what it returns is not looked at
    interval
        s between two calls
    """

    function: Act
    interval: float = 60.0
    begin: float = 0.0
    end: float = math.inf

    def rules(self, site: Site, faults: Faults) -> list[Rule]:
        """Return the rule that calls the function."""
        check_period(self.begin, self.end, site.duration, faults)
        check_interval(self.interval, site, faults)
        if not callable(self.function):
            what = "must be a function of traffic and levers"
            faults.add(what, column="function", value=self.function)
        own = getattr(self.function, "__name__", type(self.function).__name__)
        name = f"own control {own}"
        return [Rule(name, self.function, (), self.begin, self.end, self.interval)]
