"""The page on networks and demand: its configurations are ones, but for files that are not here."""

from __future__ import annotations

import re
from typing import Any

import pytest
import yaml
from conftest import REPOSITORY

from pipeline.ingest_config import IngestSection

PAGE = (REPOSITORY / "docs/networks.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```yaml\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("block", BLOCKS)
def test_every_configuration_is_understood(block: str) -> None:
    section: dict[str, Any] = yaml.safe_load(block)["ingest"]
    section.setdefault("demand", [{"od": {"file": "od.csv"}, "demand_period_s": 3600.0}])
    assert IngestSection.model_validate(section).format == section["format"]


def test_every_format_has_one() -> None:
    told = {yaml.safe_load(block)["ingest"]["format"] for block in BLOCKS}
    assert told == {"osm", "gmns", "csv", "tables"}
