"""Ways cut into sections between junctions: the undirected shape of the network, as arrays.

A way is cut where it ends, at nodes that it shares with another way or passes twice (closed ways,
crossings with itself), where it turns back over the same piece, at nodes that a turn restriction
names as its place, and where the file lacks a node.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from uxsim_geo.network.osm_file import PER_DEGREE, Ids, OsmFile

Rows = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Sections:
    """Sections in the order of way ids and of the places on the way.

    points
        rows in the file's ``node_ids``, of all sections one after the other; (points,)
    first
        section ``s`` runs over ``points[first[s]:first[s + 1]]``; (sections + 1,)
    way
        row of the way that each belongs to; (sections,)
    step
        m, on the WGS 84 ellipsoid, from each point to the next of its section; 0 at its end;
        (points,)
    neighbours
        how many other nodes each node of the file is tied to by a piece of road; (nodes,)
    missing
        by way: how many of its nodes the file lacks; (ways,)
    """

    points: Rows
    first: Rows
    way: Rows
    step: Floats
    neighbours: Rows
    missing: Rows

    @property
    def start(self) -> Rows:
        """Row of the node at which each section starts."""
        return self.points[self.first[:-1]]

    @property
    def end(self) -> Rows:
        """Row of the node at which each section ends."""
        return self.points[self.first[1:] - 1]

    @property
    def length(self) -> Floats:
        """Length of each section, m."""
        return np.add.reduceat(self.step, self.first[:-1]) if len(self.way) else np.empty(0)


def cut_ways(file: OsmFile, forced: Ids) -> Sections:
    """Cut the ways of a file; ``forced`` are ids of nodes at which to cut wherever they lie."""
    way = np.repeat(np.arange(len(file.way_ids)), np.diff(file.first))
    node, present = rows_of(file.refs, file.node_ids)
    missing = np.bincount(way[~present], minlength=len(file.way_ids))
    way, node = _without_gaps_and_repeats(way, node, present)
    tied = (way[:-1] == way[1:]) & (node[:-1] >= 0) & (node[1:] >= 0)
    onward, back = np.append(tied, False), np.insert(tied, 0, False)
    number = np.bincount(node[onward | back], minlength=len(file.node_ids) + 1)
    rows, known = rows_of(forced, file.node_ids)
    number[rows[known]] += 2
    neighbours = _neighbours(node[:-1][tied], node[1:][tied], len(file.node_ids))
    junction = (number > 1) | (np.append(neighbours, 0) == 1)
    cut = (onward ^ back) | (onward & back & junction[node])
    starts, ends = np.flatnonzero(cut & onward), np.flatnonzero(cut & back)
    sizes = ends - starts + 1
    first = np.concatenate([[0], np.cumsum(sizes)])
    positions = np.arange(first[-1]) - np.repeat(first[:-1] - starts, sizes)
    points, inside = node[positions], np.ones(len(positions), dtype=bool)
    inside[first[1:] - 1] = False
    return Sections(
        points=points,
        first=first,
        way=way[starts],
        step=_steps(file, points, inside),
        neighbours=neighbours,
        missing=missing,
    )


def rows_of(ids: Ids, known: Ids) -> tuple[Rows, Flags]:
    """Rows of ids in a sorted array (-1 where they are not in it), and whether they are."""
    if not len(known):
        return np.full(len(ids), -1), np.zeros(len(ids), dtype=bool)
    rows = np.minimum(np.searchsorted(known, ids), len(known) - 1)
    present = known[rows] == ids
    return np.where(present, rows, -1), present


def _without_gaps_and_repeats(way: Rows, node: Rows, present: Flags) -> tuple[Rows, Rows]:
    """Leave out nodes named twice running; of missing ones running, one stays and cuts the way."""
    again = np.zeros(len(node), dtype=bool)
    again[1:] = (node[1:] == node[:-1]) & (way[1:] == way[:-1])
    assert bool((node[~present] == -1).all()), "missing nodes are alike"
    return way[~again], node[~again]


def _steps(file: OsmFile, points: Rows, inside: Flags) -> Floats:
    """Length, m, from each point to the next; 0 where ``inside`` says that its section ends."""
    from pyproj import Geod

    x, y = file.x[points] / PER_DEGREE, file.y[points] / PER_DEGREE
    start = np.flatnonzero(inside)
    steps = np.zeros(len(points))
    # the ellipsoid's own shortest line: right across the 180th meridian as well
    inverse = Geod(ellps="WGS84").inv(x[start], y[start], x[start + 1], y[start + 1])
    steps[start] = inverse[2]
    return steps


def _neighbours(start: Rows, end: Rows, nodes: int) -> Rows:
    """Number of different nodes at the other ends of each node's pieces of road."""
    low, high = np.minimum(start, end), np.maximum(start, end)
    pairs = np.unique(np.stack([low, high], axis=1), axis=0)
    return np.bincount(pairs.ravel(), minlength=nodes)
