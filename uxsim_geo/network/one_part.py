"""Whether a network is one part, as most are: then nothing has to be known of its parts."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Rows = npt.NDArray[np.integer]


def is_one_part(start: Rows, end: Rows, nodes: int) -> bool:
    """Tell whether every node reaches every other along links from ``start`` to ``end``.

    Whoever needs the parts has scipy, which takes longer to load than this takes for a city.
    """
    return _leads_to_all(start, end, nodes) and _leads_to_all(end, start, nodes)


def _leads_to_all(start: Rows, end: Rows, nodes: int) -> bool:
    """Tell whether one comes from node 0 to every other."""
    ends_from: list[list[int]] = [[] for _ in range(nodes)]
    for one, other in zip(start.tolist(), end.tolist(), strict=True):
        ends_from[one].append(other)
    reached = set(range(min(nodes, 1)))
    to_visit = list(reached)
    while to_visit:
        new = set(ends_from[to_visit.pop()]) - reached
        reached |= new
        to_visit += new
    return len(reached) == nodes
