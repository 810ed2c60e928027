"""What the pages for readers list is what the program knows."""

from __future__ import annotations

import re
from pathlib import Path

import yaml

from pipeline.config import Config
from uxsim_geo.network.overrides import NAMES, TEXTS

PAGE = (Path(__file__).parents[1] / "docs" / "data.md").read_text(encoding="utf-8")


def test_the_page_lists_every_column_of_overrides() -> None:
    table = PAGE[PAGE.index("| attribute |") : PAGE.index("### Files of your own")]
    assert set(re.findall("`(.*?)`", table)) == {*NAMES, *TEXTS}


def test_the_worked_configuration_is_one() -> None:
    example = re.search("```yaml\n(.*?)```", PAGE, flags=re.DOTALL)
    assert example is not None
    assert Config.model_validate(yaml.safe_load(example[1])).ingest.length_unit == "ft"
