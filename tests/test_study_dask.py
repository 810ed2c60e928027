"""Studies by Dask: the same bytes as by processes, on this machine and by workers elsewhere."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from conftest import REPOSITORY
from study_files import results, run_folder, started, study, write_study

from pipeline.cli import main

pytest.importorskip("distributed", reason="the extra dask is not installed")


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """What one process leaves, run by run."""
    folder = tmp_path_factory.mktemp("undisturbed")
    write_study(folder)
    study(folder)
    return results(folder)


def dask(*arguments: str) -> subprocess.Popen[str]:
    """Start a command of Dask, with a pipe for what it says."""
    environment = {**os.environ, "PYTHONPATH": str(REPOSITORY)}
    return subprocess.Popen(
        [sys.executable, "-m", "dask", *arguments, "--host", "127.0.0.1"],
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
    )


def worker(address: str) -> subprocess.Popen[str]:
    """Start a worker without a nurse, which ends where it is killed."""
    return dask("worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard")


@pytest.fixture
def address() -> Iterator[str]:
    """Address of a scheduler in a process of its own."""
    process = dask("scheduler", "--port", "0", "--no-dashboard", "--no-jupyter")
    assert process.stderr is not None
    for line in process.stderr:
        if "Scheduler at:" in line:
            yield line.split("Scheduler at:")[1].strip()
            break
    else:
        pytest.fail("the scheduler did not start")
    process.kill()
    process.communicate()


def test_a_cluster_of_this_machine_leaves_the_same_bytes(
    tmp_path: Path, undisturbed: dict[str, str]
) -> None:
    write_study(tmp_path)
    done = started(tmp_path, "--scheduler", "dask", "--workers", "2")
    _, said = done.communicate()
    assert done.returncode == 0, said
    assert results(tmp_path) == undisturbed


def test_two_workers_in_processes_of_their_own_leave_the_same_bytes(
    tmp_path: Path, address: str, undisturbed: dict[str, str]
) -> None:
    workers = [worker(address) for _ in range(2)]
    try:
        write_study(tmp_path)
        assert not [line for line in study(tmp_path, scheduler=address).lines if "problem" in line]
        assert results(tmp_path) == undisturbed
    finally:
        for process in workers:
            process.kill()
            process.communicate()


@pytest.mark.skipif(os.name != "posix", reason="needs named pipes")
def test_what_a_lost_worker_was_doing_is_redone(
    tmp_path: Path, address: str, undisturbed: dict[str, str]
) -> None:
    write_study(tmp_path)
    log = run_folder(tmp_path, "larger", 1) / "run.log"
    log.parent.mkdir(parents=True)
    os.mkfifo(log)
    first = worker(address)
    driver = started(tmp_path, "--scheduler", address)
    with log.open("rb"):  # opened at both ends: the worker is in the middle of this run
        log.unlink()
        first.kill()
        first.communicate()
    second = worker(address)
    try:
        _, said = driver.communicate()
    finally:
        second.kill()
        second.communicate()
    assert driver.returncode == 0, said
    assert results(tmp_path) == undisturbed


def test_no_scheduler_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("pipeline.study_dask.PATIENCE_S", 1)
    path = write_study(tmp_path)
    options = ["--out", str(tmp_path / "runs"), "--scheduler", "tcp://127.0.0.1:9"]
    assert main(["study", str(path), *options]) == 2
    assert "no Dask cluster with workers there" in capsys.readouterr().err
