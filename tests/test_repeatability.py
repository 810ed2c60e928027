"""The shipped examples give the same values: in every process, in pieces, resumed, uncompiled.

What they gave is kept in data/example_hashes.json, whichever supported Python and libraries worked
it out. Where a change of the model is meant, `make hashes` writes it anew (CONTRIBUTING.md).
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import example_hashes
import pytest
from conftest import REPOSITORY
from example_hashes import Hashes, beside_the_tables, finished, hashes_of, kept, simulation_of

from pipeline.config import Config
from pipeline.config_file import load_config
from pipeline.scenarios import Tables
from uxsim_geo.engine.simulation import Simulation

Case = tuple[Config, Tables]

#: small enough to be worked out by plain Python
SMALL = ("gridlock", "gridlock_perimeter")

ADVICE = "where the model is meant to give something else now: make hashes"


@pytest.fixture(scope="module")
def cases() -> dict[str, Case]:
    return {name: (config, tables) for name, config, tables in example_hashes.simulations()}


def printed_by_a_process(*names: str, **variables: str) -> dict[str, Hashes]:
    """What a process of its own finds for some examples."""
    paths = os.pathsep.join([str(Path(__file__).parent), str(REPOSITORY)])
    command = [sys.executable, "-W", "error", str(Path(example_hashes.__file__)), *names]
    done = subprocess.run(
        command,
        env=os.environ | {"PYTHONPATH": paths} | variables,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found: dict[str, Hashes] = json.loads(done.stdout)
    return found


def test_every_example_that_ships_its_data_is_kept() -> None:
    assert list(kept()) == example_hashes.names()
    for name in example_hashes.DOWNLOADED:
        assert (REPOSITORY / f"configs/{name}.yaml").is_file()
    paths = (REPOSITORY / "configs").glob("*.yaml")
    whole = {path.stem for path in paths} - set(example_hashes.DOWNLOADED)
    assert {name.partition(":")[0] for name in kept()} == whole


def test_the_examples_give_what_they_gave(cases: dict[str, Case]) -> None:
    now = {name: hashes_of(finished(simulation_of(*case))) for name, case in cases.items()}
    assert now == kept(), ADVICE


def test_runs_that_were_saved_and_resumed_give_the_same(
    cases: dict[str, Case], tmp_path: Path
) -> None:
    for name, (config, tables) in cases.items():
        first = simulation_of(config, tables)
        first.advance(0.45 * first.settings.duration)
        first.save(tmp_path / "saved")
        second = Simulation.resume(tmp_path / "saved", **beside_the_tables(config))
        assert hashes_of(finished(second)) == kept()[name], name


def test_another_process_gives_the_same_whatever_its_hashing_and_threads() -> None:
    names = example_hashes.names()
    threads = dict.fromkeys(("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "ARROW_NUM_THREADS"), "1")
    assert printed_by_a_process(*names, PYTHONHASHSEED="7", **threads) == kept()


def test_plain_python_gives_the_same_as_compiled_code() -> None:
    found = printed_by_a_process(*SMALL, NUMBA_DISABLE_JIT="1")
    assert found == {name: kept()[name] for name in SMALL}


def test_another_seed_gives_something_else(cases: dict[str, Case]) -> None:
    """The hashes see what they are there to see."""
    config = load_config(REPOSITORY / "configs/gridlock.yaml", ["simulate.seed=1"])
    _, tables = cases["gridlock"]
    other = hashes_of(finished(simulation_of(config, tables)))
    assert other["events"] != kept()["gridlock"]["events"]
    assert other["trips"] != kept()["gridlock"]["trips"]
    # the same priorities, by a table of overrides and by control: of no other two runs one hash
    assert kept()["gridlock_prevented"] == kept()["gridlock_merge_priority"]
    assert len({one["events"] for one in kept().values()}) == len(kept()) - 1
