"""The results of a run on the terminal: figures with their units, and what was written where."""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING, Any

from pipeline.lines import show
from pipeline.report import SUMMARY
from pipeline.runs import CONFIG, MANIFEST, RunFolder, is_unchanged
from pipeline.warned import warning_of_aborted
from uxsim_geo.network.units import KMH, LENGTHS, TIMES

if TYPE_CHECKING:
    from rich.table import Table

VEHICLE_COUNTS = ("demanded", "departed", "completed", "running", "waiting", "aborted")


def show_results(folder: RunFolder) -> None:
    """Print the table of results, if the run has come so far, and the paths of the files there."""
    from rich.console import Console

    console = Console(highlight=False)
    stages = folder.read_manifest().stages
    figures = read_summary(folder)
    outputs = [name for record in stages.values() for name in record.outputs]
    with console.capture() as capture:
        if figures is not None:
            if (warning := warning_of_aborted(figures)) is not None:
                console.print(warning, markup=False)
            console.print(results_table(figures, folder.path.name))
        for path in (folder / name for name in (*outputs, CONFIG, MANIFEST)):
            if path.is_file():
                console.out(f"{path}  {size_in_words(path.stat().st_size)}")
    show(capture.get().rstrip("\n"), sys.stdout)


def read_summary(folder: RunFolder) -> dict[str, Any] | None:
    """Return the figures of a run; None where its manifest vouches for none, or no longer."""
    outputs = [stage.outputs for stage in folder.read_manifest().stages.values()]
    record = next((files[SUMMARY] for files in outputs if SUMMARY in files), None)
    if record is None or not is_unchanged(record, folder / SUMMARY):
        return None
    figures: dict[str, Any] = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))
    return figures


def results_table(figures: dict[str, Any], title: str) -> Table:
    """Return a table of name, value and unit."""
    from rich.table import Table

    table = Table(title=title, title_justify="left", show_header=False)
    table.add_column()
    table.add_column(justify="right")
    table.add_column()
    for row in result_rows(figures):
        table.add_row(*row)
    return table


def result_rows(figures: dict[str, Any]) -> list[tuple[str, str, str]]:
    """Name, value and unit of every figure that a reader wants first, in people's units."""
    completed = figures["completed"]
    counts = [
        (f"vehicles {state}", _number(figures[f"vehicles_{state}"]), "veh")
        for state in VEHICLE_COUNTS
    ]
    return [
        *counts,
        ("mean travel time, completed", _number(completed["average_travel_time_s"]), "s"),
        ("mean delay, completed", _number(completed["average_delay_s"]), "s"),
        ("travel time, all", _number(figures["total_travel_time_veh_s"], 1 / TIMES["h"]), "veh·h"),
        ("delay, all", _number(figures["total_delay_veh_s"], 1 / TIMES["h"]), "veh·h"),
        ("distance, all", _number(figures["total_distance_veh_m"], 1 / LENGTHS["km"]), "veh·km"),
        ("mean speed", _number(figures["average_speed_m_s"], KMH, decimals=1), "km/h"),
        ("gridlock", "yes" if figures["gridlocked"] else "no", ""),
        ("time of the engine", _number(figures["engine_wall_s"], 1000, decimals=1), "ms"),
        ("seed", str(figures["seed"]), ""),
    ]


def size_in_words(size: int) -> str:
    """Return a file's size (bytes) as a reader likes it."""
    for unit, worth in (("MB", 1e6), ("kB", 1e3)):
        if size >= worth:
            return f"{size / worth:,.1f} {unit}"
    return f"{size} B"


def _number(value: float | None, factor: float = 1.0, *, decimals: int = 0) -> str:
    return "–" if value is None else f"{value * factor:,.{decimals}f}"
