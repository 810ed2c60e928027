"""Desire lines as a layer: who wants to go where, and how late they are."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd

from uxsim_geo.analysis.edie import ratio
from uxsim_geo.analysis.groups import Groups
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.export.map_plane import MapPlane, round_below
from uxsim_geo.network.measure import distances
from uxsim_geo.network.network import Network

#: more pairs of nodes than a map can show are put together by cells
MOST_PAIRS = 3000

#: columns of :func:`uxsim_geo.analysis.od.od_table` that add up, by their names here
SUMS = {
    "vehicles_demanded": "demanded_veh",
    "vehicles_departed": "departed_veh",
    "vehicles_completed": "completed_veh",
    "vehicles_unfinished": "unfinished_veh",
    "vehicles_aborted": "aborted_veh",
    "total_delay_so_far_veh_s": "delay_veh_s",
}


class _Ends(NamedTuple):
    """Places where trips start and end.

    of_node (the end of every node), names and points (of every end; x and y in the network's CRS),
    cell (length of a cell's side in units of the map; None: ends are nodes)
    """

    of_node: Integers
    names: pd.Index[str]
    points: Floats
    cell: float | None


def od_lines_layer(network: Network, od: pd.DataFrame, most: int = MOST_PAIRS) -> pd.DataFrame:
    """Straight lines between the ends of trips; columns are those of ``columns.OD_LINES``.

    ``od`` comes from :func:`uxsim_geo.analysis.od.od_table`, by pairs of nodes. More than ``most``
    pairs are put together by square cells of the map, as small as leaves at most so many. Trips
    within an end have a row without a line; all rows together have all vehicles. Without geometry
    in the network it is a table of the pairs of nodes.

    Raises ValueError if ``od`` names nodes that the network lacks.
    """
    known = pd.Index(network.nodes["node_id"].astype(str))
    pair = [known.get_indexer(pd.Index(od[end].astype(str))) for end in ("origin", "destination")]
    if min(rows.min(initial=0) for rows in pair) < 0:
        raise ValueError("the table names nodes that the network lacks")
    origin, destination = (rows.astype(np.int64) for rows in pair)
    spatial = "geometry" in network.nodes.columns
    if not spatial:
        ends = _Ends(np.arange(len(known)), known, np.full((len(known), 2), np.nan), None)
    else:
        ends = _ends(network, known, (origin, destination), most)
    groups = Groups.of(ends.of_node[origin], ends.of_node[destination])
    if spatial:
        weights = np.concatenate([od["vehicles_demanded"].to_numpy(float)] * 2)
        ends = _at_mean_places(network, ends, np.concatenate([origin, destination]), weights)
    return _layer(network, od, groups, ends)


def _ends(
    network: Network, names: pd.Index[str], pair: tuple[Integers, Integers], most: int
) -> _Ends:
    """Nodes, or the smallest cells of 1, 2 or 5 times a power of ten that leave few pairs."""
    plane = MapPlane.of(network)
    nodes = np.arange(len(names))
    if _pairs(nodes, pair) <= most:
        return _Ends(nodes, names, plane.points, None)
    low, high = plane.points.min(axis=0), plane.points.max(axis=0)
    cell = round_below(max(float((high - low).max()), 1e-9) / 200)
    while True:
        places = np.floor(plane.points / cell).astype(np.int64)
        found, of_node = np.unique(places, axis=0, return_inverse=True)
        of_node = of_node.ravel().astype(np.int64)
        if _pairs(of_node, pair) <= most or len(found) == 1:
            break
        cell = _next_round(cell)
    column, row = (found - found.min(axis=0)).T
    texts = [f"cell {x}/{y}" for x, y in zip(column, row, strict=True)]
    return _Ends(of_node, pd.Index(texts), np.empty((0, 2)), cell * (plane.metres_per_unit or 1.0))


def _pairs(of_node: Integers, pair: tuple[Integers, Integers]) -> int:
    return len(Groups.of(of_node[pair[0]], of_node[pair[1]])) if pair[0].size else 0


def _next_round(value: float) -> float:
    """The next of 1, 2 and 5 times a power of ten."""
    return round_below(value * 2.55)


def _at_mean_places(network: Network, ends: _Ends, node: Integers, weights: Floats) -> _Ends:
    """The ends, each at the mean place of the trips that start or end in it."""
    import shapely

    points = shapely.get_coordinates(network.nodes["geometry"].to_numpy())
    end, size = ends.of_node[node], len(ends.names)
    weights = np.maximum(weights, 1e-9)  # pairs without vehicles have a place too
    whole = np.bincount(end, weights, minlength=size).astype(float)
    sums = [np.bincount(end, weights * points[node, axis], size).astype(float) for axis in (0, 1)]
    mean = np.stack([ratio(total, whole) for total in sums], axis=1)
    if ends.cell is None:
        mean = points
    return ends._replace(points=mean)


def _layer(network: Network, od: pd.DataFrame, groups: Groups, ends: _Ends) -> pd.DataFrame:
    crs = getattr(network.nodes, "crs", None)
    start, end = (ends.points[key] for key in groups.keys)
    beeline = (
        distances(start, end, crs)
        if crs is not None and len(start)
        else np.full(len(start), np.nan)
    )
    departed = od["vehicles_departed"].to_numpy(float)
    layer = pd.DataFrame(
        {
            "origin": ends.names[groups.keys[0]],
            "destination": ends.names[groups.keys[1]],
            "cell_m": np.nan if ends.cell is None or crs is None else ends.cell,
            "beeline_m": beeline,
        }
    )
    sums = {new: groups.total(od[old].to_numpy(float)) for old, new in SUMS.items()}
    total_delay = sums.pop("delay_veh_s")
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
