"""Time the engine: seconds, ns per link entry and peak memory, each run in a process of its own.

python benchmarks/engine.py [--runs N]. Where UXsim is installed it runs the same tables, in turn.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from cases import CASES
from one_run import ENGINES


def one_run(case: str, engine: str, seed: int) -> dict[str, float]:
    """Run one case in a process of its own."""
    program = Path(__file__).with_name("one_run.py")
    command = [sys.executable, str(program), case, engine, str(seed)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    figures: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return figures


def spread(runs: list[dict[str, float]], figure: str, scale: float = 1.0) -> str:
    """Minimum, median and maximum of a figure."""
    values = sorted(run[figure] * scale for run in runs)
    return f"{values[0]:9.4g} {statistics.median(values):9.4g} {values[-1]:9.4g}"


def main() -> None:
    """Run all cases and print a line for each figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=5, help="runs of each case (default 5)")
    runs = parser.parse_args().runs
    start = one_run(next(iter(CASES)), "uxsim-geo", 0)["start_s"]
    print(f"first run in this installation: {start:.2f} s until the engine is ready")
    print(f"{'':<44}{'min':>9} {'median':>9} {'max':>9}")
    for case in CASES:
        results: dict[str, list[dict[str, float]]] = {engine: [] for engine in ENGINES}
        for seed in range(runs):
            for engine in ENGINES:
                results[engine].append(one_run(case, engine, seed))
        for engine, figures in results.items():
            label = f"{case}, {engine}"
            print(f"{label + ': ms':<44}{spread(figures, 'engine_s', 1000)}")
            if "entries" in figures[0]:
                for run in figures:
                    run["entry_ns"] = run["engine_s"] / run["entries"] * 1e9
                print(f"{'  ns per link entry':<44}{spread(figures, 'entry_ns')}")
                print(f"{'  s to start, compiled before':<44}{spread(figures, 'start_s')}")
            print(f"{'  MB at most, whole process':<44}{spread(figures, 'peak_mb')}")
            print(f"{'  vehicles completed':<44}{spread(figures, 'completed')}")
        if len(results) == 2:
            ours, theirs = results.values()
            pairs = zip(ours, theirs, strict=True)
            ratios = [{"ratio": their["engine_s"] / our["engine_s"]} for our, their in pairs]
            print(f"{'  times faster, run by run':<44}{spread(ratios, 'ratio')}")


if __name__ == "__main__":
    main()
