"""Zones on a map and points: which nodes serve them, and with which shares."""

from __future__ import annotations

from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
from od_files import hour, mapped, told, values, write
from pyproj import Transformer
from shapely.geometry import LineString, Point, Polygon, box
from small_networks import link, network

from uxsim_geo.demand.od_files import read_od
from uxsim_geo.demand.od_loading import load_od
from uxsim_geo.demand.points import Points, nearest_nodes
from uxsim_geo.demand.zones import AccessOptions, access_of_zones, read_zones
from uxsim_geo.errors import InputError
from uxsim_geo.network.network import Network

E, N = 500_000.0, 5_500_000.0  # in the middle of UTM zone 32

#: a ↔ b ↔ c ↔ d along a road of 3 km; from a one may leave to the dead end z
PLACES = {
    "a": (E, N),
    "b": (E + 1000, N),
    "c": (E + 2000, N),
    "d": (E + 3000, N),
    "z": (E, N + 1000),
}
LINKS = [
    *(link(f"{s}{t}", s, t) for s, t in ("ab", "ba", "bc", "cb", "cd", "dc")),
    link("az", "a", "z", lanes=2),
]


@pytest.fixture
def road() -> Network:
    return mapped(LINKS, PLACES)


def zones(shapes: dict[str, object], crs: str | None = "EPSG:25832") -> gpd.GeoDataFrame:
    return gpd.GeoDataFrame({"zone": list(shapes)}, geometry=list(shapes.values()), crs=crs)


def around(x: float, y: float, half: float) -> Polygon:
    return box(E + x - half, N + y - half, E + x + half, N + y + half)


def test_nodes_inside_serve_a_zone_in_even_shares(road: Network) -> None:
    of = access_of_zones(zones({"west": box(E - 9, N - 9, E + 1009, N + 1009)}), road)
    assert values(of.origins) == [["west", "a", 0.5], ["west", "b", 0.5]]  # z has no way out
    third = pytest.approx(1 / 3)
    assert values(of.destinations) == [["west", node, third] for node in "abz"]
    assert of.notes.empty


def test_shares_by_capacity_and_by_a_column(road: Network) -> None:
    west = zones({"west": box(E - 9, N - 9, E + 1009, N + 1009)})
    of = access_of_zones(west, road, AccessOptions(weights="capacity"))
    # out of a: one lane and two; out of b: one and one
    assert values(of.origins) == [["west", "a", 0.6], ["west", "b", 0.4]]
    given = road.links.assign(capacity=[1.0, 1.0, np.nan, 1.0, 1.0, 1.0, 6.0])
    of = access_of_zones(west, Network(road.nodes, given), AccessOptions(weights="capacity"))
    per_lane = 11 / 7
    assert of.origins["share"].tolist() == pytest.approx(
        [7 / (8 + per_lane), (1 + per_lane) / (8 + per_lane)]
    )
    jobs = Network(road.nodes.assign(jobs=[30.0, 0.0, 5.0, 5.0, 10.0]), road.links)
    of = access_of_zones(west, jobs, AccessOptions(weights="jobs"))
    assert values(of.origins) == [["west", "a", 1.0]]
    assert values(of.destinations) == [["west", "a", 0.75], ["west", "z", 0.25]]


def test_the_heaviest_nodes_come_first_then_the_nearest(road: Network) -> None:
    whole = zones({"all": box(E - 9, N - 9, E + 3009, N + 1009)})
    two = AccessOptions(nodes_per_zone=2)
    # the middle is at 1.5 km
    assert access_of_zones(whole, road, two).origins["node"].tolist() == ["b", "c"]
    one = AccessOptions(nodes_per_zone=1, weights="capacity")
    assert access_of_zones(whole, road, one).origins["node"].tolist() == ["a"]


def test_a_zone_without_a_node_takes_the_nearest_up_to_a_distance(road: Network) -> None:
    empty = zones({"near": around(400, 300, 50), "far": around(9000, 0, 50)})
    of = access_of_zones(empty, road, AccessOptions(nodes_per_zone=2, within_m=700.0))
    assert values(of.origins) == [["near", "a", 0.5], ["near", "b", 0.5]]
    assert of.zones.tolist() == ["far", "near"]
    notes = of.notes["value"].tolist()
    assert notes == ["1: near", "1: far", "1: near", "1: far"]
    loaded = load_od(hour(("near", "far", 3.0), ("near", "near", 1.0)), road, of)
    assert loaded.demand.table.empty
    assert loaded.dropped["reason"].tolist() == ["no access node", "intrazonal"]


def test_zones_may_be_points_and_in_another_system(road: Network) -> None:
    to_degrees = Transformer.from_crs("EPSG:25832", "EPSG:4326", always_xy=True)
    lon, lat = to_degrees.transform(E + 1020, N + 30)
    of = access_of_zones(
        zones({"7": Point(lon, lat)}, "EPSG:4326"), road, AccessOptions(nodes_per_zone=1)
    )
    assert of.origins["node"].tolist() == ["b"]


def test_a_network_in_degrees_feet_or_web_metres_is_measured_in_metres() -> None:
    for crs in ("EPSG:4326", "EPSG:2231", "EPSG:3857"):
        to_own = Transformer.from_crs("EPSG:32613", crs, always_xy=True)
        places = {node: to_own.transform(x, 4_400_000.0 + y - N) for node, (x, y) in PLACES.items()}
        of = mapped(LINKS, places, crs)
        point = np.array([[E + 1300.0, 4_400_400.0]])
        node, distance = nearest_nodes(point, of, "origin")
        assert of.nodes["node_id"].iloc[node[0]] == "b"
        assert distance[0] == pytest.approx(500.0, abs=0.5)


def test_order_of_rows_of_zones_does_not_matter(road: Network) -> None:
    shapes = {"10": around(0, 0, 50), "9": around(1000, 0, 50), "b": around(2000, 0, 1100)}
    first = access_of_zones(zones(shapes), road)
    second = access_of_zones(zones(dict(reversed(shapes.items()))), road)
    assert first.origins.equals(second.origins)
    assert first.origins["zone"].tolist() == ["9", "10", "b", "b", "b"]


def test_a_node_on_a_border_serves_both(road: Network) -> None:
    both = zones(
        {"1": box(E - 500, N - 9, E + 1000, N + 9), "2": box(E + 1000, N - 9, E + 1500, N + 9)}
    )
    of = access_of_zones(both, road)
    assert values(of.origins) == [["1", "a", 0.5], ["1", "b", 0.5], ["2", "b", 1.0]]


def test_crossed_areas_are_repaired_and_told(road: Network) -> None:
    bow = Polygon([(E - 9, N - 9), (E + 9, N + 9), (E + 9, N - 9), (E - 9, N + 9)])
    of = access_of_zones(zones({"bow": bow}), road)
    assert of.origins["node"].tolist() == ["a"]
    assert of.notes["severity"].tolist() == ["warning"]


def test_faults_of_zones_all_at_once(road: Network) -> None:
    shapes = [box(0, 0, 1, 1), box(0, 0, 1, 1), None, LineString([(0, 0), (1, 1)])]
    table = gpd.GeoDataFrame({"zone": ["1", "1", "", "4"]}, geometry=shapes)
    with pytest.raises(InputError) as raised:
        access_of_zones(table, road, AccessOptions(weights="nobody"))
    message = str(raised.value)
    for what in (
        "column crs: must be stated: that of the network is EPSG:25832",
        "row 1: the zone stands in an earlier row",
        "row 2: needs a name",
        "row 2: has no geometry",
        "row 3: its geometry must be an area",
        "column of the nodes (found 'nobody')",
    ):
        assert what in message
    with pytest.raises(InputError, match="no reference system, so points"):
        access_of_zones(zones({"1": box(0, 0, 1, 1)}), mapped(LINKS, PLACES, None))
    with pytest.raises(InputError, match="no geometry"):
        access_of_zones(zones({"1": box(0, 0, 1, 1)}), network(LINKS))


def test_zones_on_a_network_without_any_system() -> None:
    plain = mapped(LINKS, {node: (x - E, y - N) for node, (x, y) in PLACES.items()}, None)
    of = access_of_zones(zones({"1": box(900, -9, 2100, 9)}, None), plain)
    assert values(of.origins) == [["1", "b", 0.5], ["1", "c", 0.5]]


def test_zones_from_files(tmp_path: Path) -> None:
    table = zones({"1": around(0, 0, 50), "2": around(1000, 0, 50)}).assign(jobs=[3, 4])
    table = table.assign(zone=table["zone"].astype(int)).rename(columns={"zone": "no"})
    for name in ("zones.gpkg", "zones.geojson"):
        table.to_file(tmp_path / name)
    table.rename_geometry("geom").to_parquet(tmp_path / "zones.parquet")
    for name in ("zones.gpkg", "zones.geojson", "zones.parquet"):
        found = read_zones(tmp_path / name, "no")
        assert found["zone"].tolist() == ["1", "2"]
        assert found["jobs"].tolist() == [3, 4]
        assert found.crs is not None
    with pytest.raises(InputError, match=r"zones\.gpkg, column zone: has no such column"):
        read_zones(tmp_path / "zones.gpkg")
    with pytest.raises(InputError, match="no such file"):
        read_zones(tmp_path / "absent.gpkg")
    with pytest.raises(InputError, match="cannot be read as a table"):
        read_zones(write(tmp_path, "text.gpkg", "no database"))
    table_without = write(tmp_path, "zones.csv", "zone\n1\n")
    with pytest.raises(InputError, match="convert it to GeoPackage"):
        read_zones(table_without)


HEAD = "origin_lon,origin_lat,destination_lon,destination_lat,vehicles\n"


def degrees(x: float, y: float) -> str:
    lon, lat = Transformer.from_crs("EPSG:25832", "EPSG:4326", always_xy=True).transform(
        E + x, N + y
    )
    return f"{lon:.7f},{lat:.7f}"


def test_points_go_to_the_nearest_node(tmp_path: Path, road: Network) -> None:
    text = HEAD + f"{degrees(40, 30)},{degrees(1900, 0)},2\n"
    text += f"{degrees(-30, -40)},{degrees(2050, 10)},3\n"
    text += f"{degrees(0, 1000)},{degrees(3000, 0)},4\n"  # nothing leaves z
    text += f"{degrees(0, 0)},{degrees(0, 900)},1\n"  # but it can be reached
    text += f"{degrees(10, 0)},{degrees(0, 10)},9\n"
    path = write(tmp_path, "points.csv", text)
    loaded = load_od(in_first_hour(path, Points(road, "EPSG:4326", within_m=200.0)), road)
    assert values(loaded.demand.table, "origin", "destination", "vehicles") == [
        ["a", "c", 5.0],
        ["a", "z", 1.0],
    ]
    assert sorted(loaded.dropped["reason"]) == ["intrazonal", "no access node"]
    lost = loaded.dropped.set_index("reason").loc["no access node"]
    assert lost["vehicles"] == 4.0
    assert lost["origin"].split()[1].startswith("49.6")  # its coordinates
    far = loaded.demand.notes.query("topic == 'points'")["value"].astype(float).tolist()
    assert far == pytest.approx([50.0, 100.0], abs=0.3)


def in_first_hour(path: Path, points: Points):  # type: ignore[no-untyped-def]
    from uxsim_geo.demand.profile import TripsOptions
    from uxsim_geo.demand.timing import in_time

    return in_time(read_od(path, points=points), TripsOptions(3600.0))


def test_faults_of_points(tmp_path: Path, road: Network) -> None:
    with pytest.raises(InputError, match=r"crs.*must be stated"):
        Points(road)
    with pytest.raises(InputError, match="metres above 0"):
        Points(road, "EPSG:4326", within_m=0.0)
    rows = ("9,49,8.9,149.6,1", "9,49,x,49,1", "9,nan,9,49,-1", "9,49,9,49,1")
    beyond = write(tmp_path, "points.csv", HEAD + "\n".join(rows))
    with pytest.raises(InputError) as raised:
        read_od(beyond, points=Points(road, "EPSG:4326"))
    assert [fault[:2] for fault in told(raised.value)] == [
        (3, "destination_lon"),
        (4, "origin_y"),
        (2, "destination_y"),
        (4, "vehicles"),
    ]
    assert "149.6" in str(raised.value)
    with pytest.raises(InputError, match="is not a reference system"):
        read_od(beyond, points=Points(road, "EPSG:nowhere"))
    with pytest.raises(InputError, match="that of the network is"):
        read_od(beyond, points=Points(road, "none"))
    with pytest.raises(InputError, match="lacks the column origin "):
        read_od(beyond)


def test_without_any_system_coordinates_are_metres(tmp_path: Path) -> None:
    plain = mapped(LINKS, {node: (x - E, y - N) for node, (x, y) in PLACES.items()}, None)
    text = "origin_x,origin_y,destination_x,destination_y,vehicles\n1,1,2000,0,2\n"
    od = read_od(write(tmp_path, "p.csv", text), points=Points(plain, "none", within_m=2.0))
    assert values(od.table) == [["a", "c", 2.0]]
