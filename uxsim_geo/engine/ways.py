"""From the paths of a network to the vertices and arcs of the engine."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from uxsim_geo.engine import records
from uxsim_geo.network.paths import Ints, Paths

Records = npt.NDArray[Any]


def vertex_records(paths: Paths) -> Records:
    """Make the vertices, and one more, whose arcs would begin where the last one's end."""
    vertices = paths.node.size
    vertex = np.zeros(vertices + 1, records.VERTEX)
    numbers = np.arange(vertices + 1)
    vertex["first_out"] = np.searchsorted(paths.tail, numbers)
    vertex["first_in"] = np.searchsorted(np.sort(paths.head, kind="stable"), numbers)
    vertex["others"][paths.first[:-1]] = np.diff(paths.first) - 1
    vertex["rank"][:-1] = numbers[:-1] - paths.first[paths.node]
    return vertex


def arc_records(paths: Paths, row_of_link: Ints) -> tuple[Records, Records]:
    """Make the arcs, by where they start and by where they lead.

    ``row_of_link`` are the rows of the links table in the order of the engine.
    """
    by_head = np.argsort(paths.head, kind="stable")
    arc = np.zeros(paths.tail.size, records.ARC)
    arc["link"] = np.argsort(row_of_link)[paths.link]
    arc["head"] = paths.head
    arc["place"][by_head] = np.arange(by_head.size)
    incoming = np.zeros(paths.tail.size, records.INCOMING)
    incoming["arc"] = by_head
    incoming["tail"] = paths.tail[by_head]
    return arc, incoming
