"""Links as scripts handle them: what was added, what may change, how it is now."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from uxsim_geo.errors import Faults
from uxsim_geo.world import values
from uxsim_geo.world.link_state import LinkState
from uxsim_geo.world.nodes import Node
from uxsim_geo.world.values import Pricing

if TYPE_CHECKING:
    from uxsim_geo.world.roads import Roads

#: veh/m of one lane, where a link is given none
JAM_DENSITY = 0.2


class Link(LinkState):
    """A link: one direction of a road."""

    __slots__ = (
        "_capacity_in",
        "_capacity_out",
        "_congestion_pricing",
        "_free_flow_speed",
        "_jam_density_per_lane",
        "_merge_priority",
        "_number_of_lanes",
        "_route_choice_penalty",
        "_signal_group",
        "end_node",
        "length",
        "start_node",
    )

    FIXED = LinkState.FIXED | {"end_node", "length", "start_node"}
    INSTEAD = MappingProxyType(
        {
            "kappa": "jam_density",
            "q_star": "capacity",
            "traveltime_actual": "actual_travel_time(t)",
            "traveltime_instant": "instant_travel_time()",
            "u": "free_flow_speed",
            "vehicles": "num_vehicles counts those on it; W.VEHICLES_RUNNING has all",
        }
    )

    def __init__(self, world: Roads, name: str, number: int, told: dict[str, Any]) -> None:
        super().__init__(world, name, number, told)
        faults = self._faults()
        self.start_node: Node = told["start_node"]
        self.end_node: Node = told["end_node"]
        self.length = values.number(faults, "length", told["length"], above=0.0)
        speed, priority = told["free_flow_speed"], told["merge_priority"]
        self._free_flow_speed = values.number(faults, "free_flow_speed", speed, above=0.0)
        self._merge_priority = values.number(faults, "merge_priority", priority, above=0.0)
        self._number_of_lanes = values.lanes(faults, told["number_of_lanes"])
        self._jam_density_per_lane = values.jam_density_per_lane(
            faults,
            told["jam_density"],
            told["jam_density_per_lane"],
            self._number_of_lanes,
            JAM_DENSITY,
        )
        self._signal_group = values.signal_group(faults, told["signal_group"])
        self._capacity_out = values.capacity(faults, "capacity_out", told["capacity_out"])
        self._capacity_in = values.capacity(faults, "capacity_in", told["capacity_in"])
        self._congestion_pricing = values.pricing(faults, told["congestion_pricing"])
        self._route_choice_penalty = 0.0
        faults.raise_if_any()

    @property
    def capacity(self) -> float:
        """Capacity Q of the whole link, with its present speed and lanes, veh/s."""
        from uxsim_geo.network.diagram import diagram_capacity
        from uxsim_geo.world.scenario import links_table

        return float(diagram_capacity(links_table([self]), self.W.REACTION_TIME)[0])

    @property
    def jam_density(self) -> float:
        """Jam density κ over all lanes together, veh/m."""
        return self._jam_density_per_lane * self._number_of_lanes

    @jam_density.setter
    def jam_density(self, value: float) -> None:
        self._must_not_run("jam_density")
        faults = self._faults()
        found = values.number(faults, "jam_density", value, above=0.0)
        faults.raise_if_any()
        self._jam_density_per_lane = found / self._number_of_lanes

    @property
    def jam_density_per_lane(self) -> float:
        """Jam density κ of one lane, veh/m."""
        return self._jam_density_per_lane

    @jam_density_per_lane.setter
    def jam_density_per_lane(self, value: float) -> None:
        self._must_not_run("jam_density_per_lane")
        faults = self._faults()
        found = values.number(faults, "jam_density_per_lane", value, above=0.0)
        faults.raise_if_any()
        self._jam_density_per_lane = found

    @property
    def signal_group(self) -> tuple[int, ...]:
        """The phases of the signal at the end in which this link has green."""
        return self._signal_group

    @signal_group.setter
    def signal_group(self, value: Any) -> None:
        self._must_not_run("signal_group")
        faults = self._faults()
        found = values.signal_group(faults, value)
        faults.raise_if_any()
        self._signal_group = found

    @property
    def free_flow_speed(self) -> float:
        """Free speed u, m/s; set during a run, it holds for those who enter from then on."""
        return self._free_flow_speed

    @free_flow_speed.setter
    def free_flow_speed(self, value: float) -> None:
        faults = self._faults()
        found = values.number(faults, "free_flow_speed", value, above=0.0)
        if self._run is not None and found > (built := self._run.speed_built(self)):
            what = f"cannot be above that the link was built for, {built:g} m/s, during a run"
            faults.add(what, column="free_flow_speed", value=value)
        self._set("_free_flow_speed", found, faults)

    @property
    def number_of_lanes(self) -> int:
        """Lanes; during a run some may be closed, which takes their share of the capacity."""
        return self._number_of_lanes

    @number_of_lanes.setter
    def number_of_lanes(self, value: int) -> None:
        faults = self._faults()
        found = values.lanes(faults, value)
        if self._run is not None and found > (built := self._run.lanes_built(self)):
            what = f"cannot be more than the link was built with, {built}, during a run"
            faults.add(what, column="number_of_lanes", value=value)
        self._set("_number_of_lanes", found, faults)

    @property
    def merge_priority(self) -> float:
        """Weight of this link where it competes with others for an out-link."""
        return self._merge_priority

    @merge_priority.setter
    def merge_priority(self, value: float) -> None:
        faults = self._faults()
        found = values.number(faults, "merge_priority", value, above=0.0)
        self._set("_merge_priority", found, faults)

    @property
    def capacity_out(self) -> float | None:
        """What may leave the link, veh/s; None: as much as its own capacity."""
        return self._capacity_out

    @capacity_out.setter
    def capacity_out(self, value: float | None) -> None:
        faults = self._faults()
        self._set("_capacity_out", values.capacity(faults, "capacity_out", value), faults)

    @property
    def capacity_in(self) -> float | None:
        """What may enter the link, veh/s; None: as much as its own capacity."""
        return self._capacity_in

    @capacity_in.setter
    def capacity_in(self, value: float | None) -> None:
        faults = self._faults()
        self._set("_capacity_in", values.capacity(faults, "capacity_in", value), faults)

    @property
    def congestion_pricing(self) -> Pricing | None:
        """Toll as a function of the time in s, in s of travel time; None: no toll."""
        return self._congestion_pricing

    @congestion_pricing.setter
    def congestion_pricing(self, value: Pricing | None) -> None:
        faults = self._faults()
        self._set("_congestion_pricing", values.pricing(faults, value), faults)

    @property
    def route_choice_penalty(self) -> float:
        """Toll at all times, s of travel time; without effect where there is congestion_pricing."""
        return self._route_choice_penalty

    @route_choice_penalty.setter
    def route_choice_penalty(self, value: float) -> None:
        faults = self._faults()
        found = values.number(faults, "route_choice_penalty", value)
        self._set("_route_choice_penalty", found, faults)

    def change_free_flow_speed(self, new_value: float) -> None:
        """Set :attr:`free_flow_speed`."""
        self.free_flow_speed = new_value

    def change_jam_density(self, new_value: float) -> None:
        """Set :attr:`jam_density`."""
        self.jam_density = new_value

    def get_toll(self, t: float) -> float:
        """Return the toll at a time, s of travel time; raises InputError where it is no toll."""
        if self._congestion_pricing is None:
            return self._route_choice_penalty
        faults = self._faults()
        found = values.number(faults, f"congestion_pricing({t:g})", self._congestion_pricing(t))
        faults.raise_if_any()
        return found

    def _set(self, name: str, value: object, faults: Faults) -> None:
        faults.raise_if_any()
        object.__setattr__(self, name, value)
        if self._run is not None:
            self._run.write_link(self)
