"""Reporting: events and trips to figures, layers and pictures."""

from __future__ import annotations

import json
import traceback
from collections.abc import Callable
from functools import partial
from pathlib import Path

from pipeline import ingest, simulate
from pipeline.config import Config, Output
from pipeline.config_keys import files_in
from pipeline.material import Material, check_bins_of_report, read_material
from pipeline.plots import FOLDER, check_plots, write_plot
from pipeline.results_files import (
    Writers,
    describe,
    flatgeobuf,
    geopackage,
    geoparquet,
)
from pipeline.runs import RunFolder
from pipeline.signal_tables import SIGNALS
from pipeline.space_time import Progress, check_space_time, space_time_writers
from pipeline.stages import Outcome, Stage, Task
from uxsim_geo.errors import InputError
from uxsim_geo.files import replace_when_complete

SUMMARY = "summary.json"


def _inputs(config: Config, folder: RunFolder) -> dict[str, Path]:
    tables = (f"{ingest.NETWORK}/{table}.parquet" for table in ("nodes", "links", "import_notes"))
    names = (*tables, ingest.DEMAND_NOTES, *simulate.tables_of(folder))
    if (folder / SIGNALS).is_file():
        names = (*names, SIGNALS)
    areas = dict.fromkeys(files_in(config.report))
    files = {name: folder / name for name in names}
    return files | {f"area.{number}": path for number, path in enumerate(areas)}


def _run(task: Task) -> Outcome:
    """Write everything that can be written, also where something else fails."""
    material = read_material(task)
    check_bins_of_report(task.config, len(material.network.links))
    check_plots(task.config, material.network)
    check_space_time(task.config)
    task.begin_writing()
    _write_summary(material, task.folder / SUMMARY)
    written, problems = [SUMMARY], []
    writers = _writers(task, material)
    for folder in sorted({(task.folder / name).parent for name in writers}):
        folder.mkdir(exist_ok=True)
    for name, write in writers.items():
        try:
            write(task.folder / name)
            written.append(name)
        except Exception as error:  # noqa: BLE001  told below, and the command fails by it
            problems += [f"{name} could not be written: {what}" for what in in_words(error)]
            task.folder.log("".join(traceback.format_exception(error)))
    return Outcome(written, ", ".join(written), problems=problems)


# what files say of where the run came from has the settings of its sources
STAGE = Stage("report", ("name", "ingest", "simulate", "report"), _inputs, _run)


def _writers(task: Task, material: Material) -> Writers:
    """By the name of each file, the function that writes it to a path."""
    writers: Writers = {}
    for output in task.config.report.outputs:
        writers |= OUTPUTS[output](material, task.watch.drawn)
    for entry in task.config.report.plots:
        progress = partial(task.watch.drawn, entry.file_name)
        name = f"{FOLDER}/{entry.file_name}"
        writers[name] = partial(write_plot, material, entry, progress=progress)
    return writers


def in_words(error: Exception) -> list[str]:
    """What went wrong, a line each: as it was meant for the reader, else after the type's name."""
    if isinstance(error, InputError):
        return [str(fault) for fault in error.faults]
    if isinstance(error, (ValueError, RuntimeError)) and str(error):
        return [str(error)]
    return [f"{type(error).__name__}: {error}"]


def _write_summary(material: Material, path: Path) -> None:
    text = json.dumps(material.figures, indent=1, allow_nan=False) + "\n"
    with replace_when_complete(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _write_page(material: Material, path: Path) -> None:
    from uxsim_geo.export.page.page import Run, write_page

    run = Run(material.network, material.result, material.kept_states)
    write_page(path, run, describe(material))


#: the function that gives the writer of each file, by the output's name in a configuration; it is
#: handed what to tell how far a file is, by its name
OUTPUTS: dict[Output, Callable[[Material, Progress], Writers]] = {
    "geopackage": lambda material, _: geopackage(material),
    "space_time": space_time_writers,
    "page": lambda material, _: {"report.html": partial(_write_page, material)},
    "geoparquet": lambda material, _: geoparquet(material),
    "flatgeobuf": lambda material, _: flatgeobuf(material),
}
