"""Simulation: the tables of a run through the engine to its events and trips."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline import ingest
from pipeline.allowance import allowed_machine
from pipeline.config import Config
from pipeline.config_keys import files_in
from pipeline.control_config_faults import as_written
from pipeline.runs import MANIFEST, RunFolder, of_form
from pipeline.signal_tables import SIGNALS, signals_of
from pipeline.stages import Outcome, Stage, Task
from uxsim_geo.errors import Fault, InputError

if TYPE_CHECKING:
    import pandas as pd

    from uxsim_geo.network.network import Network
    from uxsim_geo.result import Result

EVENTS = "events.parquet"
TRIPS = "trips.parquet"
#: only where control has set limits
SPEED_LIMITS = "speed_limits.parquet"


def _inputs(config: Config, folder: RunFolder) -> dict[str, Path]:
    tables = (f"{ingest.NETWORK}/{table}.parquet" for table in ("nodes", "links", "movements"))
    files = {name: folder / name for name in (*tables, ingest.DEMAND)}
    sometimes = (SIGNALS, ingest.DEMAND_CHANGES)
    files |= {name: folder / name for name in sometimes if (folder / name).is_file()}
    areas = dict.fromkeys(files_in(config.simulate))
    return files | {f"area.{number}": path for number, path in enumerate(areas)}


def _run(task: Task) -> Outcome:
    from uxsim_geo.files import replace_when_complete
    from uxsim_geo.parquet import write_table

    with replace_when_complete(task.folder / EVENTS) as events_file:
        result = _simulated(task, events_file)
        task.begin_writing()
    tables = {TRIPS: result.trips}
    if len(result.speed_limits):
        tables[SPEED_LIMITS] = result.speed_limits
    for name, table in tables.items():
        write_table(table, task.folder / name)
    figures = {
        "engine_wall_s": round(result.engine_wall_s, 6),
        "locked_vehicles": result.locked_vehicles,
        "ineffective_measures": list(result.notes),
    }
    warnings = [f"warning: {note}" for note in result.notes]
    return Outcome((EVENTS, *tables), _words(result), figures, warnings=warnings)


STAGE = Stage("simulate", ("simulate",), _inputs, _run, may_leave=(SPEED_LIMITS,), storable=True)


def _simulated(task: Task, events_file: Path) -> Result:
    """Run the engine; what is wrong with the control is told by the keys of the configuration."""
    from uxsim_geo.demand.files import read_demand
    from uxsim_geo.engine.simulation import simulate
    from uxsim_geo.network.files import read_network

    section = task.config.simulate
    network = read_network(task.folder / ingest.NETWORK)
    demand = read_demand(task.folder / ingest.DEMAND)
    signals = signals_of(task.config, task.folder / SIGNALS)
    try:
        result = simulate(
            network,
            demand,
            section.settings(),
            control=[
                *(entry.measure() for _, _, entry in section.control.entries()),
                *signals,
            ],
            classes=[entry.driver_class() for entry in section.classes],
            progress=task.watch.simulated,
            machine=allowed_machine(),
            events_file=events_file,
        )
    except InputError as error:
        raise InputError(as_written(error.faults, section)) from None
    # a signal of the network, which nobody asked for here, may well stand where nobody drives
    own = tuple(f"signal at node {signal.node_id} never" for signal in signals)
    notes = tuple(note for note in result.notes if not (own and note.startswith(own)))
    return replace(result, notes=notes)


def read_result(task: Task, network: Network) -> Result:
    """Read back what the simulation of a network left.

    Raises :class:`uxsim_geo.errors.InputError` for files that are absent or damaged.
    """
    import pandas as pd

    from uxsim_geo.events import EventFile
    from uxsim_geo.parquet import read_tables
    from uxsim_geo.result import Result

    events, *others = (task.folder / name for name in tables_of(task.folder))
    trips, *limits = read_tables(*others)
    log = EventFile(events, pd.Index(network.links["link_id"].astype(str)))
    ends = dict.fromkeys(("origin", "destination"), network.nodes["node_id"])
    trips = _with_categories(trips, ends)
    told = _figures(task)
    result = Result(
        log,
        trips,
        task.config.simulate.settings(),
        engine_wall_s=told.engine_wall_s,
        locked_vehicles=told.locked_vehicles,
        notes=told.ineffective_measures,
    )
    return replace(result, speed_limits=limits[0]) if limits else result


@dataclass(frozen=True)
class _Figures:
    """What the stage leaves in the manifest."""

    engine_wall_s: float
    locked_vehicles: int
    ineffective_measures: tuple[str, ...]


def _figures(task: Task) -> _Figures:
    """Return what the simulation has left in the manifest, where that is still to be read."""
    try:
        figures: _Figures = of_form(_Figures, task.figures[STAGE.name])
    except ValueError:
        what = "the figures of the stage simulate are damaged; run it again with --force"
        raise InputError([Fault(what, str(task.folder / MANIFEST))]) from None
    return figures


def _with_categories(table: pd.DataFrame, ids: Mapping[str, Iterable[str]]) -> pd.DataFrame:
    """Give columns of a table without rows their categories back: Parquet has forgotten them."""
    import pandas as pd

    if len(table):
        return table
    lost = {name: pd.Categorical([], categories=list(map(str, of))) for name, of in ids.items()}
    return table.assign(**lost)


def tables_of(folder: RunFolder) -> list[str]:
    """Name the tables that the simulation left."""
    return [EVENTS, TRIPS, *([SPEED_LIMITS] if (folder / SPEED_LIMITS).is_file() else [])]


def _words(result: Result) -> str:
    return f"{len(result.log):,} link entries in {_wall(result.engine_wall_s)} of engine"


def _wall(seconds: float) -> str:
    return f"{1000 * seconds:,.1f} ms" if seconds < 1 else f"{seconds:,.1f} s"
