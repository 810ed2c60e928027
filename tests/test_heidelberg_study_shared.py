"""The shipped study of a bridge in Heidelberg, on the real map, with few trips."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
import pyogrio
import pytest
import yaml
from conftest import REPOSITORY

from pipeline.cli import main

CONFIGS = REPOSITORY / "configs"
STUDY = "study_heidelberg_bridge"

#: by the names of their streets in the map; joined links have several
CLOSED, OTHER = "Theodor-Heuss-Brücke", "Ernst-Walz-Brücke"

#: bytes of the page of a scenario of 13,000 links
MOST_BYTES = 6_000_000


def written(folder: Path, shared: Path, **changes: Any) -> Path:
    """The study and its base, on the file of the map, with 4,000 trips in 20 minutes; its path."""
    base = yaml.safe_load((CONFIGS / "heidelberg.yaml").read_text(encoding="utf-8"))
    study = yaml.safe_load((CONFIGS / f"{STUDY}.yaml").read_text(encoding="utf-8")) | changes
    del base["ingest"]["osm"]["place"]
    base["ingest"]["osm"]["file"] = str(shared / "data/osm/heidelberg.osm.pbf")
    (demand,) = base["ingest"]["demand"]
    demand["demand_period_s"] = 1200
    demand["gravity"]["total_vehicles"] = 4000
    base["simulate"]["duration_s"] = 1800
    for name, values in (("heidelberg", base), (STUDY, study)):
        text = yaml.safe_dump(values, allow_unicode=True)
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    return folder / f"{STUDY}.yaml"


def test_the_scenarios_mean_the_bridge_and_nothing_else(
    shared: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(tmp_path, shared)
    assert main(["study", str(path), "--out", str(tmp_path), "--dry-run", "--quiet"]) == 0
    told = capsys.readouterr().out
    closed, one_lane, slow = (part.splitlines() for part in told.split("\n\n")[:3])
    assert closed[0] == "bridge_closed: 1 edit"
    assert "2 links, 0.5 km  closed: – → always" in closed[1]
    assert "2 links, 0.5 km  lanes_closed: – → 1, always" in one_lane[1]
    assert slow[1].endswith(" → 30")


def test_traffic_of_the_closed_bridge_takes_the_other(shared: Path, tmp_path: Path) -> None:
    whole = yaml.safe_load((CONFIGS / f"{STUDY}.yaml").read_text(encoding="utf-8"))
    scenarios = {"bridge_closed": whole["scenarios"]["bridge_closed"]}
    path = written(tmp_path, shared, seeds=2, scenarios=scenarios)
    assert main(["study", str(path), "--out", str(tmp_path), "--quiet"]) == 0
    folder = tmp_path / STUDY
    links = pd.read_csv(folder / "comparison/links.csv")
    streets = links["name"].fillna("").str.split("; ")
    closed, other = (streets.map(lambda names, one=one: one in names) for one in (CLOSED, OTHER))
    assert links.index[closed].tolist() == links.index[links["changed"]].tolist()
    assert (closed.sum(), other.sum()) == (2, 2)
    volume = links[["volume_veh_base", "volume_veh_scenario"]].set_axis(
        ["base", "scenario"], axis=1
    )
    assert (volume.loc[closed, "base"] > 50).all()
    assert (volume.loc[closed, "scenario"] == 0).all()
    # one by one: the other bridge takes more, both ways
    assert (volume.loc[other, "scenario"] > 1.1 * volume.loc[other, "base"]).all()
    totals = pd.read_csv(folder / "comparison/totals.csv").set_index("figure")
    assert totals.loc["vehicles_demanded", "difference"] == 0
    assert totals.loc["total_travel_time_veh_h", "difference"] > 0
    told = (folder / "comparison/summary.txt").read_text(encoding="utf-8")
    assert "Fewer take " in told
    assert 100_000 < (folder / "comparison.html").stat().st_size < MOST_BYTES
    layers = pyogrio.list_layers(folder / "comparison.gpkg")[:, 0]
    assert "links_bridge_closed" in layers
