"""Tables of a finished run: what they hold, where they go, and what is refused."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pyogrio
import pytest
from shapely.geometry import box
from small_run import CONFIG, run_small, write_small_run

from pipeline.cli import main
from pipeline.table_formats import FORMATS, plain_decimal
from pipeline.table_makers import TABLES
from pipeline.table_options import FLAGS
from uxsim_geo.errors import InputError


def export(run: Path, table: str, *options: str) -> int:
    return main(["export", str(run), "--table", table, *options])


def exported(run: Path, table: str, *options: str) -> pd.DataFrame:
    assert export(run, table, *options) == 0
    return pd.read_csv(run / f"tables/{table}.csv")


def options_of(table: str, folder: Path) -> list[str]:
    """What a table cannot be without, for the small run; files are made in ``folder``."""
    observed = "link_id,start_s,end_s,vehicles\n3-4,0,300,40\n"
    if table.startswith("travel_times"):
        observed = "link_id,start_s,end_s,travel_time_s\n3-4,0,300,60\n"
    (folder / "observed.csv").write_text(observed, encoding="utf-8")
    shapes = [box(-100, -100, 1600, 100), box(400, -100, 2100, 100)]
    areas = gpd.GeoDataFrame({"name": ["west", "east"]}, geometry=shapes)
    areas.to_file(folder / "areas.gpkg")
    values = {
        "links": "3-4",
        "zones": "1",
        "areas": str(folder / "areas.gpkg"),
        "observed": str(folder / "observed.csv"),
    }
    return [text for name in sorted(TABLES[table].needs) for text in (FLAGS[name], values[name])]


def files_below(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.filterwarnings("ignore:'crs' was not provided")
@pytest.mark.parametrize("table", TABLES)
def test_all_formats_say_the_same(
    finished: Path, capsys: pytest.CaptureFixture[str], table: str
) -> None:
    asked = options_of(table, finished.parent)
    for form in FORMATS:
        assert export(finished, table, "--format", form, *asked) == 0
    text = pd.read_csv(finished / f"tables/{table}.csv", dtype=str)
    binary = pd.read_parquet(finished / f"tables/{table}.parquet")
    assert list(text.columns) == list(binary.columns)
    for name in binary.columns:
        if pd.api.types.is_numeric_dtype(binary[name].dtype):
            numbers = text[name].astype(float)
            np.testing.assert_array_equal(numbers, binary[name].astype(float))
        else:
            assert text[name].astype(str).tolist() == binary[name].astype(str).tolist()
    shown = capsys.readouterr().out.splitlines()
    size = f"{len(binary)} rows, {len(binary.columns)} columns"
    assert shown == [f"{finished / 'tables' / table}.{form}: {size}" for form in FORMATS]
    sheet = pd.read_excel(finished / f"tables/{table}.xlsx", sheet_name="table")
    assert list(sheet.columns) == list(binary.columns)
    for name in binary.columns[[pd.api.types.is_float_dtype(kind) for kind in binary.dtypes]]:
        numbers = sheet[name].astype(float)
        assert numbers.to_numpy() == pytest.approx(binary[name].to_numpy(), rel=1e-14, nan_ok=True)


@pytest.mark.filterwarnings("ignore:'crs' was not provided")
@pytest.mark.parametrize("table", TABLES)
def test_csv_is_utf8_with_a_header_and_plain_decimals(finished: Path, table: str) -> None:
    assert export(finished, table, *options_of(table, finished.parent)) == 0
    content = (finished / f"tables/{table}.csv").read_bytes()
    header, *rows = content.decode("utf-8").splitlines()
    assert not any(cell[:1].isdigit() for cell in header.split(","))
    assert rows
    assert b"\r" not in content
    numbers = [cell for row in rows for cell in row.split(",") if cell[:1] in set("-0123456789")]
    assert not any("e" in cell.lower() for cell in numbers)


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (1e-7, "0.0000001"),
        (-2.5e-5, "-0.000025"),
        (3e20, "300000000000000000000"),
        (0.1, "0.1"),
        (12.0, "12.0"),
        (float("inf"), "inf"),
    ],
)
def test_decimals_have_no_exponent_and_read_back(number: float, text: str) -> None:
    assert plain_decimal(number) == text
    assert float(text) == number


def test_figures_of_a_road_on_which_nobody_is_held_up(finished: Path) -> None:
    """100 vehicles in platoons of 5 from 1 by 3 and 4 to 2: links of 25, 50 and 25 s."""
    od = exported(finished, "od").iloc[0]
    assert (od["origin"], od["destination"]) == (1, 2)
    assert od["vehicles_demanded"] == od["vehicles_completed"] == 100
    assert od["experienced_travel_time_completed_only_s"] >= 100
    trips = exported(finished, "trips")
    assert len(trips) == 20
    assert trips["links_entered"].tolist() == [3] * 20
    routes = exported(finished, "trip_routes")
    assert routes["link"].tolist() == ["1-3", "3-4", "4-2"] * 20
    turns = exported(finished, "turning_counts")
    assert turns.to_numpy().tolist() == [[3, "1-3", "3-4", 100], [4, "3-4", "4-2", 100]]
    skims = exported(finished, "skims")
    assert skims["free_flow_travel_time_s"].tolist() == pytest.approx([100] * 4)


def test_link_times_are_in_seconds_and_the_units_of_their_names(finished: Path) -> None:
    times = exported(finished, "link_times")
    assert times["link_id"].tolist() == [name for name in ("1-3", "3-4", "4-2") for _ in range(4)]
    assert times["begin_s"].tolist() == [0, 300, 600, 900] * 3
    assert times["end_s"].tolist() == [300, 600, 900, 1200] * 3
    assert times.groupby("link_id")["entries_veh"].sum().tolist() == [100] * 3
    # all vehicles drive 500, 1000 and 500 m: flow times length and bin
    driven = times.groupby("link_id")["flow_vph"].sum() / 3600 * 300 * [500, 1000, 500]
    assert driven.tolist() == pytest.approx([50_000, 100_000, 50_000])


def test_cumulative_curves_of_all_links_at_the_edges_of_the_bins(finished: Path) -> None:
    curves = exported(finished, "cumulative", "--bin-s", "600").set_index("link_id")
    assert curves.index.tolist() == [name for name in ("1-3", "3-4", "4-2") for _ in range(3)]
    assert curves["time_s"].tolist() == [0, 600, 1200] * 3
    # all depart before 600 s and are on the first link for 25 s
    assert curves.loc["1-3", "entries"].tolist() == [0, 100, 100]
    assert curves.loc["4-2", "exits"].tolist()[::2] == [0, 100]
    assert (curves.loc["1-3", "exits"].array == curves.loc["3-4", "entries"].array).all()
    assert (curves["queue"] == curves["virtual_departures"] - curves["exits"]).all()


def test_bins_are_those_of_the_report_unless_others_are_asked_for(finished: Path) -> None:
    moments = exported(finished, "vehicles_over_time")
    assert moments["time_s"].tolist() == [0, 300, 600, 900, 1200]
    assert moments["completed"].iloc[-1] == 100
    moments = exported(finished, "vehicles_over_time", "--bin-s", "500")
    assert moments["time_s"].tolist() == [0, 500, 1000, 1200]
    # every platoon departs within its share of 30 s
    od = exported(finished, "od", "--bin-s", "300")
    assert od["begin_s"].tolist() == [0, 300]
    assert od["vehicles_demanded"].tolist() == [50, 50]


def test_the_file_is_named_as_asked(finished: Path) -> None:
    place = finished.parent / "pairs.parquet"
    assert export(finished, "od", "--out", str(place)) == 0
    assert pd.read_parquet(place)["vehicles_completed"].tolist() == [100]
    inside = finished / "tables/pairs.csv"
    assert export(finished, "od") == 0
    assert export(finished, "od", "--out", str(inside)) == 0
    assert inside.read_bytes() == (finished / "tables/od.csv").read_bytes()


def test_every_fault_is_said_at_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = str(tmp_path / "gone/table.ods")
    assert export(tmp_path, "turning_count", "--out", out) == 2
    lines = capsys.readouterr().err.splitlines()
    expected = (
        "did you mean turning_counts?",
        "must end in .csv or .parquet or .xlsx",
        "no such folder",
        "only tables/ is for tables",
        "is no run",
    )
    assert len(lines) == len(expected)
    for line, words in zip(lines, expected, strict=True):
        assert line.startswith("error: ")
        assert words in line
    assert list(tmp_path.iterdir()) == []


def test_a_name_like_no_other_gets_the_list(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert export(finished, "xyz") == 2
    shown = capsys.readouterr().err
    assert "did you mean" not in shown
    assert ", ".join(TABLES) in shown


@pytest.mark.parametrize(
    ("name", "format_", "expected"),
    [
        ("{run}/events.parquet", None, "only tables/ is for tables"),
        ("{run}/../../trips.csv", None, "the run was made from this file"),
        ("{run}/tables/od.csv", "parquet", "must end in .parquet, as --format says"),
        ("{run}/tables.csv/", None, "is a folder"),
    ],
)
def test_a_file_that_is_no_place_for_a_table(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    name: str,
    format_: str | None,
    expected: str,
) -> None:
    write_small_run(tmp_path, CONFIG.replace("trips.tntp", "trips.csv"))
    shutil.move(tmp_path / "trips.tntp", tmp_path / "trips.csv")
    assert run_small(tmp_path) == 0
    run = tmp_path / "runs/small"
    (run / "tables").mkdir()
    (run / "tables.csv").mkdir()
    before = files_below(tmp_path)
    options = [] if format_ is None else ["--format", format_]
    assert export(run, "od", "--out", name.format(run=run), *options) == 2
    assert expected in capsys.readouterr().err
    assert files_below(tmp_path) == before


@pytest.mark.parametrize("name", ["events.parquet", "trips.parquet", "network/links.parquet"])
def test_a_run_whose_files_are_others_is_refused(
    finished: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    content = (finished / name).read_bytes()
    (finished / name).write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
    assert export(finished, "od") == 2
    assert f"{name} is not what the run wrote" in capsys.readouterr().err
    (finished / name).unlink()
    assert export(finished, "od") == 2
    assert f"{name} is missing" in capsys.readouterr().err
    assert not (finished / "tables").exists()


def test_limits_of_another_run_are_refused(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copy(finished / "trips.parquet", finished / "speed_limits.parquet")
    assert export(finished, "link_times") == 2
    assert "speed_limits.parquet is not what the run wrote" in capsys.readouterr().err


def test_a_simulation_fed_by_another_network_is_refused(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    manifest = json.loads((finished / "manifest.json").read_text())
    manifest["stages"]["simulate"]["inputs"]["network/links.parquet"]["sha256"] = "0" * 64
    (finished / "manifest.json").write_text(json.dumps(manifest))
    assert export(finished, "od") == 2
    assert "network/links.parquet is not what the run wrote" in capsys.readouterr().err


def test_a_run_that_was_not_finished_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_small_run(tmp_path)
    assert run_small(tmp_path, command="ingest") == 0
    run = tmp_path / "runs/small"
    capsys.readouterr()
    assert export(run, "od") == 2
    assert "has not been simulated" in capsys.readouterr().err
    manifest = json.loads((run / "manifest.json").read_text())
    manifest["stages"]["simulate"] = {"inputs": {}, "outputs": {}, "problems": ["broke off"]}
    (run / "manifest.json").write_text(json.dumps(manifest))
    assert export(run, "od") == 2
    assert "small: broke off" in capsys.readouterr().err


def test_a_manifest_with_keys_that_nobody_knows_is_refused(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    manifest = json.loads((finished / "manifest.json").read_text())
    manifest["run"]["config"]["simulate"]["of_tomorrow"] = 1
    (finished / "manifest.json").write_text(json.dumps(manifest))
    assert export(finished, "od") == 2
    assert "another version" in capsys.readouterr().err


def test_neither_sources_nor_pictures_are_needed(finished: Path) -> None:
    before = exported(finished, "skims")
    for path in finished.parents[1].glob("*.*"):
        path.unlink()
    (finished / "results.gpkg").unlink()
    pd.testing.assert_frame_equal(exported(finished, "skims"), before)


def test_bins_that_a_table_does_not_have(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for table in ("trips", "trip_routes"):
        assert export(finished, table, "--bin-s", "60") == 2
        assert f"--bin-s: {table} does not go by it" in capsys.readouterr().err


@pytest.mark.parametrize("seconds", ["0", "-5", "nan", "inf", "soon"])
def test_bins_of_no_length(
    finished: Path, capsys: pytest.CaptureFixture[str], seconds: str
) -> None:
    with pytest.raises(SystemExit) as end:
        export(finished, "od", "--bin-s", seconds)
    assert end.value.code == 2
    assert "--bin-s: must be a finite number above 0" in capsys.readouterr().err


@pytest.mark.filterwarnings("ignore:'crs' was not provided")
@pytest.mark.parametrize(
    "table", [name for name, table in TABLES.items() if "bin_s" in table.takes]
)
def test_bins_beyond_number(finished: Path, capsys: pytest.CaptureFixture[str], table: str) -> None:
    asked = options_of(table, finished.parent)
    assert export(finished, table, "--bin-s", "1e-6", *asked) == 2
    shown = capsys.readouterr().err
    assert "s or more" in shown or "take longer cells" in shown
    assert not (finished / "tables").exists()


def test_a_failure_while_writing_keeps_the_table_of_before(
    finished: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fill_the_disk(_: pd.DataFrame, path: Path, **__: object) -> None:
        path.write_text("origin,dest")
        raise OSError(28, "No space left on device")

    assert export(finished, "od") == 0
    before = files_below(finished)
    monkeypatch.setattr(pd.DataFrame, "to_csv", fill_the_disk)
    capsys.readouterr()
    assert export(finished, "od") == 1
    assert "No space left" in capsys.readouterr().err
    assert files_below(finished) == before


def test_a_file_in_the_way_of_the_tables(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (finished / "tables").write_text("in the way")
    assert export(finished, "od") == 2
    assert "choose another --out" in capsys.readouterr().err


def test_first_lines_of_a_table(finished: Path) -> None:
    assert export(finished, "turning_counts") == 0
    text = (finished / "tables/turning_counts.csv").read_text(encoding="utf-8")
    assert text == "node,from_link,to_link,vehicles\n3,1-3,3-4,100.0\n4,3-4,4-2,100.0\n"


def test_a_sheet_takes_texts_for_texts_and_is_the_same_each_time(tmp_path: Path) -> None:
    table = pd.DataFrame({"name": ["=1+1", "http://a.b", "007"], "value": [1.5, np.nan, np.inf]})
    for name in ("a", "b"):
        FORMATS["xlsx"](table, tmp_path / f"{name}.xlsx")
    assert (tmp_path / "a.xlsx").read_bytes() == (tmp_path / "b.xlsx").read_bytes()
    read = pd.read_excel(tmp_path / "a.xlsx", dtype={"name": str})
    assert read["name"].tolist() == ["=1+1", "http://a.b", "007"]
    assert read["value"].tolist()[0] == 1.5


def test_more_rows_than_a_sheet_has_are_refused(tmp_path: Path) -> None:
    table = pd.DataFrame({"value": np.zeros(1_048_576)})
    with pytest.raises(InputError, match=r"1,048,575 rows .* take csv or parquet"):
        FORMATS["xlsx"](table, tmp_path / "long.xlsx")
    assert list(tmp_path.iterdir()) == []


def test_options_are_asked_for_where_they_are_needed(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert export(finished, "link_users") == 2
    assert "--links: link_users needs it" in capsys.readouterr().err
    assert export(finished, "area_pairs", "--zones", "1") == 2
    shown = capsys.readouterr().err
    assert "--zones: area_pairs does not go by it" in shown
    assert "--areas: area_pairs needs it" in shown


def test_tables_of_chosen_links_zones_and_areas(finished: Path) -> None:
    flows = exported(finished, "link_user_flows", "--links", "1-3")
    assert flows["share"].tolist() == [1, 1, 1]
    assert exported(finished, "zone_user_pairs", "--zones", "2")["share"].tolist() == [1]
    cells = exported(finished, "cells", "--links", "4-2,1-3", "--cell-m", "250")
    assert cells["link_id"].unique().tolist() == ["1-3", "4-2"]
    assert cells["distance_veh_m"].sum() == pytest.approx(100 * 1000)
    way = exported(finished, "trajectories", "--step-s", "25", "--links", "3-4")
    assert way["position_m"].between(0, 1000).all()


def test_counts_beside_the_run(finished: Path) -> None:
    observed = finished.parent / "counts.csv"
    observed.write_text("link_id,start_s,end_s,vehicles\n1-3,0,300,50\n", encoding="utf-8")
    table = exported(finished, "counts", "--observed", str(observed))
    assert table["simulated_vehicles"].tolist() == [50]
    fit = exported(finished, "counts_fit", "--observed", str(observed)).set_index("figure")
    assert float(fit.loc["share_under_geh_5", "value"]) == 1


@pytest.mark.filterwarnings("ignore:'crs' was not provided")
def test_areas_that_cannot_be_used(
    finished: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert export(finished, "area_states", "--areas", str(tmp_path / "none.gpkg")) == 2
    assert "no such file" in capsys.readouterr().err
    (tmp_path / "text.gpkg").write_text("no polygons", encoding="utf-8")
    assert export(finished, "area_states", "--areas", str(tmp_path / "text.gpkg")) == 2
    assert "holds no data that are read here" in capsys.readouterr().err
    far = gpd.GeoDataFrame({"name": ["far"]}, geometry=[box(9e5, 9e5, 9.1e5, 9.1e5)])
    far.to_file(tmp_path / "far.gpkg")
    assert export(finished, "area_states", "--areas", str(tmp_path / "far.gpkg")) == 2
    assert "no link of the network lies in any" in capsys.readouterr().err
    far.rename(columns={"name": "area"}).to_file(tmp_path / "unnamed.gpkg")
    assert export(finished, "area_states", "--areas", str(tmp_path / "unnamed.gpkg")) == 2
    shown = capsys.readouterr().err
    assert "there is no such column; there are area" in shown
    assert f"--areas {tmp_path / 'unnamed.gpkg'}, column name" in shown
    pyogrio.write_dataframe(pd.DataFrame({"name": ["a"]}), tmp_path / "bare.gpkg")
    assert export(finished, "area_states", "--areas", str(tmp_path / "bare.gpkg")) == 2
    assert "has no geometry" in capsys.readouterr().err
    some = gpd.GeoDataFrame(
        {"name": ["here", "far"]}, geometry=[box(-100, -100, 1600, 100), box(9e5, 9e5, 1e6, 1e6)]
    )
    some.to_file(tmp_path / "some.gpkg")
    table = exported(finished, "area_states", "--areas", str(tmp_path / "some.gpkg"))
    assert set(table["area"]) == {"here"}
    assert capsys.readouterr().err == "note: no link lies in far: left out\n"


def test_options_that_do_not_fit_are_shown_as_they_were_written(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert export(finished, "od", "--links", "1-3,3-4") == 2
    assert (
        "--links: od does not go by it; leave it out (found '1-3,3-4')" in capsys.readouterr().err
    )


def test_unknown_links_are_told_with_those_near(
    finished: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert export(finished, "link_users", "--links", "1-33") == 2
    told = r"there is none of this name; did you mean .*1-3.*\? \(found '1-33'\)"
    assert re.search(told, capsys.readouterr().err)


@pytest.mark.parametrize("names", ["", ",", "a,,b"])
def test_names_of_nothing(finished: Path, capsys: pytest.CaptureFixture[str], names: str) -> None:
    with pytest.raises(SystemExit):
        export(finished, "link_users", "--links", names)
    assert "names nothing between commas" in capsys.readouterr().err


@pytest.mark.filterwarnings("ignore:'crs' was not provided")
def test_a_run_in_which_nobody_drives_has_a_report_and_all_tables(tmp_path: Path) -> None:
    late = CONFIG.replace("demand_period_s: 600", "demand_period_s: 10\n    start_s: 10000")
    write_small_run(tmp_path, late.replace("  plots: []\n", ""))
    assert run_small(tmp_path, "--quiet") == 0
    run = tmp_path / "runs/small"
    assert len(list((run / "plots").iterdir())) == 2
    for table in TABLES:
        assert export(run, table, *options_of(table, tmp_path)) == 0, table
    assert pd.read_csv(run / "tables/od.csv")["vehicles_demanded"].tolist() == [100]
    assert pd.read_csv(run / "tables/links.csv")["volume_veh"].tolist() == [0, 0, 0]
    assert pd.read_csv(run / "tables/trip_routes.csv").empty
