"""Manifests that were changed by hand, or are of other programs: told, never a failure."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from copy import deepcopy
from pathlib import Path
from typing import Any

import pytest
from small_run import run_small
from study_files import BASE, study, write_study

from pipeline.cli import main

Place = tuple[str | int, ...]

#: what is put in the place of a value
ODD: tuple[object, ...] = (None, -1.5, "../../x", [], {}, [None], {"a": None}, 1e308)

#: what a manifest holds in free form, as the configuration, is put in another form as a whole only
WHOLE = ("config", "base_config", "base_document", "settings", "machine", "versions")


def places(values: Any, place: Place = ()) -> Iterator[Place]:
    """Where in a manifest a value stands: of lists the first, of files and runs one alone."""
    if place:
        yield place
    if place and place[-1] in WHOLE:
        return
    if isinstance(values, dict):
        names = list(values)
        for name in names[:1] if place and place[-1] in ("inputs", "outputs") else names:
            yield from places(values[name], (*place, name))
    elif isinstance(values, list) and values:
        yield from places(values[0], (*place, 0))


def changed(values: Any, place: Place, number: int) -> Any:
    """The same with another value at a place, or without it."""
    copy = deepcopy(values)
    inside = copy
    for part in place[:-1]:
        inside = inside[part]
    odd = [odd for odd in ODD if odd != inside[place[-1]]]
    if number == len(odd):
        del inside[place[-1]]
    else:
        inside[place[-1]] = odd[number % len(odd)]
    return copy


def tried(path: Path, call: Callable[[], object]) -> int:
    """Call with every place of a manifest changed, to one value after the other in turn."""
    good = json.loads(path.read_text(encoding="utf-8"))
    number = 0
    for number, place in enumerate(places(good)):
        path.write_text(json.dumps(changed(good, place, number % 9)), encoding="utf-8")
        call()
    path.write_text(json.dumps(good), encoding="utf-8")
    return number


def told(capsys: pytest.CaptureFixture[str], *command: str) -> tuple[int, str]:
    status = main(command)
    text = capsys.readouterr().err
    # what the program did not foresee is told by the name of its exception
    assert not [
        line for line in text.splitlines() if line.startswith("error: ") and "Error:" in line
    ]
    return status, text


def test_a_run_with_a_changed_manifest(finished: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def call() -> None:
        told(capsys, "inspect", str(finished))
        told(capsys, "verify", str(finished))
        status, text = told(capsys, "export", str(finished), "--table", "trips")
        assert status in (0, 2)
        assert (status == 2) == bool(text.startswith("error: "))

    assert tried(finished / "manifest.json", call) > 50


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{", "[" * 100_000, '{"format": 1}', '{"format": 1, "stages": {}, "run": []}'],
)
def test_a_manifest_that_is_none(
    finished: Path, capsys: pytest.CaptureFixture[str], text: str
) -> None:
    path = finished / "manifest.json"
    path.write_text(text, encoding="utf-8")
    assert told(capsys, "verify", str(finished))[0] == 2
    assert told(capsys, "run", str(path))[0] == 2
    assert told(capsys, "compare", str(finished), str(finished))[0] == 2
    # and all is done again
    assert run_small(finished.parents[1]) == 0
    assert told(capsys, "verify", str(finished))[0] == 0


def test_a_manifest_of_stages_that_are_not_known(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = finished / "manifest.json"
    manifest = json.loads(path.read_text(encoding="utf-8"))
    manifest["stages"] = {"other": manifest["stages"]["ingest"]}
    path.write_text(json.dumps(manifest), encoding="utf-8")
    status, text = told(capsys, "run", str(path))
    assert status == 2
    assert (
        text
        == f"error: {path}: names no stage that this version knows: run the run's config.yaml\n"
    )


def test_figures_of_the_simulation_that_are_none(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = finished / "manifest.json"
    manifest = json.loads(path.read_text(encoding="utf-8"))
    manifest["stages"]["simulate"]["figures"] = {"locked_vehicles": "many"}
    path.write_text(json.dumps(manifest), encoding="utf-8")
    status, text = told(capsys, "export", str(finished), "--table", "trips")
    assert status == 2
    assert "manifest.json: the figures of the stage simulate are damaged; run it again" in text


def test_a_study_with_a_changed_manifest(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_study(tmp_path, "name: study\nbase: small.yaml\nseeds: 1\nscenarios:\n  nothing: []\n")
    study(tmp_path)
    folder, outside = tmp_path / "runs/study", tmp_path / "x"
    outside.write_text(BASE, encoding="utf-8")

    def call() -> None:
        told(capsys, "inspect", str(folder))
        told(capsys, "verify", str(folder))
        told(capsys, "clean", "--out", str(tmp_path / "runs"))

    assert tried(folder / "manifest.json", call) > 50


def test_a_study_is_not_repeated_from_a_part_of_its_manifest(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_study(tmp_path, "name: study\nbase: small.yaml\nseeds: 1\nscenarios:\n  nothing: []\n")
    study(tmp_path)
    path = tmp_path / "runs/study/manifest.json"
    good = json.loads(path.read_text(encoding="utf-8"))
    for name in ("text", "config", "folder", "base_document", "base_folder"):
        for odd in (None, "", {}, [1]):
            path.write_text(json.dumps(good | {"study": good["study"] | {name: odd}}))
            # a folder or text that is empty is one; nothing is repeated then but told
            if not (odd == "" and name in ("folder", "base_folder")):
                assert told(capsys, "run", str(path))[0] == 2


def test_nothing_outside_a_study_is_removed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_study(tmp_path, "name: study\nbase: small.yaml\nseeds: 1\nscenarios:\n  nothing: []\n")
    study(tmp_path)
    path, outside = tmp_path / "runs/study/manifest.json", tmp_path / "runs/precious.txt"
    outside.write_text("mine", encoding="utf-8")
    manifest = json.loads(path.read_text(encoding="utf-8"))
    record = next(iter(manifest["outputs"].values()))
    manifest["outputs"]["../precious.txt"] = record
    path.write_text(json.dumps(manifest), encoding="utf-8")
    assert told(capsys, "verify", str(path.parent))[0] == 2
    # a study that is done again takes away what its manifest vouches for
    study(tmp_path)
    assert outside.read_text(encoding="utf-8") == "mine"
