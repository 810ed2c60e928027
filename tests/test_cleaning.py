"""What ``clean`` shows and removes, and what it leaves."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from study_files import STUDY, manifest, results, run_folder, study, write_study

from pipeline.cleaning import A_DAY
from pipeline.cli import main

TWO = STUDY.replace("seeds: 3", "seeds: 2")


def clean(folder: Path, *options: str) -> int:
    return main(["clean", "--out", str(folder / "runs"), *options])


@pytest.fixture
def done(tmp_path: Path) -> Path:
    write_study(tmp_path, TWO)
    study(tmp_path)
    return tmp_path


def entries(folder: Path) -> set[str]:
    return {path.name for path in (folder / "runs/store").glob("??/*")}


def test_what_a_study_refers_to_stays(done: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before, kept = results(done), entries(done)
    assert clean(done, "--remove") == 0
    assert "nothing left over" in capsys.readouterr().out
    assert (results(done), entries(done)) == (before, kept)


def test_runs_that_a_study_no_longer_has_go_with_their_entries(
    done: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_study(done, TWO.replace("platoon_size: 10", "platoon_size: 4").replace("larger", "four"))
    study(done)
    old = run_folder(done, "larger", 1)
    kept = entries(done)
    assert clean(done) == 0
    shown = capsys.readouterr().out
    assert f"{old}  " in shown
    assert "would be removed" in shown
    assert old.is_dir()
    assert entries(done) == kept
    assert clean(done, "--remove") == 0
    assert not old.exists()
    # tables of the scenario, and its runs and their measures
    assert len(kept - entries(done)) == 1 + 2 * 2
    assert clean(done) == 0
    assert "nothing left over" in capsys.readouterr().out.splitlines()[-1]
    assert len(study(done).lines) == 1 + len(manifest(done)["runs"]) + 3 + 1


def test_a_study_that_is_not_finished_loses_no_runs(done: Path) -> None:
    write_study(done, TWO.replace("larger", "other"))
    text = (
        (done / "runs/study/manifest.json")
        .read_text()
        .replace('"finished": true', '"finished": false')
    )
    (done / "runs/study/manifest.json").write_text(text.replace('"runs/larger', '"runs/gone'))
    assert clean(done, "--remove") == 0
    assert run_folder(done, "larger", 1).is_dir()


def test_entries_of_a_study_that_was_deleted_go(done: Path) -> None:
    other = TWO.replace("name: study", "name: other").replace("seeds: 2", "seeds: [1, 7]")
    write_study(done, other)
    study(done)
    assert clean(done, "--remove") == 0
    shared = entries(done)
    for path in sorted((done / "runs/other").rglob("*"), reverse=True):
        path.rmdir() if path.is_dir() else path.unlink()
    assert clean(done, "--remove") == 0
    lost = shared - entries(done)
    # seed 7 of base (and of nothing) and of larger, with their measures
    assert len(lost) == 2 * 2
    write_study(done, TWO)
    assert all("up to date" in line for line in study(done).lines if " of " in line)


def test_unfinished_entries_of_dead_processes_go(done: Path) -> None:
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    host = socket.gethostname()
    folder = done / "runs/store/unfinished"
    names = {
        "dead": f"{host}-{ended.pid}-0f",
        "own": f"{host}-{os.getpid()}-0f",
        "elsewhere": f"not{host}-{ended.pid}-0f",
        "old": f"not{host}-{ended.pid}-0e",
    }
    for name in names.values():
        (folder / name).mkdir()
        (folder / name / "half").write_text("half")
    os.utime(folder / names["old"], (1e9, 1e9))
    assert clean(done, "--remove") == 0
    assert {path.name for path in folder.iterdir()} == {names["own"], names["elsewhere"]}


def test_unfinished_files_go_after_a_day(done: Path) -> None:
    run = run_folder(done, "base", 0)
    old, young = (
        run / ".events.uxsim-geo.part12.parquet",
        run / "network/.links.uxsim-geo.part13.parquet",
    )
    old.write_text("half")
    young.write_text("half")
    long_ago = young.stat().st_mtime - 2 * A_DAY
    os.utime(old, (long_ago, long_ago))
    assert clean(done, "--remove") == 0
    assert not old.exists()
    assert young.exists()


def test_no_folder_of_results(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert clean(tmp_path) == 2
    assert "no folder of results" in capsys.readouterr().err
