"""The nodes of a table of lines: from a table of points, from ids, or from where lines meet."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.network.mapped_options import ColumnMapping, source_of
from uxsim_geo.network.mapped_values import Rows, ids, texts
from uxsim_geo.network.measure import Floats, distances, metric_places
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.wkt import Lines

if TYPE_CHECKING:
    from pyproj import CRS

Ints = npt.NDArray[np.int64]

#: cells that mean yes and no, in small letters
YES, NO = ("true", "1", "yes", "signal"), ("false", "0", "no", "none", "")


def ends_of(lines: Lines) -> Floats:
    """First and last point of each line; shape (lines, 2, 2)."""
    import shapely

    points = [shapely.get_coordinates(shapely.get_point(lines, end)) for end in (0, -1)]
    return np.stack(points, axis=1)


def nodes_where_lines_meet(
    ends: Floats, tolerance: float, crs: CRS | None, notes: Notes
) -> tuple[pd.DataFrame, Ints]:
    """Nodes numbered from 1 in the order of the rows, and those at the ends; (lines, 2).

    Ends within the tolerance (m) of one another are at one node, which lies at the first of them;
    so are those that a chain of such ends connects.
    """
    points = ends.reshape(-1, 2)
    place = _clusters(points, tolerance, crs)
    _, first, node = np.unique(place, return_index=True, return_inverse=True)
    order = np.argsort(np.argsort(first, kind="stable"), kind="stable")
    first = np.sort(first)
    node = order[node]
    nodes = pd.DataFrame({"node_id": [str(number) for number in range(1, len(first) + 1)]})
    nodes = nodes.astype("str").assign(x=points[first, 0], y=points[first, 1])
    notes.add("nodes from ends", "the ends of the lines make the nodes", element="node")
    moved = distances(points, points[first][node], crs)
    if (moved > 0).any():
        note = (
            f"moved onto the node within {tolerance:g} m, at most {moved.max():.3g} m; value: ends"
        )
        notes.add("snapped", note, element="node", value=int((moved > 0).sum()))
    if moved.max(initial=0.0) > tolerance:
        note = "a chain of near ends makes one node, wider than the tolerance (value, m): lower it"
        notes.add("snapped", note, severity="warning", element="node", value=float(moved.max()))
    return nodes, node.reshape(-1, 2)


def _clusters(points: Floats, tolerance: float, crs: CRS | None) -> Ints:
    """The number of the group of near points to which each belongs."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    single, place = np.unique(points, axis=0, return_inverse=True)
    if tolerance == 0:
        return np.asarray(place, dtype=np.int64).ravel()
    tree = cKDTree(metric_places(single, crs))
    pairs = tree.query_pairs(tolerance, output_type="ndarray")
    size = (len(single), len(single))
    near = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=size)
    group = connected_components(near, directed=False)[1]
    return np.asarray(group[place.ravel()], dtype=np.int64)


def nodes_by_id(
    link_ends: list[list[str]], ends: Floats, mapping: ColumnMapping, crs: CRS | None, notes: Notes
) -> tuple[pd.DataFrame, Ints]:
    """Nodes that the links name, each where it is met first; those met elsewhere too are noted."""
    named = pd.Series([one for pair in zip(*link_ends, strict=True) for one in pair], dtype="str")
    number, unique = pd.factorize(named)
    points = ends.reshape(-1, 2)
    first = np.unique(number, return_index=True)[1]
    nodes = pd.DataFrame({"node_id": pd.Series(unique, dtype="str")})
    nodes = nodes.assign(x=points[first, 0], y=points[first, 1])
    apart = distances(points, points[first][number], crs)
    widest = pd.Series(apart).groupby(number).max().to_numpy()
    far = np.flatnonzero(widest > mapping.tolerance).tolist()
    for node in far:
        note = f"lines end up to {widest[node]:.4g} m from where the node is met first"
        notes.rows.append(
            ("node", str(unique[node]), "node at several places", "warning", note, None)
        )
    return nodes, np.asarray(number, dtype=np.int64).reshape(-1, 2)


def nodes_of_table(rows: Rows, mapping: ColumnMapping) -> pd.DataFrame:
    """node_id, x, y, and zone_id, control and through_traffic where they are mapped."""
    import shapely

    sources = {name: source_of(written) for name, written in mapping.nodes.items()}
    nodes = pd.DataFrame({"node_id": ids(rows, sources["node_id"], "node_id")}).astype("str")
    for row in np.flatnonzero(nodes["node_id"].duplicated()).tolist():
        text = nodes["node_id"].iloc[row]
        rows.add("stands on an earlier row too", row, str(sources["node_id"].column), text)
    points = np.asarray(rows.table.geometry, dtype=object)
    wrong = (shapely.get_type_id(points) != 0) | shapely.is_empty(points)
    for row in np.flatnonzero(wrong).tolist():
        rows.add("must be a point", row, "geometry", getattr(points[row], "geom_type", None))
    place = np.column_stack([shapely.get_x(points), shapely.get_y(points)])
    for row in np.flatnonzero(~wrong & ~np.isfinite(place).all(axis=1)).tolist():
        rows.add("must have finite coordinates", row, "geometry")
    nodes = nodes.assign(x=place[:, 0], y=place[:, 1])
    if "zone_id" in sources:
        nodes["zone_id"] = pd.Series(texts(rows, sources["zone_id"]), dtype="str")
    for name in ("control", "through_traffic"):
        if name in sources:
            cells = [(text or "").lower() for text in texts(rows, sources[name])]
            for row in [row for row, text in enumerate(cells) if text not in (*YES, *NO)]:
                what = f"must be one of {', '.join(filter(None, (*YES, *NO)))}, or empty"
                rows.add(what, row, sources[name].column or name, cells[row])
            default = name == "through_traffic"
            nodes[name] = [text in YES or (default and not text) for text in cells]
    return nodes


def nearest_nodes(
    rows: Rows, nodes: pd.DataFrame, ends: Floats, tolerance: float, crs: CRS | None
) -> Ints:
    """The rows of the nodes at the ends of each line, (lines, 2); none within reach is a fault."""
    from scipy.spatial import cKDTree

    tree = cKDTree(metric_places(nodes[["x", "y"]].to_numpy(dtype=np.float64), crs))
    apart, node = tree.query(metric_places(ends.reshape(-1, 2), crs))
    for end in np.flatnonzero(apart > tolerance).tolist():
        which = ("first", "last")[end % 2]
        what = f"no node is within {tolerance:g} m of the {which} point of the line"
        rows.add(f"{what}: the nearest is {apart[end]:.4g} m away", end // 2, "geometry")
    return np.asarray(node, dtype=np.int64).reshape(-1, 2)
