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
TOWARDS_THE_VIEWER = (0.35, -1.0, 0.75)


def render(scene: Any, picture: str) -> None:
    """Draw ribbons over ground lines, a time axis, a scale bar and north, and save a PNG."""
    import pyvista as pv

    plotter: Plotter = pv.Plotter(off_screen=True, window_size=list(WINDOW), lighting="none")
    plotter.set_background("white")
    _add_ground(plotter, scene)
    _add_ribbons(plotter, scene)
    _add_axes(plotter, scene)
    _write(plotter, str(scene["title"]), 0.955, 16)
    _write(plotter, str(scene["subtitle"]), 0.015, 10)
    plotter.enable_anti_aliasing("ssaa")
    plotter.enable_depth_peeling(8)
    plotter.view_vector(TOWARDS_THE_VIEWER, viewup=(0, 0, 1))
    plotter.camera.zoom(1.1)
    plotter.screenshot(picture)
    plotter.close()


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


def _add_axes(plotter: Plotter, scene: Any) -> None:
    """Straight black lines (time axis, its ticks, scale bar, north) and their labels."""
    import pyvista as pv

    segments = scene["segments"]
    lines = np.column_stack(
        [
            np.full(len(segments), 2),
            np.arange(0, 2 * len(segments), 2),
            1 + 2 * np.arange(len(segments)),
        ]
    )
    plotter.add_mesh(
        pv.PolyData(segments.reshape(-1, 3), lines=lines.ravel()), color="black", line_width=3
    )
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
