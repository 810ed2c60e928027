"""``uxsim-geo examples``: configurations with their data, copied to run and to change."""

from __future__ import annotations

from pathlib import Path

import pytest
from conftest import REPOSITORY

from pipeline import examples
from pipeline.cli import main
from pipeline.config_file import load_config


def test_every_configuration_is_told_and_finds_its_data(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["examples", str(tmp_path / "copies")]) == 0
    told = [line.split() for line in capsys.readouterr().out.splitlines()]
    names = {path.name for path in (REPOSITORY / "configs").glob("*.yaml")}
    assert {Path(path).name for *_, path in told} == names
    for program, command, path in told:
        assert program == "uxsim-geo"
        if command == "run":
            load_config(Path(path))
        else:
            assert (command, Path(path).name[:6]) == ("study", "study_")


def test_copies_that_are_there_stay(tmp_path: Path) -> None:
    first = examples.copy_examples(tmp_path)
    times = [path.stat().st_mtime_ns for path in first]
    (tmp_path / "configs/own.yaml").write_text("of the user")
    first[0].unlink()
    second = examples.copy_examples(tmp_path)
    assert second == first
    assert [path.stat().st_mtime_ns for path in second[1:]] == times[1:]
    assert (tmp_path / "configs/own.yaml").read_text() == "of the user"


def test_what_the_user_has_changed_is_not_written_over(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    examples.copy_examples(tmp_path)
    (tmp_path / "configs/gridlock.yaml").write_text("of the user")
    (tmp_path / "data/uroboros/overrides.csv").write_text("of the user")
    (tmp_path / "configs/sioux_falls.yaml").unlink()
    assert main(["examples", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert "configs/gridlock.yaml has been changed; name another folder" in said
    assert "data/uroboros/overrides.csv has been changed" in said
    assert not (tmp_path / "configs/sioux_falls.yaml").exists()
    assert (tmp_path / "configs/gridlock.yaml").read_text() == "of the user"


def test_a_file_in_the_place_of_the_folder_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "copies").write_text("a file")
    assert main(["examples", str(tmp_path / "copies")]) == 2
    assert "name another folder" in capsys.readouterr().err


def test_a_package_without_examples_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(examples, "PARTS", ("configs", "no such part"))
    assert main(["examples", str(tmp_path / "copies")]) == 2
    assert "install the package again" in capsys.readouterr().err
