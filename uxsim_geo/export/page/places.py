"""Where links and nodes lie on the page's map, which knows longitudes and latitudes alone.

Networks without a place on the earth are drawn on a small patch around 0° N 0° E, where degrees of
both kinds are equally long: shapes are kept, and the page claims no place, scale or north.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from uxsim_geo.analysis.types import Floats
from uxsim_geo.export.page.packing import DEGREES
from uxsim_geo.network.layout import schematic_layout
from uxsim_geo.network.network import Network

#: width of the patch for networks that lie nowhere, degrees
PATCH = 0.2

#: points of lines nearer than this to the straight way between others are left out, degrees
TOLERANCE = 2 * DEGREES


@dataclass(frozen=True)
class Places:
    """Lines of the links and points of the nodes, degrees.

    lines
        shapely lines, one a link, in the order of the links
    points
        longitude and latitude of the nodes, shape (nodes, 2)
    on_earth
        False where the network has no reference system
    """

    lines: npt.NDArray[Any]
    points: Floats
    on_earth: bool

    @classmethod
    def of(cls, network: Network) -> Places:
        """Look up or invent the places of a network."""
        import shapely

        crs = getattr(network.links, "crs", None)
        if "geometry" not in network.links or "geometry" not in network.nodes:
            lines, points = _schematic(network)
        elif crs is None:
            lines = shapely.force_2d(network.links["geometry"].to_numpy())
            points = shapely.get_coordinates(network.nodes["geometry"].to_numpy())
        else:
            import geopandas as gpd

            links, nodes = (
                gpd.GeoSeries(table["geometry"], crs=crs).to_crs("EPSG:4326")
                for table in (network.links, network.nodes)
            )
            lines = shapely.force_2d(links.to_numpy())
            points = shapely.get_coordinates(nodes.to_numpy())
            return cls(shapely.simplify(lines, TOLERANCE), points, True)
        return cls(*_on_patch(lines, points), on_earth=False)


def _schematic(network: Network) -> tuple[npt.NDArray[Any], Floats]:
    """Straight lines between nodes that are as far apart as the road between them is long."""
    import shapely

    ids = {node: row for row, node in enumerate(network.nodes["node_id"])}
    start, end = (
        np.array([ids[node] for node in network.links[column]], np.int64)
        for column in ("from_node_id", "to_node_id")
    )
    points = schematic_layout(start, end, network.links["length"].to_numpy(float), len(ids))
    return shapely.linestrings(np.stack([points[start], points[end]], axis=1)), points


def _on_patch(lines: npt.NDArray[Any], points: Floats) -> tuple[npt.NDArray[Any], Floats]:
    """Plane coordinates moved and shrunk or stretched, alike in both directions."""
    import shapely

    x0, y0, x1, y1 = (float(value) for value in shapely.total_bounds(lines))
    scale = PATCH / max(x1 - x0, y1 - y0, 1e-9)
    middle = np.array([(x0 + x1) / 2, (y0 + y1) / 2])

    def moved(places: Floats) -> Floats:
        scaled: Floats = (places - middle) * scale
        return scaled

    return shapely.simplify(shapely.transform(lines, moved), TOLERANCE), moved(points)
