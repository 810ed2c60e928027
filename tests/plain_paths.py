"""Shortest paths that obey banned turns, found in the plainest way, to hold others against.

A state is the node one is at and the last links one has driven, as many as the longest ban needs.
"""

from __future__ import annotations

import heapq
from collections.abc import Collection, Mapping, Sequence

from small_networks import Row

#: link_ids one after the other
Way = tuple[str, ...]


def is_legal(route: Sequence[str], banned: Collection[Way]) -> bool:
    """Whether a route holds none of the banned paths."""
    return not any(
        tuple(route[place : place + len(way)]) == tuple(way)
        for way in banned
        for place in range(len(route))
    )


def best_routes(
    links: Sequence[Row],
    banned: Collection[Way],
    cost: Mapping[str, float],
    origin: str,
    *,
    no_through: Collection[str] = (),
) -> dict[str, tuple[float, Way]]:
    """Least sum of the costs of links from a node to every other one that can be reached, and how.

    Paths pass no node of ``no_through``.
    """
    remembered = max((len(way) - 1 for way in banned), default=0)
    best: dict[str, tuple[float, Way]] = {}
    seen: set[tuple[str, Way]] = set()
    heap: list[tuple[float, Way, str]] = [(0.0, (), origin)]
    while heap:
        distance, route, node = heapq.heappop(heap)
        state = (node, route[len(route) - remembered :] if remembered else ())
        if state in seen:
            continue
        seen.add(state)
        best.setdefault(node, (distance, route))
        if route and node in no_through:
            continue
        for link in links:
            if link["from_node_id"] == node and is_legal((*route, link["link_id"]), banned):
                further = distance + cost[link["link_id"]]
                heapq.heappush(heap, (further, (*route, link["link_id"]), link["to_node_id"]))
    return best
