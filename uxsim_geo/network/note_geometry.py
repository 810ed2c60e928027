"""Where notes are: the point of the node, or the middle of the link, that each is about."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.network.network import NOTE_COLUMNS, Network


def placed(notes: pd.DataFrame, *networks: Network) -> pd.DataFrame:
    """The notes as points in the system of the first network, null where they have no place.

    An element is looked for in the networks in turn: the second may be the one before links were
    joined or dropped. Places that notes have stay. Without geometry in the first, the bare table.
    """
    bare = notes[list(NOTE_COLUMNS)].astype("str").reset_index(drop=True)
    if "geometry" not in networks[0].nodes:
        return bare
    import geopandas

    crs: Any = getattr(networks[0].nodes, "crs", None)
    points = np.full(len(notes), None, dtype=object)
    if "geometry" in notes:
        points[:] = notes["geometry"].to_numpy()
    for network in networks:
        for element in ("node", "link"):
            missing = pd.isna(points) & np.asarray(bare["element"] == element, dtype=bool)
            rows = np.flatnonzero(missing & np.asarray(bare["element_id"].notna(), dtype=bool))
            points[rows] = _points(network, element, bare["element_id"].iloc[rows], crs)
    points[pd.isna(points)] = None
    located: pd.DataFrame = geopandas.GeoDataFrame(bare, geometry=points, crs=crs)
    return located


def _points(network: Network, element: str, ids: pd.Series, crs: Any) -> Any:
    """Points of nodes or links in ``crs``; None where there is no such element, or no geometry."""
    import geopandas
    import shapely

    table = network.nodes if element == "node" else network.links
    found = np.full(len(ids), None, dtype=object)
    if "geometry" not in table:
        return found
    known = pd.Index(table[f"{element}_id"].drop_duplicates())
    first = np.flatnonzero(~table[f"{element}_id"].duplicated())
    place = known.get_indexer(pd.Index(ids))
    there = np.flatnonzero(place >= 0)
    shapes = table["geometry"].to_numpy()[first[place[there]]]
    if element == "link":
        shapes = shapely.line_interpolate_point(shapes, 0.5, normalized=True)
    own: Any = getattr(table, "crs", None)
    if own is not None and crs is not None and own != crs:
        shapes = geopandas.GeoSeries(shapes, crs=own).to_crs(crs).to_numpy()
    found[there] = shapes
    return found
