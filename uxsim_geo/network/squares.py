"""What lies around some nodes, square by square.

Looked up so, all squares together take as long as the nodes in and around them, however large the
whole network is.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from uxsim_geo.network.incidence import Ends, Floats, Rows

#: m: shorter links, and those of no known length, are taken to be so long
SHORTEST = 1e-3


def squares(points: Floats, some: Rows, size: float, reach: float) -> Iterator[tuple[Rows, Rows]]:
    """Part nodes by the squares of ``size`` in which they lie, each part with what is around.

    ``points``: x and y of all nodes, (nodes, 2); ``some``: rows of them, a row may be there more
    than once. Yields which of ``some`` are a part, ascending, and the rows of all nodes in the
    rectangle around the part that is wider by ``reach`` on all sides, ascending.
    """
    strip = np.floor(points[:, 0] / size)
    order = np.lexsort((points[:, 1], strip))
    strip, height = strip[order], points[order, 1]
    at = points[some]
    for part in _parts(np.floor(at / size)):
        low, high = at[part].min(axis=0) - reach, at[part].max(axis=0) + reach
        found = [np.empty(0, dtype=np.int64)]
        for column in np.arange(np.floor(low[0] / size), np.floor(high[0] / size) + 1):
            first, last = np.searchsorted(strip, [column, column + 1])
            bottom = np.searchsorted(height[first:last], low[1])
            top = np.searchsorted(height[first:last], high[1], side="right")
            found.append(order[first + bottom : first + top])
        near = np.sort(np.concatenate(found))
        across = points[near, 0]
        yield part, near[(across >= low[0]) & (across <= high[0])]


def _parts(cells: Floats) -> list[Rows]:
    """Rows with the same numbers."""
    if not len(cells):
        return []
    _, cell = np.unique(cells, axis=0, return_inverse=True)
    order = np.argsort(cell.ravel(), kind="stable")
    return np.split(order, np.flatnonzero(np.diff(cell.ravel()[order])) + 1)


def points_by_road(ends: Ends, length: Floats) -> Floats:
    """Places for nodes of which nothing is known but the roads, m: x and y; (nodes, 2).

    They are the ways, in any direction, from two nodes far from one another. So the places of any
    two nodes differ in x, and in y, by no more than the way between them is long.
    """
    from scipy.sparse.csgraph import dijkstra

    roads = shortest_roads(ends, length)

    def away_from(node: int) -> Floats:
        found: Floats = dijkstra(roads, directed=False, indices=node)
        return found

    if not ends.nodes:
        return np.empty((0, 2))
    one = away_from(_furthest(away_from(0)))
    opposite = away_from(_furthest(one))
    other = away_from(_furthest(np.minimum(one, opposite)))
    points = np.stack([one, other], axis=1)
    known = np.isfinite(points)
    # what no road leads to is beyond all others, and in one place
    return np.where(known, points, 2 * points[known].max() + 1e6)


def _furthest(away: Floats) -> int:
    """The node that is furthest away of those to which a road leads."""
    return int(np.argmax(np.where(np.isfinite(away), away, -1.0)))


def shortest_roads(ends: Ends, length: Floats) -> Any:
    """The shortest link between any two nodes, whatever its direction, as a sparse matrix.

    ``length``: of each link, m; rows are those of the lower number of the two nodes.
    """
    from scipy.sparse import csr_array

    # to a sparse matrix a length of 0 would be no link at all
    length = np.maximum(np.nan_to_num(length), SHORTEST)
    low, high = np.minimum(ends.start, ends.end), np.maximum(ends.start, ends.end)
    order = np.lexsort((length, high, low))
    pair = (low * ends.nodes + high)[order]
    shortest = order[np.flatnonzero(np.diff(pair, prepend=-1))]
    data = (length[shortest], (low[shortest], high[shortest]))
    return csr_array(data, shape=(ends.nodes, ends.nodes))
