"""Small OpenStreetMap files for tests: drawn in the test, or lying in ``tests/data/osm``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from xml.sax.saxutils import quoteattr

import pandas as pd
from conftest import REPOSITORY

from uxsim_geo.network.network import Network
from uxsim_geo.network.osm import read_osm_network
from uxsim_geo.network.osm_options import OsmOptions

DATA = REPOSITORY / "tests" / "data" / "osm"

#: degrees of one unit of drawing: 100 m along the equator
UNIT = 0.0009

Tags = Mapping[str, str]


def node(number: int, x: float, y: float, tags: Tags | None = None) -> str:
    """A node at x, y units of 100 m from 0° 0°."""
    place = f"id='{number}' version='1' lat='{y * UNIT:.7f}' lon='{x * UNIT:.7f}'"
    return f"<node {place}>{_tags(tags)}</node>"


def way(number: int, nodes: Iterable[int], tags: Tags | None = None) -> str:
    """A residential road, unless the tags say otherwise."""
    refs = "".join(f"<nd ref='{ref}'/>" for ref in nodes)
    own = _tags({"highway": "residential"} | dict(tags or {}))
    return f"<way id='{number}' version='1'>{refs}{own}</way>"


def restriction(number: int, kind: str, members: str, tags: Tags | None = None) -> str:
    """A turn restriction; members as ``from w1 via n2 to w3``."""
    words = members.split()
    types = {"n": "node", "w": "way", "r": "relation"}
    found = "".join(
        f"<member type='{types[what[0]]}' ref='{what[1:]}' role='{role}'/>"
        for role, what in zip(words[::2], words[1::2], strict=True)
    )
    own = {"type": "restriction"} | ({"restriction": kind} if kind else {}) | dict(tags or {})
    return f"<relation id='{number}' version='1'>{found}{_tags(own)}</relation>"


def _tags(tags: Tags | None) -> str:
    pairs = (tags or {}).items()
    return "".join(f"<tag k={quoteattr(key)} v={quoteattr(value)}/>" for key, value in pairs)


def osm(*elements: str) -> str:
    """A file of these elements."""
    return "\n".join(["<osm version='0.6'>", *elements, "</osm>"])


def read(folder: Path, *elements: str, options: OsmOptions | None = None) -> Network:
    """The network of these elements."""
    path = folder / "drawn.osm"
    path.write_text(osm(*elements), encoding="utf-8")
    return read_osm_network(path, options or OsmOptions())


@cache
def read_data(name: str, options: OsmOptions | None = None) -> Network:
    """The network of a file in ``tests/data/osm``, read once."""
    return read_osm_network(DATA / name, options or OsmOptions())


def both_ways(network: Network, name: str, column: str) -> tuple[object, object]:
    """Values of a column forward and backward on the road of a name; None where it is no link."""
    links = network.links[network.links["name"] == name]
    found = dict(zip(links["direction"], links[column], strict=True))
    assert len(found) == len(links)
    return found.get("forward"), found.get("backward")


def topics(network: Network) -> dict[str, int]:
    """How many notes there are of each topic."""
    counts: pd.Series = network.notes["topic"].value_counts()
    return {str(topic): int(number) for topic, number in counts.items()}


def noted(network: Network, topic: str) -> list[str]:
    """The values of the notes of a topic."""
    notes = network.notes
    return [str(value) for value in notes["value"][notes["topic"] == topic]]
