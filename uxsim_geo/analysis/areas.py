"""Parts of a network, as figures are wanted of them: by polygons, by zones, by nodes.

An area is a name with link_ids, or with node_ids: a mapping of those is what the functions here
make and take. Areas may overlap, and need not cover the network.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import pandas as pd

from uxsim_geo.analysis.groups import Groups
from uxsim_geo.analysis.network_states import lane_lengths, states_of_part
from uxsim_geo.analysis.od import od_of_groups
from uxsim_geo.analysis.state_grid import StateGrid
from uxsim_geo.analysis.subsets import named_rows, node_rows
from uxsim_geo.analysis.trips import trip_summary
from uxsim_geo.analysis.types import Booleans
from uxsim_geo.demand.loading import zone_nodes
from uxsim_geo.errors import Faults, InputError
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result

if TYPE_CHECKING:
    import geopandas as gpd

#: name of each area → its link_ids or node_ids
Areas = Mapping[str, Iterable[str]]

PARTS = ("touching", "inside")


def zone_areas(network: Network) -> dict[str, list[str]]:
    """The node_ids at which trips of each zone start or end, by zone, in the order of the nodes."""
    ends = [
        zone_nodes(network, end).set_axis(["zone", "node"], axis=1)
        for end in ("origin", "destination")
    ]
    pairs = pd.concat(ends).drop_duplicates()
    rows = pd.Index(network.nodes["node_id"].astype(str)).get_indexer(pd.Index(pairs["node"]))
    pairs = pairs.assign(row=rows).sort_values("row", kind="stable")
    return {str(zone): own["node"].tolist() for zone, own in pairs.groupby("zone", sort=False)}


def nodes_in_polygons(
    network: Network, polygons: gpd.GeoDataFrame, name: str
) -> dict[str, list[str]]:
    """The node_ids within or on each of some polygons, by their column ``name``.

    Polygons of one name are one area. Raises :class:`uxsim_geo.errors.InputError` if the network
    has no coordinates, if ``polygons`` have no such column, a row without a name or without a valid
    polygon, or a CRS that the network's does not go with.
    """
    placed = _placed(network, polygons, name)
    return _within(placed, network.nodes, "node_id", "intersects")


def links_in_polygons(
    network: Network,
    polygons: gpd.GeoDataFrame,
    name: str,
    *,
    part: Literal["touching", "inside"] = "inside",
) -> dict[str, list[str]]:
    """The link_ids that lie inside of (or touch) each of some polygons, by their column ``name``.

    Errors as of :func:`nodes_in_polygons`, and for another ``part``.
    """
    if part not in PARTS:
        faults = Faults()
        faults.add(f"must be {' or '.join(PARTS)}", column="part", value=part)
        faults.raise_if_any()
    placed = _placed(network, polygons, name)
    predicate = "covers" if part == "inside" else "intersects"
    return _within(placed, network.links, "link_id", predicate)


def links_of_nodes(network: Network, areas: Areas, *, border: bool = True) -> dict[str, list[str]]:
    """The link_ids with one end (``border``: False: both ends) at the nodes of each area.

    Raises :class:`uxsim_geo.errors.InputError` for an area that is empty or names a node that is
    not there.
    """
    links = network.links
    ends = [links[name].astype(str) for name in ("from_node_id", "to_node_id")]
    found = {}
    for name, rows in _rows(areas, network.nodes["node_id"]).items():
        own = network.nodes["node_id"].astype(str).iloc[rows]
        start, end = (column.isin(own) for column in ends)
        found[name] = links.loc[start | end if border else start & end, "link_id"].astype(str)
    return {name: ids.tolist() for name, ids in found.items()}


def area_states(states: pd.DataFrame, network: Network, areas: Areas) -> pd.DataFrame:
    """Flow, density and speed of areas in every time bin: a fundamental diagram for each.

    ``states`` is what :func:`uxsim_geo.analysis.link_states.link_times` returns, ``areas`` names
    links of it. One row an area and bin, areas in the order given: area (categorical), links
    (their number), and the columns of
    :func:`uxsim_geo.analysis.network_states.network_states`.

    Raises :class:`uxsim_geo.errors.InputError` for an area that is empty or names a link that is
    not among the states, or for states that are not a full grid of links and bins.
    """
    grid = StateGrid.of(states)
    rows = _rows(areas, grid.link_ids)
    lanes_m = lane_lengths(grid, network)
    tables = [states_of_part(grid, lanes_m, part) for part in rows.values()]
    table = pd.concat(tables, ignore_index=True)
    area = np.repeat(np.arange(len(rows)), len(grid.begin))
    named = pd.Categorical.from_codes(area, categories=pd.Index(list(rows)))
    table.insert(0, "area", pd.Series(named))
    table.insert(1, "links", np.repeat([len(part) for part in rows.values()], len(grid.begin)))
    return table


def area_pairs(result: Result, network: Network, areas: Areas) -> pd.DataFrame:
    """Trips between areas: one row a pair that has any, in the order given.

    ``areas`` names nodes; a trip between nodes of several areas counts for each pair of them.
    Columns: origin_area, destination_area (categorical) and those of
    :func:`uxsim_geo.analysis.od.od_table` from vehicles_demanded on.

    Raises :class:`uxsim_geo.errors.InputError` for an area that is empty or names a node that is
    not there, or if the result is of another network.
    """
    rows = _rows(areas, network.nodes["node_id"])
    trips = trip_summary(result, network)
    origin, destination = (
        _memberships(node_rows(result, network, end), rows) for end in ("origin", "destination")
    )
    trip, start = np.nonzero(origin)
    number, end = np.nonzero(destination[trip])
    trip, start = trip[number], start[number]
    groups = Groups.of(start, end)
    names: dict[str, Any] = {
        f"{name}_area": pd.Categorical.from_codes(key, categories=pd.Index(list(rows)))
        for name, key in zip(("origin", "destination"), groups.keys, strict=True)
    }
    figures = od_of_groups(trips.iloc[trip], groups, result.settings.duration)
    return pd.DataFrame(names | figures)


def _memberships(at: np.ndarray, areas: dict[str, np.ndarray]) -> Booleans:
    """Whether each trip's node is in each area; shape (trips, areas)."""
    inside = [np.isin(at, rows) for rows in areas.values()]
    return np.stack(inside, axis=1)


def _rows(areas: Areas, ids: pd.Series | pd.Index[str]) -> dict[str, np.ndarray]:
    """Rows of the elements of every area; raises with all that is not known."""
    faults = Faults()
    if not areas:
        faults.add("is empty: name one at least", column="areas")
    known, rows = pd.Index(ids.astype(str)), {}
    for name, members in areas.items():
        try:
            rows[str(name)] = named_rows(members, known, f"areas[{name}]")
        except InputError as error:
            faults.found += error.faults
    faults.raise_if_any()
    return rows


def _placed(network: Network, polygons: gpd.GeoDataFrame, name: str) -> dict[str, Any]:
    """The area of every name in the CRS of the network.

    Its polygons are dissolved: what lies across the seam of two of them lies inside.
    """
    faults = Faults("polygons")
    if "geometry" not in network.links.columns or "geometry" not in network.nodes.columns:
        faults.add("the network has no coordinates: there is nothing to find inside of polygons")
    if name not in polygons.columns:
        known = ", ".join(str(column) for column in polygons.columns)
        faults.add(f"there is no such column; there are {known}", column=name)
    else:
        for row in np.flatnonzero(polygons[name].isna()):
            faults.add(f"row {row}: has no name", column=name)
    _check_shapes(polygons, faults)
    crs, own = getattr(network.links, "crs", None), getattr(polygons, "crs", None)
    if (own is None) != (crs is None):
        lacking = "the polygons have" if own is None else "the network has"
        faults.add(f"{lacking} no CRS, so that the two cannot be laid on one another")
    faults.raise_if_any()
    placed = polygons if crs is None else polygons.to_crs(crs)
    return _dissolved(placed.geometry, placed[name].astype(str).to_numpy())


def _dissolved(shapes: gpd.GeoSeries, names: np.ndarray) -> dict[str, Any]:
    """One shape a name, in the order in which they come."""
    import shapely

    by_name = pd.Series(shapes.to_numpy(), dtype=object).groupby(names, sort=False)
    return {str(name): shapely.union_all(own.to_numpy()) for name, own in by_name}


def _check_shapes(polygons: gpd.GeoDataFrame, faults: Faults) -> None:
    """Note every row that has no valid polygon."""
    import shapely

    shapes = getattr(polygons, "geometry", None)
    if shapes is None:
        faults.add("have no geometry: give a layer of polygons")
        return
    for row, shape in enumerate(shapes):
        if shape is None or shape.is_empty:
            faults.add(f"row {row}: has no geometry", column="geometry")
        elif shape.geom_type not in ("Polygon", "MultiPolygon"):
            faults.add(f"row {row}: must be a polygon", column="geometry", value=shape.geom_type)
        elif not shape.is_valid:
            reason = shapely.is_valid_reason(shape)
            faults.add(f"row {row}: is no valid polygon ({reason}); mend it", column="geometry")


def _within(
    areas: dict[str, Any], table: pd.DataFrame, id_column: str, predicate: str
) -> dict[str, list[str]]:
    """Ids of the elements that lie so to the areas; none: an empty list."""
    import shapely

    tree = shapely.STRtree(np.asarray(table["geometry"]))
    area, element = tree.query(np.array(list(areas.values()), object), predicate=predicate)
    ids = table[id_column].astype(str).to_numpy()
    return {
        name: ids[np.sort(element[area == number])].tolist() for number, name in enumerate(areas)
    }
