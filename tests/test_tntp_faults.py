"""Wrong TNTP files: every fault is told with its place, and nothing but InputError comes out."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tntp_files import HEADER, net, row, trips, write

from uxsim_geo.demand.profile import TripsOptions
from uxsim_geo.demand.tntp import read_tntp_trips
from uxsim_geo.errors import Fault, InputError
from uxsim_geo.network.check import check_network
from uxsim_geo.network.overrides import apply_overrides
from uxsim_geo.network.tntp import read_tntp_network
from uxsim_geo.network.tntp_options import TntpOptions

UNITS = TntpOptions(length_unit="km", time_unit="min", capacity_unit="veh/h", crs="none")
RING = [row(1, 2), row(2, 3), row(3, 1)]
TRIPS = trips("Origin 1\n  2 : 4.0;  3 : 6.0;\n")
NODES = "node\tX\tY\t;\n1\t0\t0\t;\n2\t1\t0\t;\n3\t0\t1\t;\n"


def faults_of(folder: Path, text: str, options: TntpOptions = UNITS) -> list[Fault]:
    with pytest.raises(InputError) as raised:
        read_tntp_network(write(folder, "net.tntp", text), options)
    return raised.value.faults


def trips_faults(folder: Path, text: str) -> list[Fault]:
    network = read_tntp_network(write(folder, "net.tntp", net(RING, zones=3)), UNITS)
    with pytest.raises(InputError) as raised:
        read_tntp_trips(write(folder, "trips.tntp", text), TripsOptions(3600.0), network)
    return raised.value.faults


@pytest.mark.parametrize(
    ("old", "new", "line", "column", "value", "what"),
    [
        ("\t2\t3\t1800", "\t2\t3\t18o0", 10, "capacity", "18o0", "must be a number"),
        ("\t2\t3\t1800", "\t2\t3\t1_800", 10, "capacity", "1_800", "must be a number"),
        ("\t2\t3\t1800", "\t2\t3\t-1800", 10, "capacity", "-1800", "must not be negative"),
        ("\t2\t3\t1800", "\t2\t3\t0", 10, "capacity", "0", "must not be 0"),
        ("\t2\t3\t1800", "\t2\t3\tnan", 10, "capacity", "nan", "is needed here"),
        ("\t2\t3\t1800\t1", "\t2\t3\t1800\t-1", 10, "length", "-1", "must not be negative"),
        ("\t2\t3\t1800\t1", "\t2\t3\t1800\tinf", 10, "length", "inf", "is needed here"),
        ("\t2\t3\t1800\t1", "\t2\t3\t1800\t", 10, "length", "", "is needed here"),
        ("\t2\t3\t", "\t2\t77\t", 10, "to_node_id", "77", "unknown node"),
        ("\t2\t3\t", "\t2.5\t3\t", 10, "init_node", "2.5", "must be a node's number"),
        ("\t2\t3\t", "\t0\t3\t", 10, "init_node", "0", "must be a node's number"),
        ("<NUMBER OF NODES> 3", "<NUMBER OF NODES> x", 2, "<NUMBER OF NODES>", "x", "whole number"),
        ("<NUMBER OF LINKS> 3", "<NUMBER OF LINKS> 4", 4, None, None, "it is cut"),
        ("0.15\t4\t0\t0\t1\t;\n\t3", "0.15\n\t3", 10, None, None, "has 6 values where 10"),
    ],
)
def test_one_fault_has_its_place(
    tmp_path: Path, old: str, new: str, line: int, column: str, value: str, what: str
) -> None:
    text = net(RING)
    assert text.count(old) == 1
    fault = faults_of(tmp_path, text.replace(old, new))[0]
    assert (fault.line, fault.column) == (line, column)
    assert value is None or fault.value == value
    assert what in fault.what


def test_all_faults_of_all_files_come_at_once(tmp_path: Path) -> None:
    text = (
        net(RING).replace("\t2\t3\t1800", "\t2\t3\tx").replace("\t3\t1\t1800\t1", "\t3\t1\t1800\ty")
    )
    path = write(tmp_path, "net.tntp", text)
    nodes = write(tmp_path, "node.tntp", NODES.replace("2\t1\t0", "2\t1\tz"))
    flow = write(tmp_path, "flow.tntp", "From\tTo\tVolume\tCost\n1\t2\tv\t1\n")
    with pytest.raises(InputError) as raised:
        read_tntp_network(path, replace(UNITS, length_unit=None), nodes=nodes, flow=flow)
    told = str(raised.value)
    for part in (
        f"{path}:10, column capacity: must be a number (found 'x')",
        f"{path}:11, column length: must be a number (found 'y')",
        "must be stated as length_unit",
        f"{nodes}:3, column y: must be a number (found 'z')",
        f"{flow}:2, column volume: must be a number (found 'v')",
    ):
        assert part in told


IN_NET = {
    "no number": ("\t2\t3\t1800\t1", "\t2\t3\t1800\t6.x"),
    "below any size": ("\t2\t3\t1800\t1", "\t2\t3\t1800\t-inf"),
    "a letter for a node": ("\t2\t3\t", "\tA\t3\t"),
    "node 0": ("\t2\t3\t", "\t0\t3\t"),
    "an unknown node": ("\t2\t3\t", "\t99\t3\t"),
    "cut in a row": ("\t2\t3\t1800", "\t2\t3\t180"),
}
IN_NODES = {
    "no number": ("2\t1\t0", "2\t-96.7x7\t0"),
    "not finite": ("2\t1\t0", "2\tnan\t0"),
    "cut in the last row": ("3\t0\t1\t;\n", "3\t0"),
    "cut in an earlier row": ("2\t1\t0\t;\n3\t0\t1\t;\n", "2\t1"),
    "the same node again": ("3\t0\t1", "2\t0\t1"),
}


@pytest.mark.parametrize("name", IN_NET)
def test_one_fault_in_a_net_file_has_one_message(tmp_path: Path, name: str) -> None:
    old, new = IN_NET[name]
    before, after = net(RING).split(old)
    text = before + new + ("" if name.startswith("cut") else after)
    path = write(tmp_path, "net.tntp", text)
    with pytest.raises(InputError) as raised:
        read_tntp_network(path, UNITS, nodes=write(tmp_path, "node.tntp", NODES))
    (fault,) = raised.value.faults
    assert fault.line == 10


@pytest.mark.parametrize("name", IN_NODES)
def test_one_fault_in_a_node_file_has_one_message(tmp_path: Path, name: str) -> None:
    old, new = IN_NODES[name]
    assert NODES.count(old) == 1
    nodes = write(tmp_path, "node.tntp", NODES.replace(old, new))
    with pytest.raises(InputError) as raised:
        read_tntp_network(write(tmp_path, "net.tntp", net(RING)), UNITS, nodes=nodes)
    (fault,) = raised.value.faults
    assert fault.line == NODES[: NODES.index(old)].count("\n") + 1


def test_a_latitude_that_is_none_is_told_where_it_stands(tmp_path: Path) -> None:
    path = write(tmp_path, "net.tntp", net(RING))
    nodes = write(tmp_path, "node.tntp", NODES.replace("2\t1\t0", "2\t1\t943"))
    with pytest.raises(InputError) as raised:
        read_tntp_network(path, replace(UNITS, crs="EPSG:4326"), nodes=nodes)
    (fault,) = raised.value.faults
    assert (fault.line, fault.column, fault.value) == (3, "y", "943")


def test_files_taken_for_one_another_give_one_message(tmp_path: Path) -> None:
    blocks = "Origin 1\n 2 : 4.0; 3 : 6.0;\nOrigin 2\n 3 : 1.0;\n"
    (fault,) = faults_of(tmp_path, trips(blocks * 20))
    assert "is a file of trips" in fault.what
    (fault,) = faults_of(tmp_path, net([RING[0], "\t1\t2\t;", "\t1\t2\t3\t;"] * 9))
    assert "is it the right file" in fault.what


@pytest.mark.parametrize("unit", ["length_unit", "time_unit", "capacity_unit"])
def test_a_unit_that_is_needed_is_asked_for(tmp_path: Path, unit: str) -> None:
    (fault,) = faults_of(tmp_path, net(RING), replace(UNITS, **{unit: None}))
    assert f"must be stated as {unit}" in fault.what


def test_a_capacity_per_lane_needs_lanes(tmp_path: Path) -> None:
    (fault,) = faults_of(tmp_path, net(RING), replace(UNITS, capacity_unit="veh/h/lane"))
    assert "no column lanes" in fault.what


def test_a_first_thru_node_above_all_nodes_would_leave_no_way(tmp_path: Path) -> None:
    (fault,) = faults_of(tmp_path, net(RING, first=4))
    assert (fault.line, fault.column, fault.value) == (3, "<FIRST THRU NODE>", "4")
    assert "the highest is 3" in fault.what
    (fault,) = faults_of(tmp_path, net(RING), replace(UNITS, first_thru_node=4))
    assert (fault.column, fault.value) == ("first_thru_node", 4)
    write(tmp_path, "net.tntp", net(RING, first=4))
    read_tntp_network(tmp_path / "net.tntp", replace(UNITS, first_thru_node=3))


def test_options_tell_all_their_faults() -> None:
    with pytest.raises(InputError) as raised:
        TntpOptions(length_unit="furlong", time_unit="-1 h", max_speed=1.0, capacity="guess")  # type: ignore[arg-type]
    assert len(raised.value.faults) == 4
    with pytest.raises(InputError) as raised:
        TripsOptions(None, factor=0.0, start_s=-1.0)
    assert len(raised.value.faults) == 3
    assert "an hour" in str(raised.value)


@pytest.mark.parametrize(
    ("profile", "what"),
    [
        (((60.0, 1.0), (30.0, 1.0), (3600.0, 1.0)), r"pair 2: .* before, 60 s \(found '30.0'\)"),
        (((60.0, 1.0),), r"pair 1: the last time must be the end of the period"),
        (((60.0, 0.0), (3600.0, -1.0)), r"pair 2: the share must be .* \(found '-1.0'\)"),
        (((3600.0, 0.0),), "one share at least"),
    ],
)
def test_profiles_that_make_no_sense(profile: tuple[tuple[float, float], ...], what: str) -> None:
    with pytest.raises(InputError, match=what):
        TripsOptions(3600.0, profile=profile)


def bad_files(folder: Path) -> dict[str, tuple[Path, str]]:
    good = net(RING)
    (folder / "folder").mkdir()
    (folder / "binary").write_bytes(b"\x89PNG\r\n\x1a\n\xff\x00")
    (folder / "zeros").write_bytes(bytes(100))
    return {
        "missing": (folder / "nowhere", "no such file"),
        "a directory": (folder / "folder", "is a folder"),
        "binary": (folder / "binary", r"not a text file in UTF-8 \(byte 0x89\)"),
        "zero bytes": (folder / "zeros", "binary file"),
        "empty": (write(folder, "empty", ""), "is empty"),
        "blank": (write(folder, "blank", " \n\t\n"), "is empty"),
        "another text": (
            write(folder, "prose", "Dear reader,\nno table here.\n"),
            "not a TNTP file",
        ),
        "cut in the tags": (write(folder, "tags", good[:30]), "not a TNTP file"),
        "cut before the rows": (
            write(folder, "head", good[: good.index(HEADER)]),
            "no row of data",
        ),
        "cut in a row": (
            write(folder, "cut", good.rstrip()[:-12]),
            "values where 10 were expected",
        ),
        "cut in the last value": (write(folder, "semi", good.rstrip()[:-1]), "lacks its semicolon"),
        "no header": (
            write(folder, "bare", good.replace(HEADER, "")),
            "lacks the column init_node",
        ),
    }


def test_files_that_are_none_give_one_clear_message(tmp_path: Path) -> None:
    for name, (path, what) in bad_files(tmp_path).items():
        with pytest.raises(InputError, match=what) as raised:
            read_tntp_network(path, UNITS)
        assert str(path) in str(raised.value), name


@pytest.mark.parametrize(
    ("text", "line", "what"),
    [
        (trips("Origin 1\n 2 : 4.0; 9 : 1;\n"), 6, "unknown zone"),
        (trips("Origin 8\n 2 : 4.0;\n"), 6, "unknown zone"),
        (trips("Origin 1\n 2 : four;\n"), 6, "destination : trips"),
        (trips("Origin 1\n 2 4.0;\n"), 6, "destination : trips"),
        (trips("Origin 1\n 2 : -4.0;\n"), 6, "not negative"),
        (trips("Origin 1\n 2 : nan;\n"), 6, "not negative"),
        (trips("Origin 1\n 2 : 4.0; 3 : 6.\n"), 6, "lacks its closing semicolon"),
        (trips("Origin 1\n 2 : 4.0; 2 : 6.0;\n"), 6, "on an earlier line"),
        (trips("Origin x\n 2 : 4.0;\n"), 5, "must be a zone's number"),
        (trips(" 2 : 4.0;\n 3 : 4.0;\nOrigin 1\n"), 5, "before the first Origin"),
        (trips(" 2 : 4.0;\n 3 : 4.0;\n"), None, "is this a trips file"),
        (net(RING), None, "is this a trips file"),
        (trips(""), None, "no Origin line"),
        ("Origin 1\n 2 : 4.0;\n", None, "not a TNTP file"),
    ],
)
def test_faults_in_trips(tmp_path: Path, text: str, line: int | None, what: str) -> None:
    (fault,) = trips_faults(tmp_path, text)
    assert fault.line == line
    assert what in fault.what


PIECES = st.sampled_from(
    ["", "\t", " ", ";", "\n", "~", "<", ">", ":", "-", "0", "9", "1e308", "nan", "inf", "Origin ",
     "\x00", "\r", "é", ",", '"', "1e-320", "99999999999999999999", "_", "NUMBER", "{", "null"]
)  # fmt: skip


@st.composite
def damaged(draw: st.DrawFn, text: str) -> str:
    """The text with a few pieces replaced by others."""
    for _ in range(draw(st.integers(1, 4))):
        begin = draw(st.integers(0, len(text)))
        end = draw(st.integers(begin, min(len(text), begin + 8)))
        text = text[:begin] + draw(PIECES) + text[end:]
    return text


FEW = settings(
    max_examples=60,
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)


@FEW
@given(text=damaged(net([*RING, row(1, 3, 99999, 0, 0)], zones=2, first=2)), keep=st.booleans())
def test_a_damaged_net_file_raises_nothing_else(tmp_path: Path, text: str, keep: bool) -> None:
    options = replace(UNITS, connectors="keep" if keep else "collapse")
    with suppress(InputError):
        check_network(read_tntp_network(write(tmp_path, "net.tntp", text), options))


@FEW
@given(text=damaged(NODES))
def test_a_damaged_node_file_raises_nothing_else(tmp_path: Path, text: str) -> None:
    path, nodes = write(tmp_path, "net.tntp", net(RING)), write(tmp_path, "node.tntp", text)
    with suppress(InputError):
        read_tntp_network(path, UNITS, nodes=nodes)


@FEW
@given(text=damaged(TRIPS))
def test_a_damaged_trips_file_raises_nothing_else(tmp_path: Path, text: str) -> None:
    network = read_tntp_network(write(tmp_path, "net.tntp", net(RING, zones=3)), UNITS)
    with suppress(InputError):
        read_tntp_trips(write(tmp_path, "trips.tntp", text), TripsOptions(3600.0), network)


@FEW
@given(text=damaged("link_id,lanes,free_speed_kmh,name\n1-2,2,50,High Street\n2-3,,30,\n"))
def test_a_damaged_overrides_table_raises_nothing_else(tmp_path: Path, text: str) -> None:
    network = read_tntp_network(write(tmp_path, "net.tntp", net(RING)), UNITS)
    with suppress(InputError):
        apply_overrides(network, write(tmp_path, "overrides.csv", text))
