"""Pictures and films in space and time, what happens where none can be drawn, and VTK's files."""

from __future__ import annotations

from collections.abc import Iterable
from ctypes.util import find_library
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mapped_network import states_with_a_queue, two_way_road
from matplotlib.colors import to_rgb
from matplotlib.image import imread

from uxsim_geo.errors import InputError
from uxsim_geo.export.colours import SPEED_CLASSES
from uxsim_geo.export.space_time import drawing, vtk
from uxsim_geo.export.space_time.drawing import RenderError, write_film, write_still
from uxsim_geo.export.space_time.look import Look
from uxsim_geo.export.space_time.scene import space_time_scene
from uxsim_geo.export.space_time.surface import surface_scene
from uxsim_geo.export.space_time.vtk import RIBBON, ROAD, WAY, write_vtk

OFF_SCREEN = find_library("EGL") is not None or find_library("OSMesa") is not None
needs_opengl = pytest.mark.skipif(
    not OFF_SCREEN, reason="needs libegl1 and libgl1-mesa-dri, or libosmesa6"
)
SMALL = Look(title="A queue for $5 & $6", size=(800, 600), show=("ribbons", "queues", "time_plane"))


def small_scene() -> dict:
    network = two_way_road()
    return space_time_scene(network, states_with_a_queue(network), SMALL)


def pixels_of(picture: np.ndarray, number: int) -> int:
    """How many pixels of a picture have about the hue of a class: light and shade change them."""
    wanted = np.array(to_rgb(SPEED_CLASSES[number].colour))
    colour = picture[:, :, :3].astype(float)
    colour = colour / 255 if colour.max() > 1 else colour
    strength = (colour @ wanted) / (wanted @ wanted)
    off = np.abs(colour - strength[:, :, None] * wanted).max(axis=2)
    return int(np.count_nonzero((off < 0.05) & (strength > 0.55) & (strength < 1.05)))


@needs_opengl
@pytest.mark.parametrize("camera", ["south", "above"])
def test_a_still_shows_the_queue_in_its_colour(tmp_path: Path, camera: str) -> None:
    path = tmp_path / "space_time.png"
    write_still(path, small_scene(), SMALL, camera)
    picture = imread(path)
    assert picture.shape[:2] == (600, 800)
    above_the_legend = picture[: int(600 * 0.8)]
    assert pixels_of(above_the_legend, 0) > 60
    assert pixels_of(above_the_legend, 4) == 0  # nobody drives at free speed as a wall
    assert [file.name for file in tmp_path.iterdir()] == ["space_time.png"]


@needs_opengl
def test_the_terrain_is_drawn_like_any_scene(tmp_path: Path) -> None:
    network = two_way_road()
    scene = surface_scene(network, states_with_a_queue(network), SMALL)
    write_still(tmp_path / "a.png", scene, Look(size=(640, 480)))
    assert imread(tmp_path / "a.png")[:400].std() > 0.02


@needs_opengl
def test_walls_grow_with_the_time_of_a_sweep_and_an_orbit_turns(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: dict[str, list[np.ndarray]] = {}

    def keep(path: Path, pictures: Iterable[np.ndarray], frame_ms: float) -> None:
        assert frame_ms == 80.0
        shown[motion] = [picture[: int(0.8 * 600)] for picture in pictures]
        path.write_bytes(b"film")

    monkeypatch.setattr(drawing, "write_mp4", keep)
    monkeypatch.setattr(drawing, "check_film", lambda *_: None)
    for motion in ("sweep", "orbit"):
        done: list[float] = []
        target = tmp_path / f"{motion}.mp4"
        write_film(target, small_scene(), SMALL, motion=motion, pictures=4, progress=done.append)
        assert done == [0.25, 0.5, 0.75, 1.0]
    # the first half is at half speed, and they stand in the second half alone
    standing = [pixels_of(picture, 0) for picture in shown["sweep"]]
    assert max(standing[:2]) < 1_000  # their road on the ground
    assert 10_000 < standing[2] < standing[3] / 2
    half_speed = [pixels_of(picture, 2) for picture in shown["sweep"]]
    assert 0 < half_speed[0] < half_speed[1]
    turned = np.abs(shown["orbit"][0].astype(int) - shown["orbit"][2])
    assert np.count_nonzero(turned > 60) > 1000


@needs_opengl
def test_a_film_is_an_mp4_of_all_pictures(tmp_path: Path) -> None:
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    path = tmp_path / "a.mp4"
    write_film(path, small_scene(), SMALL, motion="orbit", pictures=3, frame_ms=100.0)
    assert imageio_ffmpeg.count_frames_and_secs(str(path)) == (3, pytest.approx(0.3))
    assert [file.name for file in tmp_path.iterdir()] == ["a.mp4"]


def test_a_film_has_another_name_only_with_a_fault(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.gif or \.mp4"):
        write_film(tmp_path / "film.avi", small_scene(), SMALL, motion="orbit")


@pytest.fixture
def without_drivers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a screen and without drivers VTK takes the process down."""
    if find_library("OSMesa") is not None:
        pytest.skip("OSMesa draws without drivers")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_DIRS", str(tmp_path / "none"))
    monkeypatch.setenv("LIBGL_DRIVERS_PATH", str(tmp_path / "none"))


@pytest.mark.usefixtures("without_drivers")
def test_death_of_the_drawing_process_names_the_packages(tmp_path: Path) -> None:
    with pytest.raises(RenderError, match="libegl1 and libgl1-mesa-dri"):
        write_still(tmp_path / "a.png", small_scene(), SMALL)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("without_drivers")
def test_death_before_the_first_picture_of_a_film_says_the_same(tmp_path: Path) -> None:
    pytest.importorskip("imageio_ffmpeg")
    with pytest.raises(RenderError, match="libegl1 and libgl1-mesa-dri"):
        write_film(tmp_path / "a.mp4", small_scene(), SMALL, motion="sweep")
    assert list(tmp_path.iterdir()) == []


def test_an_error_in_the_drawing_process_is_passed_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(drawing, "RENDERER", tmp_path / "gone.py")
    with pytest.raises(RenderError, match=r"gone\.py"):
        write_still(tmp_path / "a.png", small_scene(), SMALL)
    assert list(tmp_path.iterdir()) == []


def test_a_drawing_process_that_never_ends_is_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("imageio_ffmpeg")
    stuck = tmp_path / "stuck.py"
    stuck.write_text("import threading\nthreading.Event().wait()\n", encoding="utf-8")
    monkeypatch.setattr(drawing, "RENDERER", stuck)
    monkeypatch.setattr(drawing, "TIME_LIMIT", 0.1)
    with pytest.raises(RenderError, match=r"more than 0\.1 s"):
        write_film(tmp_path / "a.mp4", small_scene(), SMALL, motion="sweep")
    with pytest.raises(RenderError, match=r"timed out after 0\.1 seconds"):
        write_still(tmp_path / "a.png", small_scene(), SMALL)
    assert list(tmp_path.iterdir()) == [stuck]


def text_values(mesh: Any, name: str) -> list[str]:
    array = mesh.GetFieldData().GetAbstractArray(name)
    return [array.GetValue(row) for row in range(array.GetNumberOfValues())]


@pytest.mark.parametrize("ending", ["vtp", "vtkhdf"])
def test_files_for_paraview_hold_all_states_in_metres_and_seconds(
    tmp_path: Path, ending: str
) -> None:
    import pyvista as pv

    network = two_way_road()
    network.links["link_id"] = names = ["Straße 🚗", "link 1"]
    way = np.array([(0.0, 0.0, 0.0), (1000.0, 0.0, 50.0)])
    path = tmp_path / f"space_time.{ending}"
    states = states_with_a_queue(two_way_road())
    states["link_id"] = np.repeat(names, 2)
    write_vtk(path, network, states, [way], "© Ähm")
    mesh = pv.read(path)
    part = mesh.cell_data["part"]
    # two roads, a way, and three states with somebody there
    assert part.tolist() == [ROAD, ROAD, WAY, RIBBON, RIBBON, RIBBON]
    assert mesh.cell_data["link"].tolist() == [0, 1, -1, 0, 0, 1]
    assert text_values(mesh, "link_id") == names
    assert text_values(mesh, "attribution") == ["© Ähm"]
    assert mesh.field_data["origin"].tolist() == [500.0, 0.0]
    assert mesh.bounds == pytest.approx((-500, 500, 0, 0, 0, 200))
    ribbons = {name: values[part == RIBBON] for name, values in mesh.cell_data.items()}
    assert ribbons["begin_s"].tolist() == [0, 100, 0]
    assert ribbons["end_s"].tolist() == [100, 200, 100]
    assert ribbons["speed_kmh"] == pytest.approx([3.6 * 1975 / 190, 0, 72])
    assert ribbons["speed_percent"] == pytest.approx([100 * 1975 / 190 / 20, 0, 100])
    assert ribbons["density_vpkm"] == pytest.approx([9.5, 10, 2.5])
    assert ribbons["queue_m"] == pytest.approx([50, 50, 0])
    assert np.isnan(mesh.cell_data["speed_kmh"][:3]).all()
    corners = mesh.get_cell(4).points
    assert corners.tolist() == [
        pytest.approx(corner)
        for corner in [(-500, 0, 100), (500, 0, 100), (500, 0, 200), (-500, 0, 200)]
    ]
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def test_a_vtp_file_is_the_same_each_time(tmp_path: Path) -> None:
    network = two_way_road()
    paths = [tmp_path / "a.vtp", tmp_path / "b.vtp"]
    for path in paths:
        write_vtk(path, network, states_with_a_queue(network))
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_too_many_ribbons_and_other_endings_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    network = two_way_road()
    states = states_with_a_queue(network)
    with pytest.raises(InputError, match=r"\.vtp or \.vtkhdf"):
        write_vtk(tmp_path / "a.glb", network, states)
    monkeypatch.setattr(vtk, "MOST_QUADS", 2)
    with pytest.raises(InputError, match="3 ribbons for ParaView, of at most 2: take longer time"):
        write_vtk(tmp_path / "a.vtp", network, states)
    assert list(tmp_path.iterdir()) == []
