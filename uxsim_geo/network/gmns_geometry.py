"""The lines of GMNS links, each from its from-node to its to-node."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.errors import Faults
from uxsim_geo.network.csv_table import CsvTable, id_cells
from uxsim_geo.network.gmns_reading import Reading
from uxsim_geo.network.measure import distances, line_lengths
from uxsim_geo.network.wkt import Lines, parse_lines

#: m, and part of a link's length: a line may begin so far from its node, which is a junction's size
NEAR, NEAR_PART = 15.0, 0.1


def read_lines_of_links(reading: Reading, table: CsvTable) -> Lines:
    """Lines as they are drawn, one a row; None where the row has none. Faults where it is wrong."""
    faults = reading.faults["link"]
    texts = table.cells("geometry")
    lines, wrong = parse_lines(texts)
    for place, what in sorted(wrong.items()):
        faults.add(what, line=table.lines[place], column="geometry", value=texts[place])
    shapes = reading.tables.get("geometry")
    wanted = id_cells(table, "geometry_id")
    if shapes is None:
        if any(one is not None for one in wanted) and not any(map(str.strip, texts)):
            faults.add("names geometries, but there is no geometry.csv", column="geometry_id")
        return lines
    by_id = _shapes(shapes, reading.faults["geometry"])
    for place, geometry_id in enumerate(wanted):
        if geometry_id is None or lines[place] is not None or place in wrong:
            continue
        if geometry_id in by_id:
            lines[place] = by_id[geometry_id]
        else:
            what = "refers to a geometry that is not there"
            faults.add(what, line=table.lines[place], column="geometry_id", value=geometry_id)
    return lines


def _shapes(table: CsvTable, faults: Faults) -> dict[str, object]:
    """The lines of geometry.csv by their ids; None where a line is wrong, which is a fault."""
    texts = table.cells("geometry")
    lines, wrong = parse_lines(texts)
    shapes: dict[str, object] = {}
    for place, geometry_id in enumerate(id_cells(table, "geometry_id")):
        line = table.lines[place]
        if place in wrong:
            faults.add(wrong[place], line=line, column="geometry", value=texts[place])
        if geometry_id is None:
            faults.add("needs a value", line=line, column="geometry_id")
        elif geometry_id in shapes:
            what = "stands on an earlier line too"
            faults.add(what, line=line, column="geometry_id", value=geometry_id)
        else:
            shapes[geometry_id] = lines[place]
    return shapes


def directions(reading: Reading, table: CsvTable) -> npt.NDArray[np.int64]:
    """dir_flag: 1 and -1, or 0 where nothing says which way the line is drawn."""
    known = {"": 0, "0": 0, "0.0": 0, "nan": 0, "1": 1, "1.0": 1, "-1": -1, "-1.0": -1}
    cells = [cell.strip().lower() for cell in table.cells("dir_flag")]
    for cell, line in zip(cells, table.lines, strict=True):
        if cell not in known:
            what = "must be 1, -1, 0 or empty"
            reading.faults["link"].add(what, line=line, column="dir_flag", value=cell)
    return np.array([known.get(cell, 0) for cell in cells], dtype=np.int64)


def lines_along(reading: Reading, links: pd.DataFrame, drawn: Lines, nodes: pd.DataFrame) -> Lines:
    """Lines from the from-node to the to-node: turned where needed, straight where there is none.

    ``links``: link_id, from_node_id, to_node_id and direction, one a line of ``drawn``. Lines that
    run against what dir_flag says, or end far from their nodes, are noted.
    """
    import shapely

    row = pd.Index(nodes["node_id"])
    place = nodes[["x", "y"]].to_numpy(dtype=np.float64)
    ends = [place[row.get_indexer(links[end])] for end in ("from_node_id", "to_node_id")]
    lines = drawn.copy()
    missing = shapely.is_missing(lines)
    lines[missing] = shapely.linestrings(np.stack(ends, axis=1)[missing])
    if missing.any():
        note = "no geometry: a straight line between the nodes; value: links"
        reading.notes.add("straight lines", note, element="link", value=int(missing.sum()))
    ahead, turned = _apart(lines, ends, reading), _apart(shapely.reverse(lines), ends, reading)
    near = np.maximum(NEAR, NEAR_PART * line_lengths(lines, reading.crs))
    flag = links["direction"].to_numpy()
    by_flag = np.where(flag == 0, turned < ahead, flag < 0)
    against = (flag != 0) & (np.where(by_flag, turned, ahead) > near)
    against &= np.where(by_flag, ahead, turned) <= near
    against &= not reading.is_own  # a line that was written so is meant so
    lines[by_flag ^ against] = shapely.reverse(lines[by_flag ^ against])
    apart = np.where(by_flag ^ against, turned, ahead)
    _note_ends(reading, links["link_id"], against, np.where(apart > near, apart, np.nan))
    return lines


def _apart(lines: Lines, ends: list[np.ndarray], reading: Reading) -> np.ndarray:
    """How far each line's farther end is from its node, m."""
    import shapely

    points = [shapely.get_coordinates(shapely.get_point(lines, end)) for end in (0, -1)]
    apart = [distances(*pair, reading.crs) for pair in zip(points, ends, strict=True)]
    return np.maximum(*apart)


def _note_ends(reading: Reading, link_id: pd.Series, against: np.ndarray, far: np.ndarray) -> None:
    note = "the geometry runs against dir_flag, from the to-node to the from-node: turned"
    ids = list(link_id[against])
    reading.notes.warn_each("geometry turned", note, ids, [None] * len(ids))
    if reading.crs is None or reading.is_own:
        return
    note = "the geometry ends (value, m) away from the node"
    ids, values = list(link_id[~np.isnan(far)]), far[~np.isnan(far)].tolist()
    reading.notes.warn_each("geometry off its node", note, ids, values)
