"""The network as paths of an SVG picture: small enough for a page, whatever the network."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.analysis.types import Floats
from uxsim_geo.export.map_plane import MapPlane

#: units of the picture along its longer side; coordinates are whole numbers of them
SIZE = 2000

#: lines are simplified until a path has at most so many characters
MOST_CHARACTERS = 500_000

#: classes of roads that are drawn wider, with their links
MAIN_ROADS = ("motorway", "trunk", "primary", "secondary")


@dataclass(frozen=True)
class Picture:
    """A plane in units of a picture: x to the right, y downwards, from 0.

    plane
        what is drawn
    left, top
        least x and greatest y of the plane that are in the picture
    scale
        units of the picture in a unit of the plane
    width, height
        in units; the longer one is :data:`SIZE`
    """

    plane: MapPlane
    left: float
    top: float
    scale: float
    width: int
    height: int

    @classmethod
    def of(cls, plane: MapPlane) -> Picture:
        """A picture as large as the network."""
        x0, y0, x1, y1 = plane.extent
        scale = SIZE / max(x1 - x0, y1 - y0)
        width, height = (max(round(side * scale), 1) for side in (x1 - x0, y1 - y0))
        return cls(plane, x0, y1, scale, width, height)

    def place(self, points: Floats) -> Floats:
        """Points of the plane in the picture; (points, 2)."""
        return np.column_stack([points[:, 0] - self.left, self.top - points[:, 1]]) * self.scale

    def bar(self) -> tuple[float, str] | None:
        """Length of a scale bar in the picture and its name; None where no length is known."""
        bar = self.plane.scale_bar(self.width / 4 / self.scale)
        return None if bar is None else (bar[0] * self.scale, bar[1])


def main_roads(links: pd.DataFrame) -> npt.NDArray[np.bool_]:
    """Which links are of the classes that are drawn wider."""
    if "road_class" not in links:
        return np.zeros(len(links), dtype=bool)
    names = links["road_class"].astype("str").fillna("").str.removesuffix("_link")
    return np.asarray(names.isin(MAIN_ROADS), dtype=bool)


def path_of(picture: Picture, rows: npt.NDArray[np.bool_]) -> str:
    """The data of an SVG path of some links: joined, both directions once, simplified as needed."""
    import shapely

    lines = shapely.get_parts(picture.plane.lines[rows])
    lines = lines[shapely.get_type_id(lines) == shapely.GeometryType.LINESTRING]
    if not len(lines):
        return ""
    lines = shapely.get_parts(shapely.line_merge(shapely.multilinestrings(_once(lines))))
    tolerance = 1.0
    while True:
        text = _path(picture, shapely.simplify(lines, tolerance / picture.scale), tolerance)
        if len(text) <= MOST_CHARACTERS:
            return text
        tolerance *= 2.0


def _once(lines: Any) -> Any:
    """The lines without those that lie on another, as the two directions of a road do."""
    import shapely

    return shapely.from_wkb(np.unique(shapely.to_wkb(shapely.normalize(lines))))


def _path(picture: Picture, lines: Any, least: float) -> str:
    """Lines as moves and steps in whole units; those shorter than ``least`` are left out."""
    import shapely

    lines = lines[shapely.length(lines) * picture.scale >= least]
    points, line = shapely.get_coordinates(lines, return_index=True)
    places = np.rint(picture.place(points)).astype(np.int64)
    steps = np.diff(places, axis=0, prepend=places[:1])
    first = np.flatnonzero(np.diff(line, prepend=-1))
    begins = np.zeros(len(line), dtype=bool)
    begins[first] = True
    kept = begins | steps.any(axis=1)
    texts = [
        f"M{x} {y}" if begin else f"l{dx} {dy}"
        for (x, y), (dx, dy), begin in zip(
            places[kept].tolist(), steps[kept].tolist(), begins[kept].tolist(), strict=True
        )
    ]
    return "".join(texts)
