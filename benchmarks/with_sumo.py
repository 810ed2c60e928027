"""Run one case with SUMO's mesoscopic model in a process of its own, and print its figures.

FOLDER OPTIONS, with ``seed`` and ``sumo``, the program. Every vehicle may change its route every
``route_update_interval`` by the mean speeds of the links, as drivers do in the other engines.
"""

from __future__ import annotations

import os
import re
import subprocess
import time
from collections.abc import Sequence

from measuring import MB, RSS_UNIT, Told, give, told

#: headways of one reaction time of 1 s whether traffic flows or stands; one queue a lane
MODEL = ["--mesosim", "--meso-tauff", "1", "--meso-taufj", "1", "--meso-taujf", "1"]
MODEL += ["--meso-taujj", "1"]
QUIET = ["--no-step-log", "--no-warnings", "--duration-log.statistics"]


def command(asked: Told) -> list[str]:
    """The call of SUMO; the result is a row for each trip, as from the other engines."""
    interval = str(asked.case["route_update_interval"])
    routes = ["--device.rerouting.probability", "1", "--device.rerouting.period", interval]
    routes += ["--device.rerouting.adaptation-interval", "60", "--junction-taz"]
    routes += ["--device.rerouting.adaptation-steps", "0", "--routing-algorithm", "astar"]
    files = ["-n", "sumo.net.xml", "-r", "sumo.trips.xml", "--tripinfo-output", "sumo.trips.out"]
    times = ["--end", str(asked.case["duration"]), "--seed", str(asked.options["seed"])]
    return [asked.options["sumo"], *files, *times, *MODEL, *routes, *QUIET]


def run(words: Sequence[str], asked: Told) -> tuple[str, float, float]:
    """Run a command; gives what it says, the most memory that it held, MB, and its CPU time, s."""
    process = subprocess.Popen(words, cwd=asked.folder, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None, "it is a pipe"
    said = process.stdout.read()
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"SUMO ended with {process.returncode}")
    return said, used.ru_maxrss * RSS_UNIT / MB, used.ru_utime + used.ru_stime


def number(said: str, name: str) -> float:
    """A number of SUMO's statistics, by the word before it."""
    found = re.search(rf"{name}: ([0-9.]+)", said)
    return float(found[1]) if found else float("nan")


def main() -> None:
    """Run what the command line says."""
    asked = told()
    started = time.perf_counter()
    _, before, _ = run([asked.options["sumo"], "--version"], asked)
    start = time.perf_counter() - started
    said, peak, busy = run(command(asked), asked)
    whole = time.perf_counter() - started - 2 * start
    inserted, running = number(said, "Inserted"), number(said, "Running")
    figures = {
        "engine_s": number(said, "Duration"),
        "whole_s": whole,
        "cpu_s": busy,
        "vehicles": number(said, "Loaded") if "Loaded" in said else inserted,
        "completed": inserted - running,
    }
    give(figures | {"start_s": start, "peak_mb": peak, "run_mb": peak - before})


if __name__ == "__main__":
    main()
