"""GMNS folders of a few rows, and the comparison of networks to the bit."""

from __future__ import annotations

import math
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import shapely
from pandas.testing import assert_frame_equal

from uxsim_geo.errors import Fault, InputError
from uxsim_geo.network.gmns import read_gmns_network
from uxsim_geo.network.gmns_options import GmnsOptions
from uxsim_geo.network.network import Network

NODES = ["node_id,x_coord,y_coord", "1,0,0", "2,1000,0", "3,1000,500"]

#: lengths in m agree with the geometry in this plane system
LINKS = [
    "link_id,from_node_id,to_node_id,directed,length,free_speed,lanes,capacity",
    "a,1,2,1,1000,36,2,1800",
    "b,2,3,1,500,36,1,1800",
    "c,3,1,1,1120,72,1,",
]

METRIC = GmnsOptions(length_unit="m", speed_unit="km/h", crs="EPSG:32632")

#: 9° east, on the central meridian of that system
EAST, NORTH = 500_000.0, 5_300_000.0


def placed(nodes: list[str]) -> list[str]:
    """Move nodes of the plane into the area of the system, where its scale is that of the earth."""
    moved = nodes[:1]
    for row in nodes[1:]:
        node_id, x, y, *rest = row.split(",")
        moved.append(",".join([node_id, str(float(x) + EAST), str(float(y) + NORTH), *rest]))
    return moved


def folder_of(folder: Path, **tables: list[str] | bytes) -> Path:
    """Write tables by name, as lines or as bytes; node and link are there if not told otherwise."""
    for name, content in ({"node": placed(NODES), "link": LINKS} | tables).items():
        data = content if isinstance(content, bytes) else "\n".join([*content, ""]).encode()
        (folder / f"{name}.csv").write_bytes(data)
    return folder


def read(folder: Path, options: GmnsOptions = METRIC, **tables: list[str] | bytes) -> Network:
    return read_gmns_network(folder_of(folder, **tables), options)


def faults_of(
    folder: Path, options: GmnsOptions = METRIC, **tables: list[str] | bytes
) -> list[Fault]:
    try:
        read(folder, options, **tables)
    except InputError as error:
        return error.faults
    raise AssertionError("the folder was read")


def told(faults: list[Fault]) -> set[tuple[str, int | None, str | int | None, object]]:
    """File, line, column and value of each fault."""
    return {(Path(one.source).stem, one.line, one.column, one.value) for one in faults}


def assert_same_network(first: Network, second: Network) -> None:
    """Nodes, links and movements are the same tables, to the bit."""
    for name in ("nodes", "links", "movements"):
        assert_same_table(getattr(first, name), getattr(second, name))


def assert_same_table(first: pd.DataFrame, second: pd.DataFrame) -> None:
    assert type(first) is type(second)
    assert list(first.columns) == list(second.columns)
    if "geometry" in first:
        assert first.crs == second.crs
        shapes = [np.asarray(table.geometry) for table in (first, second)]
        assert shapely.equals_identical(*shapes).all()
        first, second = (pd.DataFrame(table.drop(columns="geometry")) for table in (first, second))
    assert_frame_equal(first, second, check_exact=True)


def crossing() -> Network:
    """Four arms, each two ways, at node m; the link from a to b is ab."""
    places = {"m": (0, 0), "n": (0, 100), "e": (100, 0), "s": (0, -100), "w": (-100, 0)}
    ends = [(arm, "m") for arm in "nesw"] + [("m", arm) for arm in "nesw"]
    nodes = pd.DataFrame({"node_id": list(places)}).astype("str")
    links = pd.DataFrame(
        {
            "link_id": [a + b for a, b in ends],
            "from_node_id": [a for a, _ in ends],
            "to_node_id": [b for _, b in ends],
            "length": 100.0,
            "lanes": 1,
            "free_speed": 10.0,
            "jam_density": 0.2,
            "capacity": math.nan,
            "merge_priority": 1.0,
        }
    )
    lines = [shapely.linestrings([places[a], places[b]]) for a, b in ends]
    return Network(
        gpd.GeoDataFrame(nodes, geometry=shapely.points(list(places.values()))),
        gpd.GeoDataFrame(links, geometry=lines),
    )
