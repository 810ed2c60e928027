"""Keys of measures that hold or let through: signals, meters, capacities, closures, priorities.

Every section makes the measure of the same name in ``uxsim_geo.control``, which knows what values
make sense; here people's units become SI.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from pipeline.config_keys import (
    ChosenLinks,
    Id,
    Ids,
    Period,
    Section,
    TimetableKey,
    scaled,
)
from uxsim_geo.control.capacity import LinkCapacity, NodeCapacity
from uxsim_geo.control.closures import Closure, Incident
from uxsim_geo.control.metering import Feedback, RampMeter
from uxsim_geo.control.perimeter import Perimeter
from uxsim_geo.control.priorities import MergePriority
from uxsim_geo.control.signals import Phase, Signal
from uxsim_geo.control.speed_limits import SpeedLimit
from uxsim_geo.network.units import KMH, PER_HOUR, PER_KM


class PhaseEntry(Section):
    """A part of a cycle in which some links have green."""

    duration_s: float = Field(description="length of the green, s")
    links: Ids = Field(description="link_ids that have green; they end at the node")


class SignalEntry(Period):
    """A signal plan: phases one after the other, again and again."""

    node_id: Id = Field(description="node at which the signal stands")
    phases: tuple[PhaseEntry, ...] = Field(
        strict=False, description="the phases of a cycle, in their order"
    )
    offset_s: float = Field(0.0, description="when a first phase begins, s after the start")
    all_red_s: float = Field(0.0, description="after each phase, when nobody has green, s")

    def measure(self) -> Signal:
        """Return the measure."""
        phases = tuple(Phase(phase.duration_s, phase.links) for phase in self.phases)
        return Signal(self.node_id, phases, self.offset_s, self.all_red_s, self.begin_s, self.end)


class FeedbackEntry(Section):
    """A rate that follows the traffic, by ALINEA: it falls while the road is too full."""

    measured: ChosenLinks = Field(
        description="section: links whose density counts, as a rule just below the ramp"
    )
    target_density_veh_per_km: float = Field(
        description="density that is held, all lanes, veh/km; at capacity or a little below"
    )
    gain: float | None = Field(
        None,
        description="change of the rate at each interval, veh/h for each veh/km off the target; "
        "none: that of ALINEA, which for one lane with a jam density of 200 veh/km is 35",
    )
    min_rate_veh_per_h: float = Field(
        Feedback.min_rate * PER_HOUR, description="lowest rate of each ramp, veh/h"
    )
    max_rate_veh_per_h: float | None = Field(
        None, description="highest rate of each ramp, veh/h; none: its capacity"
    )
    interval_s: float = Field(Feedback.interval, description="between two changes of the rate, s")

    def feedback(self) -> Feedback:
        """Return what the measure is told."""
        highest = self.max_rate_veh_per_h
        return Feedback(
            measured=self.measured.target(),
            target_density=self.target_density_veh_per_km / PER_KM,
            gain=None if self.gain is None else self.gain * PER_KM / PER_HOUR,
            min_rate=self.min_rate_veh_per_h / PER_HOUR,
            max_rate=None if highest is None else highest / PER_HOUR,
            interval=self.interval_s,
        )


class RampMeterEntry(Period, ChosenLinks):
    """Each of some links lets through a rate of vehicles, fixed or by feedback."""

    rate_veh_per_h: TimetableKey | None = Field(
        None, description="rate of each link, veh/h: a number, or pairs [from_s, veh/h]"
    )
    feedback: FeedbackEntry | None = Field(
        None, description="section, in place of a rate: how it follows the traffic"
    )

    def measure(self) -> RampMeter:
        """Return the measure."""
        rate = self.rate_veh_per_h
        in_si = None if rate is None else scaled(rate, 1 / PER_HOUR)
        feedback = None if self.feedback is None else self.feedback.feedback()
        return RampMeter(self.target(), in_si, feedback, self.begin_s, self.end)


class PerimeterEntry(Period):
    """The gates of a region let in a fixed flow, or as much as keeps it from filling up."""

    region: ChosenLinks = Field(description="section: links whose vehicles are counted")
    gates: ChosenLinks | None = Field(
        None, description="section: links that are held; none: those that lead into the region"
    )
    target_vehicles: float | None = Field(
        None, description="vehicles in the region that feedback aims at"
    )
    flow_veh_per_h: TimetableKey | None = Field(
        None,
        description="in place of a target: through all gates together, veh/h: a number, or pairs "
        "[from_s, veh/h]",
    )
    gain: float = Field(
        Perimeter.gain * PER_HOUR,
        description="change of the flow at each interval, veh/h for each vehicle off the target",
    )
    damping: float = Field(
        Perimeter.damping * PER_HOUR,
        description="change of the flow, veh/h less for each vehicle more than at the interval "
        "before",
    )
    min_flow_veh_per_h: float = Field(
        Perimeter.min_flow * PER_HOUR, description="lowest flow of all gates together, veh/h"
    )
    max_flow_veh_per_h: float | None = Field(
        None, description="highest flow of all gates together, veh/h; none: their capacity"
    )
    interval_s: float = Field(Perimeter.interval, description="between two changes of the flow, s")

    def measure(self) -> Perimeter:
        """Return the measure."""
        flow, highest = self.flow_veh_per_h, self.max_flow_veh_per_h
        return Perimeter(
            region=self.region.target(),
            gates=None if self.gates is None else self.gates.target(),
            target_vehicles=self.target_vehicles,
            flow=None if flow is None else scaled(flow, 1 / PER_HOUR),
            gain=self.gain / PER_HOUR,
            damping=self.damping / PER_HOUR,
            min_flow=self.min_flow_veh_per_h / PER_HOUR,
            max_flow=None if highest is None else highest / PER_HOUR,
            interval=self.interval_s,
            begin=self.begin_s,
            end=self.end,
        )


class LinkCapacityEntry(Period, ChosenLinks):
    """Each of some links lets no more vehicles out, or in."""

    exit_veh_per_h: TimetableKey | None = Field(
        None, description="leave each link at most, veh/h: a number, or pairs [from_s, veh/h]"
    )
    entry_veh_per_h: TimetableKey | None = Field(
        None, description="enter each link at most, veh/h: a number, or pairs [from_s, veh/h]"
    )

    def measure(self) -> LinkCapacity:
        """Return the measure."""
        leave, enter = (
            None if rate is None else scaled(rate, 1 / PER_HOUR)
            for rate in (self.exit_veh_per_h, self.entry_veh_per_h)
        )
        return LinkCapacity(self.target(), leave, enter, self.begin_s, self.end)


class NodeCapacityEntry(Period):
    """Each of some nodes lets no more vehicles pass from link to link."""

    nodes: Ids = Field(description="node_ids, as [a, b]")
    capacity_veh_per_h: TimetableKey = Field(
        description="pass each node at most, veh/h: a number, or pairs [from_s, veh/h]"
    )

    def measure(self) -> NodeCapacity:
        """Return the measure."""
        capacity = scaled(self.capacity_veh_per_h, 1 / PER_HOUR)
        return NodeCapacity(self.nodes, capacity, self.begin_s, self.end)


class ClosureEntry(Period, ChosenLinks):
    """Nobody may enter some links, or no driver of some classes."""

    on_link: Literal["clear", "stay"] = Field(
        "clear", description="those who are on the links when they close: clear: leave; stay: wait"
    )
    classes: Ids = Field((), description="of drivers to whom it is closed; empty: to all")

    def measure(self) -> Closure:
        """Return the measure."""
        return Closure(self.target(), self.begin_s, self.end, self.on_link, self.classes)


class IncidentEntry(Period, ChosenLinks):
    """Some lanes of each of some links are blocked, at their ends; the others stay open."""

    lanes_closed: int = Field(description="lanes blocked, at least 1, fewer than the link has")

    def measure(self) -> Incident:
        """Return the measure."""
        return Incident(self.target(), self.lanes_closed, self.begin_s, self.end)


class SpeedLimitEntry(Period, ChosenLinks):
    """Who enters some links drives no faster."""

    speed_kmh: TimetableKey = Field(
        description="limit, km/h: a number, or pairs [from_s, km/h]; free speeds below it stay"
    )

    def measure(self) -> SpeedLimit:
        """Return the measure."""
        return SpeedLimit(self.target(), scaled(self.speed_kmh, 1 / KMH), self.begin_s, self.end)


class MergePriorityEntry(Period, ChosenLinks):
    """Some links have another weight where they compete with others for the same road."""

    priority: TimetableKey = Field(
        description="weight, above 0: a number, or pairs [from_s, weight]; shares of a merge are "
        "as the weights"
    )

    def measure(self) -> MergePriority:
        """Return the measure."""
        return MergePriority(self.target(), self.priority, self.begin_s, self.end)
