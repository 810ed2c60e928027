"""Demand between zones, under the names that occur; faults with their places."""

from __future__ import annotations

from pathlib import Path

import pytest
from gmns_files import METRIC, folder_of, placed

from uxsim_geo.demand.check import check_demand
from uxsim_geo.demand.demand import Demand
from uxsim_geo.demand.gmns import read_gmns_demand
from uxsim_geo.demand.profile import TripsOptions
from uxsim_geo.errors import InputError
from uxsim_geo.network.gmns import read_gmns_network
from uxsim_geo.network.network import Network

ZONED = placed(["node_id,x_coord,y_coord,zone_id", "1,0,0,1", "2,1000,0,3", "3,1000,500,3"])
HOUR = TripsOptions(3600.0)


def network_of(folder: Path, *demand: str) -> Network:
    return read_gmns_network(folder_of(folder, node=ZONED, demand=list(demand)), METRIC)


def rows(demand: Demand) -> list[list[object]]:
    return demand.table.to_numpy().tolist()


@pytest.mark.parametrize(
    "header",
    ["o_zone_id,d_zone_id,volume", "orig_taz,dest_taz,total", "from_zone_id,to_zone_id,trips"],
)
def test_trips_start_and_end_at_all_nodes_of_their_zones(tmp_path: Path, header: str) -> None:
    network = network_of(tmp_path, header, "1,3,10", "3,1,", "3,3,5")
    demand = read_gmns_demand(tmp_path, network, HOUR)
    check_demand(demand, network)
    assert rows(demand) == [["1", "2", 0.0, 3600.0, 5.0], ["1", "3", 0.0, 3600.0, 5.0]]
    assert demand.notes["topic"].tolist() == ["intrazonal trips"]


def test_trips_may_start_and_end_at_the_node_of_the_zones_name(tmp_path: Path) -> None:
    network = network_of(tmp_path, "o_zone_id,d_zone_id,volume", "1,3,10")
    demand = read_gmns_demand(tmp_path, network, HOUR, zone_nodes="own")
    assert rows(demand) == [["1", "3", 0.0, 3600.0, 10.0]]


def test_unknown_zones_are_faults_or_left_out(tmp_path: Path) -> None:
    network = network_of(tmp_path, "o_zone_id,d_zone_id,volume", "1,9,10", "1,3,2", "8,3,4")
    with pytest.raises(InputError) as raised:
        read_gmns_demand(tmp_path, network, HOUR)
    assert [(fault.line, fault.value) for fault in raised.value.faults] == [(4, "8"), (2, "9")]
    demand = read_gmns_demand(tmp_path, network, HOUR, unknown_zones="drop")
    assert demand.table["vehicles"].sum() == 2
    assert demand.notes["value"].tolist() == ["14.0"]


def test_all_faults_of_a_demand_at_once(tmp_path: Path) -> None:
    network = network_of(tmp_path, "o_zone_id,d_zone_id,volume", "1,,10", "1,3,-2", "3,1,many")
    with pytest.raises(InputError) as raised:
        read_gmns_demand(tmp_path, network)
    found = [(fault.line, fault.column, fault.value) for fault in raised.value.faults]
    assert found[:3] == [
        (2, "d_zone_id", None),
        (4, "volume", "many"),
        (3, "volume", "-2"),
    ]
    assert "state the period" in raised.value.faults[3].what


@pytest.mark.parametrize(
    ("header", "said"),
    [
        ("a,b,c", "must have one of o_zone_id"),
        ("o_zone_id,orig_taz,volume", "must have only one of o_zone_id, orig_taz"),
    ],
)
def test_tables_without_zones_say_which_columns_they_need(
    tmp_path: Path, header: str, said: str
) -> None:
    network = network_of(tmp_path, header, "1,3,2")
    with pytest.raises(InputError, match=said):
        read_gmns_demand(tmp_path, network, HOUR)


def test_rows_between_nodes_are_checked_too(tmp_path: Path) -> None:
    header = "o_zone_id,d_zone_id,volume,o_node_id,d_node_id,start_s,end_s"
    network = network_of(tmp_path, header, ",,5,1,9,0,10", ",,,1,2,0,x")
    with pytest.raises(InputError) as raised:
        read_gmns_demand(tmp_path, network)
    found = {(fault.line, fault.column, fault.value) for fault in raised.value.faults}
    assert found == {(2, "d_node_id", "9"), (3, "volume", None), (3, "end_s", "x")}
