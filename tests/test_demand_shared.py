"""Measured tables: TNTP, GMNS and CSV read alike, and put on their networks without loss."""

from __future__ import annotations

from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
from od_files import values
from shapely.geometry import box

from uxsim_geo.demand.access import Access, access_of_nodes, with_shares
from uxsim_geo.demand.balance import balance
from uxsim_geo.demand.check import check_demand
from uxsim_geo.demand.free_flow import free_flow_times
from uxsim_geo.demand.furness import BalanceOptions
from uxsim_geo.demand.gravity import Impedance, gravity
from uxsim_geo.demand.od_files import read_od
from uxsim_geo.demand.od_loading import load_od
from uxsim_geo.demand.od_table import ends_of, vehicles_of
from uxsim_geo.demand.points import Points, points_to_nodes
from uxsim_geo.demand.profile import TripsOptions
from uxsim_geo.demand.timing import in_time
from uxsim_geo.demand.tntp import read_tntp_od, read_tntp_trips
from uxsim_geo.demand.trip_ends import TripRates, trip_ends
from uxsim_geo.demand.zones import AccessOptions, access_of_zones
from uxsim_geo.errors import InputError
from uxsim_geo.network.network import Network
from uxsim_geo.network.tntp import read_tntp_network
from uxsim_geo.network.tntp_options import TntpOptions

UNITS = {"SiouxFalls": "km", "Chicago-Sketch": "mi", "Anaheim": "ft"}
STEMS = {"SiouxFalls": "SiouxFalls", "Chicago-Sketch": "ChicagoSketch", "Anaheim": "Anaheim"}


def network_of(shared: Path, name: str, nodes: str | None = None) -> Network:
    folder = shared / "data" / "tntp" / name
    options = TntpOptions(length_unit=UNITS[name], time_unit="min", capacity_unit="veh/h")
    path = folder / f"{STEMS[name]}_net.tntp"
    return read_tntp_network(path, options, nodes=folder / nodes if nodes else None)


def trips_of(shared: Path, name: str) -> Path:
    return shared / "data" / "tntp" / name / f"{STEMS[name]}_trips.tntp"


@pytest.mark.parametrize("name", UNITS)
def test_both_ways_through_a_trips_file_agree(shared: Path, name: str) -> None:
    network, path = network_of(shared, name), trips_of(shared, name)
    options = TripsOptions(3600.0, factor=0.7, profile=((1200.0, 1.0), (3600.0, 2.0)))
    direct = read_tntp_trips(path, options, network)
    loaded = load_od(in_time(read_tntp_od(path), options), network)
    check_demand(loaded.demand, network)
    keys = ["origin", "destination", "start_s", "end_s"]
    first, second = (
        demand.table.groupby(keys)["vehicles"].sum() for demand in (direct, loaded.demand)
    )
    assert first.index.equals(second.index)
    assert second.to_numpy() == pytest.approx(first.to_numpy(), rel=1e-12)
    within = dict(zip(direct.notes["topic"], direct.notes["value"], strict=True))
    lost = loaded.dropped.query("reason == 'intrazonal'")["vehicles"].sum()
    assert lost == pytest.approx(float(within.get("intrazonal trips", "0")), rel=1e-12)
    assert set(loaded.dropped["reason"]) <= {"intrazonal"}


def test_sioux_falls_in_csv_is_sioux_falls_in_tntp(shared: Path) -> None:
    csv = read_od(shared / "data" / "tntp" / "SiouxFalls" / "CSV-data" / "SiouxFalls_od.csv")
    tntp = read_tntp_od(trips_of(shared, "SiouxFalls"))
    assert values(csv.table) == values(tntp.table)
    assert csv.table["vehicles"].sum() == 360_600.0


def test_lima_on_its_network(shared: Path) -> None:
    folder = shared / "data" / "gmns" / "lima"
    od = read_od(folder / "demand.csv")
    written = pd.read_csv(folder / "demand.csv")
    assert od.table["vehicles"].sum() == written["total"].sum()
    nodes = pd.read_csv(folder / "node.csv", dtype={"node_id": str, "zone_id": str})
    links = pd.read_csv(folder / "link.csv", dtype=str)
    links = links.assign(length=links["length"].astype(float), free_speed=10.0)
    network = Network(nodes, links)
    timed = in_time(od, TripsOptions(3600.0))
    # zone 441 and others are of the wider area
    with pytest.raises(InputError, match=r"demand\.csv:43, column destination: .*'441'"):
        load_od(timed, network)
    loaded = load_od(timed, network, unknown="drop")
    zones = set(nodes["zone_id"].dropna())
    away = ~(
        written["orig_taz"].astype(str).isin(zones) & written["dest_taz"].astype(str).isin(zones)
    )
    assert loaded.demand.table["vehicles"].sum() + loaded.dropped["vehicles"].sum() == (
        pytest.approx(written["total"].sum())
    )
    own = written.loc[~away & (written["orig_taz"] == written["dest_taz"]), "total"].sum()
    dropped = loaded.dropped.groupby("reason")["vehicles"].sum()
    assert dropped["unknown place"] == written.loc[away, "total"].sum()
    assert dropped["intrazonal"] == own


def test_chicago_balances_to_totals_that_grow(shared: Path) -> None:
    od = read_tntp_od(trips_of(shared, "Chicago-Sketch"))
    ends = ends_of(od.table)
    out, into = ends.totals(vehicles_of(od.table))
    generator = np.random.default_rng(0)
    wanted = pd.DataFrame({"place": ends.names, "out": out, "in": into})
    wanted["out"] *= generator.uniform(0.8, 1.6, len(wanted))
    wanted["in"] *= wanted["out"].sum() / wanted["in"].sum()
    balanced = balance(od, wanted, BalanceOptions(tolerance=1e-9))
    assert balanced.converged
    assert balanced.report["out_after"].to_numpy() == pytest.approx(wanted["out"].to_numpy())
    assert balanced.report["in_after"].to_numpy() == pytest.approx(wanted["in"].to_numpy())


def test_gravity_from_its_own_totals_comes_near_to_chicago(shared: Path) -> None:
    """With totals and times of the network, trips are about as long as in the survey's table."""
    network = network_of(shared, "Chicago-Sketch")
    od = read_tntp_od(trips_of(shared, "Chicago-Sketch"))
    table = od.table[od.table["origin"] != od.table["destination"]]
    ends = ends_of(table)
    out, into = ends.totals(vehicles_of(table))
    zones = pd.DataFrame({"zone": ends.names, "production": out, "attraction": into})
    times = free_flow_times(network, access_of_zones_of(network))
    model = gravity(zones, times, Impedance(decay_per_min=0.12))
    place = times.zones.get_indexer(ends.names)
    seconds = times.seconds[place[ends.origin], place[ends.destination]]
    vehicles = vehicles_of(table)
    known = np.isfinite(seconds)
    mean = float((vehicles * np.nan_to_num(seconds)).sum() / vehicles[known].sum())
    assert model.figures["mean_time_s"] == pytest.approx(mean, rel=0.15)
    matrix = model.od.table.set_index(["origin", "destination"])["vehicles"]
    observed = table.set_index(["origin", "destination"])["vehicles"].reindex(matrix.index)
    assert np.corrcoef(matrix, observed.fillna(0.0))[0, 1] > 0.8


def access_of_zones_of(network: Network) -> Access:
    from uxsim_geo.demand.access import access_of_network

    return access_of_network(network)


def test_anaheim_by_areas_and_by_points(shared: Path) -> None:
    network = network_of(shared, "Anaheim", "anaheim_nodes.geojson")
    assert network.nodes.crs.is_geographic  # type: ignore[union-attr]
    west, south, east, north = network.nodes.total_bounds  # type: ignore[operator]
    xs, ys = np.linspace(west, east, 6), np.linspace(south, north, 5)
    shapes = {
        f"{i}{j}": box(xs[i], ys[j], xs[i + 1], ys[j + 1]) for i in range(5) for j in range(4)
    }
    areas = gpd.GeoDataFrame(
        {"zone": list(shapes)}, geometry=list(shapes.values()), crs="EPSG:4326"
    )
    areas["population"] = np.arange(1000.0, 3000.0, 100.0)
    access = access_of_zones(areas, network, AccessOptions(3, 2000.0, "capacity"))
    assert access.origins.groupby("zone")["share"].sum().to_numpy() == pytest.approx(1.0)
    assert access.origins.groupby("zone").size().max() == 3
    model = gravity(
        trip_ends(areas, TripRates({"population": 0.1}, {"population": 1.0})),
        free_flow_times(network, access),
        Impedance(0.5, 0.1),
    )
    loaded = load_od(in_time(model.od, TripsOptions(3600.0)), network, access)
    check_demand(loaded.demand, network)
    total = loaded.demand.table["vehicles"].sum() + loaded.dropped["vehicles"].sum()
    assert total == pytest.approx(3900.0, rel=1e-4)
    # every node as a point is its own nearest
    xy = network.nodes.geometry  # type: ignore[operator]
    rows = pd.DataFrame({"origin_x": xy.x, "origin_y": xy.y, "vehicles": 1.0})
    rows = rows.assign(destination_x=xy.x, destination_y=xy.y)
    found, _ = points_to_nodes(rows, Points(network, "EPSG:4326", 1.0))
    leaving = network.nodes["node_id"].isin(network.links["from_node_id"])
    same = (found["origin"] == network.nodes["node_id"]).to_numpy()
    assert same[leaving.to_numpy()].mean() > 0.98  # some nodes lie on one another
    assert not with_shares(access_of_nodes(network).origins, np.ones(len(network.nodes))).empty
