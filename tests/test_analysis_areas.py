"""Figures of parts of a network: which elements are meant, and that their figures add up."""

from __future__ import annotations

from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
from mapped_network import two_way_road
from shapely.geometry import Polygon, box
from small_networks import across, grid
from small_networks import network as network_of_rows

from uxsim_geo.analysis.areas import (
    area_pairs,
    area_states,
    links_in_polygons,
    links_of_nodes,
    nodes_in_polygons,
    zone_areas,
)
from uxsim_geo.analysis.link_states import link_times
from uxsim_geo.analysis.network_states import network_states
from uxsim_geo.analysis.od import od_table
from uxsim_geo.analysis.summary import summary
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.errors import InputError
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings


@pytest.fixture(scope="module")
def crowded() -> tuple[Network, Result]:
    of = network_of_rows(grid(4))
    return of, simulate(of, across(4, 15.0, 400.0), Settings(600.0, platoon_size=2))


def halves(of: Network) -> dict[str, list[str]]:
    """The nodes of the rows 0 and 1, and of 2 and 3."""
    ids = of.nodes["node_id"]
    upper = ids.str[0].isin(["0", "1"])
    return {"upper": ids[upper].tolist(), "lower": ids[~upper].tolist()}


def test_links_of_nodes_with_and_without_those_that_cross_the_border(
    crowded: tuple[Network, Result],
) -> None:
    of, _ = crowded
    inside = links_of_nodes(of, halves(of), border=False)
    with_border = links_of_nodes(of, halves(of))
    crossing = {f"{a},{j}-{b},{j}" for j in range(4) for a, b in ((1, 2), (2, 1))}
    assert set(with_border["upper"]) - set(inside["upper"]) == crossing
    assert set(inside["upper"]) | set(inside["lower"]) | crossing == set(of.links["link_id"])
    assert not set(inside["upper"]) & set(inside["lower"])


def test_the_states_of_areas_add_up_to_those_of_the_network(
    crowded: tuple[Network, Result],
) -> None:
    of, result = crowded
    states = link_times(result, of, bin_s=100.0)
    ids = of.links["link_id"].tolist()
    areas = {"one": ids[:7], "rest": ids[7:], "all": ids}
    table = area_states(states, of, areas)
    assert table["area"].tolist() == ["one"] * 6 + ["rest"] * 6 + ["all"] * 6
    by_area = {name: own.reset_index(drop=True) for name, own in table.groupby("area")}
    for name in ("distance", "time", "delay", "queue"):
        both = by_area["one"][name] + by_area["rest"][name]
        assert both.to_numpy() == pytest.approx(by_area["all"][name].to_numpy()), name
    whole = network_states(states, of)
    columns = list(whole.columns)
    pd.testing.assert_frame_equal(by_area["all"][columns], whole)
    assert by_area["one"]["links"].tolist() == [7] * 6
    # flow and density are per metre of lane of the area's own links
    expected = by_area["one"]["distance"] / (7 * 300.0 * 100.0)
    assert by_area["one"]["flow"].to_numpy() == pytest.approx(expected.to_numpy())


def test_trips_between_areas_are_those_of_their_pairs(crowded: tuple[Network, Result]) -> None:
    of, result = crowded
    areas = halves(of)
    table = area_pairs(result, of, areas)
    assert list(zip(table["origin_area"], table["destination_area"], strict=True)) == [
        ("upper", "upper"),
        ("upper", "lower"),
        ("lower", "upper"),
        ("lower", "lower"),
    ]
    figures = summary(result, of)
    assert table["vehicles_departed"].sum() == figures["vehicles_departed"]
    assert table["total_delay_so_far_veh_s"].sum() == pytest.approx(figures["total_delay_veh_s"])
    pairs = od_table(result, of)
    there = pairs["origin"].isin(areas["upper"]) & pairs["destination"].isin(areas["lower"])
    own, row = pairs[there], table.iloc[1]
    assert row["vehicles_completed"] == own["vehicles_completed"].sum()
    name = "experienced_travel_time_completed_only_s"
    mean = np.average(own[name], weights=own["vehicles_completed"])
    assert row[name] == pytest.approx(mean)


def test_trips_of_nodes_in_two_areas_count_in_both(crowded: tuple[Network, Result]) -> None:
    of, result = crowded
    areas = halves(of) | {"everywhere": of.nodes["node_id"].tolist()}
    table = area_pairs(result, of, areas).set_index(["origin_area", "destination_area"])
    departed = table["vehicles_departed"]
    assert departed["everywhere", "everywhere"] == summary(result, of)["vehicles_departed"]
    both = departed["upper", "lower"] + departed["upper", "upper"]
    assert departed["upper", "everywhere"] == both


def test_polygons_find_links_and_nodes_in_any_reference_system() -> None:
    network = two_way_road("EPSG:25832")  # 1 km from (0, 0) eastward, both ways
    shapes = gpd.GeoDataFrame(
        {"name": ["whole", "west", "nowhere"]},
        geometry=[box(-10, -10, 1010, 10), box(-10, -10, 500, 10), box(5e5, 5e6, 6e5, 6e6)],
        crs="EPSG:25832",
    )
    for polygons in (shapes, shapes.to_crs("EPSG:3857")):
        inside = links_in_polygons(network, polygons, "name")
        assert inside == {"whole": ["link 0", "link 1"], "west": [], "nowhere": []}
        touching = links_in_polygons(network, polygons, "name", part="touching")
        assert touching["west"] == ["link 0", "link 1"]
        assert nodes_in_polygons(network, polygons, "name") == {
            "whole": ["a", "b"],
            "west": ["a"],
            "nowhere": [],
        }


def test_polygons_of_one_name_are_one_area() -> None:
    network = two_way_road("EPSG:25832")
    shapes = gpd.GeoDataFrame(
        {"name": ["ends", "ends"]},
        geometry=[box(-10, -10, 10, 10), box(990, -10, 1010, 10)],
        crs="EPSG:25832",
    )
    assert nodes_in_polygons(network, shapes, "name") == {"ends": ["a", "b"]}


def test_zones_are_areas_of_their_nodes(crowded: tuple[Network, Result]) -> None:
    of = crowded[0]
    nodes = of.nodes.assign(zone_id=[None, "west", "east", "west"] + [None] * 12)
    areas = zone_areas(Network(nodes, of.links))
    ids = of.nodes["node_id"].tolist()
    assert areas == {"west": [ids[1], ids[3]], "east": [ids[2]]}


@pytest.mark.parametrize(
    ("areas", "message"),
    [
        ({}, "areas: is empty"),
        ({"a": []}, r"areas\[a\]: is empty"),
        ({"a": ["0,0"], "b": ["x", "y"]}, "(?s)'x'.*'y'"),
    ],
)
def test_areas_of_nothing_are_refused(
    crowded: tuple[Network, Result], areas: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        area_pairs(crowded[1], crowded[0], areas)


def test_polygons_that_do_not_go_with_the_network_are_refused_at_once() -> None:
    shapes = gpd.GeoDataFrame({"name": ["a", "b"]}, geometry=[Polygon(), None])
    with pytest.raises(InputError, match=r"(?s)no such column; there are name.*row 1.*no CRS"):
        nodes_in_polygons(two_way_road("EPSG:25832"), shapes, "zone")
    with pytest.raises(InputError, match="part"):
        links_in_polygons(two_way_road(), shapes, "name", part="near")  # type: ignore[arg-type]


def test_a_network_without_coordinates_has_nothing_in_polygons(
    crowded: tuple[Network, Result],
) -> None:
    shapes = gpd.GeoDataFrame({"name": ["a"]}, geometry=[box(0, 0, 1, 1)])
    with pytest.raises(InputError, match="no coordinates"):
        nodes_in_polygons(crowded[0], shapes, "name")


def test_a_link_across_the_seam_of_two_polygons_of_one_name_lies_inside() -> None:
    shapes = gpd.GeoDataFrame(
        {"name": ["whole", "half", "whole"]},
        geometry=[box(-10, -10, 500, 10), box(-10, -10, 500, 10), box(500, -10, 1010, 10)],
        crs="EPSG:25832",
    )
    inside = links_in_polygons(two_way_road("EPSG:25832"), shapes, "name")
    assert inside == {"whole": ["link 0", "link 1"], "half": []}


def test_rows_without_a_name_or_a_valid_polygon_are_all_told() -> None:
    bow_tie = Polygon([(0, 0), (1, 1), (1, 0), (0, 1)])
    shapes = [box(0, 0, 1, 1), bow_tie, Polygon(), box(0, 0, 1, 1).centroid, None]
    polygons = gpd.GeoDataFrame({"name": [None, *"abcd"]}, geometry=shapes, crs="EPSG:25832")
    with pytest.raises(InputError) as raised:
        links_in_polygons(two_way_road("EPSG:25832"), polygons, "name")
    told = [fault.what for fault in raised.value.faults]
    assert told[0] == "row 0: has no name"
    assert told[1].startswith("row 1: is no valid polygon (Self-intersection")
    assert told[2:] == [
        "row 2: has no geometry",
        "row 3: must be a polygon",
        "row 4: has no geometry",
    ]
    with pytest.raises(InputError, match="have no geometry: give a layer of polygons"):
        links_in_polygons(two_way_road(), pd.DataFrame({"name": ["a"]}), "name")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="the network has no CRS"):
        links_in_polygons(two_way_road(None), polygons[:1].assign(name="a"), "name")


def test_names_that_are_no_text_are_made_so(crowded: tuple[Network, Result]) -> None:
    of, result = crowded
    states = link_times(result, of, bin_s=300.0)
    areas: dict[Any, list[str]] = {1: of.links["link_id"][:2].tolist(), 2.5: ["0,0-1,0"]}
    table = area_states(states, of, areas)
    assert table["area"].tolist() == ["1", "1", "2.5", "2.5"]
