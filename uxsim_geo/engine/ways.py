"""From the paths of a network to the vertices and arcs of the engine."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from uxsim_geo.engine import records
from uxsim_geo.network.paths import Ints, Paths

Records = npt.NDArray[Any]


def vertex_records(paths: Paths, arc: Records, incoming: Records) -> Records:
    """Make the vertices, and one more, whose arcs would begin where the last one's end."""
    vertex = np.zeros(paths.node.size + 1, records.VERTEX)
    numbers = np.arange(vertex.size)
    vertex["first_out"] = np.searchsorted(paths.tail, numbers)
    vertex["first_in"] = np.searchsorted(paths.head[incoming["arc"]], numbers)
    leads_on = np.unique(paths.tail)
    first = paths.first[paths.node[leads_on]]
    np.maximum.at(vertex["others"], first, (leads_on - first).astype(np.int16))
    vertex["barred"] = _barred(paths, arc, vertex)
    return vertex


def _barred(paths: Paths, arc: Records, vertex: Records) -> npt.NDArray[np.int32]:
    """Mark the arcs that do not lead where that of the first vertex of the node leads, as bits."""
    unlike = np.flatnonzero(arc["alike"] == 0)
    tail = paths.tail[unlike]
    bit = np.minimum(1 + unlike - vertex["first_out"][tail], 31).astype(np.uint32)
    bits = np.zeros(vertex.size, np.uint32)
    np.bitwise_or.at(bits, tail, np.uint32(1) << bit)
    return bits.view(np.int32)


def arc_records(paths: Paths, row_of_link: Ints) -> Records:
    """Make the arcs; ``row_of_link`` are the rows of the links table in the order of the engine."""
    arc = np.zeros(paths.tail.size, records.ARC)
    arc["link"] = np.argsort(row_of_link)[paths.link]
    arc["head"] = paths.head
    arc["cost"] = records.UNREACHED
    usual = np.flatnonzero(_is_of_first(paths))
    of_link = np.empty(paths.start.size, np.int64)  # every link has just one arc of a first vertex
    of_link[paths.link[usual]] = usual
    like = of_link[paths.link]
    arc["alike"] = paths.head == paths.head[like]
    np.minimum.at(arc["alike"], like, arc["alike"])
    return arc


def incoming_records(paths: Paths, arc: Records) -> Records:
    """Make the arcs as the search for ways needs them, ordered by where they lead.

    Those that lead where the one of the first vertex of their node leads are left out: the search
    tells the others of a node when it comes to that one.
    """
    kept = (paths.head >= 0) & (_is_of_first(paths) | (arc["alike"] == 0))
    by_head = np.flatnonzero(kept)[np.argsort(paths.head[kept], kind="stable")]
    incoming = np.zeros(by_head.size, records.INCOMING)
    incoming["arc"] = by_head
    incoming["tail"] = paths.tail[by_head]
    incoming["head"] = paths.head[by_head]
    return incoming


def _is_of_first(paths: Paths) -> npt.NDArray[np.bool_]:
    """Say which arcs start at the first vertex of a node; shape (arcs,)."""
    first: npt.NDArray[np.bool_] = paths.tail == paths.first[paths.node[paths.tail]]
    return first
