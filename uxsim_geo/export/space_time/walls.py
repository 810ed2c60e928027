"""Links as walls that stand on the map: straight pieces, thick enough to be seen from their ends.

A wall is a box over a straight piece of a link, from one time up to another.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import numpy.typing as npt

from uxsim_geo.analysis.samples import numbered_from
from uxsim_geo.analysis.trajectories import LinkLines
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.export.space_time.frame import Frame
from uxsim_geo.network.driving_side import DrivingSide

BESIDE = 0.003  # how far a link stands beside the middle of its road, of the map's side
RIBBON = 0.0011  # half the thickness of a ribbon, of that side
QUEUE = 0.0026  # of the wall of a queue: thicker, and less than BESIDE
SMOOTHED = 0.0005  # bends less wide than this are left out, of that side

#: faces of a box, by its corners: four below and four above them, counter-clockwise from outside
FACES = np.array(
    [(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (4, 5, 6, 7), (3, 2, 1, 0)]
)


@dataclass(frozen=True)
class Walls:
    """What stands on links; arrays of one length.

    link (its number among those of :class:`Pieces`), begin and end (s), tail (share of the link
    before it, 0 to 1), colour (number of its class), half (of its thickness).
    """

    link: Integers
    begin: Floats
    end: Floats
    tail: Floats
    colour: Integers
    half: Floats

    def part(self, rows: Integers) -> Walls:
        """Those of these rows, which may come again."""
        return Walls(*(getattr(self, field.name)[rows] for field in fields(self)))


@dataclass(frozen=True)
class Pieces:
    """Straight pieces of some links in the picture.

    begin and end (points, shape (pieces, 2)), reach (share of the link up to both, (pieces, 2)),
    first (per link and one more: where its pieces begin).
    """

    begin: Floats
    end: Floats
    reach: Floats
    first: Integers

    @classmethod
    def of(cls, frame: Frame, links: Integers, side: DrivingSide) -> Pieces:
        """Links beside the middle of their roads, where they are driven, but for smallest bends."""
        import shapely

        aside = np.full(len(links), BESIDE * frame.side)
        lines = type(frame.plane)(
            frame.plane.lines[links], frame.plane.points, frame.plane.metres_per_unit
        ).beside(aside, side)
        smooth = shapely.simplify(lines, SMOOTHED * frame.side, preserve_topology=False)
        lines = np.where(shapely.is_empty(smooth), lines, smooth)  # of a line without length
        flat = LinkLines.of(lines)
        points = frame.on_ground(np.stack([flat.x, flat.y], axis=1))
        starts = np.ones(len(points), bool)
        starts[flat.first[1:] - 1] = False
        start = np.flatnonzero(starts)
        reach = np.stack([flat.reach[start], flat.reach[start + 1]], axis=1)
        first = flat.first - np.arange(len(flat.first))
        return cls(points[start], points[start + 1], reach, first)

    def middle(self, link: int) -> Floats:
        """A point on a link about halfway."""
        own = slice(self.first[link], self.first[link + 1])
        piece = self.first[link] + int(np.argmax(self.reach[own, 1] >= 0.5))
        middle: Floats = (self.begin[piece] + self.end[piece]) / 2
        return middle

    def boxes(self, frame: Frame, walls: Walls) -> tuple[Floats, Integers]:
        """Corners of boxes, shape (boxes, 8, 3), and the wall that each is a part of."""
        counts = np.diff(self.first)[walls.link]
        wall = np.repeat(np.arange(len(walls.link)), counts)
        piece = numbered_from(self.first[walls.link], counts)
        low, high = self.reach[piece].T
        from_share = np.maximum(low, walls.tail[wall])
        kept = from_share < high
        wall, piece, low, high, from_share = (x[kept] for x in (wall, piece, low, high, from_share))
        part = ((from_share - low) / (high - low))[:, None]
        begin = self.begin[piece] + part * (self.end[piece] - self.begin[piece])
        end = self.end[piece]
        way = end - begin
        length = np.maximum(np.hypot(*way.T), 1e-12)
        left = np.stack([-way[:, 1], way[:, 0]], axis=1) / length[:, None]
        left *= walls.half[wall, None]
        corners = np.empty((len(wall), 8, 3))
        around = np.stack([begin - left, end - left, end + left, begin + left], axis=1)
        corners[:, :4, :2] = corners[:, 4:, :2] = around
        corners[:, :4, 2] = frame.upwards(walls.begin[wall])[:, None]
        corners[:, 4:, 2] = frame.upwards(walls.end[wall])[:, None]
        return corners, wall


def runs(classes: npt.NDArray[Any]) -> tuple[Integers, Integers, Integers, Integers]:
    """Row, first and last column, and value of the longest equal stretches in rows, but of −1.

    Bins of a link that look the same, one after the other, are one wall.
    """
    bins = classes.shape[1]
    flat = classes.ravel()
    new = np.ones(flat.size, bool)
    new[1:] = flat[1:] != flat[:-1]
    new[::bins] = True
    first = np.flatnonzero(new)
    last = np.append(first[1:], flat.size) - 1
    kept = flat[first] >= 0
    first, last = first[kept], last[kept]
    return first // bins, first % bins, last % bins, flat[first]


def quads(corners: Floats) -> tuple[Floats, Integers]:
    """Points (n, 3) and faces (m, 4) of boxes: their rows."""
    count = len(corners)
    rows = 8 * np.arange(count)[:, None, None] + FACES
    return corners.reshape(-1, 3), rows.reshape(-1, 4)
