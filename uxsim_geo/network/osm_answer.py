"""Answers of Overpass, in JSON, to OpenStreetMap's own XML, which every program reads.

What is not as it should be is refused: an answer that was cut off, or that the server gave up on,
would be a network with holes.
"""

from __future__ import annotations

import gzip
import json
import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

from uxsim_geo.errors import Faults
from uxsim_geo.files import replace_when_complete

ATTRIBUTION = "© OpenStreetMap contributors"
LICENCE = "ODbL 1.0, https://www.openstreetmap.org/copyright"

#: elements in the order of OpenStreetMap's files
KINDS = ("node", "way", "relation")

#: what XML cannot hold
_NOT_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")

_DATE = re.compile(r"[0-9T:.Z+-]{10,40}")

#: faults of one answer that are told
_TOLD = 5

_Element = dict[str, Any]


@dataclass(frozen=True)
class Answer:
    """Elements sorted by kind and id, each once, and of when they are (ISO 8601, UTC)."""

    elements: list[_Element]
    data_date: str

    def counts(self) -> dict[str, int]:
        """How many elements there are of each kind."""
        kinds = [element["type"] for element in self.elements]
        return {f"{kind}s": kinds.count(kind) for kind in KINDS}


def read_answer(content: bytes, faults: Faults) -> Answer | None:
    """The elements that Overpass has found, or None with faults that say why there are none."""
    try:
        told = json.loads(content)
    except (ValueError, RecursionError):
        what = "the answer is no JSON: it was cut off, or the server is none of Overpass"
        faults.add(what, value=content[:60].decode("utf-8", errors="replace"))
        return None
    elements = told.get("elements") if isinstance(told, dict) else None
    if not isinstance(elements, list):
        faults.add("the answer holds no elements: the server is none of Overpass")
        return None
    if told.get("remark"):
        what = "the server gave up, the answer is not complete; take a smaller area or try later"
        faults.add(what, value=told["remark"])
        return None
    strange = [element for element in elements if not _is_element(element)]
    for element in strange[:_TOLD]:
        faults.add("the answer has an element that is none", value=element)
    about = told.get("osm3s")
    date = about.get("timestamp_osm_base") if isinstance(about, dict) else None
    if not strange and not any(element["type"] == "way" for element in elements):
        faults.add("there are no roads of these classes there")
    if faults.found:
        return None
    known = isinstance(date, str) and _DATE.fullmatch(date) is not None
    return Answer(_in_order(elements), str(date) if known else "unknown")


def _in_order(elements: list[_Element]) -> list[_Element]:
    """Each element once, whatever the order and however often it came."""
    by_id = {(KINDS.index(element["type"]), element["id"]): element for element in elements}
    return [by_id[key] for key in sorted(by_id)]


def write_osm_xml(answer: Answer, path: Path) -> None:
    """Write .osm.gz: the same answer gives the same bytes."""
    with (
        replace_when_complete(path) as temporary,
        temporary.open("wb") as raw,
        # neither name nor time in the head of the packed file
        gzip.GzipFile("", "wb", 6, raw, mtime=0) as packed,
    ):
        for line in _lines(answer):
            packed.write(line.encode("utf-8") + b"\n")


def _lines(answer: Answer) -> Iterator[str]:
    yield '<?xml version="1.0" encoding="UTF-8"?>'
    source = f"copyright={_quoted(ATTRIBUTION)} license={_quoted(LICENCE)}"
    yield f'<osm version="0.6" generator="uxsim-geo" {source}>'
    yield f"<meta osm_base={_quoted(answer.data_date)}/>"
    for element in answer.elements:
        kind = element["type"]
        inside = _inside(element)
        attributes = f'id="{element["id"]}" version="1"'
        if kind == "node":
            attributes += f' lat="{element["lat"]:.7f}" lon="{element["lon"]:.7f}"'
        yield f"<{kind} {attributes}>{inside}</{kind}>" if inside else f"<{kind} {attributes}/>"
    yield "</osm>"


def _inside(element: _Element) -> str:
    refs = [f'<nd ref="{ref}"/>' for ref in element.get("nodes", ())]
    members = [
        f'<member type="{member["type"]}" ref="{member["ref"]}" role={_quoted(member["role"])}/>'
        for member in element.get("members", ())
    ]
    tags = [
        f"<tag k={_quoted(key)} v={_quoted(value)}/>"
        for key, value in sorted(element.get("tags", {}).items())
    ]
    return "".join(refs + members + tags)


def _quoted(text: str) -> str:
    return quoteattr(_NOT_XML.sub("\ufffd", text))


def _is_element(element: object) -> bool:
    """Tell whether all that is written of it is there, and of its kind."""
    if not isinstance(element, dict) or not _is_id(element.get("id")):
        return False
    tags = element.get("tags", {})
    has_texts = isinstance(tags, dict) and all(isinstance(value, str) for value in tags.values())
    kind = element.get("type")
    return has_texts and isinstance(kind, str) and kind in _FITS and _FITS[kind](element)


def _is_node(element: _Element) -> bool:
    return _is_within(element.get("lat"), 90) and _is_within(element.get("lon"), 180)


def _is_way(element: _Element) -> bool:
    nodes = element.get("nodes")
    return isinstance(nodes, list) and all(map(_is_id, nodes))


def _is_relation(element: _Element) -> bool:
    members = element.get("members")
    return isinstance(members, list) and all(map(_is_member, members))


def _is_member(member: object) -> bool:
    return (
        isinstance(member, dict)
        and member.get("type") in KINDS
        and _is_id(member.get("ref"))
        and isinstance(member.get("role"), str)
    )


def _is_id(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**63


def _is_within(value: object, most: float) -> bool:
    if not isinstance(value, int | float) or isinstance(value, bool):
        return False
    return math.isfinite(value) and abs(value) <= most


_FITS: dict[str, Callable[[_Element], bool]] = {
    "node": _is_node,
    "way": _is_way,
    "relation": _is_relation,
}
