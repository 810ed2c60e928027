"""Studies by several processes: the same bytes, whoever is killed, stopped or full in between."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest
from conftest import REPOSITORY
from study_files import (
    STUDY,
    command,
    lines_of,
    manifest,
    results,
    run_folder,
    started,
    study,
    write_study,
)

from pipeline.cli import main
from pipeline.study_jobs import Job, Report, run_job
from pipeline.study_processes import ATTEMPTS, Processes
from pipeline.verification import verify_run

posix = pytest.mark.skipif(os.name != "posix", reason="needs signals and named pipes")


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """What one process leaves that nothing disturbs."""
    folder = tmp_path_factory.mktemp("undisturbed")
    write_study(folder)
    study(folder)
    return results(folder)


def test_processes_leave_the_same_bytes(tmp_path: Path, undisturbed: dict[str, str]) -> None:
    write_study(tmp_path)
    said = study(tmp_path, scheduler="processes", workers=2)
    assert results(tmp_path) == undisturbed
    assert lines_of(said, "from the store") == [f"nothing, seed {seed}" for seed in range(3)]


def killed_once(job: Job) -> Report:
    """Do a run, killed the first time when half of it is written."""
    marker = job.store.parent / "killed"
    if (job.scenario, job.seed) == ("larger", 1) and not marker.exists():
        marker.touch()
        die_after_the_trips()
    return run_job(job)


def killed_always(job: Job) -> Report:
    """Do a run; one of them is killed every time."""
    if (job.scenario, job.seed) == ("larger", 1):
        with (job.store.parent / "killed").open("a", encoding="utf-8") as file:
            file.write("once more\n")
        die_after_the_trips()
    return run_job(job)


def die_after_the_trips() -> None:
    import uxsim_geo.parquet

    write = uxsim_geo.parquet.write_table

    def write_and_die(table: object, path: Path) -> None:
        write(table, path)  # type: ignore[arg-type]
        os.kill(os.getpid(), signal.SIGKILL)

    uxsim_geo.parquet.write_table = write_and_die  # type: ignore[assignment]


@posix
def test_what_a_lost_worker_was_doing_is_redone(
    tmp_path: Path, undisturbed: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    write_study(tmp_path)
    monkeypatch.setattr("pipeline.study.Processes", partial(Processes, work=killed_once))
    said = study(tmp_path, scheduler="processes", workers=2)
    assert (tmp_path / "runs/killed").is_file()
    assert not [line for line in said.lines if "problem" in line]
    assert results(tmp_path) == undisturbed
    assert verify_run(run_folder(tmp_path, "larger", 1)).wrong == []


@posix
def test_a_run_that_kills_every_worker_is_told_and_the_others_are_done(
    tmp_path: Path, undisturbed: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    write_study(tmp_path)
    monkeypatch.setattr("pipeline.study.Processes", partial(Processes, work=killed_always))
    said = study(tmp_path, scheduler="processes", workers=2)
    assert len((tmp_path / "runs/killed").read_text().splitlines()) == ATTEMPTS + 1
    (problem,) = (line for line in said.lines if "problem" in line)
    assert "larger, seed 1: " in problem
    assert "signal 9" in problem
    assert str(run_folder(tmp_path, "larger", 1) / "run.log") in problem
    found = results(tmp_path)
    assert {name for name in undisturbed if found.get(name) != undisturbed[name]} == {
        name
        for name in undisturbed
        if (name.startswith("runs/larger/seed_1/") and "measures" in name) or name == "figures.csv"
    }
    monkeypatch.undo()
    study(tmp_path, scheduler="processes", workers=2)
    assert results(tmp_path) == undisturbed


@pytest.fixture
def blocked(tmp_path: Path) -> Path:
    """A study of which one run waits in the middle of it, until its log is read: the log's path."""
    write_study(tmp_path)
    log = run_folder(tmp_path, "larger", 2) / "run.log"
    log.parent.mkdir(parents=True)
    os.mkfifo(log)
    return log


def wait_for_runs(process: subprocess.Popen[str], number: int) -> None:
    """Read what a study says until so many runs are done."""
    assert process.stderr is not None
    for line in process.stderr:
        if line.strip().startswith(f"{number} of"):
            return
    pytest.fail("the study ended too early")


def let_go(blocked: Path) -> None:
    """Let the run go on that waits for a reader of its log; what it logs next is a file."""
    with blocked.open("rb") as log:
        blocked.unlink()
        log.read()


@posix
@pytest.mark.parametrize("workers", ["1", "2"])
def test_ctrl_c_leaves_what_is_finished(
    tmp_path: Path, blocked: Path, undisturbed: dict[str, str], workers: str
) -> None:
    # all that comes before the blocked run is done: with one process in turn
    process = started(tmp_path, "--workers", workers)
    wait_for_runs(process, 8)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate()
    assert process.returncode == 1
    assert "interrupted" in said
    assert "Traceback" not in said
    assert not manifest(tmp_path)["study"]["finished"]
    statuses = [run["status"] for run in manifest(tmp_path)["runs"]]
    assert sorted(statuses) == ["failed", *["finished"] * 8]
    blocked.unlink()
    again = study(tmp_path, scheduler="processes", workers=2)
    assert len(lines_of(again, "up to date")) >= 8
    assert results(tmp_path) == undisturbed
    assert manifest(tmp_path)["study"]["finished"]


@posix
def test_a_killed_study_goes_on_where_it_was(
    tmp_path: Path, blocked: Path, undisturbed: dict[str, str]
) -> None:
    process = started(tmp_path, "--workers", "2")
    wait_for_runs(process, 8)
    process.kill()
    let_go(blocked)  # the worker goes on, and finds that nobody waits for it
    process.communicate()  # to the end of all that could still write here: of the workers too
    assert not (tmp_path / "runs/study/figures.csv").exists()
    assert not manifest(tmp_path)["study"]["finished"]
    again = study(tmp_path, scheduler="processes", workers=2)
    assert len(lines_of(again, "up to date")) >= 8
    assert results(tmp_path) == undisturbed


@posix
def test_a_study_is_not_done_twice_at_once(tmp_path: Path, blocked: Path) -> None:
    process = started(tmp_path, "--scheduler", "none")
    wait_for_runs(process, 8)
    second = started(tmp_path, "--scheduler", "none")
    _, said = second.communicate()
    assert second.returncode == 2
    assert "another process works on this study" in said
    let_go(blocked)
    _, said = process.communicate()
    assert process.returncode == 0, said


def test_two_studies_at_once_on_one_store(tmp_path: Path, undisturbed: dict[str, str]) -> None:
    write_study(tmp_path)
    other = STUDY.replace("name: study", "name: other")
    (tmp_path / "other.yaml").write_text(other, encoding="utf-8")
    commands = [command(tmp_path, "--workers", "1") for _ in range(2)]
    commands[1] = [part.replace("study.yaml", "other.yaml") for part in commands[1]]
    both = [
        subprocess.Popen(one, cwd=REPOSITORY, stderr=subprocess.PIPE, text=True) for one in commands
    ]
    for process in both:
        _, said = process.communicate()
        assert process.returncode == 0, said
    assert results(tmp_path) == undisturbed
    store = tmp_path / "runs/store"
    assert list((store / "unfinished").iterdir()) == []
    # each once, whole, though both made them
    study(tmp_path)
    assert main(["clean", "--out", str(tmp_path / "runs")]) == 0


FULL = """
import resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, ({size}, {size}))
from pipeline.cli import main
sys.exit(main(sys.argv[1:]))
"""


@posix
def test_a_full_disk_spoils_nothing(tmp_path: Path, undisturbed: dict[str, str]) -> None:
    write_study(tmp_path)
    # no file can be written beyond this: that of a run's events is among those that are larger
    code = FULL.format(size=9_000)
    options = command(tmp_path, "--scheduler", "none")[3:]
    done = subprocess.run(
        [sys.executable, "-c", code, *options],
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1, done.stderr
    assert "Traceback" not in done.stderr
    assert "File too large" in done.stderr
    assert not list((tmp_path / "runs").rglob(".*.part*"))
    study(tmp_path)
    assert results(tmp_path) == undisturbed


@posix
def test_a_full_file_system_spoils_nothing(tmp_path: Path, undisturbed: dict[str, str]) -> None:
    write_study(tmp_path)
    small = tmp_path / "runs"
    small.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=400k", "tmpfs", str(small)]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("no file system can be mounted here")
    try:
        done = subprocess.run(
            command(tmp_path, "--scheduler", "none"),
            cwd=REPOSITORY,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 1, done.stderr
        assert "No space left on device" in done.stderr
        assert "Traceback" not in done.stderr
        subprocess.run(["mount", "-o", "remount,size=40m", str(small)], check=True)
        study(tmp_path)
        assert results(tmp_path) == undisturbed
    finally:
        subprocess.run(["umount", str(small)], check=True)
