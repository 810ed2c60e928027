"""Junctions for the tests of signals: links that arrive at a node from given directions."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import geopandas
import numpy as np
import pandas as pd
import shapely

from uxsim_geo.network.network import Network

#: metres, in the middle of a zone where grid north is north
CENTRE = (500_000.0, 5_500_000.0)
METRIC = "EPSG:25832"

Point = tuple[float, float]


def road(link_id: str, start: str, end: str, **other: Any) -> dict[str, Any]:
    """A link of one lane, 0.8 veh/s, without geometry unless told."""
    row: dict[str, Any] = {
        "link_id": link_id,
        "from_node_id": start,
        "to_node_id": end,
        "length": 200.0,
        "lanes": 1,
        "free_speed": 20.0,
        "jam_density": 0.2,
        "capacity": np.nan,
        "merge_priority": 1.0,
        "road_class": None,
    }
    return row | other


def towards(bearing: float, at: Point = CENTRE, length: float = 200.0) -> shapely.LineString:
    """A straight line that arrives at a point in the direction of a bearing."""
    angle = math.radians(bearing)
    start = (at[0] - length * math.sin(angle), at[1] - length * math.cos(angle))
    return shapely.LineString([start, at])


def table(rows: Sequence[dict[str, Any]], crs: str | None = METRIC) -> pd.DataFrame:
    """Links as a table; with geometry where the first row has some."""
    if "geometry" not in rows[0]:
        return pd.DataFrame(rows)
    return geopandas.GeoDataFrame(rows, geometry="geometry", crs=crs)


def network_of(links: pd.DataFrame, signals: Iterable[str]) -> Network:
    """The network of some links, with signals at some nodes."""
    ids = pd.unique(pd.concat([links["from_node_id"], links["to_node_id"]]))
    marked = set(signals)
    control = ["signal" if node in marked else "none" for node in ids]
    nodes = pd.DataFrame({"node_id": ids, "through_traffic": True, "control": control})
    return Network(nodes, links)


def junction(
    bearings: Sequence[float], *, one_way: bool = False, crs: str | None = METRIC, **columns: Any
) -> Network:
    """Links a, b, c … that arrive at node X at these bearings, from A, B, C …

    Each has a link back unless ``one_way``; then one link leaves to Z. ``columns`` hold one value
    for each that arrives, or one for all.
    """
    rows = []
    for number, bearing in enumerate(bearings):
        name = chr(ord("a") + number)
        values = {
            key: value[number] if isinstance(value, list) else value
            for key, value in columns.items()
        }
        line = towards(bearing)
        rows.append(road(name, name.upper(), "X", geometry=line, **values))
        if not one_way:
            back = shapely.reverse(line)
            rows.append(road(f"{name}-back", "X", name.upper(), geometry=back, **values))
    if one_way:
        rows.append(road("out", "X", "Z", geometry=towards(0.0, (CENTRE[0], CENTRE[1] + 300.0))))
    return network_of(table(rows, crs), ["X"])


def phases_of(plans: pd.DataFrame, node_id: str = "X") -> list[set[str]]:
    """The links of each phase of a node, in their order."""
    own = plans[plans["node_id"] == node_id]
    return [set(links) for _, links in own.groupby("phase")["link_id"]]


def greens_of(plans: pd.DataFrame, node_id: str = "X") -> list[float]:
    """The green of each phase of a node, in their order."""
    own = plans[plans["node_id"] == node_id]
    return own.groupby("phase")["green_s"].first().tolist()
