"""Draws one 3D picture; run as a program of its own, because a machine without OpenGL kills it.

    python space_time_render.py SCENE.npz PICTURE.png

It knows nothing of traffic: SCENE holds arrays and texts made by
:mod:`uxsim_geo.export.space_time_scene`, which also says what they mean.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

#: pyvista's own annotations of its decorated methods are too narrow to be checked against
Plotter = Any

WINDOW = (1600, 1200)
DARK = "#333333"
TOWARDS_THE_VIEWER = np.array([0.35, -1.0, 0.75]) / np.linalg.norm([0.35, -1.0, 0.75])
VIEW_ANGLE = 30.0  # degrees from the lower to the upper edge

#: the part of the window for the scene, between texts: left, right, bottom, top (0 to 1)
ROOM = (0.04, 0.96, 0.08, 0.87)


def render(scene: Any, picture: str) -> None:
    """Draw ribbons over ground lines, a time axis, a scale bar and north, and save a PNG."""
    import pyvista as pv

    plotter: Plotter = pv.Plotter(off_screen=True, window_size=list(WINDOW), lighting="none")
    plotter.set_background("white")
    _add_ground(plotter, scene)
    _add_ribbons(plotter, scene)
    _add_lines(plotter, scene["feet"], color=DARK, line_width=1.5, opacity=0.35)
    _add_axes(plotter, scene)
    _write(plotter, str(scene["title"]), 0.955, 16)
    _write(plotter, str(scene["subtitle"]), 0.012, 10)
    plotter.enable_anti_aliasing("ssaa")
    plotter.enable_depth_peeling(8)
    _aim(plotter, scene)
    plotter.screenshot(picture)
    plotter.close()


def _aim(plotter: Plotter, scene: Any) -> None:
    """Put the camera as near as the window's room for the scene allows, and the scene amid it."""
    x0, y0, x1, y1 = scene["ground"]
    corners = np.array([(x, y, 0.0) for x in (x0, x1) for y in (y0, y1)])
    parts = [corners, scene["points"], scene["segments"].reshape(-1, 3), scene["label_points"]]
    focus, distance = camera(np.concatenate(parts))
    plotter.camera.view_angle = VIEW_ANGLE
    plotter.camera.focal_point = focus
    plotter.camera.position = focus + distance * TOWARDS_THE_VIEWER
    plotter.camera.up = (0, 0, 1)
    plotter.reset_camera_clipping_range()


def camera(points: Any) -> tuple[Any, float]:
    """Focal point of a camera that shows all points (n, 3) in ROOM, and its distance from it.

    A point at x to the right of and w before the focal plane is seen at x / (D - w); that it lies
    inside an edge is linear in the distance D and in the shift of the focus, for every edge.
    """
    right = np.cross((0.0, 0.0, 1.0), TOWARDS_THE_VIEWER)
    right /= np.linalg.norm(right)
    up = np.cross(TOWARDS_THE_VIEWER, right)
    before = points @ TOWARDS_THE_VIEWER
    half = np.tan(np.radians(VIEW_ANGLE / 2))
    limits = (2 * np.array(ROOM) - 1) * half * np.array([WINDOW[0] / WINDOW[1]] * 2 + [1.0] * 2)
    spans = []
    for axis, low, high in ((right, *limits[:2]), (up, *limits[2:])):
        along = points @ axis
        spans.append((np.max(along + high * before), np.min(along + low * before), low, high))
    distance = max((most - least) / (high - low) for most, least, low, high in spans)
    shifts = [
        (most - high * distance + least - low * distance) / 2 for most, least, low, high in spans
    ]
    return shifts[0] * right + shifts[1] * up, float(distance)


def _write(plotter: Plotter, text: str, height: float, size: int) -> None:
    plotter.add_text(text, position=(0.015, height), viewport=True, font_size=size, color=DARK)


def _add_ground(plotter: Plotter, scene: Any) -> None:
    """The road network on a pale sheet; grey where it always flowed freely."""
    import pyvista as pv
    from matplotlib.colors import ListedColormap

    x0, y0, x1, y1 = scene["ground"]
    sheet = pv.Plane(
        center=((x0 + x1) / 2, (y0 + y1) / 2, -0.002 * (x1 - x0)),
        i_size=x1 - x0,
        j_size=y1 - y0,
    )
    plotter.add_mesh(sheet, color="#f3f3f0")
    roads = pv.PolyData(scene["road_points"], lines=scene["roads"])
    roads.cell_data["slowest"] = scene["road_speed"]
    colours = [*(str(colour) for colour in scene["colours"][:-1]), "#8a8a8a"]
    plotter.add_mesh(
        roads,
        scalars="slowest",
        cmap=ListedColormap(colours),
        clim=(0, 100),
        line_width=5,
        show_scalar_bar=False,
    )


def _add_ribbons(plotter: Plotter, scene: Any) -> None:
    """Quads with the colour of their class of speed; all classes are equally wide."""
    import pyvista as pv
    from matplotlib.colors import ListedColormap

    colours = [str(colour) for colour in scene["colours"]]
    if len(scene["quads"]) == 0:
        return
    ribbons = pv.PolyData(scene["points"], faces=scene["quads"])
    ribbons.cell_data["speed"] = scene["speed"]
    plotter.add_mesh(
        ribbons,
        scalars="speed",
        cmap=ListedColormap(colours),
        clim=(0, 100),
        opacity=scene["opacity"],
        show_scalar_bar=True,
        scalar_bar_args={
            "title": str(scene["speed_title"]),
            "n_labels": len(colours) + 1,
            "n_colors": len(colours),
            "fmt": "%.0f",
            "color": DARK,
            "title_font_size": 22,
            "label_font_size": 20,
            "position_x": 0.62,
            "position_y": 0.88,
            "width": 0.34,
            "height": 0.1,
        },
    )


def _add_lines(plotter: Plotter, segments: Any, **look: Any) -> None:
    """Straight lines, shape (n, 2, 3); none at all is no error."""
    import pyvista as pv

    if len(segments) == 0:
        return
    rows = np.arange(2 * len(segments)).reshape(-1, 2)
    lines = np.column_stack([np.full(len(segments), 2), rows])
    plotter.add_mesh(pv.PolyData(segments.reshape(-1, 3), lines=lines.ravel()), **look)


def _add_axes(plotter: Plotter, scene: Any) -> None:
    """Straight black lines (time axis, its ticks, scale bar, north) and their labels."""
    _add_lines(plotter, scene["segments"], color="black", line_width=3)
    plotter.add_point_labels(
        scene["label_points"],
        [str(label) for label in scene["labels"]],
        font_size=22,
        text_color="black",
        show_points=False,
        shape=None,
        always_visible=True,
        justification_horizontal="center",
        justification_vertical="center",
    )


if __name__ == "__main__":
    with np.load(sys.argv[1], allow_pickle=False) as arrays:
        render(dict(arrays), sys.argv[2])
