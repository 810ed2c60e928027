"""Figures of trips and of links: numbers in the artists that one can work out by hand."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from mapped_network import states_with_a_queue, two_way_road
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from newell_link import events_of, network_of, result_of, trips_of

from uxsim_geo.analysis.cells import space_time_cells
from uxsim_geo.analysis.link_states import link_times, link_totals
from uxsim_geo.analysis.network_states import network_states
from uxsim_geo.analysis.passages import Passages
from uxsim_geo.errors import InputError
from uxsim_geo.export import fundamental_diagram as fd
from uxsim_geo.export.cumulative import cumulative_figure
from uxsim_geo.export.desire_lines import THIN, WIDE, _pairs, desire_lines_figure
from uxsim_geo.export.fundamental_diagram import fundamental_diagram_figure
from uxsim_geo.export.network_plan import network_figure
from uxsim_geo.export.plots import mfd_figure, network_state_figure
from uxsim_geo.export.space_time_states import space_time_states_figure
from uxsim_geo.export.trajectories import trajectories_figure
from uxsim_geo.export.travel_times import travel_times_figure
from uxsim_geo.network.network import Network
from uxsim_geo.settings import Settings


def texts(figure: Figure) -> str:
    return "\n".join(text.get_text() for text in figure.axes[0].texts)


def legend_texts(figure: Figure) -> list[str]:
    legend = figure.axes[0].get_legend() or figure.legends[0]
    return [text.get_text() for text in legend.get_texts()]


def od(*rows: tuple[str, str, float, float]) -> pd.DataFrame:
    columns = ["origin", "destination", "vehicles_departed", "total_delay_so_far_veh_s"]
    return pd.DataFrame(rows, columns=columns)


def desire_lines(figure: Figure) -> tuple[LineCollection, LineCollection]:
    figure.draw_without_rendering()
    _, shown, others = (c for c in figure.axes[0].collections if isinstance(c, LineCollection))
    return shown, others


def test_desire_lines_bow_to_the_right_of_their_direction() -> None:
    table = od(("a", "b", 30.0, 3600.0), ("b", "a", 60.0, 0.0))
    shown, _ = desire_lines(desire_lines_figure(two_way_road(), table, "t"))
    there, back = shown.get_segments()  # the larger is drawn last, on top
    assert there[0] == pytest.approx((0, 0))
    assert there[-1] == pytest.approx((1000, 0))
    assert (there[1:-1, 1] < 0).all()  # eastwards: right is south
    assert there[10] == pytest.approx((500, -120))
    assert back == pytest.approx(there * (1, -1) * (-1, 1) + (1000, 0))
    np.testing.assert_allclose(shown.get_linewidth(), [THIN + (WIDE - THIN) / 2, WIDE])
    np.testing.assert_allclose(shown.get_array(), [2.0, 0.0])  # min


def test_classes_and_slices_are_one_pair_and_trips_within_a_node_none() -> None:
    rows = [("a", "b", 30.0, 3600.0), ("a", "b", 10.0, 1200.0), ("b", "b", 90.0, 0.0)]
    figure = desire_lines_figure(two_way_road(), od(*rows, ("b", "a", 0.0, 0.0)), "t")
    shown, others = desire_lines(figure)
    np.testing.assert_allclose(shown.get_array(), [2.0])
    assert others.get_segments() == []
    assert "1 of 1 pair,\n100 % of vehicles" in texts(figure)


def test_small_pairs_lie_thin_below() -> None:
    table = od(("a", "b", 30.0, 3600.0), ("b", "a", 90.0, 0.0))
    figure = desire_lines_figure(two_way_road(), table, "t", most=1)
    shown, others = desire_lines(figure)
    assert [line[0] for line in shown.get_segments()] == [pytest.approx((1000, 0))]
    assert [line[0] for line in others.get_segments()] == [pytest.approx((0, 0))]
    assert others.get_zorder() < shown.get_zorder()
    assert "1 of 2 pairs,\n75 % of vehicles" in texts(figure)
    assert "other pairs" in legend_texts(figure)


def test_lines_that_bow_out_of_the_map_are_on_the_paper() -> None:
    table = od(("a", "b", 30.0, 3600.0), ("b", "a", 60.0, 0.0))
    bottom, top = desire_lines_figure(two_way_road(), table, "t").axes[0].get_ylim()
    assert bottom < -120
    assert top > 120


def test_desire_lines_of_nobody_and_of_nodes_that_are_not_there() -> None:
    assert "nobody" in texts(desire_lines_figure(two_way_road(), od(), "t"))
    with pytest.raises(ValueError, match="nodes that the network lacks"):
        desire_lines_figure(two_way_road(), od(("a", "x", 1.0, 0.0)), "t")


def every_fate() -> pd.DataFrame:
    """Of 100 vehicles 40 take 10 min, 50 take 20 min, 10 take 30 min; 7 run, 5 wait, 3 gave up."""
    done = [(40, 600.0), (50, 1200.0), (10, 1800.0)]
    rows = [{"vehicles": n, "arrive_s": t + 60, "depart_s": 60.0} for n, t in done]
    rows += [{"vehicles": n, "status": s} for n, s in [(7, "running"), (5, "waiting")]]
    return trips_of([*rows, {"vehicles": 3, "status": "aborted"}])


def test_travel_times_weigh_vehicles_and_say_who_is_missing() -> None:
    figure = travel_times_figure(every_fate(), "t")
    axes = figure.axes[0]
    bars = {round(p.get_x(), 6): p.get_height() for p in axes.patches if hasattr(p, "get_height")}
    assert {x: h for x, h in bars.items() if h} == {10.0: 40.0, 20.0: 50.0, 30.0: 10.0}
    assert axes.get_ylabel() == "vehicles per 0.5 min"
    assert axes.get_xlabel() == "travel time, min"
    marks = [line.get_xdata()[0] for line in axes.lines]
    assert marks == [pytest.approx(20.0), pytest.approx(30.0)]
    assert "median: 20.0 min" in legend_texts(figure)
    said = "100 vehicles arrived; 12 had not arrived by the end; 3 gave up"
    assert said in texts(figure)


def test_travel_times_at_free_flow_stand_beside() -> None:
    (outline,) = (
        p
        for p in travel_times_figure(every_fate(), "t").axes[0].patches
        if p.get_label() == "at free flow"
    )
    assert outline.get_xy()[:, 1].max() == 100.0  # all take 50 s
    without = travel_times_figure(every_fate(), "t", free_flow=False)
    assert "at free flow" not in legend_texts(without)


def test_travel_times_of_nobody() -> None:
    assert "nobody has arrived" in texts(travel_times_figure(every_fate().iloc[3:], "t"))


def test_states_lie_on_the_diagram_of_their_link() -> None:
    network = two_way_road()
    figure = fundamental_diagram_figure(
        network, states_with_a_queue(network), ["link 0", "link 1"], 1.0, "t"
    )
    axes = figure.axes[0]
    # u = 20 m/s, κ = 0.2 veh/m, τ = 1 s: 0.8 veh/s at 0.04 veh/m; one triangle for both links
    (triangle,) = axes.lines
    np.testing.assert_allclose(triangle.get_xydata(), [(0, 0), (40, 2880), (200, 0)])
    assert triangle.get_color() == fd.SHARED
    queue, free = axes.collections
    # 5 vehicles drove 1000 m + 5 x 975 m in the first 100 s, and stood in the second
    expected = [(5 * 190 / 100, 5 * 1.975 * 36), (2 * 5, 0)]
    np.testing.assert_allclose(queue.get_offsets(), expected)
    np.testing.assert_allclose(free.get_offsets()[0], (5 * 50 / 100, 5 * 36))
    assert legend_texts(figure) == ["own diagram", "link link 0", "link link 1"]
    assert axes.get_xlabel() == "density, veh/km of the link"
    assert axes.get_ylabel() == "flow, veh/h of the link"


def test_a_given_capacity_cuts_the_diagram() -> None:
    network = two_way_road()
    network.links["capacity"] = [0.4, 5.0]  # veh/s; the latter is above what is possible
    states = states_with_a_queue(network)
    figure = fundamental_diagram_figure(network, states, ["link 0", "link 1"], 1.0, "t")
    given = [line for line in figure.axes[0].lines if line.get_linestyle() == "--"]
    # up to 0.4 / 20 veh/m; half of the way from the jam back to the top
    np.testing.assert_allclose(given[0].get_xydata(), [(20, 1440), (120, 1440)])
    assert len(given) == 1
    assert to_hex(given[0].get_color()) == fd.COLOURS[0]


def test_too_many_links_are_refused() -> None:
    network = two_way_road()
    states = states_with_a_queue(network)
    with pytest.raises(InputError, match="at most 21 links"):
        fundamental_diagram_figure(network, states, ["link 0"] * 22, 1.0, "t")
    with pytest.raises(InputError, match=r"none of this name .found 'x'"):
        fundamental_diagram_figure(network, states, ["x"], 1.0, "t")


def test_the_bare_network_has_lines_arrows_and_names() -> None:
    figure = network_figure(two_way_road(), "t")
    axes = figure.axes[0]
    (lines,) = (c for c in axes.collections if isinstance(c, LineCollection))
    (heads,) = (c for c in axes.collections if isinstance(c, PolyCollection))
    assert len(lines.get_segments()) == len(heads.get_paths()) == 2
    tip, left, right = heads.get_paths()[0].vertices[:3]
    assert tip[0] > left[0] == pytest.approx(right[0])  # eastwards
    assert {"a", "b", "link 0", "link 1"} <= set(texts(figure).splitlines())
    assert texts(network_figure(two_way_road(), "t", font_size=0)) == ""


def test_many_links_take_few_artists_and_no_names() -> None:
    network = two_way_road(ways=50)
    many = Network(network.nodes.loc[network.nodes.index.repeat(40)], network.links)
    axes = network_figure(many, "t").axes[0]
    assert not axes.texts
    assert not axes.lines
    assert len(axes.collections) == 3


def test_maps_of_a_network_without_geometry_are_refused() -> None:
    bare = network_of([{}])
    with pytest.raises(ValueError, match="no geometry"):
        network_figure(bare, "t")
    with pytest.raises(ValueError, match="no geometry"):
        desire_lines_figure(bare, od(("a", "b", 1.0, 0.0)), "t")


def test_of_equal_pairs_those_shown_are_spread_over_the_table() -> None:
    ends = [(a, b) for a in "abcdefgh" for b in "abcdefgh" if a != b]
    table = od(*((a, b, 5.0, 0.0) for a, b in ends))
    many = Network(
        two_way_road().nodes.loc[[0] * 8].assign(node_id=list("abcdefgh")), two_way_road().links
    )
    pairs = _pairs(many, table, 8)
    # seven pairs of each origin: one of each is shown
    assert pairs.origin[-8:].tolist() == list(range(8))
    assert sorted(zip(pairs.origin, pairs.destination, strict=True)) == sorted(
        (ord(a) - 97, ord(b) - 97) for a, b in ends
    )
    larger = _pairs(many, pd.concat([table, od(("a", "b", 1.0, 0.0))]), 3)
    assert (larger.origin[-1], larger.destination[-1]) == (0, 1)
    assert len(set(larger.origin[-3:])) == 3


def test_without_any_delay_the_scale_is_a_minute() -> None:
    shown, _ = desire_lines(desire_lines_figure(two_way_road(), od(("a", "b", 1.0, 0.0)), "t"))
    assert (shown.norm.vmin, shown.norm.vmax) == (0.0, 1.0)


def test_of_one_vehicle_no_part_is_spoken_of() -> None:
    figure = desire_lines_figure(two_way_road(), od(("a", "b", 1.0, 0.0)), "t")
    assert legend_texts(figure) == ["1"]
    one = trips_of([{"vehicles": 1, "arrive_s": 60.0}])
    assert texts(travel_times_figure(one, "t")) == "1 vehicle arrived"


def test_who_departs_after_the_end_is_not_missing() -> None:
    late = trips_of([{"vehicles": 9, "status": "waiting", "depart_s": 2000.0}])
    trips = pd.concat([every_fate(), late], ignore_index=True)
    said = "100 vehicles arrived; 12 had not arrived by the end; 3 gave up"
    assert texts(travel_times_figure(trips, "t", duration=1900.0)) == said


def test_where_nobody_drove_pictures_say_so() -> None:
    network = two_way_road()
    result = result_of(events_of(network, []), trips_of([]), Settings(200.0))
    states, passages = link_times(result, network, bin_s=100.0), Passages.of(result, network)
    cells = space_time_cells(result, network, bin_s=100.0, cell_m=500.0)
    for figure in (
        mfd_figure(network_states(states, network), "t"),
        network_state_figure(network, link_totals(states), "t"),
        trajectories_figure(network, passages, ["link 0"], 200.0),
        trajectories_figure(network, passages, ["link 0"], 200.0, by_speed=True),
        space_time_states_figure(network, cells, ["link 0"]),
        cumulative_figure(network, passages, "link 0", 200.0),
        fundamental_diagram_figure(network, states, ["link 0"], 1.0, "t"),
    ):
        assert "nobody drove" in texts(figure)
    assert legend_texts(network_state_figure(network, link_totals(states), "t")) == ["no vehicles"]


def test_points_at_zero_are_whole() -> None:
    network = two_way_road()
    states = states_with_a_queue(network)
    mfd = mfd_figure(network_states(states, network), "t")
    diagram = fundamental_diagram_figure(network, states, ["link 0"], 1.0, "t")
    for figure in (mfd, diagram):
        assert not any(points.get_clip_on() for points in figure.axes[0].collections)


def test_the_scale_of_flow_ends_at_the_capacity() -> None:
    network = two_way_road()
    rows = [(0, 0, 0.0, 50.0)]
    result = result_of(events_of(network, rows), trips_of([{}]), Settings(200.0))
    cells = space_time_cells(result, network, bin_s=100.0, cell_m=500.0)
    figure = space_time_states_figure(network, cells, ["link 0"], "flow", reaction_time=1.0)
    # 20 m/s, 0.2 veh/m: 0.8 veh/s
    assert figure.axes[0].collections[0].get_clim() == (0.0, pytest.approx(2880.0))
    assert "capacity at the top" in figure.axes[1].get_ylabel()


def test_north_stands_below_the_map() -> None:
    figure = network_state_figure(
        two_way_road(), link_totals(states_with_a_queue(two_way_road())), "t"
    )
    figure.draw_without_rendering()
    axes = figure.axes[0]
    (north,) = (text for text in axes.texts if text.get_text() == "N")
    paper, box = figure.bbox, north.get_window_extent()
    assert paper.y0 <= box.y0
    assert box.y1 <= axes.bbox.y0
    (arrow,) = (text.arrow_patch for text in axes.texts if getattr(text, "arrow_patch", None))
    assert paper.y0 <= arrow.get_window_extent().y0
    assert arrow.get_window_extent().y1 <= box.y0 + 1
