"""Zones as polygons or points, and the nodes at which their trips start and end."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.demand.access import ENDS, Access, End, with_shares
from uxsim_geo.demand.od_table import add_of_rows, natural_order
from uxsim_geo.demand.points import Plane, node_metres, plane_of, usable_nodes
from uxsim_geo.demand.table_files import ids_of
from uxsim_geo.errors import Faults
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.rows import lacking, numbers
from uxsim_geo.network.vector_files import read_vector_file

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


@dataclass(frozen=True)
class AccessOptions:
    """Which nodes serve a zone.

    nodes_per_zone
        at most so many at each end, those of the greatest weight first and, among equals, those
        nearest to a point in the middle of the zone
    within_m
        m; a zone without a usable node inside takes the nearest around that point, up to so far
    weights
        how the zone's trips are shared among them: ``even``, ``capacity`` (of the links that
        leave the node, or enter it where trips end; veh/s, of links without one the mean per lane
        of the others), or the name of a column of the nodes that holds numbers, 0 or more
    """

    nodes_per_zone: int = 5
    within_m: float = 1000.0
    weights: Literal["even", "capacity"] | str = "even"

    def __post_init__(self) -> None:
        faults = Faults("access of zones")
        if self.nodes_per_zone < 1:
            faults.add("must be 1 or more", column="nodes_per_zone", value=self.nodes_per_zone)
        if not 0 <= self.within_m < math.inf:
            what = "must be a finite number of metres, 0 or more"
            faults.add(what, column="within_m", value=self.within_m)
        faults.raise_if_any()


def read_zones(path: Path, zone_column: str = "zone", *, layer: str | None = None) -> Any:
    """Read zones from a file of areas or points (GeoPackage, GeoJSON, shapefile, GeoParquet).

    Returns a GeoDataFrame with the column ``zone`` (text), all other columns and the geometry.
    Raises :class:`uxsim_geo.errors.InputError` with every fault: no such file or column, zones
    without name or geometry, or named twice, geometry of another kind.
    """
    faults = Faults(str(path))
    table = read_vector_file(path, layer, faults)
    faults.raise_if_any()
    assert table is not None, "else there was a fault"
    if table.geometry.name != "geometry":
        table = table.rename_geometry("geometry")
    if zone_column not in table:
        there = ", ".join(str(name) for name in table.columns)
        faults.add(f"has no such column (columns here: {there})", column=zone_column)
    faults.raise_if_any()
    table.index = pd.RangeIndex(1, len(table) + 1, name="row")
    zones = ids_of(table, zone_column, faults)
    table = table.drop(columns=zone_column).assign(zone=zones)
    check_zones(table, faults)
    faults.raise_if_any()
    return table


def check_zones(zones: Any, faults: Faults) -> None:
    """Add every fault of a table of zones: names and geometry."""
    import shapely

    add_of_rows(faults, zones, lacking(zones["zone"]), "zone", "needs a name")
    again = (zones["zone"].duplicated() & ~lacking(zones["zone"])).to_numpy(bool)
    add_of_rows(faults, zones, again, "zone", "the zone stands in an earlier row too")
    shapes = zones.geometry.to_numpy()
    empty = shapely.is_missing(shapes) | shapely.is_empty(shapes)
    add_of_rows(faults, zones, empty, "zone", "has no geometry")
    is_line = ~empty & np.isin(shapely.get_type_id(shapes), [1, 2, 4, 5, 7])
    add_of_rows(faults, zones, is_line, "zone", "its geometry must be an area or one point")


def access_of_zones(zones: Any, network: Network, options: AccessOptions | None = None) -> Access:
    """The nodes that serve each zone, with their shares of its trips.

    ``zones``: a GeoDataFrame with the column zone, in any reference system (in none if the network
    has none: then coordinates are taken as metres). Nodes inside an area serve it (on a common
    border both areas), those at which trips can start (end), with a link that leaves (enters); a
    zone without any takes the nearest. Invalid areas are repaired. Notes tell of what was
    repaired, of zones that took nodes from outside, and of zones without a node.

    Raises :class:`uxsim_geo.errors.InputError` with every fault of the zones, for reference systems
    of which only one is known, a network without geometry, and weights that it does not have.
    """
    options = options or AccessOptions()
    faults, notes = Faults("zones"), Notes()
    check_zones(zones, faults)
    plane = plane_of(network, "none" if zones.crs is None else zones.crs, faults)
    weights = {end: _weights(network, end, options, faults) for end in ENDS}
    faults.raise_if_any()
    assert plane is not None, "else there was a fault"
    names, shapes = _in_natural_order(zones, plane, notes)
    tables = {
        end: _served(names, shapes, (network, end, weights[end]), options, notes) for end in ENDS
    }
    return Access(names, tables["origin"], tables["destination"], notes.table())


def _in_natural_order(
    zones: Any, plane: Plane, notes: Notes
) -> tuple[pd.Index[str], npt.NDArray[np.object_]]:
    """Names and shapes on the plane, repaired where they are invalid."""
    import shapely

    names = pd.Index(zones["zone"].astype("str"))
    ordered = pd.Index(natural_order(names), dtype="str")
    zones = zones.iloc[names.get_indexer(ordered)]
    shapes = (zones if plane.target is None else zones.to_crs(plane.target)).geometry.to_numpy()
    broken = ~shapely.is_valid(shapes)
    note = "invalid areas, such as those that cross themselves, were repaired"
    if broken.any():
        listed = ", ".join(ordered[broken][:20])
        notes.add("zones", note, element="demand", severity="warning", value=listed)
    return ordered, np.where(broken, shapely.make_valid(shapes), shapes)


def _weights(network: Network, end: End, options: AccessOptions, faults: Faults) -> Floats:
    """The weight of every node of the network at one end."""
    nodes, links = network.nodes, network.links
    if options.weights == "even":
        return np.ones(len(nodes))
    if options.weights == "capacity":
        capacity, lanes = numbers(links["capacity"]), numbers(links["lanes"])
        given = np.isfinite(capacity)
        per_lane = capacity[given].sum() / lanes[given].sum() if given.any() else 1.0
        capacity = np.where(given, capacity, lanes * per_lane)
        column = "from_node_id" if end == "origin" else "to_node_id"
        ids = pd.Index(nodes["node_id"].astype("str"))
        at = ids.get_indexer(pd.Index(links[column].astype("str")))
        return np.bincount(at, capacity, minlength=len(ids)).astype(np.float64)
    if options.weights not in nodes:
        what = "must be even, capacity or a column of the nodes"
        faults.add(what, column="weights", value=options.weights)
        return np.ones(len(nodes))
    weights = numbers(nodes[options.weights])
    wrong = nodes[~(np.isfinite(weights) & (weights >= 0))]
    for node, value in zip(wrong["node_id"], wrong[options.weights], strict=True):
        what = f"node {node}: must be a finite number, 0 or more"
        faults.add(what, column=options.weights, value=value)
    return weights


def _served(
    names: pd.Index[str],
    shapes: npt.NDArray[np.object_],
    at: tuple[Network, End, Floats],
    options: AccessOptions,
    notes: Notes,
) -> pd.DataFrame:
    """zone, node, share of one end; zones without a node have no row."""
    network, end, weights = at
    usable = usable_nodes(network, end)
    usable = usable[weights[usable] > 0]
    metres = node_metres(network)[usable]
    zone, node = _inside(shapes, metres)
    outside = np.setdiff1d(np.arange(len(shapes)), zone)
    found = _nearest(shapes, metres, outside, options)
    zone, node = np.concatenate((zone, found[0])), np.concatenate((node, found[1]))
    rank = _rank(zone, _distances(shapes, metres, zone, node), weights[usable][node], usable[node])
    keep = rank < options.nodes_per_zone
    zone, node = zone[keep], usable[node[keep]]
    _note_zones(names, zone, outside, end, notes)
    ids = network.nodes["node_id"].astype("str").to_numpy(object)
    table = pd.DataFrame({"zone": names[zone], "node": ids[node]})
    order = np.lexsort((node, zone))
    return with_shares(table.iloc[order].reset_index(drop=True), weights[node][order])


def _inside(shapes: npt.NDArray[np.object_], metres: Floats) -> tuple[Ints, Ints]:
    """Every shape and node on it."""
    import shapely

    tree = shapely.STRtree(shapely.points(metres))
    zone, node = tree.query(shapes, predicate="intersects")
    return zone.astype(np.int64), node.astype(np.int64)


def _middles(shapes: npt.NDArray[np.object_]) -> Floats:
    """A point inside each shape, as near to its middle as that allows; shape (shapes, 2)."""
    import shapely

    middle = shapely.centroid(shapes)
    within = shapely.intersects(shapes, middle)
    points = np.where(within, middle, shapely.point_on_surface(shapes))
    xy: Floats = shapely.get_coordinates(points)
    return xy


def _nearest(
    shapes: npt.NDArray[np.object_], metres: Floats, outside: Ints, options: AccessOptions
) -> tuple[Ints, Ints]:
    """For each of the shapes ``outside`` the nodes nearest to its middle, up to a distance."""
    from scipy.spatial import cKDTree

    count = min(options.nodes_per_zone, len(metres))
    if not outside.size or not count:
        return np.empty(0, np.int64), np.empty(0, np.int64)
    # the limit belongs to the zone
    distance, node = cKDTree(metres).query(_middles(shapes[outside]), k=range(1, count + 1))
    row, place = np.nonzero(distance <= options.within_m)
    return outside[row], node[row, place].astype(np.int64)


def _distances(shapes: npt.NDArray[np.object_], metres: Floats, zone: Ints, node: Ints) -> Floats:
    apart = _middles(shapes)[zone] - metres[node]
    distances: Floats = np.hypot(apart[:, 0], apart[:, 1])
    return distances


def _rank(zone: Ints, distance: Floats, weight: Floats, node: Ints) -> Ints:
    """The rank of each node in its zone, from 0: by weight, then nearness, then their order."""
    order = np.lexsort((node, distance, -weight, zone))
    first = np.searchsorted(zone[order], zone[order])
    rank = np.empty(len(zone), np.int64)
    rank[order] = np.arange(len(zone)) - first
    return rank


def _note_zones(names: pd.Index[str], zone: Ints, outside: Ints, end: End, notes: Notes) -> None:
    has = np.isin(np.arange(len(names)), zone)
    what = "start" if end == "origin" else "end"
    from_outside = outside[has[outside]]
    if from_outside.size:
        note = f"zones without a node inside at which trips can {what}: the nearest serve them"
        listed = ", ".join(names[from_outside][:20])
        notes.add("zones", note, element="demand", value=f"{from_outside.size}: {listed}")
    if not has.all():
        note = f"zones without any node near at which trips can {what}: their trips are left out"
        listed = ", ".join(names[~has][:20])
        value = f"{int((~has).sum())}: {listed}"
        notes.add("zones", note, element="demand", severity="warning", value=value)
