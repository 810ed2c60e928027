"""TNTP networks to network tables: the entry point, and what ties links and nodes together."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from uxsim_geo.errors import Faults
from uxsim_geo.network.centroids import Loading, load_zones, zones_of
from uxsim_geo.network.coordinates import Coordinates, read_coordinates
from uxsim_geo.network.network import LINK_COLUMNS, NODE_COLUMNS, Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.one_part import is_one_part
from uxsim_geo.network.rows import is_among
from uxsim_geo.network.tntp_flow import add_unknown_link_faults, read_flow, with_flow
from uxsim_geo.network.tntp_links import links_table
from uxsim_geo.network.tntp_net import ENDS, NetFile, read_net
from uxsim_geo.network.tntp_options import TntpOptions


def read_tntp_network(
    net: Path, options: TntpOptions, *, nodes: Path | None = None, flow: Path | None = None
) -> Network:
    """Read a TNTP network into tables in SI units, as GeoDataFrames.

    net
        links (``*_net.tntp``)
    nodes
        coordinates (``*_node.tntp``, or points in GeoJSON); without them a schematic map is
        laid out, without CRS
    flow
        volume and cost of a static assignment, kept as the columns tntp_volume and tntp_cost

    ``link_id`` is ``from-to``; of links with the same ends the first is used, as the format's
    authors say. Beside the shared columns, nodes have origin_of and destination_of (zones whose
    trips may start or end there, with blanks between), links the file's own columns under
    ``tntp_`` and their name. Raises :class:`InputError` with all that is wrong in the files.
    """
    file, coordinates, volumes = _read_files(net, options, nodes, flow)
    notes = Notes()
    file = replace(file, table=_without_duplicates(file.table, notes))
    if volumes is not None:
        file = replace(file, table=with_flow(file.table, volumes, notes))
    _note_counts(file, coordinates, notes)
    loading = load_zones(file, options, notes)
    staying = replace(file, table=file.table[loading.links])
    links = links_table(staying, options, notes, loading.centroids).reset_index(drop=True)
    loops = list(links["link_id"][links["from_node_id"] == links["to_node_id"]])
    notes.warn_each("self-loop", "the link leads back to its own node", loops, [None] * len(loops))
    node_table = _nodes(links, loading, coordinates)
    _note_parts(node_table, links, notes)
    return _with_geometry(node_table, links, coordinates, notes)


def _read_files(
    net: Path, options: TntpOptions, nodes: Path | None, flow: Path | None
) -> tuple[NetFile, Coordinates | None, pd.DataFrame | None]:
    """Read all three, and raise once for all of them."""
    net_faults, node_faults, flow_faults = Faults(str(net)), Faults(str(nodes)), Faults(str(flow))
    file = read_net(net, options, net_faults)
    coordinates = None if nodes is None else read_coordinates(nodes, options, node_faults)
    volumes = None if flow is None else read_flow(flow, flow_faults)
    # what is missing in a file that has faults may only be lost
    if file is not None and coordinates is not None and not node_faults.found:
        _add_unknown_node_faults(file.table, coordinates, net_faults)
    if file is not None and volumes is not None and not net_faults.found:
        add_unknown_link_faults(volumes, file.table, flow_faults)
    faults = Faults()
    for found in (net_faults, node_faults, flow_faults):
        faults.extend(found)
    faults.raise_if_any()
    assert file is not None, "a file that cannot be read is a fault"
    return file, coordinates, volumes


def _add_unknown_node_faults(table: pd.DataFrame, coordinates: Coordinates, faults: Faults) -> None:
    told = [fault.line for fault in faults.found]
    table = table[~table["line"].isin(told)]
    for column in ENDS:
        unknown = table[~is_among(table[column], coordinates.table["node_id"])]
        for node_id, line in zip(unknown[column], unknown["line"], strict=True):
            faults.add("the node file has no such node", line=line, column=column, value=node_id)


def _without_duplicates(table: pd.DataFrame, notes: Notes) -> pd.DataFrame:
    again = table.duplicated(ENDS)
    ids = table["from_node_id"][again] + "-" + table["to_node_id"][again]
    note = "the file has this link again on a later line (value): the first is used"
    notes.add_each("duplicate link", note, list(ids), values=list(table["line"][again]))
    return table[~again]


def _note_counts(file: NetFile, coordinates: Coordinates | None, notes: Notes) -> None:
    """Declared counts against those found, and nodes at which there is no link."""
    used = pd.Index(pd.unique(pd.concat([file.table[end] for end in ENDS])))
    if file.links is not None and len(file.table) > file.links:
        note = f"more links than the {file.links} that the file declares; value: links"
        notes.add("link count", note, severity="warning", value=len(file.table))
    if file.nodes is not None and len(used) != file.nodes:
        notes.add(
            "node count",
            f"other nodes than the {file.nodes} that the file declares; value: nodes",
            value=len(used),
        )
    if coordinates is not None:
        known = pd.Index(coordinates.table["node_id"])
    elif file.nodes is not None and max(map(int, used)) <= file.nodes < 10 * len(used):
        known = pd.Index([str(node) for node in range(1, file.nodes + 1)])
    else:
        return
    unused = known.difference(used, sort=False)
    notes.add_each("unused node", "no link starts or ends here: left out", unused, element="node")


def _nodes(links: pd.DataFrame, loading: Loading, coordinates: Coordinates | None) -> pd.DataFrame:
    """Nodes in the node file's order, otherwise by number, with x and y where they are known."""
    ids = [links[end] for end in ENDS]
    ids += [pairs["node_id"] for pairs in (loading.origins, loading.destinations)]
    used = pd.concat(ids).drop_duplicates()
    if coordinates is None:
        nodes = pd.DataFrame({"node_id": pd.Series(sorted(used, key=int), dtype="str")})
    else:
        table = coordinates.table
        nodes = table[is_among(table["node_id"], used)].reset_index(drop=True)
    node_id = nodes["node_id"]
    pairs = pd.concat([loading.origins, loading.destinations]).drop_duplicates("node_id")
    return nodes.assign(
        zone_id=node_id.map(pairs.set_index("node_id")["zone_id"]).astype("str"),
        control="none",
        through_traffic=~is_among(node_id, loading.centroids),
        origin_of=zones_of(node_id, loading.origins),
        destination_of=zones_of(node_id, loading.destinations),
    )


def _positions(nodes: pd.DataFrame, links: pd.DataFrame) -> tuple[np.ndarray, np.ndarray]:
    """Rows of the nodes at which each link starts and ends."""
    row = pd.Index(nodes["node_id"])
    return row.get_indexer(links["from_node_id"]), row.get_indexer(links["to_node_id"])


def _note_parts(nodes: pd.DataFrame, links: pd.DataFrame, notes: Notes) -> None:
    """Parts that no link ties together, and parts that cannot be left or reached."""
    start, end = _positions(nodes, links)
    if is_one_part(start, end, len(nodes)):
        return
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(links)), (start, end)), shape=(len(nodes), len(nodes)))
    for connection, what in (
        ("weak", "parts that no link ties together"),
        ("strong", "parts within which every node reaches every other, but not beyond"),
    ):
        parts, part_of = connected_components(graph, connection=connection)
        if parts > 1:
            sizes = sorted(np.bincount(part_of).tolist(), reverse=True)
            largest = ", ".join(map(str, sizes[:5])) + (" ..." if parts > 5 else "")
            notes.add(
                f"{connection} components", f"{what}, of {largest} nodes; value: parts", value=parts
            )


def _with_geometry(
    nodes: pd.DataFrame, links: pd.DataFrame, coordinates: Coordinates | None, notes: Notes
) -> Network:
    """Points, and straight lines between them, in columns after the shared ones."""
    import geopandas
    import shapely

    start, end = _positions(nodes, links)
    if coordinates is not None:
        place = nodes[["x", "y"]].to_numpy(dtype=np.float64)
        nodes = nodes.drop(columns=["x", "y"])
        crs = coordinates.crs
        for doubt in coordinates.doubts:
            notes.add("doubtful CRS", doubt, severity="warning", value=crs)
        if crs is None:
            notes.add("no CRS", "coordinates of no known reference system", severity="warning")
    else:
        from uxsim_geo.network.layout import schematic_layout

        place, crs = schematic_layout(start, end, links["length"].to_numpy(), len(nodes)), None
        note = "no coordinates: nodes are laid out by distances along the links, not on the earth"
        notes.add("schematic map", note, element="node", severity="warning")
    nodes.insert(len(NODE_COLUMNS), "geometry", shapely.points(place))
    lines = shapely.linestrings(np.stack([place[start], place[end]], axis=1))
    links.insert(len(LINK_COLUMNS), "geometry", lines)
    return Network(
        geopandas.GeoDataFrame(nodes, geometry="geometry", crs=crs),
        geopandas.GeoDataFrame(links, geometry="geometry", crs=crs),
        notes=notes.table(),
    )
