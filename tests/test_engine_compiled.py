"""Compiling: it changes nothing, is done once, and is not counted."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from test_engine_order import hash_of, random_case
from test_engine_pieces import under_all_control

from uxsim_geo.engine.simulation import simulate


def run_program(*lines: str, **variables: str) -> str:
    """Run some lines in a process of its own, with what this file imports at hand."""
    here = Path(__file__).parent
    paths = os.pathsep.join([str(here), str(here.parent)])
    program = "\n".join(["from test_engine_order import *", *lines])
    environment = os.environ | variables | {"PYTHONPATH": paths}
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("variable", ["NUMBA_DISABLE_JIT", "UXSIM_GEO_COUNT_REFERENCES"])
def test_the_compiler_changes_nothing(variable: str) -> None:
    """Without compilation, and with numba's reference counting on: slower, and the same bytes."""
    lines = (
        "from test_engine_pieces import under_all_control",
        "runs = [simulate(*random_case(seed)) for seed in (0, 3, 9)] + [under_all_control(3)]",
        "print(*[hash_of(run) for run in runs])",
    )
    printed = run_program(*lines, **{variable: "1", "PYTHONWARNINGS": "error"})
    runs = [simulate(*random_case(seed)) for seed in (0, 3, 9)] + [under_all_control(3)]
    assert printed.split() == [hash_of(run) for run in runs]


@pytest.mark.parametrize("told", ["route_update_weight=0.5", "route_update_weight=0.3"])
def test_the_compiler_changes_nothing_of_sweeps(told: str) -> None:
    lines = (
        "from test_engine_sweeps import Router, always_sweep",
        "Router.prepare = always_sweep",
        "net, dem, settings = random_case(4)",
        f"print(hash_of(simulate(net, dem, replace(settings, {told}))))",
    )
    printed = {run_program(*lines, NUMBA_DISABLE_JIT=off) for off in ("0", "1")}
    assert len(printed) == 1


def test_compiled_code_is_found_again_by_the_next_process(tmp_path: Path) -> None:
    lines = (
        "from uxsim_geo.engine.loop import run_until, finish",
        "simulate(*random_case(0))",
        "print(*[sum(task.stats.cache_hits.values()) for task in (run_until, finish)])",
    )
    printed = [run_program(*lines, NUMBA_CACHE_DIR=str(tmp_path)) for _ in range(2)]
    assert [line.split() for line in printed] == [["0", "0"], ["1", "1"]]


def test_compiling_is_done_before_the_clock_of_the_engine_starts() -> None:
    printed = run_program(
        "from uxsim_geo.engine.loop import run_until",
        "net, dem, settings = random_case(0)",
        "Simulation(net, dem, settings)",
        "print(len(run_until.signatures))",
    )
    assert printed.strip() == "1"
