"""Shortest ways that keep to the bans: links are the places, permitted turns the steps.

A ban over several links holds for those who came along them, so such a link is there once more
for each beginning of a ban that may lie behind one, see :mod:`uxsim_geo.network.long_bans`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from uxsim_geo.network.incidence import Ends, Flags, Floats, Rows, Turns, ends_of, turns_of
from uxsim_geo.network.long_bans import LongBans, Path
from uxsim_geo.network.network import Network
from uxsim_geo.network.u_turns import needless


@dataclass(frozen=True)
class TurnGraph:
    """Steps from place to place; places are links, then states, then nodes to start from.

    link
        row of the link of each link and state; (links + states,)
    before, after
        places of each step
    """

    ends: Ends
    link: Rows
    before: Rows
    after: Rows


def turn_graph(network: Network) -> TurnGraph:
    """The permitted turns; turning back is one only where :func:`needless` does not say so."""
    ends = ends_of(network)
    turns = turns_of(network, ends)
    allowed = ~turns.banned & ~needless(network, ends, turns)
    bans = LongBans.of(network)
    states = sorted(bans.states)
    place = {path: len(ends.start) + number for number, path in enumerate(states)}
    replaced = _first_steps(turns, allowed, place)
    before, after = turns.before[allowed], turns.after[allowed].copy()
    for row, state in replaced:
        after[row] = state
    steps = _steps_of_states(place, bans, before, turns.after[allowed])
    link = np.array([*range(len(ends.start)), *(path[-1] for path in states)], dtype=np.int64)
    starts = len(link) + ends.start
    return TurnGraph(
        ends,
        link,
        np.concatenate([before, steps[:, 0], starts]),
        np.concatenate([after, steps[:, 1], np.arange(len(ends.start))]),
    )


def _first_steps(turns: Turns, allowed: Flags, place: dict[Path, int]) -> list[tuple[int, int]]:
    """Steps that begin a ban: their rows among those allowed, and the state they lead to."""
    before, after = turns.before[allowed], turns.after[allowed]
    found: list[tuple[int, int]] = []
    for path in place:
        if len(path) == 2:
            rows = np.flatnonzero((before == path[0]) & (after == path[1]))
            found.extend((int(row), place[path]) for row in rows)
    return found


def _steps_of_states(place: dict[Path, int], bans: LongBans, before: Rows, after: Rows) -> Rows:
    """Steps from states: to the state of what lies behind one then, or to the plain link."""
    steps = []
    for state, number in place.items():
        low, high = np.searchsorted(before, [state[-1], state[-1] + 1])
        for link in after[low:high].tolist():
            onward = bans.onward(state, link)
            if onward is not None:
                steps.append((number, place.get(onward, link)))
    return np.array(steps, dtype=np.int64).reshape(-1, 2)


def shortest(
    graph: TurnGraph, cost: Floats, origins: Rows, limit: float = np.inf
) -> Iterator[Floats]:
    """Costs of the shortest ways from each of some nodes to all, in turn; (nodes,) each.

    ``cost``: of each link, above 0. Infinite where no way leads, or none up to the limit.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import dijkstra

    links = len(graph.link)
    places = links + graph.ends.nodes
    weights = cost[graph.link[graph.after]]
    steps: Any = csr_array((weights, (graph.before, graph.after)), shape=(places, places))
    node = graph.ends.end[graph.link]
    order = np.argsort(node, kind="stable")
    known = np.unique(node)
    begin = np.searchsorted(node[order], known)
    for origin in origins.tolist():
        found = dijkstra(steps, indices=links + origin, limit=limit)
        least = np.full(graph.ends.nodes, np.inf)
        least[known] = np.minimum.reduceat(found[:links][order], begin)
        least[origin] = 0.0
        yield least
