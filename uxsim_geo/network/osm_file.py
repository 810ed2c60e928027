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

#: osmium's coordinates of a node without a place
NOWHERE = 2**31 - 1

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
    """What the passes find: by id, with the version in front, so that the newest of several stays.

    ways: version, why it is no road (or empty), nodes, tags; restrictions: version, relation;
    nodes: version, x, y.
    """

    ways: dict[int, tuple[int, str, array[int], dict[str, str]]] = field(default_factory=dict)
    restrictions: dict[int, tuple[int, Restriction]] = field(default_factory=dict)
    nodes: dict[int, tuple[int, int, int]] = field(default_factory=dict)
    node_tags: dict[int, Tags] = field(default_factory=dict)


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
    found = _Found()
    try:
        _read_ways(source, reason_to_drop, found)
        _read_nodes(source, found, progress)
    except UnicodeDecodeError:
        faults.add("has text that is not UTF-8")
    except (RuntimeError, OSError, ValueError, MemoryError, osmium.InvalidLocationError) as error:
        faults.add(f"cannot be read, it is damaged or cut off: {error}")
    faults.raise_if_any()
    return _as_arrays(found)


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


def _read_nodes(source: File, found: _Found, progress: Callable[[float], None]) -> None:
    """Places and tags of the nodes that ways name.

    Osmium's own filter by ids is faster, but takes 400 MB whatever the file, and no negative ids.
    """
    import osmium

    progress(0.5)
    wanted = {ref for _, reason, refs, _ in found.ways.values() if not reason for ref in refs}
    for node in osmium.FileProcessor(source, osmium.osm.NODE):
        if node.id not in wanted:
            continue
        assert isinstance(node, osmium.osm.Node)
        if not node.deleted:
            _add_node(node, found)
        if len(found.nodes) % 50_000 == 0:
            progress((1.0 + len(found.nodes) / len(wanted)) / 2)


def _add_node(node: Node, found: _Found) -> None:
    location, tags = node.location, node.tags
    place = (node.version, location.x, location.y)
    known = found.nodes.get(node.id)
    if location.x == location.y == NOWHERE or (known is not None and known > place):
        return
    if not location.valid():
        where = f"{location.x / PER_DEGREE:g}, {location.y / PER_DEGREE:g}"
        raise ValueError(f"node {node.id} is at {where}, beyond 180 or 90 degrees")
    told = {tag.k: tag.v for tag in tags} if any(key in tags for key in NODE_TAGS) else {}
    if known == place and sorted(found.node_tags.get(node.id, {}).items()) > sorted(told.items()):
        return
    found.nodes[node.id] = place
    found.node_tags.pop(node.id, None)
    if told:
        found.node_tags[node.id] = told


def _as_arrays(found: _Found) -> OsmFile:
    way_ids = sorted(way_id for way_id, way in found.ways.items() if not way[1])
    counts = [len(found.ways[way_id][2]) for way_id in way_ids]
    refs = array("q")
    for way_id in way_ids:
        refs.extend(found.ways[way_id][2])
    node_ids = np.array(sorted(found.nodes), dtype=np.int64)
    places = [found.nodes[node_id] for node_id in node_ids.tolist()]
    dropped = {way_id: way[1] for way_id, way in found.ways.items() if way[1]}
    return OsmFile(
        way_ids=np.array(way_ids, dtype=np.int64),
        way_tags=[found.ways[way_id][3] for way_id in way_ids],
        first=np.concatenate([[0], np.cumsum(counts, dtype=np.int64)]),
        refs=np.array(refs, dtype=np.int64),
        node_ids=node_ids,
        x=np.array([x for _, x, _ in places], dtype=np.int32),
        y=np.array([y for _, _, y in places], dtype=np.int32),
        node_tags=found.node_tags,
        other_way_ids=_named_elsewhere(node_ids, found),
        restrictions=[found.restrictions[key][1] for key in sorted(found.restrictions)],
        dropped=Counter(dropped.values()),
        dropped_ids=frozenset(dropped),
    )


def _named_elsewhere(node_ids: Ids, found: _Found) -> Ids:
    """Nodes at which a road meets a way that is none: a path, steps, a way of another class."""
    refs = array("q")
    for _, reason, nodes, _ in found.ways.values():
        if reason:
            refs.extend(nodes)
    return np.intersect1d(node_ids, np.array(refs, dtype=np.int64))
