"""The page on scenarios: its study is understood, says what the page says, and names every edit."""

from __future__ import annotations

import re
from pathlib import Path

from conftest import REPOSITORY

from pipeline.config_file import load_config, read_config
from pipeline.config_keys import Reading
from pipeline.dry_run import dry_run_text
from pipeline.edits_config import TableEdit
from pipeline.edits_config_study import StudyEdit
from pipeline.ingest import read_sources
from pipeline.scenarios import Tables, read_scenarios, resolve
from pipeline.yaml_source import read_yaml

PAGE = (REPOSITORY / "docs/studies_edits.md").read_text(encoding="utf-8")
CONFIG = REPOSITORY / "configs/sioux_falls.yaml"


def block(language: str) -> str:
    found = re.search(rf"^```{language}\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    assert found is not None
    return found[1]


def test_the_study_of_the_page_changes_what_the_page_says(tmp_path: Path) -> None:
    path = tmp_path / "study.yaml"
    path.write_text(block("yaml"), encoding="utf-8")
    study = Reading(read_yaml(path), tmp_path)
    tables = Tables(*read_sources(load_config(CONFIG).ingest))
    found = resolve(read_config(CONFIG), study, read_scenarios(study), tables)
    assert block("text").strip() in dry_run_text(found, tables)


def test_the_page_names_every_edit() -> None:
    named = {key.alias or name for name, key in StudyEdit.model_fields.items()}
    assert {name for name in named if f"`{name}: " not in PAGE and f"`{name}`" not in PAGE} == set()
    last = PAGE.rpartition("## In a single run")[2]
    own = {key.alias or name for name, key in TableEdit.model_fields.items()}
    assert {name for name in own if f"`{name}`" not in last} == set()
