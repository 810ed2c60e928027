"""Desire lines and trajectories as layers, and layers as files of their own."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pyogrio
import pytest
import shapely
from newell_link import events_of, network_of, result_of, trips_of
from packaged_road import description_of, run_of, two_way_road
from shapely.geometry import LineString, Point

from uxsim_geo.analysis.link_states import link_times
from uxsim_geo.analysis.od import od_table
from uxsim_geo.analysis.run_passages import RunPassages
from uxsim_geo.analysis.trajectories import trajectories
from uxsim_geo.events import EventTable
from uxsim_geo.export.archives import write_flatgeobuf, write_geoparquet
from uxsim_geo.export.findings import extent_of_traffic
from uxsim_geo.export.layers import link_times_layer
from uxsim_geo.export.od_layer import least_of_largest, od_lines_layer
from uxsim_geo.export.run_layers import layers_of_run
from uxsim_geo.export.trajectory_layer import Sample, trajectories_layer
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

START = datetime(2024, 3, 1, 7, 0, tzinfo=UTC)


def grid_of_nodes(side: int, apart: float) -> Network:
    """Nodes of a square grid without links between them, for trips from all to all."""
    places = [(x * apart, y * apart) for x in range(side) for y in range(side)]
    ids = [f"n{number}" for number in range(len(places))]
    plain = network_of([{"from_node_id": ids[0], "to_node_id": ids[-1]}], ids)
    nodes = gpd.GeoDataFrame(plain.nodes, geometry=[Point(p) for p in places], crs="EPSG:25832")
    line = LineString([places[0], places[-1]])
    links = gpd.GeoDataFrame(plain.links, geometry=[line], crs="EPSG:25832")
    return Network(nodes, links)


def trips_between_all(network: Network, seed: int) -> Result:
    """Some vehicles between every two nodes, a third of them arrived."""
    random = np.random.default_rng(seed)
    ids = network.nodes["node_id"].tolist()
    rows = [
        {"origin": a, "destination": b, "vehicles": int(random.integers(1, 6)), "arrive_s": 80.0}
        for a in ids
        for b in ids
    ]
    for row in rows[::3]:
        row |= {"status": "waiting", "arrive_s": np.nan}
    return result_of(events_of(network, []), trips_of(rows), Settings(100.0))


@pytest.mark.parametrize(
    ("bin_s", "duration", "first", "last"),
    [
        (50.0, 200.0, 49.0, 49.0),
        (2.0, 200.0, 1.0, 1.0),
        (1.0, 200.0, 0.0, 0.0),
        (0.25, 50.0, 0.0, 0.0),
        (75.0, 150.5, 74.0, 0.0),  # the last bin is half a second
    ],
)
def test_bins_end_a_second_before_the_next_and_never_before_they_begin(
    bin_s: float, duration: float, first: float, last: float
) -> None:
    network = network_of([{}])
    result = result_of(events_of(network, []), trips_of([{}]), Settings(duration))
    layer = link_times_layer(network, link_times(result, network, bin_s=bin_s), START)
    length = (layer["end"] - layer["begin"]).dt.total_seconds()
    assert (length.iloc[0], length.iloc[-1]) == (first, last)
    assert (layer["end"].iloc[:-1].to_numpy() < layer["begin"].iloc[1:].to_numpy()).all()


def test_few_pairs_are_lines_between_their_nodes() -> None:
    network = grid_of_nodes(2, 1000.0)
    od = od_table(trips_between_all(network, 1), network)
    layer = od_lines_layer(network, od)
    assert len(layer) == len(od) == 16
    assert layer["cell_m"].isna().all()
    places = dict(zip(network.nodes["node_id"], network.nodes["geometry"], strict=True))
    for row, pair in zip(layer.itertuples(), od.itertuples(), strict=True):
        assert (row.origin, row.destination) == (pair.origin, pair.destination)
        assert row.departed_veh == pair.vehicles_departed
        assert row.delay_s == pytest.approx(pair.delay_so_far_s)
        if row.origin == row.destination:
            assert row.geometry is None
        else:
            ends = shapely.get_coordinates(row.geometry)
            assert [Point(end) for end in ends] == [places[row.origin], places[row.destination]]
            # a scale of 0.9996 on the map's central line
            assert row.beeline_m == pytest.approx(row.geometry.length, rel=0.02)


def test_rounding_leaves_no_delay_below_zero() -> None:
    network = grid_of_nodes(2, 1000.0)
    od = od_table(trips_between_all(network, 1), network)
    od["total_delay_so_far_veh_s"] = -1e-12
    layer = od_lines_layer(network, od)
    assert (layer[["delay_s", "delay_veh_s"]] == 0.0).all(axis=None)


@pytest.mark.parametrize(
    ("vehicles", "most", "least"),
    [
        ([3.0, 1.0, 2.0], 3, 0.0),
        ([3.0, 1.0, 2.0], 2, 2.0),
        ([3.0, 2.0, 2.0, 2.0], 2, 3.0),  # of equal ones all or none
        ([2.0, 2.0, 2.0], 2, 2.0),
        ([], 2, 0.0),
    ],
)
def test_the_largest_pairs_are_no_more_than_asked_for(
    vehicles: list[float], most: int, least: float
) -> None:
    lines = [LineString([(0, 0), (k + 1, 0)]) for k in range(len(vehicles))]
    inside = pd.DataFrame({"departed_veh": [9.0], "geometry": [None]})  # a pair without a line
    layer = pd.concat([inside, pd.DataFrame({"departed_veh": vehicles, "geometry": lines})])
    assert least_of_largest(layer, most) == least
    assert least_of_largest(layer.drop(columns="geometry"), most) == 0.0


def test_many_ends_are_put_together_in_squares_and_lose_nobody(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("uxsim_geo.export.trip_ends.MOST_NODES", 24)
    monkeypatch.setattr("uxsim_geo.export.trip_ends.MOST_SQUARES", 4)
    network = grid_of_nodes(5, 400.0)
    od = od_table(trips_between_all(network, 2), network)
    layer = od_lines_layer(network, od)
    assert set(layer["origin"]) == {"A1", "A2", "B1", "B2"}
    assert len(layer) == 16
    (cell,) = set(layer["cell_m"])
    # five columns 400 m apart: cells of 1,000 m hold up to 3 x 3 nodes, smaller ones leave more
    assert cell == 1000.0
    for ours, theirs in (
        ("demanded_veh", "vehicles_demanded"),
        ("departed_veh", "vehicles_departed"),
        ("completed_veh", "vehicles_completed"),
        ("unfinished_veh", "vehicles_unfinished"),
        ("delay_veh_s", "total_delay_so_far_veh_s"),
    ):
        assert layer[ours].sum() == pytest.approx(od[theirs].sum())
    mean = np.average(layer["travel_time_s"], weights=layer["departed_veh"])
    assert mean == pytest.approx(
        np.average(od["travel_time_so_far_s"], weights=od["vehicles_departed"])
    )
    hull = shapely.box(0, 0, 1600, 1600)
    assert all(hull.contains(line) for line in layer.geometry.dropna())


def bent_road() -> tuple[Network, Result]:
    """Two links drawn with corners; a platoon waits at the end of the first, one comes after."""
    plain = network_of(
        [{"link_id": "1"}, {"link_id": "2", "from_node_id": "b", "to_node_id": "c"}],
        ["a", "b", "c"],
    )
    ends = [Point(0, 0), Point(600, 400), Point(600, 1400)]
    lines = [LineString([(0, 0), (600, 0), (600, 400)]), LineString([(600, 400), (600, 1400)])]
    nodes = gpd.GeoDataFrame(plain.nodes, geometry=ends, crs="EPSG:25832")
    network = Network(nodes, gpd.GeoDataFrame(plain.links, geometry=lines, crs="EPSG:25832"))
    events = events_of(
        network,
        [(0, 0, 5.0, 95.0), (1, 0, 15.0, 105.0), (0, 1, 95.0, 145.0), (1, 1, 105.0, np.nan)],
    )
    trips = trips_of(
        [
            {"destination": "c", "enter_s": 5.0, "arrive_s": 145.0, "distance_m": 2000.0},
            {"destination": "c", "enter_s": 15.0, "status": "running", "distance_m": 1900.0},
            {"destination": "c", "depart_s": 500.0, "status": "waiting"},
        ]
    )
    return network, result_of(events, trips, Settings(150.0))


def test_trajectories_are_where_the_vehicles_are() -> None:
    network, result = bent_road()
    passages = RunPassages(result, network)
    layer = trajectories_layer(result, network, passages, Sample(10, 5.0), START)
    assert layer["vehicle"].tolist() == [0, 1]
    assert layer["begin"].tolist() == [
        pd.Timestamp("2024-03-01T07:00:05Z"),
        pd.Timestamp("2024-03-01T07:00:15Z"),
    ]
    assert layer["end"].tolist() == [
        pd.Timestamp("2024-03-01T07:02:25Z"),
        pd.Timestamp("2024-03-01T07:02:30Z"),
    ]
    assert layer["speed_kmh"][0] == pytest.approx(3.6 * 2000 / 140)
    exact = trajectories(result, network, times=np.arange(1.0, 150.0))
    for vehicle, line in zip(layer["vehicle"], layer.geometry, strict=True):
        x, y, z, m = shapely.get_coordinates(line, include_z=True, include_m=True).T
        assert (np.diff(z) > 0).all()
        assert m == pytest.approx(z + START.timestamp(), abs=1e-3)
        own = exact[exact["vehicle"] == vehicle]
        off = np.hypot(
            np.interp(own["time_s"], z, x) - own["x"], np.interp(own["time_s"], z, y) - own["y"]
        )
        # between multiples of 5 s a platoon may stop and start at 20 m/s
        assert off.max() < 5 * 20 / 4 + 2
        on_grid = own["time_s"] % 5 == 0
        assert off[on_grid].max() < 2
        # the corner of the road is kept
        if vehicle == 0:
            assert np.hypot(x - 600, y).min() < 1e-6


def test_a_sample_is_spread_over_all_that_drove() -> None:
    network, result = bent_road()
    rows = [(v, 0, 5.0 + v, 60.0 + v) for v in range(40)]
    trips = trips_of([{"enter_s": 5.0 + v, "arrive_s": 60.0 + v} for v in range(40)])
    result = replace(result, log=EventTable(events_of(network, rows)), trips=trips)
    passages = RunPassages(result, network)
    layer = trajectories_layer(result, network, passages, Sample(4, 10.0), START)
    assert layer["vehicle"].tolist() == [5, 15, 25, 35]


def test_nobody_on_the_road_gives_empty_layers() -> None:
    network = two_way_road("EPSG:4326")
    result = result_of(events_of(network, []), trips_of([]), Settings(100.0))
    passages = RunPassages(result, network)
    assert len(trajectories_layer(result, network, passages, Sample(), START)) == 0
    assert len(od_lines_layer(network, od_table(result, network))) == 0


@pytest.mark.parametrize("crs", ["EPSG:25832", None])
def test_geoparquet_keeps_all_layers_with_their_four_coordinates(
    tmp_path: Path, crs: str | None
) -> None:
    network = two_way_road(crs)
    layers = layers_of_run(run_of(network), description_of(network))
    for name, layer in layers.items():
        path = tmp_path / f"{name}.parquet"
        write_geoparquet(path, layer)
        spatial = "geometry" in layer.columns
        back = gpd.read_parquet(path) if spatial else pd.read_parquet(path)
        assert list(back.columns) == list(layer.columns)
        if spatial:
            assert back.crs == layer.crs
            assert shapely.to_wkt(back.geometry).tolist() == shapely.to_wkt(layer.geometry).tolist()
    assert gpd.read_parquet(tmp_path / "trajectories.parquet").geometry.has_m.all()
    again = tmp_path / "again.parquet"
    write_geoparquet(again, layers["trajectories"])
    assert again.read_bytes() == (tmp_path / "trajectories.parquet").read_bytes()


def test_flatgeobuf_keeps_layers_of_the_map(tmp_path: Path) -> None:
    network = two_way_road("EPSG:25832")
    layers = layers_of_run(run_of(network), description_of(network))
    for name in ("nodes", "links", "od_lines", "import_notes", "trajectories"):
        path = tmp_path / f"{name}.fgb"
        write_flatgeobuf(path, name, layers[name])
        back = pyogrio.read_dataframe(path)
        assert set(back.columns) == set(layers[name].columns)
        assert len(back) == len(layers[name])
        assert back.crs == "EPSG:25832"
    assert back.geometry.has_z.all()


def test_the_map_opens_where_most_drive() -> None:
    """A thousand links in town and one long road out of it, which few take."""
    ends = [((x, 0), (x + 1, 0)) for x in range(1000)] + [((1000, 0), (9000, 0))]
    links = gpd.GeoDataFrame(
        {"volume_veh": [100.0] * 1000 + [1.0], "delay_veh_s": [10.0] * 1001, "length_m": 1.0},
        geometry=[LineString(pair) for pair in ends],
    )
    x0, y0, x1, y1 = extent_of_traffic(links)
    assert -60 < x0 < 30
    assert 970 < x1 < 1060
    assert y0 < 0 < y1
    links[["volume_veh", "delay_veh_s"]] = 0.0
    assert extent_of_traffic(links)[2] > 9000
