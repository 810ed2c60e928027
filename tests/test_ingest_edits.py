"""Edits of a configuration: made when its files are read, noted, and part of what is up to date."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
from small_run import CONFIG, run_small, write_small_run

from pipeline import ingest
from pipeline.config_file import load_config, write_config
from pipeline.runs import RunFolder
from uxsim_geo.demand.files import read_demand
from uxsim_geo.errors import InputError
from uxsim_geo.network.files import read_network

EDITS = """edits:
  - set: {links: [1-3], free_speed_kmh: 36}
  - add_node: {id: "9", x: 1000, y: 300}
  - add_link: {id: up, from: "3", to: "9", lanes: 1, free_speed_kmh: 72}
  - add_link: {id: down, from: "9", to: "4", lanes: 1, free_speed_kmh: 72, length_m: 900}
  - shift_demand: {by_s: 300, share: 0.5}
"""


def written(folder: Path, edits: str = EDITS) -> Path:
    return write_small_run(folder, CONFIG.replace("simulate:\n", f"{edits}simulate:\n"))


def faults_of(folder: Path, capsys: pytest.CaptureFixture[str]) -> str:
    capsys.readouterr()
    assert run_small(folder, command="ingest") == 2
    return capsys.readouterr().err


def test_tables_of_a_run_are_those_with_the_edits(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    written(tmp_path)
    assert run_small(tmp_path, command="simulate") == 0
    folder = RunFolder(tmp_path / "runs/small")
    network = read_network(folder / "network")
    links = network.links.set_index("link_id")
    assert links.loc["1-3", "free_speed"] == pytest.approx(10.0)
    # from (500, 0) to (1000, 300), plane coordinates in m
    assert links.loc["up", "length"] == pytest.approx((500**2 + 300**2) ** 0.5)
    assert links.loc["down", "length"] == 900
    told = network.notes.loc[network.notes["topic"] == "edits", "note"].tolist()
    assert told[:2] == ["edit 1, set: free_speed of 1 link", "edit 2, add_node: exists of 1 node"]
    demand = read_demand(folder / "demand.parquet")
    assert len(demand.changes) == 1
    assert "1 OD pairs, 100 trips" in capsys.readouterr().err
    trips = pd.read_parquet(folder / "trips.parquet")
    assert trips["vehicles"].sum() == 100
    inputs = folder.read_manifest().stages["simulate"].inputs
    assert "demand_changes.parquet" in inputs
    assert "edits:\n- set:\n" in (folder / "config.yaml").read_text()


def test_half_of_the_trips_depart_five_minutes_later(tmp_path: Path) -> None:
    departures = []
    for name, edits in (("plain", ""), ("later", EDITS)):
        (tmp_path / name).mkdir()
        written(tmp_path / name, edits)
        assert run_small(tmp_path / name, command="simulate") == 0
        trips = pd.read_parquet(tmp_path / name / "runs/small/trips.parquet")
        departures.append(trips.set_index("number")["depart_s"].sort_index())
    later = departures[1] - departures[0]
    assert later.round(6).value_counts().to_dict() == {0.0: 10, 300.0: 10}


def test_ingestion_runs_again_where_edits_changed_and_not_where_they_did_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    written(tmp_path)
    assert run_small(tmp_path, command="simulate") == 0
    capsys.readouterr()
    assert run_small(tmp_path, command="simulate") == 0
    assert capsys.readouterr().err.count("up to date") == 2
    written(tmp_path, EDITS.replace("0.5", "0.25"))
    assert run_small(tmp_path, command="simulate") == 0
    assert "up to date" not in capsys.readouterr().err
    written(tmp_path, "")
    assert run_small(tmp_path, command="simulate") == 0
    assert not (tmp_path / "runs/small/demand_changes.parquet").exists()


def test_a_line_from_a_file_is_an_input_of_the_run(tmp_path: Path) -> None:
    (tmp_path / "way.geojson").write_text("{}")
    text = """edits:
  - add_link: {id: over, from: "3", to: "4", along: way.geojson, lanes: 1, free_speed_kmh: 72}
"""
    written(tmp_path, text)
    config = load_config(tmp_path / "small.yaml")
    (edit,) = config.edits
    assert edit.add_link is not None
    assert edit.add_link.along == tmp_path / "way.geojson"
    inputs = ingest.STAGE.inputs(config, RunFolder(tmp_path / "run"))
    assert inputs["edits.0.add_link.along"] == tmp_path / "way.geojson"


def test_edits_at_fault_are_told_at_their_lines(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(tmp_path, 'edits:\n  - set: {links: ["7"], lanes: 2}\n  - add: {lanes: 1}\n')
    line = path.read_text().splitlines().index("edits:") + 1
    told = faults_of(tmp_path, capsys)
    assert f"small.yaml:{line + 2}: edits[1].add: says of no link" in told
    path = written(tmp_path, 'edits:\n  - set: {links: ["7"], lanes: 2}\n')
    assert f"small.yaml:{line + 1}: edits[0].set.links: the network has no such link_id" in (
        faults_of(tmp_path, capsys)
    )


def test_edits_are_written_as_they_were_given(tmp_path: Path) -> None:
    config = load_config(written(tmp_path))
    write_config(config, tmp_path / "again.yaml")
    text = (tmp_path / "again.yaml").read_text()
    assert text.count("add_link:") == 2
    assert "ban_turn" not in text
    assert load_config(tmp_path / "again.yaml") == config


def test_a_street_cannot_be_chosen_where_none_has_a_name(tmp_path: Path) -> None:
    from pipeline.edits import apply_edits, placed_edits
    from pipeline.ingest import read_sources

    config = load_config(written(tmp_path, "edits:\n  - add: {street: High Street, lanes: 1}\n"))
    with pytest.raises(InputError, match=r"edits\[0\].add.street: the links .* have no names"):
        apply_edits(*read_sources(config.ingest), placed_edits(config))


SIGNALS = """node_id,phase,link_id,green_s
3,1,1-3,30
3,2,,10
4,1,3-4,40
"""


def test_signals_of_a_table_go_with_their_links_and_nodes(tmp_path: Path) -> None:
    (tmp_path / "signals.csv").write_text(SIGNALS)
    text = """edits:
  - add_link: {id: other, from: "3", to: "4", lanes: 1, free_speed_kmh: 72}
  - remove_links: {links: [3-4]}
  - remove_signals: {nodes: ["3"]}
"""
    path = written(tmp_path, text)
    told = path.read_text().replace("  crs: none\n", "  crs: none\n  signal_table: signals.csv\n")
    path.write_text(told)
    assert run_small(tmp_path, command="simulate") == 0
    table = tmp_path / "runs/small/network/signals.csv"
    assert len(table.read_text().splitlines()) == 1
    path.write_text(told.replace('{nodes: ["3"]}', '{nodes: ["4"]}'))
    assert run_small(tmp_path, command="simulate") == 0
    assert [line.split(",")[0] for line in table.read_text().splitlines()[1:]] == ["3", "3"]
