"""Where a turn restriction lies on the roads: rows of links one after the other."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

from uxsim_geo.network.osm_junctions import Junctions
from uxsim_geo.network.osm_relations import RestrictionError, Turn

#: rows of links: from, those between, to
Path = tuple[int, ...]

#: links of the ways between, ends of ways at them and links tried, after which a restriction is
#: given up: no road needs as many, and a file made to do harm may ask for a great deal more
MOST_BETWEEN, MOST_STARTS, MOST_TRIED = 500, 50, 500

#: degrees within which a turn is what its restriction calls it
ANGLES = {
    "left_turn": (15.0, 175.0),
    "right_turn": (-175.0, -15.0),
    "straight_on": (-50.0, 50.0),
}


def paths_of(turn: Turn, node: int | None, junctions: Junctions) -> list[Path]:
    """The paths from the turn's first way to its last, over the row of a node or over ways.

    Raises :class:`RestrictionError` where the roads do not meet, where traffic cannot take the
    path, or where several could be meant.
    """
    paths = []
    for from_way, to_way in product(turn.from_ways, turn.to_ways):
        if node is None:
            paths.append(_over_ways(turn, from_way, to_way, junctions))
        else:
            paths.extend(_over_node(turn, node, (from_way, to_way), junctions))
    return paths


def _over_node(turn: Turn, node: int, ways: tuple[int, int], junctions: Junctions) -> list[Path]:
    from_links, to_links = (junctions.of(way) for way in ways)
    arriving = junctions.arriving(from_links, node)
    leaving = junctions.departing(to_links, node)
    for way, links, found in ((ways[0], from_links, arriving), (ways[1], to_links, leaving)):
        if not found and node not in junctions.nodes_of(links):
            raise RestrictionError("broken restriction", f"way {way} does not come to its node")
    pairs: list[Path] = list(product(arriving, leaving))
    if not pairs:
        raise RestrictionError("restriction without effect", "one-way roads ban it already")
    if turn.kind.endswith("u_turn") and ways[0] == ways[1]:
        return [pair for pair in pairs if junctions.back(*pair)]
    if len(pairs) > 1:
        pairs = _as_named(turn, pairs, junctions)
    if len(pairs) != 1:
        raise RestrictionError(
            "broken restriction", "its ways go on beyond its node, to either side"
        )
    return pairs


def _as_named(turn: Turn, pairs: list[Path], junctions: Junctions) -> list[Path]:
    """The pairs that turn as the restriction says, where a way goes on beyond its place."""
    low, high = ANGLES.get(turn.kind.partition("_")[2], (-180.0, 180.0))
    return [pair for pair in pairs if low <= junctions.angle(pair[0], pair[1]) <= high]


def _over_ways(turn: Turn, from_way: int, to_way: int, junctions: Junctions) -> Path:
    between = _between(turn, junctions)
    from_links, to_links = junctions.of(from_way), junctions.of(to_way)
    nodes = {node for link in between for node in (junctions.start(link), junctions.end(link))}
    for way, links in ((from_way, from_links), (to_way, to_links)):
        if junctions.nodes_of(links).isdisjoint(nodes):
            what = f"way {way} does not come to the ways between"
            raise RestrictionError("broken restriction", what)
    starts = [link for link in from_links if junctions.end(link) in nodes]
    if len(starts) > MOST_STARTS:
        raise RestrictionError("broken restriction", "its ways meet in too many places")
    found: list[Path] = []
    for link in starts:
        found.extend(_walks(link, between, frozenset(to_links), junctions))
    if not found:
        raise RestrictionError("restriction without effect", "no traffic can take its way")
    if len(found) > 1:
        raise RestrictionError("broken restriction", "several ways through it could be meant")
    return found[0]


def _between(turn: Turn, junctions: Junctions) -> dict[int, int]:
    """Rows of the links of the ways between, and which way each is of."""
    links = {way: junctions.of(way) for way in turn.via_ways}
    if sum(map(len, links.values())) > MOST_BETWEEN:
        raise RestrictionError("broken restriction", "the ways between have too many junctions")
    return {link: way for way, found in links.items() for link in found}


def _walks(
    link: int, between: dict[int, int], to_links: frozenset[int], junctions: Junctions
) -> Iterator[Path]:
    """Paths from a link over all the ways between to one of the last links, turning nowhere."""
    ways = set(between.values())
    unfinished: list[Path] = [(link,)]
    for _ in range(MOST_TRIED):
        if not unfinished:
            return
        path = unfinished.pop()
        covered = {between[row] for row in path[1:]}
        for onward in junctions.from_node(junctions.end(path[-1])):
            if onward in to_links and covered == ways:
                yield (*path, onward)
            elif onward in between and onward not in path and not junctions.back(path[-1], onward):
                unfinished.append((*path, onward))
    raise RestrictionError("broken restriction", "the ways between have too many branches")
