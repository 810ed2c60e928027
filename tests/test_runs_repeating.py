"""A run is repeated from its manifest, and every file compared."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from crates import entities_of
from small_run import run_small, write_small_run

from pipeline.cli import main
from pipeline.ro_crate import METADATA
from pipeline.runs import sha256_of


@pytest.fixture
def run(tmp_path: Path) -> Path:
    write_small_run(tmp_path)
    assert run_small(tmp_path) == 0
    return tmp_path / "runs/small"


def change_version(run: Path, library: str, version: str) -> None:
    path = run / "manifest.json"
    data = json.loads(path.read_text())
    for stage in data["stages"].values():
        stage["versions"][library] = version
    path.write_text(json.dumps(data))


def repeat(run: Path, *options: str) -> int:
    return main(["run", str(run / "manifest.json"), "--quiet", *options])


def test_the_same_run_gives_the_same_files(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert repeat(run) == 0
    again = run.parent / "repeated/small"
    for name in ("events.parquet", "results.gpkg", "network/links.parquet"):
        assert (again / name).read_bytes() == (run / name).read_bytes()
    said = capsys.readouterr()
    count = len(json.loads((again / METADATA).read_text())["@graph"][1]["hasPart"]) - 2
    assert f"the same result; {count} of {count} files are equal" in said.out
    assert said.err == ""


def test_the_configuration_beside_the_manifest_is_not_asked(run: Path) -> None:
    (run / "config.yaml").write_text("damaged")
    assert repeat(run) == 0


def test_what_is_no_longer_the_same_is_named(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    trips = run.parents[1] / "trips.tntp"
    trips.write_text(trips.read_text().replace("100.0", "50.0"))
    change_version(run, "numpy", "1.0")
    assert repeat(run) == 1
    said = capsys.readouterr()
    assert "different: trips.parquet: is not the same\n" in said.err
    assert "network/links.parquet" not in said.err
    assert "trips.tntp: has changed since" in said.out
    assert "made with numpy 1.0 (now " in said.out


def test_summaries_are_equal_but_for_the_clock(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    figures = json.loads((run / "summary.json").read_text())
    assert figures["engine_wall_s"] > 0
    (run / "summary.json").write_text(json.dumps(figures | {"engine_wall_s": 5.0}))
    data = json.loads((run / "manifest.json").read_text())
    data["stages"]["report"]["outputs"]["summary.json"]["sha256"] = sha256_of(run / "summary.json")
    (run / "manifest.json").write_text(json.dumps(data))
    assert repeat(run) == 0
    figures["vehicles_completed"] += 1
    (run / "summary.json").write_text(json.dumps(figures))
    data["stages"]["report"]["outputs"]["summary.json"]["sha256"] = sha256_of(run / "summary.json")
    (run / "manifest.json").write_text(json.dumps(data))
    assert repeat(run) == 1
    assert "summary.json: is not the same" in capsys.readouterr().err


def test_a_run_is_not_repeated_over_itself(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert repeat(run, "--out", str(run.parent)) == 2
    assert "the run itself lies there" in capsys.readouterr().err
    assert repeat(run, "--out", str(run.parents[1] / "elsewhere")) == 0


def test_a_repetition_changes_nothing(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert repeat(run, "--seed", "3") == 2
    assert "run its config.yaml" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["{}", "no json", '{"format": 1, "run": {}, "stages": {}}'])
def test_what_is_no_manifest_is_said(
    tmp_path: Path, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "manifest.json").write_text(text)
    assert main(["run", str(tmp_path / "manifest.json")]) == 2
    assert "is no manifest of a run" in capsys.readouterr().err
    assert main(["run", str(tmp_path / "other.json")]) == 2


def test_the_crate_describes_every_file_and_stage(run: Path) -> None:
    entities = entities_of(run)
    files = {path for path in run.rglob("*") if path.is_file()}
    names = {path.relative_to(run).as_posix() for path in files} - {METADATA, "run.log"}
    assert {part["@id"] for part in entities["./"]["hasPart"]} == names
    for name in names - {"manifest.json"}:
        assert entities[name]["sha256"] == sha256_of(run / name)
        assert int(entities[name]["contentSize"]) == (run / name).stat().st_size
    simulated = entities["#simulate"]
    assert {"@id": "events.parquet"} in simulated["result"]
    assert {"@id": "demand.parquet"} in simulated["object"]
    (source,) = [
        entities[one["@id"]]
        for one in entities["#ingest"]["object"]
        if entities[one["@id"]]["name"] == "net.tntp"
    ]
    assert source["sha256"] == sha256_of(run.parents[1] / "net.tntp")
    # of where the files of the user lie nothing is told
    assert str(run.parents[1]) not in (run / METADATA).read_text()


def test_an_unfinished_stage_leaves_no_crate(run: Path) -> None:
    (run / "network/links.parquet").unlink()
    trips = run.parents[1] / "trips.tntp"
    trips.write_text(trips.read_text().replace("100.0", "many"))
    assert run_small(run.parents[1]) == 2
    assert (run / METADATA).is_file()  # nothing was begun
