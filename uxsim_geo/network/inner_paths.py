"""The ways through a junction of several nodes: which are open, how long and how slow."""

from __future__ import annotations

from dataclasses import dataclass, field
from heapq import heappop, heappush

import numpy as np

from uxsim_geo.network.incidence import Ends, Rows, turns_of, twins_of
from uxsim_geo.network.long_bans import LongBans, Path
from uxsim_geo.network.network import Network
from uxsim_geo.network.rows import numbers
from uxsim_geo.network.u_turns import needless

#: rows of a first and a last link
Pair = tuple[int, int]


class CannotMergeError(Exception):
    """Why a junction is left as it is."""


@dataclass(frozen=True)
class Streets:
    """Links and bans as lists, for the search from node to node.

    twin
        row of the way back along each link, -1 where there is none
    leaving, arriving
        rows of the links that start, and end, at each node
    first, after
        the links that may follow link l are ``after[first[l]:first[l + 1]]``
    """

    start: list[int]
    end: list[int]
    length: list[float]
    time: list[float]
    twin: list[int]
    leaving: list[list[int]]
    arriving: list[list[int]]
    first: list[int]
    after: list[int]
    long_bans: LongBans

    def open_from(self, link: int) -> list[int]:
        """Rows of the links that may follow a link, as far as that depends on it alone."""
        return self.after[self.first[link] : self.first[link + 1]]


@dataclass
class Junction:
    """A junction of several nodes.

    nodes, inner
        rows of nodes, and of links between them
    approaches, exits
        rows of links into it and out of it
    ways
        by approach and exit: length (m) and free-flow time (s) of the shortest open way between
        them, each the least of its own; turning back at once is no way, save at dead ends
    """

    nodes: frozenset[int]
    inner: frozenset[int]
    approaches: list[int]
    exits: list[int]
    ways: dict[Pair, tuple[float, float]] = field(default_factory=dict)


def streets_of(network: Network, ends: Ends) -> Streets:
    """Put a network into lists."""
    length = numbers(network.links["length"])
    time = length / numbers(network.links["free_speed"])
    turns = turns_of(network, ends)
    allowed = ~turns.banned & ~needless(network, ends, turns)
    first = np.searchsorted(turns.before[allowed], np.arange(len(length) + 1))
    return Streets(
        ends.start.tolist(),
        ends.end.tolist(),
        length.tolist(),
        time.tolist(),
        twins_of(network, ends).tolist(),
        _rows_by(ends.start, ends.nodes),
        _rows_by(ends.end, ends.nodes),
        first.tolist(),
        turns.after[allowed].tolist(),
        LongBans.of(network),
    )


def _rows_by(node: Rows, nodes: int) -> list[list[int]]:
    order = np.argsort(node, kind="stable")
    bounds = np.searchsorted(node[order], np.arange(1, nodes))
    return [rows.tolist() for rows in np.split(order, bounds)]


def junction_of(nodes: Rows, streets: Streets) -> Junction:
    """The links around and within a junction, with the open ways through it.

    Raises :class:`CannotMergeError` where a ban over several links goes on outside.
    """
    within = frozenset(nodes.tolist())
    arriving = [link for node in nodes.tolist() for link in streets.arriving[node]]
    leaving = [link for node in nodes.tolist() for link in streets.leaving[node]]
    inner = frozenset(link for link in leaving if streets.end[link] in within)
    junction = Junction(
        within,
        inner,
        [link for link in arriving if link not in inner],
        [link for link in leaving if link not in inner],
    )
    _check_long_bans(junction, streets)
    for approach in junction.approaches:
        lengths = _walk(approach, junction, streets, streets.length)
        times = _walk(approach, junction, streets, streets.time)
        junction.ways.update({(approach, b): (lengths[b], times[b]) for b in lengths})
    return junction


def _check_long_bans(junction: Junction, streets: Streets) -> None:
    for link in junction.inner & streets.long_bans.of_link.keys():
        for path in streets.long_bans.of_link[link]:
            if not junction.inner.issuperset(path[1:-1]):
                raise CannotMergeError("a ban over several links goes on outside")


def _walk(
    approach: int, junction: Junction, streets: Streets, cost: list[float]
) -> dict[int, float]:
    """Least cost of the ways from an approach to each exit, over links between (Dijkstra)."""
    done: set[Path] = set()
    found: dict[int, float] = {}
    unfinished: list[tuple[float, Path]] = [(0.0, (approach,))]
    while unfinished:
        covered, state = heappop(unfinished)
        if state in done:
            continue
        done.add(state)
        for link in streets.open_from(state[-1]):
            onward = streets.long_bans.onward(state, link)
            if onward is None:
                continue
            if link in junction.inner:
                heappush(unfinished, (covered + cost[link], onward))
            else:
                found.setdefault(link, covered)
    return found
