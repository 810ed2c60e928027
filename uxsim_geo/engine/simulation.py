"""The Python side of the engine: tables in, events and trips out."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.control.drivers import DriverClass
from uxsim_geo.control.levers import Levers
from uxsim_geo.control.site import Measure
from uxsim_geo.control.traffic import Traffic
from uxsim_geo.demand.check import check_demand
from uxsim_geo.demand.demand import DEMAND_COLUMNS, Demand
from uxsim_geo.engine.additions import add_platoons, platoons_to_add
from uxsim_geo.engine.arrays import build_world
from uxsim_geo.engine.loop import finish, refresh, run_until
from uxsim_geo.engine.memory import check_memory, memory_needs
from uxsim_geo.engine.records import EVENT, Queues, World
from uxsim_geo.engine.router import Router, passes_in
from uxsim_geo.engine.saved import (
    fill_steering,
    from_plain,
    platoon_parts,
    platoons_from,
    read_saved,
    steering_parts,
    to_plain,
    with_arrays,
    world_arrays,
    write_saved,
)
from uxsim_geo.engine.setting import Setting, set_up
from uxsim_geo.engine.sinks import EventSink, InMemory, to_file
from uxsim_geo.engine.tables import limit_table, metres_driven, tolls_paid, trip_table
from uxsim_geo.errors import Fault, InputError
from uxsim_geo.events import EventFile
from uxsim_geo.machine import Machine
from uxsim_geo.network.network import Network
from uxsim_geo.result import Progress, Result
from uxsim_geo.settings import Settings

_REPORTS = 100  # of progress, in a run that is watched
_LEAST_ROOM = 1 << 12  # places by which a buffer grows at least

Records = npt.NDArray[Any]


def simulate(
    network: Network,
    demand: Demand,
    settings: Settings,
    *,
    control: Sequence[Measure] = (),
    classes: Sequence[DriverClass] = (),
    progress: Callable[[Progress], None] | None = None,
    events_file: str | Path | None = None,
    sleep: bool = True,
    machine: Machine | None = None,
) -> Result:
    """Simulate a demand on a network until ``settings.duration``, under some measures of control.

    ``control`` are measures of ``uxsim_geo.control``; ``classes`` the classes of drivers that the
    demand names. ``progress`` is called about a hundred times with the state of the run.
    ``events_file`` is a Parquet file for the events: they go there while the run goes on, and the
    result reads them from there (None: they are kept in memory). It appears at the end.
    ``sleep`` lets blocked platoons rest until something can change for them; False tries them
    again in every step, which is slower and gives the same result, to the bit. ``machine`` says
    how much of this machine the run may use, on which no result depends.

    Raises :class:`uxsim_geo.errors.InputError` with all that is wrong with the tables, or with the
    control, and where the run would need more memory than there is.
    """
    run = partial(
        Simulation, network, demand, settings, control=control, classes=classes, machine=machine
    )
    if events_file is None:
        return _run_through(run(sleep=sleep), progress)
    with to_file(Path(events_file)) as sink:
        result = _run_through(run(sink=sink, sleep=sleep), progress)
    return replace(result, log=EventFile(Path(events_file), result.log.link_ids))


def _run_through(run: Simulation, progress: Callable[[Progress], None] | None) -> Result:
    """Bring a run to its end, and tell of it on the way."""
    reports = 1 if progress is None else _REPORTS
    for report in range(1, reports + 1):
        run.advance(run.settings.duration * report / reports)
        if progress is not None:
            progress(run.progress())
    return run.result()


class Simulation:
    """One run, piece by piece: advance, look, change, advance.

    Pieces of any length give the same result as one, to the bit. ``sink`` is where its events go
    (None: into memory). Raises :class:`uxsim_geo.errors.InputError` with all that is wrong with
    what it is given.
    """

    def __init__(
        self,
        network: Network,
        demand: Demand,
        settings: Settings,
        *,
        control: Sequence[Measure] = (),
        classes: Sequence[DriverClass] = (),
        sink: EventSink | None = None,
        sleep: bool = True,
        machine: Machine | None = None,
    ) -> None:
        self.network = network
        self.settings = settings
        self.setting: Setting = set_up(network, demand, settings, control, classes)
        self.platoons = self.setting.platoons
        self.wall_s = 0.0
        wishes, drivers = self.setting.wishes_of(self.platoons), self.setting.driver_records()
        machine, passes = machine or Machine(), passes_in(settings, drivers)
        self.router = Router(self.setting.paths, passes, machine.used_threads)
        self.router.prepare(wishes.destinations)
        needs = memory_needs(self.router, self.platoons, wishes, drivers, settings)
        check_memory(needs, machine)
        self.world = build_world(
            network,
            self.platoons,
            wishes,
            drivers,
            settings,
            router=self.router,
            sleep=sleep,
        )
        self.steering = self.setting.steering
        plans = self.steering.application.plans
        self.world = self.world._replace(links=self.world.links._replace(green=plans.greens))
        self.steering.application.start(self.world, self.steering.levers, self.router)
        self._sink: EventSink = InMemory() if sink is None else sink
        self._sink.begin(self.setting.row_of_link, pd.Index(self.setting.site.link_ids))
        self._acted_step = -1  # the last step at whose start rules have been called
        self._touched = False  # whether somebody may have written to the levers
        # up to step 0: compiles, where that has to be done, before the clock
        self._call(run_until)
        self.router.start(self.world)

    @property
    def time(self) -> float:
        """How far the run has come, s after the start."""
        clock = self.world.links.clock[0]
        return min(float(clock["step"] * clock["step_length"]), self.settings.duration)

    @property
    def finished(self) -> bool:
        """Whether the run has come to its end."""
        return int(self.world.links.clock[0]["step"]) >= self.world.calendar.bucket.size

    @property
    def levers(self) -> Levers:
        """What is set now; what is written here takes effect when the run goes on."""
        self._touched = True
        return self.steering.levers

    @property
    def traffic(self) -> Traffic:
        """The state of the network now."""
        return self.steering.look(self.world, self.time)

    def advance(self, until: float) -> None:
        """Run up to the start of the first step at or after a time, s; at most to the end."""
        started = time.perf_counter() - self._sink.writing_s
        clock = self.world.links.clock
        steps = int(self.world.calendar.bucket.size)
        target = int(np.ceil(min(until / self.settings.step, steps) - 1e-9))
        if self._touched and clock["step"][0] < target:
            self.steering.apply_outside(self.world, int(clock["step"][0]))
            self._touched = False
        while clock["step"][0] < target:
            step = int(clock["step"][0])
            if step > self._acted_step and self.steering.next_due(step) == step:
                self.steering.act(self.world, step)
                self._acted_step = step
            if clock["update_step"][0] == step:
                self.router.update(self.world, step)
            due = self.steering.next_due(step + 1)
            clock["control_step"] = due
            clock["until_step"] = min(target, due, int(clock["update_step"][0]))
            self._call(run_until)
        self.wall_s += time.perf_counter() - self._sink.writing_s - started

    def add(self, demand: Demand) -> None:
        """Add demand during the run: it leaves home when it says, from now on.

        Who is added chooses by the costs of the last update of routes, like everybody else.
        Raises :class:`InputError` with all that is wrong with it; then nothing is added.
        """
        check_demand(demand, self.network)
        added = platoons_to_add(demand, self.settings, self.platoons, self.time)
        self.setting.check_demand(demand)
        wishes = self.setting.wishes_of(added)
        rank = self.router.rank
        self.world, origins = add_platoons(self.world, added, wishes, self.network, rank)
        self.platoons = self.platoons.joined(added)
        self.router.prepare(self.world.routes.destination.size - 1)
        self.router.introduce(self.world)
        self._call(lambda world: refresh(Queues(world.links, world.calendar), origins))

    def progress(self) -> Progress:
        """Say where the run stands."""
        clock = self.world.links.clock[0]
        return Progress(
            time=self.time,
            duration=self.settings.duration,
            vehicles_running=int(clock["vehicles_running"]),
            vehicles_completed=int(clock["vehicles_completed"]),
            mean_speed=float(clock["mean_speed"]),
        )

    def result(self) -> Result:
        """Give the tables of the run so far; it can go on afterwards."""
        running, rest = self.world, list[Records]()
        free_time = self.setting.site.length / self.setting.site.free_speed
        self.world = _copy_to_finish(running, self.time, free_time[self.setting.row_of_link])
        self.router.give_free_times(self.world)
        self._call(finish, lambda events: rest.append(events.copy()))
        world, self.world = self.world, running
        log = self._sink.log(rest, last=self.finished)
        changes, trips = self.steering.changes, world.log.trip.size
        tolls = [(at, now["toll"]) for at, now in changes if "toll" in now]
        limits = [(at, now["speed_limit"]) for at, now in changes if "speed_limit" in now]
        paid = tolls_paid(log, tolls, trips) * self.setting.toll_factors(self.platoons)
        driven = metres_driven(log, self.setting.site.length, trips)
        return Result(
            log=log,
            trips=trip_table(world, self.platoons, driven, paid),
            settings=self.settings,
            engine_wall_s=self.wall_s,
            locked_vehicles=int(world.links.clock[0]["vehicles_locked"]),
            notes=self.steering.notes(world) + self.setting.notes(self.platoons),
            speed_limits=limit_table(limits, self.setting.site.free_speed, log.link_ids),
        )

    def save(self, path: str | Path) -> None:
        """Write the run to a file, from which :meth:`resume` goes on as if it had not stopped."""
        texts, arrays = platoon_parts(self.platoons)
        told, control = steering_parts(self.steering)
        arrays |= control | world_arrays(self.world)
        arrays["events"] = to_plain(self._sink.records())
        state = {
            "settings": asdict(self.settings),
            "classes": [repr(one) for one in self.setting.classes],
            "platoons": texts,
            "measures": self.setting.measures,
            "control": told,
            "acted_step": self._acted_step,
            "touched": self._touched,
            "wall_s": self.wall_s,
        }
        write_saved(Path(path), self.network, state, arrays)

    @classmethod
    def resume(
        cls,
        path: str | Path,
        *,
        control: Sequence[Measure] = (),
        classes: Sequence[DriverClass] = (),
        machine: Machine | None = None,
    ) -> Simulation:
        """Go on with a run that was saved; it needs the same control and classes once more.

        Raises :class:`InputError` for a file that is no saved run, is damaged, is of another
        version of this library, or was under other control.
        """
        network, state, arrays = read_saved(Path(path))
        try:
            nobody = Demand(pd.DataFrame({name: [] for name in DEMAND_COLUMNS}))
            settings = Settings(**state["settings"])
            run = cls(network, nobody, settings, control=control, classes=classes, machine=machine)
            if [repr(one) for one in run.setting.classes] != state["classes"]:
                raise ValueError(f"it had other classes of drivers: {', '.join(state['classes'])}")
            run.platoons = platoons_from(state["platoons"], arrays)
            run.world = with_arrays(run.world, arrays)
            run.router.prepare(run.world.routes.destination.size - 1)
            run.setting.given = run.world.routes.given.astype(np.int64)
            if run.setting.measures != state["measures"]:
                under = ", ".join(state["measures"]) or "none"
                raise ValueError(f"it was under other control: {under}; give that again")
            fill_steering(run.steering, state["control"], arrays)
            run._sink.add(from_plain(arrays["events"], EVENT))
            run._acted_step, run._touched = int(state["acted_step"]), bool(state["touched"])
            run.wall_s = float(state["wall_s"])
        except (ValueError, LookupError, TypeError, AttributeError) as error:
            if isinstance(error, InputError):
                raise
            raise InputError([Fault(f"cannot be resumed: {error}", str(path))]) from None
        return run

    def _call(
        self, task: Callable[[World], bool], take: Callable[[Records], None] | None = None
    ) -> None:
        """Have the kernels do a task; empty and widen buffers as often as needed.

        ``take`` is given the events (None: the sink is).
        """
        take = self._sink.add if take is None else take
        done = False
        with np.errstate(all="ignore"):  # hashes overflow by design; matters without the JIT only
            while not done:
                done = task(self.world)
                clock = self.world.links.clock[0]
                take(self.world.log.event[: clock["events"]])
                clock["events"] = 0
                if not done:
                    self.world = _widened(self.world)


def _widened(world: World) -> World:
    """Give the pool of rings, or the trail, as much again where it is full.

    The buffer of events, which is empty now, must hold all platoons of any link.
    """
    links, routes, clock = world.links, world.routes, world.links.clock[0]
    queue = links.queue[: clock["links"]]
    fullest = int(np.max(queue["entered"] - queue["left"], initial=0))
    if fullest > world.log.event.size:
        world = world._replace(log=world.log._replace(event=np.empty(fullest, EVENT)))
    if clock["pool_full"]:
        clock["pool_full"] = 0
        world = world._replace(links=links._replace(platoon=_twice(links.platoon)))
    if clock["no_cycles"] and clock["trail_used"] == routes.trail.size:
        world = world._replace(routes=routes._replace(trail=_twice(routes.trail)))
    return world


def _twice(buffer: Records) -> Records:
    return np.concatenate([buffer, np.empty(max(buffer.size, _LEAST_ROOM), buffer.dtype)])


def _copy_to_finish(world: World, now: float, free_time: npt.NDArray[np.float64]) -> World:
    """Copy what the end of a run writes; ``free_time`` of links is that without control, s."""
    links, routes, log = world.links, world.routes, world.log
    clock, queue, trip = links.clock.copy(), links.queue.copy(), log.trip.copy()
    clock["end"] = now
    queue["free_time"][: free_time.size] = free_time
    return world._replace(
        links=links._replace(clock=clock, queue=queue),
        routes=routes._replace(
            vertex=routes.vertex.copy(), arc=routes.arc.copy(), incoming=routes.incoming.copy()
        ),
        log=log._replace(trip=trip, event=log.event.copy()),
    )
