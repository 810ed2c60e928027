"""Measured GMNS folders: each is read, or refused for what is wrong with it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from gmns_files import assert_same_network, assert_same_table

from uxsim_geo.demand.check import check_demand
from uxsim_geo.demand.gmns import read_gmns_demand, write_gmns
from uxsim_geo.demand.profile import TripsOptions
from uxsim_geo.errors import InputError
from uxsim_geo.network.check import check_network
from uxsim_geo.network.gmns import read_gmns_network
from uxsim_geo.network.gmns_options import GmnsOptions
from uxsim_geo.network.gmns_tables import GmnsUnits

LIMA = GmnsOptions(length_unit="ft", speed_unit="mph", crs="EPSG:3735")
CAMBRIDGE = GmnsOptions(length_unit="m", speed_unit="km/h", crs="EPSG:4326")
RAILS = ("rail", "light_rail", "tram")
TEMPE = GmnsOptions(length_unit="mi", speed_unit="mph", crs="EPSG:4326", leave_out=RAILS)
ANAHEIM = replace(CAMBRIDGE, capacity_unit="veh/h")
ARLINGTON = GmnsOptions(length_unit="ft", speed_unit="mph", crs="EPSG:32619")

FOLDERS = {
    "lima": (LIMA, 2232, 6095, 6031),
    "cambridge": (CAMBRIDGE, 1057, 1885, 0),
    "asu_tempe": (TEMPE, 977, 1751, 0),
    "anaheim_gmnsplus": (ANAHEIM, 416, 914, 0),
}


@pytest.mark.parametrize("name", sorted(FOLDERS))
@pytest.mark.parametrize("units", [("m", "km/h"), ("mi", "mph")])
def test_a_measured_folder_is_read_and_comes_back(
    shared: Path, tmp_path: Path, name: str, units: tuple[str, str]
) -> None:
    folder = shared / "data" / "gmns" / name
    options, nodes, links, banned = FOLDERS[name]
    network = read_gmns_network(folder, options)
    found = (len(network.nodes), len(network.links), len(network.movements))
    assert found == (nodes, links, banned)
    check_network(replace(network, movements=network.movements[:0]))
    demand = None
    if (folder / "demand.csv").exists():
        demand = read_gmns_demand(
            folder, network, TripsOptions(3600.0), unknown_zones="drop", zone_nodes="own"
        )
        check_demand(demand, network)
    write_gmns(network, demand, tmp_path, units=GmnsUnits(*units))
    back = read_gmns_network(tmp_path)
    assert_same_network(back, network)
    if demand is not None:
        assert_same_table(read_gmns_demand(tmp_path, back).table, demand.table)


@pytest.mark.parametrize("name", [*sorted(FOLDERS), "arlington_errors"])
def test_no_folder_is_read_without_its_units(shared: Path, name: str) -> None:
    with pytest.raises(InputError) as raised:
        read_gmns_network(shared / "data" / "gmns" / name)
    told = str(raised.value)
    assert "stated as crs" in told
    assert "stated as length_unit" in told
    assert "stated as speed_unit" in told


@pytest.mark.parametrize(
    ("name", "options", "rather"),
    [
        ("lima", replace(LIMA, length_unit="m"), "ft"),
        ("asu_tempe", replace(TEMPE, length_unit="km"), "mi"),
        ("anaheim_gmnsplus", replace(ANAHEIM, length_unit="km"), "m"),
        ("cambridge", replace(CAMBRIDGE, length_unit="ft"), "m"),
    ],
)
def test_the_wrong_unit_is_refused_for_the_right_one(
    shared: Path, name: str, options: GmnsOptions, rather: str
) -> None:
    with pytest.raises(InputError, match=f"the unit is rather {rather};"):
        read_gmns_network(shared / "data" / "gmns" / name, options)


def test_arlington_is_refused_with_all_its_faults(shared: Path) -> None:
    folder = shared / "data" / "gmns" / "arlington_errors"
    with pytest.raises(InputError) as raised:
        read_gmns_network(folder, ARLINGTON)
    faults = raised.value.faults
    assert [(fault.line, fault.column, fault.value) for fault in faults] == [
        (24, "parent_link_id", "NULL"),
        (25, "parent_link_id", "NULL"),
        (26, "parent_link_id", "NULL"),
        (27, "parent_link_id", "NULL"),
        (8, "lanes", None),
        (16, "free_speed", None),
    ]
    assert "15 links without a value (link_id 71, 72, 211" in faults[4].what
    assert "13 links without a value (link_id 211, 221" in faults[5].what


def test_lima_has_the_speeds_and_capacities_of_its_source(shared: Path) -> None:
    network = read_gmns_network(shared / "data" / "gmns" / "lima", LIMA)
    first = network.links.iloc[0]
    assert first["length"] == pytest.approx(277 * 0.3048, abs=1e-12)
    assert first["free_speed"] == pytest.approx(25 * 0.44704, abs=1e-12)
    assert first["capacity"] == 0.5
    centre = network.nodes.to_crs("EPSG:4326").geometry.union_all().centroid
    assert (centre.x, centre.y) == pytest.approx((-84.12, 40.77), abs=0.01)


def test_cambridge_lengths_were_measured_on_a_web_map(shared: Path) -> None:
    network = read_gmns_network(shared / "data" / "gmns" / "cambridge", CAMBRIDGE)
    stretched = network.notes[network.notes["topic"] == "lengths differ"]
    assert float(stretched["value"].iloc[0]) == pytest.approx(1.354, abs=0.002)
