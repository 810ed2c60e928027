"""The project inside a results file, opened by QGIS itself where the system has it."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imread
from packaged_road import NAMES, two_way_road, write

from uxsim_geo.export.columns import LAYERS, titled
from uxsim_geo.network.driving_side import DrivingSide

LOOK = Path(__file__).with_name("qgis_look.py")
SIDES: dict[str, tuple[str | None, DrivingSide]] = {
    "degrees": ("EPSG:4326", "right"),
    "metres": ("EPSG:25832", "left"),
    "no CRS": (None, "right"),
}
MAPS = {"nodes", "links", "link_states", "od_lines", "trajectories", "import_notes"}


@pytest.fixture(scope="module")
def python_of_qgis() -> str:
    """The system's interpreter, whose packages QGIS comes with."""
    python = shutil.which("python3", path=os.defpath)
    if python is None or subprocess.run([python, "-c", "import qgis"], check=False).returncode:
        pytest.skip("needs QGIS for the system's python3: apt-get install qgis python3-qgis")
    return python


@pytest.fixture(scope="module", params=SIDES)
def seen(
    request: pytest.FixtureRequest, python_of_qgis: str, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Any]:
    """What QGIS tells of a results file, the folder of its pictures, and what was asked for."""
    folder = tmp_path_factory.mktemp("qgis")
    crs, side = SIDES[request.param]
    write(folder / "results.gpkg", two_way_road(crs), side=side)
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        [python_of_qgis, str(LOOK), str(folder / "results.gpkg"), str(folder)],
        capture_output=True,
        text=True,
        check=False,
        env=environment,
        cwd="/",
    )
    assert done.returncode == 0, done.stderr
    told: dict[str, Any] = json.loads(done.stdout)
    return told | {"folder": folder, "asked_crs": crs, "side": side}


def layer(seen: dict[str, Any], name: str) -> dict[str, Any]:
    told: dict[str, Any] = seen["layers"][f"uxsim_geo_{name}"]
    return told


def test_the_project_opens_with_every_layer_valid_and_styled(seen: dict[str, Any]) -> None:
    assert seen["opened"]
    assert seen["title"] == "small"
    on_map = {"EPSG:4326": "EPSG:32632"}  # the zone of UTM around 8 degrees east
    assert seen["crs"] == on_map.get(seen["asked_crs"], seen["asked_crs"] or "")
    assert {layer(seen, name)["crs"] for name in MAPS} == {seen["asked_crs"] or ""}
    assert set(seen["layers"]) == {f"uxsim_geo_{name}" for name in LAYERS}
    assert seen["visible"] == ["uxsim_geo_link_states"]
    for name in LAYERS:
        told = layer(seen, name)
        assert told["valid"]
        assert told["rows"] > 0
        assert told["faults"] == []
        assert told["attribution"] == "© <Jürgen> & 'co'"
        if name in MAPS:
            assert told["renderer"] in ("graduatedSymbol", "categorizedSymbol")
            assert len(told["classes"]) >= 2
        for column in LAYERS[name].columns:
            assert told["aliases"][column.name] == titled(column)


def test_layers_have_their_styles_without_the_project_too(seen: dict[str, Any]) -> None:
    for name in LAYERS:
        told, alone = layer(seen, name), seen["alone"][f"uxsim_geo_{name}"]
        assert alone == {
            "valid": True,
            "classes": len(told["classes"]),
            "styles": sorted(told["styles"]),
        }


def test_trajectories_have_four_coordinates(seen: dict[str, Any]) -> None:
    assert layer(seen, "trajectories")["geometry"] == "LineStringZM"


def test_links_have_styles_by_speed_delay_queue_and_use(seen: dict[str, Any]) -> None:
    assert layer(seen, "links")["styles"] == ["delay", "queue", "roads", "speed", "volume"]
    assert layer(seen, "link_states")["styles"] == ["delay", "flow", "queue", "speed"]
    assert layer(seen, "links")["style"] == layer(seen, "link_states")["style"] == "speed"


def test_the_slider_shows_exactly_the_links_of_one_bin(seen: dict[str, Any]) -> None:
    assert layer(seen, "link_states")["temporal"]
    assert seen["mode"] == 1
    links = ["a'b", 'ü"2']
    assert seen["frames"] == [
        [[link, f"2024-03-01T07:0{minute}:00Z"] for link in links] for minute in range(3)
    ]


def test_every_theme_is_drawn(seen: dict[str, Any]) -> None:
    assert len(seen["themes"]) == 11
    for theme, told in seen["themes"].items():
        assert told["errors"] == [], theme
        assert told["colours"] >= 2, theme


def test_traffic_stands_on_its_side_of_the_road(seen: dict[str, Any]) -> None:
    """Those who drive to the east do so in the south where people drive on the right."""
    picture = imread(seen["folder"] / "whole_run_speed.png")[:, :, :3]
    # between 40 and 60 % of free speed
    speed = np.array([0xF2, 0xB8, 0x4B]) / 255
    rows = np.nonzero(np.abs(picture - speed).max(axis=2) < 0.02)[0]
    assert rows.size
    # the road may lie a little aslant, with its middle in that of the picture
    south = rows.mean() - len(picture) / 2
    assert south > 1 if seen["side"] == "right" else south < -1


def test_names_come_out_as_text(seen: dict[str, Any]) -> None:
    (sheet,) = seen["layouts"].values()
    assert sheet["status"] == 0
    assert any(NAMES[0] in text for text in sheet["texts"])
    assert any("© <Jürgen> & 'co'" in text for text in sheet["texts"])
    for name in ("links", "link_states"):
        head = layer(seen, name)["tips"][0].partition("<table>")[0]
        assert head == (
            "<b>O'Connell &quot;Straße&quot;; DROP TABLE links;-- &lt;b&gt;🚧&lt;/b&gt; &amp; "
            "[% 6 * 7 %] %]</b>"
        )


def test_the_sheet_says_where_when_and_how_bad(seen: dict[str, Any]) -> None:
    (sheet,) = seen["layouts"].values()
    text = "\n".join(sheet["texts"])
    assert "small, 2024-03-01, 07:00:00–07:02:30 UTC" in text
    assert "10 vehicles departed, 5 arrived by the end." in text
    # the first platoon stands from 55 to 95 s, the second from 63.75 to 100 and from 101.25 s on:
    # of the second minute 35 s, 36.25 s and 18.75 s, more than of the others
    assert "Most time is lost 07:01:00–07:02:00 UTC." in text
    # five vehicles each for 40 s, and for 36.25 and 48.75 s
    assert "10.4 veh·min  (100.0 %)  07:01:00–07:02:00  O'Connell" in text
