"""The map under a scene in space and time: its roads as straight lines on the ground."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.export.space_time.frame import Frame
from uxsim_geo.export.space_time.walls import SMOOTHED
from uxsim_geo.network.network import Network

MAJOR = ("motorway", "trunk", "primary", "secondary")
GREY = (178.0, 178.0, 178.0)
DARK_GREY = (128.0, 128.0, 128.0)


def road_meshes(network: Network, frame: Frame, longest: float | None = None) -> dict[str, Any]:
    """Minor and major roads that reach into what is shown, cut at its edge.

    ``longest`` is how long a straight line may be, in units of the map; None: as long as it is.
    """
    import shapely

    lines = shapely.clip_by_rect(frame.plane.lines, *frame.box)
    lines = shapely.simplify(lines, SMOOTHED * frame.side, preserve_topology=False)
    if longest is not None:
        lines = shapely.segmentize(lines, longest)
    major = _is_major(network)
    meshes: dict[str, Any] = {}
    for name, own, rgb in (("minor", ~major, GREY), ("major", major, DARK_GREY)):
        points, rows = _straight(frame, lines[own])
        meshes |= lines_mesh(name, points, rows, np.tile(rgb, (len(rows), 1)))
    return meshes


def lines_mesh(name: str, points: Floats, lines: Integers, rgb: Any) -> dict[str, Any]:
    """A mesh of a scene that is of straight lines: rows of their two points, and colours."""
    return {f"{name}.points": points, f"{name}.lines": lines, f"{name}.rgb": rgb}


def empty_parts(*names: str) -> dict[str, Any]:
    """Meshes of a scene that hold nothing."""
    parts: dict[str, Any] = {}
    for name in names:
        parts |= lines_mesh(name, np.empty((0, 3)), np.empty((0, 2), np.int64), np.empty((0, 3)))
    return parts


def _is_major(network: Network) -> npt.NDArray[np.bool_]:
    """Whether each link is a main road; all are where the classes are not those of streets."""
    if "road_class" not in network.links.columns:
        return np.ones(len(network.links), bool)
    class_ = network.links["road_class"].astype("string").str.removesuffix("_link")
    major = class_.isin(MAJOR).to_numpy(bool)
    return major if major.any() else np.ones(len(major), bool)


def _straight(frame: Frame, lines: npt.NDArray[Any]) -> tuple[Floats, Integers]:
    """Points on the ground and straight lines between them."""
    import shapely

    parts = shapely.get_parts(lines)
    points, part = shapely.get_coordinates(parts, return_index=True)
    rows = np.flatnonzero(part[1:] == part[:-1])
    on_ground = np.column_stack([frame.on_ground(points), np.zeros(len(points))])
    return on_ground, np.stack([rows, rows + 1], axis=1)
