"""A schematic map of a network that has no coordinates.

Pivot scaling (Brandes and Pich 2007): distances along the links from a few nodes far from one
another, then the two directions in which those distances vary most. What is far apart on the
road lies far apart on the map; angles and crossings mean nothing.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from scipy.sparse import csr_array

#: more pivots than this change the picture little
PIVOTS = 48

#: metres; to a sparse graph a length of 0 would be no link at all
SHORTEST = 1e-3

GOLDEN_ANGLE = math.pi * (3.0 - math.sqrt(5.0))


def schematic_layout(
    from_node: np.ndarray, to_node: np.ndarray, length: np.ndarray, nodes: int
) -> np.ndarray:
    """Coordinates, metres, shape (nodes, 2), of nodes 0 ... tied by links of the given lengths.

    The same network always gets the same map. Parts that no link ties together lie side by side.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    length = np.maximum(length, SHORTEST)
    edges = coo_array((length, (from_node, to_node)), shape=(nodes, nodes)).tocsr()
    parts, part_of = connected_components(edges, directed=False)
    place = np.zeros((nodes, 2))
    left = 0.0
    for part in np.argsort(-np.bincount(part_of, minlength=parts), kind="stable"):
        members = np.flatnonzero(part_of == part)
        shape = _lay_out_part(edges[members][:, members])
        shape -= shape.min(axis=0)
        place[members] = shape + np.array([left, 0.0])
        width = float(shape[:, 0].max())
        left += width + 0.1 * max(width, float(length.mean()) if len(length) else 1.0)
    return _part_coincident(place)


def _lay_out_part(edges: csr_array) -> np.ndarray:
    """Pivot scaling of a connected network; shape (nodes, 2)."""
    nodes = edges.shape[0]
    if nodes == 1:
        return np.zeros((1, 2))
    pivots, distance = _pivot_distances(edges)
    squared = distance**2
    centred = -0.5 * (
        squared - squared.mean(axis=0) - squared.mean(axis=1, keepdims=True) + squared.mean()
    )
    _, directions = np.linalg.eigh(centred.T @ centred)
    axes = directions[:, ::-1][:, :2]
    if axes.shape[1] < 2:
        axes = np.column_stack([axes, np.zeros(len(axes))])
    axes = axes * np.sign(axes[np.argmax(np.abs(axes), axis=0), range(2)])
    place = centred @ axes
    drawn = np.linalg.norm(place[:, None, :] - place[None, pivots, :], axis=2)
    squares = float(np.sum(drawn**2))
    scale = float(np.sum(drawn * distance)) / squares if squares > 0 else 1.0
    return np.asarray(place * scale)


def _pivot_distances(edges: csr_array) -> tuple[list[int], np.ndarray]:
    """Pivots, each the node farthest from those before, and distances; (nodes, pivots)."""
    from scipy.sparse.csgraph import dijkstra

    nodes = edges.shape[0]
    columns: list[np.ndarray] = []
    nearest = np.full(nodes, np.inf)
    pivots = [0]
    while True:
        distance = dijkstra(edges, directed=False, indices=pivots[-1])
        columns.append(distance)
        nearest = np.minimum(nearest, distance)
        if len(pivots) == min(PIVOTS, nodes):
            return pivots, np.column_stack(columns)
        pivots.append(int(np.argmax(nearest)))


def _part_coincident(place: np.ndarray) -> np.ndarray:
    """Move nodes that lie on one another a little apart, so that their links can be seen."""
    step = 0.004 * max(float(np.ptp(place[:, 0])), float(np.ptp(place[:, 1])), 1.0)
    cell = np.round(place / (0.1 * step)).astype(np.int64)
    _, inverse = np.unique(cell, axis=0, return_inverse=True)
    order = np.argsort(inverse, kind="stable")
    first = np.searchsorted(inverse[order], inverse[order], side="left")
    rank = np.empty(len(place))
    rank[order] = np.arange(len(place)) - first
    radius, angle = step * np.sqrt(rank), GOLDEN_ANGLE * rank
    return place + np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
