"""Zones where nobody has drawn any: square cells over a network, with the roads in them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.demand.points import metric_crs, node_metres
from uxsim_geo.errors import Faults
from uxsim_geo.network.network import Network
from uxsim_geo.network.units import LENGTHS

#: cells of a network; more would make too many pairs
MOST_CELLS = 5_000


def cell_zones(network: Network, cell_m: float) -> Any:
    """Square zones of ``cell_m`` metres over a network: those that hold the start of a link.

    A GeoDataFrame in a metric system: zone (text, row and column of the cell, as ``3-12``, from
    the south-west on), road_km (length of the links that start inside, km: a measure of what is
    there where nothing else is known), geometry. Ordered by row and column.

    Raises :class:`uxsim_geo.errors.InputError` for a network without coordinates, for a size that
    is none, or one that makes more than 5,000 cells.
    """
    import geopandas as gpd
    import shapely

    faults = Faults("cells")
    if "geometry" not in network.nodes.columns:
        faults.add("the network has no coordinates: there is nothing to lay cells on")
    if not 0 < cell_m < math.inf:
        faults.add("must be a finite number of metres above 0", column="cell_m", value=cell_m)
    faults.raise_if_any()
    places = node_metres(network)
    corner = np.floor(places.min(axis=0) / cell_m) * cell_m
    ids = pd.Index(network.nodes["node_id"].astype("str"))
    start = ids.get_indexer(pd.Index(network.links["from_node_id"].astype("str")))
    column, row = np.floor((places[start] - corner) / cell_m).astype(np.int64).T
    length = network.links["length"].to_numpy(float) / LENGTHS["km"]
    table = pd.DataFrame({"row": row, "column": column, "road_km": length})
    cells = table.groupby(["row", "column"], as_index=False)["road_km"].sum()
    if len(cells) > MOST_CELLS:
        what = f"makes {len(cells):,} cells; take larger ones, of which there are {MOST_CELLS:,}"
        faults.add(f"{what} at most", column="cell_m", value=cell_m)
    faults.raise_if_any()
    west, south = corner[0] + cells["column"] * cell_m, corner[1] + cells["row"] * cell_m
    names = cells["row"].astype("str") + "-" + cells["column"].astype("str")
    return gpd.GeoDataFrame(
        {"zone": names.astype("str"), "road_km": cells["road_km"]},
        geometry=shapely.box(west, south, west + cell_m, south + cell_m),
        crs=metric_crs(network),
    )
