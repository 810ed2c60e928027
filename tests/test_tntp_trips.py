"""TNTP trips: who travels where and when, worked out by hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from tntp_files import net, row, trips, write

from uxsim_geo.demand.check import check_demand
from uxsim_geo.demand.demand import DEMAND_COLUMNS, Demand
from uxsim_geo.demand.profile import TripsOptions
from uxsim_geo.demand.tntp import read_tntp_trips
from uxsim_geo.errors import InputError
from uxsim_geo.network.network import Network
from uxsim_geo.network.tntp import read_tntp_network
from uxsim_geo.network.tntp_options import TntpOptions

UNITS = TntpOptions(length_unit="km", time_unit="min", capacity_unit="veh/h")
HOUR = TripsOptions(3600.0)


@pytest.fixture
def ring(tmp_path: Path) -> Network:
    text = net([row(1, 2), row(2, 3), row(3, 1)], zones=3)
    return read_tntp_network(write(tmp_path, "net.tntp", text), UNITS)


def read(folder: Path, text: str, network: Network, options: TripsOptions = HOUR) -> Demand:
    demand = read_tntp_trips(write(folder, "trips.tntp", text), options, network)
    check_demand(demand, network)
    return demand


def pairs(demand: Demand) -> dict[tuple[str, str], float]:
    table = demand.table
    return dict(
        zip(zip(table["origin"], table["destination"], strict=True), table["vehicles"], strict=True)
    )


def note(demand: Demand, topic: str) -> str:
    (value,) = demand.notes.loc[demand.notes["topic"] == topic, "value"]
    return str(value)


def test_zeros_and_trips_within_a_zone_make_no_demand(tmp_path: Path, ring: Network) -> None:
    text = "Origin 1\n 1 : 2.5; 2 : 3.0;\n 3 : 0.0;\nOrigin 2\n\nOrigin 3\n 1 : 4.5;\n"
    demand = read(tmp_path, trips(text, total="10.0"), ring)
    assert tuple(demand.table.columns) == DEMAND_COLUMNS
    assert pairs(demand) == {("1", "2"): 3.0, ("3", "1"): 4.5}
    assert note(demand, "intrazonal trips") == "2.5"
    assert note(demand, "trips in file") == "10.0"
    assert "trips total" not in set(demand.notes["topic"])


WAYS = {
    "tabs round everything": "Origin \t1 \n2 \t: \t3.0; \t3 \t: \t7.0; \t\n",
    "many blanks": "Origin         1\n    2 :      3.0;    3 :      7.0; \n",
    "one a line": "Origin  1  \n2:3.0;\n3:7.0;\n",
    "windows line ends": "Origin\t1\r\n2 : 3.0;\r\n3 : 7.0;\r\n",
    "comments after the metadata": "~ a table\n~ of: two; items\n\nOrigin 1\n2 : 3; 3 : 7;\n",
    "scientific notation": "Origin 1\n2 : 3.0e+000; 3 : 0.7E1;\n",
    "lower case": "origin 1\n2 : 3.0; 3 : 7.0;\n",
}


@pytest.mark.parametrize("way", WAYS)
def test_every_way_of_writing_gives_the_same_trips(tmp_path: Path, ring: Network, way: str) -> None:
    assert pairs(read(tmp_path, trips(WAYS[way]), ring)) == {("1", "2"): 3.0, ("1", "3"): 7.0}


@pytest.mark.parametrize(
    ("total", "agrees"),
    [
        ("10.0", True),
        ("10", True),
        ("9.95", False),
        ("1.0e+001", True),
        ("10.05", False),
        ("1", False),
        ("-", True),
    ],
)
def test_the_declared_total_is_compared_as_precisely_as_it_is_written(
    tmp_path: Path, ring: Network, total: str, agrees: bool
) -> None:
    demand = read(tmp_path, trips("Origin 1\n 2 : 10.0;\n", total=total), ring)
    assert ("trips total" not in set(demand.notes["topic"])) == agrees


def test_a_file_cut_at_an_origin_block_is_a_fault(tmp_path: Path, ring: Network) -> None:
    whole = "Origin 1\n 2 : 10.0;\nOrigin 2\n 3 : 10.0;\n"
    assert pairs(read(tmp_path, trips(whole, total="20"), ring))[("2", "3")] == 10.0
    cut = whole[: whole.index("Origin 2")]
    with pytest.raises(InputError, match=r":2, .*declared 20, found 10; correct one or remove"):
        read(tmp_path, trips(cut, total="20"), ring)


def test_factor_and_profile_move_all_trips_into_their_slices(tmp_path: Path, ring: Network) -> None:
    options = TripsOptions(
        3600.0, factor=0.5, start_s=600.0, profile=((900.0, 1.0), (1800.0, 0.0), (3600.0, 3.0))
    )
    table = read(tmp_path, trips("Origin 1\n 2 : 16.0; 3 : 8.0;\n"), ring, options).table
    assert table[["start_s", "end_s"]].drop_duplicates().to_numpy().tolist() == [
        [600.0, 1500.0],
        [2400.0, 4200.0],
    ]
    assert table["destination"].tolist() == ["2", "2", "3", "3"]
    assert table["vehicles"].tolist() == [2.0, 6.0, 1.0, 3.0]


#: zone 1 at nodes 4 and 5, zone 2 at 5 and 6, zone 3 at 6; streets from 4 to 5, 5 to 6, 6 to 5
ZONES = [
    *(row(zone, node, 99999, 1, 0) for zone, node in ((1, 4), (1, 5), (2, 5), (2, 6), (3, 6))),
    *(row(node, zone, 99999, 1, 0) for zone, node in ((1, 4), (1, 5), (2, 5), (2, 6), (3, 6))),
    row(4, 5),
    row(5, 6),
    row(6, 5),
]


def test_trips_of_a_zone_use_its_connected_nodes_in_even_parts(tmp_path: Path) -> None:
    path = write(tmp_path, "net.tntp", net(ZONES, zones=3, first=4))
    network = read_tntp_network(path, UNITS)
    text = trips("Origin 1\n 2 : 9.0;\nOrigin 2\n 1 : 4.0; 3 : 5.0;\nOrigin 3\n 1 : 8.0;\n")
    demand = read(tmp_path, text, network)
    assert demand.table[["origin", "destination", "vehicles"]].to_numpy().tolist() == [
        ["4", "5", 3.0],  # zone 1 to 2, but not from node 5 to 5
        ["4", "6", 3.0],
        ["5", "6", 3.0],
        ["6", "5", 4.0],  # zone 2 to 1: nothing leads to node 4
        ["5", "6", 5.0],  # zone 2 to 3
        ["6", "5", 8.0],  # zone 3 to 1
    ]


def test_no_path_through_a_centroid(tmp_path: Path) -> None:
    rows = [row(1, 2), row(2, 1), row(2, 3), row(3, 2), row(4, 1), row(1, 4), row(3, 5), row(5, 3)]
    options = replace(UNITS, connectors="keep", first_thru_node=3)
    network = read_tntp_network(write(tmp_path, "net.tntp", net(rows, zones=2)), options)
    demand = read(tmp_path, trips("Origin 1\n 2 : 7.0;\n"), network)
    assert pairs(demand) == {("1", "2"): 7.0}
    assert "unreachable" not in set(demand.notes["topic"])
    through = read_tntp_network(write(tmp_path, "net.tntp", net(rows, zones=3)), options)
    demand = read(tmp_path, trips("Origin 1\n 3 : 7.0;\n"), through)
    assert note(demand, "unreachable") == "7.0"
    assert demand.table["vehicles"].sum() == 7.0


def test_zones_that_share_their_only_node_have_no_trips(tmp_path: Path) -> None:
    rows = [row(1, 3), row(3, 1), row(2, 3), row(3, 2), row(3, 4), row(4, 3)]
    path = write(tmp_path, "net.tntp", net(rows, zones=2, first=3))
    network = read_tntp_network(path, UNITS)
    demand = read(tmp_path, trips("Origin 1\n 2 : 7.0;\n"), network)
    assert demand.table.empty
    assert note(demand, "trips at one node") == "7.0"


def test_a_network_without_zones_takes_nodes_by_their_ids(tmp_path: Path, ring: Network) -> None:
    plain = replace(ring, nodes=ring.nodes[["node_id"]])
    assert pairs(read(tmp_path, trips("Origin 1\n 2 : 3.0;\n"), plain)) == {("1", "2"): 3.0}


def test_sparse_ids_without_a_first_thru_node(tmp_path: Path) -> None:
    """Zones with ids of their own, known from the trips alone, as Munich has them."""
    rows = [row(2146237932, 1000036), row(1000036, 113707), row(113707, 2146237932)]
    text = net(rows, zones=742).replace("<FIRST THRU NODE> 1\n", "")
    network = read_tntp_network(write(tmp_path, "net.tntp", text), UNITS)
    assert network.nodes["node_id"].tolist() == ["113707", "1000036", "2146237932"]
    text = trips("Origin 2146237932\n 113707 : 3.0;\nOrigin\t1000036\n 113707 : 4.0;\n", zones=284)
    assert pairs(read(tmp_path, text, network)) == {
        ("2146237932", "113707"): 3.0,
        ("1000036", "113707"): 4.0,
    }
