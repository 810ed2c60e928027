"""Desire lines as a layer: who wants to go where, and how late they are."""

from __future__ import annotations

import numpy as np
import pandas as pd

from uxsim_geo.analysis.edie import ratio
from uxsim_geo.analysis.types import Floats
from uxsim_geo.export.trip_ends import TripEnds
from uxsim_geo.network.measure import distances
from uxsim_geo.network.network import Network

#: columns of :func:`uxsim_geo.analysis.od.od_table` that add up, by their names here
SUMS = {
    "vehicles_demanded": "demanded_veh",
    "vehicles_departed": "departed_veh",
    "vehicles_completed": "completed_veh",
    "vehicles_unfinished": "unfinished_veh",
    "vehicles_aborted": "aborted_veh",
    "total_delay_so_far_veh_s": "delay_veh_s",
}


def od_lines_layer(network: Network, od: pd.DataFrame) -> pd.DataFrame:
    """Straight lines between the ends of trips; columns are those of ``columns.OD_LINES``.

    ``od`` comes from :func:`uxsim_geo.analysis.od.od_table`, by pairs of nodes; its rows are put
    together by :class:`uxsim_geo.export.trip_ends.TripEnds`. Trips within an end have a row
    without a line; all rows together have all vehicles. Without geometry in the network it is a
    table.

    Raises ValueError if ``od`` names nodes that the network lacks.
    """
    import shapely

    ends = TripEnds.of(network, od)
    points = np.full((len(network.nodes), 2), np.nan)
    if "geometry" in network.nodes.columns:
        points = shapely.get_coordinates(network.nodes["geometry"].to_numpy())
    return _layer(network, od, ends, ends.points(points))


def least_of_largest(layer: pd.DataFrame, most: int) -> float:
    """Vehicles of the smallest of the largest pairs; 0 if there are no more than ``most``.

    Of equal pairs all or none are among the largest; if all are equal, all are.
    """
    lines = layer["geometry"].notna() if "geometry" in layer else np.zeros(len(layer), bool)
    vehicles = np.sort(layer.loc[lines, "departed_veh"].to_numpy(float))
    if len(vehicles) <= most:
        return 0.0
    larger = vehicles[vehicles > vehicles[-most - 1]]
    return float(larger[0] if larger.size else vehicles[-1])


def _layer(network: Network, od: pd.DataFrame, ends: TripEnds, points: Floats) -> pd.DataFrame:
    crs, groups, names = getattr(network.nodes, "crs", None), ends.pairs(), np.array(ends.names)
    start, end = (points[key] for key in groups.keys)
    beeline = (
        distances(start, end, crs)
        if crs is not None and len(start)
        else np.full(len(start), np.nan)
    )
    departed = od["vehicles_departed"].to_numpy(float)
    layer = pd.DataFrame(
        {
            "origin": names[groups.keys[0]],
            "destination": names[groups.keys[1]],
            "cell_m": ends.side,
            "beeline_m": beeline,
        }
    )
    sums = {new: groups.total(od[old].to_numpy(float)) for old, new in SUMS.items()}
    total_delay = np.maximum(sums.pop("delay_veh_s"), 0.0)  # rounding may leave -1e-12
    layer = layer.assign(
        **sums,
        travel_time_s=groups.mean(od["travel_time_so_far_s"].to_numpy(float), departed),
        delay_s=ratio(total_delay, sums["departed_veh"]),
        delay_veh_s=total_delay,
    )
    if "geometry" not in network.nodes.columns:
        return layer
    return _with_lines(layer, start, end, crs)


def _with_lines(layer: pd.DataFrame, start: Floats, end: Floats, crs: object) -> pd.DataFrame:
    """Lines from start to end; none within one place."""
    import geopandas as gpd
    import shapely

    apart = (start != end).any(axis=1)
    lines = np.full(len(layer), None, dtype=object)
    lines[apart] = shapely.linestrings(np.stack([start, end], axis=1)[apart])
    spatial: pd.DataFrame = gpd.GeoDataFrame(layer, geometry=lines, crs=crs)
    return spatial
