"""The command line as its users meet it: statuses, messages, and what is left on disk."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import REPOSITORY
from small_run import CONFIG, NET, TRIPS, run_small, write_small_run

from pipeline.cli import main
from uxsim_geo.version import __version__


def test_help_and_version_load_nothing_heavy() -> None:
    code = (
        "import sys\n"
        "from pipeline.cli import main\n"
        "try:\n"
        "    main(['--help'])\n"
        "except SystemExit as end:\n"
        "    assert end.code == 0\n"
        "heavy = {'numpy', 'pandas', 'numba', 'pydantic', 'rich', 'yaml', 'geopandas'}\n"
        "print(sorted(heavy & set(sys.modules)))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=REPOSITORY, check=True, capture_output=True, text=True
    )
    assert "inspect" in done.stdout
    assert done.stdout.splitlines()[-1] == "[]"


def test_version_as_a_module() -> None:
    command = [sys.executable, "-m", "pipeline", "--version"]
    done = subprocess.run(command, cwd=REPOSITORY, check=True, capture_output=True, text=True)
    assert done.stdout.split() == ["uxsim-geo", __version__]


def test_run_ends_with_a_table_and_the_paths(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_small_run(tmp_path)
    assert run_small(tmp_path) == 0
    shown = capsys.readouterr()
    figures = json.loads((tmp_path / "runs/small/summary.json").read_text())
    assert figures["vehicles_completed"] == 100
    (row,) = (line for line in shown.out.splitlines() if "vehicles completed" in line)
    assert "100" in row
    assert "veh" in row
    for name in ("config.yaml", "manifest.json", "events.parquet", "results.gpkg", "summary.json"):
        assert f"runs/small/{name}" in shown.out.replace("\n", "")
        assert (tmp_path / "runs/small" / name).is_file()
    assert [line.partition(":")[0] for line in shown.err.splitlines() if line[0] != " "] == [
        "ingest",
        "warning",
        "simulate",
        "report",
    ]


def test_quiet_says_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_small_run(tmp_path)
    assert run_small(tmp_path, "--quiet") == 0
    assert capsys.readouterr() == ("", "")


def test_a_run_goes_on_when_nobody_reads_its_lines(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_small_run(tmp_path)
    for name in ("stdout", "stderr"):
        reader, writer = os.pipe()
        os.close(reader)
        monkeypatch.setattr(sys, name, os.fdopen(writer, "w"))
    assert run_small(tmp_path) == 0
    sys.stdout.close()
    sys.stderr.close()
    assert (tmp_path / "runs/small/summary.json").is_file()
    assert "Error" not in (tmp_path / "runs/small/run.log").read_text()


def test_one_stage_runs_those_before_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_small_run(tmp_path)
    assert run_small(tmp_path, command="simulate") == 0
    names = {path.name for path in (tmp_path / "runs/small").iterdir()}
    assert {"network", "events.parquet", "trips.parquet"} <= names
    assert "summary.json" not in names
    assert "vehicles completed" not in capsys.readouterr().out


def test_seed_goes_into_summary_and_manifest(tmp_path: Path) -> None:
    write_small_run(tmp_path)
    assert run_small(tmp_path, "--seed", "7", "--quiet") == 0
    folder = tmp_path / "runs/small"
    assert json.loads((folder / "summary.json").read_text())["seed"] == 7
    assert json.loads((folder / "manifest.json").read_text())["run"]["seed"] == 7


WRONG_INPUTS = {
    "net.tntp": {
        "empty": (b"", "is empty"),
        "cut in a row": (NET[:-40].encode(), "net.tntp"),
        "binary": (bytes(range(256)), "net.tntp"),
        "letters in a number": (NET.replace(" 1000 ", " 1ooo ").encode(), "1ooo"),
        "negative length": (NET.replace(" 1000 ", " -1000 ").encode(), "-1000"),
        "zero capacity": (NET.replace("3 4 1800", "3 4 0").encode(), "capacity"),
        "unknown node": (NET.replace(" 3 4 ", " 3 9 ").encode(), "9"),
    },
    "trips.tntp": {
        "empty": (b"", "is empty"),
        "cut in a row": (TRIPS[:-2].encode(), "semicolon"),
        "binary": (bytes(range(256)), "trips.tntp"),
        "letters in a number": (TRIPS.replace(": 100.0", ": 1OO").encode(), "1OO"),
        "unknown zone": (TRIPS.replace(" 2 :", " 9 :").encode(), "unknown zone"),
    },
    "small.yaml": {
        "empty": (b"", "is empty"),
        "binary": (bytes(range(256)), "small.yaml"),
        "unknown key": (CONFIG.replace("duration_s", "duratoin_s").encode(), "duration_s?"),
        "wrong type": (CONFIG.replace("1200", "soon").encode(), "found 'soon'"),
        "missing file": (CONFIG.replace("net.tntp", "gone.tntp").encode(), "no such file"),
        "folder for a file": (CONFIG.replace("net.tntp", ".").encode(), "is a folder"),
        "no unit": (CONFIG.replace("  length_unit: m\n", "").encode(), "length_unit"),
        "no capacity unit": (CONFIG.replace("  capacity_unit: veh/h\n", "").encode(), "capacity"),
    },
}


@pytest.mark.parametrize(
    ("name", "case"), [(name, case) for name, cases in WRONG_INPUTS.items() for case in cases]
)
def test_wrong_input_is_said_and_leaves_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, case: str
) -> None:
    write_small_run(tmp_path)
    content, expected = WRONG_INPUTS[name][case]
    (tmp_path / name).write_bytes(content)
    assert run_small(tmp_path) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "Traceback" not in shown.err
    assert expected in shown.err
    assert all(line.startswith("error: ") for line in shown.err.splitlines())
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize("command", ["run", "inspect", "verify"])
def test_path_that_is_not_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    assert main([command, str(tmp_path / "nothing")]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_folder_in_place_of_a_configuration(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", str(tmp_path)]) == 2
    assert "folder" in capsys.readouterr().err


def test_file_in_the_way_of_the_run_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_small_run(tmp_path)
    (tmp_path / "runs").write_text("in the way")
    assert run_small(tmp_path) == 2
    assert "a file is in the way" in capsys.readouterr().err


def test_a_run_folder_holds_what_is_promised(tmp_path: Path) -> None:
    write_small_run(tmp_path)
    pictures = "report.plots=[{plot: network_average}, {plot: travel_times, format: svg}]"
    assert run_small(tmp_path, "--quiet", "--set", pictures) == 0
    folder = tmp_path / "runs/small"
    assert {path.relative_to(folder).as_posix() for path in folder.rglob("*.*")} == {
        "config.yaml",
        "demand.parquet",
        "demand_notes.parquet",
        "events.parquet",
        "import_notes.html",
        "manifest.json",
        "network/import_notes.parquet",
        "network/links.parquet",
        "network/movements.parquet",
        "network/nodes.parquet",
        "plots/network_average.png",
        "plots/travel_times.svg",
        "results.gpkg",
        "ro-crate-metadata.json",
        "run.log",
        "summary.json",
        "trips.parquet",
    }


def test_time_bins_beyond_number_are_refused_before_they_fill_the_memory(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_small(finished.parents[1], "--set", "report.bin_s=1e-9") == 2
    assert "take 0.0012 s or more" in capsys.readouterr().err
    assert (finished / "results.gpkg").exists()


def test_a_folder_that_cannot_be_written_to(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    write_small_run(tmp_path)
    (tmp_path / "runs/small").mkdir(parents=True)
    # a folder without the right to write, also for those whom no rights hold back
    monkeypatch.setattr("os.access", lambda *_, **__: False)
    assert run_small(tmp_path) == 2
    line = capsys.readouterr().err.splitlines()[-1]
    assert line.startswith("error: ")
    assert "cannot be written to; choose another --out" in line
    assert list((tmp_path / "runs/small").iterdir()) == []


@pytest.mark.parametrize("out", ["", " "])
def test_an_empty_folder_name_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, out: str
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as end:
        main(["run", str(write_small_run(tmp_path)), "--out", out])
    assert end.value.code == 2
    assert "--out: is empty" in capsys.readouterr().err
    assert not (tmp_path / "small").exists()


@pytest.mark.parametrize("name", ["too-long-" * 40, "refused"])
def test_a_folder_that_cannot_be_made(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    write_small_run(tmp_path)
    if name == "refused":
        monkeypatch.setattr(Path, "mkdir", refuse)
    assert run_small(tmp_path, "--set", f"name={name}") == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "cannot be the run's folder" in line


def test_what_was_deleted_is_neither_listed_nor_missed(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (finished / "results.gpkg").unlink()
    (finished / "summary.json").write_text("{")
    assert run_small(finished.parents[1], command="simulate") == 0
    shown = capsys.readouterr().out
    assert "events.parquet" in shown
    assert "results.gpkg" not in shown
    assert main(["inspect", str(finished)]) == 0
    assert "vehicles completed" not in capsys.readouterr().out


def test_wrong_input_later_keeps_what_was_finished(finished: Path) -> None:
    log = finished / "run.log"
    logged = log.read_text()
    assert "uxsim-geo run" in logged
    files = [path for path in finished.rglob("*") if path.is_file() and path != log]
    before = {path: path.read_bytes() for path in files}
    (finished.parents[1] / "trips.tntp").write_text("Origin", encoding="utf-8")
    assert run_small(finished.parents[1]) == 2
    assert {path for path in finished.rglob("*") if path.is_file()} == {*files, log}
    assert {path: path.read_bytes() for path in files} == before
    assert "error: " in log.read_text().removeprefix(logged)


#: one way only, from zone 1 to zone 2; half a trip more than whole
UNREACHABLE = TRIPS.replace("100.0\n", "340.5\n") + "\nOrigin 2\n 1 : 240.5;\n"


def test_warnings_come_with_their_number_and_sum(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_small_run(tmp_path)
    (tmp_path / "trips.tntp").write_text(UNREACHABLE, encoding="utf-8")
    assert run_small(tmp_path) == 0
    shown = capsys.readouterr()
    assert "2 OD pairs, 340.5 trips" in shown.err
    assert (
        "warning: unreachable: no path leads from zone 2 to zone 1: nobody can arrive (240.5 trips)"
        in shown.err
    )
    assert "nobody can arrive (240.5 trips)" in (tmp_path / "runs/small/run.log").read_text()
    (warning,) = (line for line in shown.out.splitlines() if line.startswith("warning: "))
    figures = json.loads((tmp_path / "runs/small/summary.json").read_text())
    aborted, demanded = figures["vehicles_aborted"], figures["vehicles_demanded"]
    assert (aborted, demanded) in {(240, 340), (240, 341), (241, 340), (241, 341)}
    assert f"{aborted} of {demanded} vehicles (71%) were aborted" in warning
    assert shown.out.index("warning: ") < shown.out.index("vehicles demanded")
    assert main(["inspect", str(tmp_path / "runs/small")]) == 0
    assert "warning  unreachable" in capsys.readouterr().out.partition("demand notes")[2]


def test_unexpected_failure_is_one_line_and_a_log(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise ZeroDivisionError("of a kind that nobody foresaw")

    write_small_run(tmp_path)
    monkeypatch.setattr("uxsim_geo.network.tntp.read_tntp_network", fail)
    assert run_small(tmp_path) == 1
    shown = capsys.readouterr().err
    assert shown.startswith("error: ZeroDivisionError: of a kind that nobody foresaw")
    assert shown.count("\n") == 1
    assert "Traceback" in (tmp_path / "runs/small/run.log").read_text()
    (tmp_path / "runs/small/run.log").unlink()
    (tmp_path / "runs/small/run.log").mkdir()
    assert run_small(tmp_path) == 1
    shown = capsys.readouterr().err
    assert "nobody foresaw; no details, since there is no log" in shown
    assert shown.count("\n") == 1
