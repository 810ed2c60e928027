"""Overrides: what a table says replaces what the source says, and every slip in it is told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from tntp_files import net, row, write

from uxsim_geo.errors import InputError
from uxsim_geo.network.network import Network
from uxsim_geo.network.overrides import apply_overrides
from uxsim_geo.network.tntp import read_tntp_network
from uxsim_geo.network.tntp_options import TntpOptions

UNITS = TntpOptions(length_unit="km", time_unit="min", capacity_unit="veh/h")


@pytest.fixture
def network(tmp_path: Path) -> Network:
    text = net([row(1, 2, time=0.1), row(2, 3), row(3, 1)])
    return read_tntp_network(write(tmp_path, "net.tntp", text), UNITS)


def test_filled_cells_replace_and_empty_ones_leave(tmp_path: Path, network: Network) -> None:
    table = "name,free_speed_kmh,lanes,link_id,capacity_vph\nBroad Way,36,,2-3,720\n,,3,1-2,\n"
    links = apply_overrides(network, write(tmp_path, "over.csv", table)).links
    assert links["free_speed"].to_numpy() == pytest.approx([40.0, 10.0, 1000 / 60])
    assert links["lanes"].tolist() == [3, 1, 1]
    assert links["capacity"].to_numpy() == pytest.approx([0.5, 0.2, 0.5])
    assert links["name"].tolist()[1] == "Broad Way"
    assert links["name"].isna().tolist() == [True, False, True]
    assert links["lanes_source"].tolist() == ["given", "assumed", "assumed"]
    assert links["free_speed_source"].tolist() == ["assumed", "given", "given"]
    assert network.links["lanes"].tolist() == [1, 1, 1]


@pytest.mark.parametrize(
    ("name", "text", "column", "expected"),
    [
        ("length_km", "1.5", "length", 1500.0),
        ("length_ft", "1000", "length", 304.8),
        ("length_mi", "2", "length", 3218.688),
        ("length", "12", "length", 12.0),
        ("free_speed_mph", "30", "free_speed", 13.4112),
        ("free_speed_m_s", "9", "free_speed", 9.0),
        ("jam_density_vpkm", "150", "jam_density", 0.15),
        ("capacity", "0.75", "capacity", 0.75),
        ("merge_priority", "2", "merge_priority", 2.0),
        ("lanes", "1.5", "lanes", 1.5),
    ],
)
def test_units_stand_in_the_names(
    tmp_path: Path, network: Network, name: str, text: str, column: str, expected: float
) -> None:
    path = write(tmp_path, "over.csv", f"link_id,{name}\n3-1,{text}\n")
    assert apply_overrides(network, path).links[column].iloc[2] == pytest.approx(expected)


def test_a_geopackage_does_as_well(tmp_path: Path, network: Network) -> None:
    import pyogrio

    path = tmp_path / "over.gpkg"
    table = pd.DataFrame({"link_id": ["2-3", "1-2"], "lanes": [2, 4], "length": [np.nan, 70.5]})
    pyogrio.write_dataframe(table, path, layer="overrides")
    links = apply_overrides(network, path).links
    assert links["lanes"].tolist() == [4, 2, 1]
    assert links["length"].tolist() == [70.5, 1000.0, 1000.0]


def test_all_slips_come_at_once(tmp_path: Path, network: Network) -> None:
    path = write(
        tmp_path,
        "over.csv",
        "link_id,free_sped,length,length_km,lanes\n"
        "1-2,1,1,,x\n9-9,,,,\n1-2,,,,\n,,,,1\n2-3,,-4,,\n3-1,,,inf,\n",
    )
    with pytest.raises(InputError) as raised:
        apply_overrides(network, path)
    told = str(raised.value).replace(str(path), "")
    for part in (
        "column free_sped: is no attribute of links that can be set; did you mean free_speed?",
        "column length_km: sets length, as length does",
        ":3, column link_id: the network has no such link",
        ":4, column link_id: the link has a row above: keep one (found '1-2')",
        ":5, column link_id: the row names no link",
        ":2, column lanes: must be a finite number above 0, or empty (found 'x')",
        ":6, column length: must be a finite number above 0, or empty (found '-4')",
        ":7, column length_km: must be a finite number above 0, or empty (found 'inf')",
    ):
        assert part in told
    assert len(raised.value.faults) == 8


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("", "is empty"),
        ("a,b\n1,2\n", "lacks the column link_id"),
        ("link_id;lanes\n1-2;2\n", "separate the columns by commas"),
        (",,\n", "is empty"),
        ("link_id,lanes\n1-2\n", "1 values under 2 names"),
        ("link_id,lanes,lanes\n1-2,1,2\n", "more than once"),
        ('link_id,lanes\n"1-2,1\n', "is no table of comma-separated values"),
    ],
)
def test_tables_that_are_none(tmp_path: Path, network: Network, text: str, what: str) -> None:
    with pytest.raises(InputError, match=what):
        apply_overrides(network, write(tmp_path, "over.csv", text))


def test_a_geopackage_that_is_none(tmp_path: Path, network: Network) -> None:
    with pytest.raises(InputError, match="cannot be read as a table"):
        apply_overrides(network, write(tmp_path, "over.gpkg", "no database"))
    with pytest.raises(InputError, match="no such file"):
        apply_overrides(network, tmp_path / "nowhere.gpkg")


def test_notes_on_a_column_that_every_link_has_anew_are_dropped(tmp_path: Path) -> None:
    text = net([row(1, 2), row(2, 3), row(3, 1)])  # length and time are the same numbers
    network = read_tntp_network(write(tmp_path, "net.tntp", text), UNITS)
    some = write(tmp_path, "some.csv", "link_id,free_speed\n1-2,10\n2-3,20\n3-1,\n")
    every = write(tmp_path, "every.csv", "link_id,free_speed\n1-2,10\n2-3,20\n3-1,15\n")
    assert "free speeds equal" in set(apply_overrides(network, some).notes["topic"])
    topics = set(apply_overrides(network, every).notes["topic"])
    assert "free speeds equal" not in topics
    assert {"length copied", "lanes assumed"} <= topics
