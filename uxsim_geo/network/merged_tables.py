"""Tables of a network whose junctions of several nodes have become one node each."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from uxsim_geo.network.bans import ban_paths
from uxsim_geo.network.incidence import Floats, Rows, rank_of
from uxsim_geo.network.inner_paths import Streets
from uxsim_geo.network.network import Network
from uxsim_geo.network.rows import numbers

if TYPE_CHECKING:
    from uxsim_geo.network.junctions import Merged

#: in a ban that a merged junction needs: no open way led from the one link to the other
NO_WAY = "no way through the junction"

#: a link whose speed would change by less than this share keeps its own
SAME_SPEED = 0.002

#: decimals of lengths in m: the last bits may differ between machines
DECIMALS = 6


def merged_network(network: Network, merged: list[Merged], streets: Streets) -> Network:
    """The tables with one node a junction."""
    rank = rank_of(network.nodes["node_id"])
    head = _heads(network, merged, rank)
    inner = np.zeros(len(network.links), dtype=bool)
    for one in merged:
        inner[list(one.junction.inner)] = True
    nodes = _nodes(network.nodes, head, rank)
    error = {int(head[min(one.junction.nodes)]): one.additions.error for one in merged}
    known = (
        numbers(nodes["merge_error"]).copy()
        if "merge_error" in nodes
        else np.full(len(nodes), np.nan)
    )
    known[list(error)] = np.round(list(error.values()), 3)
    nodes["merge_error"] = known
    ids = network.nodes["node_id"].to_numpy()
    links = network.links.copy()
    for column, end in (("from_node_id", streets.start), ("to_node_id", streets.end)):
        links[column] = pd.Series(ids[head[end]], dtype="str", index=links.index)
    links["length"], links["free_speed"] = lengths_and_speeds(network.links, merged)
    if "geometry" in links:
        links["geometry"] = moved_lines(network, nodes, head, (streets.start, streets.end))
    movements = _movements(network, merged, streets, head)
    kept = head == np.arange(len(head))
    return Network(
        nodes[kept].reset_index(drop=True),
        links[~inner].reset_index(drop=True),
        movements,
        network.notes,
    )


def _heads(network: Network, merged: list[Merged], rank: Rows) -> Rows:
    """Row of the node that each becomes: the first of its junction by id, signals before others."""
    signal = np.zeros(len(network.nodes), dtype=bool)
    if "control" in network.nodes:
        signal = np.asarray(network.nodes["control"] == "signal", dtype=bool)
    head = np.arange(len(network.nodes))
    for one in merged:
        nodes = np.array(sorted(one.junction.nodes))
        head[nodes] = nodes[np.lexsort((rank[nodes], ~signal[nodes]))[0]]
    return head


def _nodes(table: pd.DataFrame, head: Rows, rank: Rows) -> pd.DataFrame:
    """The table with what the nodes of each junction have together in the row of its head."""
    nodes = table.copy()
    order = np.lexsort((rank, head))
    begin = np.flatnonzero(np.diff(head[order], prepend=-1))
    size = np.diff(np.append(begin, len(order)))
    several = np.flatnonzero(size > 1)
    rows = [order[begin[k] : begin[k] + size[k]] for k in several.tolist()]
    heads = head[order[begin[several]]]
    merged_ids = nodes.get("merged_node_ids", pd.Series([None] * len(nodes), dtype="str"))
    columns = {"merged_node_ids": merged_ids.fillna(nodes["node_id"])}
    if "signal_node_ids" in nodes:
        columns["signal_node_ids"] = nodes["signal_node_ids"]
    nodes["merged_node_ids"] = merged_ids
    for name, column in columns.items():
        texts = column.tolist()
        together = [_together([texts[row] for row in of_one]) for of_one in rows]
        values = nodes[name].tolist()
        for row, text in zip(heads.tolist(), together, strict=True):
            values[row] = text
        nodes[name] = pd.Series(values, dtype="str", index=nodes.index)
    if "geometry" in nodes:
        nodes["geometry"] = _centres(nodes, rows, heads)
    return nodes


def _together(texts: list[Any]) -> str | None:
    ids = [name for text in texts if isinstance(text, str) for name in text.split()]
    return " ".join(dict.fromkeys(ids)) or None


def _centres(nodes: pd.DataFrame, rows: list[Rows], heads: Rows) -> Any:
    """The points, those of junctions in the middle of their nodes."""
    import shapely

    shapes = np.array(nodes["geometry"], dtype=object)
    points = shapely.get_coordinates(shapes)
    middles = np.array([points[of_one].mean(axis=0) for of_one in rows])
    decimals = 9 if _in_degrees(nodes) else 3
    shapes[heads] = shapely.points(np.round(middles, decimals))
    return shapes


def _in_degrees(table: pd.DataFrame) -> bool:
    crs: Any = getattr(table, "crs", None)
    return crs is not None and bool(crs.is_geographic)


def lengths_and_speeds(links: pd.DataFrame, merged: list[Merged]) -> tuple[Floats, Floats]:
    """Of each link, m and m/s, with what it takes over of the junctions at its ends."""
    length, speed = numbers(links["length"]), numbers(links["free_speed"])
    more, longer = np.zeros(len(length)), np.zeros(len(length))
    for one in merged:
        for link, metres in one.additions.length.items():
            more[link] += metres
            longer[link] += one.additions.time[link]
    changed = more > 0
    total = np.where(changed, np.round(length + more, DECIMALS), length)
    found = total / (length / speed + longer)
    same = ~changed & (longer == 0) | (np.abs(found - speed) < SAME_SPEED * speed)
    return total, np.where(same, speed, found)


def _movements(
    network: Network, merged: list[Merged], streets: Streets, head: Rows
) -> pd.DataFrame:
    """Bans elsewhere as they were, and of every junction one for each turn without a way."""
    movements = network.movements
    row = {link_id: row for row, link_id in enumerate(network.links["link_id"])}
    paths = [tuple(row[name] for name in path) for path in ban_paths(movements)]
    gone = {link for one in merged for link in one.junction.inner}
    at = {node for one in merged for node in one.junction.nodes}
    kept, said = [], {}
    for place, path in enumerate(paths):
        own = streets.start[path[-1]] in at and len(path) == 2
        if gone.isdisjoint(path) and not own:
            kept.append(place)
        said[path[0], path[-1]] = place
    own_rows = _rows_of_junctions(network, merged, said)
    old = movements.iloc[kept].copy()
    together = pd.concat([old, own_rows], ignore_index=True) if len(own_rows) else old
    node = [head[streets.end[row[link_id]]] for link_id in together["from_link_id"]]
    ids = network.nodes["node_id"].to_numpy()
    together["node_id"] = pd.Series(ids[np.array(node, dtype=np.int64)], dtype="str")
    return together.reset_index(drop=True)


def _rows_of_junctions(
    network: Network, merged: list[Merged], said: dict[Any, int]
) -> pd.DataFrame:
    """One row a turn of a junction for which there was no open way."""
    ids, movements = network.links["link_id"].tolist(), network.movements
    pairs = [
        (a, b)
        for one in merged
        for a in sorted(one.junction.approaches)
        for b in sorted(one.junction.exits)
        if (a, b) not in one.junction.ways
    ]
    columns = {
        "from_link_id": [ids[a] for a, _ in pairs],
        "to_link_id": [ids[b] for _, b in pairs],
        "node_id": [None] * len(pairs),
    }
    for name in movements.columns.difference([*columns, "via_link_ids"]):
        column = movements[name].tolist()
        columns[name] = [column[said[pair]] if pair in said else None for pair in pairs]
    table = pd.DataFrame(columns, dtype="str")
    if "restriction" in movements:
        table["restriction"] = table["restriction"].fillna(NO_WAY)
    return table.reindex(columns=movements.columns).astype("str")


def moved_lines(
    network: Network, nodes: pd.DataFrame, head: Rows, ends: tuple[list[int], list[int]]
) -> Any:
    """Lines of the links, led to the middle of junctions where they came to one of its nodes.

    Vertices that are nearer to the middle than the node was go, so that no line runs back.
    """
    import shapely

    shapes = np.array(network.links["geometry"], dtype=object)
    size = np.bincount(head, minlength=len(head))
    start, end = (np.array(rows, dtype=np.int64) for rows in ends)
    moved = np.flatnonzero((size[head[start]] > 1) | (size[head[end]] > 1))
    centres = shapely.get_coordinates(nodes["geometry"].to_numpy())
    at = shapely.get_coordinates(network.nodes["geometry"].to_numpy())
    points, line = shapely.get_coordinates(shapes[moved], return_index=True)
    first = np.flatnonzero(np.diff(line, prepend=-1))
    last = np.append(first[1:], len(line)) - 1
    inside = np.zeros(len(points), dtype=bool)
    for rows, tip in ((start[moved], first), (end[moved], last)):
        centre = centres[head[rows]]
        reach = np.hypot(*(at[rows] - centre).T)
        distance = np.hypot(*(points - centre[line]).T)
        inside |= distance < reach[line]
        points[tip] = centre
    inside[first] = inside[last] = False
    shapes[moved] = shapely.linestrings(points[~inside], indices=line[~inside])
    return shapes
