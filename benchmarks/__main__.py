"""Times uxsim-geo, UXsim's compiled engine and SUMO's mesoscopic model on the same tables.

python benchmarks [--quick] [--only KEY ...] writes ``results.json``, ``runs.csv`` and a page with a
plot into build/bench. Peers are run where they are installed: UXsim in the interpreter that --peers
names (else the variable BENCH_PYTHON), SUMO beside it, in $SUMO_HOME/bin or on the path.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import shutil
import sys
import time
from dataclasses import asdict
from fnmatch import fnmatch
from functools import partial
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from cases import Tables, city, write_tables
from machine import machine, sumo_version, version_in
from page import write
from plan import OURS, SUMO, UXSIM, UXSIM_LOGS, Case, compared, large, series
from sumo_files import write_sumo
from turns import Engine, Limits, run_in_turns, run_once

from uxsim_geo.version import __version__

QUICK_VEHICLES, QUICK_ROUNDS = 40_000, 2
QUICK = ("sioux-falls-5", "grid-11", "sketch-30")


def main() -> None:
    """Run what the command line asks for."""
    told = arguments()
    engines, peers = installed(told)
    results: dict[str, Any] = {"machine": machine(), "version": __version__, "peers": peers}
    results |= {"cases": [], "runs": [], "skipped": {}}
    results["first_start_s"] = compile_first(told.out, engines[OURS])
    started = time.perf_counter()
    for case in chosen(told):
        missing = [path.name for path in case.files if not path.exists()]
        if missing:
            results["skipped"][case.title] = f"needs {missing[0]} in UXSIM_GEO_SHARED"
            continue
        print(f"{time.perf_counter() - started:6.0f} s  {case.title}", flush=True)
        run_case(case, told, engines, results)
        save(results, told.out)  # what stands when somebody stops it here
    save(results, told.out)
    write(results, told.out / "performance.md")
    print(f"{time.perf_counter() - started:6.0f} s  see {told.out / 'performance.md'}")


def arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    add = parser.add_argument
    add("--quick", action="store_true", help="the small cases alone, twice each: a few minutes")
    add("--only", nargs="+", default=["*"], metavar="KEY", help="cases, by patterns as 'grid*'")
    add("--rounds", type=int, help="runs of each (default: as the plan says, 3 or 5)")
    add("--seconds", type=float, default=90.0, help="of one run at most (default 90)")
    add("--together", type=float, default=30.0, help="s for an engine at a case (default 30)")
    add("--gb", type=float, default=8.0, help="memory of one run at most (default 8)")
    add("--out", type=Path, default=Path("build/bench"), help="folder (default build/bench)")
    given = os.environ.get("BENCH_PYTHON") or sys.executable
    add("--peers", default=given, metavar="PYTHON", help="interpreter that has UXsim")
    return parser.parse_args()


def installed(told: argparse.Namespace) -> tuple[dict[str, Engine], dict[str, str]]:
    """The engines that can be run here, and the versions of the peers among them."""
    engines = {OURS: Engine(OURS, sys.executable, "with_uxsim_geo.py", {})}
    peers = {}
    if version := version_in(told.peers, "uxsim"):
        peers["UXsim"] = version
        for name, logs in ((UXSIM, False), (UXSIM_LOGS, True)):
            engines[name] = Engine(name, told.peers, "with_uxsim.py", {"logs": logs})
    homes = [Path(told.peers).parent, Path(os.environ.get("SUMO_HOME", "")) / "bin"]
    path = os.pathsep.join([*map(str, homes), os.environ.get("PATH", "")])
    sumo = shutil.which("sumo", path=path)
    if sumo and (version := sumo_version(sumo)):
        peers["SUMO"] = version
        engines[SUMO] = Engine(SUMO, sys.executable, "with_sumo.py", {"sumo": sumo})
    return engines, peers


def compile_first(out: Path, engine: Engine) -> float:
    """Have the engine compiled where it has not been, so that no run pays for it; s to start."""
    case = Case("first", "first", partial(city, 3, 2, 10.0, 100.0), duration=200.0)
    folder = prepare(case, case.make(), out)
    figures = run_once(folder, engine, 0, Limits(600.0, 8000.0, 600.0))
    shutil.rmtree(folder)
    return figures["start_s"]


def prepare(case: Case, tables: Tables, out: Path) -> Path:
    """Write what every engine reads of a case; gives the folder."""
    folder = out.resolve() / "cases" / case.key
    write_tables(tables, folder)
    (folder / "case.json").write_text(json.dumps(case.settings()), encoding="utf-8")
    return folder


def chosen(told: argparse.Namespace) -> list[Case]:
    """The cases that are asked for."""
    if told.quick:
        cases = [case for case in compared() if case.key in QUICK] + series(QUICK_VEHICLES)
    else:
        cases = [*compared(), *large(), *series()]
    return [case for case in cases if any(fnmatch(case.key, name) for name in told.only)]


def run_case(
    case: Case, told: argparse.Namespace, engines: dict[str, Engine], results: dict[str, Any]
) -> None:
    """Write a case's tables, run it, and add what was measured to the results."""
    tables = case.make()
    folder = prepare(case, tables, told.out)
    asked = [engines[name] for name in case.engines if name in engines]
    for engine in asked:
        if engine.name == SUMO:
            netconvert = str(Path(engine.options["sumo"]).with_name("netconvert"))
            write_sumo(tables, folder, netconvert)
    rounds = told.rounds or (min(case.rounds, QUICK_ROUNDS) if told.quick else case.rounds)
    limits = Limits(told.seconds, 1000 * told.gb, told.together)
    runs = run_in_turns(folder, asked, rounds, limits, print)
    results["runs"] += [run | {"case": case.key, "threads": case.threads} for run in runs]
    sizes = {"nodes": len(tables.nodes), "links": len(tables.links), "rounds": rounds}
    what = {key: value for key, value in asdict(case).items() if key not in ("make", "files")}
    results["cases"].append(what | sizes)
    shutil.rmtree(folder)


def save(results: dict[str, Any], folder: Path) -> None:
    """Write all that has been measured so far: as JSON, and a row a figure as CSV."""
    text = json.dumps(results, indent=1, ensure_ascii=False)
    (folder / "results.json").write_text(text + "\n", encoding="utf-8")
    with (folder / "runs.csv").open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow(["case", "engine", "round", "figure", "value"])
        for run in results["runs"]:
            for name, value in run.get("figures", {"reason": run.get("reason")}).items():
                out.writerow([run["case"], run["engine"], run["round"], name, value])


if __name__ == "__main__":
    main()
