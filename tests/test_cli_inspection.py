"""What `verify` and `inspect` say of a run, a network or a file."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
from small_run import run_small, write_small_run

from pipeline import execution, program
from pipeline.cli import main
from uxsim_geo.network.notes import Notes


def test_verify_finds_a_changed_byte(finished: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", str(finished)]) == 0
    path = finished / "events.parquet"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(bytes(content))
    assert main(["verify", str(finished)]) == 1
    assert "events.parquet: is not what the run wrote" in capsys.readouterr().err


def test_verify_finds_missing_and_unknown_files(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (finished / "summary.json").unlink()
    (finished / "strange.txt").write_text("?")
    assert main(["verify", str(finished)]) == 1
    shown = capsys.readouterr()
    assert "summary.json: is missing" in shown.err
    assert "strange.txt" in shown.out


def test_verify_mentions_a_source_that_has_changed(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trips = finished.parents[1] / "trips.tntp"
    trips.write_text(trips.read_text().replace("100.0", "50.0"))
    assert main(["verify", str(finished)]) == 0
    assert "trips.tntp: has changed since" in capsys.readouterr().out


def test_other_versions_of_libraries_are_told_and_nothing_is_done_again(
    finished: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    now = program.versions()
    for module in (program, execution):
        monkeypatch.setattr(module, "versions", lambda: {**now, "numpy": "99.1"})
    assert main(["verify", str(finished)]) == 0
    told = f"made with numpy {now['numpy']} (now 99.1)"
    assert f"note: simulate: {told}" in capsys.readouterr().out
    assert run_small(finished.parents[1]) == 0
    shown = capsys.readouterr().err
    assert f"simulate: up to date; {told}, --force repeats" in shown
    assert run_small(finished.parents[1], "--force", "--quiet") == 0
    assert main(["verify", str(finished)]) == 0
    assert "numpy" not in capsys.readouterr().out


NOTES = Notes()
for _number in range(12):
    NOTES.add(f"topic {_number}", "what was done; value: links", value=_number)
NOTES.add("fell out", "2 links on an island: left out; value: km", severity="warning", value=1.5)
NOTES.add("fell out", "1 link in a trap: left out; value: km", severity="warning", value=0.25)


def test_inspect_says_how_many_topics_it_leaves_out_and_how_to_see_them(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = finished / "network/import_notes.parquet"
    NOTES.table().to_parquet(table)
    assert main(["inspect", str(finished / "network")]) == 0
    shown = capsys.readouterr().out.partition("import notes")[2].splitlines()
    assert shown[1].split() == ["2", "warning", "fell", "out"]
    assert f"and 5 more topics; all notes: uxsim-geo inspect {table}" in shown
    assert (
        "warning: fell out (2 notes, 1.75 km in all): 2 links on an island: left out (1.5 km); "
        "1 link in a trap: left out (0.25 km)"
    ) in shown
    assert main(["inspect", str(table)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 2 + 14
    assert lines[-1].endswith("what was done (11 links)")


def test_verify_needs_a_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verify", str(tmp_path)]) == 2
    assert "manifest.json" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("", ["run small", "vehicles completed", "links"]),
        ("network", ["free speed", "72", "km/h", "CRS"]),
        ("results.gpkg", ["link_states", "link_times", "rows"]),
        ("events.parquet", ["60 rows", "exit_s", "float64"]),
    ],
)
def test_inspect_shows_a_screenful(
    finished: Path, capsys: pytest.CaptureFixture[str], name: str, expected: list[str]
) -> None:
    assert main(["inspect", str(finished / name)]) == 0
    shown = capsys.readouterr().out
    assert all(word in shown for word in expected)
    assert len(shown.splitlines()) <= 50


def test_inspect_says_that_a_manifest_is_damaged(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (finished / "manifest.json").write_text("{")
    assert main(["inspect", str(finished)]) == 0
    assert "manifest.json is damaged" in capsys.readouterr().out


def test_inspect_rounds_but_keeps_what_stands_before_the_point(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pd.DataFrame({"a": [0.123456, 12345.678]}).to_parquet(finished / "some.parquet")
    assert main(["inspect", str(finished / "some.parquet")]) == 0
    assert "0.123 to 12,346" in capsys.readouterr().out


def test_inspect_counts_zones_and_their_nodes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_small_run(tmp_path)
    net = tmp_path / "net.tntp"
    # zones 1 and 2 become centroids of one street: both are loaded at nodes 3 and 4
    text = net.read_text().replace("THRU NODE> 1", "THRU NODE> 3").replace("LINKS> 3", "LINKS> 5")
    net.write_text(text + " 2 3 1800 0 0 0.15 4 0 0 1 ;\n 4 1 1800 0 0 0.15 4 0 0 1 ;\n")
    assert run_small(tmp_path, "--quiet", command="ingest") == 0
    assert main(["inspect", str(tmp_path / "runs/small/network")]) == 0
    assert "2 of them carry 2 zones" in capsys.readouterr().out


def test_inspect_names_what_a_network_lacks(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (finished / "network/links.parquet").write_bytes((finished / "events.parquet").read_bytes())
    assert main(["inspect", str(finished / "network")]) == 2
    assert "lacks the column length" in capsys.readouterr().err


def test_inspect_refuses_what_it_does_not_know(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (finished / "other.gpkg").write_bytes(b"no database")
    (finished / "other.parquet").write_bytes(b"no table")
    for name in ("other.gpkg", "other.parquet", "summary.json"):
        assert main(["inspect", str(finished / name)]) == 2
        assert capsys.readouterr().err.startswith("error: ")


@pytest.mark.parametrize("name", ["", "network"])
def test_inspect_sums_up_what_is_given_assumed_and_doubtful(
    finished: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    assert main(["inspect", str(finished / name)]) == 0
    lines = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    # lanes follow from the capacities, speeds from times in the file
    assert "given by the source lanes 0.0 %, speed 100.0 % of 2.0 km" in lines
    assert "short links 0, 0.0 % driven in less than 5 s" in lines
    assert "doubtful spots none" in lines


def test_inspect_counts_doubts_by_kind(finished: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = finished / "network/import_notes.parquet"
    notes = pd.read_parquet(path).drop(columns="geometry")
    doubt = ["link", "1-3", "doubtful speed", "doubt", "far", "50-90-50 km/h"]
    more = ["link", None, "doubtful speed", "doubt", "more", "1200"]
    for row in (doubt, more):
        notes.loc[len(notes)] = row
    notes.to_parquet(path)
    assert main(["inspect", str(finished / "network")]) == 0
    lines = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert "doubtful speed 1,201 spots to look at" in lines
