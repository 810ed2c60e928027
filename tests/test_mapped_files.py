"""Files of lines in all the formats, and files that are none."""

from __future__ import annotations

from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import shapely
from gmns_files import assert_same_network

from uxsim_geo.errors import InputError
from uxsim_geo.network.check import check_network
from uxsim_geo.network.gmns import read_gmns_network
from uxsim_geo.network.gmns_write import write_gmns_network
from uxsim_geo.network.mapped import network_from_tables, read_mapped_network
from uxsim_geo.network.mapped_options import ColumnMapping, Direction, Source

MAPPING = ColumnMapping(
    {
        "link_id": "key",
        "name": "name",
        "free_speed": Source("vmax", unit="mph"),
        "lanes": Source("lanes", missing=1),
    },
    nodes={"node_id": "node"},
)


def links() -> gpd.GeoDataFrame:
    lines = [[(10, 60), (10.01, 60)], [(10.01, 60), (10.01, 60.01)], [(10.01, 60.01), (10, 60)]]
    return gpd.GeoDataFrame(
        {
            "key": [1, 2, 3],
            "name": ["Straße", None, "橋"],
            "vmax": [30, 35, 55.5],
            "lanes": [2, 1, 3],
        },
        geometry=[shapely.linestrings(one) for one in lines],
        crs="EPSG:4326",
    )


def nodes() -> gpd.GeoDataFrame:
    points = shapely.points([(10, 60), (10.01, 60), (10.01, 60.01)])
    return gpd.GeoDataFrame({"node": ["a", "b", "c"]}, geometry=points, crs="EPSG:4326")


def write(table: gpd.GeoDataFrame, path: Path) -> Path:
    if path.suffix == ".parquet":
        table.to_parquet(path)
    else:
        # a spatial index of FlatGeobuf would change the order of the features
        table.to_file(path, **({"SPATIAL_INDEX": "NO"} if path.suffix == ".fgb" else {}))
    return path


@pytest.mark.parametrize("suffix", [".gpkg", ".geojson", ".fgb", ".shp", ".parquet"])
def test_the_same_network_from_every_format(tmp_path: Path, suffix: str) -> None:
    paths = [write(links(), tmp_path / f"l{suffix}"), write(nodes(), tmp_path / f"n{suffix}")]
    network = read_mapped_network(paths[0], MAPPING, nodes_file=paths[1])
    check_network(network)
    assert_same_network(network, network_from_tables(links(), MAPPING, nodes()))
    assert network.links["name"].tolist()[::2] == ["Straße", "橋"]


def test_layers_are_named_where_there_are_several(tmp_path: Path) -> None:
    path = tmp_path / "both.gpkg"
    links().to_file(path, layer="roads")
    nodes().to_file(path, layer="junctions")
    named = {"links_layer": "roads", "nodes_layer": "junctions"}
    network = read_mapped_network(path, MAPPING, nodes_file=path, **named)
    assert len(network.links) == 3
    with pytest.raises(InputError) as raised:
        read_mapped_network(path, MAPPING, nodes_file=path, nodes_layer="ghost")
    assert [fault.what for fault in raised.value.faults] == [
        "must hold one layer, or layer must name it; it holds roads, junctions",
        "has no such layer, only roads, junctions",
    ]


@pytest.mark.parametrize(
    ("name", "content", "what"),
    [
        ("x.gpkg", b"", "cannot be read as a table"),
        ("x.gpkg", b"\0" * 5000, "cannot be read as a table"),
        ("x.geojson", b'{"type": "FeatureCollection", "features": [', "cannot be read"),
        ("x.geojson", b"[" * 100_000, "cannot be read"),
        ("x.shp", b"\0\0\x27\x0a", "cannot be read"),
        ("x.parquet", b"PAR1", "is not a Parquet table"),
        ("x.csv", b"a,b\n1,2\n", "convert it to GeoPackage"),
        ("x.gpkg", None, "there is no such file"),
    ],
)
def test_files_that_hold_no_lines_say_why(
    tmp_path: Path, name: str, content: bytes | None, what: str
) -> None:
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=what) as raised:
        read_mapped_network(path, MAPPING)
    assert raised.value.faults[0].source == str(path)


def test_a_parquet_file_without_geometry_or_a_folder(tmp_path: Path) -> None:
    path = tmp_path / "plain.parquet"
    links().drop(columns="geometry").to_parquet(path)
    with pytest.raises(InputError, match="is no GeoParquet file"):
        read_mapped_network(path, MAPPING)
    with pytest.raises(InputError, match="is a folder"):
        read_mapped_network(tmp_path, MAPPING)


def test_faults_name_the_feature_and_the_file(tmp_path: Path) -> None:
    path = write(links().assign(vmax=["x", "30", None], key=[1, 1, 2]), tmp_path / "l.geojson")
    with pytest.raises(InputError) as raised:
        read_mapped_network(path, ColumnMapping(MAPPING.links))
    assert [str(fault).removeprefix(str(path)) for fault in raised.value.faults] == [
        ", column key of feature 2: stands on an earlier row too (found '1')",
        ", column vmax of feature 1: must be a finite number above 0, or empty (found 'x')",
        ", column vmax of feature 3: needs a value, or the mapping of free_speed a missing",
    ]


def test_measured_streets_as_a_table_of_lines(shared: Path, tmp_path: Path) -> None:
    folder = shared / "data" / "tntp" / "Anaheim"
    mapping = ColumnMapping(
        {
            "from_node_id": "init_node",
            "to_node_id": "term_node",
            "length": Source("length", unit="ft"),
            "free_speed": Source("speed", unit="ft/min"),
            "lanes": 1,
            "capacity": Source("capacity", unit="veh/h"),
        },
        nodes={"node_id": "id"},
    )
    lines, points = (folder / f"anaheim{part}.geojson" for part in ("", "_nodes"))
    network = read_mapped_network(lines, mapping, nodes_file=points)
    check_network(network)
    assert (len(network.nodes), len(network.links)) == (416, 914)
    first = network.links.iloc[0]
    assert (first["from_node_id"], first["to_node_id"]) == ("1", "117")
    assert first["length"] == pytest.approx(1609.344)
    assert first["free_speed"] == pytest.approx(4842 * 0.3048 / 60)
    assert first["capacity"] == 2.5
    write_gmns_network(network, tmp_path)
    assert_same_network(read_gmns_network(tmp_path), network)
    wrong = ColumnMapping(
        dict(mapping.links) | {"length": Source("length", unit="m")}, nodes=mapping.nodes
    )
    with pytest.raises(InputError, match="the unit is rather ft"):
        read_mapped_network(lines, wrong, nodes_file=points)


def test_streets_both_ways_come_back_through_gmns(tmp_path: Path) -> None:
    way = Direction("way", forward=("F",), backward=("T",), both=("B",))
    mapping = ColumnMapping({**MAPPING.links}, direction=way, keep=("way",))
    network = network_from_tables(links().assign(way=["B", "F", "T"]), mapping)
    assert network.links["link_id"].tolist() == ["1", "1-reverse", "2", "3"]
    write_gmns_network(network, tmp_path)
    assert_same_network(read_gmns_network(tmp_path), network)
    assert np.isfinite(network.links["length"]).all()
