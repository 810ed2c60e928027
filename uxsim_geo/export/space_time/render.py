"""Draws 3D pictures; run as a program of its own, because a machine without OpenGL kills it.

    python render.py SCENE.npz PICTURE.png      the first view, as a file
    python render.py SCENE.npz -                all views, as RGB bytes to the output

It knows nothing of traffic: SCENE holds arrays and texts made by
:mod:`uxsim_geo.export.space_time.scene`, which also says what they mean, and beside them

views.position, views.focus, views.up, views.corner
    cameras, (n, 3) each, and the number of the map's corner that is seen at the left
views.plane, views.until, views.text
    height of the time plane, and up to which walls are seen (NaN: none, and all), and the clock
size, view_angle, font
    pixels, degrees from the lower to the upper edge, and a file of letters
"""

from __future__ import annotations

import os
import sys
import textwrap
from collections.abc import Iterator
from typing import Any

import numpy as np

#: pyvista's own annotations of its decorated methods are too narrow to be checked against
Plotter = Any

DARK = "#333333"
SIDES = 4
USUAL_WIDTH = 1600  # pixels; sizes of letters here are for it
NONE_TEXT = " "
SMALL = 7  # letters of the smallest text


class Stage:
    """A plotter with what stands still, and the actors that change from view to view."""

    def __init__(self, scene: Any, *, still: bool) -> None:
        import pyvista as pv

        self.scene = scene
        size = [int(pixels) for pixels in scene["size"]]
        self.fine = size[0] / USUAL_WIDTH  # texts and lines grow with the picture
        window: Any = pv.Plotter
        self.plotter: Plotter = window(off_screen=True, window_size=size, lighting="none")
        self.plotter.set_background("white")
        self._add_light()
        self._add_ground()
        self.walls = [self._add_boxes("ribbons"), self._add_boxes("queues")]
        self.walls += [self._add_lines("trajectories", line_width=1.5, opacity=0.5)]
        self._add_segments(scene["feet"], color=DARK, line_width=1.2, opacity=0.3)
        self.axes = [self._add_axes(number) for number in range(SIDES)]
        self.sides = [self._add_side(number) for number in range(SIDES)]
        self.plane = self._add_plane()
        self._add_marks()
        self._add_texts()
        self.clock = self._text(NONE_TEXT, 0.015, 0.9, 15)
        self.plotter.enable_anti_aliasing("ssaa" if still else "msaa")
        self.plotter.camera.view_angle = float(scene["view_angle"])

    def show(self, number: int) -> None:
        """Set camera, axes, time plane and clock to those of a view."""
        scene, camera = self.scene, self.plotter.camera
        camera.position = scene["views.position"][number]
        camera.focal_point = scene["views.focus"][number]
        camera.up = scene["views.up"][number]
        self.plotter.reset_camera_clipping_range()
        for corner, actors in enumerate(self.axes):
            for actor in actors:
                actor.SetVisibility(corner == int(scene["views.corner"][number]))
        towards = scene["views.position"][number] - scene["views.focus"][number]
        for actor, outwards in zip(self.sides, self._outwards(), strict=True):
            actor.SetVisibility(bool(outwards @ towards[:2] < 0))
        self._cut(float(scene["views.until"][number]))
        height = float(scene["views.plane"][number])
        for actor in self.plane:
            actor.SetVisibility(bool(np.isfinite(height)))
            actor.SetPosition(0.0, 0.0, np.nan_to_num(height))
        self.clock.SetInput(str(scene["views.text"][number]) or NONE_TEXT)

    def _cut(self, until: float) -> None:
        """Hide walls above a height."""
        from vtkmodules.vtkCommonDataModel import vtkPlane

        for actor in (actor for actor in self.walls if actor is not None):
            actor.mapper.RemoveAllClippingPlanes()
            if np.isfinite(until):
                plane = vtkPlane()
                plane.SetOrigin(0.0, 0.0, until)
                plane.SetNormal(0.0, 0.0, -1.0)
                actor.mapper.AddClippingPlane(plane)

    def _outwards(self) -> list[Any]:
        corners = self.scene["corners"]
        ways = np.roll(corners, -1, axis=0) - corners
        return [np.array([y, -x]) for x, y in ways]

    def _add_light(self) -> None:
        """From over the viewer's left shoulder: faces that look elsewhere differ in shade."""
        import pyvista as pv

        light = pv.Light(position=(-0.6, 0.4, 1.0), light_type="camera light")
        self.plotter.add_light(light)

    def _add_ground(self) -> None:
        """The map on a pale sheet."""
        import pyvista as pv

        x0, y0, x1, y1 = self.scene["ground"]
        sheet = pv.Plane(
            center=((x0 + x1) / 2, (y0 + y1) / 2, -0.002), i_size=x1 - x0, j_size=y1 - y0
        )
        self.plotter.add_mesh(sheet, color="#f6f6f3", lighting=False)
        self._add_lines("minor", line_width=1)
        self._add_lines("major", line_width=2)
        self._add_lines("slow", line_width=5)

    def _mesh(self, name: str) -> Any:
        """A mesh of the scene with its colours; None where it is empty."""
        import pyvista as pv

        kind = "faces" if f"{name}.faces" in self.scene else "lines"
        rows = self.scene[f"{name}.{kind}"]
        if not len(rows):
            return None
        cells = np.column_stack([np.full(len(rows), rows.shape[1]), rows]).ravel()
        make: Any = pv.PolyData
        mesh = make(self.scene[f"{name}.points"], **{kind: cells})
        mesh.cell_data["rgb"] = self.scene[f"{name}.rgb"].astype(np.uint8)
        return mesh

    def _add_lines(self, name: str, **look: Any) -> Any:
        mesh = self._mesh(name)
        if mesh is None:
            return None
        look["line_width"] *= self.fine
        return self.plotter.add_mesh(mesh, scalars="rgb", rgb=True, lighting=False, **look)

    def _add_boxes(self, name: str) -> Any:
        mesh = self._mesh(name)
        if mesh is None:
            return None
        shade = {"ambient": 0.7, "diffuse": 0.42, "specular": 0.0}
        edges = {"show_edges": True, "edge_color": DARK, "edge_opacity": 0.25}
        edges["line_width"] = 0.5 * self.fine
        return self.plotter.add_mesh(mesh, scalars="rgb", rgb=True, **shade, **edges)

    def _add_segments(self, segments: Any, **look: Any) -> Any:
        """Straight lines, shape (n, 2, 3); none at all is no error."""
        import pyvista as pv

        if not len(segments):
            return None
        rows = np.arange(2 * len(segments)).reshape(-1, 2)
        lines = np.column_stack([np.full(len(segments), 2), rows])
        mesh = pv.PolyData(segments.reshape(-1, 3), lines=lines.ravel())
        look["line_width"] *= self.fine
        return self.plotter.add_mesh(mesh, lighting=False, **look)

    def _add_axes(self, number: int) -> list[Any]:
        lines = self._add_segments(
            self.scene[f"axes{number}.segments"], color="black", line_width=3
        )
        labels = self._add_labels(f"axes{number}", font_size=21)
        return [actor for actor in (lines, labels) if actor is not None]

    def _add_side(self, number: int) -> Any:
        """Lines at round times on a side of the map."""
        segments = self.scene[f"side{number}.segments"]
        return self._add_segments(segments, color="#9aa0ab", line_width=1)

    def _add_plane(self) -> list[Any]:
        """A sheet at one time, lying on the ground until it is moved."""
        import pyvista as pv

        x0, y0, x1, y1 = self.scene["ground"]
        sheet = pv.Plane(center=((x0 + x1) / 2, (y0 + y1) / 2, 0), i_size=x1 - x0, j_size=y1 - y0)
        look = {"color": "#5b7fa6", "lighting": False}
        corners = np.column_stack([self.scene["corners"], np.zeros(SIDES)])
        border = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
        return [
            self.plotter.add_mesh(sheet, opacity=0.22, **look),
            self._add_segments(border, color="#3d5a7a", line_width=2),
        ]

    def _add_labels(self, name: str, **look: Any) -> Any:
        points = self.scene[f"{name}.points"]
        if not len(points):
            return None
        size = max(round(look.pop("font_size") * self.fine), 7)
        return self.plotter.add_point_labels(
            points,
            [_plain(text) for text in self.scene[f"{name}.texts"]],
            show_points=False,
            always_visible=True,
            shape=None,
            font_size=size,
            font_file=str(self.scene["font"]),
            justification_horizontal="center",
            justification_vertical="center",
            **({"bold": False, "text_color": "black"} | look),
        )

    def _add_marks(self) -> None:
        """Poles with numbers."""
        points = self.scene["marks.points"]
        if len(points):
            poles = np.stack([points * (1.0, 1.0, 0.0), points], axis=1)
            self._add_segments(poles, color="black", line_width=2)
            look = {"background_color": "#222222", "background_opacity": 1.0}
            self._add_labels("marks", font_size=24, text_color="white", **look)

    def _add_texts(self) -> None:
        """Title, where most time is lost, what is drawn, whose data it is, and the colour bar."""
        scene = self.scene
        lift = self._add_attribution()
        self._text(str(scene["title"]), 0.015, 0.945, 17)
        self._text("\n".join(str(note) for note in scene["notes"]), 0.015, 0.075 + lift, 10)
        self._text(str(scene["subtitle"]), 0.015, 0.017 + lift, 9)
        self._add_bar(lift)

    def _add_attribution(self) -> float:
        """Whose data it is, at the foot; what its lines but one take, of the picture's height."""
        width, height = (float(pixels) for pixels in self.scene["size"])
        letter = 2.0 * self._font_size(SMALL)  # its height, pixels
        lines = textwrap.wrap(str(self.scene["attribution"]), int(0.98 * width / (0.58 * letter)))
        text = self._text("\n".join(lines), 0.995, 0.001, SMALL)
        text.prop.justification_horizontal = "right"
        return 1.25 * letter / height * max(len(lines) - 1, 0)

    def _text(self, text: str, x: float, y: float, size: int) -> Any:
        return self.plotter.add_text(
            _plain(text) or NONE_TEXT,
            position=(x, y),
            viewport=True,
            font_size=self._font_size(size),
            color=DARK,
            font_file=str(self.scene["font"]),
        )

    def _font_size(self, size: int) -> int:
        return max(round(size * self.fine), 5)

    def _add_bar(self, lift: float) -> None:
        """A bar of even classes; it needs a mesh that has them, which nobody sees."""
        import pyvista as pv
        from matplotlib.colors import ListedColormap

        labels = [float(text) for text in self.scene["scale_labels"]]
        mesh = pv.PolyData(np.zeros((2, 3)))
        mesh.point_data["scale"] = [labels[0], labels[-1]]
        title = f"{self.scene['scale_title']}\n"
        self.plotter.add_mesh(
            mesh,
            scalars="scale",
            opacity=0.0,
            cmap=ListedColormap(self.scene["scale_rgb"] / 255),
            clim=(labels[0], labels[-1]),
            scalar_bar_args={
                "title": title,
                "n_labels": len(labels),
                "n_colors": len(labels) - 1,
                "fmt": "%g",
                "color": DARK,
                "title_font_size": round(22 * self.fine),
                "label_font_size": round(20 * self.fine),
                "position_x": 0.62,
                "position_y": 0.075 + lift,
                "width": 0.34,
                "height": 0.1,
            },
        )

    def pictures(self) -> Iterator[Any]:
        """Every view, one after the other, as an array (height, width, 3)."""
        for number in range(len(self.scene["views.position"])):
            self.show(number)
            self.plotter.render()
            yield self.plotter.screenshot(return_img=True)


def _plain(text: object) -> str:
    """A text that VTK takes literally: it would set what stands between dollars as a formula."""
    return str(text).replace("$", r"\$")


def main(scene: Any, target: str) -> None:
    """Draw one picture into a file, or all to the standard output."""
    if target != "-":
        stage = Stage(scene, still=True)
        stage.show(0)
        stage.plotter.screenshot(target)
        return
    # what libraries print goes elsewhere: the output is for pictures alone
    with os.fdopen(os.dup(1), "wb") as output:
        os.dup2(2, 1)
        for picture in Stage(scene, still=False).pictures():
            output.write(np.ascontiguousarray(picture[:, :, :3]).tobytes())
            output.flush()


if __name__ == "__main__":
    with np.load(sys.argv[1], allow_pickle=False) as arrays:
        main(dict(arrays), sys.argv[2])
