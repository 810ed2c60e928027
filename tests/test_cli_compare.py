"""The command that compares two finished runs, and the stage that measures."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest
from small_run import CONFIG, run_small, write_small_run

from pipeline import ingest, measure, simulate
from pipeline.cli import main
from pipeline.compare import compare_pairs, compare_runs
from pipeline.config_file import load_config
from pipeline.execution import Run
from pipeline.progress import Silence
from pipeline.runs import RunFolder
from uxsim_geo.analysis.comparison.comparison import Facts
from uxsim_geo.errors import InputError
from uxsim_geo.export.comparison import files
from uxsim_geo.export.comparison.study import Study

CLOSED = CONFIG.replace("name: small", "name: closed").replace(
    "  duration_s: 1200\n",
    "  duration_s: 1200\n  control: {closures: [{links: [3-4], begin_s: 300}]}\n",
)
FASTER = CONFIG.replace("name: small", "name: faster")


def run_of(folder: Path, config: str) -> Path:
    write_small_run(folder, config)
    assert run_small(folder, "--quiet", command="simulate") == 0
    return folder / "runs" / config.split()[1]


def tables(*arguments: object) -> int:
    """The exit status of a comparison without pictures."""
    return main(["compare", "--tables-alone", *map(str, arguments)])


@pytest.fixture
def runs(tmp_path: Path) -> tuple[Path, Path]:
    return run_of(tmp_path, CONFIG), run_of(tmp_path, CLOSED)


def test_tables_and_sentences_of_two_runs(
    runs: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    assert tables(*runs) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert 'simulate.control.closures.0: – in A, {"links": ["3-4"]' in said.out
    assert "closed against small, one pair of runs, 1,200 s each:" in said.out
    assert "Vehicles unfinished rises by " in said.out
    out = runs[0].parent / "closed_against_small"
    assert main(["inspect", str(out)]) == 0
    assert capsys.readouterr().out.startswith("closed against small, one pair of runs, 1,200 s")
    out = out / "comparison"
    names = {path.name for path in out.iterdir()}
    assert {"totals.csv", "links.csv", "trips.csv", "summary.txt", "comparison.json"} <= names
    links = pd.read_csv(out / "links.csv").set_index("link_id")
    assert links["changed"].to_dict() == {"1-3": False, "3-4": True, "4-2": False}
    assert (links["scenario"] == "closed").all()
    totals = pd.read_csv(out / "totals.csv").set_index("figure")
    assert totals.loc["vehicles_completed", "difference"] < 0
    assert pd.isna(totals.loc["vehicles_completed", "low"])
    told = pd.read_csv(out / "config_differences.csv")
    assert told["key"].tolist() == ["simulate.control.closures.0"]
    assert json.loads((out / "comparison.json").read_text())["comparisons"][0]["base"] == "small"


def test_a_run_and_itself(runs: tuple[Path, Path], capsys: pytest.CaptureFixture[str]) -> None:
    assert tables(runs[0], runs[0]) == 0
    said = capsys.readouterr().out
    assert "Both runs were told the same." in said
    assert "Nothing changes: all figures are equal in the pair of runs." in said


def test_the_same_comparison_is_the_same_bytes_and_replaces_itself(
    runs: tuple[Path, Path], tmp_path: Path
) -> None:
    out = tmp_path / "found"
    for _ in range(2):
        assert tables(*runs, "--out", out) == 0
    assert tables(*runs, "--out", tmp_path / "other") == 0
    for path in (out / "comparison").iterdir():
        assert path.read_bytes() == (tmp_path / "other" / "comparison" / path.name).read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir() if path.name.startswith(".")) == []


def test_layers_and_page_lie_beside_and_what_fails_is_told_without_the_rest(
    runs: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    real = files.study_writers

    def some_writers(study: Study) -> dict[str, Callable[[Path], None]]:
        def fail(path: Path) -> None:
            raise RuntimeError(f"no room for {path.name}")

        found = real(study)
        assert study.scenarios[0].edits[0].startswith("simulate.control.closures.0: ")
        names = ("comparison.gpkg", "comparison.html")
        return {"comparison/bad.png": fail} | {name: found[name] for name in names}

    monkeypatch.setattr(files, "study_writers", some_writers)
    assert main(["compare", *map(str, runs)]) == 1
    said = capsys.readouterr()
    assert said.err == "error: comparison/bad.png could not be written: no room for bad.png\n"
    assert "Vehicles unfinished rises by " in said.out
    out = runs[0].parent / "closed_against_small"
    assert sorted(path.name for path in out.iterdir()) == [
        "comparison",
        "comparison.gpkg",
        "comparison.html",
        "errors.log",
    ]
    assert "RuntimeError" in (out / "errors.log").read_text(encoding="utf-8")
    assert "closed against small" in (out / "comparison.html").read_text(encoding="utf-8")


def test_a_folder_of_something_else_is_left_alone(
    runs: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "letter.txt").write_text("dear", encoding="utf-8")
    assert tables(*runs, "--out", tmp_path / "mine") == 2
    assert "holds other files than those of a comparison" in capsys.readouterr().err
    assert [path.name for path in (tmp_path / "mine").iterdir()] == ["letter.txt"]
    assert tables(*runs, "--out", tmp_path / "net.tntp") == 2
    assert "is a file" in capsys.readouterr().err


def test_what_is_no_finished_run_is_told_for_both(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert tables(tmp_path / "a", tmp_path / "b") == 2
    said = capsys.readouterr().err
    assert said.count("is no run: it holds no readable manifest.json") == 2


def test_a_run_whose_files_were_touched_is_refused(runs: tuple[Path, Path]) -> None:
    path = runs[1] / "trips.parquet"
    path.write_bytes(path.read_bytes() + b" ")
    with pytest.raises(InputError, match=r"trips\.parquet is not what the run wrote"):
        compare_runs(*runs)


def test_runs_that_cannot_be_compared_are_refused_in_words(tmp_path: Path) -> None:
    usual = run_of(tmp_path, CONFIG)
    longer = run_of(tmp_path, CONFIG.replace("name: small", "name: long").replace("1200", "1300"))
    with pytest.raises(InputError, match="the one ends at 1200 s, the other at 1300 s"):
        compare_runs(usual, longer)


def test_other_seeds_and_other_demand_are_said(tmp_path: Path) -> None:
    usual = run_of(tmp_path, CONFIG)
    other = CONFIG.replace("name: small", "name: other").replace(
        "  duration_s: 1200\n", "  duration_s: 1200\n  seed: 7\n"
    )
    other = other.replace("demand_period_s: 600", "demand_period_s: 600\n    factor: 1.5")
    found = compare_runs(usual, run_of(tmp_path, other))
    said = "\n".join(found.comparison.remarks)
    assert "Seeds differ" in said
    assert "Vehicles in the scenario alone: 50" in said
    assert [difference.key for difference in found.differences] == [
        "ingest.trips.0.factor",
        "simulate.seed",
    ]


def test_time_bins_and_corridors_of_the_first_run_hold_for_both(tmp_path: Path) -> None:
    section = "measure:\n  bin_s: 400\n  corridors: [{links: [1-3, 3-4], name: way}]\n"
    first, second = run_of(tmp_path, CONFIG + section), run_of(tmp_path, FASTER)
    found = compare_runs(first, second)
    assert found.comparison.bin_s == 400.0
    assert found.comparison.corridors["corridor"].tolist() == ["way"] * 3
    assert compare_runs(first, second, 600.0).comparison.bin_s == 600.0
    assert compare_runs(second, first).comparison.bin_s == 300.0


def test_a_corridor_that_the_network_lacks_is_told(tmp_path: Path) -> None:
    section = "measure: {corridors: [{links: [1-3, 3-9], name: way}, {street: Main}]}\n"
    found = compare_runs(*[run_of(tmp_path, CONFIG + section)] * 2)
    assert found.warnings == [
        "warning: corridor way: the network has no link 3-9; left out",
        "warning: corridor: no link is called Main; left out",
    ]


@pytest.mark.parametrize(
    ("section", "said"),
    [
        ("{corridors: [{}]}", "needs links or street"),
        ("{corridors: [{links: [a], street: b}]}", "needs links or street"),
        ("{corridors: [{street: b, name: c}]}", "name goes with links"),
        ("{corridors: [{street: b}, {street: b}]}", "two of them are b"),
        ("{bin_s: 0}", "greater than 0"),
        ("{zones: nowhere.gpkg}", "no such file"),
    ],
)
def test_faults_of_the_section(tmp_path: Path, section: str, said: str) -> None:
    path = write_small_run(tmp_path, f"{CONFIG}measure: {section}\n")
    with pytest.raises(InputError, match=said):
        load_config(path)


STAGES = (ingest.STAGE, simulate.STAGE, measure.STAGE)


def test_the_stage_leaves_what_comparisons_read_and_knows_when_it_is_up_to_date(
    tmp_path: Path,
) -> None:
    config = load_config(write_small_run(tmp_path))
    folder = RunFolder(tmp_path / "runs" / "small")
    assert Run(config, folder, Silence(), ["test"], STAGES).execute("measure") == []
    found = measure.read_measures(folder)
    assert found.links["link_id"].tolist() == ["1-3", "3-4", "4-2"]
    assert found.bin_s == 300.0
    compared = compare_pairs([(folder, folder), (folder, folder)], Facts("base", "same"))
    assert (compared.totals["difference"] == 0.0).all()
    assert len(compared.seeds) == 2
    record = folder.read_manifest().stages["measure"]
    assert set(record.outputs) == {
        path.relative_to(folder.path).as_posix() for path in (folder / "measures").iterdir()
    }
    assert Run(config, folder, Silence(), ["test"], STAGES).is_current(measure.STAGE)
    other = load_config(tmp_path / "small.yaml", ["measure.bin_s=60"])
    assert not Run(other, folder, Silence(), ["test"], STAGES).is_current(measure.STAGE)


def test_zones_of_a_file(tmp_path: Path) -> None:
    import geopandas as gpd
    import shapely

    boxes = [shapely.box(-1, -1, 600, 1), shapely.box(1400, -1, 2100, 1), shapely.box(9, 9, 10, 10)]
    table = gpd.GeoDataFrame({"area": ["west", "east", "empty"]}, geometry=boxes)
    with pytest.warns(UserWarning, match="crs"):  # the network has none either
        table.to_file(tmp_path / "areas.gpkg")
    config = f"{CONFIG}measure: {{zones: areas.gpkg, zone_name: area}}\n"
    run = run_of(tmp_path, config)
    found = compare_runs(run, run)
    ends = ["origin_zone", "destination_zone"]
    assert found.comparison.zone_pairs[ends].to_numpy().tolist() == [["west", "east"]]
    assert found.warnings == ["warning: measure.zones: no node lies in empty"]
