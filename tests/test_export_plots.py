"""Plots: what is drawn where, how wide and in which colour."""

from __future__ import annotations

from dataclasses import replace

import geopandas as gpd
import numpy as np
import pytest
from mapped_network import states_with_a_queue, two_way_road
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from newell_link import network_of
from pyproj import CRS
from shapely.geometry import LineString, Point

from uxsim_geo.analysis.link_states import link_totals
from uxsim_geo.analysis.network_states import network_states
from uxsim_geo.export.colours import NO_TRAFFIC, SPEED_CLASSES
from uxsim_geo.export.map_plane import MapPlane, round_below
from uxsim_geo.export.map_sheet import MapSheet
from uxsim_geo.export.plots import mfd_figure, network_state_figure
from uxsim_geo.network.network import Network


def state_figure(network: Network) -> Figure:
    return network_state_figure(network, link_totals(states_with_a_queue(network)), "t")


def drawn_traffic(figure: Figure) -> LineCollection:
    figure.draw_without_rendering()
    lines = [c for c in figure.axes[0].collections if isinstance(c, LineCollection)]
    return lines[-1]


def texts(figure: Figure) -> set[str]:
    return {text.get_text() for text in figure.axes[0].texts}


def test_links_lie_to_the_right_of_their_direction_and_do_not_overlap() -> None:
    traffic = drawn_traffic(state_figure(two_way_road()))
    free, slow = traffic.get_segments()  # the slowest is drawn last, on top
    assert slow[0][0] < slow[-1][0]
    assert (slow[:, 1] < 0).all()  # eastwards: right is south
    assert free[0][0] > free[-1][0]
    assert (free[:, 1] > 0).all()


def test_where_people_drive_on_the_left_links_lie_there() -> None:
    network = two_way_road()
    totals = link_totals(states_with_a_queue(network))
    free, slow = drawn_traffic(
        network_state_figure(network, totals, "t", driving_side="left")
    ).get_segments()
    assert slow[0][0] < slow[-1][0]
    assert (slow[:, 1] > 0).all()  # eastwards: left is north
    assert (free[:, 1] < 0).all()


def test_colour_is_the_speed_and_width_the_volume() -> None:
    traffic = drawn_traffic(state_figure(two_way_road()))
    colours = traffic.get_colors()
    assert colours[0] == pytest.approx(to_rgba(SPEED_CLASSES[-1].colour))  # free speed
    # 10 vehicles made 1000 m and 975 m in 390 s: 25 % of 20 m/s
    assert colours[1] == pytest.approx(to_rgba(SPEED_CLASSES[1].colour))
    free_width, slow_width = traffic.get_linewidths()
    assert slow_width > free_width


def test_a_map_has_a_scale_and_north_or_says_why_not() -> None:
    assert {"200 m", "N", "a", "b"} <= texts(state_figure(two_way_road()))
    without = texts(state_figure(two_way_road(None)))
    assert "schematic: coordinates without a reference system, no scale" in without
    assert "N" not in without


def test_nodes_are_named_while_there_is_room() -> None:
    network = two_way_road()
    many = Network(network.nodes.loc[network.nodes.index.repeat(40)], network.links)
    assert "a" not in texts(state_figure(many))


def test_unused_links_stay_on_the_map() -> None:
    network = two_way_road(ways=2)
    figure = state_figure(network)
    figure.draw_without_rendering()
    unused, used = (c for c in figure.axes[0].collections if isinstance(c, LineCollection))
    assert (len(unused.get_segments()), len(used.get_segments())) == (2, 2)
    assert legend_texts(figure)[-1] == NO_TRAFFIC
    assert NO_TRAFFIC not in legend_texts(state_figure(two_way_road()))


def test_thousands_are_set_off_by_commas() -> None:
    network = two_way_road()
    totals = link_totals(states_with_a_queue(network)).assign(volume=[2000.0, 1.0])
    assert "2,000" in legend_texts(network_state_figure(network, totals, "t"))


def legend_texts(figure: Figure) -> list[str]:
    legend = figure.axes[0].get_legend()
    assert legend is not None
    return [text.get_text() for text in legend.get_texts()]


def grid(side: int) -> Network:
    """A grid of two-way streets, 100 m apart."""
    places = np.arange(side * side).reshape(side, side)
    pairs = [*zip(places[:, :-1].ravel(), places[:, 1:].ravel(), strict=True)]
    pairs += zip(places[:-1].ravel(), places[1:].ravel(), strict=True)
    points = [Point(100.0 * (place % side), 100.0 * (place // side)) for place in places.ravel()]
    ends = [(a, b) for one, other in pairs for a, b in ((one, other), (other, one))]
    rows = [{"from_node_id": str(a), "to_node_id": str(b), "length": 100.0} for a, b in ends]
    plain = network_of(rows, [str(place) for place in places.ravel()])
    lines = [LineString([points[a], points[b]]) for a, b in ends]
    return Network(
        gpd.GeoDataFrame(plain.nodes, geometry=points, crs="EPSG:25832"),
        gpd.GeoDataFrame(plain.links, geometry=lines, crs="EPSG:25832"),
    )


@pytest.mark.parametrize("side", [3, 10, 71])
def test_lines_of_a_crowded_map_leave_paper_between_them(side: int) -> None:
    sheet = MapSheet.of(grid(side), "t")
    block = 100.0 / sheet.units_per_point
    assert sheet.usual == pytest.approx(block)
    assert 0.3 <= sheet.thin < sheet.narrowest < sheet.widest <= block / 4
    beside = sheet.beside(np.full(len(sheet.plane.lines), sheet.widest))
    edge = min(line.distance(road) for line, road in zip(beside, sheet.plane.lines, strict=True))
    assert edge / sheet.units_per_point > sheet.widest / 2  # the two directions do not touch
    assert edge / sheet.units_per_point < sheet.widest / 2 + 0.4


def test_twenty_thousand_links_are_two_artists() -> None:
    network = grid(71)
    assert len(network.links) == 19_880
    volume = np.arange(len(network.links), dtype=float)
    totals = network.links[["link_id"]].assign(volume=volume, speed=np.where(volume % 2, 20.0, 1.0))
    axes = network_state_figure(network, totals, "t").axes[0]
    unused, traffic = axes.collections
    assert (len(unused.get_paths()), len(traffic.get_paths())) == (1, 19_879)
    shown = traffic.get_array()
    assert (np.diff(shown) <= 0).all()  # the slowest on top
    assert "1 km" in {text.get_text() for text in axes.texts}


def test_a_network_without_geometry_cannot_be_drawn() -> None:
    with pytest.raises(ValueError, match="no geometry"):
        state_figure(network_of([{}, {}]))


def test_the_fundamental_diagram_is_in_vehicles_per_hour_and_kilometre() -> None:
    network = two_way_road()
    states = network_states(states_with_a_queue(network), network)
    figure = mfd_figure(states, "t")
    points = figure.axes[0].collections[0].get_offsets()
    # first bin: 1975 m x 5 and 1000 m x 5 vehicles; 190 s x 5 and 50 s x 5, on 2 km for 100 s
    assert np.asarray(points[0]) == pytest.approx([5 * 240 / 2e5 * 1000, 5 * 2975 / 2e5 * 3600])
    assert "veh/km" in figure.axes[0].get_xlabel()
    assert "veh/h" in figure.axes[0].get_ylabel()


def test_degrees_become_metres_of_equal_scale() -> None:
    network = two_way_road()
    degrees = Network(
        gpd.GeoDataFrame(network.nodes).to_crs("EPSG:4326"),
        gpd.GeoDataFrame(network.links).to_crs("EPSG:4326"),
    )
    plane = MapPlane.of(degrees)
    assert plane.metres_per_unit == 1
    lengths = [line.length for line in plane.lines]
    assert lengths == pytest.approx([1000, 1000], rel=5e-3)


@pytest.mark.parametrize(("pole", "latitude"), [("EPSG:32661", 87.0), ("EPSG:32761", -85.0)])
def test_near_a_pole_there_are_metres_too(pole: str, latitude: float) -> None:
    # a degree along a meridian is 111.7 km there; the polar grids shrink it by up to 0.6 %
    ends = [Point(20.0, latitude), Point(20.0, latitude + 0.009)]
    plain = network_of([{}, {"from_node_id": "b", "to_node_id": "a"}])
    lines = [LineString(ends), LineString(ends[::-1])]
    network = Network(
        gpd.GeoDataFrame(plain.nodes, geometry=ends, crs="EPSG:4326"),
        gpd.GeoDataFrame(plain.links, geometry=lines, crs="EPSG:4326"),
    )
    plane = MapPlane.of(network)
    assert plane.metres_per_unit == 1
    assert [line.length for line in plane.lines] == pytest.approx([1005.0, 1005.0], rel=8e-3)
    assert plane.crs == CRS.from_user_input(pole)
    assert network_state_figure(network, link_totals(states_with_a_queue(network)), "t").axes


def test_the_scale_bar_is_round_in_metres_whatever_the_unit() -> None:
    feet = MapPlane.of(two_way_road("EPSG:2263"))
    bar = feet.scale_bar(1000.0)  # US survey feet: 304.8 m
    assert bar == (pytest.approx(200 / 0.3048006096), "200 m")
    assert replace(feet, metres_per_unit=1.0).scale_bar(5300.0) == (5000.0, "5 km")
    assert replace(feet, metres_per_unit=None).scale_bar(5300.0) is None


@pytest.mark.parametrize("power", range(-3, 7))
def test_round_numbers_below_are_not_above(power: int) -> None:
    one = 10.0**power
    assert round_below(one) == pytest.approx(one)
    assert round_below(np.nextafter(one, 0)) == pytest.approx(one / 2)
    assert round_below(4.9 * one) == pytest.approx(2 * one)


def test_a_line_that_cannot_be_moved_stays() -> None:
    network = two_way_road()
    point = LineString([(0, 0), (0, 0)])
    plane = replace(MapPlane.of(network), lines=np.array([point, LineString([(0, 0), (9, 0)])]))
    stayed, moved = plane.beside(np.array([1.0, 1.0]), "right")
    assert stayed.equals_exact(point, 0)
    assert moved.bounds == pytest.approx((0, -1, 9, -1))
