"""The figures of a run of a study: those of a summary, without the time that it took."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pipeline import ingest, simulate
from pipeline.config import Config
from pipeline.runs import RunFolder
from pipeline.stages import Outcome, Stage, Task
from uxsim_geo.files import replace_when_complete

FIGURES = "figures.json"

#: figures of a summary that say nothing of the traffic, or are in other columns
NOT_OF_TRAFFIC = ("engine_wall_s", "seed")


#: columns of figures.csv, as :func:`uxsim_geo.analysis.summary.summary` describes them
NAMES = (
    "vehicles_demanded",
    "vehicles_departed",
    "vehicles_completed",
    "vehicles_running",
    "vehicles_waiting",
    "vehicles_aborted",
    "total_travel_time_veh_s",
    "total_delay_veh_s",
    "completed.average_travel_time_s",
    "completed.average_delay_s",
    "total_distance_veh_m",
    "average_speed_m_s",
    "gridlocked",
)


def _inputs(config: Config, folder: RunFolder) -> dict[str, Path]:  # noqa: ARG001
    tables = (f"{ingest.NETWORK}/{table}.parquet" for table in ("nodes", "links"))
    return {name: folder / name for name in (*tables, *simulate.tables_of(folder))}


def _run(task: Task) -> Outcome:
    from uxsim_geo.analysis.summary import summary
    from uxsim_geo.network.files import read_network

    network = read_network(task.folder / ingest.NETWORK)
    figures = flat(summary(simulate.read_result(task, network), network))
    task.begin_writing()
    with replace_when_complete(task.folder / FIGURES) as path:
        path.write_text(json.dumps(figures, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    return Outcome([FIGURES], FIGURES)


STAGE = Stage("figures", ("simulate",), _inputs, _run, storable=True)


def flat(figures: dict[str, Any], above: str = "") -> dict[str, Any]:
    """Return figures by their dotted names, as completed.average_delay_s."""
    found: dict[str, Any] = {}
    for name, value in figures.items():
        if isinstance(value, dict):
            found |= flat(value, f"{above}{name}.")
        elif above or name not in NOT_OF_TRAFFIC:
            found[f"{above}{name}"] = value
    return found


def read_figures(folder: RunFolder) -> dict[str, Any]:
    """Read the figures that the stage has left."""
    figures: dict[str, Any] = json.loads((folder / FIGURES).read_text(encoding="utf-8"))
    return figures
