"""Simulation: the tables of a run through the engine to its events and trips."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pipeline import ingest
from pipeline.config import Config
from pipeline.runs import RunFolder
from pipeline.stages import Outcome, Stage, Task

if TYPE_CHECKING:
    from uxsim_geo.result import Result

EVENTS = "events.parquet"
TRIPS = "trips.parquet"


def _inputs(config: Config, folder: RunFolder) -> dict[str, Path]:  # noqa: ARG001
    names = (f"{ingest.NETWORK}/{table}.parquet" for table in ("nodes", "links", "movements"))
    return {name: folder / name for name in (*names, ingest.DEMAND)}


def _run(task: Task) -> Outcome:
    from uxsim_geo.demand.files import read_demand
    from uxsim_geo.engine.simulation import simulate
    from uxsim_geo.network.files import read_network
    from uxsim_geo.parquet import write_table

    network = read_network(task.folder / ingest.NETWORK)
    demand = read_demand(task.folder / ingest.DEMAND)
    settings = task.config.simulate.settings()
    result = simulate(network, demand, settings, progress=task.watch.simulated)
    task.begin_writing()
    write_table(result.events, task.folder / EVENTS)
    write_table(result.trips, task.folder / TRIPS)
    figures = {
        "engine_wall_s": round(result.engine_wall_s, 6),
        "locked_vehicles": result.locked_vehicles,
    }
    return Outcome((EVENTS, TRIPS), _words(result), figures)


STAGE = Stage("simulate", ("simulate",), _inputs, _run)


def read_result(task: Task) -> Result:
    """Read back what the simulation left.

    Raises :class:`uxsim_geo.errors.InputError` for files that are absent or damaged.
    """
    from uxsim_geo.parquet import read_tables
    from uxsim_geo.result import Result

    events, trips = read_tables(task.folder / EVENTS, task.folder / TRIPS)
    settings = task.config.simulate.settings()
    return Result(events, trips, settings, **task.figures[STAGE.name])


def _words(result: Result) -> str:
    return f"{len(result.events):,} link entries in {1000 * result.engine_wall_s:,.1f} ms of engine"
