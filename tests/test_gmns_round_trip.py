"""What is written as GMNS reads back as the same tables, to the bit."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from gmns_files import METRIC, assert_same_network, assert_same_table, crossing, folder_of, read
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pandas.testing import assert_frame_equal
from tntp_files import net, row, write

from uxsim_geo.demand.demand import Demand
from uxsim_geo.demand.gmns import read_gmns_demand, write_gmns
from uxsim_geo.errors import InputError
from uxsim_geo.network.exact import exact_factor, product, shortest_text
from uxsim_geo.network.gmns import read_gmns_network
from uxsim_geo.network.gmns_tables import GmnsUnits
from uxsim_geo.network.gmns_write import write_gmns_network
from uxsim_geo.network.network import MOVEMENT_COLUMNS, Network
from uxsim_geo.network.tntp import read_tntp_network
from uxsim_geo.network.tntp_options import TntpOptions

FLOATS = st.floats(1e-3, 1e7, allow_subnormal=False)
PLACES = st.tuples(*[st.floats(-179, 179), st.floats(-80, 80)])
TEXTS = st.text(max_size=6).filter(lambda text: "\0" not in text and text.strip() != "")
TEXTS = TEXTS.filter(lambda text: text.encode("utf-8", "ignore").decode() == text)
IDS = TEXTS.map(str.strip).filter(lambda text: text.lower() not in ("", "nan"))
IDS = IDS.filter(lambda text: " " not in text)


@st.composite
def networks(draw: st.DrawFn) -> Network:
    """Up to five nodes and eight links, with columns of their own and banned turns."""
    ids = draw(st.lists(IDS, min_size=2, max_size=5, unique=True))
    nodes = pd.DataFrame({"node_id": pd.Series(ids, dtype="str")})
    nodes["zone_id"] = pd.Series([draw(st.none() | IDS) for _ in ids], dtype="str")
    control = [draw(st.sampled_from(["none", "signal"])) for _ in ids]
    nodes["control"] = pd.Series(control, dtype="str")
    nodes["through_traffic"] = [draw(st.booleans()) for _ in ids]
    points = shapely.points([draw(PLACES) for _ in ids])
    names = draw(st.lists(IDS, min_size=1, max_size=8, unique=True))
    rows = [_link(draw, name, ids) for name in names]
    links = pd.DataFrame(rows)
    text = ["link_id", "from_node_id", "to_node_id", "road_class", "name", "remark"]
    links = links.astype(dict.fromkeys(text, "str"))
    lines = [shapely.linestrings(draw(st.lists(PLACES, min_size=2, max_size=4))) for _ in names]
    crs = draw(st.sampled_from(["EPSG:4326", None]))
    meeting = [
        (one["to_node_id"], one["link_id"], other["link_id"])
        for one in rows
        for other in rows
        if one["to_node_id"] == other["from_node_id"]
    ]
    banned = [turn for turn in meeting if draw(st.booleans())]
    movements = pd.DataFrame(banned, columns=list(MOVEMENT_COLUMNS)).astype("str")
    return Network(
        gpd.GeoDataFrame(nodes, geometry=points, crs=crs),
        gpd.GeoDataFrame(links, geometry=lines, crs=crs),
        movements,
    )


def _link(draw: st.DrawFn, name: str, nodes: Sequence[str]) -> dict[str, Any]:
    ends = [draw(st.sampled_from(nodes)) for _ in range(2)]
    return {
        "link_id": name,
        "from_node_id": ends[0],
        "to_node_id": ends[1],
        "length": draw(FLOATS),
        "lanes": draw(st.integers(1, 9)),
        "free_speed": draw(FLOATS),
        "jam_density": draw(st.floats(1e-3, 1)),
        "capacity": draw(FLOATS | st.just(math.nan)),
        "merge_priority": draw(FLOATS),
        "road_class": draw(st.none() | TEXTS),
        "name": draw(st.none() | TEXTS),
        "remark": draw(st.none() | TEXTS),
        "gmns_grade": draw(st.floats(allow_nan=True)),
        "count": draw(st.integers(-(2**63), 2**63 - 1)),
        "open": draw(st.booleans()),
    }


@settings(
    max_examples=80,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(
    network=networks(),
    units=st.sampled_from([("m", "km/h"), ("ft", "mph"), ("mi", "m/s"), ("km", "ft/s")]),
)
def test_any_network_comes_back(
    tmp_path_factory: pytest.TempPathFactory, network: Network, units: tuple[str, str]
) -> None:
    folder = tmp_path_factory.mktemp("gmns")
    write_gmns_network(network, folder, units=GmnsUnits(*units))
    assert_same_network(read_gmns_network(folder), network)


@given(
    value=st.floats(1e-9, 1e9),
    unit=st.sampled_from(["ft", "mi", "km"]),
    lanes=st.integers(1, 12),
)
def test_a_number_in_any_unit_reads_back(value: float, unit: str, lanes: int) -> None:
    for factor in (exact_factor(unit, "length"), exact_factor("veh/h", "capacity") * lanes):
        assert product(shortest_text(value, factor), factor) == value


def test_what_people_wrote_is_written_as_they_would() -> None:
    mph, lane = exact_factor("mph", "speed"), exact_factor("veh/h", "capacity") * 3
    assert shortest_text(25 * 0.44704, mph) == "25"
    assert shortest_text(1900 * 3 / 3600, lane) == "1900"
    assert shortest_text(120.5, exact_factor("m", "length")) == "120.5"


def test_tntp_networks_come_back_with_their_own_columns(tmp_path: Path) -> None:
    text = net([row(1, 2), row(2, 3), row(3, 1), row(3, 2)], zones=3)
    options = TntpOptions(length_unit="km", time_unit="min", capacity_unit="veh/h")
    network = read_tntp_network(write(tmp_path, "net.tntp", text), options)
    assert network.links["road_class"].notna().all()
    write_gmns_network(network, tmp_path / "gmns")
    back = read_gmns_network(tmp_path / "gmns")
    assert_same_network(back, network)
    # the notes of the first reading lie beside the tables and lead those of the second
    assert_frame_equal(back.notes.iloc[: len(network.notes)], network.notes)


def test_measured_networks_that_lack_what_a_run_needs_come_back(
    shared: Path, tmp_path: Path
) -> None:
    folder = shared / "data" / "tntp" / "Winnipeg"
    options = TntpOptions(length_unit="km", time_unit="min", capacity_unit="veh/h")
    network = read_tntp_network(folder / "Winnipeg_net.tntp", options)
    assert network.links["lanes"].isna().all()
    write_gmns_network(network, tmp_path)
    assert_same_network(read_gmns_network(tmp_path), network)


def banning(*turns: tuple[str, str, str]) -> Network:
    return replace(crossing(), movements=pd.DataFrame(turns, columns=list(MOVEMENT_COLUMNS)))


def listed(folder: Path) -> list[dict[str, str]]:
    with (folder / "movement.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_banned_turns_are_written_as_all_the_others_at_their_node(tmp_path: Path) -> None:
    network = banning(("m", "nm", "mn"), ("m", "sm", "mw"))
    write_gmns_network(network, tmp_path)
    rows = listed(tmp_path)
    assert len(rows) == 16 - 2
    assert {line["node_id"] for line in rows} == {"m"}
    kinds = {line["ib_link_id"] + " " + line["ob_link_id"]: line["type"] for line in rows}
    assert {turn: kinds[turn] for turn in ("nm ms", "nm me", "nm mw", "em me")} == {
        "nm ms": "thru",
        "nm me": "left",
        "nm mw": "right",
        "em me": "uturn",
    }
    assert_same_network(read_gmns_network(tmp_path), network)


def test_a_node_where_every_turn_is_banned_is_closed_still(tmp_path: Path) -> None:
    network = banning(("n", "mn", "nm"))
    write_gmns_network(network, tmp_path)
    assert [line["allowed_uses"] for line in listed(tmp_path)] == ["none"]
    assert_same_network(read_gmns_network(tmp_path), network)


def test_tables_of_an_earlier_writing_do_not_stay(tmp_path: Path) -> None:
    write_gmns_network(banning(("n", "mn", "nm")), tmp_path)
    write_gmns_network(crossing(), tmp_path)
    assert not (tmp_path / "movement.csv").exists()
    assert_same_network(read_gmns_network(tmp_path), crossing())


def test_tables_that_others_wrote_are_not_touched(tmp_path: Path) -> None:
    folder_of(tmp_path, lane=["lane_id,link_id,lane_num", "1,a,1"])
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(InputError) as raised:
        write_gmns_network(crossing(), tmp_path)
    assert [fault.what.split()[2] for fault in raised.value.faults] == [
        "node.csv",
        "link.csv",
        "lane.csv",
    ]
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_the_same_network_gives_the_same_bytes(tmp_path: Path) -> None:
    texts = []
    for name in ("one", "two"):
        paths = write_gmns_network(banning(("m", "nm", "mn")), tmp_path / name)
        texts.append([(path.name, path.read_bytes()) for path in paths])
    assert texts[0] == texts[1]


def test_a_read_folder_is_written_under_its_own_names(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    rows = ["link_id,from_node_id,to_node_id,directed,length,free_speed,lanes,capacity,toll,NAME"]
    rows += [
        "a,1,2,1,1000,36,2,1800,2.5,High St",
        "b,2,3,1,500,36,1,1800,,",
        "c,3,1,1,1120,72,1,,,",
    ]
    network = read(tmp_path / "in", link=rows)
    write_gmns_network(network, tmp_path / "out")
    header = (tmp_path / "out" / "link.csv").read_text(encoding="utf-8").split("\n")[0].split(",")
    assert "toll" in header
    assert "name" in header
    assert_same_network(read_gmns_network(tmp_path / "out"), network)


def test_links_for_other_uses_come_back_without_being_asked_for(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    rows = ["link_id,from_node_id,to_node_id,directed,length,free_speed,lanes,allowed_uses"]
    rows += ["a,1,2,1,1000,36,2,bus", "b,2,3,1,500,36,1,", "c,3,1,1,1120,72,1,bus;taxi"]
    network = read(tmp_path / "in", replace(METRIC, uses=("bus",)), link=rows)
    assert len(network.links) == 3
    write_gmns_network(network, tmp_path / "out")
    assert_same_network(read_gmns_network(tmp_path / "out"), network)


def test_edited_files_are_read_as_they_are_now(tmp_path: Path) -> None:
    write_gmns_network(crossing(), tmp_path)
    path = tmp_path / "link.csv"
    text = path.read_text(encoding="utf-8")
    assert text.count(",100,") == 8
    path.write_text(text.replace(",100,", ",250.5,", 1), encoding="utf-8")
    assert read_gmns_network(tmp_path).links["length"].tolist()[:2] == [250.5, 100]


@pytest.mark.parametrize(
    ("file", "old", "new", "what"),
    [
        ("uxsim_columns", "node,node_id", "node,ghost", None),
        ("uxsim_columns", "float64", "complex", "must be one of"),
        ("uxsim_columns", "length,length,", "length,gone,", "lacks a column"),
        ("link", "uxsim_jam_density", "uxsim_density", "lacks a column"),
        ("link", "0.2", "-0.2", "must be above 0"),
    ],
)
def test_edits_that_break_the_description_are_told_of(
    tmp_path: Path, file: str, old: str, new: str, what: str | None
) -> None:
    write_gmns_network(crossing(), tmp_path)
    path = tmp_path / f"{file}.csv"
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    if what is None:
        read_gmns_network(tmp_path)
        return
    with pytest.raises(InputError, match=what):
        read_gmns_network(tmp_path)


def test_what_cannot_be_written_is_told_at_once_and_nothing_is(tmp_path: Path) -> None:
    network = crossing()
    links = network.links.assign(
        link_id=["nm", "nm", " x", "nan", "a", "b", "c", "d"],
        free_speed=[10.0, math.inf, 0, 10, 10, 10, 10, 10],
        remark=[None, "", "  ", "a\0", "x", "x", "x", "x"],
        when=pd.Timestamp("2026-01-01"),
    )
    with pytest.raises(InputError) as raised:
        write_gmns_network(
            replace(network, links=links), tmp_path / "out", units=GmnsUnits("mph", "m")
        )
    assert [fault.column for fault in raised.value.faults] == [
        "length",
        "speed",
        "link_id",
        "link_id",
        "link_id",
        "remark",
        "remark",
        "remark",
        "when",
        "free_speed",
    ]
    assert not (tmp_path / "out").exists()


def test_networks_without_geometry_cannot_be_written(tmp_path: Path) -> None:
    network = crossing()
    bare = Network(
        pd.DataFrame(network.nodes.drop(columns="geometry")),
        pd.DataFrame(network.links.drop(columns="geometry")),
    )
    with pytest.raises(InputError, match="the nodes have no geometry"):
        write_gmns_network(bare, tmp_path)


def test_demand_comes_back_with_classes_and_routes(tmp_path: Path) -> None:
    table = pd.DataFrame(
        {
            "origin": ["n", "n", "w"],
            "destination": ["s", "s", "e"],
            "start_s": [0.0, 100.1, 0.1 + 0.2],
            "end_s": [100.1, 1 / 3 * 1000, 7200.0],
            "vehicles": [1e-9, 12.3, 7],
            "class": ["slow, heavy", None, None],
        }
    ).astype({"origin": "str", "destination": "str", "class": "str"})
    table["route"] = pd.Series([None, ("nm", "ms"), None], dtype=object)
    write_gmns(crossing(), Demand(table), tmp_path)
    network = read_gmns_network(tmp_path)
    back = read_gmns_demand(tmp_path, network)
    assert_same_table(back.table, table)


def test_whole_numbers_of_vehicles_stay_whole(tmp_path: Path) -> None:
    table = pd.DataFrame([("n", "s", 0, 3600, 40)])
    table.columns = ["origin", "destination", "start_s", "end_s", "vehicles"]
    table = table.astype({"origin": "str", "destination": "str"})
    write_gmns(crossing(), Demand(table), tmp_path)
    assert_same_table(read_gmns_demand(tmp_path, crossing()).table, table)
    text = (tmp_path / "demand.csv").read_text(encoding="utf-8")
    assert text.split("\n")[1] == ",,40,n,s,0,3600"


def test_the_floats_of_lines_come_back_to_the_bit(tmp_path: Path) -> None:
    generator = np.random.default_rng(5)
    points = generator.normal(size=(8, 3, 2)) * 10.0 ** generator.integers(-12, 12, (8, 1, 1))
    network = crossing()
    links = network.links.set_geometry(shapely.linestrings(points))
    write_gmns_network(replace(network, links=links), tmp_path)
    assert_same_network(read_gmns_network(tmp_path), replace(network, links=links))
