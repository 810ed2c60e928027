"""The ways through a junction of several nodes: which are open, how long and how slow."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from uxsim_geo.network.incidence import Ends, Rows, twins_of
from uxsim_geo.network.network import Network
from uxsim_geo.network.rows import numbers

#: so many ways in from one approach are tried; a junction with more is no junction
MOST_TRIED = 2000

#: rows of a first and a last link
Pair = tuple[int, int]


class CannotMergeError(Exception):
    """Why a junction is left as it is."""


@dataclass(frozen=True)
class Streets:
    """Links and bans as lists, for the search from node to node.

    leaving, arriving
        rows of the links that start, and end, at each node
    bans
        pairs of links that must not follow one another
    long_bans
        by the last link: paths of three or more links that must not be driven
    """

    start: list[int]
    end: list[int]
    length: list[float]
    time: list[float]
    twin: list[int]
    leaving: list[list[int]]
    arriving: list[list[int]]
    bans: set[Pair]
    long_bans: dict[int, list[tuple[int, ...]]]


@dataclass
class Junction:
    """A junction of several nodes.

    nodes, inner
        rows of nodes, and of links between them
    approaches, exits
        rows of links into it and out of it
    ways
        by approach and exit: length (m) and free-flow time (s) of the shortest open way between
        them, each the least of its own
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
    bans, long_bans = _bans_of(network)
    return Streets(
        ends.start.tolist(),
        ends.end.tolist(),
        length.tolist(),
        time.tolist(),
        twins_of(network, ends).tolist(),
        _rows_by(ends.start, ends.nodes),
        _rows_by(ends.end, ends.nodes),
        bans,
        long_bans,
    )


def _rows_by(node: Rows, nodes: int) -> list[list[int]]:
    order = np.argsort(node, kind="stable")
    bounds = np.searchsorted(node[order], np.arange(1, nodes))
    return [rows.tolist() for rows in np.split(order, bounds)]


def _bans_of(network: Network) -> tuple[set[Pair], dict[int, list[tuple[int, ...]]]]:
    row = {link_id: row for row, link_id in enumerate(network.links["link_id"])}
    bans: set[Pair] = set()
    long_bans: dict[int, list[tuple[int, ...]]] = defaultdict(list)
    for path in ban_paths(network.movements):
        rows = tuple(row[link_id] for link_id in path)
        if len(rows) == 2:
            bans.add((rows[0], rows[1]))
        else:
            long_bans[rows[-1]].append(rows)
    return bans, dict(long_bans)


def ban_paths(movements: pd.DataFrame) -> list[tuple[str, ...]]:
    """Ids of the links that each ban names, from the first to the last."""
    has_via = "via_link_ids" in movements
    via = movements["via_link_ids"].fillna("") if has_via else [""] * len(movements)
    columns = (movements["from_link_id"], via, movements["to_link_id"])
    return [
        (first, *between.split(), last) for first, between, last in zip(*columns, strict=True)
    ]


def junction_of(nodes: Rows, streets: Streets) -> Junction:
    """The links around and within a junction, with the open ways through it.

    Raises :class:`CannotMergeError` where there are too many ways, or where a ban over several
    links begins, ends or goes on outside.
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
        _walk(approach, junction, streets)
    return junction


def _check_long_bans(junction: Junction, streets: Streets) -> None:
    around = set(junction.exits) | junction.inner
    for last in around & streets.long_bans.keys():
        for path in streets.long_bans[last]:
            _check_long_ban(path, junction)
    outside = [path for paths in streets.long_bans.values() for path in paths]
    for path in outside:
        if not junction.inner.isdisjoint(path):
            _check_long_ban(path, junction)


def _check_long_ban(path: tuple[int, ...], junction: Junction) -> None:
    if junction.inner.isdisjoint(path):
        return
    if not junction.inner.issuperset(path[1:-1]):
        raise CannotMergeError("a ban over several links goes on outside")


def _walk(approach: int, junction: Junction, streets: Streets) -> None:
    """Find the ways from an approach to all exits, over every inner node at most once."""
    unfinished: list[tuple[tuple[int, ...], float, float]] = [((approach,), 0.0, 0.0)]
    tried = 0
    while unfinished:
        path, length, time = unfinished.pop()
        tried += 1
        if tried > MOST_TRIED:
            raise CannotMergeError("there are too many ways through it")
        seen = {streets.end[link] for link in path}
        for link in streets.leaving[streets.end[path[-1]]]:
            if _banned(path, link, streets):
                continue
            if link not in junction.inner:
                known = junction.ways.get((approach, link), (length, time))
                best = min(known[0], length), min(known[1], time)
                junction.ways[approach, link] = best
            elif streets.end[link] not in seen:
                onward = length + streets.length[link], time + streets.time[link]
                unfinished.append(((*path, link), *onward))


def _banned(path: tuple[int, ...], link: int, streets: Streets) -> bool:
    if (path[-1], link) in streets.bans:
        return True
    whole = (*path, link)
    return any(whole[-len(ban) :] == ban for ban in streets.long_bans.get(link, ()))
