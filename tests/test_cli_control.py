"""Control from a configuration through a run: what it does, and how faults and idlers are told."""

from __future__ import annotations

import json
import sqlite3
from pathlib import Path

import pandas as pd
import pytest
from small_run import CONFIG, TRIPS, run_small, write_small_run

#: a run of 1,200 s in which 100 vehicles depart within 600 s, with two trips files
FIRST = CONFIG[: CONFIG.index("report:")].count("\n") + 1

FAULTY = """
signals:
  - node_id: 3
    phases: [{duration_s: -30, links: [1-3]}]
  - node_id: 4
    phases: [{duration_s: 30, links: [3-4]}]
  - node_id: 4
    phases: [{duration_s: 20, links: [3-4]}]
    begin_s: 600
ramp_meters:
  - links: [1-3]
    rate_veh_per_h: 36000
tolls:
  - links: [3-4]
    amount: [[0, 1], [3600, 2]]
closures:
  - links: [zz, 3-4]
    begin_s: 5000
  - where: lanes > 9
speed_limits:
  - polygon: area.geojson
    speed_kmh: 30
incidents:
  - links: [4-2]
    lanes_closed: 1
    end_s: 0
advice:
  - links: [3-4]
    seconds: 60
    classes: [lorries]
"""


def with_control(text: str, config: str = CONFIG) -> str:
    lines = "".join(f"    {line}\n" for line in text.strip("\n").split("\n"))
    return config.replace("report:", f"  control:\n{lines}report:")


def run_faulty(folder: Path, config: str, capsys: pytest.CaptureFixture[str]) -> list[str]:
    """Run it, see that nothing is simulated, and give the faults."""
    write_small_run(folder, config)
    assert run_small(folder) == 2
    shown = capsys.readouterr()
    assert "Traceback" not in shown.err
    assert shown.out == ""
    left = {path.name for path in (folder / "runs").rglob("*") if path.is_file()}
    assert not left & {"events.parquet", "trips.parquet", "results.gpkg", "summary.json"}
    return [
        line.removeprefix("error: ").replace(f"{folder}/", "")
        for line in shown.err.splitlines()
        if line.startswith("error: ")
    ]


EXPECTED = {
    3: ["simulate.control.signals[0].phases[0].duration_s: a phase must last a finite time"],
    6: ["simulate.control.signals[2]: signal at node 4: sets the plan of 4"],
    11: ["simulate.control.ramp_meters[0].rate_veh_per_h: changes nothing: without control there"],
    14: ["simulate.control.tolls[0].amount: changes when the simulation is over"],
    16: ["simulate.control.closures[0].links: the network has no such link_id"],
    17: ["simulate.control.closures[0].begin_s: begins when the simulation is over"],
    18: ["simulate.control.closures[1].where: no link of the network is meant"],
    20: ["simulate.control.speed_limits[0].polygon: cannot be laid over the network"],
    24: ["simulate.control.incidents[0].lanes_closed: leaves no lane open on link 4-2: close it"],
    25: ["simulate.control.incidents[0].end_s: must be later than begin"],
    29: ["simulate.control.advice[0].classes: no such class of drivers"],
}


def test_all_faults_of_control_come_at_once_with_their_lines(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    area = '{"type": "Polygon", "coordinates": [[[0, 0], [9, 0], [9, 9], [0, 0]]]}'
    (tmp_path / "area.geojson").write_text(area)
    faults = run_faulty(tmp_path, with_control(FAULTY), capsys)
    by_line: dict[int, list[str]] = {}
    for fault in faults:
        place, _, what = fault.partition(": ")
        name, _, line = place.partition(":")
        assert name == "small.yaml", fault
        by_line.setdefault(int(line) - FIRST, []).append(what)
    assert sorted(by_line) == sorted(EXPECTED)
    for line, starts in EXPECTED.items():
        for what, start in zip(by_line[line], starts, strict=True):
            assert what.startswith(start)
    (rate,) = by_line[11]
    assert "1800 veh/h at most; is the unit veh/h? (found '36000')" in rate
    (plans,) = by_line[6]
    assert f"simulate.control.signals[1], line {FIRST + 4}" in plans


def test_faults_in_a_control_file_have_its_lines(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "rules.yaml").write_text("closures:\n  - links: [zz]\n    begin_s: -1\n")
    config = CONFIG.replace("report:", "  control: rules.yaml\nreport:")
    assert [fault.partition(": ")[0] for fault in run_faulty(tmp_path, config, capsys)] == [
        "rules.yaml:2",
        "rules.yaml:3",
    ]


def test_a_meter_holds_what_it_should_and_an_idle_measure_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    control = """
ramp_meters: [{links: [1-3], rate_veh_per_h: 360}]
tolls: [{links: [3-4], amount: 2}]
closures: [{links: [4-2], begin_s: 1195}]
speed_limits: [{links: [4-2], speed_kmh: 36, begin_s: 300}]
"""
    write_small_run(tmp_path, with_control(control))
    assert run_small(tmp_path) == 0
    folder = tmp_path / "runs/small"
    events = pd.read_parquet(folder / "events.parquet")
    gaps = events.loc[events["link"] == "1-3", "exit_s"].sort_values().diff().dropna()
    assert gaps.to_numpy() == pytest.approx(50.0, abs=1e-6)  # 5 vehicles at 0.1 veh/s
    trips = pd.read_parquet(folder / "trips.parquet")
    assert set(trips.loc[trips["status"] == "completed", "toll"]) == {2.0}
    assert set(pd.read_parquet(folder / "speed_limits.parquet")["speed_limit_m_s"]) == {10.0}
    (warning,) = (line for line in capsys.readouterr().err.splitlines() if "closure" in line)
    assert warning.startswith("warning: closure of link 4-2 never took effect")
    assert "closure of link 4-2 never took effect" in (folder / "run.log").read_text()
    figures = json.loads((folder / "manifest.json").read_text())["stages"]["simulate"]["figures"]
    assert [note.partition(" never")[0] for note in figures["ineffective_measures"]] == [
        "closure of link 4-2"
    ]
    with sqlite3.connect(folder / "results.gpkg") as database:
        info = dict(database.execute("select item, value from run_info"))
    assert info["control"] == "ramp_meters: 1, tolls: 1, closures: 1, speed_limits: 1"
    assert info["classes"] == ""


def test_another_control_file_or_area_repeats_the_simulation_only(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rules = "tolls: [{links: [3-4], amount: 2}]\n"
    (tmp_path / "rules.yaml").write_text(rules)
    config = CONFIG.replace("report:", "  control: rules.yaml\nreport:")
    write_small_run(tmp_path, config)

    def words() -> list[str]:
        assert run_small(tmp_path, command="simulate") == 0
        lines = capsys.readouterr().err.splitlines()
        return [line for line in lines if line.endswith("up to date")]

    assert words() == []
    assert words() == ["ingest: up to date", "simulate: up to date"]
    (tmp_path / "rules.yaml").write_text(rules.replace("2}", "3}"))
    assert words() == ["ingest: up to date"]
    trips = pd.read_parquet(tmp_path / "runs/small/trips.parquet")
    assert set(trips.loc[trips["status"] == "completed", "toll"]) == {3.0}


def test_a_polygon_file_is_an_input_of_the_simulation(tmp_path: Path) -> None:
    from pipeline.config_file import load_config
    from pipeline.runs import RunFolder
    from pipeline.simulate import STAGE

    (tmp_path / "area.geojson").write_text("{}")
    control = "perimeters: [{region: {polygon: area.geojson}, flow_veh_per_h: 100}]"
    config = load_config(write_small_run(tmp_path, with_control(control)))
    inputs = STAGE.inputs(config, RunFolder(tmp_path / "runs/small"))
    assert inputs["area.0"] == tmp_path / "area.geojson"


def test_trips_of_a_class_that_may_not_use_the_only_way_are_aborted(tmp_path: Path) -> None:
    config = CONFIG.replace(
        "  trips:\n    file: trips.tntp\n    demand_period_s: 600\n",
        "  trips:\n    - {file: trips.tntp, demand_period_s: 600}\n"
        "    - {file: trips.tntp, demand_period_s: 600, class: lorries}\n",
    )
    classes = "  classes:\n    - {name: lorries, banned: {links: [3-4]}}\n"
    write_small_run(tmp_path, config.replace("report:", f"{classes}report:"))
    assert run_small(tmp_path, "--quiet") == 0
    folder = tmp_path / "runs/small"
    demand = pd.read_parquet(folder / "demand.parquet")
    assert demand["class"].tolist() == ["default", "lorries"]
    trips = pd.read_parquet(folder / "trips.parquet")
    status = trips.groupby("class", observed=True)["status"].unique().map(list)
    assert status["default"] == ["completed"]
    assert status["lorries"] == ["aborted"]
    assert TRIPS.count("Origin") == 1


def test_demand_has_no_column_of_classes_where_no_trips_name_one(finished: Path) -> None:
    assert "class" not in pd.read_parquet(finished / "demand.parquet")
