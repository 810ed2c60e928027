"""The GeoPackage: what it holds, that it conforms, and that the same input gives the same bytes."""

from __future__ import annotations

import json
import os
import re
import shutil
import sqlite3
import subprocess
from contextlib import closing
from dataclasses import replace
from datetime import timedelta, timezone
from pathlib import Path
from typing import get_args
from xml.etree import ElementTree

import geopandas as gpd
import numpy as np
import pandas as pd
import pyogrio
import pytest
from newell_link import events_of, network_of, result_of, trips_of
from packaged_road import NAMES, START, description_of, run_of, two_way_road, write

from uxsim_geo.analysis.link_states import link_states, link_times
from uxsim_geo.analysis.run_passages import RunPassages
from uxsim_geo.export import geopackage, layers
from uxsim_geo.export.colours import NO_TRAFFIC, SPEED_CLASSES
from uxsim_geo.export.columns import LAYERS as COLUMNS_IN_WORDS
from uxsim_geo.export.columns import titled
from uxsim_geo.export.geopackage import write_geopackage
from uxsim_geo.export.geopackage_words import described as described_in_words
from uxsim_geo.export.layers import link_times_layer, links_layer
from uxsim_geo.export.run_description import RunDescription
from uxsim_geo.export.run_layers import Run, layers_of_run
from uxsim_geo.network.diagram import diagram_capacity
from uxsim_geo.network.note_geometry import placed
from uxsim_geo.network.notes import Severity
from uxsim_geo.settings import Settings

# pyogrio leaves out the fourth coordinate of trajectories, and says so
pytestmark = pytest.mark.filterwarnings("ignore:Measured")

TABLES = {"link_times", "run_info"}
MAPS = {"nodes", "links", "link_states", "od_lines", "trajectories", "import_notes"}
LAYERS = TABLES | MAPS


@pytest.fixture(params=["EPSG:4326", "EPSG:25832", None], ids=str)
def package(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    path = tmp_path / "results.gpkg"
    write(path, two_way_road(request.param))
    return path


def rows(path: Path, sql: str) -> list[tuple[object, ...]]:
    with closing(sqlite3.connect(path)) as database:
        return database.execute(sql).fetchall()


def test_every_layer_is_there_and_registered(package: Path) -> None:
    assert {name for name, _ in pyogrio.list_layers(package)} == LAYERS | {"layer_styles"}
    kinds = dict(rows(package, "SELECT table_name, data_type FROM gpkg_contents"))
    assert kinds == dict.fromkeys(MAPS, "features") | dict.fromkeys(
        TABLES | {"layer_styles"}, "attributes"
    )


#: what scripts and maps rely on, by layer; a change here breaks theirs
STATE_COLUMNS = (
    "speed_kmh speed_ratio experienced_travel_time_s delay_s delay_veh_s queue_veh queue_m "
    "spillback_share volume_to_capacity"
)
COLUMNS = {
    "nodes": "node_id zone_id control through_traffic",
    "links": "link_id from_node_id to_node_id name ref road_class length_m lanes free_speed_kmh "
    "jam_density_vpkm_per_lane capacity_vph effective_capacity_vph merge_priority lanes_source "
    f"free_speed_source source_id volume_veh {STATE_COLUMNS}",
    "link_times": "link_id begin end flow_vph density_vpkm entries_veh exits_veh "
    f"{STATE_COLUMNS} instantaneous_travel_time_s",
    "link_states": "link_id from_node_id to_node_id name ref road_class length_m lanes "
    "free_speed_kmh jam_density_vpkm_per_lane effective_capacity_vph "
    f"begin end flow_vph density_vpkm entries_veh exits_veh {STATE_COLUMNS} "
    "instantaneous_travel_time_s",
    "od_lines": "origin destination cell_m beeline_m demanded_veh departed_veh completed_veh "
    "unfinished_veh aborted_veh travel_time_s delay_s delay_veh_s",
    "trajectories": "vehicle origin destination class vehicles_veh status begin end distance_m "
    "travel_time_s delay_s speed_kmh",
    "import_notes": "element element_id topic severity note value",
    "run_info": "item value",
}


@pytest.mark.parametrize("layer", sorted(LAYERS))
def test_every_layer_has_the_columns_that_others_rely_on(package: Path, layer: str) -> None:
    assert list(pyogrio.read_info(package, layer=layer)["fields"]) == COLUMNS[layer].split()
    assert [column.name for column in COLUMNS_IN_WORDS[layer].columns] == COLUMNS[layer].split()


def test_columns_are_empty_only_where_the_page_says() -> None:
    network = two_way_road("EPSG:25832")
    states = link_times(
        result_of(events_of(network, []), trips_of([]), Settings(100.0)), network, bin_s=100.0
    )
    nobody = ["speed_kmh", "speed_ratio", "experienced_travel_time_s", "delay_s"]
    for layer in (links_layer(network, states, 1.0), link_times_layer(network, states, START)):
        empty = {name for name in layer.columns if layer[name].isna().all()}
        assert empty - {"source_id", "zone_id", "ref"} == set(nobody)


def test_figures_are_in_the_units_of_their_names(package: Path) -> None:
    links = gpd.read_file(package, layer="links")
    first = links.iloc[0]
    assert links["link_id"].tolist() == ["a'b", 'ü"2']
    assert links["name"].tolist() == NAMES
    assert first["free_speed_kmh"] == pytest.approx(72)
    assert first["capacity_vph"] == pytest.approx(1800)
    assert np.isnan(links["capacity_vph"][1])
    assert first["jam_density_vpkm_per_lane"] == pytest.approx(200)
    assert first["volume_veh"] == 10
    assert first["delay_s"] == pytest.approx(90 - 50)
    # to the end: the first loses 40 s; the second, due at 975 m at 63.75 s, loses the rest there
    # but for the 25 m from 100 s on, when it feels the exit: (100 - 63.75) + (150 - 101.25)
    assert first["delay_veh_s"] == pytest.approx(5 * 40 + 5 * (36.25 + 48.75))
    states = gpd.read_file(package, layer="link_states").sort_values(["link_id", "begin"])
    states = states.reset_index(drop=True)
    assert states["flow_vph"][0] == pytest.approx(5 * (1000 + 900) / 1000 * 60)
    assert states["density_vpkm"][0] == pytest.approx(5 * (55 + 45) / 60)
    assert states["speed_kmh"][0] == pytest.approx(3.6 * 1900 / 100)
    assert states["queue_veh"].tolist() == [5, 5, 5, 0, 0, 0]


def test_the_effective_capacity_is_the_one_the_engine_works_with(tmp_path: Path) -> None:
    network = network_of([{}, {"capacity": 0.5}, {"capacity": 9.0, "lanes": 2}])
    result = result_of(events_of(network, []), trips_of([]), Settings(100.0))
    states = link_times(result, network, bin_s=100.0)
    run = Run(network, result, states, RunPassages(result, network))
    settings = Settings(100.0, reaction_time=1.5)
    tabled = links_layer(network, states, settings.reaction_time)["effective_capacity_vph"]
    # one lane: 20 m/s x 0.2 veh/m / (1 + 20 x 1.5 x 0.2) = 4/7 veh/s
    assert tabled.tolist() == pytest.approx([3600 * 4 / 7, 1800, 3600 * 8 / 7])
    diagram = diagram_capacity(network.links, settings.reaction_time)
    assert (tabled / 3600).tolist() == pytest.approx(np.fmin(network.links["capacity"], diagram))
    path = tmp_path / "results.gpkg"
    for information in ({}, {"reaction_time_s": 1.5}):
        description = RunDescription(START, network.notes, information)
        write_geopackage(path, layers_of_run(run, description), description)
        written = pyogrio.read_dataframe(path, layer="links")["effective_capacity_vph"]
        assert written.notna().all() == bool(information)


def style_of(path: Path, layer: str) -> ElementTree.Element:
    found = rows(path, f"SELECT styleQML FROM layer_styles WHERE f_table_name = '{layer}'")
    return ElementTree.fromstring(str(found[0][0]))


def test_a_standing_queue_is_wide_and_an_empty_road_narrow(package: Path) -> None:
    root = style_of(package, "link_states")
    expressions = {str(option.get("value")) for option in root.iter("Option")}
    (width,) = (text for text in expressions if text.startswith("scale_linear"))
    share = re.fullmatch(r"scale_linear\((.*), 0, 1, 0.25, 2.6\)", width)
    assert share is not None
    two_lanes = 'SELECT 1000.0 AS "effective_capacity_vph", 2 AS "lanes", '
    two_lanes += '200.0 AS "jam_density_vpkm_per_lane", '

    def width_of(flow: float | str, density: float) -> object:
        state = f'{two_lanes} {flow} AS "flow_vph", {density} AS "density_vpkm"'
        return rows(package, f"SELECT {share[1]} FROM ({state})")[0][0]

    assert width_of(0.0, 400.0) == 1
    assert width_of(1000.0, 40.0) == 1
    assert width_of(500.0, 20.0) == 0.5
    assert width_of(0.0, 0.0) == 0
    assert width_of("NULL", 100.0) == 0.25


@pytest.mark.parametrize("layer", ["links", "link_states"])
def test_where_nobody_was_is_grey_and_says_so(package: Path, layer: str) -> None:
    root = style_of(package, layer)
    renderer = root.find("renderer-v2")
    assert renderer is not None
    assert renderer.get("attr") == 'coalesce("speed_ratio", -1)'
    holding = {
        speed: [r for r in root.iter("range") if is_in(speed, r)] for speed in (-1.0, 0.1, 1.0)
    }
    assert [found.get("label") for found in holding[-1.0]] == [NO_TRAFFIC]
    assert [found.get("label") for found in holding[0.1]] == [SPEED_CLASSES[0].label]
    assert [found.get("label") for found in holding[1.0]] == [SPEED_CLASSES[-1].label]


def is_in(speed: float, range_: ElementTree.Element) -> bool:
    return float(str(range_.get("lower"))) <= speed <= float(str(range_.get("upper")))


def test_states_join_their_own_link_and_clock(package: Path) -> None:
    states = gpd.read_file(package, layer="link_states").sort_values(["link_id", "begin"])
    links = gpd.read_file(package, layer="links").set_index("link_id")
    assert len(states) == 6
    for _, state in states.iterrows():
        assert state.geometry.equals(links.geometry[state["link_id"]])
    assert states["begin"].dt.strftime("%H:%M:%S").tolist()[:3] == [
        "07:00:00",
        "07:01:00",
        "07:02:00",
    ]
    assert (states["end"] - states["begin"]).dt.total_seconds().tolist()[:3] == [59, 59, 29]
    assert str(states["begin"].dt.tz) == "UTC"


def test_coordinates_keep_their_system_or_say_that_there_is_none(tmp_path: Path) -> None:
    srs = "SELECT table_name, srs_id FROM gpkg_geometry_columns"
    for crs, number in (("EPSG:25832", 25832), (None, -1)):
        path = tmp_path / f"{number}.gpkg"
        write(path, two_way_road(crs))
        assert dict(rows(path, srs)) == dict.fromkeys(MAPS, number)


def test_a_network_without_geometry_gives_tables(tmp_path: Path) -> None:
    path = tmp_path / "results.gpkg"
    write(path, two_way_road(None, geometry=False))
    kinds = dict(rows(path, "SELECT table_name, data_type FROM gpkg_contents"))
    assert set(kinds) == LAYERS - {"trajectories"} | {"layer_styles"}
    assert set(kinds.values()) == {"attributes"}
    assert len(pyogrio.read_dataframe(path, layer="link_states")) == 6


def test_layers_keep_their_type_where_nobody_drove(tmp_path: Path) -> None:
    network, path = two_way_road("EPSG:25832"), tmp_path / "results.gpkg"
    result = result_of(events_of(network, []), trips_of([]), Settings(100.0))
    states = link_times(result, network, bin_s=100.0)
    empty = Run(network, result, states, RunPassages(result, network))
    for run in (empty, run_of(network)):
        description = description_of(network)
        write_geopackage(path, layers_of_run(run, description), description)
        columns = "table_name, geometry_type_name, z, m"
        assert set(rows(path, f"SELECT {columns} FROM gpkg_geometry_columns")) == {
            ("nodes", "POINT", 0, 0),
            ("links", "LINESTRING", 0, 0),
            ("link_states", "LINESTRING", 0, 0),
            ("od_lines", "LINESTRING", 0, 0),
            ("trajectories", "LINESTRING", 1, 1),
            ("import_notes", "POINT", 0, 0),
        }


def test_states_that_are_written_in_parts_are_those_written_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    network = two_way_road("EPSG:25832")
    run, whole, parts = run_of(network), tmp_path / "whole.gpkg", tmp_path / "parts.gpkg"
    kept = link_states(run.result, network, bin_s=60.0)
    table = link_times(run.result, network, bin_s=60.0)
    description = description_of(network)
    write_geopackage(whole, layers_of_run(replace(run, states=table), description), description)
    monkeypatch.setattr(layers, "AT_ONCE", 1)
    write_geopackage(parts, layers_of_run(replace(run, states=kept), description), description)
    query = "SELECT * FROM link_time_values"
    assert len(rows(whole, query)) == len(table) > 2 * len(network.links)
    assert rows(parts, query) == rows(whole, query)
    assert rows(parts, "SELECT * FROM link_times") == rows(whole, "SELECT * FROM link_times")


def test_every_layer_has_a_default_style_that_fits_its_columns(package: Path) -> None:
    styles = rows(
        package,
        "SELECT f_table_name, f_geometry_column, styleQML FROM layer_styles WHERE useAsDefault = 1",
    )
    assert {name for name, _, _ in styles} == LAYERS
    for name, geometry, qml in styles:
        columns = {row[1] for row in rows(package, f"PRAGMA table_info({name})")}
        root = ElementTree.fromstring(str(qml))
        assert {alias.get("field") for alias in root.iter("alias")} - columns <= {"geometry"}
        assert geometry == ("geom" if "geom" in columns else "")
        for option in root.iter("Option"):
            if option.get("name") == "expression":
                assert set(re.findall('"(.*?)"', str(option.get("value")))) <= columns
        temporal = root.find("temporal")
        if name in ("link_states", "trajectories"):
            assert temporal is not None
            assert {temporal.get("startField"), temporal.get("endField")} <= columns
        else:
            assert temporal is None


def test_the_same_input_gives_the_same_bytes(tmp_path: Path) -> None:
    elsewhere = START.astimezone(timezone(timedelta(hours=9)))
    paths = [tmp_path / name / "results.gpkg" for name in ("one", "two")]
    for path, start in zip(paths, (START, elsewhere), strict=True):
        path.parent.mkdir()
        write(path, two_way_road("EPSG:4326"), start)
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_no_time_stamp_tells_when_the_file_was_written(package: Path) -> None:
    stamps = rows(
        package,
        "SELECT last_change FROM gpkg_contents UNION SELECT update_time FROM layer_styles"
        " UNION SELECT timestamp FROM gpkg_metadata_reference",
    )
    assert stamps == [("2024-03-01T07:00:00.000Z",)]
    assert pyogrio.get_gdal_config_option("OGR_CURRENT_DATE") is None


def test_notes_and_run_information_are_text_as_given(package: Path) -> None:
    notes = pyogrio.read_dataframe(package, layer="import_notes")
    texts = notes.drop(columns="geometry").iloc[0].tolist()
    assert texts == [
        "link",
        "a'b",
        "length",
        "warning",
        'it\'s "short" (3.5)',
        "3.5",
    ]
    information = pyogrio.read_dataframe(package, layer="run_info")
    assert dict(information.itertuples(index=False)) == {
        "seed": "7",
        "title": 'Nüßler\'s "run"',
        "attribution": "© <Jürgen> & 'co'",
    }


def test_every_column_is_described_in_the_file(package: Path) -> None:
    described = rows(package, "SELECT table_name, column_name, title FROM gpkg_data_columns")
    for name in LAYERS:
        found = [(column, title) for table, column, title in described if table == name]
        told = [(column.name, titled(column)) for column in COLUMNS_IN_WORDS[name].columns]
        assert found == told
    units = {column.unit for layer in COLUMNS_IN_WORDS.values() for column in layer.columns}
    assert {"text", "UTC", "veh", "veh/h", "km/h", "s", "m", "–"} <= units
    flow = COLUMNS_IN_WORDS["link_times"].column("flow_vph")
    assert (titled(flow), described_in_words(flow)) == (
        "flow (veh/h)",
        "distance driven / (length × bin)",
    )


def test_the_file_says_how_it_came_about(package: Path) -> None:
    (items,), (provenance,) = rows(package, "SELECT metadata FROM gpkg_metadata ORDER BY id")
    told = {item.get("key"): item.text for item in ElementTree.fromstring(str(items)).iter("MDI")}
    assert told == {
        "run": "small",
        "attribution": "© <Jürgen> & 'co'",
        "seed": "7",
        "title": 'Nüßler\'s "run"',
    }
    assert json.loads(str(provenance)) == {"sources": {"net": {"file": "ü.tntp"}}}
    assert rows(package, "SELECT DISTINCT reference_scope FROM gpkg_metadata_reference") == [
        ("geopackage",)
    ]


def test_layers_that_nobody_wants_are_left_out(tmp_path: Path) -> None:
    path, network = tmp_path / "results.gpkg", two_way_road("EPSG:4326")
    description = description_of(network)
    for wanted in ([], ["od_lines"], ["link_times"]):
        write_geopackage(path, layers_of_run(run_of(network), description, wanted), description)
        there = {name for (name,) in rows(path, "SELECT table_name FROM gpkg_contents")}
        always = {"nodes", "links", "run_info", "layer_styles"}
        views = {"link_states"} if "link_times" in wanted else set()
        assert there == {*always, *wanted, *views}
        styled = {name for (name,) in rows(path, "SELECT f_table_name FROM layer_styles")}
        assert styled == there - {"layer_styles"}


def test_a_bin_a_link_or_a_row_is_found_without_a_search(package: Path) -> None:
    for where in (
        "begin <= '2024-03-01T07:01:59' AND \"end\" >= '2024-03-01T07:01:00'",
        "link_id = 'a''b'",
        "OGC_FID = 2",
    ):
        plan = rows(package, f"EXPLAIN QUERY PLAN SELECT * FROM link_states WHERE {where}")
        steps = [str(step[-1]) for step in plan]
        assert [step for step in steps if step.startswith("SCAN")] == ["SCAN b"], where
        assert any(step.startswith("SEARCH v USING INTEGER PRIMARY KEY") for step in steps)


def test_a_clock_without_a_time_zone_is_refused() -> None:
    with pytest.raises(ValueError, match="time zone"):
        RunDescription(START.replace(tzinfo=None), pd.DataFrame(), {})


def test_a_failed_write_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fill_the_disk(*_: object) -> None:
        raise OSError(28, "No space left on device")

    path, network = tmp_path / "results.gpkg", two_way_road(None)
    write(path, network)
    before = path.read_bytes()
    monkeypatch.setattr(geopackage, "add_styles", fill_the_disk)
    with pytest.raises(OSError, match="No space left"):
        write(path, network)
    assert path.read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == ["results.gpkg"]


@pytest.mark.skipif(shutil.which("ogrinfo") is None, reason="needs GDAL's command line tools")
def test_gdal_lists_the_layers_and_its_validator_accepts_the_file(package: Path) -> None:
    listed = subprocess.run(["ogrinfo", "-q", package], capture_output=True, text=True, check=True)
    assert all(f": {name} (" in listed.stdout for name in LAYERS)
    assert "Warning" not in listed.stderr
    python = shutil.which("python3", path=os.defpath)  # the system's, which has GDAL's module
    module = "osgeo_utils.samples.validate_gpkg"
    if python is None or subprocess.run([python, "-c", f"import {module}"], check=False).returncode:
        pytest.skip("needs GDAL's validate_gpkg")
    verdict = subprocess.run(
        [python, "-m", module, "-k", package], capture_output=True, text=True, check=False
    )
    assert verdict.returncode == 0, verdict.stdout + verdict.stderr


@pytest.mark.parametrize("crs", ["EPSG:4326", "EPSG:25832", None])
@pytest.mark.parametrize("element_id", ["a'b", "gone"])
def test_notes_with_places_are_points_coloured_by_severity(
    tmp_path: Path, crs: str | None, element_id: str
) -> None:
    network = two_way_road(crs)
    bare = pd.DataFrame(network.notes.drop(columns="geometry")).assign(element_id=element_id)
    path = tmp_path / "results.gpkg"
    write(path, replace(network, notes=placed(bare, network)))
    assert pyogrio.read_info(path, layer="import_notes")["geometry_type"] == "Point"
    (shape,) = pyogrio.read_dataframe(path, layer="import_notes").geometry
    if element_id == "gone":
        assert shape is None
    else:
        assert (shape.x, shape.y) == pytest.approx((8.005, 49.0))
    (style,) = rows(path, "SELECT styleQML FROM layer_styles WHERE f_table_name = 'import_notes'")
    root = ElementTree.fromstring(str(style[0]))
    told = {one.get("value"): one.get("symbol") for one in root.iter("category")}
    assert set(told) == set(get_args(Severity))
    assert set(told.values()) == {one.get("name") for one in root.iter("symbol")}
