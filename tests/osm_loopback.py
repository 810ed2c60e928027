"""A server on this computer that answers as Nominatim and Overpass do, from a small map."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import parse_qs

from loopback import Reply, serving
from shapely.geometry import LineString, Polygon, box, mapping

DATE = "2025-03-01T12:00:00Z"


def node(number: int, lon: float, lat: float, **tags: str) -> dict[str, Any]:
    found: dict[str, Any] = {"type": "node", "id": number, "lat": lat, "lon": lon}
    return found | ({"tags": tags} if tags else {})


def way(number: int, nodes: list[int], highway: str, **tags: str) -> dict[str, Any]:
    return {"type": "way", "id": number, "nodes": nodes, "tags": {"highway": highway} | tags}


#: a town round 50° 8°, and one road far from it
TOWN: list[dict[str, Any]] = [
    node(1, 8.000, 50.000),
    node(2, 8.010, 50.000, highway="traffic_signals"),
    node(3, 8.020, 50.000),
    node(4, 8.010, 50.005),
    node(5, 8.020, 50.005),
    node(8, 8.100, 50.100),
    node(9, 8.110, 50.100),
    way(10, [1, 2], "primary", maxspeed="50", name='Straße "A" & <B>'),
    way(11, [2, 4], "residential"),
    way(12, [4, 5], "service"),
    way(13, [2, 3], "primary"),
    way(15, [8, 9], "residential"),
    {
        "type": "relation",
        "id": 20,
        "members": [
            {"type": "way", "ref": 10, "role": "from"},
            {"type": "node", "ref": 2, "role": "via"},
            {"type": "way", "ref": 11, "role": "to"},
        ],
        "tags": {"type": "restriction", "restriction": "no_left_turn"},
    },
    {"type": "relation", "id": 21, "members": [], "tags": {"type": "restriction"}},
]

#: west, south, east, north of the town without the far road
TOWN_BOX = (7.99, 49.99, 8.03, 50.01)


def match(name: str, shape: dict[str, Any], importance: float) -> dict[str, Any]:
    return {
        "place_id": 1,
        "osm_type": "relation",
        "osm_id": 1,
        "lat": "50.0",
        "lon": "8.0",
        "importance": importance,
        "display_name": name,
        "boundingbox": ["49.99", "50.01", "7.99", "8.03"],
        "geojson": shape,
    }


_TOWN_SHAPE = mapping(box(*TOWN_BOX))
_POINT = {"type": "Point", "coordinates": [8.0, 50.0]}

#: what Nominatim knows, in the order in which it answers
PLACES: dict[str, list[dict[str, Any]]] = {
    "Smalltown": [match("Smalltown, Hesse, Germany", _TOWN_SHAPE, 0.5)],
    "Springfield": [
        match("Springfield, Elsewhere", mapping(box(8.09, 50.09, 8.12, 50.11)), 0.2),
        match("Springfield, a signpost", _POINT, 0.9),
        match("Springfield, Hesse, Germany", _TOWN_SHAPE, 0.6),
    ],
    "Signpost": [match("Signpost, Hesse", _POINT, 0.5)],
    "Empire": [match("Empire", mapping(box(0.0, 40.0, 20.0, 55.0)), 0.5)],
}

_WAYS = re.compile(
    r'way\["highway"~"\^\((?P<classes>[a-z_|]+)\)\$"\]\(poly:"(?P<outline>[^"]+)"\);'
)


def overpass(question: str) -> dict[str, Any]:
    """What Overpass answers: ways that touch an outline, their nodes, restrictions of theirs."""
    by_id = {(one["type"], one["id"]): one for one in TOWN}
    roads: dict[int, dict[str, Any]] = {}
    for asked in _WAYS.finditer(question):
        numbers = list(map(float, asked["outline"].split()))
        area = Polygon(zip(numbers[1::2], numbers[::2], strict=True))
        for one in TOWN:
            if one["type"] != "way" or one["tags"]["highway"] not in asked["classes"].split("|"):
                continue
            ends = [by_id["node", ref] for ref in one["nodes"]]
            if LineString([(end["lon"], end["lat"]) for end in ends]).intersects(area):
                roads[one["id"]] = one
    nodes = {ref for road in roads.values() for ref in road["nodes"]}
    bans = [
        one
        for one in TOWN
        if one["type"] == "relation"
        and any(member["type"] == "way" and member["ref"] in roads for member in one["members"])
    ]
    # ways in front, as Overpass does not promise an order
    found = [*roads.values(), *(by_id["node", ref] for ref in sorted(nodes)), *bans]
    return {"version": 0.6, "osm3s": {"timestamp_osm_base": DATE}, "elements": found}


@dataclass
class Loopback:
    """Where the servers are, what they were asked; ``replies`` come first, by path, one each."""

    url: str = ""
    asked: list[str] = field(default_factory=list)
    agents: list[str] = field(default_factory=list)
    questions: list[str] = field(default_factory=list)
    replies: dict[str, list[Reply]] = field(default_factory=dict)

    def reply(self, path: str, text: str) -> Reply:
        """The answer to a path with its parameters, as they were sent."""
        told = parse_qs(text)
        self.asked.append(path)
        if path == "/interpreter":
            self.questions.append(told["data"][0])
        if self.replies.get(path):
            return self.replies[path].pop(0)
        if path == "/interpreter":
            return Reply(body=json.dumps(overpass(told["data"][0])).encode())
        if path == "/search":
            return Reply(body=json.dumps(PLACES.get(told["q"][0], [])).encode())
        return Reply(404)


@contextmanager
def loopback() -> Iterator[Loopback]:
    """Servers on a free port of this computer, until the end of the block."""
    state = Loopback()
    with serving(state):
        yield state
