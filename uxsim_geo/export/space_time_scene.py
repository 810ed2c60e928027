"""The scene of the 3D picture: links as upright ribbons, time upwards, speed as colour."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.analysis.state_grid import StateGrid
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.export.colours import SPEED_CLASSES
from uxsim_geo.export.map_plane import MapPlane
from uxsim_geo.network.network import Network

MOST_QUADS = 300_000  # more take longer to draw and show no more
MOST_STATES = 5_000  # more ribbons hide each other: the slowest and, of those, the fullest count
HEIGHT = 0.4  # of the time axis at most, as a part of the map's larger side
LEAST_HEIGHT = 0.25  # of it on a narrow map, where it would tower
FEW_LINKS = 200  # of more, free-flowing ribbons would be a fog: only the slower ones are drawn
BESIDE = 0.003  # how far a link stands to the right of its road, as a part of that side
TICK_MINUTES = (1, 2, 5, 10, 15, 20, 30, 60, 120, 180, 240, 360, 720, 1440)
OPACITIES = (1.0, 1.0, 0.9, 0.3, 0.05)  # of the classes of speed: free traffic hides no queue
CROWD = 500  # of more ribbons each is paler, so that those behind show
MOST_FEET = 300  # more lines under ribbons would be a thicket
FAINT = 0.06  # opacities up to here draw no attention
SPARSE = 0.03  # of jam density: states below fade, since a few vehicles are no queue


def space_time_scene(network: Network, states: pd.DataFrame, title: str) -> dict[str, Any]:
    """Arrays and texts of the picture; coordinates from the middle of the map, its side 1.

    points, quads
        corners of the ribbons (n, 3) and faces as VTK counts them: 4, then four rows of points
    speed, opacity
        of each quad: % of free speed, at most 100, and 0 to 1
    road_points, roads, road_speed
        the links on the ground, as VTK's polylines, with the lowest speed each ever had while
        there were more than a few vehicles
    feet
        lines (n, 2, 3) from the ground up to the lowest ribbon of each link that is not faint,
        where that floats; none if they would be a thicket
    segments, label_points, labels
        the time axis, and with a CRS the scale bar and north: lines (n, 2, 3), texts at (n, 3)
    ground, colours, title, subtitle, speed_title
        the sheet under the map, and the colours of the classes of speed, which are even
    """
    grid = StateGrid.of_all(states, network)
    plane = MapPlane.of(network)
    frame = _Frame.of(plane, float(grid.end[-1]))
    percent, weight = _percent(network, states), _weight(network, states)
    worth = 100.0 if len(network.links) <= FEW_LINKS else 100 * SPEED_CLASSES[-1].lower
    chosen = _slowest(np.flatnonzero(percent <= worth), percent, states)
    pieces = _Pieces.of(plane, frame, len(grid.begin), chosen)
    state, piece = pieces.quads_of(chosen)
    if len(state) > MOST_QUADS:
        slowest = np.sort(np.argsort(percent[state], kind="stable")[:MOST_QUADS])
        state, piece = state[slowest], piece[slowest]
    opacity = _opacity(percent, weight)
    crowd = int(np.count_nonzero(opacity[chosen] > FAINT))
    opacity *= (CROWD / max(crowd, CROWD)) ** 0.5
    seen = state[opacity[state] > FAINT]
    return {
        "title": title,
        "subtitle": _subtitle(percent, len(np.unique(state))),
        **_ribbons(pieces, piece, frame.heights(states, state)),
        "feet": _feet(pieces, seen, frame.heights(states, seen)),
        "speed": percent[state],
        "speed_title": "speed, % of free speed\n",
        "colours": np.array([speed.colour for speed in SPEED_CLASSES]),
        "opacity": opacity[state],
        **_roads(pieces, np.where(weight < 1, np.nan, percent)),
        **frame.axes(),
    }


@dataclass(frozen=True)
class _Frame:
    """The picture's coordinates: the map's middle is the origin, its larger side 1."""

    plane: MapPlane
    middle: Floats
    side: float
    height: float
    duration: float

    @classmethod
    def of(cls, plane: MapPlane, duration: float) -> _Frame:
        x0, y0, x1, y1 = plane.extent
        middle = np.array([(x0 + x1) / 2, (y0 + y1) / 2])
        side = max(x1 - x0, y1 - y0)
        height = min(HEIGHT, max((x1 - x0) / side, LEAST_HEIGHT))
        return cls(plane, middle, side, height, duration)

    def heights(self, states: pd.DataFrame, rows: Integers) -> Floats:
        """Begin and end of these states above the ground, shape (rows, 2)."""
        seconds = states[["begin_s", "end_s"]].to_numpy(float)[rows]
        heights: Floats = self.height * seconds / self.duration
        return heights

    def axes(self) -> dict[str, Any]:
        """Time axis at the left corner, scale bar along the near edge, north at the right."""
        x0, y0 = (self.plane.extent[:2] - self.middle) / self.side
        x1, y1 = (self.plane.extent[2:] - self.middle) / self.side
        corner = np.array([x0 - 0.02, y0 - 0.02, 0.0])
        segments, labels = _time_axis(corner, self.height, self.duration)
        near = np.array([x0, y0 - 0.05, 0.0])
        bar = self.plane.scale_bar(0.3 * (x1 - x0) * self.side)
        if bar is not None:
            length = np.array([bar[0] / self.side, 0.0, 0.0])
            segments.append((near, near + length))
            labels.append((_moved(near + length / 2, 0.0, -0.035), bar[1]))
            foot, head = np.array([x1 + 0.06, y1 - 0.12, 0.0]), np.array([x1 + 0.06, y1, 0.0])
            segments += [(foot, head)]
            segments += [(head, _moved(head, sign * 0.012, -0.03)) for sign in (-1, 1)]
            labels.append((_moved(head, 0.0, 0.05), "N"))
        return {
            "ground": np.array([x0 - 0.03, y0 - 0.03, x1 + 0.03, y1 + 0.03]),
            "segments": np.array(segments),
            "label_points": np.array([point for point, _ in labels]),
            "labels": np.array([text for _, text in labels]),
        }


@dataclass(frozen=True)
class _Pieces:
    """Straight pieces of links: from and to (pieces, 2), and where each link's pieces begin.

    first has one entry more than there are links; bins is the number of time bins.
    """

    begin: Floats
    end: Floats
    first: Integers
    bins: int

    @classmethod
    def of(cls, plane: MapPlane, frame: _Frame, bins: int, moving: Integers) -> _Pieces:
        """Links beside the middle of their roads; with too many pieces, as the crow flies."""
        import shapely

        aside = np.full(len(plane.lines), BESIDE * frame.side)
        lines = plane.to_the_right(aside)
        corners = shapely.get_num_coordinates(lines)
        if np.sum(corners[moving // bins] - 1) > MOST_QUADS:
            ends = [shapely.get_point(lines, 0), shapely.get_point(lines, -1)]
            xy = np.stack([shapely.get_coordinates(points) for points in ends], axis=1)
            lines = shapely.linestrings(xy)
            corners = np.full(len(lines), 2)
        xy = (shapely.get_coordinates(lines) - frame.middle) / frame.side
        last = np.cumsum(corners)
        is_start, is_end = np.ones(len(xy), bool), np.ones(len(xy), bool)
        is_start[last - 1] = False
        is_end[last - corners] = False
        first = np.concatenate(([0], np.cumsum(corners - 1)))
        return cls(xy[is_start], xy[is_end], first, bins)

    def quads_of(self, states: Integers) -> tuple[Integers, Integers]:
        """Every state with every piece of its link: two arrays of one length."""
        link = states // self.bins
        pieces = np.diff(self.first)[link]
        state = np.repeat(states, pieces)
        within = np.arange(len(state)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
        return state, np.repeat(self.first[link], pieces) + within


def _ribbons(pieces: _Pieces, piece: Integers, heights: Floats) -> dict[str, Any]:
    """Upright rectangles over the pieces between two heights."""
    corners = np.empty((len(piece), 4, 3))
    corners[:, [0, 3], :2] = pieces.begin[piece, None]
    corners[:, [1, 2], :2] = pieces.end[piece, None]
    corners[:, [0, 1], 2] = heights[:, :1]
    corners[:, [2, 3], 2] = heights[:, 1:]
    return {"points": corners.reshape(-1, 3), "quads": _cells(len(piece), 4)}


def _feet(pieces: _Pieces, state: Integers, heights: Floats) -> Floats:
    """Upright lines under the middles of links whose lowest ribbon floats, shape (links, 2, 3)."""
    link = state // pieces.bins
    links, first = np.unique(link, return_index=True)  # states of a link stand in order of time
    top = heights[first, 0]
    links, top = links[top > 0], top[top > 0]
    if len(links) > MOST_FEET:
        return np.empty((0, 2, 3))
    middle = (pieces.first[links] + pieces.first[links + 1] - 1) // 2
    xy = (pieces.begin[middle] + pieces.end[middle]) / 2
    ends = [np.column_stack([xy, np.zeros(len(xy))]), np.column_stack([xy, top])]
    return np.stack(ends, axis=1)


def _roads(pieces: _Pieces, percent: Floats) -> dict[str, Any]:
    """The pieces on the ground, with the lowest speed their link ever had."""
    ends = np.stack([pieces.begin, pieces.end], axis=1).reshape(-1, 2)
    on_ground = np.column_stack([ends, np.zeros(len(ends))])
    slowest = np.nan_to_num(percent, nan=100.0).reshape(-1, pieces.bins).min(axis=1)
    return {
        "road_points": on_ground,
        "roads": _cells(len(pieces.begin), 2),
        "road_speed": np.repeat(slowest, np.diff(pieces.first)),
    }


def _cells(count: int, corners: int) -> Integers:
    """Cells in VTK's way, none sharing a point: the number of corners, then their rows."""
    rows = np.arange(count * corners).reshape(count, corners)
    return np.column_stack([np.full(count, corners), rows]).ravel()


def _time_axis(
    corner: Floats, height: float, duration: float
) -> tuple[list[Any], list[tuple[Floats, str]]]:
    """A line upwards with a tick and a label (h:min) at every round time."""
    top = _moved(corner, 0.0, 0.0, height)
    segments: list[Any] = [(corner, top)]
    labels = [(_moved(top, -0.02, 0.0, 0.05), "time, h:min")]
    minutes = duration / 60
    step = next((step for step in TICK_MINUTES if minutes / step <= 6.5), minutes / 6)
    for minute in np.arange(0, minutes + 1e-6, step):
        tick = _moved(corner, 0.0, 0.0, height * minute / minutes)
        segments.append((tick, _moved(tick, -0.015)))
        hours, rest = divmod(round(minute), 60)
        labels.append((_moved(tick, -0.05), f"{hours}:{rest:02d}"))
    return segments, labels


def _moved(point: Floats, x: float, y: float = 0.0, z: float = 0.0) -> Floats:
    moved: Floats = point + np.array([x, y, z])
    return moved


def _percent(network: Network, states: pd.DataFrame) -> Floats:
    """Speed of every state in % of its link's free speed, NaN where nobody was."""
    free = np.repeat(network.links["free_speed"].to_numpy(float), len(states) // len(network.links))
    percent: Floats = np.minimum(100 * states["speed"].to_numpy(float) / free, 100.0)
    return percent


def _slowest(rows: Integers, percent: Floats, states: pd.DataFrame) -> Integers:
    """Of these states as many as a picture bears, in the order of the table."""
    density = states["density"].to_numpy(float)[rows]
    order = np.lexsort((-density, percent[rows]))
    kept: Integers = np.sort(rows[order[:MOST_STATES]])
    return kept


def _weight(network: Network, states: pd.DataFrame) -> Floats:
    """1 for a state with traffic to speak of, less where a few vehicles were on the link."""
    jam = network.links["jam_density"].to_numpy(float) * network.links["lanes"].to_numpy(float)
    few = SPARSE * np.repeat(jam, len(states) // len(network.links))
    weight: Floats = np.minimum(states["density"].to_numpy(float) / few, 1.0)
    return weight


def _opacity(percent: Floats, weight: Floats) -> Floats:
    """By class of speed, and fading where one slow vehicle would look like a queue."""
    speed_class = np.minimum(np.nan_to_num(percent) * len(OPACITIES) / 100, len(OPACITIES) - 1)
    opacity: Floats = np.array(OPACITIES)[speed_class.astype(int)] * weight
    return opacity


def _subtitle(percent: Floats, shown: int) -> str:
    ground = (
        "paler with few vehicles\non the ground: the lowest speed of each link, grey where it "
        "stayed above 80 % of free speed or nobody drove"
    )
    moving = int(np.count_nonzero(~np.isnan(percent)))
    if shown == moving:
        return f"ribbons: every link and time bin with traffic; {ground}"
    return (
        f"ribbons: the {shown:,} slowest of {moving:,} links and time bins with traffic; {ground}"
    )
