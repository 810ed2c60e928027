"""Every format of network and every source of demand, by a configuration, to a finished run."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import geopandas as gpd
import pandas as pd
import pytest
import yaml
from mapped_network import two_way_road
from shapely.geometry import LineString, Point, box
from small_networks import demand

from pipeline.cli import main
from pipeline.config_file import load_config
from uxsim_geo.control.signals import Phase, Signal
from uxsim_geo.demand.cells import cell_zones
from uxsim_geo.demand.gmns import write_gmns
from uxsim_geo.demand.uxsim_csv import write_uxsim_csv
from uxsim_geo.errors import InputError
from uxsim_geo.network.files import read_network
from uxsim_geo.network.network import Network

OSM = """<?xml version="1.0"?><osm version="0.6">
<node id="1" lat="50.000" lon="8.000"/><node id="2" lat="50.000" lon="8.010"/>
<node id="3" lat="50.000" lon="8.020"/><node id="4" lat="50.005" lon="8.010"/>
<way id="10"><nd ref="1"/><nd ref="2"/><nd ref="3"/>
<tag k="highway" v="primary"/><tag k="maxspeed" v="50"/><tag k="lanes" v="2"/></way>
<way id="11"><nd ref="2"/><nd ref="4"/><tag k="highway" v="residential"/></way></osm>
"""

OD = "origin,destination,vehicles\n1,3,60\n4,1,40\n"


def ingest(folder: Path, section: dict[str, Any], *, command: str = "run") -> int:
    config = {
        "name": "run",
        "ingest": section,
        "simulate": {"duration_s": 3600},
        "report": {"outputs": [], "plots": []},
    }
    (folder / "run.yaml").write_text(yaml.safe_dump(config), encoding="utf-8")
    return main([command, str(folder / "run.yaml"), "--out", str(folder), "--quiet"])


def test_a_network_is_made_ready_unless_that_is_left_out(
    tmp_path: Path, osm: dict[str, Any]
) -> None:
    assert ingest(tmp_path, with_od(osm)) == 0
    ready = read_network(tmp_path / "run/network")
    assert ready.nodes.crs.is_projected
    assert "short links" in set(ready.notes["topic"])
    assert ingest(tmp_path, with_od(osm) | {"ready": False}) == 0
    raw = read_network(tmp_path / "run/network")
    assert raw.nodes.crs.to_epsg() == 4326
    assert "short links" not in set(raw.notes["topic"])
    assert ingest(tmp_path, with_od(osm) | {"ready": {"join": False, "u_turns": "nowhere"}}) == 0


def figures(folder: Path) -> dict[str, Any]:
    text = (folder / "run/summary.json").read_text(encoding="utf-8")
    found: dict[str, Any] = json.loads(text)
    return found


@pytest.fixture
def osm(tmp_path: Path) -> dict[str, Any]:
    (tmp_path / "town.osm").write_text(OSM, encoding="utf-8")
    (tmp_path / "od.csv").write_text(OD, encoding="utf-8")
    return {"format": "osm", "osm": {"file": "town.osm", "country": "DE"}}


def with_od(section: dict[str, Any], **more: Any) -> dict[str, Any]:
    entry = {"od": {"file": "od.csv"}, "demand_period_s": 600.0} | more
    return section | {"demand": [entry]}


def test_a_town_of_openstreetmap(tmp_path: Path, osm: dict[str, Any]) -> None:
    assert ingest(tmp_path, with_od(osm)) == 0
    assert figures(tmp_path)["vehicles_completed"] == 100
    network = read_network(tmp_path / "run/network")
    speeds = network.links.set_index("link_id")["free_speed_source"]
    assert set(speeds) == {"given", "assumed"}
    assert len(network.links) == 6
    manifest = json.loads((tmp_path / "run/manifest.json").read_text(encoding="utf-8"))
    inputs = manifest["stages"]["ingest"]["inputs"]
    assert set(inputs) == {"osm.file", "demand.0.od.file"}


def road() -> Network:
    return two_way_road("EPSG:25832")


def trips() -> Any:
    return demand(("a", "b", 0.0, 600.0, 30.0), ("b", "a", 0.0, 600.0, 20.0))


def test_a_folder_of_gmns_with_its_demand(tmp_path: Path) -> None:
    write_gmns(road(), trips(), tmp_path / "gmns")
    assert ingest(tmp_path, {"format": "gmns", "gmns": {"folder": "gmns"}}) == 0
    assert figures(tmp_path)["vehicles_completed"] == 50
    read = read_network(tmp_path / "run/network")
    assert read.links["length"].tolist() == road().links["length"].tolist()
    assert ingest(tmp_path, {"format": "gmns", "gmns": {"folder": "gmns", "demand": False}}) == 2


def test_csv_files_of_uxsim(tmp_path: Path) -> None:
    write_uxsim_csv(road(), trips(), tmp_path / "csv")
    files = {name: f"csv/{name}.csv" for name in ("nodes", "links", "demand")}
    assert ingest(tmp_path, {"format": "csv", "csv": files}) == 0
    assert figures(tmp_path)["vehicles_completed"] == 50


def test_any_file_of_lines(tmp_path: Path) -> None:
    lines = [LineString([(0, 0), (1000, 0)]), LineString([(1000, 0), (1000, 800)])]
    table = gpd.GeoDataFrame(
        {"vmax": [50, 30], "way": ["both", "forward"]}, geometry=lines, crs="EPSG:25832"
    )
    table.to_file(tmp_path / "roads.gpkg")
    (tmp_path / "trips.csv").write_text(
        "origin_x,origin_y,destination_x,destination_y,depart\n0,10,990,790,06:05\n",
        encoding="utf-8",
    )
    section = {
        "format": "tables",
        "tables": {
            "links": "roads.gpkg",
            "columns": {"free_speed": {"column": "vmax", "unit": "km/h"}, "lanes": 1},
            "direction": {"column": "way", "forward": ["forward"], "both": ["both"]},
        },
        "demand": [
            {
                "trip_list": {"file": "trips.csv", "begin": "06:00", "points_crs": "EPSG:25832"},
                "factor": 3.0,
            }
        ],
    }
    assert ingest(tmp_path, section) == 0
    assert figures(tmp_path)["vehicles_completed"] == 3
    links = read_network(tmp_path / "run/network").links
    assert links["length"].tolist() == pytest.approx([1000, 1000, 800], rel=0.01)
    departures = pd.read_parquet(tmp_path / "run/trips.parquet")["depart_s"]
    assert departures.tolist() == pytest.approx([300.0])


def test_demand_by_gravity_between_cells(tmp_path: Path, osm: dict[str, Any]) -> None:
    gravity = {
        "zones": {"cell_m": 400.0},
        "productions": {"road_km": 1.0},
        "attractions": {"road_km": 1.0},
        "total_vehicles": 80.0,
    }
    section = osm | {"demand": [{"gravity": gravity, "demand_period_s": 900.0}]}
    assert ingest(tmp_path, section) == 0
    assert figures(tmp_path)["vehicles_completed"] == pytest.approx(80, abs=1)
    few = pd.read_parquet(tmp_path / "run/demand.parquet")
    section["demand"][0] |= {"whole_vehicles": False}
    assert ingest(tmp_path, section) == 0
    all_pairs = pd.read_parquet(tmp_path / "run/demand.parquet")
    assert len(few) < len(all_pairs)
    assert few["vehicles"].sum() == pytest.approx(all_pairs["vehicles"].sum(), abs=1)


def test_sources_add_up_and_have_classes(tmp_path: Path, osm: dict[str, Any]) -> None:
    section = osm | {
        "demand": [
            {"od": {"file": "od.csv"}, "demand_period_s": 600.0},
            {"od": {"file": "od.csv"}, "demand_period_s": 600.0, "factor": 0.5, "class": "lorry"},
        ]
    }
    config = {"simulate": {"duration_s": 3600, "classes": [{"name": "lorry"}]}, "name": "run"}
    config |= {"ingest": section, "report": {"outputs": [], "plots": []}}
    (tmp_path / "run.yaml").write_text(yaml.safe_dump(config), encoding="utf-8")
    assert main(["run", str(tmp_path / "run.yaml"), "--out", str(tmp_path), "--quiet"]) == 0
    found = pd.read_parquet(tmp_path / "run/trips.parquet")
    sums = found["vehicles"].groupby(found["class"].astype(str)).sum()
    assert sums.to_dict() == {"default": 100, "lorry": 50}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": "gmns"}, "gmns is missing: format gmns"),
        ({"gmns": {"folder": "."}}, "gmns is for format: gmns, and this is osm"),
        ({"net": "town.osm"}, "net is for format: tntp, and this is osm"),
        ({"demand": []}, "has no trips: give demand"),
        ({"demand": [{"demand_period_s": 5.0}]}, "must have one of od, trip_list and gravity"),
        ({"osm": {"file": "nowhere.osm"}}, "no such file"),
        ({"osm": {"file": "town.osm", "countri": "DE"}}, "did you mean ingest.osm.country"),
        ({"osm": {"file": "town.osm", "road_classes": ["path"]}}, "road_classes"),
        ({"osm": {"file": "town.osm", "country": "Fr"}}, "ingest.osm.country: is not known"),
        ({"demand": [{"od": {"file": "od.csv", "colums": {}}}]}, "ingest.demand.od.columns"),
    ],
)
def test_what_does_not_fit_is_told_with_its_line(
    tmp_path: Path,
    osm: dict[str, Any],
    change: dict[str, Any],
    message: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert ingest(tmp_path, with_od(osm) | change) == 2
    shown = capsys.readouterr().err
    assert message in shown
    assert "Traceback" not in shown
    assert "run.yaml:" in shown


def test_faults_of_all_sources_are_told_at_once(
    tmp_path: Path, osm: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "bad.csv").write_text("origin,destination,vehicles\n1,99,5\n", encoding="utf-8")
    (tmp_path / "worse.csv").write_text("origin,destination,vehicles\n1,3,-5\n", encoding="utf-8")
    entries = [{"od": {"file": name}, "demand_period_s": 60.0} for name in ("bad.csv", "worse.csv")]
    assert ingest(tmp_path, osm | {"demand": entries}) == 2
    shown = capsys.readouterr().err
    assert "bad.csv" in shown
    assert "worse.csv:2" in shown


def test_a_resolved_configuration_is_one_again(tmp_path: Path, osm: dict[str, Any]) -> None:
    assert ingest(tmp_path, with_od(osm)) == 0
    config = load_config(tmp_path / "run/config.yaml")
    assert config.ingest == load_config(tmp_path / "run.yaml").ingest


def test_cells_hold_the_roads_that_start_in_them() -> None:
    nodes = gpd.GeoDataFrame(
        {"node_id": ["a", "b", "c"]},
        geometry=[Point(10, 10), Point(90, 10), Point(150, 120)],
        crs="EPSG:25832",
    )
    links = pd.DataFrame(
        {
            "from_node_id": ["a", "b", "c"],
            "to_node_id": ["b", "c", "a"],
            "length": [100.0, 200.0, 400.0],
        }
    )
    zones = cell_zones(Network(nodes, links), 100.0)
    assert zones["zone"].tolist() == ["0-0", "1-1"]
    assert zones["road_km"].tolist() == pytest.approx([0.3, 0.4])
    assert zones.geometry.iloc[1].equals(box(100, 100, 200, 200))
    with pytest.raises(InputError, match="cell_m"):
        cell_zones(Network(nodes, links), 0.0)


CROSSING = """<?xml version="1.0"?><osm version="0.6">
<node id="1" lat="50.000" lon="7.990"/><node id="2" lat="50.000" lon="8.000">
<tag k="highway" v="traffic_signals"/></node>
<node id="3" lat="50.000" lon="8.010"/><node id="4" lat="50.007" lon="8.000"/>
<node id="5" lat="49.993" lon="8.000"/>
<way id="10"><nd ref="1"/><nd ref="2"/><nd ref="3"/><tag k="highway" v="primary"/></way>
<way id="11"><nd ref="4"/><nd ref="2"/><nd ref="5"/><tag k="highway" v="secondary"/></way></osm>
"""


def test_signals_are_timed_by_the_rule_or_by_a_table_of_ones_own(
    tmp_path: Path, osm: dict[str, Any]
) -> None:
    (tmp_path / "town.osm").write_text(CROSSING, encoding="utf-8")
    (tmp_path / "od.csv").write_text("origin,destination,vehicles\n1,3,60\n", encoding="utf-8")
    section = with_od(osm)
    assert ingest(tmp_path, section | {"signals": "none"}) == 0
    table = tmp_path / "run/network/signals.csv"
    assert not table.exists()
    free = figures(tmp_path)["total_delay_veh_s"]
    assert ingest(tmp_path, section) == 0
    plans = pd.read_csv(table)
    assert set(plans["source"]) == {"assumed"}
    assert plans["phase"].nunique() == 2
    assumed = figures(tmp_path)["total_delay_veh_s"]
    assert assumed > free
    # nearly always red for the road that everybody drives
    own = plans.assign(source="given", cycle_s=float("nan"))
    main_road = own["link_id"].str.startswith("10:")
    own.loc[main_road, "green_s"], own.loc[~main_road, "green_s"] = 8.0, 100.0
    own.to_csv(tmp_path / "plans.csv", index=False)
    assert ingest(tmp_path, section | {"signal_table": "plans.csv"}) == 0
    assert figures(tmp_path)["total_delay_veh_s"] > 2 * assumed
    assert ingest(tmp_path, section | {"signals": "none"}) == 0
    assert not table.exists()
    assert figures(tmp_path)["total_delay_veh_s"] == free


def test_signals_of_gmns_tables_keep_their_times(tmp_path: Path) -> None:
    plan = Signal("b", (Phase(30.0, ("link 0",)), Phase(25.0, ())), offset=5.0)
    crossing = replace(road(), nodes=road().nodes.assign(control=["none", "signal"]))
    write_gmns(crossing, trips(), tmp_path / "gmns", signals=[plan])
    assert ingest(tmp_path, {"format": "gmns", "gmns": {"folder": "gmns"}}) == 0
    plans = pd.read_csv(tmp_path / "run/network/signals.csv")
    assert set(plans["source"]) == {"given"}
    held = plans[plans["link_id"] == "link 0"].iloc[0]
    assert (held["green_s"], held["offset_s"], held["cycle_s"]) == (30.0, 5.0, 55.0)


def test_one_of_several_plans_of_a_controller_is_stated(tmp_path: Path) -> None:
    phases = Phase(30.0, ("link 0",)), Phase(25.0, ())
    day = Signal("b", phases, begin=0.0, end=900.0)
    night = Signal("b", phases[::-1], offset=5.0, begin=900.0)
    crossing = replace(road(), nodes=road().nodes.assign(control=["none", "signal"]))
    write_gmns(crossing, trips(), tmp_path / "gmns", signals=[day, night])
    plans = pd.read_csv(tmp_path / "gmns/signal_timing_plan.csv", dtype="str")
    plans[["timing_plan_id", "controller_id"]].to_csv(
        tmp_path / "gmns/signal_timing_plan.csv", index=False
    )
    section = {"format": "gmns", "gmns": {"folder": "gmns"}}
    assert ingest(tmp_path, section) == 2
    section["gmns"] = {"folder": "gmns", "timing_plans": [plans["timing_plan_id"][1]]}
    assert ingest(tmp_path, section) == 0
    held = pd.read_csv(tmp_path / "run/network/signals.csv")
    assert set(held["offset_s"]) == {5.0}


def test_signals_of_the_network_where_nobody_drives_are_no_warning(
    tmp_path: Path, osm: dict[str, Any]
) -> None:
    (tmp_path / "town.osm").write_text(CROSSING, encoding="utf-8")
    late = "origin,destination,vehicles,start_s,end_s\n1,3,5,4000,4100\n"
    (tmp_path / "od.csv").write_text(late, encoding="utf-8")
    assert ingest(tmp_path, osm | {"demand": [{"od": {"file": "od.csv"}}]}) == 0
    assert (tmp_path / "run/network/signals.csv").exists()
    assert "never took effect" not in (tmp_path / "run/run.log").read_text(encoding="utf-8")
