"""Wrong GMNS folders: every fault is told with its place, and nothing but InputError comes out."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest
from gmns_files import LINKS, METRIC, NODES, faults_of, folder_of, placed, told
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from uxsim_geo.demand.gmns import read_gmns_demand
from uxsim_geo.demand.profile import TripsOptions
from uxsim_geo.errors import InputError
from uxsim_geo.network.gmns import read_gmns_network
from uxsim_geo.network.gmns_options import GmnsOptions

MOVEMENTS = ["mvmt_id,node_id,ib_link_id,ob_link_id", "1,2,a,b", "2,3,b,c"]
FULL = [f"{LINKS[0]},dir_flag,geometry,parent_link_id", *(f"{row},,," for row in LINKS[1:])]


@pytest.mark.parametrize(
    ("old", "new", "line", "column", "value", "what"),
    [
        ("b,2,3", "a,2,3", 3, "link_id", "a", "stands on line 2 too"),
        ("b,2,3", ",2,3", 3, "link_id", None, "needs a value"),
        ("b,2,3", "NaN,2,3", 3, "link_id", None, "needs a value"),
        ("b,2,3", "b,2,9", 3, "to_node_id", "9", "refers to a node that is not there"),
        ("b,2,3", "b,,3", 3, "from_node_id", None, "needs a value"),
        ("3,1,500", "3,2,500", 3, "directed", "2", "must be 1"),
        (",500,", ",5oo,", 3, "length", "5oo", "must be a finite number"),
        (",500,", ",5_00,", 3, "length", "5_00", "must be a finite number"),
        (",500,", ",1e400,", 3, "length", "1e400", "must be a finite number"),
        (",500,", ",-5,", 3, "length", "-5", "must not be negative"),
        ("500,36,", "500,inf,", 3, "free_speed", "inf", "must be a finite number"),
        ("500,36,", "500,0,", 3, "free_speed", "0", "must be above 0"),
        ("500,36,1", "500,36,1.5", 3, "lanes", "1.5", "a whole number"),
        ("500,36,1", "500,36,-1", 3, "lanes", "-1", "a whole number"),
        ("36,1,1800", "36,1,0", 3, "capacity", "0", "must be above 0, or empty"),
        ("1800,,,\nc", "1800,2,,\nc", 3, "dir_flag", "2", "must be 1, -1, 0 or empty"),
        ("1800,,,\nc", "1800,,POINT (1 2),\nc", 3, "geometry", "POINT (1 2)", "LINESTRING in WKT"),
        ("1800,,,\nc", "1800,,LINESTRING (1,\nc", 3, "geometry", "LINESTRING (1", "LINESTRING"),
        ("1800,,,\nc", "1800,,,x\nc", 3, "parent_link_id", "x", "refers to a link that is not"),
        (",1800,,,\nc", ",1800\nc", 3, None, "b,2,3,1,500,36,1,1800", "has 8 values under 11"),
        ("length", "lanes", 1, "lanes", None, "more than once"),
        ("from_node_id", "from", 1, None, None, "lacks the column from_node_id"),
    ],
)
def test_one_fault_of_a_link_has_its_place(
    tmp_path: Path,
    old: str,
    new: str,
    line: int,
    column: str | None,
    value: str | None,
    what: str,
) -> None:
    text = "\n".join(FULL)
    assert text.count(old) == 1
    faults = faults_of(tmp_path, link=text.replace(old, new).encode())
    found = {(fault.line, fault.column, fault.value) for fault in faults}
    assert (line, column, value) in found
    assert any(what in fault.what for fault in faults)
    assert len(faults) == 1 or "lengths" in str(faults)


@pytest.mark.parametrize(
    ("shape", "what"),
    [
        ("LINESTRING EMPTY", "without a point"),
        ("LINESTRING (0 0, nan 1)", "not a finite number"),
        ("LINESTRING (0 0, 1e400 1)", "not a finite number"),
        ("MULTILINESTRING ((0 0, 1 0), (5 5, 6 6))", "do not join"),
        ("MULTILINESTRING EMPTY", "without a point"),
        ("LINESTRING" + "(" * 5000, "must be a LINESTRING"),
        ("GEOMETRYCOLLECTION (LINESTRING (0 0, 1 1))", "must be a LINESTRING"),
    ],
)
def test_shapes_that_are_no_line(tmp_path: Path, shape: str, what: str) -> None:
    rows = [FULL[0], FULL[1].replace(",,,", f',,"{shape}",'), *FULL[2:]]
    (fault,) = faults_of(tmp_path, link=rows)
    assert (fault.line, fault.column) == (2, "geometry")
    assert what in fault.what


def test_all_faults_of_all_tables_at_once(tmp_path: Path) -> None:
    nodes = placed([*NODES, "3,7,7", "4,8,9"])
    nodes[4] = nodes[4].replace(",5300007", ",north")
    links = [*LINKS[:2], "b,2,77,1,500,36,1,1800", "c,3,1,1,x,72,1,"]
    lanes = ["lane_id,link_id,lane_num", "1,a,left", "1,zz,1"]
    movements = [*MOVEMENTS, "2,2,a,c", "4,2,ghost,b", "5,9,a,b"]
    faults = faults_of(tmp_path, node=nodes, link=links, lane=lanes, movement=movements)
    assert told(faults) == {
        ("node", 5, "node_id", "3"),
        ("node", 5, "y_coord", nodes[4].split(",")[2]),
        ("link", 3, "to_node_id", "77"),
        ("link", 4, "length", "x"),
        ("lane", 2, "lane_num", "left"),
        ("lane", 3, "lane_id", "1"),
        ("lane", 3, "link_id", "zz"),
        ("movement", 3, "ib_link_id", "b"),
        ("movement", 4, "mvmt_id", "2"),
        ("movement", 4, "ob_link_id", "c"),
        ("movement", 5, "ib_link_id", "ghost"),
        ("movement", 6, "node_id", "9"),
    }


def test_movements_must_meet_at_their_node(tmp_path: Path) -> None:
    faults = faults_of(tmp_path, movement=[*MOVEMENTS[:2], "2,3,a,c"])
    assert [(fault.column, fault.what) for fault in faults] == [
        ("ib_link_id", "does not end at node 3")
    ]


@pytest.mark.parametrize(
    ("row", "column", "what"),
    [
        ("furlong,mph,4326", "long_length", "is no unit that is known"),
        ("mile,warp,4326", "speed", "is no unit that is known"),
        ("mile,mph,EPSG:99999999", "crs", "is not a reference system"),
    ],
)
def test_config_that_says_nothing_useful(tmp_path: Path, row: str, column: str, what: str) -> None:
    rows = ["long_length,speed,crs", row]
    faults = faults_of(tmp_path, GmnsOptions(length_check="warn"), config=rows)
    assert [(Path(fault.source).stem, fault.column) for fault in faults] == [("config", column)]
    assert what in faults[0].what


def test_coordinates_that_are_no_degrees(tmp_path: Path) -> None:
    faults = faults_of(tmp_path, replace(METRIC, crs="EPSG:4326"))
    assert [(fault.column, fault.value) for fault in faults] == [("crs", "EPSG:4326")]
    assert "3 of 3 points" in faults[0].what


@pytest.mark.parametrize(
    ("content", "what"),
    [
        (b"", "is empty"),
        (b"\n \n,,\n", "is empty"),
        (b"link_id,from_node_id\0,to_node_id\n", "binary file"),
        (b"PK\x03\x04\xff\xfe\x00", "not a text file in UTF-8"),
        ("link_id,name\n1,Stra\xdfe\n".encode("latin-1"), "not a text file in UTF-8"),
        (b'link_id,name\n1,"open\n2,b\n', "no table of comma-separated values"),
        (b"link_id;from_node_id;to_node_id\n1;2;3\n", "separate the columns by commas"),
        (b"link_id,from_node_id,to_node_id," + b"x" * 200_000, "field larger than field limit"),
        (b"link_id,from_node_id,to_node_id,\n1,1,2,z\n", "column 4 has values but no name"),
        (b"link_id,from_node_id,to_node_id\n", "has no row"),
    ],
)
def test_files_that_are_no_table_say_why(tmp_path: Path, content: bytes, what: str) -> None:
    faults = faults_of(tmp_path, link=content)
    assert any(what in fault.what for fault in faults), [str(fault) for fault in faults]
    assert all(Path(fault.source).name == "link.csv" for fault in faults)


def test_folders_without_their_tables(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no such folder"):
        read_gmns_network(tmp_path / "ghost", METRIC)
    with pytest.raises(InputError) as raised:
        read_gmns_network(tmp_path, METRIC)
    assert [Path(fault.source).name for fault in raised.value.faults] == ["node.csv", "link.csv"]


def test_a_file_with_a_million_wrong_cells_gives_a_message_one_can_read(tmp_path: Path) -> None:
    rows = [f"{number},1,2,1,x,y,z,w" for number in range(20_000)]
    faults = faults_of(tmp_path, link=[LINKS[0], *rows])
    assert len(faults) <= 101
    assert "more faults of the same kinds" in faults[-1].what


def test_rows_of_cells_with_newlines_keep_their_line_numbers(tmp_path: Path) -> None:
    rows = [f"{LINKS[0]},name", f'{LINKS[1]},"two\nlines"', f"{LINKS[2]},", "c,3,7,1,1,72,1,,"]
    (fault,) = faults_of(tmp_path, link=rows)
    assert (fault.line, fault.value) == (5, "7")


TABLES = {
    "node": "\n".join(placed(NODES)),
    "link": "\n".join(FULL),
    "movement": "\n".join(MOVEMENTS),
    "demand": "o_zone_id,d_zone_id,volume\n1,2,3.5\n3,1,2",
    "config": "long_length,speed,crs\nm,km/h,32632",
}
PIECES = ["", ",", "\n", '"', "nan", "inf", "1e999999999", "-1e-999999999", "-1", "9" * 90, "\r"]
PIECES += ["LINESTRING (0 0, 1 1)", "\x00", "\u2028", "é", "=1+1", "a-reverse", "  "]


@settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_whatever_stands_in_the_files_only_faults_come_out(
    tmp_path: Path, data: st.DataObject
) -> None:
    texts = dict(TABLES)
    for _ in range(data.draw(st.integers(1, 4))):
        name = data.draw(st.sampled_from(sorted(texts)))
        text = texts[name]
        begin = data.draw(st.integers(0, len(text)))
        end = min(len(text), begin + data.draw(st.integers(0, 6)))
        piece = data.draw(st.one_of(st.sampled_from(PIECES), st.text(max_size=5)))
        texts[name] = text[:begin] + piece + text[end:]
    folder_of(
        tmp_path,
        **{name: text.encode("utf-8", "surrogatepass") for name, text in texts.items()},
    )
    with suppress(InputError):
        network = read_gmns_network(tmp_path, GmnsOptions(length_check="warn"))
        read_gmns_demand(tmp_path, network, TripsOptions(3600.0))
