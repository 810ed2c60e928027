"""Scripts as UXsim's users write them, run as they stand."""

from __future__ import annotations

import re
import runpy
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import REPOSITORY

from uxsim_geo import Settings, simulate
from uxsim_geo.analysis.summary import summary

LISTINGS = REPOSITORY / "tests" / "listings"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(name: str) -> Any:
    return runpy.run_path(str(LISTINGS / f"{name}.py"))["W"]


def test_the_merge_runs_as_printed(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    world = run("merge")
    said = capsys.readouterr().out
    assert "4 nodes, 3 links" in said
    assert "810 vehicles, in platoons of 5" in said
    assert "mean speed" in said
    pictures = {path.name for path in (folder / "out").iterdir()}
    assert {"tsd_traj_links_link1-link3.png", "mfd.png", "network1_1000.png"} <= pictures
    # 1.05 veh/s want to merge from 400 s on and 0.8 do: 650 s + 100 s + the rest after 1,000 s
    left = world.result.events.loc[world.result.events["link"] == "link3", "exit_s"].dropna()
    busy = np.sort(left[(left > 600) & (left < 1150)])
    assert np.diff(busy) == pytest.approx(5 / 0.8)
    assert world.analyzer.statistics()["vehicles_departed"] == 810


def test_a_scenario_in_files_runs_as_printed_and_as_its_tables_do(
    shared: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "dat").mkdir()
    for part in ("nodes", "links", "demand"):
        source = shared / "data" / "uxsim" / f"siouxfalls_{part}.csv"
        shutil.copy(source, folder / "dat" / source.name)
    world = run("files")
    assert "[528 rows x 11 columns]" in capsys.readouterr().out
    assert (folder / "outsf" / "anim_network0.gif").stat().st_size > 10_000

    from uxsim_csv import read_uxsim_demand, read_uxsim_network

    files = [folder / "dat" / f"siouxfalls_{part}.csv" for part in ("nodes", "links", "demand")]
    network = read_uxsim_network(files[0], files[1])
    result = simulate(network, read_uxsim_demand(files[2]), Settings(duration=7200))
    assert result.events.equals(world.result.events)
    by_function, by_world = summary(result, network), world.analyzer.statistics()
    del by_function["engine_wall_s"], by_world["engine_wall_s"]
    assert by_function == by_world


def test_a_grid_under_control_runs(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    world = run("grid")
    out = capsys.readouterr().out
    assert "[31 rows x 11 columns]" in out
    assert not (folder / "out_grid").exists()
    trips = world.result.trips
    # one pair is asked for twice
    assert trips["vehicles"].sum() == 2 * 16 * 27
    link = world.get_link("l(0, 0, 1, 0)")
    assert (link.merge_priority, link.free_flow_speed) == (0.2, 5)
    assert link.capacity_in == pytest.approx(0.5 / 2)  # at 5 m/s: 5·0.2 / (1 + 5·0.2)


def test_the_examples_of_the_docs_run(folder: Path) -> None:
    text = (REPOSITORY / "docs" / "scripting.md").read_text(encoding="utf-8")
    examples = re.findall(r"^```python\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    worlds = []
    for example in examples:
        names: dict[str, Any] = {}
        exec(example, names)
        worlds.append(names["W"])
    merge, junction = worlds
    assert merge.result.trips["vehicles"].sum() == 450 + 360
    assert len(list((folder / "out_merge").iterdir())) == 2
    assert junction.result.trips["vehicles"].sum() == 270 + 450 + 20
    assert junction.get_link("bc").number_of_lanes == 1


def test_the_example_of_the_readme_runs(capsys: pytest.CaptureFixture[str]) -> None:
    text = (REPOSITORY / "README.md").read_text(encoding="utf-8")
    section = text.split("## Scripting")[1].split("\n## ")[0]
    code = [line[4:] for line in section.splitlines() if line.startswith("    ")]
    exec("\n".join(code), {})
    assert "720 vehicles" in capsys.readouterr().out


def test_importing_all_names_is_light() -> None:
    program = (
        "from uxsim_geo import *; import sys; W = World(print_mode=0);"
        "print([m for m in ('geopandas', 'matplotlib', 'numba', 'pyvista') if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=REPOSITORY
    )
    assert done.stdout.strip() == "[]"
