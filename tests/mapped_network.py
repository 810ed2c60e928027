"""A small network on a map, with the events of two platoons, for tests of the export."""

from __future__ import annotations

import geopandas as gpd
import numpy as np
import pandas as pd
from newell_link import events_of, network_of, result_of, trips_of
from shapely.geometry import LineString, Point

from uxsim_geo.analysis.link_states import link_times
from uxsim_geo.network.network import Network
from uxsim_geo.settings import Settings

ENDS = (Point(0.0, 0.0), Point(1000.0, 0.0))


def two_way_road(crs: str | None = "EPSG:25832", ways: int = 1) -> Network:
    """Links a → b (even rows) and b → a (odd rows), 1 km of straight road from west to east."""
    there, back = {}, {"from_node_id": "b", "to_node_id": "a"}
    plain = network_of([there, back] * ways)
    lines = [LineString(ENDS), LineString(ENDS[::-1])] * ways
    return Network(
        gpd.GeoDataFrame(plain.nodes, geometry=list(ENDS), crs=crs),
        gpd.GeoDataFrame(plain.links, geometry=lines, crs=crs),
    )


def states_with_a_queue(network: Network) -> pd.DataFrame:
    """10 vehicles enter link 0 and stand at its end; 5 drive through link 1. Two bins of 100 s."""
    events = events_of(network, [(0, 0, 0.0, np.nan), (1, 0, 10.0, np.nan), (2, 1, 10.0, 60.0)])
    return link_times(
        result_of(events, trips_of([{}, {}, {}]), Settings(200.0)), network, bin_s=100.0
    )
