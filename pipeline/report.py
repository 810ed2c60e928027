"""Reporting: events and trips to figures, layers and pictures."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline import ingest, simulate
from pipeline.config import Config, Output
from pipeline.runs import RunFolder
from pipeline.stages import Outcome, Stage, Task
from uxsim_geo.errors import Fault, InputError
from uxsim_geo.files import replace_when_complete

if TYPE_CHECKING:
    import pandas as pd

    from uxsim_geo.network.network import Network
    from uxsim_geo.result import Result

SUMMARY = "summary.json"

#: links times time bins; more would take over 10 GB of memory
MOST_STATES = 50_000_000


@dataclass(frozen=True)
class Material:
    """What the outputs are made of.

    notes
        of the import, network and demand together
    states
        of all links in all time bins: :func:`uxsim_geo.analysis.link_states.link_times`
    figures
        of the whole run: :func:`uxsim_geo.analysis.summary.summary`
    """

    config: Config
    network: Network
    notes: pd.DataFrame
    result: Result
    states: pd.DataFrame
    figures: dict[str, Any]


def _inputs(config: Config, folder: RunFolder) -> dict[str, Path]:  # noqa: ARG001
    tables = (f"{ingest.NETWORK}/{table}.parquet" for table in ("nodes", "links", "import_notes"))
    names = (*tables, ingest.DEMAND_NOTES, *simulate.tables_of(folder))
    return {name: folder / name for name in names}


def _run(task: Task) -> Outcome:
    from uxsim_geo.export.space_time import RenderError

    material = _read_material(task)
    task.begin_writing()
    _write_summary(material, task.folder / SUMMARY)
    written, problems = [SUMMARY], []
    for output in task.config.report.outputs:
        name, write = OUTPUTS[output]
        try:
            write(material, task.folder / name)
            written.append(name)
        except RenderError as error:
            problems.append(f"{name} could not be drawn: {error}")
    return Outcome(written, ", ".join(written), problems=problems)


STAGE = Stage("report", ("name", "simulate", "report"), _inputs, _run)


def _read_material(task: Task) -> Material:
    import pandas as pd

    from uxsim_geo.analysis.link_states import link_times
    from uxsim_geo.analysis.summary import summary
    from uxsim_geo.network.files import read_network
    from uxsim_geo.parquet import read_tables

    network = read_network(task.folder / ingest.NETWORK)
    _check_bins(len(network.links), task.config)
    (demand_notes,) = read_tables(task.folder / ingest.DEMAND_NOTES)
    result = simulate.read_result(task)
    return Material(
        config=task.config,
        network=network,
        notes=pd.concat([network.notes, demand_notes], ignore_index=True),
        result=result,
        states=link_times(result, network, bin_s=task.config.report.bin_s),
        figures=summary(result, network),
    )


def _check_bins(links: int, config: Config) -> None:
    """Refuse time bins so short that the computer would choke on their number."""
    bin_s, shortest = config.report.bin_s, config.simulate.duration_s * links / MOST_STATES
    if bin_s < shortest:
        what = f"report.bin_s: too short for {links:,} links; take {math.ceil(shortest)} s or more"
        raise InputError([Fault(what, value=bin_s)])


def _write_summary(material: Material, path: Path) -> None:
    text = json.dumps(material.figures, indent=1, allow_nan=False) + "\n"
    with replace_when_complete(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _write_geopackage(material: Material, path: Path) -> None:
    from uxsim_geo.export.geopackage import RunDescription, write_geopackage

    description = RunDescription(
        material.config.report.start, material.notes, _information(material)
    )
    write_geopackage(path, material.network, material.states, description)


def _write_network_state(material: Material, path: Path) -> None:
    from uxsim_geo.analysis.link_states import link_totals
    from uxsim_geo.export.plots import network_state_figure
    from uxsim_geo.export.saving import save_figure

    totals = link_totals(material.states)
    save_figure(network_state_figure(material.network, totals, material.config.name), path)


def _write_mfd(material: Material, path: Path) -> None:
    from uxsim_geo.analysis.network_states import network_states
    from uxsim_geo.export.plots import mfd_figure
    from uxsim_geo.export.saving import save_figure

    states = network_states(material.states, material.network)
    save_figure(mfd_figure(states, material.config.name), path)


def _write_space_time(material: Material, path: Path) -> None:
    from uxsim_geo.export.space_time import write_space_time

    write_space_time(path, material.network, material.states, material.config.name)


def _information(material: Material) -> dict[str, object]:
    """Return what run_info says: nothing that differs between two equal runs."""
    import uxsim_geo.version

    config = material.config
    figures = {name: value for name, value in material.figures.items() if name != "engine_wall_s"}
    completed = figures.pop("completed")
    return {
        "name": config.name,
        "uxsim_geo_version": uxsim_geo.version.__version__,
        "start": config.report.start.isoformat(),
        "bin_s": config.report.bin_s,
        **config.simulate.model_dump(exclude={"classes", "control"}),
        "classes": ", ".join(entry.name for entry in config.simulate.classes),
        "control": config.simulate.control.in_words(),
        **figures,
        **{f"completed_{name}": value for name, value in completed.items()},
    }


#: name of the file and the function that writes it, by the output's name in a configuration
OUTPUTS: dict[Output, tuple[str, Callable[[Material, Path], None]]] = {
    "geopackage": ("results.gpkg", _write_geopackage),
    "network_state": ("network_state.png", _write_network_state),
    "mfd": ("mfd.png", _write_mfd),
    "space_time": ("space_time.png", _write_space_time),
}
