"""OpenStreetMap files read plainly, to be counted without any of the reader's own code."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from pathlib import Path

import osmium

CLASSES = {
    f"{name}{link}"
    for name in ("motorway", "trunk", "primary", "secondary", "tertiary")
    for link in ("", "_link")
} | {"unclassified", "residential", "living_street", "road"}

#: values that keep cars out, of all that occur in the files
CLOSED = {
    *("no", "private", "permit", "residents", "delivery", "agricultural", "forestry", "psv"),
    *("military", "emergency", "bus", "taxi", "official_vehicles", "staff", "permissive_no"),
}

#: kinds of barriers that keep cars out, of all that stand on roads in the files
SHUT = {"block", "bollard", "chain", "cycle_barrier", "fence", "jersey_barrier", "log", "wall"}

Tags = dict[str, str]


@dataclass
class Raw:
    """Nodes to longitude and latitude, their tags; drivable ways; all highway ways' ids."""

    places: dict[int, tuple[float, float]] = field(default_factory=dict)
    node_tags: dict[int, Tags] = field(default_factory=dict)
    barriers: dict[int, Tags] = field(default_factory=dict)
    ways: dict[int, tuple[list[int], Tags]] = field(default_factory=dict)
    relations: dict[int, tuple[Tags, list[tuple[str, int, str]]]] = field(default_factory=dict)

    def pieces(self, way: int) -> list[tuple[int, int]]:
        """Neighbouring nodes along a way, where the file has both."""
        nodes = self.ways[way][0]
        return [
            (a, b) for a, b in pairwise(nodes) if a != b and a in self.places and b in self.places
        ]

    def km(self, way: int) -> float:
        """Length of a way on a sphere."""
        return sum(self._distance_km(a, b) for a, b in self.pieces(way))

    def _distance_km(self, a: int, b: int) -> float:
        (x, y), (u, v) = (map(math.radians, self.places[node]) for node in (a, b))
        half = math.sin((v - y) / 2) ** 2 + math.cos(y) * math.cos(v) * math.sin((u - x) / 2) ** 2
        return 2 * 6371.0088 * math.asin(math.sqrt(half))

    @cached_property
    def neighbours(self) -> dict[int, set[int]]:
        """Nodes that a piece of road ties to each node."""
        found: dict[int, set[int]] = defaultdict(set)
        for way in self.ways:
            for a, b in self.pieces(way):
                found[a].add(b)
                found[b].add(a)
        return found

    @cached_property
    def km_by_class(self) -> Counter[str]:
        """Length of the roads of each class, one way or both."""
        lengths: Counter[str] = Counter()
        for way, (_, tags) in self.ways.items():
            lengths[tags["highway"]] += self.km(way)  # type: ignore[assignment]
        return lengths


def is_oneway(tags: Tags) -> bool:
    """Whether a road may be driven one way only, as far as the files say it."""
    said = next(
        (tags[key] for key in ("oneway:motor_vehicle", "oneway") if key in tags),
        "yes" if tags.get("junction") in ("roundabout", "circular") else "",
    )
    if not said and tags["highway"] == "motorway":
        said = "yes"
    closed = [
        tags.get(f"{key}:{side}") in CLOSED
        for key in ("motor_vehicle", "vehicle", "access")
        for side in ("forward", "backward")
    ]
    return said in ("yes", "true", "1", "-1", "reverse") or any(closed)


def is_shut(tags: Tags) -> bool:
    """Whether a barrier keeps cars out: as it says itself, else by its kind."""
    for key in ("motorcar", "motor_vehicle", "vehicle", "access"):
        if key in tags:
            return tags[key] in CLOSED
    if tags.get("bollard") == "rising":
        return False
    return tags["barrier"] in SHUT or tags.get("locked") == "yes"


def is_drivable(tags: Tags) -> bool:
    """Whether a way is a public road for cars."""
    if tags.get("highway") not in CLASSES or tags.get("area") == "yes":
        return False
    if "yes" in [tags.get(key) for key in ("construction", "proposed", "disused", "abandoned")]:
        return False
    for key in ("motorcar", "motor_vehicle", "vehicle", "access"):
        if key in tags:
            return any(part not in CLOSED for part in tags[key].split(";"))
    return True


def read_raw(path: Path) -> Raw:
    """Everything that is counted, element by element."""
    raw = Raw()
    for element in osmium.FileProcessor(str(path)):
        if element.is_node():
            raw.places[element.id] = (element.location.lon, element.location.lat)
            if "highway" in element.tags:
                raw.node_tags[element.id] = _tags(element)
            if "barrier" in element.tags:
                raw.barriers[element.id] = _tags(element)
        elif element.is_way():
            if is_drivable(tags := _tags(element)):
                raw.ways[element.id] = ([node.ref for node in element.nodes], tags)
        elif (tags := _tags(element)).get("type", "").startswith("restriction"):
            members = [(member.type, member.ref, member.role) for member in element.members]
            raw.relations[element.id] = (tags, members)
    return raw


def _tags(element: object) -> Tags:
    return {tag.k: tag.v for tag in element.tags}  # type: ignore[attr-defined]
