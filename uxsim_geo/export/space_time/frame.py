"""Coordinates of a picture in space and time, and its axes: time, scale and north."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from uxsim_geo.analysis.types import Floats
from uxsim_geo.export.clock import Clock
from uxsim_geo.export.map_plane import MapPlane

HEIGHT = 0.45  # of the time axis at most, as a part of the map's larger side
CROWDED_HEIGHT = 0.3  # of it over many links, where walls would hide one another
LEAST_HEIGHT = 0.25  # of it on a narrow map, where it would tower
MOST_TICKS = 7
EAST, NORTH, UP = np.eye(3)
CORNERS = 4  # of the map: south-west, south-east, north-east, north-west


@dataclass(frozen=True)
class Frame:
    """The picture's coordinates: the middle of what is shown is the origin, its larger side 1.

    box
        least x and y, greatest x and y of what is shown, in units of the map
    height, duration
        of the time axis, and the time that it shows, s
    """

    plane: MapPlane
    box: tuple[float, float, float, float]
    height: float
    duration: float

    @classmethod
    def of(
        cls,
        plane: MapPlane,
        box: tuple[float, float, float, float],
        duration: float,
        *,
        crowded: bool = False,
    ) -> Frame:
        """Choose the height by the extent: a narrow map carries no tower, nor a crowded one."""
        x0, y0, x1, y1 = box
        narrow = min(x1 - x0, y1 - y0) / max(x1 - x0, y1 - y0)
        highest = CROWDED_HEIGHT if crowded else HEIGHT
        return cls(plane, box, min(highest, max(narrow, LEAST_HEIGHT)), duration)

    @property
    def side(self) -> float:
        """Larger side of what is shown, in units of the map."""
        x0, y0, x1, y1 = self.box
        return max(x1 - x0, y1 - y0)

    def on_ground(self, points: Floats) -> Floats:
        """Points of the map, shape (..., 2), in the picture."""
        x0, y0, x1, y1 = self.box
        moved: Floats = (points - np.array([x0 + x1, y0 + y1]) / 2) / self.side
        return moved

    def upwards(self, seconds: Any) -> Any:
        """Height of a time."""
        return self.height * seconds / self.duration

    @property
    def ground(self) -> Floats:
        """Least x and y, greatest x and y of the map in the picture."""
        return self.on_ground(np.reshape(self.box, (2, 2))).ravel()

    def corners(self) -> Floats:
        """The map's corners, counter-clockwise from the south-west, shape (4, 2)."""
        x0, y0, x1, y1 = self.ground
        return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])


def time_marks(frame: Frame, clock: Clock) -> list[tuple[float, str]]:
    """Heights of round times, and what the clock shows then; at most seven or so."""
    return [(frame.upwards(time), text) for time, text in clock.ticks(MOST_TICKS)]


def axes(frame: Frame, marks: list[tuple[float, str]], title: str) -> dict[str, Any]:
    """For each corner: axes for a viewer who sees it on the left, and the side from it onwards.

    ``marks`` are heights and what is written beside them, ``title`` stands above the axis.

    axes{k}.segments (lines, (n, 2, 3)), axes{k}.points and axes{k}.texts (labels at (n, 3))
    side{k}.segments
        lines at the heights of marks over the side of the map from corner k to the next, for
        readers to follow a height; they are shown where they stand behind the map
    """
    arrays: dict[str, Any] = {}
    corners = frame.corners()
    for number in range(CORNERS):
        here, there = corners[number], corners[(number + 1) % CORNERS]
        segments, labels = _upright(frame, marks, here, there)
        labels.append((segments[0][1] + 0.05 * UP, title))
        _add_scale(frame, segments, labels, (here, there))
        arrays[f"axes{number}.segments"] = np.array(segments)
        arrays[f"axes{number}.points"] = np.array([point for point, _ in labels])
        arrays[f"axes{number}.texts"] = np.array([text for _, text in labels])
        lines = [(np.append(here, height), np.append(there, height)) for height, _ in marks]
        arrays[f"side{number}.segments"] = np.array(lines)
    return arrays


def _upright(
    frame: Frame, marks: list[tuple[float, str]], here: Floats, there: Floats
) -> tuple[list[Any], list[tuple[Floats, str]]]:
    """The axis upwards at a corner, with a tick and a label at every mark."""
    along, out = _directions(here, there)
    corner = np.append(here, 0.0) - 0.02 * along + 0.02 * out
    segments: list[Any] = [(corner, corner + frame.height * UP)]
    labels = []
    for height, text in marks:
        tick = corner + height * UP
        segments.append((tick, tick - 0.015 * along))
        labels.append((tick - 0.05 * along, text))
    return segments, labels


def _add_scale(
    frame: Frame, segments: list[Any], labels: list[Any], edge: tuple[Floats, Floats]
) -> None:
    """The scale along an edge of the map, and north at its end; none without a CRS."""
    here, there = edge
    length = float(np.hypot(*(there - here)))
    bar = frame.plane.scale_bar(0.3 * length * frame.side)
    if bar is None:
        return
    along, out = _directions(here, there)
    near = np.append(here, 0.0) + 0.05 * out
    far = near + bar[0] / frame.side * along
    segments.append((near, far))
    labels.append(((near + far) / 2 + 0.035 * out, bar[1]))
    foot = np.append(there, 0.0) + 0.07 * along - 0.06 * out
    head = foot + 0.1 * NORTH
    segments.append((foot, head))
    segments.extend((head, head - 0.03 * NORTH + x * EAST) for x in (-0.012, 0.012))
    labels.append((head + 0.045 * NORTH, "N"))


def _directions(here: Floats, there: Floats) -> tuple[Floats, Floats]:
    """Along an edge of the map, and away from the map, of length 1."""
    along = np.append((there - here) / np.hypot(*(there - here)), 0.0)
    return along, np.array([along[1], -along[0], 0.0])
