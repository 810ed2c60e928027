"""Classes of drivers: what they pay, know, follow and may use."""

from __future__ import annotations

from dataclasses import dataclass

from uxsim_geo.control.site import Target, check_number
from uxsim_geo.control.timetable import NUMBER
from uxsim_geo.errors import Faults

#: of demand that names no class
DEFAULT = "default"


@dataclass(frozen=True)
class DriverClass:
    """Drivers who choose their routes alike. Demand names its class in column ``class``.

    A route costs its time plus toll / value of time plus distance cost / value of time.

    value_of_time
        currency per hour
    distance_cost
        currency per km
    toll_factor
        of every toll, this class pays so much
    informed_share
        of the drivers see the traffic; the others go by free-flow times (and know tolls,
        closures and bans)
    information_interval
        s between two looks at the traffic; None: the route update interval of the settings
    information_delay
        s: how old the traffic is that they see
    compliance
        share that follows advice
    banned
        links that they may not use
    """

    name: str = DEFAULT
    value_of_time: float = 15.0
    distance_cost: float = 0.0
    toll_factor: float = 1.0
    informed_share: float = 1.0
    information_interval: float | None = None
    information_delay: float = 0.0
    compliance: float = 1.0
    banned: Target | tuple[str, ...] = ()

    def add_faults(self, faults: Faults) -> None:
        """Note all values that make no sense."""
        check_number(self.value_of_time, "value_of_time", faults, above=0.0)
        for name in ("distance_cost", "toll_factor", "information_delay"):
            check_number(getattr(self, name), name, faults)
        if self.information_interval is not None:
            check_number(self.information_interval, "information_interval", faults, above=0.0)
        for name in ("informed_share", "compliance"):
            share = getattr(self, name)
            if not isinstance(share, NUMBER) or not 0 <= share <= 1:
                faults.add("must lie between 0 and 1", column=name, value=share)
