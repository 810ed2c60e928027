"""Makes the page about performance, and its plot, from what the benchmarks have measured.

python benchmarks/page.py RESULTS PAGE, with RESULTS the ``results.json`` of a run; the plot goes
into ``images`` beside the page.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any, NamedTuple

from figures import GOALS, Place, Records, Spread, attained, figure, is_met, ratio
from plan import OURS, UXSIM, UXSIM_LOGS
from plot import draw

PLOT = "performance_growth.png"
BUSY = 1.1  # more wall than CPU time than that: something else was running

HEAD = """# Performance

What a run costs in time and memory, beside UXsim's compiled engine and SUMO's mesoscopic model
where they are installed. This page is made by `make bench` from what it has measured.

{machine}

- All engines get the same tables, in turns (A, B, C, A, B, C …), every run in a fresh process and
  with another seed. Numbers are medians, with the least and the most in brackets. Ratios are those
  of runs of the same round.
- *Engine* is the time of the simulation alone, routes included: here `engine_wall_s`, after which
  every trajectory follows from events and trips; in UXsim its compiled loop (`exec_simulation` also
  collects what was logged); in SUMO the duration that it tells.
- *End to end* goes from reading tables to results in memory (SUMO: to a file of trips); loading
  programs, libraries and compiled code comes before, as *start-up*.
- *Memory* is the most that the process has held; *run adds* is that without what it held before it
  read anything.
- A *link entry* is a platoon that enters a link. SUMO moves single vehicles: it has no Δn.
- Beside UXsim demand is cut to whole platoons here too (`demand_rounding: truncate`), so that both
  move the same vehicles. SUMO's node model and route choice are others; its vehicles have the same
  headways and jam density, and look for a new route as often.
"""

GROWTH = """## Growth

![Plots with logarithmic axes: time and memory against what makes a run large](images/{plot})

*Medians of {rounds} runs, bars from the least to the most. Dashed: in proportion to the axis below,
or to its inverse. On a grid that grows, trips grow longer in step with its width.*
"""


class Column(NamedTuple):
    """A column of the table: its title, the figure, and its factor from it."""

    title: str
    figure: str
    factor: float = 1.0


COLUMNS = (
    Column("engine, s", "engine_s"),
    Column("end to end, s", "whole_s"),
    Column("ns per link entry", "entry_ns"),
    Column("memory, MB", "peak_mb"),
    Column("run adds, MB", "run_mb"),
    Column("start-up, s", "start_s"),
    Column("vehicles", "vehicles"),
    Column("arrived", "completed"),
)
UPDATE_COLUMNS = (
    Column("an update, ms", "update_ms"),
    Column("the first, ms", "first_update_ms"),
    Column("memory, MB", "peak_mb"),
    Column("run adds, MB", "run_mb"),
)
RATIOS = (
    (UXSIM, "engine_s", "engine_s", "loop / engine"),
    (UXSIM, "whole_s", "whole_s", "end to end"),
    (UXSIM, "run_mb", "run_mb", "run adds memory"),
    (UXSIM, "peak_mb", "peak_mb", "memory, whole process"),
    (UXSIM_LOGS, "exec_s", "engine_s", "`exec_simulation` / engine"),
    (UXSIM_LOGS, "run_mb", "run_mb", "run adds memory"),
    ("SUMO, mesoscopic", "engine_s", "engine_s", "engine"),
    ("SUMO, mesoscopic", "whole_s", "whole_s", "end to end"),
)


def number(value: float) -> str:
    """Three digits that count, with commas between thousands."""
    if value >= 1000:
        return f"{value:,.0f}"
    return f"{float(f'{value:.3g}'):g}"


def told(spread: Spread | None, factor: float = 1.0) -> str:
    """Median, and where there is more than one run, from least to most."""
    if spread is None:
        return "–"
    least, middle, most = (number(factor * value) for value in spread[:3])
    return middle if least == most else f"{middle} ({least}–{most})"


def page(results: dict[str, Any]) -> str:
    """The whole page."""
    records, known = results["runs"], results["cases"]
    ordinary = [case for case in known if not case["series"] and not case["updates"]]
    updates = [case for case in known if not case["series"] and case["updates"]]
    series = [case for case in known if case["series"]]
    parts = [HEAD.format(machine=_machine(results)), _busy(records)]
    parts += ["## Cases\n", _cases(records, ordinary, COLUMNS)]
    parts += ["## Ratios\n\nHow many times less is needed here.\n", _ratios(records, ordinary)]
    if updates:
        parts += ["## Updates of routes\n", _cases(records, updates, UPDATE_COLUMNS)]
    parts += ["## Goals\n", _goals(records)]
    if series:
        parts += [GROWTH.format(plot=PLOT, rounds=max(case["rounds"] for case in series))]
        parts += [_series(records, series)]
    parts += [_not_run(results)]
    return "\n".join(part for part in parts if part)


def table(titles: list[str], rows: list[list[str]]) -> str:
    """A table; its first column is text, the others are numbers."""
    lines = [titles, ["---", *["---:"] * (len(titles) - 1)], *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def _machine(results: dict[str, Any]) -> str:
    on = results["machine"]
    versions = {"uxsim-geo": results["version"], "Python": on["python"]} | on["libraries"]
    versions |= results["peers"]
    return (
        f"Measured {on['date']} on {on['processor']}, {on['cores']} cores, "
        f"{on['memory_gb']:.0f} GB, {on['system']}: "
        f"{', '.join(f'{name} {version}' for name, version in versions.items())}. "
        "The first start, compiling where that was needed, took "
        f"{number(results['first_start_s'])} s."
    )


def _busy(records: Records) -> str:
    """Say so where the machine had other work: then wall time is not what the program needs."""
    shares = [
        run["figures"]["engine_s"] / run["figures"]["engine_cpu_s"]
        for run in records
        if run.get("figures", {}).get("engine_cpu_s", 0.0) > 0.1 and run["threads"] == 1
    ]
    busy = sum(share > BUSY for share in shares)
    if busy <= 0.1 * len(shares):
        return ""
    return (
        f"**The machine was busy with other work:** in {busy} of {len(shares)} runs the engine "
        "waited for the processor. These times are too long.\n"
    )


def _cases(records: Records, known: list[dict[str, Any]], columns: tuple[Column, ...]) -> str:
    rows = []
    for case in known:
        for engine in case["engines"]:
            cells = [figure(records, case["key"], engine, column.figure) for column in columns]
            if any(cells):
                factors = [column.factor for column in columns]
                numbers = [told(*both) for both in zip(cells, factors, strict=True)]
                rows.append([f"{case['title']}: {engine}", *numbers])
    return table(["case", *[column.title for column in columns]], rows)


def _ratios(records: Records, known: list[dict[str, Any]]) -> str:
    rows = []
    for case in known:
        for engine, above, below, what in RATIOS:
            ours = Place(case["key"], OURS, below)
            found = ratio(records, Place(case["key"], engine, above), ours)
            if found:
                rows.append([f"{case['title']}: {engine}, {what}", told(found), str(found.runs)])
    return table(["against", "times", "rounds"], rows)


def _goals(records: Records) -> str:
    rows = []
    for goal in GOALS:
        found = attained(records, goal)
        sign, unit = ("≤", f" {goal.unit}") if goal.per is None else ("≥", " ×")
        answer = "not run" if found is None else "yes" if is_met(goal, found) else "**no**"
        rows.append([goal.what, f"{sign} {number(goal.bound)}{unit}", told(found), answer])
    return table(["what", "goal", "measured", "met"], rows)


def _series(records: Records, known: list[dict[str, Any]]) -> str:
    columns = (COLUMNS[0], COLUMNS[2], COLUMNS[3], COLUMNS[4], UPDATE_COLUMNS[0])
    return _cases(records, known, columns)


def _not_run(results: dict[str, Any]) -> str:
    titles = {case["key"]: case["title"] for case in results["cases"]}
    stopped = [
        [f"{titles[run['case']]}: {run['engine']}", run["reason"]]
        for run in results["runs"]
        if "reason" in run
    ]
    rows = stopped + [[title, why] for title, why in results["skipped"].items()]
    if not rows:
        return ""
    lines = [["what", "why"], ["---", "---"], *rows]
    return "## Not measured\n\n" + "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def write(results: dict[str, Any], path: Path) -> None:
    """Write the page, and draw its plot."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(page(results), encoding="utf-8")
    if any(case["series"] for case in results["cases"]):
        (path.parent / "images").mkdir(exist_ok=True)
        draw(results, path.parent / "images" / PLOT)


if __name__ == "__main__":
    write(json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")), Path(sys.argv[2]))
