"""The page on control: its examples work, and its figures are those of the runs."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
from conftest import REPOSITORY

from pipeline.config import Config
from pipeline.config_file import load_config
from pipeline.control_config import ControlSection
from pipeline.ingest import read_sources
from uxsim_geo.analysis.summary import summary
from uxsim_geo.demand.demand import Demand
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result

PAGE = (REPOSITORY / "docs/control.md").read_text(encoding="utf-8")
GRIDLOCK = REPOSITORY / "configs/gridlock.yaml"


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)


@cache
def ring() -> tuple[Network, Demand]:
    return read_sources(load_config(GRIDLOCK).ingest)


def run(config: Config, *, lanes: float = 1.0) -> Result:
    network, demand = ring()
    network = replace(network, links=network.links.assign(lanes=lanes))
    control = [entry.measure() for _, _, entry in config.simulate.control.entries()]
    classes = [entry.driver_class() for entry in config.simulate.classes]
    settings = config.simulate.settings()
    return simulate(network, demand, settings, control=control, classes=classes)


@pytest.mark.parametrize("block", blocks("yaml"))
def test_every_example_is_understood_and_takes_effect(tmp_path: Path, block: str) -> None:
    path = tmp_path / "example.yaml"
    data = (REPOSITORY / "data").as_posix()
    lines = "".join(f"  {line}\n" for line in block.splitlines())
    simulated, _, report = GRIDLOCK.read_text().replace("../data", data).partition("\nreport:")
    path.write_text(f"{simulated}{lines}\nreport:{report}")
    config = load_config(path)
    assert list(config.simulate.control.entries())
    assert run(config, lanes=2.0 if "incidents" in block else 1.0).notes == ()


def test_there_is_an_example_of_every_kind() -> None:
    text = "\n".join(blocks("yaml"))
    assert [kind for kind in ControlSection.model_fields if f"  {kind}:\n" not in text] == []


@pytest.mark.parametrize("block", blocks("python"))
def test_examples_in_python_run_and_keep_the_ring_moving(
    block: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    network, demand = ring()
    names = {"network": network, "demand": demand}
    names["settings"] = load_config(GRIDLOCK).simulate.settings()
    exec(block, names)
    result = names["result"]
    assert isinstance(result, Result)
    assert (result.trips["status"] == "completed").all()


@pytest.mark.parametrize(
    ("name", "shown"), re.findall(r"^\| \[(\w+)\]\(\S+\) \| [^|]+ \| (.+) \|$", PAGE, re.MULTILINE)
)
def test_the_table_of_cures_shows_what_the_runs_give(name: str, shown: str) -> None:
    config = load_config(REPOSITORY / f"configs/{name}.yaml")
    figures = summary(run(config), ring()[0])
    hours = figures["total_travel_time_veh_s"] / 3600
    completed, gridlock = figures["vehicles_completed"], figures["gridlocked"]
    assert shown == f"{completed:,} | {hours:,.0f} | {'yes' if gridlock else 'no'}"
    assert (completed == 4200) == (name != "gridlock")


def test_every_way_to_cure_is_in_the_table() -> None:
    cures = {path.stem for path in (REPOSITORY / "configs").glob("gridlock*.yaml")}
    listed = set(re.findall(r"^\| \[(\w+)\]", PAGE, re.MULTILINE))
    assert listed == cures - {"gridlock_prevented"}
