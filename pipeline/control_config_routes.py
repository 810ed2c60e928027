"""Keys of what steers route choice: tolls, advice, enforced routes, and classes of drivers.

Every section makes the measure of the same name in ``uxsim_geo.control``, which knows what values
make sense; here people's units become SI.
"""

from __future__ import annotations

from pydantic import Field

from pipeline.config_keys import ChosenLinks, Id, Ids, Period, Section, TimetableKey
from uxsim_geo.control.drivers import DriverClass
from uxsim_geo.control.guidance import Advice, EnforcedRoute
from uxsim_geo.control.tolls import CongestionToll, Toll
from uxsim_geo.network.units import PER_KM


class TollEntry(Period, ChosenLinks):
    """Each of some links costs an amount on entry."""

    amount: TimetableKey = Field(
        description="currency of the value of time: a number, or pairs [from_s, amount]"
    )

    def measure(self) -> Toll:
        """Return the measure."""
        return Toll(self.target(), self.amount, self.begin_s, self.end)


class CongestionTollEntry(Period, ChosenLinks):
    """A toll that rises while a link is fuller than wanted, and falls while it is emptier."""

    target_density_veh_per_km: float = Field(
        description="density of each link that is aimed at, all lanes, veh/km"
    )
    gain: float = Field(
        description="change of the toll at each interval, currency for each veh/km off the target"
    )
    max_amount: float = Field(description="highest toll, currency")
    min_amount: float = Field(CongestionToll.min_amount, description="lowest toll, currency")
    interval_s: float = Field(
        CongestionToll.interval, description="between two changes of the toll, s"
    )

    def measure(self) -> CongestionToll:
        """Return the measure."""
        return CongestionToll(
            links=self.target(),
            target_density=self.target_density_veh_per_km / PER_KM,
            gain=self.gain * PER_KM,
            max_amount=self.max_amount,
            min_amount=self.min_amount,
            interval=self.interval_s,
            begin=self.begin_s,
            end=self.end,
        )


class AdviceEntry(Period, ChosenLinks):
    """To those who follow advice, some links count as if they took longer, or less long."""

    seconds: TimetableKey = Field(
        description="added to the time of each link, s: above 0 to avoid it, below 0 to prefer it; "
        "a number, or pairs [from_s, seconds]"
    )
    classes: Ids = Field((), description="of drivers who are advised; empty: all")

    def measure(self) -> Advice:
        """Return the measure."""
        return Advice(self.target(), self.seconds, self.classes, self.begin_s, self.end)


class EnforcedRouteEntry(Period):
    """Drivers between two nodes who leave home in a period take a given route."""

    origin: Id = Field(description="node_id")
    destination: Id = Field(description="node_id")
    links: Ids = Field(description="link_ids of the whole route, in the order of driving")
    share: float = Field(EnforcedRoute.share, description="of these drivers, above 0 and up to 1")
    classes: Ids = Field((), description="of drivers who take it; empty: all")

    def measure(self) -> EnforcedRoute:
        """Return the measure."""
        return EnforcedRoute(
            self.origin,
            self.destination,
            self.links,
            self.share,
            self.classes,
            self.begin_s,
            self.end,
        )


class ClassEntry(Section):
    """Drivers who choose their routes alike; ``ingest.trips`` names their class."""

    name: Id = Field(description="of the class; default: that of trips that name none")
    value_of_time_per_h: float = Field(
        DriverClass.value_of_time, description="what an hour is worth to them, currency"
    )
    distance_cost_per_km: float = Field(
        DriverClass.distance_cost, description="what a kilometre costs them, currency"
    )
    toll_factor: float = Field(
        DriverClass.toll_factor, description="of every toll they pay so much; 0: nothing"
    )
    informed_share: float = Field(
        DriverClass.informed_share,
        description="of them see the traffic, 0 to 1; the others go by free-flow times",
    )
    information_interval_s: float | None = Field(
        None, description="between two looks at the traffic, s; none: route_update_interval_s"
    )
    information_delay_s: float = Field(
        DriverClass.information_delay, description="how old the traffic is that they see, s"
    )
    compliance: float = Field(DriverClass.compliance, description="of them follow advice, 0 to 1")
    banned: ChosenLinks | None = Field(None, description="section: links that they may not use")

    def driver_class(self) -> DriverClass:
        """Return what the engine is told."""
        return DriverClass(
            name=self.name,
            value_of_time=self.value_of_time_per_h,
            distance_cost=self.distance_cost_per_km,
            toll_factor=self.toll_factor,
            informed_share=self.informed_share,
            information_interval=self.information_interval_s,
            information_delay=self.information_delay_s,
            compliance=self.compliance,
            banned=() if self.banned is None else self.banned.target(),
        )
