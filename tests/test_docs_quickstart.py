"""The quick start does what it says: its two configurations, with an extract for the place."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import yaml
from conftest import REPOSITORY

from pipeline.cli import main
from pipeline.config import Config

PAGE = (REPOSITORY / "docs/quickstart.md").read_text(encoding="utf-8")
FIRST, SECOND = (
    yaml.safe_load(block)
    for block in re.findall(r"^```yaml\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
)


def test_both_are_configurations() -> None:
    assert Config.model_validate(FIRST, strict=False).name == "town"
    assert Config.model_validate(FIRST | SECOND, strict=False).name == "town_closed"


@pytest.fixture(scope="module")
def runs(shared: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The folders of both runs."""
    folder = tmp_path_factory.mktemp("quickstart")
    extract = str(shared / "data/osm/bad-hersfeld.osm.xml.gz")
    for config in (FIRST, FIRST | SECOND):
        ingest: dict[str, Any] = config["ingest"] | {"osm": {"file": extract, "country": "DE"}}
        path = folder / f"{config['name']}.yaml"
        path.write_text(yaml.safe_dump(config | {"ingest": ingest}), encoding="utf-8")
        assert main(["run", str(path), "--out", str(folder), "--quiet"]) == 0
    return folder / "town", folder / "town_closed"


def test_what_the_page_names_is_there(runs: tuple[Path, Path]) -> None:
    assert (runs[0] / "results.gpkg").is_file()
    assert (runs[0] / "plots/network_average.png").is_file()


def test_nobody_enters_the_street_that_is_closed(runs: tuple[Path, Path]) -> None:
    entered = []
    for run in runs:
        links = pd.read_parquet(run / "network/links.parquet", columns=["link_id", "name"])
        street = links.loc[links["name"] == "Dudenstraße", "link_id"]
        events = pd.read_parquet(run / "events.parquet", columns=["link"])
        entered.append(int(events["link"].isin(street).sum()))
    assert entered[0] > 100
    assert entered[1] == 0


def test_every_vehicle_wants_to_depart_as_before(runs: tuple[Path, Path]) -> None:
    before, after = (pd.read_parquet(run / "trips.parquet") for run in runs)
    same = ["origin", "destination", "vehicles", "depart_s"]
    pd.testing.assert_frame_equal(before[same], after[same])
