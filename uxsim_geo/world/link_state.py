"""How a link is now, and what has passed it so far."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from uxsim_geo.world.elements import Element

Floats = npt.NDArray[np.float64]


class LinkState(Element):
    """The live values of a link."""

    __slots__ = ()

    length: float
    free_flow_speed: float

    @property
    def num_vehicles(self) -> int:
        """Vehicles on the link now."""
        return 0 if self._run is None else round(self._run.traffic.count[self.id])

    @property
    def num_vehicles_queue(self) -> int:
        """Vehicles that stand on the link now."""
        return 0 if self._run is None else round(self._run.traffic.queue[self.id])

    @property
    def density(self) -> float:
        """Vehicles on the link now per metre of it, all lanes together, veh/m."""
        return self.num_vehicles / self.length

    @property
    def speed(self) -> float:
        """Mean speed of the vehicles on the link now, m/s; free speed where there are none."""
        run = self._run
        return self.free_flow_speed if run is None else float(run.traffic.speed[self.id])

    @property
    def flow(self) -> float:
        """Density times speed, veh/s."""
        return self.density * self.speed

    def instant_travel_time(self, t: float | None = None) -> float:
        """Length over present mean speed, s; that speed counts 1 % of free speed at least.

        ``t``, where given, must lie in the present time step, s: for what is over there is
        :meth:`actual_travel_time`. Raises InputError where it does not.
        """
        if t is not None and not self.W.on_time(t):
            what = f"must be the present time, {self.W.TIME:g}; for others: actual_travel_time(t)"
            faults = self._faults()
            faults.add(what, column="t", value=t)
            faults.raise_if_any()
        if self._run is None:
            return self.length / self.free_flow_speed
        return float(self._run.traffic.travel_time[self.id])

    def arrival_count(self, t: float) -> int:
        """Return how many vehicles have entered the link up to a time, s."""
        return int(self._counts("enter_s", np.array([float(t)]))[0])

    def departure_count(self, t: float) -> int:
        """Return how many vehicles have left the link up to a time, s."""
        return int(self._counts("exit_s", np.array([float(t)]))[0])

    @property
    def cum_arrival(self) -> list[int]:
        """:meth:`arrival_count` at the begin of every time step so far, and now."""
        return [round(count) for count in self._counts("enter_s", self._steps())]

    @property
    def cum_departure(self) -> list[int]:
        """:meth:`departure_count` at the begin of every time step so far, and now."""
        return [round(count) for count in self._counts("exit_s", self._steps())]

    def actual_travel_time(self, t: float) -> float:
        """Return what the vehicles took that entered last up to a time (s) and have left, s.

        Free-flow time where there are none.
        """
        passed = self._passages()
        done = np.flatnonzero((passed["enter_s"] <= t) & np.isfinite(passed["exit_s"]))
        if not done.size:
            return self.length / self.free_flow_speed
        last = done[np.argmax(passed["enter_s"][done])]
        return float(passed["exit_s"][last] - passed["enter_s"][last])

    def _steps(self) -> Floats:
        return np.arange(self.W.T + 1, dtype=np.float64) * self.W.DELTAT

    def _counts(self, moment: str, times: Floats) -> Floats:
        """Vehicles that have entered (enter_s) or left (exit_s) up to each of some times."""
        passed = self._passages()
        order = np.argsort(passed[moment], kind="stable")  # those that have not left come last
        total = np.concatenate(([0.0], np.cumsum(passed["vehicles"][order])))
        counts: Floats = total[np.searchsorted(passed[moment][order], times, side="right")]
        return counts

    def _passages(self) -> dict[str, Floats]:
        """Entries, exits and vehicles of all platoons that have entered so far."""
        if self._run is None:
            return dict.fromkeys(("enter_s", "exit_s", "vehicles"), np.empty(0))
        result = self._run.result
        here = np.arange(len(result.log.link_ids)) == self.id
        own = result.log.some("vehicle", "enter_s", "exit_s", links=here)
        return {
            "enter_s": own["enter_s"],
            "exit_s": own["exit_s"],
            "vehicles": result.trips["vehicles"].to_numpy(float)[own["vehicle"]],
        }
