"""Lines of a network on a plane, for pictures: any CRS becomes one with equal scales."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from uxsim_geo.analysis.types import Floats
from uxsim_geo.network.driving_side import DrivingSide
from uxsim_geo.network.network import Network
from uxsim_geo.network.projection import metres_around


@dataclass(frozen=True)
class MapPlane:
    """Links and nodes in plane coordinates with equal scales on both axes.

    lines
        shapely lines, one a link, in the order of the links
    points
        x and y of the nodes, shape (nodes, 2)
    metres_per_unit
        None where the network has no CRS: then distances on the map mean nothing
    crs
        of the plane; None where it is not known
    """

    lines: npt.NDArray[Any]
    points: Floats
    metres_per_unit: float | None
    crs: Any = None

    @classmethod
    def of(cls, network: Network) -> MapPlane:
        """Project geographic coordinates to the UTM zone of the network, take others as they are.

        Near a pole, where there are no zones, the system is that of the pole. Raises ValueError if
        the network has no geometry.
        """
        if "geometry" not in network.links.columns or "geometry" not in network.nodes.columns:
            raise ValueError("this network has no geometry: there is no map to draw")
        import geopandas as gpd
        import shapely

        links = gpd.GeoSeries(network.links["geometry"], crs=getattr(network.links, "crs", None))
        nodes = gpd.GeoSeries(network.nodes["geometry"], crs=links.crs)
        if links.crs is not None and links.crs.is_geographic:
            metres = metres_around(nodes)
            links, nodes = links.to_crs(metres), nodes.to_crs(metres)
        points = shapely.get_coordinates(nodes.to_numpy())
        scale = links.crs.axis_info[0].unit_conversion_factor if links.crs else None
        return cls(shapely.force_2d(links.to_numpy()), points, scale, links.crs)

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Least x and y, greatest x and y of the lines, with a margin; never without area."""
        import shapely

        x0, y0, x1, y1 = (float(value) for value in shapely.total_bounds(self.lines))
        half = max(x1 - x0, y1 - y0, 1e-9) * 0.02
        return x0 - half, y0 - half, x1 + half, y1 + half

    def beside(self, distances: Floats, driving_side: DrivingSide) -> npt.NDArray[Any]:
        """The lines moved to the side that is driven on by map units, one distance a line.

        A line too crooked to be moved in one piece stays where it is.
        """
        import shapely

        to_the_left = -distances if driving_side == "right" else distances
        moved = shapely.offset_curve(self.lines, to_the_left, join_style="mitre")
        is_line = shapely.get_type_id(moved) == shapely.GeometryType.LINESTRING
        return np.where(is_line & ~shapely.is_empty(moved), moved, self.lines)

    def scale_bar(self, longest: float) -> tuple[float, str] | None:
        """A round length of at most ``longest`` map units and its name; None without a CRS."""
        if self.metres_per_unit is None:
            return None
        round_metres = round_below(longest * self.metres_per_unit)
        name = f"{round_metres / 1000:g} km" if round_metres >= 1000 else f"{round_metres:g} m"
        return round_metres / self.metres_per_unit, name


def round_below(value: float) -> float:
    """The greatest of 1, 2 and 5 times a power of ten that is not above ``value`` (> 0)."""
    power = 10.0 ** math.floor(math.log10(value))
    # the logarithm of a number beside a power of ten may be rounded to the wrong side of it
    return max(step * power for step in (0.5, 1.0, 2.0, 5.0, 10.0) if step * power <= value)
