"""The signal table on disk: what is written comes back, and every slip in it is told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from signal_sites import junction

from uxsim_geo.control.signals import Phase, Signal
from uxsim_geo.errors import InputError
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.signal_options import SignalOptions
from uxsim_geo.network.signal_plans import signal_plans
from uxsim_geo.network.signal_rows import SignalRow, table_of
from uxsim_geo.network.signal_table import (
    read_signal_table,
    signals_of_table,
    write_signal_table,
)

HEADER = "node_id,phase,link_id,green_s,all_red_s,offset_s,cycle_s,source\n"


@pytest.fixture
def network() -> Network:
    return junction([0, 90, 180, 270])


def read(folder: Path, network: Network, text: str, notes: Notes | None = None) -> pd.DataFrame:
    path = folder / "signals.csv"
    path.write_text(text, encoding="utf-8")
    return read_signal_table(path, network, notes=notes)


def faults_of(folder: Path, network: Network, text: str) -> list[str]:
    with pytest.raises(InputError) as caught:
        read(folder, network, text)
    place = str(folder / "signals.csv")
    assert all(fault.source == place for fault in caught.value.faults)
    return [str(fault).removeprefix(place) for fault in caught.value.faults]


def test_what_is_written_comes_back(tmp_path: Path, network: Network) -> None:
    plans = signal_plans(network, SignalOptions(all_red=4.1))
    write_signal_table(plans, tmp_path / "signals.csv")
    text = (tmp_path / "signals.csv").read_bytes()
    assert text.startswith(HEADER.encode() + b"X,1,a,26,4.1,0,60.2,assumed\n")
    back = read_signal_table(tmp_path / "signals.csv", network)
    pd.testing.assert_frame_equal(back, plans)
    write_signal_table(back, tmp_path / "again.csv")
    assert (tmp_path / "again.csv").read_bytes() == text


IDS = st.text(
    st.characters(exclude_categories=["Cs", "Cc", "Zl", "Zp"], exclude_characters="\x85"),
    min_size=1,
).filter(lambda text: bool(text.strip()))
SECONDS = st.floats(0.1, 1e4)


@settings(derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    ids=st.lists(IDS, min_size=5, max_size=5, unique_by=str.strip),
    greens=st.lists(SECONDS, min_size=2, max_size=2),
    all_red=st.floats(0, 1e3),
    offset=st.floats(-1e6, 1e6),
)
def test_any_ids_and_times_come_back(
    tmp_path_factory: pytest.TempPathFactory,
    ids: list[str],
    greens: list[float],
    all_red: float,
    offset: float,
) -> None:
    node, *links = ids
    network = junction([0, 90, 180, 270])
    named = dict(zip("abcd", links, strict=True))
    network.links["link_id"] = network.links["link_id"].replace(named)
    network.links["to_node_id"] = network.links["to_node_id"].replace({"X": node})
    network.nodes["node_id"] = network.nodes["node_id"].replace({"X": node})
    cycle = sum(greens) + 2 * all_red
    rows = [
        SignalRow(node, phase, link, greens[phase - 1], all_red, offset, cycle, "assumed")
        for phase, link in ((1, links[0]), (1, links[1]), (2, links[2]), (2, links[3]))
    ]
    path = tmp_path_factory.mktemp("signals") / "table.csv"
    write_signal_table(table_of(rows), path)
    pd.testing.assert_frame_equal(read_signal_table(path, network), table_of(rows))


def test_an_id_over_two_lines_comes_back(tmp_path: Path, network: Network) -> None:
    network.links["link_id"] = network.links["link_id"].replace({"a": "a\n, b"})
    plans = signal_plans(network)
    write_signal_table(plans, tmp_path / "signals.csv")
    pd.testing.assert_frame_equal(read_signal_table(tmp_path / "signals.csv", network), plans)


def test_what_a_row_leaves_out_is_that_of_its_phase_or_node(
    tmp_path: Path, network: Network
) -> None:
    text = (
        "node_id,phase,link_id,green_s,all_red_s,offset_s\n"
        "X,1,a,30,3,\n\nX,1,c,,,7\nX,2,b,20,,\nX,2, d ,,,\n"
    )
    table = read(tmp_path, network, text)
    assert table["green_s"].tolist() == [30, 30, 20, 20]
    assert table["all_red_s"].tolist() == [3, 3, 0, 0]
    assert table["offset_s"].tolist() == [7] * 4
    assert table["cycle_s"].tolist() == [53] * 4
    assert table["source"].tolist() == ["given"] * 4
    assert table["link_id"].tolist() == ["a", "c", "b", "d"]


def test_a_table_without_rows_is_one_without_signals(tmp_path: Path, network: Network) -> None:
    assert read(tmp_path, network, HEADER).empty


def test_links_in_no_phase_are_noted(tmp_path: Path, network: Network) -> None:
    notes = Notes()
    read(tmp_path, network, HEADER + "X,1,a,30,,,,\nX,2,b,30,,,,\n", notes)
    table = notes.table()
    assert table["element_id"].tolist() == ["c", "d"]
    assert set(table["topic"]) == {"link beside the signal"}


def test_every_fault_is_told_at_once_with_its_place(tmp_path: Path, network: Network) -> None:
    rows = [
        "X,1,a,30,4,0,60,assumed",
        "Y,1,a,30,4,0,,assumed",  # 3
        "X,1,zz,30,4,0,60,assumed",
        "X,1,a-back,30,4,0,60,assumed",  # 5
        "X,1,a,30,4,0,60,assumed",
        "X,1,b,31,4,0,60,assumed",  # 7
        "X,1,c,30,5,1,61,guessed",
        "X,3,d,20,4,0,60,assumed",  # 9
        "A,1,a-back,0,-4,0,,",
        "B,1,b-back,,4,0,,",  # 11
        "C,1,,30,4,0,,",
    ]
    assert faults_of(tmp_path, network, HEADER + "\n".join(rows)) == [
        ":3, column node_id: the network has no such node (found 'Y')",
        ":4, column link_id: the network has no such link (found 'zz')",
        ":5, column link_id: the link ends at node A, not at X (found 'a-back')",
        ":8, column source: must be assumed or given (found 'guessed')",
        ":10, column green_s: must be a finite number above 0: a phase without green is no phase "
        "(found '0')",
        ":10, column all_red_s: must be a finite number of 0 or more (found '-4')",
        ":6, column link_id: stands in phase 1 of node X on line 2 too (found 'a')",
        ":9, column phase: phases count from 1 without gaps, but node X has no phase 2 (found '3')",
        ":7, column green_s: phase 1 of node X has 30 on line 2: all its rows must say the same "
        "(found '31')",
        ":8, column all_red_s: phase 1 of node X has 4 on line 2: all its rows must say the same "
        "(found '5')",
        ":8, column offset_s: node X has 0 on line 2: all its rows must say the same (found '1')",
        ":8, column cycle_s: node X has 60 on line 2: all its rows must say the same (found '61')",
        ":2, column cycle_s: greens and all-red times of node X sum to 58: mend them, or leave it "
        "out (found '60')",
        ":11, column green_s: no row gives phase 1 of node B a green (found '')",
        ":12, column node_id: no phase of the node names a link, so the signal would hold nobody "
        "(found 'C')",
    ]


def test_cells_that_are_no_numbers_are_told_once(tmp_path: Path, network: Network) -> None:
    rows = ["X,one,a,30,4,0,60,", "X,1.5,b,3O,nan,inf,1_0,", ",1,a,30,4,0,,", "X,0,c,30,4,0,60,"]
    rows += ["X,2,d,30,4,0,60,"]  # whether it fits cannot be said as long as the others are broken
    assert faults_of(tmp_path, network, HEADER + "\n".join(rows)) == [
        ":2, column phase: must be a whole number from 1 on (found 'one')",
        ":3, column phase: must be a whole number from 1 on (found '1.5')",
        ":3, column green_s: must be a finite number (found '3O')",
        ":3, column all_red_s: must be a finite number (found 'nan')",
        ":3, column offset_s: must be a finite number (found 'inf')",
        ":3, column cycle_s: must be a finite number (found '1_0')",
        ":4, column node_id: the row names no node",
        ":5, column phase: must be a whole number from 1 on (found '0')",
    ]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", ": is empty"),
        ("node_id;phase;link_id;green_s\n", ":1: separate the columns by commas"),
        ("node_id,phase,link_id\n", ":1: lacks the column green_s"),
        ("node_id,phase,link_id,green_s,green_s\n", ":1, column green_s: the column stands there"),
        (HEADER.replace("offset_s", "ofset_s"), "did you mean offset_s?"),
        (HEADER + "X,1,a\n", ":2: the row has 3 values under 8 names (found 'X,1,a')"),
        (HEADER + 'X,1,"a" b,30,4,0,60,\n', ":2: is not a CSV table"),
    ],
)
def test_files_that_are_no_signal_table(
    tmp_path: Path, network: Network, text: str, told: str
) -> None:
    assert told in "\n".join(faults_of(tmp_path, network, text))


def test_a_file_that_is_not_there(tmp_path: Path, network: Network) -> None:
    with pytest.raises(InputError, match="there is no such file"):
        read_signal_table(tmp_path / "nowhere.csv", network)


def test_the_signals_are_those_of_the_table(tmp_path: Path, network: Network) -> None:
    text = HEADER + "X,2,b,20,3,7,,\nX,1,a,30,3,7,,\nX,1,c,30,3,7,,\nX,2,d,20,3,7,,\n"
    phases = (Phase(30.0, ("a", "c")), Phase(20.0, ("b", "d")))
    found = signals_of_table(read(tmp_path, network, text))
    assert found == [Signal("X", phases, offset=7.0, all_red=3.0)]
    assert found[0].cycle == 56


def test_all_red_times_that_differ_are_phases_without_green(
    tmp_path: Path, network: Network
) -> None:
    table = read(tmp_path, network, HEADER + "X,1,a,30,3,,,\nX,2,b,20,5,,,\nX,3,,10,0,,,\n")
    (signal,) = signals_of_table(table)
    assert signal.cycle == table["cycle_s"].iloc[0] == 68
    assert signal.greens() == {"a": [(0, 30)], "b": [(33, 53)]}


def test_a_table_changed_in_python_is_checked_too(network: Network) -> None:
    plans = signal_plans(network)
    longer = plans.assign(green_s=plans["green_s"].where(plans["phase"] == 1, 40))
    with pytest.raises(InputError, match=r"signal table, row:1, column cycle_s: .* sum to 74"):
        signals_of_table(longer)
    mended = longer.assign(cycle_s=np.nan, green_s=longer["green_s"].astype(int))
    (signal,) = signals_of_table(mended)
    assert [phase.duration for phase in signal.phases] == [26, 40]
    wrong = plans.astype({"green_s": object, "phase": object})
    wrong.loc[0, ["green_s", "phase"]] = ["long", 0.5]
    with pytest.raises(InputError) as caught:
        signals_of_table(wrong)
    told = str(caught.value)
    assert "1 row has a phase that is no whole number from 1 on (node_id X)" in told
    assert "1 row has a green_s that is not a number (node_id X)" in told
    with pytest.raises(InputError, match="lacks the column source"):
        signals_of_table(plans.drop(columns="source"))
