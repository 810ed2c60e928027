"""``space_time.png``: every link as a ribbon on the map, time upwards, speed as colour.

Another process draws it, because VTK does not raise an error where the system has no OpenGL: it
takes the process with it.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

from uxsim_geo.export.space_time_scene import space_time_scene
from uxsim_geo.files import replace_when_complete
from uxsim_geo.network.network import Network

RENDERER = Path(__file__).with_name("space_time_render.py")
TIME_LIMIT = 300.0  # s; the largest scene takes a few, the first picture on a machine some 20


class RenderError(RuntimeError):
    """The 3D picture could not be drawn, for the reason given; everything else can."""


def write_space_time(path: Path, network: Network, states: pd.DataFrame, title: str) -> None:
    """Draw the states of the links that had traffic as ribbons in space and time.

    Where there are many links only states below 80 % of the free speed become ribbons; the
    picture says so. ``states`` comes from :func:`uxsim_geo.analysis.link_states.link_times`. Raises
    :class:`RenderError` if the drawing process dies, and ValueError if the network has no geometry.
    """
    scene = space_time_scene(network, states, title)
    with tempfile.TemporaryDirectory() as folder, replace_when_complete(path) as temporary:
        arrays = Path(folder) / "scene.npz"
        np.savez(arrays, **scene)
        _render(arrays, temporary)


def _render(arrays: Path, picture: Path) -> None:
    """Let another process draw; -P keeps its folder's names from hiding installed packages."""
    command = [sys.executable, "-P", str(RENDERER), str(arrays), str(picture)]
    try:
        child = subprocess.run(
            command,
            capture_output=True,
            encoding="utf-8",
            errors="replace",
            check=False,
            timeout=TIME_LIMIT,
        )
    except (OSError, subprocess.TimeoutExpired) as reason:
        raise RenderError(str(reason)) from reason
    if 0 < child.returncode < 128:  # Python's own: an exception, not a death
        last = child.stderr.strip().splitlines()[-1:] or ["no message"]
        raise RenderError(last[0])
    if child.returncode != 0:
        raise RenderError(
            f"the drawing process died ({child.returncode}), most likely because this system has "
            "no OpenGL without a screen. Install the packages libegl1 and libgl1-mesa-dri, or "
            "libosmesa6 with the environment variable "
            "VTK_DEFAULT_OPENGL_WINDOW=vtkOSOpenGLRenderWindow"
        )
