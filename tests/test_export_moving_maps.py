"""Moving maps: what each picture shows, by the theory of the traffic on it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pytest
import shapely
from mapped_network import states_with_a_queue, two_way_road
from matplotlib.colors import to_rgba
from newell_link import events_of, network_of, result_of, trips_of
from PIL import Image
from shapely.geometry import LineString, Point
from shapely.ops import substring

from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.samples import Samples
from uxsim_geo.analysis.trajectories import LinkLines
from uxsim_geo.errors import InputError
from uxsim_geo.export import film, moving_links, moving_vehicles, trails
from uxsim_geo.export.colours import SPEED_CLASSES
from uxsim_geo.export.film import MovingMap
from uxsim_geo.network.network import Network
from uxsim_geo.settings import Settings

FAST, SLOW = SPEED_CLASSES[-1].colour, SPEED_CLASSES[0].colour


def corridor() -> Network:
    """Two links of 1 km one after the other; each line is bent, as long as its link."""
    plain = network_of([{}, {"from_node_id": "b", "to_node_id": "c"}], nodes=("a", "b", "c"))
    lines = [
        LineString([(0, 0), (600, 0), (600, 400)]),
        LineString([(600, 400), (900, 800), (1400, 800)]),
    ]
    ends = [Point(0, 0), Point(600, 400), Point(1400, 800)]
    return Network(
        gpd.GeoDataFrame(plain.nodes, geometry=ends, crs="EPSG:25832"),
        gpd.GeoDataFrame(plain.links, geometry=lines, crs="EPSG:25832"),
    )


def passages_of(network: Network) -> Passages:
    """One platoon drives freely over both links; the next waits 100 s at the end of the first."""
    rows = [(0, 0, 0.0, 50.0), (0, 1, 50.0, 100.0), (1, 0, 10.0, 160.0), (1, 1, 160.0, 210.0)]
    result = result_of(events_of(network, rows), trips_of([{}, {}]), Settings(300.0))
    return Passages.of(result, network)


@pytest.fixture
def films(monkeypatch: pytest.MonkeyPatch) -> list[MovingMap]:
    """What is handed over to be written."""
    kept: list[MovingMap] = []

    def keep(drawn: MovingMap, *_: Any) -> None:
        kept.append(drawn)

    for module in (moving_links, moving_vehicles):
        monkeypatch.setattr(module, "write_film", keep)
    return kept


def test_links_are_as_wide_as_they_are_dense_and_the_slowest_on_top(
    films: list[MovingMap],
) -> None:
    network = two_way_road()
    states = states_with_a_queue(network)
    moving_links.animate_links(network, states, Path("x.gif"), frame_ms=100.0)
    (moving,) = films
    traffic, time = moving.artists
    assert moving.pictures == 2
    moving.draw(0)
    # 190 s x 5 veh and 50 s x 5 veh on 1 km for 100 s, of 200 veh/km; the queue comes last
    share = np.array([50, 190]) * 5 / 1e5 / 0.2
    sheet = moving.sheet
    expected = sheet.narrowest + (sheet.widest - sheet.narrowest) * share
    np.testing.assert_allclose(traffic.get_linewidth(), expected)
    traffic.update_scalarmappable()
    assert traffic.get_colors()[0] == pytest.approx(to_rgba(FAST))
    assert time.get_text() == "0:00:00–0:01:40"
    moving.draw(1)  # only the queue is left, standing
    traffic.update_scalarmappable()
    assert traffic.get_colors() == pytest.approx(np.array([to_rgba(SLOW)]))
    (line,) = traffic.get_segments()
    assert line[0][0] < line[-1][0]
    assert (line[:, 1] < 0).all()  # eastwards: right is south


def vehicles(films: list[MovingMap], network: Network, trail: int = 4) -> MovingMap:
    passages = passages_of(network)
    samples = Samples.of(passages, 20.0, 300.0)
    keywords: dict[str, Any] = {"frame_ms": 50.0, "trail": trail}
    moving_vehicles.animate_vehicles(network, passages, samples, Path("x.gif"), **keywords)
    (moving,) = films
    return moving


def test_dots_stand_beside_the_line_where_the_closed_form_says(
    films: list[MovingMap],
) -> None:
    network = corridor()
    moving = vehicles(films, network)
    _, dots, time = moving.artists
    assert moving.pictures == 11  # 0 to 200 s
    for picture in range(3):
        moving.draw(picture)
    # at 40 s: 800 m and 600 m; 600 m is where the line turns north, right is east
    assert time.get_text() == "0:00:40"
    beside = 1.1 * moving.sheet.widest * moving.sheet.units_per_point
    for place, expected in zip(dots.get_offsets(), [(600, 200), (600, 0)], strict=True):
        assert np.hypot(*(place - expected)) < beside
        assert place[0] > 600
    np.testing.assert_allclose(dots.get_array(), [100.0, 100.0])


def test_trails_fade_with_age_and_go_when_they_are_old(films: list[MovingMap]) -> None:
    moving = vehicles(films, corridor(), trail=3)
    trail = moving.artists[0]
    seen = {}
    for picture in range(moving.pictures):
        moving.draw(picture)
        seen[picture] = np.array(trail.get_color())
    assert len(seen[0]) == 0
    assert [len(seen[picture]) for picture in (1, 2, 3)] == [1, 2, 3]
    strongest = moving_vehicles.STRONGEST
    np.testing.assert_allclose(seen[3][:, 3], strongest * np.array([1, 2, 3]) / 3)
    np.testing.assert_allclose(seen[3][:, :3], [to_rgba(FAST)[:3]] * 3)
    # from 60 to 160 s one platoon waits, the other has arrived at 100 s
    np.testing.assert_allclose(seen[8][:, :3], [to_rgba(SLOW)[:3]] * 3)


def test_without_a_trail_there_is_none(films: list[MovingMap]) -> None:
    moving = vehicles(films, corridor(), trail=0)
    for picture in range(3):
        moving.draw(picture)
    assert moving.artists[0].get_segments() == []


def driven(network: Network, moments: np.ndarray) -> list[list[np.ndarray]]:
    passages = passages_of(network)
    lines = LinkLines.of(network.links["geometry"].to_numpy())
    return list(trails.trails(passages, lines, np.arange(passages.link.size), moments))


def test_a_trail_is_the_line_between_two_places_also_across_links() -> None:
    network = corridor()
    ways = driven(network, np.array([0.0, 35.0, 70.0]))
    first, second = network.links["geometry"]
    fast = ways[2][-1]
    assert np.isnan(fast[-1]).all()  # what parts it from the way of the next
    way = LineString(fast[:-1])
    expected = shapely.line_merge(
        shapely.union_all([substring(first, 700, 1000), substring(second, 0, 400)])
    )
    assert shapely.hausdorff_distance(way, expected) == pytest.approx(0.0, abs=1e-9)
    assert way.length == pytest.approx(700.0)


def test_a_slow_trail_has_the_colour_of_its_mean_speed() -> None:
    ways = driven(corridor(), np.array([0.0, 35.0, 70.0, 100.0]))
    # from 35 to 70 s the second platoon drives 500 m, to 1 km, and stands for 10 s: 71 %
    middle = ways[2][3]
    assert LineString(middle[:-1]).length == pytest.approx(500.0)
    standing = ways[3][0]
    assert np.hypot(*(standing[0] - standing[-2])) == pytest.approx(0.0)


def test_all_trails_together_are_what_was_driven(monkeypatch: pytest.MonkeyPatch) -> None:
    network = corridor()
    moments = np.arange(0.0, 240.0, 7.0)
    ways = driven(network, moments)
    steps = [np.hypot(*np.diff(points, axis=0).T) for way in ways for points in way]
    assert np.nansum(np.concatenate(steps)) == pytest.approx(4000.0)
    monkeypatch.setattr(trails, "BLOCK", 1)
    for one, other in zip(ways, driven(network, moments), strict=True):
        for points, others in zip(one, other, strict=True):
            np.testing.assert_array_equal(points, others)


def test_films_of_maps_are_whole(tmp_path: Path) -> None:
    network = corridor()
    passages = passages_of(network)
    for name in ("one.gif", "two.gif"):
        samples = Samples.of(passages, 20.0, 300.0)
        moving_vehicles.animate_vehicles(network, passages, samples, tmp_path / name, frame_ms=50.0)
    assert (tmp_path / "one.gif").read_bytes() == (tmp_path / "two.gif").read_bytes()
    assert Image.open(tmp_path / "one.gif").n_frames == 11
    road = two_way_road()
    path = tmp_path / "links.gif"
    moving_links.animate_links(road, states_with_a_queue(road), path, frame_ms=500.0)
    with Image.open(path) as shown:
        assert (shown.n_frames, shown.info["duration"]) == (2, 500)


def test_a_film_of_nobody_shows_the_clock_over_empty_roads(tmp_path: Path) -> None:
    network = corridor()
    passages = passages_of(network)
    samples = Samples.of(passages, 20.0, 300.0)
    nobody = samples.where(np.zeros(samples.time.size, bool))
    path = tmp_path / "x.gif"
    moving_vehicles.animate_vehicles(network, passages, nobody, path, frame_ms=50.0)
    assert Image.open(path).n_frames == passages.end / 20


def test_a_trail_of_the_future_and_films_without_end_are_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    network = corridor()
    passages, path = passages_of(network), Path("x.gif")
    samples = Samples.of(passages, 20.0, 300.0)
    with pytest.raises(InputError, match=r"film, column trail: .*found '-1'"):
        moving_vehicles.animate_vehicles(network, passages, samples, path, frame_ms=50.0, trail=-1)
    monkeypatch.setattr(film, "MOST_PICTURES", 1)
    with pytest.raises(InputError, match=r"interval: makes 11 pictures, of at most 1"):
        moving_vehicles.animate_vehicles(network, passages, samples, path, frame_ms=50.0)
    road = two_way_road()
    with pytest.raises(InputError, match=r"bin_s: makes 2 pictures"):
        moving_links.animate_links(road, states_with_a_queue(road), path, frame_ms=50.0)


def test_a_share_shows_somebody_and_an_interval_of_nothing_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    passages = passages_of(corridor())
    samples = Samples.of(passages, 20.0, 300.0)
    few = samples.of_share(passages, 1e-3)
    assert np.unique(passages.vehicle[few.row]).tolist() == [0]
    assert samples.of_share(passages, 0.0).time.size == 0
    for wrong in (0.0, -1.0, float("nan"), float("inf"), 1e-9, "5"):
        with pytest.raises(InputError, match="column interval"):
            Samples.of(passages, wrong, 300.0)  # type: ignore[arg-type]
    monkeypatch.setattr("uxsim_geo.analysis.samples.MOST_SAMPLES", samples.time.size - 1)
    with pytest.raises(InputError, match=f"makes {samples.time.size} rows"):
        Samples.of(passages, 20.0, 300.0)
