"""Lost time as a terrain over the map: the higher, the more, with the roads draped over it."""

from __future__ import annotations

from typing import Any

import numpy as np

from uxsim_geo.analysis.state_grid import StateGrid, States
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.export.lost_time import in_words
from uxsim_geo.export.map_plane import MapPlane
from uxsim_geo.export.space_time.bins import coarser
from uxsim_geo.export.space_time.choice import Choice
from uxsim_geo.export.space_time.frame import Frame, axes
from uxsim_geo.export.space_time.look import Look
from uxsim_geo.export.space_time.places import place_parts
from uxsim_geo.export.space_time.roads import empty_parts, lines_mesh, road_meshes
from uxsim_geo.export.space_time.scale import DENSITIES, Scale, round_above
from uxsim_geo.network.network import Network

CELLS = 160  # along the larger side of the map
SMOOTH = 2.0  # standard deviation over which lost time is spread, in cells
CLASSES = ("#f3f1ec", *DENSITIES)


def surface_scene(network: Network, states: States, look: Look) -> dict[str, Any]:
    """Make a scene, as :mod:`uxsim_geo.export.space_time.scene` describes it, of lost time.

    The height is the time lost on links over the whole run, veh·h per km², spread along the line of
    each link and smoothed. Without a CRS it is veh·h per cell of the terrain.
    """
    plane = MapPlane.of(network)
    choice = Choice.of(network, coarser(states, network), plane, look)
    delay = StateGrid.of_all(states, network).values("delay").sum(axis=1) / 3600
    frame = Frame.of(plane, choice.box, 1.0)
    cell = frame.side / CELLS
    terrain, unit = _terrain(frame, cell, delay)
    steps = len(CLASSES)
    top = round_above(float(terrain.max()), steps) if terrain.max() > 0 else float(steps)
    scale = Scale(f"time lost, {unit}", top, CLASSES)
    heights = frame.height * terrain / top
    marks = [(frame.height * k / steps, label) for k, label in enumerate(scale.labels())]
    return {
        "title": f"{look.title}: where time is lost",
        **place_parts(network, states, frame, look),
        "subtitle": f"Time lost over the whole run, {unit}, as height and colour: "
        f"{in_words(3600 * float(delay.sum()))} in all",
        "attribution": look.attribution,
        "scale_title": scale.title,
        "scale_labels": np.array(scale.labels()),
        "scale_rgb": scale.rgb(),
        **_mesh(frame, cell, heights, scale, terrain),
        **_draped(road_meshes(network, frame, longest=cell), frame, cell, heights),
        **empty_parts("queues", "slow", "trajectories"),
        **axes(frame, marks, unit),
        "feet": np.empty((0, 2, 3)),
        "ground": frame.ground,
        "corners": frame.corners(),
        "height": frame.height,
    }


def _terrain(frame: Frame, cell: float, delay: Floats) -> tuple[Floats, str]:
    """Lost time at the corners of cells, shape (rows, columns), and its unit."""
    import shapely
    from scipy.ndimage import gaussian_filter

    lines = frame.plane.lines
    counts = np.clip(np.ceil(shapely.length(lines) / cell), 1, 10 * CELLS).astype(int)
    link = np.repeat(np.arange(len(lines)), counts)
    within = np.arange(len(link)) - np.repeat(np.cumsum(counts) - counts, counts)
    share = (within + 0.5) / counts[link]
    points = shapely.line_interpolate_point(lines[link], share, normalized=True)
    x, y = shapely.get_coordinates(points).T
    x0, y0, x1, y1 = frame.box
    columns, rows = (int(np.ceil(side / cell)) + 1 for side in (x1 - x0, y1 - y0))
    edges = [
        low + cell * (np.arange(count + 1) - 0.5) for low, count in ((y0, rows), (x0, columns))
    ]
    sums = np.histogram2d(y, x, edges, weights=(delay / counts)[link])[0]
    smooth: Floats = np.maximum(gaussian_filter(sums, SMOOTH, mode="constant"), 0.0)
    if frame.plane.metres_per_unit is None:
        return smooth, "veh·h per cell"
    return smooth / (cell * frame.plane.metres_per_unit / 1000) ** 2, "veh·h/km²"


def _mesh(
    frame: Frame, cell: float, heights: Floats, scale: Scale, terrain: Floats
) -> dict[str, Any]:
    """Quads between the corners of cells, in the class of their mean."""
    rows, columns = heights.shape
    x0, y0 = frame.box[:2]
    x, y = np.meshgrid(x0 + cell * np.arange(columns), y0 + cell * np.arange(rows))
    xy = frame.on_ground(np.stack([x.ravel(), y.ravel()], axis=1))
    number = np.arange(rows * columns).reshape(rows, columns)
    around = (number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1])
    faces: Integers = np.stack([one.ravel() for one in around], axis=1)
    mean = terrain.ravel()[faces].mean(axis=1)
    return {
        "ribbons.points": np.column_stack([xy, heights.ravel()]),
        "ribbons.faces": faces,
        "ribbons.rgb": scale.rgb()[scale.classes(mean)],
    }


def _draped(roads: dict[str, Any], frame: Frame, cell: float, heights: Floats) -> dict[str, Any]:
    """Roads on the terrain, just above it."""
    from scipy.ndimage import map_coordinates

    draped: dict[str, Any] = {}
    x0, y0 = frame.ground[:2]
    for name in ("minor", "major"):
        points = roads[f"{name}.points"]
        place = (points[:, :2] - (x0, y0)) * frame.side / cell
        above = map_coordinates(heights, place[:, ::-1].T, order=1, mode="nearest") + 0.0015
        drawn = np.column_stack([points[:, :2], above])
        draped |= lines_mesh(name, drawn, roads[f"{name}.lines"], roads[f"{name}.rgb"])
    return draped
