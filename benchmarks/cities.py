"""Cases of real networks: Sioux Falls as shipped, the others from files of measured networks.

Those files are no part of this repository; they are looked for in the folder that the variable
UXSIM_GEO_SHARED names, or in ``../shared``.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pandas as pd
from cases import Tables, at_home

from pipeline.config_file import load_config
from pipeline.ingest import read_sources
from uxsim_geo.demand.profile import TripsOptions
from uxsim_geo.demand.tntp import read_tntp_trips
from uxsim_geo.network.largest_part import keep_largest_part
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.osm import read_osm_network
from uxsim_geo.network.osm_options import OsmOptions
from uxsim_geo.network.projection import project
from uxsim_geo.network.tntp import read_tntp_network
from uxsim_geo.network.tntp_options import TntpOptions

REPOSITORY = Path(__file__).resolve().parents[1]
DATA = Path(os.environ.get("UXSIM_GEO_SHARED", REPOSITORY.parent / "shared")) / "data"

TRIP_LENGTH = 10_000.0  # m; mean of the distances that synthetic trips like to cover


def _tables(network: Network, demand: pd.DataFrame) -> Tables:
    shapes = network.nodes.geometry  # a GeoDataFrame, as all readers make
    nodes = pd.DataFrame({"node_id": network.nodes["node_id"], "x": shapes.x, "y": shapes.y})
    return Tables(nodes, pd.DataFrame(network.links), demand, network.movements)


def _chicago(folder: str, stem: str) -> Network:
    files = DATA / "tntp" / folder
    network = read_tntp_network(
        files / f"{stem}_net.tntp",
        TntpOptions("mi", "min", "veh/h", crs="EPSG:26771"),
        nodes=files / f"{stem}_node.tntp",
    )
    return project(network, "EPSG:26916", Notes())


def sioux_falls() -> Tables:
    """The paper's Sioux Falls as the shipped configuration reads it: 37,502 vehicles."""
    network, demand = read_sources(load_config(REPOSITORY / "configs" / "sioux_falls.yaml").ingest)
    return _tables(project(network, None, Notes()), demand.table)


def chicago_sketch() -> Tables:
    """Chicago-Sketch as UXsim's own example has it: 1,079,457 vehicles of 8,406 pairs in an hour.

    Trips are raised by 1/0.85, pairs of no more than 30 left out; lanes carry 0.5 veh/s each (3 on
    motorways) and hold 0.2 veh/m together; free speeds lie between 10 and 40 m/s.
    """
    network = _chicago("Chicago-Sketch", "ChicagoSketch")
    links = network.links
    per_lane = (links["capacity"] / 0.5).astype(int).clip(lower=1)
    lanes = per_lane.where(links["road_class"] != "2", 3)
    links = links.assign(
        length=links["length"].clip(lower=100.0),
        free_speed=links["free_speed"].clip(10.0, 40.0),
        lanes=lanes,
        jam_density=0.2 / lanes,
        capacity=np.nan,
        merge_priority=1.0,
    )
    trips = DATA / "tntp" / "Chicago-Sketch" / "ChicagoSketch_trips.tntp"
    demand = read_tntp_trips(trips, TripsOptions(3600.0, factor=1 / 0.85), network).table
    return _tables(Network(network.nodes, links), demand[demand["vehicles"] > 30.0])


def chicago_regional(vehicles: int = 1_300_000, period: float = 7200.0) -> Tables:
    """Chicago-regional with trips that are drawn, in platoons of five, evenly over a period, s.

    Every zone sends alike; destinations are drawn ∝ exp(−distance / 10 km).
    """
    tables = _tables(_chicago("chicago-regional", "ChicagoRegional"), pd.DataFrame())
    network = _chicago("chicago-regional", "ChicagoRegional")
    zones = tables.nodes[network.nodes["zone_id"].notna().to_numpy()]
    draws = np.random.default_rng(0)
    numbers = np.bincount(draws.integers(0, len(zones), vehicles // 5), minlength=len(zones))
    x, y = zones["x"].to_numpy(), zones["y"].to_numpy()
    ends = []
    for zone, number in enumerate(numbers):
        wish = np.exp(-np.hypot(x - x[zone], y - y[zone]) / TRIP_LENGTH)
        wish[zone] = 0.0
        ends.append(draws.choice(len(zones), number, p=wish / wish.sum()))
    names = zones["node_id"].to_numpy()
    drawn = {"origin": np.repeat(names, numbers), "destination": names[np.concatenate(ends)]}
    demand = pd.DataFrame(drawn).groupby(["origin", "destination"], as_index=False).size()
    demand = demand.assign(start_s=0.0, end_s=period, vehicles=5.0 * demand.pop("size"))
    return Tables(tables.nodes, tables.links, demand)


def chicago_regional_at_home(destinations: int, departure: float) -> Tables:
    """Chicago-regional with nobody on the road, for the time of an update of routes alone."""
    tables = _tables(_chicago("chicago-regional", "ChicagoRegional"), pd.DataFrame())
    return at_home(tables, destinations, departure)


def porto_at_home(destinations: int, departure: float) -> Tables:
    """Porto and its surroundings from OpenStreetMap, with nobody on the road."""
    network = read_osm_network(DATA / "osm" / "porto_portugal.osm.pbf", OsmOptions())
    network = project(keep_largest_part(network, Notes()), None, Notes())
    return at_home(_tables(network, pd.DataFrame()), destinations, departure)
