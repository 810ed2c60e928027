"""Studies: which runs are done, that nothing is done twice, and what is left of them."""

from __future__ import annotations

import csv
from pathlib import Path

import geopandas
import pandas as pd
import pytest
from shapely import box
from small_run import write_small_run
from study_files import (
    BASE,
    STUDY,
    lines_of,
    manifest,
    results,
    run_folder,
    study,
    write_study,
)

from pipeline.cli import main
from pipeline.config_file import load_config
from pipeline.study import Study
from pipeline.study_config import read_study
from uxsim_geo.errors import InputError


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study that one process has done, run by run."""
    folder = tmp_path_factory.mktemp("done")
    write_study(folder)
    said = study(folder)
    assert lines_of(said, "from the store") == [f"nothing, seed {seed}" for seed in range(3)]
    assert not [line for line in said.lines if line.startswith("problem")]
    return folder


def test_a_scenario_without_edits_is_the_base_to_the_byte(done: Path) -> None:
    found = results(done)
    base = {name: digest for name, digest in found.items() if name.startswith("runs/base/")}
    assert len(base) > 3 * 15
    for name, digest in base.items():
        assert found[name.replace("/base/", "/nothing/", 1)] == digest
    larger = "runs/larger/seed_0/events.parquet"
    assert found[larger] != found[larger.replace("larger", "base")]


def test_seeds_differ_and_are_those_that_follow_the_base(done: Path) -> None:
    configs = [load_config(run_folder(done, "larger", seed) / "config.yaml") for seed in range(3)]
    assert [config.simulate.seed for config in configs] == [0, 1, 2]
    assert manifest(done)["study"]["seeds"] == [0, 1, 2]


def test_figures_have_a_row_for_each_run_with_what_was_measured(done: Path) -> None:
    with (done / "runs/study/figures.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["scenario"], row["seed"], row["status"]) for row in rows] == [
        (name, str(seed), "finished") for name in ("base", "nothing", "larger") for seed in range(3)
    ]
    totals = pd.read_parquet(run_folder(done, "larger", 2) / "measures/totals.parquet")
    for figure, value in zip(totals["figure"], totals["value"], strict=True):
        assert rows[-1][figure] == ("" if pd.isna(value) else repr(float(value)))


def test_a_run_of_a_study_is_an_ordinary_run(done: Path, tmp_path: Path) -> None:
    folder = run_folder(done, "larger", 1)
    assert main(["simulate", str(folder / "config.yaml"), "--out", str(tmp_path), "--quiet"]) == 0
    repeated = tmp_path / load_config(folder / "config.yaml").name
    for name in ("events.parquet", "trips.parquet", "network/links.parquet", "import_notes.html"):
        assert (repeated / name).read_bytes() == (folder / name).read_bytes()
    assert main(["verify", str(folder)]) == 0


def test_nothing_changed_nothing_done(done: Path) -> None:
    before = {path: path.stat().st_mtime_ns for path in (done / "runs/study/runs").rglob("*")}
    said = study(done)
    assert len(lines_of(said, "up to date")) == 9
    assert {p: p.stat().st_mtime_ns for p in (done / "runs/study/runs").rglob("*")} == before


def test_another_study_finds_the_runs_in_the_store(done: Path) -> None:
    text = STUDY.replace("name: study", "name: other").replace("seeds: 3", "seeds: [2, 5]")
    (done / "study.yaml").write_text(text, encoding="utf-8")
    said = study(done)
    (done / "study.yaml").write_text(STUDY, encoding="utf-8")
    assert lines_of(said, "from the store") == [
        "base, seed 2",
        "larger, seed 2",
        "nothing, seed 2",
        "nothing, seed 5",
    ]
    name = "seed_2/events.parquet"
    other = done / "runs/other/runs/larger" / name
    assert other.samefile(done / "runs/study/runs/larger" / name)


def test_an_edited_study_repeats_what_the_edit_concerns(tmp_path: Path) -> None:
    write_study(tmp_path)
    study(tmp_path)
    before = results(tmp_path)
    write_study(tmp_path, STUDY.replace("platoon_size: 10", "platoon_size: 4"))
    said = study(tmp_path)
    assert lines_of(said, "link entries") == [f"larger, seed {seed}" for seed in range(3)]
    after = results(tmp_path)
    for name in before:
        changed = "/larger/" in name and name.endswith(("events.parquet", "trips.parquet"))
        assert not changed or after[name] != before[name]
        assert "/larger/" in name or name == "figures.csv" or after[name] == before[name]
    study_again = tmp_path / "afresh"
    write_study(study_again, STUDY.replace("platoon_size: 10", "platoon_size: 4"))
    study(study_again)
    assert results(study_again) == after


def test_an_edited_base_repeats_all(tmp_path: Path) -> None:
    write_study(tmp_path)
    study(tmp_path)
    write_small_run(tmp_path, BASE.replace("duration_s: 900", "duration_s: 800"))
    assert len(lines_of(study(tmp_path), "link entries")) == 9  # three of them from the store
    afresh = tmp_path / "afresh"
    write_study(afresh)
    write_small_run(afresh, BASE.replace("duration_s: 900", "duration_s: 800"))
    study(afresh)
    assert results(afresh) == results(tmp_path)


def test_edited_tables_are_those_of_an_ordinary_run(tmp_path: Path) -> None:
    text = "base: small.yaml\nseeds: 1\ncomparison: none\nscenarios:\n  slow:\n"
    text += '    - {set: {links: ["3-4"], free_speed_kmh: 30}}\n'
    text += "    - {scale_demand: {factor: 0.5}}\n"
    write_study(tmp_path, text)
    study(tmp_path)
    folder = run_folder(tmp_path, "slow", 0)
    out = tmp_path / "again"
    assert main(["simulate", str(folder / "config.yaml"), "--out", str(out), "--quiet"]) == 0
    repeated = out / load_config(folder / "config.yaml").name
    tables = [path.relative_to(folder) for path in folder.rglob("*.parquet")]
    tables = [name for name in tables if name.parts[0] != "measures"]
    assert len(tables) >= 7
    for name in tables:
        assert (repeated / name).read_bytes() == (folder / name).read_bytes(), name


def test_one_failed_run_does_not_end_the_study(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_study(tmp_path)
    in_the_way = run_folder(tmp_path, "larger", 1)
    in_the_way.parent.mkdir(parents=True)
    in_the_way.write_text("a file, where a folder should be")
    options = ["--out", str(tmp_path / "runs"), "--scheduler", "none"]
    assert main(["study", str(tmp_path / "study.yaml"), *options]) == 1
    shown = capsys.readouterr()
    (line,) = (line for line in shown.err.splitlines() if line.startswith("error:"))
    assert "larger, seed 1: " in line
    assert "a file is in the way" in line
    rows = (tmp_path / "runs/study/figures.csv").read_text().splitlines()[1:]
    assert [row.split(",")[2] for row in rows].count("finished") == 8
    assert rows[7].startswith("larger,1,failed,,")
    in_the_way.unlink()
    assert main(["study", str(tmp_path / "study.yaml"), *options]) == 0


def test_the_log_of_a_failed_run_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise ZeroDivisionError("of all things")

    write_study(tmp_path, STUDY.replace("seeds: 3", "seeds: 1"))
    monkeypatch.setattr("uxsim_geo.engine.simulation.simulate", fail)
    options = ["--out", str(tmp_path / "runs"), "--scheduler", "none", "--quiet"]
    assert main(["study", str(tmp_path / "study.yaml"), *options]) == 1
    log = run_folder(tmp_path, "larger", 0) / "run.log"
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 3
    assert lines[2].endswith(f"ZeroDivisionError: of all things; failed; details in {log}")
    assert "Traceback" in log.read_text()


def test_reports_of_the_first_seed(tmp_path: Path) -> None:
    write_study(tmp_path, STUDY.replace("seeds: 3", "seeds: [4, 2]\nreports: first_seed"))
    study(tmp_path)
    assert (run_folder(tmp_path, "larger", 4) / "results.gpkg").is_file()
    assert not (run_folder(tmp_path, "larger", 2) / "results.gpkg").exists()


def test_runs_need_the_results_folder_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    toll = "  control:\n    tolls: [{polygon: area.gpkg, amount: 1}]\n  duration_s"
    write_study(tmp_path, STUDY.replace("seeds: 3", "seeds: 2"))
    text = BASE.replace("  duration_s", toll).replace("crs: none", "crs: EPSG:32632")
    write_small_run(tmp_path, text)
    area = geopandas.GeoSeries([box(0, -9, 1500, 9)], crs="EPSG:32632")
    area.to_file(tmp_path / "area.gpkg")
    content = (tmp_path / "area.gpkg").read_bytes()

    def clear_and_hide(_: Study) -> None:
        for name in ("net.tntp", "nodes.tntp", "trips.tntp", "area.gpkg"):
            (tmp_path / name).unlink()

    monkeypatch.setattr("pipeline.study._clear", clear_and_hide)
    assert not [line for line in study(tmp_path).lines if "problem" in line]
    config = (run_folder(tmp_path, "base", 1) / "config.yaml").read_text()
    (copy,) = (tmp_path / "runs/study/inputs").iterdir()
    assert f"../../../inputs/{copy.name}" in config
    assert copy.read_bytes() == content


def test_a_study_ends_with_its_comparison(tmp_path: Path) -> None:
    write_study(tmp_path, STUDY.replace("comparison: none", "comparison: tables"))
    study(tmp_path)
    folder = tmp_path / "runs/study"
    totals = pd.read_csv(folder / "comparison/totals.csv")
    nothing = totals[totals["compared"] == "nothing"]
    assert len(nothing) > 10
    assert (nothing["difference"].dropna() == 0.0).all()
    larger = totals[totals["compared"] == "larger"].set_index("figure")
    assert larger.loc["total_travel_time_veh_h", "difference"] != 0.0
    assert {"comparison/totals.csv", "figures.csv", "study.yaml"} <= set(
        manifest(tmp_path)["outputs"]
    )
    write_study(tmp_path)
    study(tmp_path)
    assert not (folder / "comparison/totals.csv").exists()  # of the study as it was before


WRONG = {
    "no base": ("seeds: 3\n", "base is missing"),
    "unknown base": ("base: other.yaml\n", "no such file"),
    "unknown key": ("base: small.yaml\nseed: 3\n", "did you mean seeds?"),
    "no seeds": ("base: small.yaml\nseeds: 0\n", "greater than or equal to 1"),
    "a seed twice": ("base: small.yaml\nseeds: [1, 2, 1]\n", "given twice"),
    "two widths": (
        "base: small.yaml\nseeds: {until: {half_width: 1, relative_half_width: 1}}\n",
        "one of them",
    ),
    "unknown scheduler": ("base: small.yaml\nscheduler: dusk\n", "scheduler"),
    "unknown key of the base": (
        "base: small.yaml\nset: {simulate.platoon_sice: 3}\n",
        "simulate.platoon_size",
    ),
}


@pytest.mark.parametrize(("text", "words"), WRONG.values(), ids=WRONG)
def test_faults_of_a_study_are_told_and_nothing_is_run(
    tmp_path: Path, text: str, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_study(tmp_path, f"{text}scenarios:\n  nothing: []\n")
    assert main(["study", str(path), "--out", str(tmp_path / "runs")]) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "runs").exists()


def test_faults_of_what_a_study_sets_have_its_lines(tmp_path: Path) -> None:
    path = write_study(tmp_path, "base: small.yaml\nset:\n  name.sub: 3\n")
    with pytest.raises(InputError) as raised:
        read_study(path)
    (fault,) = raised.value.faults
    assert (fault.source, fault.line) == (str(path), 3)


def test_a_warning_of_all_scenarios_is_told_once(tmp_path: Path) -> None:
    # every link is as long as it takes to drive: the reader warns of it
    write_study(tmp_path)
    net = tmp_path / "net.tntp"
    net.write_text(net.read_text().replace(" 500 25 ", " 25 25 ").replace(" 1000 50 ", " 50 50 "))
    said = [line for line in study(tmp_path).lines if "warning: length copied" in line]
    assert len(said) == 1
