"""Whole vehicles from a table of real numbers, with the totals kept."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from uxsim_geo import draws
from uxsim_geo.compiling import digest_of_sources, entry, inner
from uxsim_geo.draws import ROUNDING, Keys

_TINY = 1e-9
_inner = inner()
_combine = _inner(draws.combine)
_unit = _inner(draws.unit)


def round_keeping_totals(
    values: npt.NDArray[np.float64],
    rows: npt.NDArray[np.int64],
    columns: npt.NDArray[np.int64],
    keys: Keys,
) -> npt.NDArray[np.int64]:
    """Round every value up or down so that all totals stay within one: rows, columns and all.

    A value is rounded up with a probability equal to its fraction, by draws of its key: dependent
    rounding on a bipartite graph (Gandhi, Khuller, Parthasarathy and Srinivasan 2006). Rows and
    columns are numbers from 0; a pair of them may occur again. All arrays have the shape (n,).

    Parts of the graph that nothing connects do not feel each other: each has its own total, and
    draws of its own.
    """
    whole = np.floor(values + _TINY)
    fraction = np.clip(values - whole, 0.0, 1.0)
    open_edges = np.flatnonzero(fraction > _TINY)
    if open_edges.size == 0:
        return whole.astype(np.int64)
    first_column = int(rows.max()) + 1
    slack_column = first_column + int(columns.max()) + 1
    ends = np.stack([rows[open_edges], columns[open_edges] + first_column])
    part_of = _connected_parts(ends, slack_column)
    # One more column for each part fills every row up to a whole number. So no row can change by
    # itself, and the total of the part is held by that column's own.
    fractions_of_rows = np.bincount(rows[open_edges], fraction[open_edges])
    slack = np.ceil(fractions_of_rows - _TINY) - fractions_of_rows
    slack_rows = np.flatnonzero(slack > _TINY)
    parts = np.concatenate([fraction[open_edges], slack[slack_rows]])
    slack_ends = np.stack([slack_rows, slack_column + part_of[slack_rows]])
    slack_keys = np.zeros(first_column, np.uint64)
    np.bitwise_xor.at(slack_keys, rows[open_edges], keys[open_edges])
    edge_keys = np.concatenate([keys[open_edges], slack_keys[slack_rows]]) ^ ROUNDING
    graph = _graph_of(parts, np.concatenate([ends, slack_ends], axis=1))
    trail = _Trail(*(np.full(graph.degree.size, -1) for _ in range(3)))
    draws_made = np.zeros(part_of.size, np.uint64)  # in each part
    _round_fractions(graph, trail, edge_keys, part_of, draws_made)
    whole[open_edges] += parts[: open_edges.size]
    return np.rint(whole).astype(np.int64)


def _connected_parts(ends: npt.NDArray[np.int64], vertices: int) -> npt.NDArray[np.int64]:
    """Number the parts of a graph that hang together, by their first vertices; part of each."""
    part_of = np.arange(vertices)
    _join_parts(ends, part_of)
    return part_of


class _Graph(NamedTuple):
    """Open edges of a bipartite graph: those whose part is neither 0 nor 1 yet."""

    parts: npt.NDArray[np.float64]  # (edges,)
    ends: npt.NDArray[np.int64]  # (2, edges): vertices
    edges: npt.NDArray[np.int64]  # (2 edges,): the edges of each vertex in a run, open ones first
    places: npt.NDArray[np.int64]  # (2, edges): where each edge stands there
    first: npt.NDArray[np.int64]  # (vertices,): where each vertex's run begins
    degree: npt.NDArray[np.int64]  # (vertices,): its open edges


class _Trail(NamedTuple):
    """A walk along open edges."""

    path: npt.NDArray[np.int64]  # (vertices,): its edges
    stops: npt.NDArray[np.int64]  # (vertices,): the vertices met
    step_of: npt.NDArray[np.int64]  # (vertices,): when each was met, -1: it was not


def _graph_of(parts: npt.NDArray[np.float64], ends: npt.NDArray[np.int64]) -> _Graph:
    flat = ends.ravel()
    order = np.argsort(flat, kind="stable")
    places = np.empty_like(order)
    places[order] = np.arange(order.size)
    degree = np.bincount(flat)
    first = np.cumsum(degree) - degree
    return _Graph(parts, ends, order % parts.size, places.reshape(2, -1), first, degree)


# compiled code that makes arrays of its own needs half of numba when it is loaded
_entry = entry(digest_of_sources(Path(__file__)))


@_entry
def _join_parts(ends, parent):  # type: ignore[no-untyped-def]
    """Turn vertices, each its own parent, into the numbers of the parts that edges make of them.

    A tree's root is its lowest vertex (union-find with path halving: Tarjan and van Leeuwen 1984).
    """
    for edge in range(ends.shape[1]):
        one, other = _root(parent, ends[0, edge]), _root(parent, ends[1, edge])
        parent[max(one, other)] = min(one, other)
    parts = 0
    for vertex in range(parent.size):  # what stands before it has its number already
        if parent[vertex] == vertex:
            parent[vertex] = parts
            parts += 1
        else:
            parent[vertex] = parent[parent[vertex]]


@_inner
def _root(parent, vertex):  # type: ignore[no-untyped-def]
    while parent[vertex] != vertex:
        parent[vertex] = parent[parent[vertex]]
        vertex = parent[vertex]
    return vertex


@_entry
def _round_fractions(graph, trail, keys, part_of, draws_made):  # type: ignore[no-untyped-def]
    """Turn all parts into 0 or 1: walk along open edges, and settle every cycle or path met."""
    for start in range(part_of.size):
        while graph.degree[start] > 0:
            begin, length, leaf = _walk(graph, trail, start)
            if begin < 0:  # from that leaf to a cycle, or to the leaf at the other end
                begin, length, _ = _walk(graph, trail, leaf)
            begin = max(begin, 0)
            chance = _unit(_combine(keys[trail.path[begin]], draws_made[part_of[start]]))
            draws_made[part_of[start]] += np.uint64(1)
            _settle(graph, trail.path, begin, length, chance)


@_inner
def _walk(graph, trail, start):  # type: ignore[no-untyped-def]
    """Walk along open edges until a vertex is met again, or a leaf.

    Gives where in the path the cycle begins (-1: there is none), the edges gone, the last vertex.
    """
    vertex, length, begin, edge = start, 0, -1, -1
    while begin < 0:
        trail.step_of[vertex] = length
        trail.stops[length] = vertex
        edge = _way_on(graph, vertex, edge)
        if edge < 0:
            break
        trail.path[length] = edge
        length += 1
        vertex = graph.ends[0, edge] + graph.ends[1, edge] - vertex
        begin = trail.step_of[vertex]
    met = length if begin >= 0 else length + 1
    for place in range(met):
        trail.step_of[trail.stops[place]] = -1
    return begin, length, vertex


@_inner
def _way_on(graph, vertex, came_by):  # type: ignore[no-untyped-def]
    """Give an open edge of the vertex other than the one the walk came by; -1: none."""
    last = graph.first[vertex] + graph.degree[vertex] - 1
    if graph.degree[vertex] > 0 and graph.edges[last] != came_by:
        return graph.edges[last]
    return graph.edges[last - 1] if graph.degree[vertex] > 1 else -1


@_inner
def _settle(graph, path, begin, length, chance):  # type: ignore[no-untyped-def]
    """Shift what the edges of a path hold, up and down in turn, until one of them is whole."""
    up, down = 1.0, 1.0
    for place in range(begin, length):
        part = graph.parts[path[place]]
        rises = (place - begin) % 2 == 0
        up = min(up, 1.0 - part if rises else part)
        down = min(down, part if rises else 1.0 - part)
    shift = up if chance * (up + down) < down else -down
    for place in range(begin, length):
        edge = path[place]
        part = graph.parts[edge] + (shift if (place - begin) % 2 == 0 else -shift)
        if part < _TINY or part > 1.0 - _TINY:
            part = 0.0 if part < 0.5 else 1.0
            _close(graph, edge)
        graph.parts[edge] = part


@_inner
def _close(graph, edge):  # type: ignore[no-untyped-def]
    """Take an edge that has become whole out of the runs of its two vertices."""
    for side in range(2):
        vertex = graph.ends[side, edge]
        last = graph.first[vertex] + graph.degree[vertex] - 1
        other, place = graph.edges[last], graph.places[side, edge]
        graph.edges[place], graph.edges[last] = other, edge
        graph.places[side, other], graph.places[side, edge] = place, last
        graph.degree[vertex] -= 1
