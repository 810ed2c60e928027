"""The 3D picture: the scene by hand, the drawing, and what happens where nothing can be drawn."""

from __future__ import annotations

import itertools
from ctypes.util import find_library
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
from mapped_network import states_with_a_queue, two_way_road
from matplotlib.colors import to_rgb
from matplotlib.image import imread
from newell_link import network_of
from shapely.geometry import LineString

from uxsim_geo.export import space_time, space_time_render
from uxsim_geo.export import space_time_scene as scenes
from uxsim_geo.export.colours import SPEED_CLASSES
from uxsim_geo.export.space_time import RenderError, write_space_time
from uxsim_geo.export.space_time_scene import space_time_scene
from uxsim_geo.network.network import Network

OFF_SCREEN = find_library("EGL") is not None or find_library("OSMesa") is not None


def winding(network: Network) -> Network:
    """The same links with one corner each."""
    lines = [LineString([(0, 0), (500, 100), (1000, 0)])] * len(network.links)
    return Network(network.nodes, gpd.GeoDataFrame(network.links).set_geometry(lines))


def test_ribbons_stand_over_their_links_from_begin_to_end_of_the_bin() -> None:
    network = two_way_road()
    scene = space_time_scene(network, states_with_a_queue(network), "t")
    # the queue in both bins, the way back in the first only
    assert scene["quads"].reshape(-1, 5).tolist()[0] == [4, 0, 1, 2, 3]
    corners = scene["points"].reshape(3, 4, 3)
    assert corners[:, :, 2].tolist() == pytest.approx(
        scenes.HEIGHT * np.array([[0, 0, 0.5, 0.5], [0.5, 0.5, 1, 1], [0, 0, 0.5, 0.5]])
    )
    there, back = corners[0], corners[2]
    assert there[0, 0] < there[1, 0]
    assert back[0, 0] > back[1, 0]
    assert there[0, 1] < 0 < back[0, 1]
    # 1975 m in 190 s, standing, free
    assert scene["speed"] == pytest.approx([100 * 1975 / 190 / 20, 0, 100])
    assert scene["road_speed"] == pytest.approx([0, 100])


def test_a_few_slow_vehicles_do_not_look_like_a_queue() -> None:
    network = two_way_road()
    states = states_with_a_queue(network)
    scene = space_time_scene(network, states, "t")
    # 9.5 and 10 veh/km of 200 are traffic, 2.5 veh/km on the way back are few
    assert scene["opacity"][:2] == pytest.approx([scenes.OPACITIES[2], 1])
    assert scene["opacity"][2] == pytest.approx(scenes.OPACITIES[-1] * 2.5 / 6)
    sparse = space_time_scene(network, states.assign(density=states["density"] / 100), "t")
    assert sparse["road_speed"].tolist() == [100, 100]
    assert (sparse["opacity"] < 0.02).all()


def test_every_straight_piece_of_a_link_gets_a_ribbon() -> None:
    network = winding(two_way_road())
    scene = space_time_scene(network, states_with_a_queue(network), "t")
    assert len(scene["speed"]) == 3 * 2
    assert len(scene["road_speed"]) == 2 * 2
    corners = scene["points"].reshape(-1, 4, 3)
    assert corners[0, 1, :2] == pytest.approx(corners[1, 0, :2])  # one ends where the next begins


def test_in_a_large_network_only_what_is_slow_is_drawn() -> None:
    network = two_way_road(ways=scenes.FEW_LINKS)
    scene = space_time_scene(network, states_with_a_queue(network), "t")
    assert len(scene["road_speed"]) == 2 * scenes.FEW_LINKS
    assert scene["speed"] == pytest.approx([100 * 1975 / 190 / 20, 0])
    assert "the 2 slowest of 3" in scene["subtitle"]


def test_too_many_ribbons_become_straight_and_then_the_slowest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    network = winding(two_way_road())
    monkeypatch.setattr(scenes, "MOST_QUADS", 2)
    scene = space_time_scene(network, states_with_a_queue(network), "t")
    assert scene["speed"] == pytest.approx([100 * 1975 / 190 / 20, 0])
    assert "the 2 slowest of 3" in scene["subtitle"]


def test_the_axes_tell_time_distance_and_north() -> None:
    network = two_way_road()
    labels = set(space_time_scene(network, states_with_a_queue(network), "t")["labels"])
    assert {"time, h:min", "0:00", "200 m", "N"} <= labels
    nowhere = two_way_road(None)
    schematic = set(space_time_scene(nowhere, states_with_a_queue(nowhere), "t")["labels"])
    assert not {"200 m", "N"} & schematic


def test_a_narrow_map_does_not_carry_a_tower() -> None:
    network = two_way_road()
    upright = [LineString([(0, 0), (0, 1000)]), LineString([(0, 1000), (0, 0)])]
    narrow = Network(network.nodes, gpd.GeoDataFrame(network.links).set_geometry(upright))
    points = space_time_scene(narrow, states_with_a_queue(narrow), "t")["points"]
    assert points[:, 2].max() == pytest.approx(scenes.LEAST_HEIGHT)


def test_a_ribbon_that_floats_has_a_foot(monkeypatch: pytest.MonkeyPatch) -> None:
    network = two_way_road()
    states = states_with_a_queue(network)
    assert space_time_scene(network, states, "t")["feet"].shape == (0, 2, 3)
    late = states.assign(speed=states["speed"].where(states["begin_s"] > 0))
    scene = space_time_scene(network, late, "t")
    (foot,) = scene["feet"]
    corners = scene["points"].reshape(-1, 4, 3)[0]
    assert foot[:, :2] == pytest.approx(np.tile(corners[:2, :2].mean(axis=0), (2, 1)))
    assert foot[:, 2] == pytest.approx([0, scenes.HEIGHT / 2])
    monkeypatch.setattr(scenes, "MOST_FEET", 0)
    assert space_time_scene(network, late, "t")["feet"].shape == (0, 2, 3)


def test_of_many_slow_states_the_slowest_and_fullest_are_drawn(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    network = two_way_road()
    states = states_with_a_queue(network).assign(speed=0.0, density=[0.1, 0.2, 0.05, 0.2])
    monkeypatch.setattr(scenes, "MOST_STATES", 2)
    scene = space_time_scene(network, states, "t")
    assert scene["points"].reshape(2, 4, 3)[:, 0, 2] == pytest.approx([scenes.HEIGHT / 2] * 2)
    assert "the 2 slowest of 4" in scene["subtitle"]


def test_a_crowd_of_ribbons_is_paler(monkeypatch: pytest.MonkeyPatch) -> None:
    network = two_way_road()
    states = states_with_a_queue(network)
    alone = space_time_scene(network, states, "t")["opacity"]
    monkeypatch.setattr(scenes, "CROWD", 1)
    crowd = space_time_scene(network, states, "t")
    # two of the three are not faint
    assert crowd["opacity"] == pytest.approx(alone / 2**0.5)


@pytest.mark.parametrize("size", [(1.0, 1.0, 0.1), (1.0, 0.1, 0.4), (0.2, 1.0, 0.2)])
def test_the_camera_shows_every_point_and_comes_as_near_as_it_can(
    size: tuple[float, float, float],
) -> None:
    points = np.array(list(itertools.product((-1, 1), (-1, 1), (0, 2)))) * size + 7.0
    focus, distance = space_time_render.camera(points)
    towards = space_time_render.TOWARDS_THE_VIEWER
    right = np.cross((0, 0, 1), towards)
    right /= np.linalg.norm(right)
    seen = points - (focus + distance * towards)
    scale = -(seen @ towards) * np.tan(np.radians(space_time_render.VIEW_ANGLE / 2))
    x = 0.5 + seen @ right / scale / 2 * 1200 / 1600
    y = 0.5 + seen @ np.cross(towards, right) / scale / 2
    left, most_right, bottom, top = space_time_render.ROOM
    slack = [x.min() - left, most_right - x.max(), y.min() - bottom, top - y.max()]
    assert min(slack) >= -1e-9
    assert max(slack[:2]) < 1e-9 or max(slack[2:]) < 1e-9


def test_a_network_without_geometry_cannot_be_drawn(tmp_path: Path) -> None:
    network = network_of([{}, {}])
    with pytest.raises(ValueError, match="no geometry"):
        write_space_time(tmp_path / "a.png", network, states_with_a_queue(network), "t")


@pytest.mark.skipif(not OFF_SCREEN, reason="needs libegl1 and libgl1-mesa-dri, or libosmesa6")
def test_the_picture_shows_the_queue_in_its_colour(tmp_path: Path) -> None:
    network = two_way_road()
    path = tmp_path / "space_time.png"
    write_space_time(path, network, states_with_a_queue(network), "A queue")
    picture = imread(path)[:, :, :3]
    assert picture.shape == (1200, 1600, 3)
    below_the_legend = picture[250:]
    standing = np.abs(below_the_legend - to_rgb(SPEED_CLASSES[0].colour)).max(axis=2) < 0.05
    assert np.count_nonzero(standing) > 5000
    assert [file.name for file in tmp_path.iterdir()] == ["space_time.png"]


def test_an_empty_network_is_drawn_without_ribbons() -> None:
    network = two_way_road()
    states = states_with_a_queue(network).assign(time=0.0, speed=np.nan)
    scene = space_time_scene(network, states, "t")
    assert len(scene["quads"]) == 0
    assert scene["road_speed"].tolist() == [100, 100]


@pytest.mark.skipif(find_library("OSMesa") is not None, reason="OSMesa draws without drivers")
def test_death_of_the_drawing_process_names_the_packages(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # without a screen and without drivers VTK takes the process down
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_DIRS", str(tmp_path / "none"))
    monkeypatch.setenv("LIBGL_DRIVERS_PATH", str(tmp_path / "none"))
    network = two_way_road()
    with pytest.raises(RenderError, match="libegl1 and libgl1-mesa-dri"):
        write_space_time(tmp_path / "a.png", network, states_with_a_queue(network), "t")
    assert list(tmp_path.iterdir()) == []


def test_an_error_in_the_drawing_process_is_passed_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(space_time, "RENDERER", tmp_path / "gone.py")
    network = two_way_road()
    with pytest.raises(RenderError, match=r"gone\.py"):
        write_space_time(tmp_path / "a.png", network, states_with_a_queue(network), "t")
    assert list(tmp_path.iterdir()) == []
