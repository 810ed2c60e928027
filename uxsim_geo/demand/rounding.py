"""Whole vehicles from a table of real numbers, with the totals kept."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

from uxsim_geo import draws
from uxsim_geo.draws import ROUNDING, Keys

_TINY = 1e-9
_combine = njit(draws.combine)
_unit = njit(draws.unit)


def round_keeping_totals(
    values: npt.NDArray[np.float64],
    rows: npt.NDArray[np.int64],
    columns: npt.NDArray[np.int64],
    keys: Keys,
) -> npt.NDArray[np.int64]:
    """Round every value up or down so that all totals stay within one: rows, columns and all.

    A value is rounded up with a probability equal to its fraction, by draws of its key: dependent
    rounding on a bipartite graph (Gandhi, Khuller, Parthasarathy and Srinivasan 2006). Rows and
    columns are numbers from 0; a pair of them occurs once. All arrays have the shape (n,).
    """
    whole = np.floor(values + _TINY)
    fraction = np.clip(values - whole, 0.0, 1.0)
    open_edges = np.flatnonzero(fraction > _TINY)
    if open_edges.size == 0:
        return whole.astype(np.int64)
    # One more column fills every row up to a whole number. So no row can change by itself, and
    # the total of all is held by that column's own.
    fractions_of_rows = np.bincount(rows[open_edges], fraction[open_edges])
    slack = np.ceil(fractions_of_rows - _TINY) - fractions_of_rows
    slack_rows = np.flatnonzero(slack > _TINY)
    first_column = int(rows.max()) + 1
    slack_column = first_column + int(columns.max()) + 1
    parts = np.concatenate([fraction[open_edges], slack[slack_rows]])
    row_ends = np.concatenate([rows[open_edges], slack_rows])
    column_ends = np.concatenate(
        [columns[open_edges] + first_column, np.full(slack_rows.size, slack_column)]
    )
    slack_keys = np.zeros(first_column, np.uint64)
    np.bitwise_xor.at(slack_keys, rows[open_edges], keys[open_edges])
    edge_keys = np.concatenate([keys[open_edges], slack_keys[slack_rows]]) ^ ROUNDING
    _round_fractions(parts, np.stack([row_ends, column_ends]), edge_keys, slack_column + 1)
    whole[open_edges] += parts[: open_edges.size]
    return np.rint(whole).astype(np.int64)


@njit(cache=True)
def _round_fractions(parts, ends, keys, vertices):  # type: ignore[no-untyped-def]
    """Turn all parts into 0 or 1: walk along open edges, and settle every cycle or path met."""
    graph = _adjacency(ends, vertices)
    degree = graph[3]
    path, stops = np.empty(vertices, np.int64), np.empty(vertices, np.int64)
    step_of = np.full(vertices, -1, np.int64)
    draws_made = 0
    for start in range(vertices):
        while degree[start] > 0:
            begin, length, leaf = _walk(graph, ends, start, path, stops, step_of)
            if begin < 0:  # from that leaf to a cycle, or to the leaf at the other end
                begin, length, _ = _walk(graph, ends, leaf, path, stops, step_of)
            way = path[max(begin, 0) : length]
            chance = _unit(_combine(keys[way[0]], np.uint64(draws_made)))
            draws_made += 1
            _settle(parts, way, chance)
            for edge in way:
                if parts[edge] == 0.0 or parts[edge] == 1.0:
                    _close(graph, ends, edge)


@njit
def _walk(graph, ends, start, path, stops, step_of):  # type: ignore[no-untyped-def]
    """Walk along open edges until a vertex is met again, or a leaf.

    Gives where in `path` the cycle begins (-1: there is none), the edges gone, the last vertex.
    `stops` and `step_of` keep the vertices met and when; `step_of` is left as it was found.
    """
    vertex, length, begin, edge = start, 0, -1, -1
    while begin < 0:
        step_of[vertex], stops[length] = length, vertex
        edge = _way_on(graph, vertex, edge)
        if edge < 0:
            break
        path[length] = edge
        length += 1
        vertex = ends[0, edge] + ends[1, edge] - vertex
        begin = step_of[vertex]
    met = length if begin >= 0 else length + 1
    for place in range(met):
        step_of[stops[place]] = -1
    return begin, length, vertex


@njit
def _adjacency(ends, vertices):  # type: ignore[no-untyped-def]
    """List the open edges of every vertex: offsets, edges, the edges' places there, degrees."""
    degree = np.zeros(vertices, np.int64)
    for side in range(2):
        for vertex in ends[side]:
            degree[vertex] += 1
    first = np.zeros(vertices + 1, np.int64)
    first[1:] = np.cumsum(degree)
    edges = np.empty(first[-1], np.int64)
    places = np.empty(ends.shape, np.int64)
    filled = first[:-1].copy()
    for edge in range(ends.shape[1]):
        for side in range(2):
            vertex = ends[side, edge]
            edges[filled[vertex]] = edge
            places[side, edge] = filled[vertex]
            filled[vertex] += 1
    return first, edges, places, degree


@njit
def _way_on(graph, vertex, came_by):  # type: ignore[no-untyped-def]
    """Give an open edge of the vertex other than the one the walk came by; -1: none."""
    first, edges, _, degree = graph
    last = first[vertex] + degree[vertex] - 1
    if degree[vertex] > 0 and edges[last] != came_by:
        return edges[last]
    return edges[last - 1] if degree[vertex] > 1 else -1


@njit
def _settle(parts, path, chance):  # type: ignore[no-untyped-def]
    """Shift what the edges of a path hold, up and down in turn, until one of them is whole."""
    up = min(np.min(1.0 - parts[path[0::2]]), np.min(parts[path[1::2]]) if path.size > 1 else 1.0)
    down = min(np.min(parts[path[0::2]]), np.min(1.0 - parts[path[1::2]]) if path.size > 1 else 1.0)
    shift = up if chance * (up + down) < down else -down
    for place in range(path.size):
        part = parts[path[place]] + (shift if place % 2 == 0 else -shift)
        if part < _TINY:
            part = 0.0
        elif part > 1.0 - _TINY:
            part = 1.0
        parts[path[place]] = part


@njit
def _close(graph, ends, edge):  # type: ignore[no-untyped-def]
    """Take an edge that has become whole out of the lists of its two vertices."""
    first, edges, places, degree = graph
    for side in range(2):
        vertex = ends[side, edge]
        last = first[vertex] + degree[vertex] - 1
        other, place = edges[last], places[side, edge]
        edges[place], edges[last] = other, edge
        places[side, other], places[side, edge] = place, last
        degree[vertex] -= 1
