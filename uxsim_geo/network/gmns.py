"""GMNS folders to network tables: the entry point, and what ties nodes and links together.

Specification: General Modeling Network Specification 0.97, github.com/zephyr-data-specs/GMNS.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from uxsim_geo.network.both_ways import with_both_directions
from uxsim_geo.network.csv_table import id_cells, text_column
from uxsim_geo.network.gmns_columns import (
    USED,
    Described,
    extra_columns,
    in_order,
    read_described,
)
from uxsim_geo.network.gmns_geometry import lines_along, read_lines_of_links
from uxsim_geo.network.gmns_links import add_link_id_faults, read_links
from uxsim_geo.network.gmns_movements import add_movement_faults, read_movements
from uxsim_geo.network.gmns_nodes import read_nodes
from uxsim_geo.network.gmns_options import GmnsOptions
from uxsim_geo.network.gmns_reading import Reading, open_folder
from uxsim_geo.network.gmns_units import check_lengths
from uxsim_geo.network.gmns_uses import are_for_motor_vehicles, road_class_column
from uxsim_geo.network.measure import line_lengths
from uxsim_geo.network.network import LINK_COLUMNS, NODE_COLUMNS, NOTE_COLUMNS, Network
from uxsim_geo.network.rows import is_among


def read_gmns_network(folder: Path, options: GmnsOptions | None = None) -> Network:
    """Read the nodes, links, geometries, lanes and movements of a GMNS folder, as GeoDataFrames.

    Links that are not for motor vehicles are left out, and nodes at which no others are; of an
    undirected link ``ID`` there is also ``ID-reverse``. Columns that mean nothing here are kept
    after the shared ones as ``gmns_`` and their name.

    Raises :class:`uxsim_geo.errors.InputError` with all that is wrong with the folder: what cannot
    be read first, then every cell and reference, then lengths whose unit is evidently another.
    """
    reading = open_folder(folder, options or GmnsOptions())
    nodes = read_nodes(reading)
    add_link_id_faults(reading, nodes["node_id"])
    add_movement_faults(reading)
    kept = are_for_motor_vehicles(reading)
    table = reading.links.rows(kept)
    links = read_links(reading, table)
    drawn = read_lines_of_links(reading, table)
    described = read_described(
        reading.tables.get("uxsim_columns"), reading.faults.get("uxsim_columns")
    )
    used = {*USED["link"], road_class_column(table)}
    more = extra_columns(table, used, _of(described, "link"), reading.faults["link"])
    more_of_nodes = extra_columns(
        reading.nodes, USED["node"], _of(described, "node"), reading.faults["node"]
    )
    reading.raise_if_any()
    links["geometry"] = lines_along(reading, links, drawn, nodes)
    links = _with_lengths(reading, links, nodes).join(_within(more, "gmns_parent_link_id", links))
    links = with_both_directions(
        links, list(map(str, id_cells(reading.links, "link_id"))), reading.faults["link"]
    )
    reading.raise_if_any()
    _note_loops(reading, links)
    movements = read_movements(reading, links)
    nodes = _nodes_that_stay(reading, nodes.join(more_of_nodes), kept)
    return _network(reading, described, nodes, links, movements)


def _of(described: dict[str, list[Described]], table: str) -> list[Described]:
    """Of a table, the columns that stand in the file under a name of their own."""
    return [one for one in described.get(table, []) if one.type != "geometry"]


def _within(more: pd.DataFrame, column: str, kept: pd.DataFrame) -> pd.DataFrame:
    """Without parents that are not there any more."""
    if column not in more:
        return more
    known = kept[column.removeprefix("gmns_parent_")]
    there = is_among(more[column], known)
    more = more.assign(**{column: more[column].where(there)})
    return more if there.any() else more.drop(columns=column)


def _with_lengths(reading: Reading, links: pd.DataFrame, nodes: pd.DataFrame) -> pd.DataFrame:
    """Lengths from the geometry where the file has none; those it has are held against it."""
    lengths = links["length"].to_numpy(dtype=np.float64)
    drawn = line_lengths(links["geometry"].to_numpy(), reading.crs)
    unit = reading.options.length_unit or reading.config.length_unit
    if unit is not None:
        places = nodes[["x", "y"]].to_numpy(dtype=np.float64)
        check_lengths(reading, unit, places, (lengths, drawn))
    missing = np.isnan(lengths)
    if not missing.any():
        return links
    note = "the length (value, m) is that of the geometry"
    ids, values = list(links["link_id"][missing]), drawn[missing].tolist()
    if reading.options.length_from == "geometry":
        reading.notes.add("length of geometry", "lengths are those of the geometry")
    else:
        reading.notes.warn_each("length assumed", note, ids, values)
    known = reading.crs is not None
    why = "has none either" if known else "is in no known reference system"
    for link_id in links["link_id"][missing & ~(drawn > 0) if known else missing]:
        what = f"link {link_id} needs a value: its geometry {why}"
        reading.faults["link"].add(what, column="length")
    return links.assign(length=np.where(missing, drawn, lengths))


def _note_loops(reading: Reading, links: pd.DataFrame) -> None:
    loops = list(links["link_id"][links["from_node_id"] == links["to_node_id"]])
    note = "the link leads back to its own node"
    reading.notes.warn_each("self-loop", note, loops, [None] * len(loops))


def _nodes_that_stay(reading: Reading, nodes: pd.DataFrame, kept: np.ndarray) -> pd.DataFrame:
    """Without the nodes at which every link was left out."""
    ends = pd.concat(
        [pd.Series(id_cells(reading.links, f"{end}_node_id")) for end in ("from", "to")]
    )
    here = np.concatenate([kept, kept])
    gone = is_among(nodes["node_id"], ends[~here]) & ~is_among(nodes["node_id"], ends[here])
    if gone.any():
        note = "no link for motor vehicles starts or ends here: left out"
        ids = list(nodes["node_id"][gone])
        reading.notes.add_each("unused node", note, ids, element="node")
    staying = nodes[~gone].reset_index(drop=True)
    return _within(staying, "gmns_parent_node_id", staying)


def _network(
    reading: Reading,
    described: dict[str, list[Described]],
    nodes: pd.DataFrame,
    links: pd.DataFrame,
    movements: pd.DataFrame,
) -> Network:
    import geopandas
    import shapely

    places = nodes[["x", "y"]].to_numpy(dtype=np.float64)
    points = nodes.drop(columns=["x", "y", "line"]).assign(geometry=shapely.points(places))
    lines = links.drop(columns=["direction", "both_ways"])
    points = points[_ordered(points, (*NODE_COLUMNS, "geometry"))]
    lines = lines[_ordered(lines, (*LINK_COLUMNS, "geometry"))]
    points = in_order(points, NODE_COLUMNS, described.get("node", []))
    lines = in_order(lines, LINK_COLUMNS, described.get("link", []))
    notes = pd.concat([_earlier_notes(reading), reading.notes.table()], ignore_index=True)
    return Network(
        geopandas.GeoDataFrame(points, geometry="geometry", crs=reading.crs),
        geopandas.GeoDataFrame(lines, geometry="geometry", crs=reading.crs),
        movements,
        notes.drop_duplicates(ignore_index=True),
    )


def _ordered(table: pd.DataFrame, first: tuple[str, ...]) -> list[str]:
    return [*first, *(str(name) for name in table if name not in first)]


def _earlier_notes(reading: Reading) -> pd.DataFrame:
    """The notes that write_gmns put beside the tables, of the reading before."""
    table = reading.tables.get("import_notes")
    if table is None:
        return pd.DataFrame({name: pd.Series(dtype="str") for name in NOTE_COLUMNS})
    return pd.DataFrame({name: text_column(table.cells(name)) for name in NOTE_COLUMNS})
