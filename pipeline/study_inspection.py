"""A study on about a screen: its scenarios, what differs from the base, and where the files are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from statistics import fmean
from typing import TYPE_CHECKING, Any

from pipeline.columns import align
from pipeline.comparison_files import FOLDER
from pipeline.runs import is_unchanged
from pipeline.scenarios import BASE
from pipeline.study_folder import FIGURES, StudyFolder, StudyManifest
from pipeline.sweep_results import SWEEP
from uxsim_geo.analysis.comparison.quantities import TOTALS

if TYPE_CHECKING:
    import pandas as pd

#: figures that are shown, of all that figures.csv has
KEY_FIGURES = (
    "total_delay_veh_h",
    "total_travel_time_veh_h",
    "average_speed_kmh",
    "vehicles_completed",
    "vehicles_unfinished",
)

#: scenarios that fit a screen
MOST_SHOWN = 12

#: of the comparison
TOTALS_FILE = f"{FOLDER}/totals.csv"

#: files that are named where they are there, and what they hold
PLACES = {
    "comparison.html": "what differs, to read",
    "comparison.gpkg": "what differs, for a GIS",
    TOTALS_FILE: "what differs in all figures, with intervals",
    FIGURES: "all figures of all runs",
    SWEEP: "parameters and figures of the points of the sweep",
    "runs": "the runs, by scenario and seed",
    "study.log": "what was said",
}


def describe_study(path: Path) -> str:
    """Scenarios with their runs, key figures with their differences, and files."""
    manifest = StudyFolder(path).read_manifest()
    parts = [
        _heading(manifest),
        align(list(_scenarios(manifest)), right=(1, 2)),
        *_failed(manifest),
    ]
    if FIGURES in manifest.outputs:
        parts += _figures(path, manifest)
    places = [(str(path / name), what) for name, what in PLACES.items() if (path / name).exists()]
    return "\n\n".join(filter(None, [*parts, align(places)]))


def _heading(manifest: StudyManifest) -> str:
    study = manifest.study
    state = "finished" if manifest.is_finished else "not finished: under way, or it broke off"
    seeds = ", ".join(map(str, study.get("seeds", ()))) or "none yet"
    heading = f"study {study['name']}, {state} {study.get('ended', '')}".rstrip()
    return f"{heading}\nseeds {seeds}"


def _shown(manifest: StudyManifest) -> list[str]:
    return list(manifest.study.get("scenarios", ()))[:MOST_SHOWN]


def _scenarios(manifest: StudyManifest) -> Iterator[tuple[str, ...]]:
    """Yield a row for each scenario: runs done and failed, and the first edits."""
    every, shown = manifest.study.get("scenarios", ()), _shown(manifest)
    if every:
        yield ("scenario", "done", "failed", "edits")
    for name in shown:
        status = [run["status"] for run in manifest.runs if run["scenario"] == name]
        done = status.count("finished")
        edits = manifest.study.get("edits", {}).get(name, ())
        yield (name, f"{done:,}", f"{len(status) - done:,}", _shortened(edits))
    if len(every) > len(shown):
        yield (f"and {len(every) - len(shown):,} more", "", "", "")


def _shortened(edits: list[str], limit: int = 60) -> str:
    text = "; ".join(edits)
    return text if len(text) <= limit else f"{text[: limit - 2]} …"


def _failed(manifest: StudyManifest) -> Iterator[str]:
    lines = [
        f"{run['scenario']}, seed {run['seed']} failed: {'; '.join(run['problems'])}"
        for run in manifest.runs
        if run["status"] != "finished"
    ]
    if lines:
        more = [f"and {len(lines) - MOST_SHOWN:,} more"] if len(lines) > MOST_SHOWN else []
        yield "\n".join([*lines[:MOST_SHOWN], *more])


def _figures(path: Path, manifest: StudyManifest) -> Iterator[str]:
    """Yield a table of key figures: means of the base, and what is added to them."""
    import pandas as pd

    names = [name for name in (FIGURES, TOTALS_FILE) if name in manifest.outputs]
    changed = [name for name in names if not is_unchanged(manifest.outputs[name], path / name)]
    if changed:
        yield f"{' and '.join(changed)}: not as the study wrote it, and not shown; call it again"
        return
    runs = pd.read_csv(path / FIGURES)
    compared = pd.read_csv(path / TOTALS_FILE) if TOTALS_FILE in names else None
    known = {quantity.name: quantity for quantity in TOTALS}
    rows = [("mean of the seeds", *(known[name].title for name in KEY_FIGURES))]
    rows += [("", *(known[name].unit for name in KEY_FIGURES))]
    for name in _shown(manifest):
        if name == BASE or compared is None:
            rows.append((name, *(_mean(runs, name, figure) for figure in KEY_FIGURES)))
        else:
            told = compared[compared.iloc[:, 0] == name].set_index("figure")
            by_figure: Mapping[Any, Any] = told.to_dict("index")
            if by_figure:  # points of a sweep are not compared
                rows.append((name, *(_difference(by_figure.get(one)) for one in KEY_FIGURES)))
    what = (
        "differences from the base, with half of the 95 % interval" if TOTALS_FILE in names else ""
    )
    yield "\n".join(filter(None, [align(rows, right=range(1, 6)), what]))


def _mean(runs: pd.DataFrame, scenario: str, figure: str) -> str:
    values = runs.loc[runs["scenario"] == scenario, figure].dropna()
    return _number(fmean(values)) if len(values) else "–"


def _difference(row: Mapping[str, Any] | None) -> str:
    """Write a difference with its half width; one that is undefined as such."""
    import pandas as pd

    if row is None or pd.isna(row["difference"]):
        return "–"
    text = _number(row["difference"], sign="+")
    if pd.isna(row["half_width"]):
        return text
    # of sums of floating-point numbers, not of traffic
    width = 0.0 if row["half_width"] < 1e-9 * abs(row["difference"]) else row["half_width"]
    return f"{text} ± {_number(width)}"


def _number(value: float, sign: str = "") -> str:
    return f"{value:{sign},.0f}" if abs(value) >= 1000 else f"{value:{sign}.4g}"
