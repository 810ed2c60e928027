"""Where nodes lie in metres, and which way links run at their ends."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from uxsim_geo.network.incidence import Floats
from uxsim_geo.network.inner_paths import Junction, Pair
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.projection import in_metres, project

#: m from the end of a link at which its direction is taken: the last bend may be of the curb
BEFORE = 15.0


@dataclass(frozen=True)
class Headings:
    """Direction of links at their start and end, degrees from east to the left; None: not known."""

    at_start: list[float] | None
    at_end: list[float] | None

    def angles(self, junction: Junction) -> dict[Pair, float]:
        """By how much one turns on each open way through a junction: left above 0, within ±180."""
        if self.at_start is None or self.at_end is None:
            return {}
        return {
            (a, b): (self.at_start[b] - self.at_end[a] + 180.0) % 360.0 - 180.0
            for a, b in junction.ways
        }


def in_plane(network: Network) -> Network | None:
    """The network in metres; itself if it is already, None if it is not known where it lies."""
    crs: Any = getattr(network.links, "crs", None)
    if crs is None or getattr(network.nodes, "crs", None) is None:
        return None
    return network if in_metres(crs) else project(network, None, Notes())


def metric_points(network: Network) -> Floats | None:
    """Where the nodes are: x and y, m, (nodes, 2); None where it is not known where they lie."""
    import shapely

    plane = in_plane(network)
    if plane is None:
        return None
    return np.asarray(shapely.get_coordinates(plane.nodes["geometry"].to_numpy()))


def headings_of(network: Network) -> Headings:
    """Directions of all links at their ends."""
    import shapely

    plane = in_plane(network)
    if plane is None:
        return Headings(None, None)
    lines = plane.links["geometry"].to_numpy()
    after, before = (
        shapely.get_coordinates(shapely.line_interpolate_point(lines, distance))
        for distance in (BEFORE, -BEFORE)
    )
    start, end = (shapely.get_coordinates(shapely.get_point(lines, place)) for place in (0, -1))
    return Headings(_degrees(after - start), _degrees(end - before))


def _degrees(vectors: Floats) -> list[float]:
    found: list[float] = np.degrees(np.arctan2(vectors[:, 1], vectors[:, 0])).tolist()
    return found
