"""The Python side of the engine: tables in, events and trips out."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.control.signals import Signal, check_signals
from uxsim_geo.demand.check import check_demand
from uxsim_geo.demand.demand import Demand
from uxsim_geo.demand.platoons import Platoons, make_platoons, weighted_counts
from uxsim_geo.engine.arrays import build_world
from uxsim_geo.engine.loop import finish, prepare, run_until
from uxsim_geo.engine.records import World
from uxsim_geo.network.check import check_network
from uxsim_geo.network.network import Network
from uxsim_geo.result import Progress, Result
from uxsim_geo.settings import Settings

STATUS = ("waiting", "running", "completed", "aborted")
_REPORTS = 100  # of progress, in a run that is watched

Records = npt.NDArray[Any]


def simulate(
    network: Network,
    demand: Demand,
    settings: Settings,
    *,
    signals: Sequence[Signal] = (),
    progress: Callable[[Progress], None] | None = None,
    sleep: bool = True,
) -> Result:
    """Simulate a demand on a network until ``settings.duration``, under some signals.

    ``progress`` is called about a hundred times with the state of the run. ``sleep`` lets blocked
    platoons rest until something can change for them; False tries them again in every step, which
    is slower and gives the same result, to the bit.

    Raises :class:`uxsim_geo.errors.InputError` with all that is wrong with the tables.
    """
    check_network(network)
    check_demand(demand, network)
    links = network.links
    ends = zip(links["link_id"].astype(str), links["to_node_id"].astype(str), strict=True)
    check_signals(signals, dict(ends))
    platoons = make_platoons(demand, settings)
    simulation = Simulation(network, platoons, settings, signals, sleep=sleep)
    reports = 1 if progress is None else _REPORTS
    for report in range(1, reports + 1):
        simulation.advance(simulation.steps * report // reports)
        if progress is not None:
            progress(simulation.progress())
    return simulation.result()


class Simulation:
    """One run: its world of records, and the events that have left it."""

    def __init__(
        self,
        network: Network,
        platoons: Platoons,
        settings: Settings,
        signals: Sequence[Signal] = (),
        *,
        sleep: bool = True,
    ) -> None:
        self.network = network
        self.platoons = platoons
        self.settings = settings
        self.wall_s = 0.0
        self.world, self.row_of_link = build_world(
            network, platoons, settings, signals, sleep=sleep
        )
        self._events: list[Records] = []
        self._call(prepare)
        self._call(run_until)  # up to step 0: compiles, where that has to be done, before the clock

    @property
    def steps(self) -> int:
        """Steps from the start to the end."""
        return int(self.world.calendar.bucket.size)

    def advance(self, until_step: int) -> None:
        """Run up to the start of a step."""
        started = time.perf_counter()
        self.world.links.clock["until_step"] = until_step
        self._call(run_until)
        self.wall_s += time.perf_counter() - started

    def progress(self) -> Progress:
        """Say where the run stands."""
        clock = self.world.links.clock[0]
        return Progress(
            time=min(float(clock["step"] * clock["step_length"]), self.settings.duration),
            duration=self.settings.duration,
            vehicles_running=int(clock["vehicles_running"]),
            vehicles_completed=int(clock["vehicles_completed"]),
            mean_speed=float(clock["mean_speed"]),
        )

    def result(self) -> Result:
        """End the run and give its tables."""
        self._call(finish)
        self._take_events()
        events = np.concatenate(self._events)
        clock = self.world.links.clock[0]
        return Result(
            events=self._event_table(events),
            trips=self._trip_table(events),
            settings=self.settings,
            engine_wall_s=self.wall_s,
            locked_vehicles=int(clock["vehicles_locked"]),
        )

    def _call(self, task: Callable[[World], bool]) -> None:
        """Have the kernels do a task; empty the events and widen the rings as often as needed."""
        with np.errstate(all="ignore"):  # hashes overflow by design; matters without the JIT only
            while not task(self.world):
                self._take_events()
                if self.world.links.clock["pool_full"][0]:
                    self._widen_pool()

    def _take_events(self) -> None:
        clock = self.world.links.clock[0]
        self._events.append(self.world.log.event[: clock["events"]].copy())
        clock["events"] = 0

    def _widen_pool(self) -> None:
        """Give the pool of rings as much again."""
        links = self.world.links
        pool = np.concatenate([links.platoon, np.empty_like(links.platoon)])
        self.world = self.world._replace(links=links._replace(platoon=pool))
        self.world.links.clock["pool_full"] = 0

    def _event_table(self, events: Records) -> pd.DataFrame:
        links = pd.Index(self.network.links["link_id"].astype(str))
        return pd.DataFrame(
            {
                "vehicle": events["trip"],
                "link": pd.Categorical.from_codes(
                    self.row_of_link[events["link"]], categories=links
                ),
                "enter_s": events["enter"],
                "exit_s": events["exit"],
            }
        )

    def _trip_table(self, events: Records) -> pd.DataFrame:
        platoons, trip = self.platoons, self.world.log.trip
        nodes = pd.Index(platoons.node_ids)
        status = pd.Categorical.from_codes(trip["status"], categories=pd.Index(STATUS))
        return pd.DataFrame(
            {
                "vehicle": np.arange(trip.size, dtype=np.int32),
                "origin": pd.Categorical.from_codes(platoons.origin, categories=nodes),
                "destination": pd.Categorical.from_codes(platoons.destination, categories=nodes),
                "number": platoons.number.astype(np.int32),
                "depart_s": trip["depart"],
                "enter_s": trip["enter"],
                "arrive_s": trip["arrive"],
                "status": status,
                "vehicles": platoons.vehicles.astype(np.int32),
                "distance_m": trip["covered"] + self._lengths_of_links_done(events),
                "free_time_s": np.where(np.isinf(trip["free_time"]), np.nan, trip["free_time"]),
                "toll": np.zeros(trip.size),
            }
        )

    def _lengths_of_links_done(self, events: Records) -> npt.NDArray[np.float64]:
        done = events[~np.isnan(events["exit"])]
        metres = self.world.routes.road["length"][done["link"]]
        return weighted_counts(done["trip"], metres, self.world.log.trip.size)
