"""UXsim's CSV files to tables and back; what has no place in them is told."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from gmns_files import assert_same_network, assert_same_table
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from uxsim_csv import read_uxsim_demand, read_uxsim_network

from uxsim_geo import World
from uxsim_geo.demand.check import check_demand
from uxsim_geo.demand.demand import Demand
from uxsim_geo.demand.uxsim_csv import Written, read_uxsim_csv, write_uxsim_csv
from uxsim_geo.errors import InputError
from uxsim_geo.network.check import check_network
from uxsim_geo.network.network import LINK_COLUMNS, MOVEMENT_COLUMNS, NODE_COLUMNS, Network
from uxsim_geo.network.note_words import note_in_words
from uxsim_geo.network.uxsim_tables import UxsimCsvOptions, inverses

NODES = "name,x,y\na,0,0\nb,1,0.5\n"
LINKS = "name,start,end,length,u,kappa,merge_priority\nab,a,b,500,15,0.1,0.5\nba,b,a,500,20,0.2,1\n"
DEMAND = "orig,dest,start_t,end_t,q\na,b,0,100,0.5\nb,a,50,60,0\n"
NOBODY = Demand(
    pd.DataFrame(columns=["origin", "destination", "start_s", "end_s", "vehicles"]).astype(
        {"start_s": float, "end_s": float, "vehicles": float}
    )
)


def read(
    folder: Path,
    nodes: str = NODES,
    links: str = LINKS,
    demand: str = DEMAND,
    options: UxsimCsvOptions | None = None,
) -> tuple[Network, Demand]:
    paths = []
    for name, text in (("nodes", nodes), ("links", links), ("demand", demand)):
        paths.append(folder / f"{name}.csv")
        paths[-1].write_text(text, encoding="utf-8")
    return read_uxsim_csv(*paths, options)


def read_back(written: Written, crs: str = "none") -> tuple[Network, Demand]:
    return read_uxsim_csv(*written.paths, UxsimCsvOptions(crs))


def test_rows_become_tables(tmp_path: Path) -> None:
    network, demand = read(tmp_path)
    check_network(network)
    check_demand(demand, network)
    assert tuple(network.nodes.columns) == (*NODE_COLUMNS, "geometry")
    assert tuple(network.links.columns) == (*LINK_COLUMNS, "geometry")
    assert network.links.crs is None
    assert network.nodes.geometry.tolist() == [shapely.Point(0, 0), shapely.Point(1, 0.5)]
    assert network.links["geometry"][1].wkt == "LINESTRING (1 0.5, 0 0)"
    assert demand.table.to_numpy().tolist() == [["a", "b", 0.0, 100.0, 50.0]]
    assert demand.notes["topic"].tolist() == ["empty rows"]
    assert network.notes["topic"].tolist() == ["no CRS", "lanes assumed"]


def test_the_jam_density_of_the_file_is_that_of_all_lanes(tmp_path: Path) -> None:
    links = "name,start,end,length,u,kappa,number_of_lanes,capacity_out,capacity_in\n"
    links += "ab,a,b,500,15,0.3,2,,0.7\nba,b,a,500,,,,1.5,0.9\n"
    network, _ = read(tmp_path, links=links)
    table = network.links
    assert table["jam_density"].tolist() == [0.15, 0.2]
    assert table["lanes"].tolist() == [2, 1]
    assert table["capacity"].tolist() == [0.7, 0.9]
    assert table["free_speed"].tolist() == [15, 20]
    assert table["free_speed_source"].tolist() == ["given", "assumed"]
    assert table["lanes_source"].tolist() == ["given", "assumed"]


def test_the_reference_system_is_that_stated(tmp_path: Path) -> None:
    network, _ = read(tmp_path, options=UxsimCsvOptions("EPSG:4326"))
    assert network.nodes.crs == network.links.crs == "EPSG:4326"
    with pytest.raises(InputError, match="is not a reference system"):
        UxsimCsvOptions("nowhere")


def test_a_network_without_demand(tmp_path: Path) -> None:
    read(tmp_path)
    network, demand = read_uxsim_csv(tmp_path / "nodes.csv", tmp_path / "links.csv", None)
    assert (len(network.links), len(demand.table)) == (2, 0)
    check_demand(demand, network)


def test_all_faults_of_all_files_at_once(tmp_path: Path) -> None:
    with pytest.raises(InputError) as raised:
        read(
            tmp_path,
            nodes="name,x,y\na,inf,0\na,1,1\n",
            links=LINKS + "bc,b,c,0,1,1,1\n",
            demand="orig,dest,start_t,end_t,q\na,a,5,1,x\n",
        )
    found = {(Path(one.source).stem, one.line, one.column) for one in raised.value.faults}
    assert found == {
        ("nodes", 2, "x"),
        ("nodes", 3, "name"),
        ("links", 4, "length"),
        ("demand", 2, "q"),
        ("demand", 2, "dest"),
        ("demand", 2, "end_t"),
    }


def test_links_through_which_nothing_passes_are_refused(tmp_path: Path) -> None:
    links = LINKS.replace("priority\n", "priority,capacity_in\n").replace("0.5\n", "0.5,0\n")
    with pytest.raises(InputError, match=r"links\.csv:2, column capacity_in: must be above 0"):
        read(tmp_path, links=links)


@pytest.mark.parametrize(
    "content", [b"\0" * 50, b"name,x,y\n" + b"9" * 200_000, b'"', b"name,x,y\na,1e400,nan\n"]
)
def test_what_is_no_table_gives_faults_alone(tmp_path: Path, content: bytes) -> None:
    read(tmp_path)
    (tmp_path / "nodes.csv").write_bytes(content)
    with pytest.raises(InputError):
        read_uxsim_csv(*(tmp_path / f"{name}.csv" for name in ("nodes", "links", "demand")))


@pytest.mark.parametrize("name", ["siouxfalls", "uroboros"])
def test_published_scenarios_are_read_as_an_independent_loader_does(
    shared: Path, tmp_path: Path, name: str
) -> None:
    folder = shared / "data" / "uxsim"
    paths = [folder / f"{name}_{part}.csv" for part in ("nodes", "links", "demand")]
    network, demand = read_uxsim_csv(*paths)
    twin, twin_demand = read_uxsim_network(*paths[:2]), read_uxsim_demand(paths[2])
    numbers = ["length", "lanes", "free_speed", "jam_density", "merge_priority"]
    assert (network.links[numbers].to_numpy() == twin.links[numbers].to_numpy()).all()
    places = shapely.get_coordinates(np.asarray(network.nodes.geometry))
    assert (places == twin.nodes[["x", "y"]].to_numpy()).all()
    assert demand.table.to_numpy().tolist() == twin_demand.table.to_numpy().tolist()
    written = write_uxsim_csv(network, demand, tmp_path)
    back, back_demand = read_back(written)
    assert_same_network(back, network)
    assert_same_table(back_demand.table, demand.table)
    assert "not written" not in written.notes["topic"].tolist()


def test_tokyo_in_shift_jis_comes_back_in_utf_8(shared: Path, tmp_path: Path) -> None:
    folder = shared / "data" / "uxsim"
    paths = [folder / f"tokyo_arterial_{part}.csv" for part in ("nodes", "links")]
    network, demand = read_uxsim_csv(*paths, None, UxsimCsvOptions("EPSG:4326"))
    assert (len(network.nodes), len(network.links)) == (220, 522)
    assert network.links["length"].sum() == pytest.approx(612_460, abs=10)
    assert network.links["link_id"].str.contains("通り").any()
    check_network(network)
    written = write_uxsim_csv(network, demand, tmp_path)
    assert "通り" in written.paths[1].read_text(encoding="utf-8")
    back, _ = read_back(written, "EPSG:4326")
    assert_same_network(back, network)


def road(**other: object) -> Network:
    """Two nodes and the link between them, with columns as stated."""
    nodes = pd.DataFrame({"node_id": ["a", "b"]})
    row = {
        "link_id": "ab",
        "from_node_id": "a",
        "to_node_id": "b",
        "length": 100.0,
        "lanes": 1,
        "free_speed": 10.0,
        "jam_density": 0.2,
        "capacity": math.nan,
        "merge_priority": 1.0,
    }
    links = pd.DataFrame([row | other])
    line = shapely.linestrings([[0, 0], [0, 1]])
    return Network(
        gpd.GeoDataFrame(nodes, geometry=shapely.points([[0, 0], [0, 1]])),
        gpd.GeoDataFrame(links, geometry=[line]),
    )


def topics(written: Written) -> list[tuple[str, str]]:
    notes = written.notes[["topic", "note"]].to_numpy().tolist()
    return [(topic, note_in_words(note).split(":")[0]) for topic, note in notes]


def test_what_has_no_place_in_the_files_is_told(tmp_path: Path) -> None:
    network = road(lanes=3, capacity=0.4, road_class="primary", tntp_b=0.15)
    bent = shapely.linestrings([[0, 0], [1, 1], [0, 1]])
    nodes = network.nodes.assign(
        zone_id=["7", None], control=["signal", "none"], through_traffic=[True, False]
    )
    turn = pd.DataFrame([("a", "x", "ab")], columns=list(MOVEMENT_COLUMNS))
    network = Network(
        nodes.set_crs("EPSG:3857"),
        network.links.set_geometry([bent]).set_crs("EPSG:3857"),
        turn,
    )
    table = pd.DataFrame([("a", "b", 0.0, 10.0, 5.0, "slow")])
    table.columns = ["origin", "destination", "start_s", "end_s", "vehicles", "class"]
    assert topics(write_uxsim_csv(network, Demand(table), tmp_path)) == [
        (
            "lanes",
            "stands in the column number_of_lanes, which uxsim-geo reads and UXsim passes over",
        ),
        (
            "capacity",
            "stands in the column capacity_out, which uxsim-geo reads and UXsim passes over",
        ),
        ("not written", "the reference system, EPSG"),
        ("not written", "banned turns"),
        ("not written", "signals"),
        ("not written", "nodes without through traffic"),
        ("not written", "zones"),
        ("not written", "shapes of links that are not straight"),
        ("not written", "the column road_class"),
        ("not written", "the column tntp_b"),
        ("not written", "the column class"),
    ]


def test_lanes_and_capacities_come_back_here_and_in_a_world(tmp_path: Path) -> None:
    network = road(lanes=3, capacity=0.4, jam_density=0.17)
    written = write_uxsim_csv(network, NOBODY, tmp_path)
    back, _ = read_back(written)
    link = back.links.iloc[0]
    assert (link["lanes"], link["capacity"], link["jam_density"]) == (3, 0.4, 0.17)
    world = World(print_mode=0, save_mode=0, random_seed=1)
    world.load_scenario_from_csv(*written.paths)
    (own,) = world.LINKS
    assert (own.number_of_lanes, own.capacity_out) == (3, 0.4)
    assert own.jam_density_per_lane == pytest.approx(0.17)


def test_what_cannot_be_written_is_told_at_once(tmp_path: Path) -> None:
    network = road(free_speed=math.nan, jam_density=0.0, link_id="two\nlines")
    network = replace(network, nodes=pd.DataFrame({"node_id": [" a", "b"]}))
    table = pd.DataFrame([("a", "b", 5.0, 5.0, 5.0)])
    table.columns = ["origin", "destination", "start_s", "end_s", "vehicles"]
    with pytest.raises(InputError) as raised:
        write_uxsim_csv(network, Demand(table), tmp_path / "out")
    assert [(fault.column, fault.value) for fault in raised.value.faults] == [
        ("node_id", " a"),
        (None, None),
        ("link_id", "two\nlines"),
        ("free_speed", None),
        ("jam_density", None),
        (None, None),
    ]
    assert not (tmp_path / "out").exists()


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    density=st.floats(1e-3, 1),
    lanes=st.integers(1, 12),
    vehicles=st.floats(1e-3, 1e6),
    start=st.floats(0, 1e5),
    period=st.floats(1, 1e5),
)
def test_numbers_come_back_to_the_bit_or_it_is_told(
    tmp_path: Path, density: float, lanes: int, vehicles: float, start: float, period: float
) -> None:
    network = road(jam_density=density, lanes=lanes)
    table = pd.DataFrame([("a", "b", start, start + period, vehicles)])
    table.columns = ["origin", "destination", "start_s", "end_s", "vehicles"]
    written = write_uxsim_csv(network, Demand(table), tmp_path)
    back, demand = read_back(written)
    rounded = written.notes[written.notes["topic"] == "rounded"]["note"].str.split().str[0]
    same = {
        "kappa": back.links["jam_density"][0] == density,
        "q": demand.table["vehicles"][0] == vehicles,
    }
    assert {name for name, equal in same.items() if not equal} == set(rounded)
    assert back.links["jam_density"][0] == pytest.approx(density, rel=1e-15)
    assert demand.table["vehicles"][0] == pytest.approx(vehicles, rel=1e-15)


def test_an_inverse_is_found_beside_a_guess_that_rounding_moved() -> None:
    for guess in (math.nextafter(15, 16), math.nextafter(15, 0), 15.0):
        assert inverses([5.0], [guess], lambda total, _: total / 3) == ([15.0], 0)
    found, rounded = inverses([1.0], [5.0], lambda total, _: total)
    assert (found, rounded) == ([5.0], 1)
