"""Cameras for a scene in space and time: what must be seen, and from where most of it is."""

from __future__ import annotations

from typing import Any

import numpy as np

from uxsim_geo.analysis.types import Floats
from uxsim_geo.export.space_time.camera import DIRECTIONS, View, left_corner, towards, view
from uxsim_geo.export.space_time.look import Camera, Look

SIDES = ("south", "west", "east", "north")
BETTER = 1.2  # so much more must be seen from another side than from the south, where north is up


def direction_of(scene: dict[str, Any], look: Look, camera: Camera) -> Floats:
    """Unit vector to a camera's viewer."""
    return towards(*DIRECTIONS[best_side(scene, look) if camera == "auto" else camera])


def best_side(scene: dict[str, Any], look: Look) -> str:
    """The side from which walls are seen largest: not from their ends, and not from afar."""
    seen = {side: _seen(scene, look, towards(*DIRECTIONS[side])) for side in SIDES}
    best = max(SIDES, key=lambda side: seen[side])
    return best if seen[best] > BETTER * seen["south"] else "south"


def _seen(scene: dict[str, Any], look: Look, direction: Floats) -> float:
    """Area of the faces of ribbons as a viewer there sees it, if none hides another."""
    points = scene["ribbons.points"][scene["ribbons.faces"]]
    # a cross product of a quad's diagonals is twice its area, along its normal
    twice = np.cross(points[:, 2] - points[:, 0], points[:, 3] - points[:, 1])
    one = view_of(scene, look, direction)
    distance = float(np.linalg.norm(one.position - one.focus))
    return float(np.abs(twice @ direction).sum()) / distance**2


def view_of(scene: dict[str, Any], look: Look, direction: Any) -> View:
    """From a direction all that must be seen: map, axes, sides behind, and what stands on it."""
    corners = scene["corners"]
    left = left_corner(corners, direction)
    ground = np.column_stack([corners, np.zeros(4)])
    behind = np.roll(ground, -left, axis=0)[2:] + np.array([0.0, 0.0, float(scene["height"])])
    parts = (scene[f"{name}.points"] for name in (f"axes{left}", "ribbons", "queues", "marks"))
    return view(np.concatenate([ground, behind, *parts]), direction, look.size[0] / look.size[1])
