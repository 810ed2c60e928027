"""The page on space and time: its example runs, its configuration is one, its arrays are there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml
from conftest import REPOSITORY
from mapped_network import states_with_a_queue, two_way_road
from newell_link import events_of, result_of, trips_of
from test_export_space_time_files import needs_opengl

from pipeline.space_time_config import SpaceTimeSection
from uxsim_geo.export.space_time.vtk import write_vtk
from uxsim_geo.settings import Settings

PAGE = (REPOSITORY / "docs/space_time.md").read_text(encoding="utf-8")


@needs_opengl
def test_the_example_draws_a_picture_and_a_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    network = two_way_road()
    result = result_of(events_of(network, [(0, 0, 0.0, 400.0)]), trips_of([{}]), Settings(600.0))
    (block,) = re.findall(r"^```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    exec(block, {"network": network, "result": result})
    assert {file.name for file in tmp_path.iterdir()} == {"space_time.png", "space_time.html"}


def test_the_configuration_on_the_page_is_one() -> None:
    (block,) = re.findall(r"^    report:\n(?:    .*\n)+", PAGE, re.MULTILINE)
    report = yaml.safe_load(block)["report"]
    SpaceTimeSection.model_validate(report["space_time"])


def test_every_array_for_paraview_is_told(tmp_path: Path) -> None:
    import pyvista as pv

    network = two_way_road()
    path = tmp_path / "a.vtp"
    write_vtk(path, network, states_with_a_queue(network))
    table = PAGE.split("| array of cells |")[1].split("\n\n")[0]
    told = set(re.findall(r"`(\w+)`", "".join(row.split("|")[1] for row in table.splitlines()[2:])))
    assert told == set(pv.read(path).cell_data.keys())
