"""``comparison.gpkg``: differences as layers, in which no missing value is a nought."""

from __future__ import annotations

import json
import os
import shutil
import sqlite3
import subprocess
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyogrio
import pytest
from compared import example_comparison
from shown_study import EVIL, START, study, without_map

from uxsim_geo.export.columns import NODES
from uxsim_geo.export.comparison.changes import NOT_COMPARED, ONLY_BASE, ONLY_SCENARIO
from uxsim_geo.export.comparison.columns import OF_ALL, OF_SCENARIO
from uxsim_geo.export.comparison.geopackage import write_comparison_geopackage
from uxsim_geo.export.comparison.study import short_names

LOOK = Path(__file__).with_name("qgis_look.py")
FIRST, NOTHING = short_names([EVIL[0], "nothing"])


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("study") / "comparison.gpkg"
    write_comparison_geopackage(path, study())
    return path


def layer(path: Path, name: str) -> pd.DataFrame:
    return pyogrio.read_dataframe(path, layer=name)


def rows(path: Path, sql: str, *values: object) -> list[Any]:
    with closing(sqlite3.connect(path)) as database:
        return database.execute(sql, values).fetchall()


def test_there_are_layers_of_each_scenario_and_tables_of_all(package: Path) -> None:
    names = {name for name, _ in pyogrio.list_layers(package)}
    of_scenarios = {f"{part}_{short}" for part in OF_SCENARIO for short in (FIRST, NOTHING)}
    assert names == of_scenarios | set(OF_ALL) | {"nodes", "layer_styles"}


@pytest.mark.parametrize("part", sorted(OF_SCENARIO))
def test_columns_are_those_in_the_words_and_described(package: Path, part: str) -> None:
    columns = [column.name for column in OF_SCENARIO[part].columns]
    found = [name for name in layer(package, f"{part}_{FIRST}").columns if name != "geometry"]
    assert found == columns
    told = rows(
        package,
        "SELECT column_name FROM gpkg_data_columns WHERE table_name = ? ORDER BY rowid",
        f"{part}_{FIRST}",
    )
    assert [name for (name,) in told] == columns


@pytest.mark.parametrize("name", sorted(OF_ALL))
def test_columns_of_tables_are_those_in_the_words(package: Path, name: str) -> None:
    assert list(layer(package, name).columns) == [column.name for column in OF_ALL[name].columns]


def test_links_of_one_network_alone_have_no_difference_at_all(package: Path) -> None:
    table = layer(package, f"links_{FIRST}").set_index("link_id")
    assert (
        table["exists"].to_dict()
        == example_comparison(4)[2].links.set_index("link_id")["exists"].to_dict()
    )
    compared = [name for name in table if name.rpartition("_")[2] in ("difference", "low", "high")]
    compared += [name for name in table if name.endswith(("_relative", "_p", "_significant"))]
    for link, other in (("bd", "scenario"), ("bc", "base")):
        assert table.loc[link, compared].isna().all()
        assert table.loc[link, [name for name in table if name.endswith(f"_{other}")]].isna().all()
    assert table.loc["bd", "volume_veh_base"] == 360.0
    assert table.geometry.notna().all()


def test_a_speed_nobody_drove_at_is_no_change_of_speed(package: Path) -> None:
    table = layer(package, f"links_{FIRST}").set_index("link_id")
    assert table.loc["ac", "volume_veh_difference"] == 360.0
    assert np.isnan(table.loc["ac", "speed_kmh_difference"])
    assert np.isnan(table.loc["ac", "speed_kmh_base"])
    assert table.loc["ac", "speed_kmh_scenario"] > 0


def test_each_scenario_has_states_of_its_own_links(package: Path) -> None:
    for short, links in ((FIRST, 7), (NOTHING, 6)):
        (count,) = rows(package, f'SELECT count(*) FROM "link_states_{short}"')[0]
        assert count == 6 * links
        stored = layer(package, f"link_times_{short}")
        assert stored.groupby("begin")["link_id"].nunique().tolist() == 6 * [links]


def test_states_show_one_bin_at_a_time_for_every_link(package: Path) -> None:
    states = layer(package, f"link_states_{FIRST}")
    found = example_comparison(4)[2].link_times
    assert len(states) == len(found)
    assert states["begin"].min() == pd.Timestamp(START)
    steps = states.groupby("link_id")[["begin", "end"]].agg(["min", "max"])
    assert (steps[("end", "max")] - steps[("begin", "min")]).nunique() == 1
    times = layer(package, f"link_times_{FIRST}")
    ordered = times.sort_values(["link_id", "begin"], ignore_index=True)
    expected = found.sort_values(["link_id", "begin_s"], ignore_index=True)
    np.testing.assert_array_equal(
        ordered["delay_veh_h_difference"], expected["delay_veh_h_difference"]
    )


def test_where_nothing_differs_differences_are_nought_and_not_sure(package: Path) -> None:
    table = layer(package, f"links_{NOTHING}")
    assert (table["volume_veh_difference"] == 0).all()
    assert not table["volume_veh_significant"].astype(bool).any()
    assert not table["changed"].any()


def test_names_come_out_as_they_are(package: Path) -> None:
    assert set(layer(package, "totals")["scenario"]) == {EVIL[0], "nothing"}
    assert set(layer(package, f"links_{FIRST}")["name"]) <= set(EVIL)
    assert f"close: {EVIL[2]}" in set(layer(package, "edits")["edit"])
    told = layer(package, "study_info").set_index("item")["value"]
    assert told[f"failed: {EVIL[3]}, seed 0"] == f"no way: {EVIL[1]}"
    assert told[f"seeds of {EVIL[0]}"] == "0, 1, 2, 3"


def test_links_have_rules_for_what_is_no_difference(package: Path) -> None:
    (style,) = rows(
        package,
        "SELECT styleQML FROM layer_styles WHERE f_table_name = ? AND useAsDefault",
        f"links_{FIRST}",
    )[0]
    for label in (ONLY_BASE, ONLY_SCENARIO, NOT_COMPARED):
        assert f'label="{label}"' in style
    assert "exists&quot; = 'base'" in style


def test_the_same_study_gives_the_same_bytes(package: Path, tmp_path: Path) -> None:
    again = tmp_path / package.name
    write_comparison_geopackage(again, study())
    assert again.read_bytes() == package.read_bytes()


@pytest.mark.parametrize("kind", ["no map", "one seed", "no scenario"])
def test_there_is_a_file_of_whatever_there_is(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "comparison.gpkg"
    shown = {"no map": without_map(study(2)), "one seed": study(1), "no scenario": study(2)}[kind]
    if kind == "no scenario":
        shown = replace(shown, scenarios=shown.scenarios[2:])
    write_comparison_geopackage(path, shown)
    names = {name for name, _ in pyogrio.list_layers(path)}
    assert set(OF_ALL) <= names
    projects = rows(path, "SELECT name FROM sqlite_master WHERE name = 'qgis_projects'")
    assert bool(projects) == (kind == "one seed")
    if kind == "no scenario":
        assert layer(path, "totals").empty
        assert list(layer(path, "nodes").drop(columns="geometry").columns) == [
            column.name for column in NODES.columns
        ]
        return
    table = layer(path, f"links_{FIRST}")
    assert table["volume_veh_difference"].notna().sum() == 5
    if kind == "one seed":
        assert table["volume_veh_low"].isna().all()
        assert table["volume_veh_significant"].isna().all()


def test_the_file_is_valid(package: Path) -> None:
    python = shutil.which("python3", path=os.defpath)
    module = "osgeo_utils.samples.validate_gpkg"
    if python is None or subprocess.run([python, "-c", f"import {module}"], check=False).returncode:
        pytest.skip("needs GDAL's validate_gpkg")
    verdict = subprocess.run(
        [python, "-m", module, "-k", package], capture_output=True, text=True, check=False
    )
    assert verdict.returncode == 0, verdict.stdout + verdict.stderr


@pytest.fixture(scope="module")
def seen(package: Path) -> dict[str, Any]:
    """What QGIS tells of the file."""
    python = shutil.which("python3", path=os.defpath)
    if python is None or subprocess.run([python, "-c", "import qgis"], check=False).returncode:
        pytest.skip("needs QGIS for the system's python3: apt-get install qgis python3-qgis")
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        [python, str(LOOK), str(package), str(package.parent)],
        capture_output=True,
        text=True,
        check=False,
        env=environment,
        cwd="/",
    )
    assert done.returncode == 0, done.stderr
    told: dict[str, Any] = json.loads(done.stdout)
    return told


def test_qgis_opens_the_project_with_a_group_of_each_scenario(seen: dict[str, Any]) -> None:
    assert seen["opened"]
    assert seen["title"] == study().about.name
    assert seen["visible"] == [f"uxsim_geo_links_{FIRST}"]
    assert all(found["valid"] for found in seen["layers"].values())
    for short in (FIRST, NOTHING):
        found = seen["layers"][f"uxsim_geo_links_{short}"]
        assert found["renderer"] == "RuleRenderer"
        assert found["faults"] == []
        assert seen["layers"][f"uxsim_geo_link_states_{short}"]["temporal"]
        assert seen["layers"][f"uxsim_geo_link_states_{short}"]["faults"] == []
        assert seen["layers"][f"uxsim_geo_od_{short}"]["faults"] == []


def test_qgis_draws_every_theme_and_evaluates_no_name(seen: dict[str, Any]) -> None:
    assert len(seen["themes"]) == 2 * (10 + 5 + 1)
    for theme, drawn in seen["themes"].items():
        assert drawn["errors"] == []
        assert drawn["colours"] > 1 or theme.startswith("nothing: pairs"), theme
    tips = seen["layers"][f"uxsim_geo_links_{FIRST}"]["tips"]
    assert "[% 6 * 7 %]" in tips[0]
    assert "<b>🚧</b>" not in tips[0]


def test_qgis_shows_all_links_in_every_step_of_time(seen: dict[str, Any]) -> None:
    links = sorted(example_comparison(4)[2].links["link_id"])
    for frame in seen["frames"]:
        assert [link for link, _ in frame] == links
        assert len({begin for _, begin in frame}) == 1
