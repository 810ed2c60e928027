"""Nodes as scripts handle them: where links meet, trips begin and end, and signals stand."""

from __future__ import annotations

import math
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from uxsim_geo.errors import Faults
from uxsim_geo.world import values
from uxsim_geo.world.elements import Element
from uxsim_geo.world.signal_clock import SignalClock

if TYPE_CHECKING:
    from uxsim_geo.world.links import Link
    from uxsim_geo.world.roads import Roads


class Node(Element):
    """A node: where links meet, trips begin and end, and signals stand."""

    __slots__ = ("_clock", "_flow_capacity", "inlinks", "outlinks", "x", "y")

    FIXED = Element.FIXED | {"inlinks", "outlinks", "x", "y"}
    INSTEAD = MappingProxyType(
        {
            "generation_queue": "num_vehicles_waiting counts those who wait to enter the network",
            "incoming_vehicles": "num_vehicles_queue of its inlinks counts who stands before it",
            "signal_intervals": "signal holds the durations of the phases",
        }
    )

    def __init__(self, world: Roads, name: str, number: int, told: dict[str, Any]) -> None:
        super().__init__(world, name, number, told)
        faults = self._faults()
        self.x = values.number(faults, "x", told["x"], least=-math.inf)
        self.y = values.number(faults, "y", told["y"], least=-math.inf)
        self.inlinks: dict[str, Link] = {}
        self.outlinks: dict[str, Link] = {}
        self._clock: SignalClock | None = None
        self._flow_capacity = values.capacity(faults, "flow_capacity", told["flow_capacity"])
        durations = values.signal(faults, told["signal"])
        offset = values.number(faults, "signal_offset", told["signal_offset"], least=-math.inf)
        if told["signal_offset_old"] is not None:
            before = told["signal_offset_old"]
            offset = sum(durations) - values.number(faults, "signal_offset_old", before)
        faults.raise_if_any()
        if durations:
            self._clock = SignalClock(durations, offset)

    def __getstate__(self) -> dict[str, Any]:
        # links lead from node to node for ever: the world ties them to their nodes again
        names = {name for kind in type(self).__mro__ for name in getattr(kind, "__slots__", ())}
        return {name: getattr(self, name) for name in sorted(names - {"inlinks", "outlinks"})}

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, value in state.items():
            setattr(self, name, value)

    @property
    def signal(self) -> tuple[float, ...]:
        """Durations of the phases, s; ``(0,)`` where there is no signal.

        While the simulation runs another list may be set, of as many phases: the present phase
        goes on for the rest of its new duration.
        """
        return self._clock.durations if self._clock else (0,)

    @signal.setter
    def signal(self, value: Any) -> None:
        faults = self._faults()
        durations = values.signal(faults, value)
        phases = len(self._clock.durations) if self._clock else 0
        if self._run is not None and len(durations) != phases:
            what = "needs as many phases as before once the scenario is final"
            faults.add(what, column="signal", value=list(durations) or [0])
        faults.raise_if_any()
        if not durations:
            self._clock = None
        elif self._clock is None:
            self._clock = SignalClock(durations, 0.0)
        elif self._run is None:
            self._clock.durations = durations
        else:
            phase, elapsed = self._clock.at(self.W.TIME)
            self._clock.durations = durations
            self._move_clock(phase, min(elapsed, durations[phase]))

    @property
    def signal_offset(self) -> float:
        """Time at which the first cycle begins, s."""
        return self._clock.start if self._clock else 0.0

    @signal_offset.setter
    def signal_offset(self, value: float) -> None:
        faults = self._faults()
        offset = values.number(faults, "signal_offset", value, least=-math.inf)
        clock = self._clock_of(faults, "signal_offset")
        clock.start = offset
        if self._run is not None:
            self._run.follow_clock(self)

    @property
    def signal_phase(self) -> int:
        """The phase now, counted from 0. Setting it begins that phase; the cycle goes on then."""
        return self._clock.at(self.W.TIME)[0] if self._clock else 0

    @signal_phase.setter
    def signal_phase(self, value: int) -> None:
        faults = self._faults()
        clock = self._clock_of(faults, "signal_phase")
        if int(value) != value or not 0 <= value < len(clock.durations):
            what = f"must be a phase from 0 to {len(clock.durations) - 1}"
            faults.add(what, column="signal_phase", value=value)
        faults.raise_if_any()
        self._move_clock(int(value), 0.0)

    @property
    def signal_t(self) -> float:
        """For how many seconds the present phase has lasted."""
        return self._clock.at(self.W.TIME)[1] if self._clock else 0.0

    @signal_t.setter
    def signal_t(self, value: float) -> None:
        faults = self._faults()
        clock = self._clock_of(faults, "signal_t")
        elapsed = values.number(faults, "signal_t", value)
        phase, _ = clock.at(self.W.TIME)
        if elapsed >= clock.durations[phase]:
            what = f"must be less than the phase lasts, {clock.durations[phase]:g} s"
            faults.add(what, column="signal_t", value=value)
        faults.raise_if_any()
        self._move_clock(phase, elapsed)

    @property
    def next_phase_change(self) -> float:
        """Time at which the present phase ends, s; inf where there is no signal."""
        return self._clock.next_change(self.W.TIME) if self._clock else math.inf

    @property
    def cycle_length(self) -> float:
        """Time until the first phase comes again, s; 0 where there is no signal."""
        return self._clock.cycle if self._clock else 0.0

    @property
    def flow_capacity(self) -> float | None:
        """What may pass from link to link over the node, veh/s; None: no limit."""
        return self._flow_capacity

    @flow_capacity.setter
    def flow_capacity(self, value: float | None) -> None:
        faults = self._faults()
        found = values.capacity(faults, "flow_capacity", value)
        faults.raise_if_any()
        self._flow_capacity = found
        if self._run is not None:
            self._run.write_node(self)

    @property
    def num_vehicles_waiting(self) -> int:
        """Vehicles that have left home here and wait to enter the network."""
        return 0 if self._run is None else round(self._run.traffic.waiting[self.id])

    def _clock_of(self, faults: Faults, name: str) -> SignalClock:
        if self._clock is None:
            what = "there is no signal here: give the node one, signal=[30, 60]"
            faults.add(what, column=name)
        faults.raise_if_any()
        assert self._clock is not None
        return self._clock

    def _move_clock(self, phase: int, elapsed: float) -> None:
        assert self._clock is not None
        self._clock.move(self.W.TIME, phase, elapsed)
        if self._run is not None:
            self._run.follow_clock(self)
