"""Scenes in space and time: which links, where their walls stand, colours, axes and cameras."""

from __future__ import annotations

import itertools
from datetime import datetime, timedelta, timezone

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
from mapped_network import states_with_a_queue, two_way_road
from matplotlib.colors import to_rgb
from newell_link import events_of, network_of, result_of, trips_of
from shapely.geometry import LineString, Point

from uxsim_geo.analysis.link_states import link_states, link_times
from uxsim_geo.analysis.run_passages import RunPassages
from uxsim_geo.export.clock import Clock
from uxsim_geo.export.colours import SPEED_CLASSES
from uxsim_geo.export.map_plane import MapPlane
from uxsim_geo.export.space_time import camera as cameras
from uxsim_geo.export.space_time import choice as choices
from uxsim_geo.export.space_time import frame as frames
from uxsim_geo.export.space_time import walls as walls
from uxsim_geo.export.space_time.bins import coarser
from uxsim_geo.export.space_time.choice import Choice
from uxsim_geo.export.space_time.frame import Frame
from uxsim_geo.export.space_time.framing import best_side
from uxsim_geo.export.space_time.look import Look
from uxsim_geo.export.space_time.scale import round_above
from uxsim_geo.export.space_time.scene import space_time_scene
from uxsim_geo.export.space_time.surface import surface_scene
from uxsim_geo.export.space_time.ways import sampled_ways
from uxsim_geo.network.network import Network
from uxsim_geo.settings import Settings

SIDE = 1040.0  # m, of the map of a road of 1 km with its margin
HEIGHT = frames.LEAST_HEIGHT  # of a map that is one straight road


def boxes(scene: dict, name: str = "ribbons") -> np.ndarray:
    """Least and greatest x, y and z of each box, shape (boxes, 2, 3)."""
    corners = scene[f"{name}.points"].reshape(-1, 8, 3)
    return np.stack([corners.min(axis=1), corners.max(axis=1)], axis=1)


def colours(scene: dict, name: str = "ribbons") -> list:
    return scene[f"{name}.rgb"].reshape(-1, 6, 3)[:, 0].tolist()


def class_rgb(number: int) -> list[float]:
    return [round(255 * part) for part in to_rgb(SPEED_CLASSES[number].colour)]


def many_roads(count: int) -> tuple[Network, pd.DataFrame]:
    """Roads of 1 km from west to east, 100 m apart; vehicles stand on each, later the further."""
    plain = network_of([{}] * count)
    lines = [LineString([(0, 100.0 * k), (1000, 100.0 * k)]) for k in range(count)]
    nodes = gpd.GeoDataFrame(plain.nodes, geometry=[Point(0, 0), Point(1000, 0)], crs=25832)
    links = gpd.GeoDataFrame(plain.links, geometry=lines, crs=25832)
    network = Network(nodes, links)
    rows = [(2 * k + n, k, 10.0 * k + n, np.nan) for k in range(min(count, 10)) for n in range(2)]
    result = result_of(events_of(network, rows), trips_of([{}] * 20), Settings(200.0))
    return network, link_times(result, network, bin_s=100.0)


def test_ribbons_stand_over_their_link_while_it_is_slow_in_the_colour_of_its_speed() -> None:
    network = two_way_road()
    scene = space_time_scene(network, states_with_a_queue(network), Look())
    # 1975 m in 190 s are 52 % of 20 m/s, then they stand; the way back is free
    low, high = boxes(scene).swapaxes(0, 1)
    assert low[:, 2] == pytest.approx([0, HEIGHT / 2])
    assert high[:, 2] == pytest.approx([HEIGHT / 2, HEIGHT])
    assert low[:, 0] == pytest.approx([-500 / SIDE] * 2)
    assert high[:, 0] == pytest.approx([500 / SIDE] * 2)
    # on the right of a road to the east is south
    assert (low[:, 1] + high[:, 1]) / 2 == pytest.approx([-walls.BESIDE] * 2)
    assert colours(scene) == [class_rgb(2), class_rgb(0)]
    assert scene["slow.rgb"].tolist() == [class_rgb(0)]


def test_equal_times_are_equal_heights_and_equal_bins_one_wall() -> None:
    network = two_way_road()
    events = events_of(network, [(0, 0, 0.0, np.nan), (1, 0, 10.0, np.nan)])
    result = result_of(events, trips_of([{}, {}]), Settings(300.0))
    states = link_times(result, network, bin_s=50.0)
    scene = space_time_scene(network, states, Look())
    # at 50 s the first has come to the end; from then on both stand but for the second's last 200 m
    own = states[states["link_id"] == "link 0"]
    slow = 100 * own["speed"] / 20 < 60
    assert slow.tolist() == [False, True, True, True, True, True]
    low, high = boxes(scene).swapaxes(0, 1)
    assert low[:, 2] == pytest.approx([HEIGHT / 6])
    assert high[:, 2] == pytest.approx([HEIGHT])


def test_the_wall_of_a_queue_reaches_from_its_tail_to_the_end_of_the_link() -> None:
    network = two_way_road()
    scene = space_time_scene(network, states_with_a_queue(network), Look())
    low, high = boxes(scene, "queues").swapaxes(0, 1)
    # 10 vehicles at 0.2 veh/m are 50 m, at the end of both bins
    assert low[:, 0] == pytest.approx([(950 - 500) / SIDE] * 2)
    assert high[:, 0] == pytest.approx([500 / SIDE] * 2)
    assert high[:, 1] - low[:, 1] == pytest.approx([2 * walls.QUEUE] * 2)
    assert (boxes(scene)[:, 1, 1] - boxes(scene)[:, 0, 1]) == pytest.approx([2 * walls.RIBBON] * 2)
    assert low[:, 2] == pytest.approx([0, HEIGHT / 2])


def test_a_wall_follows_the_bends_of_its_link_and_a_queue_ends_between_them() -> None:
    network = two_way_road()
    bent = [LineString([(0, 0), (500, 400), (1000, 0)])] * 2
    network = Network(network.nodes, gpd.GeoDataFrame(network.links).set_geometry(bent))
    scene = space_time_scene(network, states_with_a_queue(network), Look())
    assert len(boxes(scene)) == 2 * 2
    assert len(boxes(scene, "queues")) == 2  # 50 m lie on the last piece alone
    first, second = boxes(scene)[:2]
    assert first[1, 0] == pytest.approx(second[0, 0], abs=2 * walls.BESIDE)


def test_of_many_bins_several_are_one_as_if_they_had_been_longer() -> None:
    network = two_way_road()
    events = events_of(network, [(0, 0, 0.0, np.nan), (1, 0, 10.0, np.nan), (2, 1, 10.0, 60.0)])
    result = result_of(events, trips_of([{}, {}, {}]), Settings(400.0))
    short = link_times(result, network, bin_s=10.0)
    joined = coarser(short, network)  # 40 bins: two by two
    longer = link_times(result, network, bin_s=20.0)
    pd.testing.assert_frame_equal(joined, longer[list(joined.columns)])
    assert coarser(longer, network) is longer
    scene = space_time_scene(network, short, Look())
    assert np.diff(scene["edges"]).tolist() == [20.0] * 20


@pytest.mark.parametrize("bin_s", [60.0, 2.0])
def test_kept_states_make_the_same_scenes_as_their_table(bin_s: float) -> None:
    network = two_way_road()
    events = events_of(network, [(0, 0, 5.0, 95.0), (1, 0, 15.0, np.nan)])
    trips = trips_of([{"enter_s": 5.0, "arrive_s": 95.0}, {"enter_s": 15.0}])
    result = result_of(events, trips, Settings(150.0))
    table = link_times(result, network, bin_s=bin_s)
    kept = link_states(result, network, bin_s=bin_s)
    for scene in (space_time_scene, surface_scene):
        ours, theirs = scene(network, kept, Look("t")), scene(network, table, Look("t"))
        assert ours.keys() == theirs.keys()
        for name in ours:
            np.testing.assert_array_equal(ours[name], theirs[name], err_msg=name)


def test_a_link_without_length_on_the_map_has_no_wall() -> None:
    network = two_way_road(ways=2)
    lines = [*network.links.geometry[:3], LineString([(0, 0), (0, 0)])]
    network = Network(network.nodes, gpd.GeoDataFrame(network.links).set_geometry(lines))
    rows = [(0, 3, 0.0, np.nan), (1, 3, 1.0, np.nan), (2, 0, 5.0, np.nan), (3, 0, 6.0, np.nan)]
    result = result_of(events_of(network, rows), trips_of([{}] * 4), Settings(200.0))
    states = link_times(result, network, bin_s=100.0)
    look = Look(slower_than=1.0)
    assert len(boxes(space_time_scene(network, states, look))) == 2  # of the link from a to b
    assert Choice.of(network, states, MapPlane.of(network), look).links.tolist() == [3, 0]


@pytest.mark.parametrize("seed", range(5))
def test_walls_are_those_of_a_plain_loop_over_links_and_bins(seed: int) -> None:
    network, states = many_roads(6)
    random = np.random.default_rng(seed)
    count, bins = len(states), 2
    states = states.assign(
        speed=np.where(random.random(count) < 0.2, np.nan, random.uniform(0, 20, count)),
        density=random.uniform(0, 0.05, count),
        delay=random.uniform(0, 900, count),
        queue_length=random.uniform(0, 1000, count) * (random.random(count) < 0.7),
    )
    expected_ribbons, expected_queues = [], []
    for link in range(6):
        before = None
        for bin_ in range(bins):
            row = states.iloc[link * bins + bin_]
            slow = row["speed"] < 0.6 * 20 and row["density"] >= 0.03 * 0.2
            number = int(row["speed"] / 20 * 5) if slow else None
            y = 100 * link - 1000 * walls.BESIDE * 1.04
            if slow and number == before:
                expected_ribbons[-1][-2] = row["end_s"]
            elif slow:
                expected_ribbons.append([y, row["begin_s"], row["end_s"], number])
            if slow and row["queue_length"] > 0:
                tail = 1000 - row["queue_length"]
                expected_queues.append([y, row["begin_s"], row["end_s"], number, tail])
            before = number
    scene = space_time_scene(network, states, Look())
    side, middle = 1040.0, (500.0, 250.0)

    def found(name: str) -> list[list[float]]:
        told = []
        for (low, high), rgb in zip(boxes(scene, name), colours(scene, name), strict=True):
            y = (low[1] + high[1]) / 2 * side + middle[1]
            begin, end = 200 * low[2] / scene["height"], 200 * high[2] / scene["height"]
            tail = low[0] * side + middle[0]
            number = [class_rgb(k) for k in range(5)].index(rgb)
            told.append([round(y, 3), round(begin, 3), round(end, 3), number, round(tail, 3)])
        return sorted(told)

    plain = [[*row, 0.0] for row in expected_ribbons]
    np.testing.assert_allclose(found("ribbons"), sorted(plain), atol=0.01)
    np.testing.assert_allclose(found("queues"), sorted(expected_queues), atol=0.01)


def test_parts_that_are_not_asked_for_are_not_there() -> None:
    network = two_way_road()
    states = states_with_a_queue(network)
    scene = space_time_scene(network, states, Look(show=("queues",)))
    assert not len(scene["ribbons.faces"])
    assert len(scene["queues.faces"]) == 2 * 6
    scene = space_time_scene(network, states, Look(show=("ribbons",)))
    assert len(scene["ribbons.faces"]) == 2 * 6
    assert not len(scene["queues.faces"])


def test_densities_have_classes_up_to_a_jam() -> None:
    network = two_way_road()
    states = states_with_a_queue(network)
    look = Look(colour="density", slower_than=1.0)
    scene = space_time_scene(network, states, look)
    assert scene["scale_labels"].tolist() == ["0", "40", "80", "120", "160", "200"]
    assert "veh/km per lane" in scene["scale_title"]
    # 9.5 and 10 veh/km are one class, so one wall
    assert boxes(scene)[:, :, 2].tolist() == [pytest.approx([0, HEIGHT])]
    dense = states.assign(density=[0.01, 0.19, 0.0, 0.0])
    high = colours(space_time_scene(network, dense, look))
    assert high == [scene["scale_rgb"][0].tolist(), scene["scale_rgb"][4].tolist()]


def test_links_that_lost_most_time_are_chosen() -> None:
    network, states = many_roads(12)
    chosen = Choice.of(network, states, MapPlane.of(network), Look(most_links=3))
    # the earlier they stand, the more time they lose; the last two roads are empty
    assert chosen.links.tolist() == [0, 1, 2]
    every = Choice.of(network, states, MapPlane.of(network), Look())
    assert every.links.tolist() == list(range(10))
    drawn, whole = chosen.lost
    assert 0 < drawn < whole
    assert whole == pytest.approx(states["delay"].sum() / 3600)
    fast = Choice.of(network, states.assign(speed=19.0), MapPlane.of(network), Look())
    assert not fast.links.size


def standing(network: Network, states: pd.DataFrame) -> pd.DataFrame:
    """The states with a queue on every link, the longer lost the lower its number."""
    number = np.repeat(np.arange(len(network.links))[::-1], len(states) // len(network.links))
    return states.assign(speed=0.0, density=0.2, time=1.0, delay=3600.0 * (1 + number))


def test_walls_of_a_large_network_do_not_crowd_its_map(monkeypatch: pytest.MonkeyPatch) -> None:
    network, states = many_roads(60)
    states, plane = standing(network, states), MapPlane.of(network)
    assert len(Choice.of(network, states, plane, Look()).links) == 60  # a small one shows all
    monkeypatch.setattr(choices, "FEW_LINKS", 50)
    _, y0, _, y1 = Choice.of(network, states, plane, Look()).box
    side = y1 - y0  # every wall is of 1 km and stands the whole time
    for crowded, count in ((25.5, 25), (1.0, choices.LEAST_WALLS)):
        monkeypatch.setattr(choices, "CROWDED", crowded * 1000 / side)
        part = Choice.of(network, states, plane, Look())
        assert part.links.tolist() == list(range(count))
        ground = part.on_ground()
        assert ground.tolist() == list(range(count, 60))
    assert len(Choice.of(network, states, plane, Look(most_links=40)).links) == 40  # as asked for


def test_short_walls_crowd_a_map_as_much_as_longer_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    network, states = many_roads(60)
    short = [LineString([(0, 100.0 * k), (1, 100.0 * k)]) for k in range(60)]
    network = Network(network.nodes, gpd.GeoDataFrame(network.links).set_geometry(short))
    monkeypatch.setattr(choices, "FEW_LINKS", 50)
    monkeypatch.setattr(choices, "CROWDED", 30.5 * choices.SHORTEST)
    chosen = Choice.of(network, standing(network, states), MapPlane.of(network), Look())
    assert len(chosen.links) == 30


def test_slow_links_without_a_wall_lie_on_the_ground_in_the_colour_of_their_worst_state() -> None:
    network, states = many_roads(3)
    states = standing(network, states)
    states.loc[states["link_id"] == "link 2", "speed"] = 9.0  # 45 % of 20 m/s
    scene = space_time_scene(network, states, Look(most_links=1))
    assert len(boxes(scene)) == 1
    # the link with a wall is the last, on top
    assert scene["slow.rgb"].tolist() == [class_rgb(0), class_rgb(2), class_rgb(0)]
    y = scene["slow.points"][scene["slow.lines"][:, 0], 1]
    assert np.argsort(y).tolist() == [2, 0, 1]


def test_what_lies_on_the_ground_ends_where_the_map_does(monkeypatch: pytest.MonkeyPatch) -> None:
    network, states = many_roads(60)
    lost = standing(network, states)
    lost["delay"] = np.where(lost["link_id"].isin([f"link {k}" for k in range(12)]), 3600.0, 1e-3)
    monkeypatch.setattr(choices, "FEW_LINKS", 50)
    scene = space_time_scene(network, lost, Look())
    assert 12 <= len(scene["slow.lines"]) < 60
    x0, y0, x1, y1 = scene["ground"]
    points = scene["slow.points"]
    assert (points[:, :2] >= (x0, y0)).all()
    assert (points[:, :2] <= (x1, y1)).all()


def test_links_stand_on_the_side_that_is_driven_on() -> None:
    network = two_way_road()
    states = states_with_a_queue(network)
    right, left = (
        space_time_scene(network, states, Look(driving_side=side)) for side in ("right", "left")
    )
    for name in ("ribbons", "queues", "slow"):
        low, high = right[f"{name}.points"][:, 1], left[f"{name}.points"][:, 1]
        assert (low < 0).all()
        assert np.sort(high) == pytest.approx(np.sort(-low))
        assert left[f"{name}.points"][:, 0].min() == pytest.approx(
            right[f"{name}.points"][:, 0].min()
        )


def test_a_few_slow_vehicles_are_no_queue() -> None:
    network = two_way_road()
    states = states_with_a_queue(network)
    sparse = states.assign(density=states["density"] * 0.5)  # 4.75 and 5 of 200 veh/km
    assert not len(space_time_scene(network, sparse, Look())["ribbons.faces"])


def test_of_a_large_map_the_part_with_lost_time_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    network, states = many_roads(150)
    whole = Choice.of(network, states, MapPlane.of(network), Look())
    assert whole.box == MapPlane.of(network).extent
    monkeypatch.setattr(choices, "FEW_LINKS", 100)
    part = Choice.of(network, states, MapPlane.of(network), Look())
    # the ten roads with queues lie in the lowest 900 m of 14.9 km; a quarter of the map is shown
    _, y0, _, y1 = part.box
    assert y0 < 100
    assert 900 < y1 < 0.3 * 14_900
    assert part.links.tolist() == list(range(10))
    scene = space_time_scene(network, states, Look())
    assert np.abs(scene["major.points"][:, :2]).max() <= 0.5 + 1e-9


def test_places_tell_where_when_and_how_bad() -> None:
    network = two_way_road()
    links = network.links.assign(name=["Königs$traße <b>", None])
    network = Network(network.nodes, links)
    states = states_with_a_queue(network)
    own = states[states["link_id"] == "link 0"].reset_index()
    lost, worst = own["delay"].sum() / 60, own.loc[own["delay"].idxmax()]
    scene = space_time_scene(network, states, Look())
    span = Clock.of(None, states["end_s"]).span(worst["begin_s"], worst["end_s"])
    speed = 3.6 * worst["distance"] / worst["time"]
    assert scene["notes"][1] == (
        f"1  Königs$traße <b>: {lost:,.1f} veh·min, {span} at {speed:.0f} km/h"
    )
    assert scene["marks.points"][:, :2] == pytest.approx(np.zeros((1, 2)), abs=1e-9)
    assert scene["marks.points"][0, 2] > HEIGHT


def test_links_without_a_name_go_by_their_id_and_streets_count_as_one() -> None:
    network, states = many_roads(6)
    named = ["Long Street", "Long Street", None, "", "Long Street", " "]
    network = Network(network.nodes, network.links.assign(name=named))
    scene = space_time_scene(network, states, Look())
    found = [note.partition("  ")[2].partition(":")[0] for note in scene["notes"][1:]]
    assert found[0] == "Long Street"
    assert set(found[1:]) == {"link link 2", "link link 3", "link link 5"}
    # how many links are drawn changes nothing of what is told
    alone = space_time_scene(network, states, Look(most_links=1))
    assert alone["notes"].tolist() == scene["notes"].tolist()


def test_an_empty_network_has_a_map_and_no_walls() -> None:
    network = two_way_road()
    states = states_with_a_queue(network).assign(time=0.0, speed=np.nan, delay=0.0, density=0.0)
    scene = space_time_scene(network, states, Look())
    for name in ("ribbons.faces", "queues.faces", "slow.lines", "marks.points", "notes"):
        assert len(scene[name]) == 0
    assert len(scene["major.lines"]) == 2
    terrain = surface_scene(network, states, Look())
    assert terrain["ribbons.points"][:, 2].max() == 0


def test_the_axes_tell_time_distance_and_north() -> None:
    network = two_way_road()
    scene = space_time_scene(network, states_with_a_queue(network), Look())
    for corner in range(4):
        assert {"time, h:min", "0:00", "N"} <= set(scene[f"axes{corner}.texts"])
    assert "200 m" in scene["axes0.texts"]
    nowhere = two_way_road(None)
    schematic = space_time_scene(nowhere, states_with_a_queue(nowhere), Look())
    assert not {"200 m", "N"} & set(schematic["axes0.texts"])


def test_the_axis_shows_round_times_of_the_clock_in_its_zone() -> None:
    zone = timezone(timedelta(hours=2))
    look = Look(start=datetime(2024, 5, 1, 7, 10, tzinfo=zone))
    network = two_way_road()
    scene = space_time_scene(network, states_with_a_queue(network), look)
    for corner in range(4):
        assert {"time, UTC+02:00", "07:10", "07:11"} <= set(scene[f"axes{corner}.texts"])


@pytest.mark.parametrize(
    ("width", "depth", "height"),
    [(1.0, 1.0, frames.HEIGHT), (1.0, 0.3, 0.3), (0.1, 1.0, frames.LEAST_HEIGHT)],
)
def test_a_narrow_map_carries_no_tower(width: float, depth: float, height: float) -> None:
    plane = MapPlane.of(two_way_road())
    frame = Frame.of(plane, (0.0, 0.0, 500 * width, 500 * depth), 60.0)
    assert frame.height == pytest.approx(height)
    crowded = Frame.of(plane, (0.0, 0.0, 500 * width, 500 * depth), 60.0, crowded=True)
    assert crowded.height == pytest.approx(min(height, frames.CROWDED_HEIGHT))
    assert frame.upwards(30.0) == pytest.approx(height / 2)
    assert frame.ground.tolist() == pytest.approx([-width / 2, -depth / 2, width / 2, depth / 2])


def test_a_ribbon_that_floats_has_a_foot() -> None:
    network = two_way_road()
    states = states_with_a_queue(network)
    assert not len(space_time_scene(network, states, Look())["feet"])
    late = states.assign(speed=states["speed"].where(states["begin_s"] > 0))
    (foot,) = space_time_scene(network, late, Look())["feet"]
    assert foot[:, 0] == pytest.approx([0, 0])
    assert foot[:, 2] == pytest.approx([0, HEIGHT / 2])


@pytest.mark.parametrize("camera", list(cameras.DIRECTIONS))
@pytest.mark.parametrize("size", [(1.0, 1.0, 0.1), (1.0, 0.1, 0.4), (0.2, 1.0, 0.2)])
def test_the_camera_shows_every_point_and_comes_as_near_as_it_can(
    size: tuple[float, float, float], camera: str
) -> None:
    points = np.array(list(itertools.product((-1, 1), (-1, 1), (0, 2)))) * size + 7.0
    direction = cameras.towards(*cameras.DIRECTIONS[camera])
    one = cameras.view(points, direction, 4 / 3)
    right = np.cross((0, 0, 1), direction)
    right /= np.linalg.norm(right)
    seen = points - one.position
    scale = -(seen @ direction) * np.tan(np.radians(cameras.VIEW_ANGLE / 2))
    x = 0.5 + seen @ right / scale / 2 * 3 / 4
    y = 0.5 + seen @ np.cross(direction, right) / scale / 2
    left, most_right, bottom, top = cameras.ROOM
    slack = [x.min() - left, most_right - x.max(), y.min() - bottom, top - y.max()]
    assert min(slack) >= -1e-9
    assert max(slack[:2]) < 1e-9 or max(slack[2:]) < 1e-9
    assert one.direction == pytest.approx(direction)


def test_each_side_sees_its_own_corner_at_the_left() -> None:
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], float)
    left = [
        cameras.left_corner(corners, cameras.towards(*cameras.DIRECTIONS[side]))
        for side in ("south", "east", "north", "west")
    ]
    assert left == [0, 1, 2, 3]


@pytest.mark.parametrize(
    ("way", "side"), [((1, 0), "south"), ((0, 1), "west"), ((1, 1), "south"), ((0, 0), "south")]
)
def test_the_best_side_sees_walls_from_their_broad_side(way: tuple[int, int], side: str) -> None:
    network = two_way_road()
    along = LineString([(0, 0), (1000 * way[0] + 1, 1000 * way[1] + 1)])
    links = gpd.GeoDataFrame(network.links).set_geometry([along, along.reverse()])
    network = Network(network.nodes, links)
    states = states_with_a_queue(network)
    if way == (0, 0):
        states = states.assign(speed=np.nan)
    scene = space_time_scene(network, states, Look())
    assert best_side(scene, Look()) == side


def test_ways_go_through_the_places_of_their_vehicles() -> None:
    network = two_way_road()
    events = events_of(network, [(0, 0, 0.0, 50.0), (0, 1, 50.0, 100.0), (1, 0, 10.0, np.nan)])
    result = result_of(events, trips_of([{}, {}]), Settings(120.0))
    ways = sampled_ways(network, RunPassages(result, network), 10)
    there_and_back, stays = ways
    # 20 m/s to the east and back again
    time, x = there_and_back[:, 2], there_and_back[:, 0]
    assert x == pytest.approx(np.where(time <= 50, 20 * time, 2000 - 20 * time), abs=1e-6)
    assert stays[-1].tolist() == pytest.approx([1000, 0, 120])
    assert len(sampled_ways(network, RunPassages(result, network), 1)) == 1
    scene = space_time_scene(network, states_with_a_queue(network), Look(), ways)
    count = sum(len(way) - 1 for way in ways)
    assert len(scene["trajectories.lines"]) == count


def test_lost_time_is_the_height_of_the_terrain() -> None:
    network, states = many_roads(12)
    scene = surface_scene(network, states, Look())
    points = scene["ribbons.points"]
    top = float(scene["scale_labels"][-1])
    # the volume under the terrain is the time lost, but for what is smoothed beyond its edge
    x = np.unique(points[:, 0].round(9))
    step = np.diff(x).min()
    plane = MapPlane.of(network)
    km = step * max(plane.extent[2] - plane.extent[0], plane.extent[3] - plane.extent[1]) / 1000
    per_km2 = points[:, 2] / float(scene["height"]) * top
    assert per_km2.sum() * km**2 == pytest.approx(states["delay"].sum() / 3600, rel=0.05)
    assert "veh·h/km²" in scene["scale_title"]
    highest = points[np.argmax(points[:, 2])]
    assert highest[1] < -0.3  # where the queues stood longest


@pytest.mark.parametrize(
    ("value", "steps", "top"), [(200, 5, 200), (150, 5, 200), (1.0, 5, 1.0), (101, 5, 125)]
)
def test_scales_end_at_round_figures(value: float, steps: int, top: float) -> None:
    assert round_above(value, steps) == pytest.approx(top)


def test_a_network_without_geometry_cannot_be_drawn() -> None:
    network = network_of([{}, {}])
    with pytest.raises(ValueError, match="no geometry"):
        space_time_scene(network, states_with_a_queue(network), Look())
