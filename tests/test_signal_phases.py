"""Phases from the directions that links come from: junctions that one can picture."""

from __future__ import annotations

import itertools
import math

import geopandas
import numpy as np
import pandas as pd
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from signal_sites import CENTRE, METRIC, junction, network_of, phases_of, road, table, towards

from uxsim_geo.network.bearings import arrival_bearings
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.signal_options import SignalOptions
from uxsim_geo.network.signal_phases import group_phases, street_grain
from uxsim_geo.network.signal_plans import signal_plans

OPTIONS = SignalOptions()


@pytest.mark.parametrize(
    ("bearings", "expected"),
    [
        ([0, 90, 180, 270], [{"a", "c"}, {"b", "d"}]),  # crossroads
        ([90, 270, 0], [{"c"}, {"a", "b"}]),  # a T: the stem by itself
        ([0, 60, 180, 240], [{"a", "c"}, {"b", "d"}]),  # skewed by 30°
        ([0, 40, 180, 220], [{"a", "c"}, {"b", "d"}]),  # skewed by 50°
        ([0, 90, 150, 270], [{"a", "c"}, {"b", "d"}]),  # a bend of 30° along one road
        ([0, 120, 240], [{"a"}, {"c"}, {"b"}]),  # a Y: nothing is opposite
        ([0, 136, 260], [{"a", "b"}, {"c"}]),  # a and b miss the opposite by 44°
        ([0, 134, 260], [{"a"}, {"b"}, {"c"}]),  # by 46°, and b and c by 54°
        ([0, 90, 180, 270, 45], [{"a", "c"}, {"e"}, {"b", "d"}]),  # five legs
        ([0, 72, 144, 216, 288], [{"a", "c"}, {"e"}, {"b", "d"}]),  # five legs, a star
        ([0, 8, 90, 180, 270], [{"a", "b", "d"}, {"c", "e"}]),  # a slip road beside a
        ([0, 10, 20, 31], [{"a", "b"}, {"c", "d"}]),  # no approach is wider than 20°
        ([355, 5, 180, 90], [{"a", "b", "c"}, {"d"}]),  # the same over north
    ],
)
def test_who_has_green_together(bearings: list[float], expected: list[set[str]]) -> None:
    found = phases_of(signal_plans(junction(bearings)))
    assert sorted(map(sorted, found)) == sorted(map(sorted, expected))


def test_the_fifth_leg_pairs_with_none_and_the_star_with_the_nearest_to_opposite() -> None:
    star = group_phases([0, 72, 144, 216, 288], [1, 1, 1, 1, 1], OPTIONS)
    assert sorted(len(phase) for phase in star) == [1, 2, 2]  # all miss the opposite by 36°
    heavy = group_phases([0, 72, 144, 216, 288], [1, 1, 5, 1, 5], OPTIONS)
    assert ((2,), (4,)) in heavy  # of equal angles, the heaviest


def test_the_heaviest_approach_of_a_phase_says_when_its_turn_comes() -> None:
    """Links 0 and 1 miss the opposite by 40°: their axis is at 0° or 40°, the others' at 20°."""
    options = SignalOptions(same_direction=5)
    for weights, first in (([5, 1, 1, 1], ((0,), (1,))), ([1, 5, 1, 1], ((2,), (3,)))):
        assert group_phases([0, 220, 200, 20], weights, options)[0] == first


def test_two_oneway_streets_that_cross_have_a_phase_each() -> None:
    assert phases_of(signal_plans(junction([0, 90], one_way=True))) == [{"a"}, {"b"}]


def test_a_dual_carriageway_crossing_is_two_nodes_that_open_the_same_way() -> None:
    """The carriageways lie 20 m apart; each meets the side road at a node of its own."""
    x, y = CENTRE
    west, east = (x, y), (x + 20.0, y)
    rows = [
        road("south", "N1", "W", lanes=2, geometry=towards(180, west)),
        road("south2", "W", "S1", lanes=2, geometry=towards(180, (x, y - 200))),
        road("north", "S2", "E", lanes=2, geometry=towards(0, east)),
        road("north2", "E", "N2", lanes=2, geometry=towards(0, (x + 20, y + 200))),
        road("in_east", "A", "W", geometry=towards(90, west)),
        road("mid_east", "W", "E", geometry=towards(90, east, 20)),
        road("out_east", "E", "B", geometry=towards(90, (x + 220, y))),
        road("in_west", "B", "E", geometry=towards(270, east)),
        road("mid_west", "E", "W", geometry=towards(270, west, 20)),
        road("out_west", "W", "A", geometry=towards(270, (x - 200, y))),
    ]
    plans = signal_plans(network_of(table(rows), ["W", "E"]))
    assert phases_of(plans, "W") == [{"south"}, {"in_east", "mid_west"}]
    assert phases_of(plans, "E") == [{"north"}, {"in_west", "mid_east"}]


@pytest.mark.parametrize("turn", [0, 15, 30, 44, 45, 46, 60, 89, 135])
def test_junctions_of_a_turned_grid_open_the_same_direction_first(turn: int) -> None:
    """Streets of a real grid bend by some degrees: that must not change which goes first."""
    bends = [0.0, 3.0, -3.0, 5.0, -5.0]
    streets = [[turn, turn + 90, turn + 180, turn + 270]] * 5
    bearings = np.array(
        [(angle + bend) % 360 for row, bend in zip(streets, bends, strict=True) for angle in row]
    )
    grain = street_grain(bearings, np.ones(20))
    firsts = [
        group_phases(bearings[4 * n : 4 * n + 4].tolist(), [1.0] * 4, OPTIONS, grain=grain)[0]
        for n in range(5)
    ]
    assert len(set(firsts)) == 1


@pytest.mark.parametrize("turn", [0, 45, 90])
def test_two_crossings_along_a_street_open_it_at_the_same_time(turn: int) -> None:
    """It bends by 4° between them; at 45° that is over the bound of the compass points."""
    rows = []
    for node, bend in (("X", -2), ("Y", 2)):
        for name, bearing in zip("abcd", (0, 90, 180, 270), strict=True):
            line = towards(turn + bend + bearing)
            rows.append(road(f"{name}{node}", f"{name}-{node}", node, geometry=line))
    plans = signal_plans(network_of(table(rows), ["X", "Y"]))
    first = [{link_id[0] for link_id in phases_of(plans, node)[0]} for node in "XY"]
    assert first[0] == first[1]


def test_without_streets_there_is_no_grain() -> None:
    assert street_grain(np.array([math.nan]), np.ones(1)) == 0.0
    assert street_grain(np.empty(0), np.empty(0)) == 0.0
    assert street_grain(np.array([10.0, 100.0, 190.0]), np.ones(3)) == 10.0


@pytest.mark.parametrize("bearing", [0.0, 17.0, 90.0, 123.0, 180.0, 225.0, 300.0, 359.0])
@pytest.mark.parametrize(
    ("crs", "place"),
    [
        (METRIC, (9.0, 49.65)),
        ("EPSG:4326", (9.0, 49.65)),
        ("EPSG:4326", (180.0, -17.0)),  # on the date line
        ("EPSG:3413", (-45.0, 80.0)),
        ("EPSG:2263", (-74.0, 40.2)),  # US feet
    ],
)
def test_the_bearing_is_that_of_the_ground_in_any_system(
    bearing: float, crs: str, place: tuple[float, float]
) -> None:
    """Made with the geodesic on the ellipsoid, where north of the system is north."""
    from pyproj import Geod, Transformer

    lon, lat, _ = Geod(ellps="WGS84").fwd(*place, bearing + 180.0, 60.0)
    ahead = Transformer.from_crs("EPSG:4326", crs, always_xy=True)
    line = shapely.LineString([ahead.transform(lon, lat), ahead.transform(*place)])
    links = geopandas.GeoDataFrame({"link_id": ["a"]}, geometry=[line], crs=crs)
    found = arrival_bearings(links, 25.0)[0]
    assert abs((found - bearing + 180.0) % 360.0 - 180.0) < 0.5


def test_the_bearing_is_that_of_the_last_metres() -> None:
    lines = [
        shapely.LineString([(0, 0), (100, 0), (100, 50)]),  # north on the last 50 m
        shapely.LineString([(0, 0), (100, 0), (100, 0.5)]),  # the last half metre is drawn anyhow
        shapely.LineString([(0, 0), (3, 4)]),  # shorter than the chord
    ]
    links = geopandas.GeoDataFrame({"link_id": list("abc")}, geometry=lines)
    chord = math.degrees(math.atan2(24.5, 0.5))
    assert arrival_bearings(links, 25.0) == pytest.approx([0.0, chord, 36.87], abs=0.01)


@pytest.mark.filterwarnings("ignore:invalid value encountered in linestrings")
def test_lines_without_a_direction_have_no_bearing() -> None:
    lines = [
        None,
        shapely.LineString(),
        shapely.LineString([(1, 1), (1, 1)]),
        shapely.Point(1, 1),
        shapely.LineString([(0, 0), (math.nan, 1)]),
        shapely.LineString([(0, 0), (0, 10)]),
    ]
    links = geopandas.GeoDataFrame({"link_id": list("abcdef")}, geometry=lines, crs=METRIC)
    assert np.isnan(arrival_bearings(links, 25.0)).tolist() == [True] * 5 + [False]
    assert np.isnan(arrival_bearings(pd.DataFrame({"link_id": ["a"]}), 25.0)).all()
    assert np.isnan(arrival_bearings(links[:1], 25.0)).all()


def test_where_a_line_is_missing_every_link_has_its_own_phase() -> None:
    network = junction([0, 90, 180, 270])
    network.links.loc[network.links["link_id"] == "b", "geometry"] = None
    notes = Notes()
    assert phases_of(signal_plans(network, notes=notes)) == [{"a"}, {"b"}, {"c"}, {"d"}]
    told = notes.table().set_index("topic")["element_id"]
    assert told["signal without directions"] == "X"
    bare = network_of(pd.DataFrame(network.links.drop(columns="geometry")), ["X"])
    assert phases_of(signal_plans(bare)) == [{"a"}, {"b"}, {"c"}, {"d"}]


def lines_through(point: tuple[float, float]) -> st.SearchStrategy[list[shapely.LineString]]:
    """Any lines that end at a point: far, near, of no length, bent."""
    offset = st.floats(-300, 300).map(lambda value: round(value, 1))
    piece = st.tuples(offset, offset).map(lambda d: (point[0] + d[0], point[1] + d[1]))
    line = st.lists(piece, min_size=1, max_size=4).map(lambda p: shapely.LineString([*p, point]))
    return st.lists(line, min_size=1, max_size=9)


@settings(derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    lines=lines_through(CENTRE),
    lanes=st.lists(st.integers(1, 5), min_size=9, max_size=9),
    options=st.builds(
        SignalOptions,
        all_red=st.sampled_from([0.0, 2.5, 4.0]),
        min_green=st.integers(1, 20),
        cycle_per_phase=st.floats(5, 90),
        same_direction=st.floats(0, 90),
        opposite_within=st.floats(0, 90),
        crossings=st.sampled_from(["ignore", "pedestrians"]),
    ),
)
def test_any_junction_gives_a_plan_that_holds_together(
    lines: list[shapely.LineString], lanes: list[int], options: SignalOptions
) -> None:
    rows = [
        road(f"in{n}", f"N{n}", "X", geometry=line, lanes=lanes[n]) for n, line in enumerate(lines)
    ]
    plans = signal_plans(network_of(table(rows), ["X"]), options)
    if plans.empty:
        return
    ids = [row["link_id"] for row in rows]
    assert sorted(plans["link_id"].dropna()) == sorted(ids)  # each in one phase, once
    firsts = plans.drop_duplicates("phase")
    assert firsts["phase"].tolist() == list(range(1, len(firsts) + 1))
    total = firsts["green_s"].sum() + firsts["all_red_s"].sum()
    assert plans["cycle_s"].to_numpy() == pytest.approx(total)
    green = firsts.loc[firsts["link_id"].notna(), "green_s"]
    assert (green >= options.min_green).all()
    assert (green % 1 == 0).all()
    needed = len(firsts) * (options.min_green + options.all_red)
    assert total <= max(options.max_cycle, needed) + options.pedestrian_green
    assert len(firsts) > 1 or options.crossings == "pedestrians"


@settings(derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    bearings=st.lists(st.integers(0, 35_999).map(lambda b: b / 100), min_size=1, max_size=8),
    weights=st.lists(st.integers(1, 9).map(float), min_size=8, max_size=8),
    grain=st.integers(-45, 45),
)
def test_links_share_a_phase_only_where_the_angles_say_so(
    bearings: list[float], weights: list[float], grain: int
) -> None:
    phases = group_phases(bearings, weights[: len(bearings)], OPTIONS, grain=grain)
    assert sorted(link for phase in phases for own in phase for link in own) == [
        *range(len(bearings))
    ]
    for phase in phases:
        assert len(phase) <= 2
        for own in phase:
            for one, other in itertools.combinations(own, 2):
                apart = abs((bearings[one] - bearings[other] + 180) % 360 - 180)
                assert apart <= OPTIONS.same_direction + 0.01
        for one, other in itertools.product(*phase) if len(phase) == 2 else ():
            miss = 180 - abs((bearings[one] - bearings[other] + 180) % 360 - 180)
            # each link may lie half the width of its approach off the middle
            assert miss <= OPTIONS.opposite_within + OPTIONS.same_direction + 0.03
