"""A road of two directions with a little traffic, as a results file."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
from newell_link import events_of, network_of, result_of, trips_of
from shapely.geometry import LineString, Point

from uxsim_geo.analysis.link_states import link_times
from uxsim_geo.analysis.run_passages import RunPassages
from uxsim_geo.export.geopackage import write_geopackage
from uxsim_geo.export.run_description import RunDescription
from uxsim_geo.export.run_layers import Run, layers_of_run
from uxsim_geo.network.driving_side import DrivingSide
from uxsim_geo.network.network import Network
from uxsim_geo.network.note_geometry import placed
from uxsim_geo.settings import Settings

START = datetime(2024, 3, 1, 7, 0, tzinfo=UTC)

#: SQL, HTML, expressions of QGIS, quotes, umlauts and an emoji
NAMES = [
    'O\'Connell "Straße"; DROP TABLE links;-- <b>🚧</b> & [% 6 * 7 %] %]',
    "Größe < 5 & größer",
]


def two_way_road(crs: str | None, *, geometry: bool = True) -> Network:
    plain = network_of(
        [
            {"link_id": "a'b", "name": NAMES[0], "capacity": 0.5},
            {"link_id": 'ü"2', "name": NAMES[1], "from_node_id": "b", "to_node_id": "a"},
        ]
    )
    notes = pd.DataFrame(
        [["link", "a'b", "length", "warning", 'it\'s "short"', 3.5]],
        columns=["element", "element_id", "topic", "severity", "note", "value"],
    )
    if not geometry:
        return Network(plain.nodes, plain.links, notes=notes)
    ends = [Point(8.0, 49.0), Point(8.01, 49.0)]
    nodes = gpd.GeoDataFrame(plain.nodes, geometry=ends, crs=crs)
    lines = [LineString(ends), LineString(ends[::-1])]
    links = gpd.GeoDataFrame(plain.links, geometry=lines, crs=crs)
    network = Network(nodes, links)
    return replace(network, notes=placed(notes, network))


def run_of(network: Network) -> Run:
    """One platoon drives through in 90 s, the next stays; bins of a minute, the last of 30 s."""
    events = events_of(network, [(0, 0, 5.0, 95.0), (1, 0, 15.0, np.nan)])
    trips = trips_of(
        [
            {"enter_s": 5.0, "arrive_s": 95.0, "distance_m": 1000.0},
            {"enter_s": 15.0, "status": "running", "distance_m": 975.0},
        ]
    )
    result = result_of(events, trips, Settings(150.0))
    states = link_times(result, network, bin_s=60.0)
    return Run(network, result, states, RunPassages(result, network))


def description_of(network: Network, start: datetime = START) -> RunDescription:
    information = {"seed": 7, "title": 'Nüßler\'s "run"'}
    return RunDescription(
        start,
        network.notes,
        information,
        name="small",
        attribution="© <Jürgen> & 'co'",
        provenance={"sources": {"net": {"file": "ü.tntp"}}},
    )


def write(
    path: Path,
    network: Network,
    start: datetime = START,
    side: DrivingSide = "right",
) -> None:
    description = replace(description_of(network, start), driving_side=side)
    write_geopackage(path, layers_of_run(run_of(network), description), description)
