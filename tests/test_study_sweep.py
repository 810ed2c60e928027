"""Sweeps in studies: points become scenarios, one tidy table, plots against parameters."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from study_files import STUDY, lines_of, manifest, run_folder, study, write_study

from pipeline.cli import main
from pipeline.config_file import load_config
from pipeline.study_config import read_study
from uxsim_geo.errors import InputError

GRID = """sweep:
  grid:
    ingest.trips.factor: [0.5, 1, 2]
    simulate.route_choice: [inertia, logit]
  build_on: [larger]
  figures: [total_delay_veh_h, average_speed_kmh]
"""


def rows_of(folder: Path) -> list[dict[str, str]]:
    with (folder / "runs/study/sweep.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_every_combination_is_run_and_stands_in_the_table(tmp_path: Path) -> None:
    write_study(tmp_path, STUDY.replace("seeds: 3", "seeds: 2") + GRID)
    assert lines_of(study(tmp_path), "problem") == []
    rows = rows_of(tmp_path)
    points = [
        (row["point"], row["ingest.trips.factor"], row["simulate.route_choice"]) for row in rows
    ]
    assert points == [
        (f"point_{number:03d}", factor, choice)
        for number, (factor, choice) in enumerate(
            ((factor, choice) for factor in ("0.5", "1", "2") for choice in ("inertia", "logit")),
            start=1,
        )
        for _ in range(2)
    ]
    # what went in came out, and the scenario that is built on is there
    assert [float(row["vehicles_demanded"]) for row in rows[::4]] == [50, 100, 200]
    config = load_config(run_folder(tmp_path, "point_004", 1) / "config.yaml")
    assert config.simulate.platoon_size == 10
    assert config.simulate.route_choice == "logit"
    assert config.simulate.seed == 1
    files = manifest(tmp_path)["outputs"]
    assert {"sweep.csv", "plots/sweep_total_delay_veh_h.png"} <= set(files)
    assert (tmp_path / "runs/study/plots/sweep_average_speed_kmh.png").is_file()


def test_points_of_a_latin_hypercube_are_those_of_its_seed(tmp_path: Path) -> None:
    text = "base: small.yaml\nsweep:\n  samples: 4\n  latin_hypercube:\n"
    text += "    ingest.trips.factor: {low: 1, high: 2}\n"
    path = write_study(tmp_path, text)
    sweep = read_study(path).config.sweep
    assert sweep is not None
    factors = [point["ingest.trips.factor"] for point in sweep.points().values()]
    assert sorted(int((factor - 1) * 4) for factor in factors) == [0, 1, 2, 3]


@pytest.mark.parametrize(
    ("sweep", "said"),
    [
        ("  grid: {simulate.platoon_sise: [1, 2]}", "study.yaml:9: "),
        ("  grid: {simulate.platoon_size: [5, none]}", "study.yaml:9: "),
        ("  grid: {simulate.seed: [1, 1]}", "stands there twice"),
        ("  grid: {}", "needs grid or latin_hypercube"),
        ("  latin_hypercube: {simulate.duration_s: {low: 9, high: 1}}", "a lower and a higher"),
        ("  grid: {simulate.seed: [1]}\n  figures: [delay]", "delay is none of"),
    ],
)
def test_what_is_wrong_is_told_before_anything_runs(
    tmp_path: Path, sweep: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write_study(tmp_path, f"{STUDY}sweep:\n{sweep}\n")
    assert main(["study", str(path), "--out", str(tmp_path / "runs")]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "runs/study/runs").exists()


def test_a_scenario_with_the_name_of_a_point_is_refused(tmp_path: Path) -> None:
    text = STUDY.replace("larger:", "point_001:") + "sweep:\n  grid: {simulate.seed: [1, 2]}\n"
    with pytest.raises(InputError, match=r"study\.yaml:7: is the name of a point"):
        read_study(write_study(tmp_path, text))
