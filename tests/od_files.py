"""OD tables and networks of a few rows for the tests of demand."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import geopandas as gpd
import pandas as pd
from shapely.geometry import Point
from small_networks import Row, network

from uxsim_geo.demand.od_table import OdTable, ordered
from uxsim_geo.errors import InputError
from uxsim_geo.network.network import Network

#: columns of a demand
Demanded = tuple[str, str, float]


def od(*rows: tuple[object, ...], columns: str = "origin destination vehicles") -> OdTable:
    """A table of those rows; further columns as named."""
    table = pd.DataFrame(list(rows), columns=columns.split())
    table = table.astype({"origin": "str", "destination": "str", "vehicles": "float64"})
    table.index = pd.RangeIndex(1, len(table) + 1, name="row")
    return OdTable(ordered(table))


def hour(*rows: Demanded) -> OdTable:
    """Rows of origin, destination, vehicles, all in the first hour."""
    timed = ((a, b, 0.0, 3600.0, v) for a, b, v in rows)
    return od(*timed, columns="origin destination start_s end_s vehicles")


def values(table: pd.DataFrame, *columns: str) -> list[list[object]]:
    """The rows of some columns (all, if none is named)."""
    return [list(row) for row in table[list(columns or table.columns)].itertuples(index=False)]


def write(folder: Path, name: str, text: str) -> Path:
    """Write a text as it stands."""
    path = folder / name
    path.write_bytes(text.encode())
    return path


def mapped(
    links: list[Row], places: Mapping[str, tuple[float, float]], crs: str | None = "EPSG:25832"
) -> Network:
    """A network with nodes at places given in the units of ``crs``."""
    plain = network(links)
    points = [Point(places[node]) for node in plain.nodes["node_id"]]
    return Network(gpd.GeoDataFrame(plain.nodes, geometry=points, crs=crs), plain.links)


def told(error: InputError) -> list[tuple[int | None, object, object]]:
    """Line, column and value of every fault."""
    return [(fault.line, fault.column, fault.value) for fault in error.faults]
