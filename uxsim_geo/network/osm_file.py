"""The roads of an OpenStreetMap file as arrays and tags, whatever its format and order.

Two passes with osmium: ways and restrictions first, then the nodes that the ways name. Everything
is sorted by id, so that nothing depends on where in the file it stood.
"""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from sys import intern
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from uxsim_geo.errors import Faults
from uxsim_geo.network.osm_guard import checked_format
from uxsim_geo.network.osm_tags import Tags

if TYPE_CHECKING:
    from osmium.io import File
    from osmium.osm.types import Node, Relation, Way

#: node references in one way beyond which it is no road (the map itself allows 2,000)
MOST_NODES = 100_000

#: highways of a file, whatever its size; and beyond that one for so many bytes, packed or not
MOST_WAYS = 200_000
BYTES_OF_A_WAY = 16

#: osmium's coordinates of a node without a place
NOWHERE = 2**31 - 1

#: less than any version
UNSEEN = -1

#: coordinates are whole numbers of so many parts of a degree
PER_DEGREE = 1e7

#: nodes without any of them keep no tags
NODE_TAGS = ("highway", "barrier", "noexit")

Ids = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Restriction:
    """A relation of type restriction: members are (``n``, ``w`` or ``r``, id, role)."""

    id: int
    tags: Tags
    members: tuple[tuple[str, int, str], ...]


@dataclass(frozen=True)
class OsmFile:
    """Roads, the nodes they name and the turn restrictions of a file, each sorted by id.

    way_ids, way_tags
        one a way kept
    first, refs
        way ``i`` names the nodes ``refs[first[i]:first[i + 1]]``; shapes (ways + 1,), (refs,)
    node_ids, x, y
        the nodes named, as far as the file has them; coordinates in 10⁻⁷ degrees
    node_tags
        by node id, of nodes with one of the tags :data:`NODE_TAGS`
    other_way_ids
        those of ``node_ids`` that a way with the tag highway names which is no road here
    dropped
        how many ways with the tag highway are no roads here, by reason
    dropped_ids
        their ids
    """

    way_ids: Ids
    way_tags: list[Tags]
    first: Ids
    refs: Ids
    node_ids: Ids
    x: npt.NDArray[np.int32]
    y: npt.NDArray[np.int32]
    node_tags: dict[int, Tags]
    other_way_ids: Ids
    restrictions: list[Restriction]
    dropped: Counter[str]
    dropped_ids: frozenset[int]


@dataclass
class _Found:
    """What the first pass finds: by id, with the version in front: the newest of several stays.

    most: ways that there may be; ways: version, why it is no road (or empty), nodes, tags;
    restrictions: version, relation.
    """

    most: int
    ways: dict[int, tuple[int, str, array[int], dict[str, str]]] = field(default_factory=dict)
    restrictions: dict[int, tuple[int, Restriction]] = field(default_factory=dict)


class _Ways:
    """Ways that are roads, sorted by id, as in :class:`OsmFile`, and what is kept of the others.

    ``found`` is emptied: names of nodes take most of the memory, and are not needed twice.
    """

    def __init__(self, found: _Found) -> None:
        dropped = {way_id: way[1] for way_id, way in found.ways.items() if way[1]}
        self.dropped, self.dropped_ids = Counter(dropped.values()), frozenset(dropped)
        others = array("q")
        for way_id in dropped:
            others.extend(found.ways.pop(way_id)[2])
        ids = sorted(found.ways)
        counts = [len(found.ways[way_id][2]) for way_id in ids]
        self.tags: list[Tags] = [found.ways[way_id][3] for way_id in ids]
        refs = array("q")
        for way_id in ids:
            refs.extend(found.ways.pop(way_id)[2])
        self.ids, self.refs = np.array(ids, dtype=np.int64), np.array(refs, dtype=np.int64)
        self.first = np.concatenate([[0], np.cumsum(counts, dtype=np.int64)])
        self.nodes = np.unique(self.refs)
        #: at which a road meets a way that is none: a path, steps, a way of another class
        self.nodes_of_others = np.intersect1d(self.nodes, np.array(others, dtype=np.int64))


class _Nodes:
    """What the second pass finds of the nodes with some ids (sorted): place and tags.

    row: of each id; version, x, y: one a node, the version :data:`UNSEEN` where the file has none;
    tags: by id; number: how many the file has.
    """

    def __init__(self, ids: Ids) -> None:
        self.ids = ids
        self.row = {node_id: row for row, node_id in enumerate(ids.tolist())}
        self.version = array("q", [UNSEEN]) * len(ids)
        self.x, self.y = (array("i", [0]) * len(ids) for _ in "xy")
        self.tags: dict[int, Tags] = {}
        self.number = 0


def read_osm_file(
    path: Path,
    reason_to_drop: Callable[[Tags], str | None],
    max_unpacked_mb: float | None,
    progress: Callable[[float], None],
) -> OsmFile:
    """Read what ``reason_to_drop`` (called with the tags of ways that have highway) lets pass.

    ``progress`` is called with the share that is done. Raises
    :class:`uxsim_geo.errors.InputError` for a file that is none, is damaged, or would unpack to
    more than is allowed (see :mod:`uxsim_geo.network.osm_guard`).
    """
    import osmium

    faults = Faults(str(path))
    written = checked_format(path, max_unpacked_mb, faults)
    faults.raise_if_any()
    assert written is not None, "a file without a format is a fault"
    source = osmium.io.File(str(path), written)
    found = _Found(MOST_WAYS + path.stat().st_size // BYTES_OF_A_WAY)
    try:
        _read_ways(source, reason_to_drop, found)
        progress(0.5)
        ways = _Ways(found)
        nodes = _Nodes(ways.nodes)
        _read_nodes(source, nodes, progress)
    except UnicodeDecodeError:
        faults.add("has text that is not UTF-8")
    except (RuntimeError, OSError, ValueError, MemoryError, osmium.InvalidLocationError) as error:
        faults.add(f"cannot be read, it is damaged or cut off: {error}")
    faults.raise_if_any()
    restrictions = [found.restrictions[key][1] for key in sorted(found.restrictions)]
    return _as_arrays(ways, nodes, restrictions)


def _read_ways(source: File, reason_to_drop: Callable[[Tags], str | None], found: _Found) -> None:
    import osmium

    wanted = osmium.osm.WAY | osmium.osm.RELATION
    elements = osmium.FileProcessor(source, wanted).with_filter(
        osmium.filter.KeyFilter("highway", "type")
    )
    for element in elements:
        # osmium's iterator is typed for files of changesets too
        assert isinstance(element, osmium.osm.Way | osmium.osm.Relation)
        if element.deleted:
            continue
        if isinstance(element, osmium.osm.Relation):
            _add_restriction(element, found)
        elif "highway" in element.tags:
            _add_way(element, reason_to_drop, found)


def _add_way(element: Way, reason_to_drop: Callable[[Tags], str | None], found: _Found) -> None:
    # most keys and many values are the same on many ways, and are kept once
    tags = {intern(tag.k): intern(tag.v) for tag in element.tags}
    reason = reason_to_drop(tags) or ""
    tags = {} if reason else tags
    nodes = [node.ref for node in element.nodes]
    if len(nodes) > MOST_NODES and not reason:
        raise ValueError(f"way {element.id} has {len(nodes)} nodes, as no road has")
    way = (element.version, reason, array("q", nodes), tags)
    known = found.ways.get(element.id)
    # files put together from several may have a way twice, in any order
    if known is None or (*known[:3], sorted(known[3].items())) < (*way[:3], sorted(tags.items())):
        found.ways[element.id] = way
    if len(found.ways) > found.most:
        raise ValueError(f"over {found.most:,} ways are more than a file of its size has")


def _add_restriction(element: Relation, found: _Found) -> None:
    if not (element.tags.get("type") or "").startswith("restriction"):
        return
    tags = {tag.k: tag.v for tag in element.tags}
    members = tuple((member.type, member.ref, member.role) for member in element.members)
    found_before = found.restrictions.get(element.id)
    relation = (element.version, Restriction(element.id, tags, members))
    if found_before is None or _rank(*found_before) < _rank(*relation):
        found.restrictions[element.id] = relation


def _rank(version: int, relation: Restriction) -> tuple[object, ...]:
    """By what the newer of two is chosen; between equal versions anything that does not change."""
    return version, sorted(relation.tags.items()), relation.members


def _read_nodes(source: File, nodes: _Nodes, progress: Callable[[float], None]) -> None:
    """Places and tags of the nodes that ways name.

    Osmium's own filter by ids is faster, but takes 400 MB whatever the file, and no negative ids.
    """
    import osmium

    for node in osmium.FileProcessor(source, osmium.osm.NODE):
        row = nodes.row.get(node.id)
        if row is None:
            continue
        assert isinstance(node, osmium.osm.Node)
        if not node.deleted:
            _add_node(node, row, nodes)
        if nodes.number % 50_000 == 0:
            progress((1.0 + nodes.number / len(nodes.ids)) / 2)


def _add_node(node: Node, row: int, nodes: _Nodes) -> None:
    location, tags = node.location, node.tags
    place = (node.version, location.x, location.y)
    known = (nodes.version[row], nodes.x[row], nodes.y[row])
    if location.x == location.y == NOWHERE or known > place:
        return
    if not location.valid():
        where = f"{location.x / PER_DEGREE:g}, {location.y / PER_DEGREE:g}"
        raise ValueError(f"node {node.id} is at {where}, beyond 180 or 90 degrees")
    told = {tag.k: tag.v for tag in tags} if any(key in tags for key in NODE_TAGS) else {}
    if known == place and sorted(nodes.tags.get(node.id, {}).items()) > sorted(told.items()):
        return
    nodes.number += known[0] == UNSEEN
    nodes.version[row], nodes.x[row], nodes.y[row] = place
    nodes.tags.pop(node.id, None)
    if told:
        nodes.tags[node.id] = told


def _as_arrays(ways: _Ways, nodes: _Nodes, restrictions: list[Restriction]) -> OsmFile:
    there = np.array(nodes.version, dtype=np.int64) != UNSEEN
    node_ids = nodes.ids[there]
    return OsmFile(
        way_ids=ways.ids,
        way_tags=ways.tags,
        first=ways.first,
        refs=ways.refs,
        node_ids=node_ids,
        x=np.array(nodes.x, dtype=np.int32)[there],
        y=np.array(nodes.y, dtype=np.int32)[there],
        node_tags=nodes.tags,
        other_way_ids=np.intersect1d(node_ids, ways.nodes_of_others),
        restrictions=restrictions,
        dropped=ways.dropped,
        dropped_ids=ways.dropped_ids,
    )
