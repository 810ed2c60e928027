"""The Sioux Falls example: its published totals, the dynamic model's rules, UXsim's own tables."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from uxsim_csv import read_uxsim_demand, read_uxsim_network

from uxsim_geo.demand.check import check_demand
from uxsim_geo.demand.demand import Demand
from uxsim_geo.demand.profile import TripsOptions
from uxsim_geo.demand.tntp import read_tntp_trips
from uxsim_geo.network.check import check_network
from uxsim_geo.network.doubts import CONNECTIONS, note_doubts
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.overrides import apply_overrides
from uxsim_geo.network.tntp import read_tntp_network
from uxsim_geo.network.tntp_options import TntpOptions

FOLDER = Path(__file__).resolve().parents[1] / "data" / "sioux_falls"
NET = FOLDER / "sioux_falls_net.tntp"
OPTIONS = TntpOptions(
    length_unit="km", time_unit="0.01 h", capacity_unit="veh/h", crs="EPSG:4326", capacity="diagram"
)


@pytest.fixture(scope="module")
def network() -> Network:
    read = read_tntp_network(NET, OPTIONS, nodes=FOLDER / "sioux_falls_node.tntp")
    return apply_overrides(read, FOLDER / "overrides.csv")


@pytest.fixture(scope="module")
def demand(network: Network) -> Demand:
    options = TripsOptions(period_s=4800, factor=0.104)
    return read_tntp_trips(FOLDER / "sioux_falls_trips.tntp", options, network)


@pytest.fixture(scope="module")
def uxsim(shared: Path) -> Path:
    return shared / "data" / "uxsim"


def test_it_can_be_simulated(network: Network, demand: Demand) -> None:
    check_network(network)
    check_demand(demand, network)
    # the one thing to warn of is the convention that the README tells
    warnings = network.notes[network.notes["severity"] == "warning"]
    assert warnings["topic"].tolist() == ["length copied"]
    assert (demand.notes["severity"] == "info").all()


def test_nothing_in_it_is_doubtful(network: Network) -> None:
    notes = Notes()
    note_doubts(network, notes)
    assert set(notes.table()["topic"]) == {CONNECTIONS}


def test_it_has_the_published_size(network: Network, demand: Demand) -> None:
    assert len(network.nodes) == 24
    assert len(network.links) == 76
    assert network.links["length"].sum() == pytest.approx(314_000)
    assert len(demand.table) == 528
    assert demand.table["vehicles"].sum() == pytest.approx(0.104 * 360_600)


def test_every_road_runs_both_ways_alike(network: Network) -> None:
    links = network.links
    forth = links.set_index(["from_node_id", "to_node_id"])[["length", "free_speed"]]
    back = links.set_index(["to_node_id", "from_node_id"])[["length", "free_speed"]]
    assert np.array_equal(forth, back.loc[list(forth.index)])


def test_speeds_follow_from_the_capacities() -> None:
    by_file = read_tntp_network(NET, replace(OPTIONS, capacity="file"))
    links = apply_overrides(by_file, FOLDER / "overrides.csv").links
    assert links["free_speed"].tolist() == (3 * (1 + links["capacity"] * 3600 // 5000)).tolist()
    assert links["merge_priority"].tolist() == (links["free_speed"] / 3).tolist()
    assert set(links["jam_density"]) == {0.2}
    assert set(links["lanes"]) == {1}


def test_links_are_those_of_uxsim(network: Network, uxsim: Path) -> None:
    tables = uxsim / "siouxfalls_nodes.csv", uxsim / "siouxfalls_links.csv"
    theirs = read_uxsim_network(*tables)
    columns = ["link_id", "from_node_id", "to_node_id"]
    ours = network.links
    assert ours[columns].to_numpy().tolist() == theirs.links[columns].to_numpy().tolist()
    for column in ("length", "free_speed", "jam_density", "merge_priority"):
        assert ours[column].tolist() == pytest.approx(theirs.links[column].tolist()), column
    assert network.nodes["node_id"].tolist() == theirs.nodes["node_id"].tolist()
    places = np.array([(point.x, point.y) for point in network.nodes["geometry"]])
    assert np.allclose(places, theirs.nodes[["x", "y"]], rtol=0, atol=1e-9)


def test_demand_is_that_of_uxsim(demand: Demand, uxsim: Path) -> None:
    # UXsim's tables state veh/s in two rows a pair, to two or three figures
    theirs = read_uxsim_demand(uxsim / "siouxfalls_demand.csv").table
    assert set(zip(theirs["start_s"], theirs["end_s"], strict=True)) == {(0.0, 4800.0)}
    pair = ["origin", "destination"]
    expected = theirs.groupby(pair)["vehicles"].sum()
    found = demand.table.set_index(pair)["vehicles"]
    assert set(found.index) == set(expected.index)
    assert np.allclose(found, expected.loc[list(found.index)], rtol=0.01, atol=0)
    assert found.sum() == pytest.approx(expected.sum(), rel=1e-4)
