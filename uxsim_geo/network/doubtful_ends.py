"""Streets that end a few metres before another: a connection may be missing there."""

from __future__ import annotations

from dataclasses import dataclass
from heapq import heappop, heappush
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.network.headings import BEFORE, in_plane
from uxsim_geo.network.incidence import Ends, Flags, Floats, Rows, rank_of
from uxsim_geo.network.network import Network
from uxsim_geo.network.rows import numbers
from uxsim_geo.network.squares import SHORTEST, shortest_roads

#: m, within which another link must lie ahead of the end; and one of the same name
AHEAD, AHEAD_OF_ITSELF = 10.0, 20.0

#: classes of roads to which no street is connected by an end like that
CLOSED_ROADS = ("motorway", "motorway_link")

#: columns of nodes that say why a street ends there: a gate, a turning place, a path that goes on
REASONS = ("barrier", "highway", "beyond")

#: degrees to both sides of the street's own direction that count as ahead
SIDEWAYS = 45.0

#: m: a place that one can drive to in this way needs no connection
WAY_ROUND = 200.0


@dataclass(frozen=True)
class Gaps:
    """Rows of nodes at which streets end, of the link ahead of each, and the metres between."""

    node: Rows
    link: Rows
    metres: Floats

    def only(self, chosen: Flags | Rows) -> Gaps:
        """Some of them."""
        return Gaps(self.node[chosen], self.link[chosen], self.metres[chosen])


def doubtful_ends(network: Network, ends: Ends) -> Gaps:
    """Find dead ends with a link close ahead that is far away by road.

    Bridges and tunnels do not count, nor links of another layer. Nothing is found where it is not
    known where the links lie.
    """
    import shapely

    plane = in_plane(network)
    if plane is None:
        none = np.empty(0, dtype=np.int64)
        return Gaps(none, none, none.astype(np.float64))
    node, street = _dead_ends(network, ends)
    gaps = _gaps_ahead(plane, ends, node, street)
    lines, points = (table["geometry"].to_numpy() for table in (plane.links, plane.nodes))
    places = shapely.line_locate_point(lines[gaps.link], points[gaps.node], normalized=True)
    return gaps.only(_ways_round(network, ends, gaps, places) > WAY_ROUND)


def _dead_ends(network: Network, ends: Ends) -> tuple[Rows, Rows]:
    """Nodes with one neighbour, and a link of each, where no reason is known for it."""
    here = np.concatenate([ends.start, ends.end])
    other = np.concatenate([ends.end, ends.start])
    link = np.tile(np.arange(len(ends.start)), 2)
    _, first = np.unique(here * ends.nodes + other, return_index=True)
    lone = np.flatnonzero(np.bincount(here[first], minlength=ends.nodes)[here] == 1)
    rank = rank_of(network.links["link_id"].iloc[link[lone]])
    lone = lone[np.lexsort((rank, here[lone]))]
    lone = lone[np.flatnonzero(np.diff(here[lone], prepend=-1))]
    node, street = here[lone], link[lone]
    meant = np.zeros(len(node), dtype=bool)
    for column in REASONS:
        if column in network.nodes:
            meant |= np.asarray(network.nodes[column].notna(), dtype=bool)[node]
    return node[~meant], street[~meant]


def _gaps_ahead(plane: Network, ends: Ends, node: Rows, street: Rows) -> Gaps:
    """The nearest link ahead of each end, where there is one."""
    import shapely

    lines = plane.links["geometry"].to_numpy()
    points = plane.nodes["geometry"].to_numpy()[node]
    one, link = shapely.STRtree(lines).query(points, predicate="dwithin", distance=AHEAD_OF_ITSELF)
    apart = (ends.start[link] != node[one]) & (ends.end[link] != node[one])
    level = _levels(plane.links)
    kept = apart & (level[link] == level[street[one]]) & ~_is_closed(plane.links)[link]
    one, link = one[kept], link[kept]
    to_link = shapely.shortest_line(points[one], lines[link])
    metres = shapely.length(to_link)
    off = _angles(_directions(lines, ends, node, street)[one], to_link)
    rank = rank_of(plane.links["link_id"].iloc[link])
    order = np.lexsort((rank, np.round(metres, 3), one))
    reach = np.where(_same_name(plane.links, street[one], link), AHEAD_OF_ITSELF, AHEAD)
    order = order[((np.round(off, 6) <= SIDEWAYS) & (np.round(metres, 3) <= reach))[order]]
    nearest = order[np.flatnonzero(np.diff(one[order], prepend=-1))]
    return Gaps(node[one[nearest]], link[nearest], metres[nearest])


def _levels(links: pd.DataFrame) -> Floats:
    """The layer of each link; on bridges and in tunnels none (NaN), which equals no other."""
    level = np.zeros(len(links))
    if "layer" in links:
        level = np.nan_to_num(numbers(links["layer"]))
    for column in ("bridge", "tunnel"):
        if column in links:
            level[np.asarray(links[column].notna(), dtype=bool)] = np.nan
    return level


def _is_closed(links: pd.DataFrame) -> Flags:
    """Roads that have no junctions with streets."""
    if "road_class" not in links:
        return np.zeros(len(links), dtype=bool)
    return np.asarray(links["road_class"].isin(CLOSED_ROADS), dtype=bool)


def _same_name(links: pd.DataFrame, one: Rows, other: Rows) -> Flags:
    """Pairs of links with the same name."""
    if "name" not in links:
        return np.zeros(len(one), dtype=bool)
    names = pd.factorize(links["name"])[0]
    return np.asarray((names[one] == names[other]) & (names[one] >= 0))


def _directions(lines: Any, ends: Ends, node: Rows, street: Rows) -> Floats:
    """Which way each street runs over its last metres to its dead end; (ends, 2)."""
    import shapely

    at_end = ends.end[street] == node
    back = np.where(at_end, -BEFORE, BEFORE)
    tip = shapely.get_coordinates(shapely.get_point(lines[street], np.where(at_end, -1, 0)))
    before = shapely.get_coordinates(shapely.line_interpolate_point(lines[street], back))
    return np.asarray(tip - before)


def _angles(direction: Floats, lines: Any) -> Floats:
    """Degrees between directions and lines of two points, 0 to 180; of no length: 0."""
    import shapely

    coordinates = shapely.get_coordinates(lines).reshape(-1, 2, 2)
    ahead = coordinates[:, 1] - coordinates[:, 0]
    cross = direction[:, 0] * ahead[:, 1] - direction[:, 1] * ahead[:, 0]
    along = (direction * ahead).sum(axis=1)
    return np.asarray(np.degrees(np.abs(np.arctan2(cross, along))))


def _ways_round(network: Network, ends: Ends, gaps: Gaps, places: Floats) -> Floats:
    """Metres by road, in any direction, from each end to its place on the link ahead.

    ``places``: share of the link before the place. Infinite beyond :data:`WAY_ROUND`.
    """
    if not len(gaps.node):
        return np.empty(0)
    length = np.maximum(np.nan_to_num(numbers(network.links["length"])), SHORTEST)
    roads = shortest_roads(ends, length)
    around = _Neighbours((roads + roads.T).tocsr())
    before = places * length[gaps.link]
    found = np.full(len(gaps.node), np.inf)
    for row, (node, link) in enumerate(zip(gaps.node.tolist(), gaps.link.tolist(), strict=True)):
        away = around.within(node, WAY_ROUND)
        to_start = away.get(int(ends.start[link]), np.inf) + before[row]
        to_end = away.get(int(ends.end[link]), np.inf) + length[link] - before[row]
        found[row] = min(to_start, to_end)
    return found


class _Neighbours:
    """Nodes and the metres to their neighbours: what is near is found without a look at the rest.

    ``roads``: a sparse matrix with the metres between any two neighbours, from both sides.
    """

    def __init__(self, roads: Any) -> None:
        self._first, self._node, self._metres = roads.indptr, roads.indices, roads.data

    def within(self, node: int, most: float) -> dict[int, float]:
        """Metres from a node to all that are not further away than ``most`` (Dijkstra)."""
        found: dict[int, float] = {}
        unfinished = [(0.0, node)]
        while unfinished:
            metres, here = heappop(unfinished)
            if here in found:
                continue
            found[here] = metres
            roads = slice(self._first[here], self._first[here + 1])
            onward = zip(self._node[roads].tolist(), self._metres[roads].tolist(), strict=True)
            for other, more in onward:
                if metres + more <= most and other not in found:
                    heappush(unfinished, (metres + more, other))
        return found
