"""The project inside a results file, as XML: what QGIS is told, for systems without it."""

from __future__ import annotations

import io
import sqlite3
import zipfile
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import geopandas as gpd
import pytest
from packaged_road import description_of, run_of, two_way_road, write
from shapely.geometry import LineString

from uxsim_geo.analysis.link_states import link_times
from uxsim_geo.export import styles
from uxsim_geo.export.findings import Findings
from uxsim_geo.export.geopackage import write_geopackage
from uxsim_geo.export.qgis_parts import as_label
from uxsim_geo.export.qml import plain
from uxsim_geo.export.run_description import RunDescription
from uxsim_geo.export.run_layers import layers_of_run
from uxsim_geo.export.styles import styles_of
from uxsim_geo.network.network import Network


def project_of(path: Path) -> ElementTree.Element:
    with closing(sqlite3.connect(path)) as database:
        ((name, content),) = database.execute("SELECT name, content FROM qgis_projects")
    assert name == "small"
    with zipfile.ZipFile(io.BytesIO(bytes.fromhex(content))) as archive:
        (inside,) = archive.namelist()
        assert inside.endswith(".qgs")
        return ElementTree.fromstring(archive.read(inside))


def written(path: Path, network: Network, description: RunDescription, *wanted: str) -> Path:
    layers = layers_of_run(run_of(network), description, wanted)
    write_geopackage(path, layers, description)
    return path


def test_layers_are_looked_for_in_the_file_itself(tmp_path: Path) -> None:
    write(tmp_path / "results.gpkg", two_way_road("EPSG:25832"))
    sources = {
        str(layer.findtext("layername")): layer.findtext("datasource")
        for layer in project_of(tmp_path / "results.gpkg").iter("maplayer")
    }
    assert sources["Links in time"] == "./results.gpkg|layername=link_states"
    assert len(set(sources.values())) == len(sources) == 8


def test_the_slider_runs_over_the_run_bin_by_bin(tmp_path: Path) -> None:
    write(tmp_path / "results.gpkg", two_way_road("EPSG:25832"))
    settings = project_of(tmp_path / "results.gpkg").find("ProjectTimeSettings")
    assert settings is not None
    assert (settings.get("timeStep"), settings.get("timeStepUnit")) == ("1", "min")
    times = [settings.findtext(f"TemporalRange/{name}") for name in ("start", "end")]
    assert times == ["2024-03-01T07:00:00Z", "2024-03-01T07:02:29Z"]


@pytest.mark.parametrize("bin_s", [0.5, 1.0, 2.0])
def test_short_bins_are_steps_of_the_slider(tmp_path: Path, bin_s: float) -> None:
    network = two_way_road("EPSG:25832")
    run, description = run_of(network), description_of(network)
    states = link_times(run.result, network, bin_s=bin_s)
    path = tmp_path / "results.gpkg"
    layers = layers_of_run(replace(run, states=states), description)
    write_geopackage(path, layers, description)
    settings = project_of(path).find("ProjectTimeSettings")
    assert settings is not None
    assert (settings.get("timeStep"), settings.get("timeStepUnit")) == (f"{bin_s:g}", "s")


def test_without_states_the_whole_run_is_shown(tmp_path: Path) -> None:
    network = two_way_road("EPSG:25832")
    path = written(tmp_path / "results.gpkg", network, description_of(network), "od_lines")
    root = project_of(path)
    shown = {
        str(layer.get("id")).removeprefix("uxsim_geo_")
        for layer in root.findall("layer-tree-group/layer-tree-layer")
        if layer.get("checked") == "Qt::Checked"
    }
    assert shown == {"links"}
    themes = {preset.get("name") for preset in root.iter("visibility-preset")}
    assert themes == {
        "desire lines",
        *(f"whole run: {style}" for style in ("speed", "delay", "queue", "volume")),
    }
    assert root.find("ProjectTimeSettings") is None
    maps = [item for item in root.iter("LayoutItem") if item.get("followPresetName")]
    assert [item.get("followPresetName") for item in maps] == ["whole run: speed"]


def test_of_many_pairs_the_largest_are_drawn_and_the_legend_says_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ends = gpd.points_from_xy([0, 1, 2], [0, 0, 0])
    lines = [LineString([ends[0], ends[1]]), LineString([ends[0], ends[2]])]
    pairs = gpd.GeoDataFrame({"departed_veh": [3.0, 7.0]}, geometry=lines)
    network = two_way_road("EPSG:25832")
    description = description_of(network)
    layers = layers_of_run(run_of(network), description) | {"od_lines": pairs}
    assert [style.name for style in styles_of(layers, description)["od_lines"]] == ["delay"]
    monkeypatch.setattr(styles, "MOST_PAIRS", 1)
    largest, everything = styles_of(layers, description)["od_lines"]
    assert (largest.name, everything.name) == ("delay", "all pairs")
    renderers = [style.root.find("renderer-v2") for style in (largest, everything)]
    values = [renderer.get("attr") for renderer in renderers if renderer is not None]
    assert values[0] == f'if("departed_veh" < 7, null, {values[1]})'
    (label,) = [r.get("label") for r in largest.root.iter("range") if float(r.get("lower", 0)) < 0]
    assert label == "not drawn: pairs under 7 vehicles"


def test_a_network_without_geometry_has_no_project(tmp_path: Path) -> None:
    write(tmp_path / "results.gpkg", two_way_road(None, geometry=False))
    with closing(sqlite3.connect(tmp_path / "results.gpkg")) as database:
        names = {name for (name,) in database.execute("SELECT name FROM sqlite_master")}
    assert "qgis_projects" not in names


def test_a_gridlock_is_told_on_the_sheet(tmp_path: Path) -> None:
    network = two_way_road("EPSG:25832")
    for gridlocked in (True, False):
        description = replace(description_of(network), information={"gridlocked": gridlocked})
        root = project_of(written(tmp_path / "results.gpkg", network, description))
        texts = [str(item.get("labelText")) for item in root.iter("LayoutItem")]
        assert any("Gridlock" in text for text in texts) == gridlocked


def test_text_that_xml_cannot_hold_is_replaced(tmp_path: Path) -> None:
    network = two_way_road("EPSG:25832")
    network.links.loc[0, "name"] = "bell \x07 and \x00"
    root = project_of(written(tmp_path / "results.gpkg", network, description_of(network)))
    assert any("bell \ufffd and \ufffd" in str(i.get("labelText")) for i in root.iter("LayoutItem"))
    assert plain("tab\t line\n ü 🚧 \ud800") == "tab\t line\n ü 🚧 \ufffd"


@pytest.mark.parametrize(
    ("text", "label"),
    [("plain %] text", "plain %] text"), ("[% 6 * 7 %]", "[%'[' || '%'%] 6 * 7 %]")],
)
def test_nothing_in_a_label_is_evaluated(text: str, label: str) -> None:
    assert as_label(text) == label


def test_findings_are_those_of_the_run() -> None:
    network = two_way_road("EPSG:25832")
    network.links["name"] = ["High Street", None]
    findings = Findings.of(layers_of_run(run_of(network), description_of(network)))
    # worked out with the figures of links in the tests of the GeoPackage
    (street,) = findings.lost.streets(8)
    assert (street.name, street.lost) == ("High Street", pytest.approx(5 * (40 + 36.25 + 48.75)))
    # the first platoon stands from 55 to 95 s, the second from 63.75 to 100 and from 101.25 s on
    lost = [5 * 5, 5 * (35 + 36.25 + 18.75), 5 * 30]
    assert findings.lost.in_bins == pytest.approx(lost)
    assert findings.lost.worst_bin == 1
