"""Points to nodes: each goes to the nearest node that trips can start from, or end at."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.demand.access import ENDS, Access, End, access_of_nodes
from uxsim_geo.demand.od_table import add_of_rows
from uxsim_geo.errors import Faults
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.projection import metres_around
from uxsim_geo.network.rows import is_among

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Points:
    """What is needed to take points of a file to nodes.

    network
        with the geometry of its nodes
    crs
        reference system of the points, x before y, such as EPSG:4326 for longitude and latitude;
        ``none`` if the network has none either: then coordinates are taken as metres
    within_m
        m; points further from every node are left out, and reported
    """

    network: Network
    crs: str | None = None
    within_m: float = 500.0

    def __post_init__(self) -> None:
        faults = Faults("points")
        if self.crs is None:
            faults.add(
                "the reference system of the points must be stated, for instance EPSG:4326 for "
                "longitude and latitude, or none: the file does not say it",
                column="crs",
            )
        if not 0 < self.within_m < math.inf:
            what = "must be a finite number of metres above 0"
            faults.add(what, column="within_m", value=self.within_m)
        faults.raise_if_any()


class Plane(NamedTuple):
    """How coordinates become metres on a plane: from which system to which; None: they are."""

    source: Any
    target: Any

    def metres(self, x: Floats, y: Floats) -> Floats:
        """Give x and y in m, shape (points, 2); infinite where the plane has no such point."""
        if self.target is not None:
            from pyproj import Transformer

            to_plane = Transformer.from_crs(self.source, self.target, always_xy=True)
            x, y = to_plane.transform(x, y)
        return np.column_stack((x, y)).astype(np.float64)


def check_points(rows: pd.DataFrame, points: Points, faults: Faults) -> None:
    """Add every fault of the points of some rows, and of their reference system.

    Coordinates must be finite, and in a system of longitudes and latitudes at most 360 and 90.
    """
    plane = plane_of(points.network, points.crs, faults)
    degrees = plane is not None and plane.source is not None and plane.source.is_geographic
    for name in (f"{end}_{letter}" for end in ENDS for letter in "xy"):
        values = rows[name].to_numpy(np.float64)
        add_of_rows(faults, rows, ~np.isfinite(values), name, "must be a finite coordinate")
        most = 360.0 if name.endswith("x") else 90.0
        what = f"is beyond {most:g} degrees: are x and y, or the reference system, confused?"
        beyond = np.isfinite(values) & (np.abs(values) > most)
        add_of_rows(faults, rows, beyond & degrees, name, what)


def points_to_nodes(rows: pd.DataFrame, points: Points) -> tuple[pd.DataFrame, Access]:
    """Give rows with origin_x, origin_y, destination_x, destination_y their origin and destination.

    A point becomes the id of its node, or, where none is near enough, the text "x y", a place
    without access. Returns the rows with columns origin and destination in place of the points,
    and the access to nodes. The points were checked by :func:`check_points`.
    """
    notes = Notes()
    lost: list[str] = []
    rows = rows.copy()
    plane = plane_of(points.network, points.crs, Faults())
    assert plane is not None, "it was checked"
    for end in ENDS:
        x, y = (rows.pop(f"{end}_{letter}").to_numpy(np.float64) for letter in "xy")
        node, distance = nearest_nodes(plane.metres(x, y), points.network, end)
        ids = points.network.nodes["node_id"].astype("str").to_numpy(object)[node]
        far = distance > points.within_m
        ids[far] = [f"{x[row]:.9g} {y[row]:.9g}" for row in np.flatnonzero(far)]
        rows[end] = pd.Series(ids, index=rows.index, dtype="str")
        lost.extend(rows.loc[far, end].unique())
        note = f"points as {end} are not far from their nodes; value: m at most"
        notes.add("points", note, element="demand", value=float(distance[~far].max(initial=0.0)))
    nodes = access_of_nodes(points.network)
    known = nodes.zones.union(pd.Index(lost, dtype="str"), sort=False).unique()
    return rows, Access(known, nodes.origins, nodes.destinations, notes.table())


def plane_of(network: Network, crs: Any, faults: Faults) -> Plane | None:
    """How coordinates of ``crs`` become metres for this network; None, with a fault, if not at all.

    Where the network's own system is not in metres, the plane is that of its UTM zone.
    """
    from pyproj import CRS
    from pyproj.exceptions import CRSError

    nodes = network.nodes
    own = getattr(nodes, "crs", None) if "geometry" in nodes else None
    if "geometry" not in nodes:
        faults.add("the network has no geometry: there is no node near a point")
    elif str(crs).strip().lower() == "none":
        if own is None:
            return Plane(None, None)
        name = own.to_string()
        faults.add(f"must be stated: that of the network is {name}", column="crs", value=crs)
    elif own is None:
        what = "the network has no reference system, so points in one cannot be placed on it"
        faults.add(what, column="crs", value=crs)
    else:
        try:
            return Plane(CRS.from_user_input(crs), metric_crs(network))
        except CRSError:
            what = "is not a reference system; write one as EPSG:4326, or none"
            faults.add(what, column="crs", value=crs)
    return None


def metric_crs(network: Network) -> Any:
    """A system in metres for the network: its own if it is one; None if it has none.

    That of maps on the web is none: its metres shrink with the latitude, to two thirds at 48°.
    """
    own = getattr(network.nodes, "crs", None)
    if own is None:
        return None
    operation = own.coordinate_operation  # None in systems with heights
    method = operation.method_name if operation else ""
    stretched = "Mercator" in method and "Transverse" not in method
    if own.is_projected and own.axis_info[0].unit_name == "metre" and not stretched:
        return own
    return metres_around(network.nodes["geometry"])


def node_metres(network: Network) -> Floats:
    """Where the nodes are on the plane of :func:`metric_crs`, m; shape (nodes, 2)."""
    import shapely

    xy = shapely.get_coordinates(shapely.centroid(network.nodes["geometry"].to_numpy()))
    target = metric_crs(network)
    plane = Plane(None, None) if target is None else Plane(network.nodes.crs, target)
    return plane.metres(xy[:, 0], xy[:, 1])


def usable_nodes(network: Network, end: End) -> Ints:
    """Rows of the nodes at which trips can start (a link leaves) or end (a link enters)."""
    column = "from_node_id" if end == "origin" else "to_node_id"
    used = is_among(network.nodes["node_id"].astype("str"), network.links[column].astype("str"))
    return np.flatnonzero(used)


def nearest_nodes(metres: Floats, network: Network, end: End) -> tuple[Ints, Floats]:
    """Row of the nearest usable node of every point, and its distance, m; inf where none is."""
    from scipy.spatial import cKDTree

    usable = usable_nodes(network, end)
    there = np.isfinite(metres).all(axis=1)
    node, distance = np.zeros(len(metres), np.int64), np.full(len(metres), np.inf)
    if usable.size and there.any():
        found, place = cKDTree(node_metres(network)[usable]).query(metres[there])
        node[there], distance[there] = usable[place], found
    return node, distance
