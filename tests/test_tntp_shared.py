"""Every measured network is read, with counts, totals and units as its inventory says."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from uxsim_geo.demand.check import check_demand
from uxsim_geo.demand.profile import TripsOptions
from uxsim_geo.demand.tntp import read_tntp_trips
from uxsim_geo.errors import InputError
from uxsim_geo.network.check import check_network
from uxsim_geo.network.coordinates import LON_LAT
from uxsim_geo.network.network import Network
from uxsim_geo.network.tntp import read_tntp_network
from uxsim_geo.network.tntp_options import TntpOptions


@dataclass(frozen=True)
class Case:
    """A network's files and units, and what its inventory says of it."""

    net: str
    options: TntpOptions
    nodes_used: int
    links: int
    coordinates: str | None = None
    trips: str | None = None
    total: float = 0.0
    intrazonal: float = 0.0
    flow: str | None = None
    unfit: str | None = None  # why it cannot be simulated as it is


def berlin(place: str, nodes_used: int, links: int, total: float) -> Case:
    folder = f"Berlin-{'-'.join(part.capitalize() for part in place.split('-'))}"
    return Case(
        net=f"{folder}/berlin-{place}_net.tntp",
        options=TntpOptions("m", "3 s", "veh/h", crs="none"),
        nodes_used=nodes_used,
        links=links,
        coordinates=f"{folder}/berlin-{place}_node.tntp",
        trips=f"{folder}/berlin-{place}_trips.tntp",
        total=total,
    )


CASES = {
    "Anaheim": Case(
        net="Anaheim/Anaheim_net.tntp",
        options=TntpOptions("ft", "min", "veh/h"),
        nodes_used=416,
        links=914,
        coordinates="Anaheim/anaheim_nodes.geojson",
        trips="Anaheim/Anaheim_trips.tntp",
        total=104_694.4,
        flow="Anaheim/Anaheim_flow.tntp",
    ),
    "Austin": Case(
        net="Austin/Austin_net.tntp",
        options=TntpOptions("mi", "min", "veh/h"),
        nodes_used=7388,
        links=18961 - 5,  # five stand there twice
    ),
    "Barcelona": Case(
        net="Barcelona/Barcelona_net.tntp",
        options=TntpOptions("0.667 km", "min"),
        nodes_used=930,
        links=2522,
        trips="Barcelona/Barcelona_trips.tntp",
        total=184_679.561,
        flow="Barcelona/Barcelona_flow.tntp",
        unfit="no lanes.*capacity was not measured",
    ),
    "Berlin-Mitte-Center": berlin("mitte-center", 397, 871, 11_481.924),
    "Berlin-Prenzlauerberg-Center": berlin("prenzlauerberg-center", 352, 749, 16_659.92),
    "Braess": Case(
        net="Braess-Example/Braess_net.tntp",
        options=TntpOptions("m", "s"),
        nodes_used=4,
        links=5,
        trips="Braess-Example/Braess_trips.tntp",
        total=6.0,
        unfit="no lanes.*capacity was not measured",
    ),
    "Chicago-Sketch": Case(
        net="Chicago-Sketch/ChicagoSketch_net.tntp",
        options=TntpOptions("mi", "min", "veh/h", crs="EPSG:26771"),
        nodes_used=933,
        links=2950,
        coordinates="Chicago-Sketch/ChicagoSketch_node.tntp",
        trips="Chicago-Sketch/ChicagoSketch_trips.tntp",
        total=1_260_907.44,
        intrazonal=123_414.0,
        flow="Chicago-Sketch/ChicagoSketch_flow.tntp",
    ),
    "chicago-regional": Case(
        net="chicago-regional/ChicagoRegional_net.tntp",
        options=TntpOptions("mi", "min", "veh/h", crs="EPSG:26771"),
        nodes_used=12979,
        links=39018,
        coordinates="chicago-regional/ChicagoRegional_node.tntp",
        flow="chicago-regional/ChicagoRegional_flow.tntp",
    ),
    "Eastern-Massachusetts": Case(
        net="Eastern-Massachusetts/EMA_net.tntp",
        options=TntpOptions("mi", "h", "veh/h"),
        nodes_used=74,
        links=258,
        trips="Eastern-Massachusetts/EMA_trips.tntp",
        total=65_576.375431,
    ),
    "GoldCoast": Case(
        net="GoldCoast/Goldcoast_network_2016_01.tntp",
        options=TntpOptions("km", "min", "veh/h/lane", crs="EPSG:4326"),
        nodes_used=4783,
        links=11140,
        coordinates="GoldCoast/Goldcoast_nodes_2016_01.tntp",
    ),
    "Hessen-Asymmetric": Case(
        net="Hessen-Asymmetric/Hessen-Asym_net.tntp",
        options=TntpOptions("km", "min", "veh/h"),
        nodes_used=4660,
        links=6674,
        trips="Hessen-Asymmetric/Hessen-Asym_trips.tntp",
        total=71_250_600.0,
        unfit="no free_speed.*free_flow_time was not measured",
    ),
    "SiouxFalls": Case(
        net="SiouxFalls/SiouxFalls_net.tntp",
        options=TntpOptions("km", "0.01 h", "veh/h", crs="EPSG:4326"),
        nodes_used=24,
        links=76,
        coordinates="SiouxFalls/SiouxFalls_node.tntp",
        trips="SiouxFalls/SiouxFalls_trips.tntp",
        total=360_600.0,
        flow="SiouxFalls/SiouxFalls_flow.tntp",
    ),
    "Winnipeg": Case(
        net="Winnipeg/Winnipeg_net.tntp",
        options=TntpOptions("0.667 km", "min"),
        nodes_used=1040,
        links=2836,
        trips="Winnipeg/Winnipeg_trips.tntp",
        total=64_784.0,
        intrazonal=9.0,
        flow="Winnipeg/Winnipeg_flow.tntp",
        unfit="no lanes.*capacity was not measured",
    ),
}

NAMES = sorted(CASES)


def read(shared: Path, name: str, **changes: object) -> Network:
    case = CASES[name]
    folder = shared / "data" / "tntp"
    return read_tntp_network(
        folder / case.net,
        replace(case.options, **changes),  # type: ignore[arg-type]
        nodes=folder / case.coordinates if case.coordinates else None,
        flow=folder / case.flow if case.flow else None,
    )


@pytest.mark.parametrize("name", NAMES)
def test_counts_are_those_of_the_inventory(shared: Path, name: str) -> None:
    case = CASES[name]
    network = read(shared, name, connectors="keep")
    assert len(network.nodes) == case.nodes_used
    assert len(network.links) == case.links
    assert (network.links["length"] > 0).all()
    crs = None if case.coordinates is None else case.options.crs or LON_LAT
    assert network.nodes.crs == (None if crs == "none" else crs)
    assert network.links.crs == network.nodes.crs


@pytest.mark.parametrize("connectors", ["keep", "collapse"])
@pytest.mark.parametrize("name", NAMES)
def test_what_can_be_simulated_is_fit_and_the_rest_says_why(
    shared: Path, name: str, connectors: str
) -> None:
    network = read(shared, name, connectors=connectors)
    unfit = CASES[name].unfit
    if unfit is None:
        check_network(network)
        return
    with pytest.raises(InputError, match=unfit):
        check_network(network)
    if "capacity" in unfit:
        check_network(read(shared, name, connectors=connectors, capacity="diagram"))


@pytest.mark.parametrize("connectors", ["keep", "collapse"])
@pytest.mark.parametrize("name", [name for name in NAMES if CASES[name].trips])
def test_no_trip_is_lost_and_every_one_has_a_path(shared: Path, name: str, connectors: str) -> None:
    case = CASES[name]
    network = read(shared, name, connectors=connectors)
    path = shared / "data" / "tntp" / str(case.trips)
    demand = read_tntp_trips(path, TripsOptions(3600.0), network)
    check_demand(demand, network)
    between = case.total - case.intrazonal
    assert demand.table["vehicles"].sum() == pytest.approx(between, rel=1e-9)
    notes = demand.notes.set_index("topic")["value"]
    assert float(notes["trips in file"]) == pytest.approx(case.total, rel=1e-9)
    assert float(notes.get("intrazonal trips", "0")) == case.intrazonal
    assert not {"unreachable", "trips at one node", "trips total"} & set(notes.index)


def test_chicago_sketch_collapses_to_its_streets(shared: Path) -> None:
    network = read(shared, "Chicago-Sketch")
    assert (len(network.nodes), len(network.links)) == (546, 2176)
    assert network.nodes["zone_id"].notna().sum() == 387


def test_unit_findings_hold(shared: Path) -> None:
    berlin_speeds = read(shared, "Berlin-Mitte-Center").links["free_speed"] * 3.6
    assert berlin_speeds.max() <= 80.0 + 1e-6
    sioux = read(shared, "SiouxFalls").links
    assert sioux["length"].sum() == pytest.approx(314_000.0)
    anaheim = read(shared, "Anaheim", connectors="keep").links
    by_column = (anaheim["tntp_speed"] * 0.3048 / 60.0).clip(upper=40.0)  # connectors: 100 mph
    assert np.allclose(anaheim["free_speed"], by_column, rtol=1e-3)
    gold = read(shared, "GoldCoast").links
    expected = gold["tntp_capacity"] * gold["lanes"] / 3600.0
    assert np.allclose(gold["capacity"], expected, rtol=1e-12)


OBJECTIVES = {
    "SiouxFalls": (4_231_335.28710744, 0.0, 0.0),
    "Anaheim": (1_286_032.1711, 0.0, 0.0),
    "Chicago-Sketch": (17_313_018.7387, 0.02, 0.04),
    "chicago-regional": (30_792_611.3864, 0.1, 0.25),
    "Barcelona": (1_265_654.9220, 0.0, 0.0),
    "Winnipeg": (827_911.4946, 0.0, 0.0),
}


@pytest.mark.parametrize("name", OBJECTIVES)
def test_flows_give_the_published_objective(shared: Path, name: str) -> None:
    """Beckmann's ∑ t₀ v (1 + b/(p+1) (v/c)^p), plus weighted tolls and lengths, in file units."""
    objective, toll, distance = OBJECTIVES[name]
    links = read(shared, name, connectors="keep").links
    volume, b, power = links["tntp_volume"], links["tntp_b"], links["tntp_power"]
    load = (volume / links["tntp_capacity"]) ** power
    time = links["tntp_free_flow_time"] * volume * (1 + b / (power + 1) * load)
    fixed = volume * (toll * links["tntp_toll"] + distance * links["tntp_length"])
    assert (time + fixed).sum() == pytest.approx(objective, rel=1e-8)
