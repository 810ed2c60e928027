"""Where a viewer of a picture in space and time stands."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from uxsim_geo.analysis.types import Floats

VIEW_ANGLE = 30.0  # degrees from the lower to the upper edge
ASIDE = 19.0  # degrees from the side of the map, for no street to be seen from its end alone
ELEVATION = 35.0  # degrees above the ground

#: where the viewer stands: degrees counter-clockwise from the east, and above the ground
DIRECTIONS: dict[str, tuple[float, float]] = {
    "south": (-90.0 + ASIDE, ELEVATION),
    "east": (ASIDE, ELEVATION),
    "north": (90.0 + ASIDE, ELEVATION),
    "west": (180.0 + ASIDE, ELEVATION),
    "above": (-90.0, 65.0),
}

#: the part of the window for the scene, between texts: left, right, bottom, top (0 to 1); below
#: it there is room for half a label of the axes
ROOM = (0.03, 0.97, 0.20, 0.95)


class View(NamedTuple):
    """A camera: position, focal point and what is up, each of shape (3,)."""

    position: Floats
    focus: Floats
    up: Floats

    @property
    def direction(self) -> Floats:
        """Unit vector to the viewer."""
        way = self.position - self.focus
        unit: Floats = way / np.linalg.norm(way)
        return unit


def towards(azimuth: float, elevation: float) -> Floats:
    """Unit vector to a viewer; degrees counter-clockwise from the east, and above the ground."""
    a, e = np.radians(azimuth), np.radians(elevation)
    return np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])


def view(points: Floats, direction: Floats, aspect: float) -> View:
    """From a direction as near as it shows all points (n, 3) in ROOM, and those amid it.

    A point at x to the right of and w before the focal plane is seen at x / (D - w); that it lies
    inside an edge is linear in the distance D and in the shift of the focus, for every edge.
    ``aspect`` is that of the window, width / height.
    """
    right, up = _axes(direction)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    points = points - middle
    before = points @ direction
    limits = _limits(aspect)
    spans = []
    for axis, (low, high) in zip((right, up), limits, strict=True):
        along = points @ axis
        spans.append((np.max(along + high * before), np.min(along + low * before), low, high))
    distance = max((most - least) / (high - low) for most, least, low, high in spans)
    shifts = [
        (most - high * distance + least - low * distance) / 2 for most, least, low, high in spans
    ]
    focus = middle + shifts[0] * right + shifts[1] * up
    return View(focus + distance * direction, focus, np.array([0.0, 0.0, 1.0]))


def left_corner(corners: Floats, direction: Floats) -> int:
    """Which of the map's corners (4, 2) a viewer in a direction sees at the left."""
    right, _ = _axes(direction)
    return int(np.argmin(corners @ right[:2]))


def _axes(direction: Floats) -> tuple[Floats, Floats]:
    """What is to the right and upwards for a viewer there."""
    right = np.cross((0.0, 0.0, 1.0), direction)
    right /= np.linalg.norm(right)
    return right, np.cross(direction, right)


def _limits(aspect: float) -> Floats:
    """Tangents of the angles to the edges of ROOM: (left, right), (bottom, top)."""
    half = np.tan(np.radians(VIEW_ANGLE / 2))
    edges = (2 * np.reshape(ROOM, (2, 2)) - 1) * half
    return np.array([edges[0] * aspect, edges[1]])
