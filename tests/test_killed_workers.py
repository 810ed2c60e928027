"""Processes of a study that are killed: what they did is redone, and nothing is left of it."""

from __future__ import annotations

import os
import random
from functools import partial
from pathlib import Path

import pytest
from study_files import STUDY, results, run_folder, study, write_study

pytest.importorskip("resource", reason="needs signals of a Unix")

from deaths import die_before
from test_killed import MOMENTS

from pipeline.study_jobs import Job, Report, run_job
from pipeline.study_processes import Processes
from pipeline.verification import verify_run

TWO = STUDY.replace("seeds: 3", "seeds: 2")

#: which change of its run's folder, or of the store, a process does not live to make; 0: none
CHANGE = "UXSIM_GEO_TEST_CHANGE"


def killed_once(job: Job) -> Report:
    """Do a run; one of them is killed in the middle, the first time; its changes are counted."""
    counted = job.store.parent.parent / "counted"
    if (job.scenario, job.seed) == ("larger", 1) and not counted.exists():
        with counted.open("wb", buffering=0) as file:
            die_before(int(os.environ[CHANGE]), str(job.store.parent), file)
            return run_job(job)
    return run_job(job)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    folder = tmp_path_factory.mktemp("undisturbed")
    write_study(folder, TWO)
    study(folder)
    return results(folder)


def done_with(folder: Path, change: int, patch: pytest.MonkeyPatch) -> int:
    """Do the study with a process that dies before a change; return how many it began."""
    write_study(folder, TWO)
    patch.setenv(CHANGE, str(change))
    patch.setattr("pipeline.study.Processes", partial(Processes, work=killed_once))
    said = study(folder, scheduler="processes", workers=2)
    assert not [line for line in said.lines if "problem" in line]
    return (folder / "counted").stat().st_size


def test_a_worker_that_is_killed_at_any_moment_is_made_good(
    tmp_path: Path, undisturbed: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    changes = done_with(tmp_path / "all", 0, monkeypatch)
    assert changes > 20
    for change in random.Random(7).sample(range(1, changes + 1), min(MOMENTS // 2, changes)):
        folder = tmp_path / str(change)
        assert done_with(folder, change, monkeypatch) == change - 1
        assert results(folder) == undisturbed, change
        assert verify_run(run_folder(folder, "larger", 1)).remarks == []
        left = [path for path in folder.rglob("*") if ".part" in path.name]
        assert left + list((folder / "runs/store/unfinished").iterdir()) == []
