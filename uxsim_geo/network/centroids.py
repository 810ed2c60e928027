"""Centroids: points where trips of a zone begin and end, tied to the streets by connectors.

A connector is a link at a centroid; it stands for all the small streets of its zone. Nobody may
drive through a centroid. Either that is kept (``through_traffic`` False), or connectors are
collapsed: they are dropped, and the zone's trips begin and end at the nodes they led to.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from uxsim_geo.network.notes import Notes
from uxsim_geo.network.rows import is_among
from uxsim_geo.network.tntp_links import infinite_capacity
from uxsim_geo.network.tntp_net import NetFile
from uxsim_geo.network.tntp_options import TntpOptions

NO_NODE = pd.Index([], dtype="str")


@dataclass(frozen=True)
class Loading:
    """Where trips get on and off: links that stay, and which zones' trips each node serves.

    links
        a boolean, one a row of the net file: whether the link stays
    centroids
        node ids that stay without through traffic
    origins, destinations
        pairs zone_id, node_id: trips from (to) the zone may start (end) at the node
    """

    links: np.ndarray
    centroids: pd.Index
    origins: pd.DataFrame
    destinations: pd.DataFrame


def load_zones(net: NetFile, options: TntpOptions, notes: Notes) -> Loading:
    """Recognise centroids and either collapse or keep their connectors."""
    zones = _zones(net)
    centroids = _centroids(net, options, zones, notes)
    leaving = is_among(net.table["from_node_id"], centroids)
    entering = is_among(net.table["to_node_id"], centroids)
    own = pd.DataFrame({"zone_id": zones, "node_id": zones}, dtype="str")
    if options.connectors == "keep" or centroids.empty:
        stays = np.ones(len(net.table), dtype=bool)
        return Loading(stays, centroids, own, own)
    return _collapse(net.table, leaving & entering, centroids, own, notes)


def _zones(net: NetFile) -> pd.Index:
    """Zones 1 to the number declared, as far as they are ends of links."""
    return _nodes_up_to(net.table, net.zones or 0)


def _nodes_up_to(table: pd.DataFrame, highest: int) -> pd.Index:
    """Node ids at which there is a link, up to a number, in the order of numbers."""
    ends = pd.concat([table["from_node_id"], table["to_node_id"]])
    numbers = sorted(int(node) for node in ends.unique())
    return pd.Index([str(node) for node in numbers if node <= highest], dtype="str")


def _centroids(net: NetFile, options: TntpOptions, zones: pd.Index, notes: Notes) -> pd.Index:
    if options.centroids == "none":
        return NO_NODE
    first = options.first_thru_node or net.first_thru_node or 1
    if first > 1:
        found = _nodes_up_to(net.table, first - 1)
        why = f"nodes below the first thru node {first}"
    else:
        found = _zones_with_connectors_only(net.table, options, zones)
        why = "zones whose links all take no time or have infinite capacity"
    if len(found):
        notes.add(
            "centroids",
            f"{why}: no through traffic; value: nodes",
            element="node",
            value=len(found),
        )
    return found


def _zones_with_connectors_only(
    table: pd.DataFrame, options: TntpOptions, zones: pd.Index
) -> pd.Index:
    """Zones of which every link takes no time or has infinite capacity, if others do not."""
    free = infinite_capacity(table, options)
    if "free_flow_time" in table:
        free = free | np.asarray(table["free_flow_time"] == 0)
    ends = pd.concat([table["from_node_id"], table["to_node_id"]])
    if ends.nunique() == len(zones):  # every node is a zone: none is there only for trips
        return NO_NODE
    with_road = ends[~np.concatenate([free, free])]
    return zones[~is_among(zones, with_road)]


def _collapse(
    table: pd.DataFrame, between: np.ndarray, centroids: pd.Index, own: pd.DataFrame, notes: Notes
) -> Loading:
    """Drop the connectors; centroids tied to one another stay as they are."""
    tied = pd.concat([table["from_node_id"][between], table["to_node_id"][between]])
    kept = centroids[is_among(centroids, tied)]
    gone = centroids.difference(kept, sort=False)
    out = is_among(table["from_node_id"], gone)
    into = is_among(table["to_node_id"], gone)
    names = {"from_node_id": "zone_id", "to_node_id": "node_id"}
    origins = table.loc[out, list(names)].rename(columns=names)
    destinations = table.loc[into, list(names)].rename(
        columns={"to_node_id": "zone_id", "from_node_id": "node_id"}
    )
    rest = own[~is_among(own["zone_id"], gone)]
    note = "connectors dropped: trips start and end evenly at the nodes they led to; value: links"
    notes.add("connectors collapsed", note, element="link", value=int((out | into).sum()))
    _note_shared_nodes(origins, destinations, notes)
    if len(kept):
        note = "centroids with links to one another were not collapsed; value: nodes"
        notes.add("connectors kept", note, element="node", value=len(kept))
    return Loading(
        ~(out | into),
        kept,
        pd.concat([origins, rest]).drop_duplicates(ignore_index=True),
        pd.concat([destinations[["zone_id", "node_id"]], rest]).drop_duplicates(ignore_index=True),
    )


def _note_shared_nodes(origins: pd.DataFrame, destinations: pd.DataFrame, notes: Notes) -> None:
    """Say that zone_id cannot name every zone, where connectors of several led to one node."""
    pairs = pd.concat([origins, destinations[["zone_id", "node_id"]]]).drop_duplicates()
    zones = pairs["node_id"].value_counts()
    shared = int((zones > 1).sum())
    if shared:
        note = (
            "nodes that serve several zones: zone_id names the first of them, "
            "origin_of and destination_of name all; value: nodes"
        )
        notes.add("zones share nodes", note, element="node", value=shared)


def zones_of(nodes: pd.Series, pairs: pd.DataFrame) -> pd.Series:
    """The zones that each node serves, as text with blanks between; null where none."""
    served: dict[str, str] = {}
    for node_id, zone in zip(pairs["node_id"], pairs["zone_id"], strict=True):
        served[node_id] = f"{served[node_id]} {zone}" if node_id in served else zone
    return nodes.map(served).astype("str")
