"""The page on analysis: its examples run, its pictures are there, and what it names exists."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path

import pandas as pd
import pytest
import yaml
from conftest import REPOSITORY

from pipeline.config_file import load_config
from pipeline.plot_config import KINDS, PlotEntry
from uxsim_geo.world.analyzer import Analyzer

PAGE = (REPOSITORY / "docs/analysis.md").read_text(encoding="utf-8")


def test_examples_run_one_after_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(REPOSITORY)
    names: dict[str, object] = {}
    for block in re.findall(r"^```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL):
        exec(block, names)
    tables = {name: value for name, value in names.items() if isinstance(value, pd.DataFrame)}
    assert {"states", "totals", "mfd", "of_some", "close_up", "cells", "users"} <= set(tables)
    assert all(len(table) for table in tables.values())


def test_every_function_that_is_named_exists() -> None:
    rows = re.findall(r"^\| (`\w+`(?:, `\w+`)?) \| (`\w.*?) \| ", PAGE, re.MULTILINE)
    assert len(rows) > 12
    for modules, functions in rows:
        names = re.findall(r"\w+", modules)
        homes = [import_module(f"uxsim_geo.analysis.{name}") for name in names]
        for function in re.findall(r"\w+", functions):
            assert any(hasattr(home, function) for home in homes), function


def test_every_plot_on_the_page_is_one_and_those_of_the_paper_are_in_the_configurations() -> None:
    entries = re.findall(r"^ +- (\{plot: .*\})$", PAGE, re.MULTILINE)
    told = {entry["plot"] for entry in map(yaml.safe_load, entries)}
    for entry in map(yaml.safe_load, entries):
        if "region" not in entry:
            PlotEntry.model_validate(entry)
    in_text = set(re.findall(r"`(\w+)` \|", PAGE)) & set(KINDS)
    assert told | in_text >= set(KINDS) - {"network_plan", "network_anim"}
    for name in ("gridlock", "gridlock_prevented"):
        config = load_config(REPOSITORY / f"configs/{name}.yaml")
        plots = {entry.plot for entry in config.report.plots}
        assert {"time_space_diagram_traj_links", "macroscopic_fundamental_diagram"} <= plots
    sioux_falls = load_config(REPOSITORY / "configs/sioux_falls.yaml").report.plots
    assert [entry.time_s for entry in sioux_falls if entry.plot == "network"] == [1800, 4200]


def test_every_call_of_the_analyzer_is_there() -> None:
    calls = re.findall(r"W\.analyzer\.(\w+)\(", PAGE)
    assert len(calls) > 4
    assert [name for name in calls if not hasattr(Analyzer, name)] == []


def test_every_picture_is_there_and_none_is_left_over() -> None:
    pages = [path.read_text(encoding="utf-8") for path in (REPOSITORY / "docs").glob("*.md")]
    pages.append((REPOSITORY / "README.md").read_text(encoding="utf-8").replace("docs/", ""))
    shown = {name for page in pages for name in re.findall(r"\]\(images/([\w.]+)\)", page)}
    assert {path.name for path in Path(REPOSITORY / "docs/images").iterdir()} == shown
