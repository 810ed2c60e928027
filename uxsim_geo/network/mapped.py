"""Any table of lines, with a mapping of its columns, to a network."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.errors import Faults
from uxsim_geo.network.both_ways import with_both_directions
from uxsim_geo.network.mapped_geometry import (
    add_loop_faults,
    onto_nodes,
    turned,
    with_lengths,
)
from uxsim_geo.network.mapped_links import links_of_rows
from uxsim_geo.network.mapped_nodes import (
    ends_of,
    nearest_nodes,
    nodes_by_id,
    nodes_of_table,
    nodes_where_lines_meet,
)
from uxsim_geo.network.mapped_options import ColumnMapping, source_of
from uxsim_geo.network.mapped_values import Rows, add_column_faults, ids
from uxsim_geo.network.measure import (
    Floats,
    add_degree_faults,
    crs_doubt,
    line_lengths,
    parse_crs,
)
from uxsim_geo.network.network import LINK_COLUMNS, NODE_COLUMNS, Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.rows import whole_where_possible
from uxsim_geo.network.vector_files import read_vector_file
from uxsim_geo.network.wkt import Lines, joined_lines

if TYPE_CHECKING:
    import geopandas
    from pyproj import CRS

Ints = npt.NDArray[np.int64]


def read_mapped_network(
    links_file: Path,
    mapping: ColumnMapping,
    *,
    nodes_file: Path | None = None,
    links_layer: str | None = None,
    nodes_layer: str | None = None,
) -> Network:
    """Read a network from a file of lines, and of points for the nodes if there is one.

    GeoPackage, GeoJSON, Shapefile, FlatGeobuf, GeoParquet; a layer is
    named where a file has several. Raises :class:`uxsim_geo.errors.InputError` with all that is
    wrong, by the number of the feature, counted from 1.
    """
    link_faults, node_faults = Faults(str(links_file)), Faults(str(nodes_file or ""))
    links = read_vector_file(links_file, links_layer, link_faults)
    nodes = None
    if nodes_file is not None:
        nodes = read_vector_file(nodes_file, nodes_layer, node_faults)
    _raise_together(link_faults, node_faults)
    assert links is not None, "a file that cannot be read is a fault"
    rows = None if nodes is None else Rows(nodes, node_faults)
    return _network(Rows(links, link_faults), rows, mapping)


def network_from_tables(
    links: geopandas.GeoDataFrame,
    mapping: ColumnMapping,
    nodes: geopandas.GeoDataFrame | None = None,
) -> Network:
    """Make a network of a table of lines, and of one of points for the nodes if there is one.

    Raises :class:`uxsim_geo.errors.InputError` with all that is wrong, by the number of the row,
    counted from 1.
    """
    rows = None if nodes is None else Rows(nodes.reset_index(drop=True), Faults("nodes"))
    return _network(Rows(links.reset_index(drop=True), Faults("links")), rows, mapping)


def _raise_together(*parts: Faults) -> None:
    together = Faults()
    for own in parts:
        together.extend(own)
    together.raise_if_any()


def _network(links: Rows, nodes: Rows | None, mapping: ColumnMapping) -> Network:
    notes = Notes()
    node_faults = Faults() if nodes is None else nodes.faults
    _add_table_faults(links, nodes, mapping)
    _raise_together(links.faults, node_faults)
    crs = _crs(links, mapping)
    lines = _lines(links)
    table = links_of_rows(links, mapping, notes)
    points = None if nodes is None else nodes_of_table(_in_system(nodes, crs, notes), mapping)
    if (mapping.crs or "").strip().lower() == "none" and "length" not in mapping.links:
        links.faults.add("lengths must be mapped where the reference system is none")
    _raise_together(links.faults, node_faults)
    ends = ends_of(lines)
    add_degree_faults(ends.reshape(-1, 2), crs, links.faults)
    links.faults.raise_if_any()
    found, at = _nodes(links, points, mapping, (ends, crs), notes)
    add_loop_faults(links, table["link_id"], mapping, (at, line_lengths(lines, crs)), notes)
    links.faults.raise_if_any()
    if points is None and "from_node_id" not in mapping.links:
        lines = onto_nodes(lines, found, at)
    table = table.assign(geometry=lines)
    for column, side in (("from_node_id", 0), ("to_node_id", 1)):
        table[column] = found["node_id"].to_numpy()[at[:, side]]
    table = with_lengths(links, table, mapping, crs, notes)
    ready = with_both_directions(turned(table), table["link_id"].tolist(), links.faults)
    links.faults.raise_if_any()
    return _tables(ready, found, crs, notes)


def _add_table_faults(links: Rows, nodes: Rows | None, mapping: ColumnMapping) -> None:
    """What makes the tables useless as a whole."""
    sources = {name: source_of(written) for name, written in mapping.links.items()}
    add_column_faults(links, mapping, sources)
    for rows in (links, nodes):
        if rows is not None and not _has_geometry(rows.table):
            rows.faults.add("has no geometry")
    if not len(links):
        links.faults.add("there is no row")
    if nodes is not None:
        own = {name: source_of(written) for name, written in mapping.nodes.items()}
        if "node_id" not in own:
            nodes.faults.add("the mapping of nodes must name the column of node_id")
        add_column_faults(nodes, mapping, own)
        if not len(nodes):
            nodes.faults.add("there is no row")
    elif mapping.nodes:
        links.faults.add("the mapping has nodes, but there is no table of points")


def _has_geometry(table: pd.DataFrame) -> bool:
    import geopandas

    return isinstance(table, geopandas.GeoDataFrame) and table.active_geometry_name is not None


def _crs(links: Rows, mapping: ColumnMapping) -> CRS | None:
    own = getattr(links.table, "crs", None)
    stated = None if mapping.crs is None else parse_crs(mapping.crs, links.faults)
    if own is None and mapping.crs is None:
        what = "does not say its reference system: state crs, as EPSG:4326, or none"
        links.faults.add(what)
    elif own is not None and mapping.crs is not None and stated != own:
        what = f"says that its reference system is {own.to_string()}: leave crs out"
        links.faults.add(what, column="crs", value=mapping.crs)
    return own if own is not None else stated


def _in_system(nodes: Rows, crs: CRS | None, notes: Notes) -> Rows:
    """The points in the system of the lines."""
    import geopandas

    table = geopandas.GeoDataFrame(nodes.table)
    own = table.crs
    if own is None or own == crs:
        return nodes
    if crs is None:
        nodes.faults.add("has a reference system and the lines have none", value=own.to_string())
        return nodes
    notes.add("reprojected", f"nodes from {own.to_string()} to {crs.to_string()}", element="node")
    return Rows(table.to_crs(crs), nodes.faults)


def _lines(links: Rows) -> Lines:
    """One line a row; a fault where there is none."""
    import shapely

    shapes = np.asarray(links.table.geometry, dtype=object)
    lines, wrong = joined_lines(shapes)
    for row in np.flatnonzero(shapely.is_missing(shapes)).tolist():
        links.add("needs a line", row, "geometry")
    for row, what in sorted(wrong.items()):
        links.add(what, row, "geometry", shapes[row].geom_type)
    return lines


def _nodes(
    links: Rows,
    points: pd.DataFrame | None,
    mapping: ColumnMapping,
    place: tuple[Floats, CRS | None],
    notes: Notes,
) -> tuple[pd.DataFrame, Ints]:
    """The nodes, and the rows of those at the two ends of each line."""
    ends, crs = place
    sources = [mapping.source(name) for name in ("from_node_id", "to_node_id")]
    doubt = crs_doubt(ends.reshape(-1, 2), crs)
    if doubt:
        notes.add("doubtful CRS", doubt, severity="warning")
    if sources[0] is None or sources[1] is None:
        if points is None:
            return nodes_where_lines_meet(ends, mapping.tolerance, crs, notes)
        return points, nearest_nodes(links, points, ends, mapping.tolerance, crs)
    named = [ids(links, source, "node") for source in sources if source is not None]
    columns = [str(source.column) for source in sources if source is not None]
    if points is None:
        return nodes_by_id(named, ends, mapping, crs, notes)
    index = pd.Index(points["node_id"])
    at = np.column_stack([index.get_indexer(pd.Index(one)) for one in named])
    for row, side in zip(*np.nonzero(at < 0), strict=True):
        text = named[side][row]
        if text:
            links.add("there is no such node", int(row), columns[side], text)
    return points, at.astype(np.int64)


def _tables(links: pd.DataFrame, nodes: pd.DataFrame, crs: CRS | None, notes: Notes) -> Network:
    import geopandas
    import shapely

    second = links["link_id"].ne(links["row_id"])
    for name in [name for name in links if str(name).endswith("_backward")]:
        own = str(name).removesuffix("_backward")
        links[own] = links[own].where(~second, links[name])
    points = nodes.assign(geometry=shapely.points(nodes[["x", "y"]].to_numpy(dtype=np.float64)))
    for name, default in (("zone_id", None), ("control", False), ("through_traffic", True)):
        if name not in points:
            points[name] = pd.Series([default] * len(points), dtype=object)
    control = np.where(points["control"].astype(bool), "signal", "none")
    points["control"] = pd.Series(control, dtype="str")
    points = points.astype({"zone_id": "str", "through_traffic": "bool"})
    links["lanes"] = whole_where_possible(links["lanes"].to_numpy(dtype=np.float64))
    kept = [str(name) for name in links if str(name).startswith("file_")]
    return Network(
        geopandas.GeoDataFrame(points[[*NODE_COLUMNS, "geometry"]], geometry="geometry", crs=crs),
        geopandas.GeoDataFrame(
            links[[*LINK_COLUMNS, "geometry", *kept]], geometry="geometry", crs=crs
        ),
        notes=notes.table(),
    )
