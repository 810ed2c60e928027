"""Studies looked at afterwards: verified, shown, repeated, and described for archives."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from crates import entities_of
from small_run import write_small_run
from study_files import BASE, STUDY, manifest, results, run_folder, study, write_study

from pipeline.cli import main
from pipeline.ro_crate import METADATA
from pipeline.runs import sha256_of

TWO = """name: study
base: small.yaml
set: {simulate.duration_s: 800}
seeds: 2
comparison: tables
scenarios:
  nothing: []
  slow:
    - {set: {links: ["3-4"], free_speed_kmh: 30}}
  larger: [{simulate: {platoon_size: 10}}]
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study that is done, which nobody changes."""
    folder = tmp_path_factory.mktemp("made")
    write_study(folder, TWO)
    study(folder)
    return folder


@pytest.fixture
def done(made: Path, tmp_path: Path) -> Path:
    """A copy of it, where it is named by its own folder."""
    folder = tmp_path / "copy"
    shutil.copytree(made, folder)
    return folder


def verify(folder: Path) -> int:
    return main(["verify", str(folder / "runs/study")])


def repeat(folder: Path, *options: str) -> int:
    return main(["run", str(folder / "runs/study/manifest.json"), "--quiet", *options])


def test_a_study_as_it_was_left_is_right(done: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert verify(done) == 0
    shown = capsys.readouterr()
    assert shown.err == ""
    assert "note:" not in shown.out
    of_runs = len(list((done / "runs/study/runs").glob("*/*/**/*.*"))) - 8 * 3
    assert of_runs > 8 * 10
    count = int(shown.out.split(": all ")[1].split()[0])
    assert count > of_runs


def test_what_is_wrong_is_named_with_its_run(
    done: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root = done / "runs/study"
    (run_folder(done, "slow", 1) / "events.parquet").write_bytes(b"other")
    (run_folder(done, "larger", 0) / "manifest.json").unlink()
    (root / "figures.csv").unlink()
    (root / "comparison/totals.csv").write_text("other")
    next((root / "sources").glob("*/demand.parquet")).write_bytes(b"other")
    assert verify(done) == 1
    errors = capsys.readouterr().err.splitlines()
    assert "error: slow, seed 1: events.parquet: is not what the run wrote" in errors
    assert "error: larger, seed 0: holds no readable manifest.json" in errors
    assert "error: figures.csv: is missing" in errors
    assert "error: comparison/totals.csv: is not what the run wrote" in errors
    assert sum(line.startswith("error: sources/") for line in errors) == 1
    assert len(errors) == 5


def test_failed_runs_and_strangers_are_named(
    done: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = run_folder(done, "larger", 1)
    shutil.rmtree(run)
    run.write_text("a file, where a folder should be")
    assert study(done).lines[-1].startswith("problem: larger, seed 1: ")
    (done / "runs/study/own.txt").write_text("mine")
    (done / "trips.tntp").write_text("other")
    capsys.readouterr()
    assert verify(done) == 1
    shown = capsys.readouterr()
    (line,) = shown.err.splitlines()
    assert line.startswith("error: larger, seed 1: failed: ")
    assert "a file is in the way" in line
    notes = shown.out.splitlines()
    assert "note: own.txt: the manifest does not know this file" in notes
    # what holds of all runs is said once
    assert sum("trips.tntp: has changed since" in note for note in notes) <= 2
    assert any("base, seed 0; base, seed 1" in note for note in notes)
    assert main(["inspect", str(done / "runs/study")]) == 0
    assert "larger, seed 1 failed: " in capsys.readouterr().out


def test_an_unfinished_study_is_not_right(done: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = done / "runs/study/manifest.json"
    path.write_text(path.read_text().replace('"finished": true', '"finished": false'))
    assert verify(done) == 1
    assert "the study was not finished" in capsys.readouterr().err
    path.write_text("{}")
    assert verify(done) == 2
    assert "name a run's folder" in capsys.readouterr().err


def test_a_study_is_shown(made: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["inspect", str(made / "runs/study")]) == 0
    shown = capsys.readouterr().out
    lines = [line.split() for line in shown.splitlines()]
    assert shown.startswith("study study, finished 20")
    assert ["base", "2", "0"] in lines
    assert any(line[:3] == ["slow", "2", "0"] and "30" in line for line in lines)
    (row,) = (line for line in lines if line[:1] == ["slow"] and "±" in line)
    # 1 km takes 120 s instead of 50 s, for 100 vehicles
    assert row[4:6] == ["+1.944", "±"]
    nothing = next(line for line in lines if line[:1] == ["nothing"] and "±" in line)
    assert nothing[1:] == ["+0", "±", "0"] * 5
    assert str(made / "runs/study/figures.csv") in shown
    assert len(lines) < 40


def test_a_study_is_repeated_with_the_same_result(
    done: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (done / "study.yaml").unlink()
    (done / "small.yaml").unlink()
    (done / "runs/study/study.yaml").unlink()
    assert repeat(done) == 0
    shown = capsys.readouterr()
    assert shown.err == ""
    assert ": the same result; " in shown.out
    again = done / "runs/repeated/study"
    assert (again / "comparison/totals.csv").is_file()
    log = (again / "study.log").read_text()
    assert "up to date" not in log
    assert "nothing, seed 1" in log
    assert "from the store" not in log
    # and once more in the same place nothing is taken from what is there
    assert repeat(done) == 0
    assert (again / "study.log").read_text().count("from the store") == 0
    assert main(["verify", str(again)]) == 0


def test_what_is_another_in_a_repetition_is_named(
    done: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trips = done / "trips.tntp"
    trips.write_text(trips.read_text().replace("100.0", "50.0"))
    assert repeat(done, "--out", str(done / "elsewhere")) == 1
    shown = capsys.readouterr()
    for name in ("runs/slow/seed_1/trips.parquet", "figures.csv", "comparison/totals.csv"):
        assert f"different: {name}: is not the same\n" in shown.err
    assert "runs/slow/seed_1/network/links.parquet" not in shown.err
    assert shown.out.count("trips.tntp: has changed since") == 1
    assert repeat(done, "--out", str(done / "runs")) == 2
    assert "the run itself lies there" in capsys.readouterr().err


def test_what_is_no_manifest_of_a_study_is_said(
    done: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = done / "runs/study/manifest.json"
    data = json.loads(path.read_text())
    del data["study"]["base_document"]
    path.write_text(json.dumps(data))
    assert repeat(done) == 2
    assert "is no manifest of a study" in capsys.readouterr().err
    assert repeat(done, "--seed", "3") == 2


def test_paths_of_study_and_base_hold_in_a_repetition(tmp_path: Path) -> None:
    """Both name files, from folders of their own, and write a list of one entry plainly."""
    base = tmp_path / "base"
    base.mkdir()
    write_small_run(base, BASE.replace("  duration_s", "  control: control.yaml\n  duration_s"))
    (base / "control.yaml").write_text('tolls: [{links: ["3-4"], amount: 2}]\n')
    (tmp_path / "half.tntp").write_text((base / "trips.tntp").read_text().replace("100.0", "50.0"))
    text = "base: base/small.yaml\nseeds: 1\ncomparison: none\nname: study\n"
    text += "set: {ingest.trips.file: half.tntp}\nscenarios:\n"
    text += "  full: [{config: {ingest.trips.file: base/trips.tntp}}]\n"
    (tmp_path / "study.yaml").write_text(text)
    study(tmp_path)
    rows = (tmp_path / "runs/study/figures.csv").read_text().splitlines()
    assert [row.split(",")[3] for row in rows[1:]] == ["50.0", "100.0"]
    (base / "control.yaml").unlink()
    assert repeat(tmp_path) == 0


def test_values_of_the_command_line_are_recorded(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_study(tmp_path, TWO)
    options = ["--out", str(tmp_path / "runs"), "--scheduler", "none", "--quiet"]
    options += ["--set", "simulate.duration_s=700", "--set", "simulate.seed=5", "--seeds", "1"]
    assert main(["study", str(tmp_path / "study.yaml"), *options]) == 0
    told = manifest(tmp_path)["study"]
    assert told["seeds"] == [5]
    assert told["config"]["set"] == {"simulate.duration_s": 700, "simulate.seed": 5}
    assert told["base_config"]["simulate"]["duration_s"] == 700
    assert repeat(tmp_path) == 0
    capsys.readouterr()
    wrong = ["study", str(tmp_path / "study.yaml"), "--set", "simulate.duration=7"]
    assert main([*wrong, "--out", str(tmp_path / "runs")]) == 2
    assert "--set simulate.duration=7: " in capsys.readouterr().err


def test_all_is_done_again_where_that_is_asked_for(done: Path) -> None:
    before = results(done)
    options = ["--out", str(done / "runs"), "--scheduler", "none", "--quiet", "--force"]
    log = done / "runs/study/study.log"
    log.unlink()
    assert main(["study", str(done / "study.yaml"), *options]) == 0
    assert log.read_text().count(" link entries in ") == 8
    assert "from the store" not in log.read_text()
    assert results(done) == before


def test_the_crate_describes_files_and_runs(made: Path) -> None:
    root = made / "runs/study"
    entities = entities_of(root)
    parts = {part["@id"] for part in entities["./"]["hasPart"]}
    runs = {part for part in parts if part.startswith("runs/")}
    assert runs == {
        f"runs/{name}/seed_{seed}/"
        for name in ("base", "nothing", "slow", "larger")
        for seed in range(2)
    }
    for run in runs:
        assert (root / entities[run]["subjectOf"]["@id"]).is_file()
    assert parts - runs == {*manifest(made)["outputs"], "manifest.json"}
    assert entities["figures.csv"]["sha256"] == sha256_of(root / "figures.csv")
    names = {entities[one["@id"]]["name"] for one in entities["#study"]["object"]}
    assert names == {"study.yaml", "small.yaml"}
    assert str(made) not in (root / METADATA).read_text()


def test_owners_and_terms_of_the_data_are_in_the_manifest(tmp_path: Path) -> None:
    write_study(tmp_path, STUDY.replace("seeds: 3", "seeds: 1"))
    write_small_run(tmp_path, BASE + "  attribution: The city of Three Links\n")
    study(tmp_path)
    assert manifest(tmp_path)["study"]["attribution"] == "The city of Three Links"
