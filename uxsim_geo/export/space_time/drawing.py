"""Pictures and films in space and time: the map below, time upwards, slow links as walls.

Another process draws them, because VTK does not raise an error where the system has no OpenGL: it
takes the process with it.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, Literal

import numpy as np

from uxsim_geo.export.film import Progress, check_film
from uxsim_geo.export.gif import Picture
from uxsim_geo.export.mp4 import write_mp4
from uxsim_geo.export.space_time.camera import VIEW_ANGLE, View, left_corner, towards
from uxsim_geo.export.space_time.framing import direction_of, view_of
from uxsim_geo.export.space_time.look import Camera, Look
from uxsim_geo.files import replace_when_complete

RENDERER = Path(__file__).with_name("render.py")
TIME_LIMIT = 300.0  # s a picture; the largest takes a few, the first one on a machine some 20

Motion = Literal["orbit", "sweep"]


class RenderError(RuntimeError):
    """The 3D picture could not be drawn, for the reason given; everything else can."""


@dataclass(frozen=True)
class Shot:
    """What changes from picture to picture: camera, heights of plane and cut (NaN: none), clock."""

    view: View
    plane: float = np.nan
    until: float = np.nan
    text: str = ""


def write_still(path: Path, scene: dict[str, Any], look: Look, camera: Camera = "auto") -> None:
    """Draw a scene from one side as a PNG.

    ``scene`` comes from :func:`uxsim_geo.export.space_time.scene.space_time_scene`. Raises
    :class:`RenderError` if the drawing process dies.
    """
    one = view_of(scene, look, direction_of(scene, look, camera))
    shown = "time_plane" in look.show
    plane = (float(scene["plane"]), np.nan, str(scene["plane_text"])) if shown else ()
    shots = [Shot(one, *plane)]
    with _scene_file(scene, look, shots) as arrays:
        # not beside the result: should this process be killed, the drawing one goes on for a while
        picture = arrays.with_name("picture.png")
        _draw(arrays, picture)
        with replace_when_complete(path) as temporary:
            shutil.copyfile(picture, temporary)


def write_film(  # noqa: PLR0913 -- how it moves, by keyword alone
    path: Path,
    scene: dict[str, Any],
    look: Look,
    *,
    motion: Motion,
    camera: Camera = "auto",
    pictures: int = 120,
    frame_ms: float = 80.0,
    progress: Progress | None = None,
) -> None:
    """Draw a scene as an MP4: once round it, or with the time rising while its walls grow.

    Raises :class:`RenderError` if the drawing process dies, and what
    :func:`uxsim_geo.export.film.check_film` does.
    """
    check_film(path, frame_ms)
    move = _round if motion == "orbit" else _rising
    shots = move(scene, look, camera, pictures)
    with _scene_file(scene, look, shots) as arrays, replace_when_complete(path) as temporary:
        write_mp4(temporary, _drawn(arrays, look, len(shots), progress), frame_ms)


def _round(scene: dict[str, Any], look: Look, camera: Camera, pictures: int) -> list[Shot]:
    """Once round the scene at one distance."""
    x, y, z = direction_of(scene, look, camera)
    first, elevation = np.degrees(np.arctan2(y, x)), np.degrees(np.arcsin(z))
    azimuths = first + 360.0 * np.arange(pictures) / pictures
    views = [view_of(scene, look, towards(azimuth, elevation)) for azimuth in azimuths]
    # a little further than each needs, since one focus is not amid what all of them see
    distance = 1.07 * max(float(np.linalg.norm(one.position - one.focus)) for one in views)
    focus = np.mean([one.focus for one in views], axis=0)
    return [
        Shot(one._replace(position=focus + distance * one.direction, focus=focus)) for one in views
    ]


def _rising(scene: dict[str, Any], look: Look, camera: Camera, pictures: int) -> list[Shot]:
    """The time plane from the ground to the top, and walls up to it."""
    one = view_of(scene, look, direction_of(scene, look, camera))
    height, duration = float(scene["height"]), float(scene["duration"])
    shares, clock = np.arange(1, pictures + 1) / pictures, look.clock(scene["edges"])
    return [
        Shot(one, share * height, share * height, clock.text(share * duration)) for share in shares
    ]


def _drawn(arrays: Path, look: Look, pictures: int, progress: Progress | None) -> Iterator[Picture]:
    """Pictures as the drawing process sends them."""
    width, height = look.size
    with tempfile.TemporaryFile() as messages:
        child = _start(arrays, "-", messages)
        assert child.stdout is not None
        try:
            for number in range(pictures):
                with _at_most(TIME_LIMIT, child) as late:
                    sent = child.stdout.read(width * height * 3)
                if late:
                    raise RenderError(f"a picture of the film took more than {TIME_LIMIT:g} s")
                if len(sent) < width * height * 3:
                    break
                yield np.frombuffer(sent, np.uint8).reshape(height, width, 3)
                if progress is not None:
                    progress((number + 1) / pictures)
        except BaseException:
            child.kill()
            raise
        finally:
            child.stdout.close()
            status = child.wait()
        messages.seek(0)
        _check(status, messages.read().decode("utf-8", "replace"))


@contextmanager
def _at_most(seconds: float, child: subprocess.Popen[bytes]) -> Iterator[list[bool]]:
    """Kill a process that takes longer than this; the list then holds something."""
    late: list[bool] = []

    def end() -> None:
        late.append(True)
        child.kill()

    timer = threading.Timer(seconds, end)
    timer.start()
    try:
        yield late
    finally:
        timer.cancel()


@contextmanager
def _scene_file(scene: dict[str, Any], look: Look, shots: list[Shot]) -> Iterator[Path]:
    """A scene with its cameras as a file, for as long as it is needed."""
    import matplotlib

    font = Path(matplotlib.get_data_path()) / "fonts/ttf/DejaVuSans.ttf"
    views = {
        f"views.{name}": np.array([getattr(shot.view, name) for shot in shots])
        for name in View._fields
    }
    views["views.corner"] = np.array(
        [left_corner(scene["corners"], shot.view.direction) for shot in shots]
    )
    for name in ("plane", "until", "text"):
        views[f"views.{name}"] = np.array([getattr(shot, name) for shot in shots])
    with tempfile.TemporaryDirectory() as folder:
        arrays = Path(folder) / "scene.npz"
        told = {"size": np.array(look.size), "view_angle": VIEW_ANGLE, "font": str(font)}
        everything: dict[str, Any] = scene | views | told
        np.savez(arrays, **everything)
        yield arrays


def _start(arrays: Path, target: str, messages: IO[bytes]) -> subprocess.Popen[bytes]:
    """Let another process draw; -P keeps its folder's names from hiding installed packages."""
    command = [sys.executable, "-P", str(RENDERER), str(arrays), target]
    try:
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=messages)
    except OSError as reason:
        raise RenderError(str(reason)) from reason


def _draw(arrays: Path, picture: Path) -> None:
    """Draw one picture into a file."""
    with tempfile.TemporaryFile() as messages:
        child = _start(arrays, str(picture), messages)
        try:
            child.communicate(timeout=TIME_LIMIT)
        except subprocess.TimeoutExpired as reason:
            child.kill()
            child.communicate()
            raise RenderError(str(reason)) from reason
        messages.seek(0)
        _check(child.returncode, messages.read().decode("utf-8", "replace"))


def _check(status: int, messages: str) -> None:
    if 0 < status < 128:  # Python's own: an exception, not a death
        last = messages.strip().splitlines()[-1:] or ["no message"]
        raise RenderError(last[0])
    if status != 0:
        raise RenderError(
            f"the drawing process died ({status}), most likely because this system has "
            "no OpenGL without a screen. Install the packages libegl1 and libgl1-mesa-dri, or "
            "libosmesa6 with the environment variable "
            "VTK_DEFAULT_OPENGL_WINDOW=vtkOSOpenGLRenderWindow"
        )
