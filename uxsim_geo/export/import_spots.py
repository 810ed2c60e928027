"""Doubtful spots and repairs as a page shows them: with road, place and a way to look at them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.network.doubts import DOUBTS
from uxsim_geo.network.import_shares import number_of_spots
from uxsim_geo.network.network import NOTE_COLUMNS, Network
from uxsim_geo.network.note_geometry import placed
from uxsim_geo.network.note_words import note_in_words

#: rows shown of each kind of doubt, and of the repairs of a topic
SPOTS_SHOWN, REPAIRS_SHOWN = 100, 10

#: whose notes are spots to look at, beside the doubts
MISSING_NODES = "missing nodes"

#: by topic: what the doubt means, and what to do about it
MEANINGS = {
    DOUBTS[0]: "A street ends within 10 m of another road, or 20 m before a road of its own name, "
    "and no way of up to 200 m leads there: a connection may be missing in the source, and all "
    "trips go round. Nothing is meant where a path goes on or the map says that the street ends.",
    DOUBTS[1]: "Fewer lanes than the same road has before and after, on a piece shorter than "
    "100 m or where they are assumed between given ones: it will hold up all that drive through.",
    DOUBTS[2]: "The same road goes on with at least two lanes more or fewer, and one of the two "
    "numbers is assumed, or nothing at the node takes or brings the difference.",
    DOUBTS[3]: "Given speeds that differ by a factor of 1.8 on a piece shorter than 500 m, or an "
    "assumed one by 1.4 between given ones: a wrong unit, a wrong class, or a piece overlooked.",
    DOUBTS[4]: "Less than half of the given capacity of the same road before and after.",
    MISSING_NODES: "Ways name nodes that the file lacks, as at its edge: they are cut there.",
}

OSM = "https://www.openstreetmap.org"
_OSM_ID = re.compile(r"[1-9][0-9]{0,18}")


@dataclass(frozen=True)
class Spot:
    """A place to look at; texts are as in the source.

    number
        its number on the page, from 1; 0: none
    href, map_href
        pages of OpenStreetMap with the element and the place; None where there are none
    place
        longitude and latitude, or x and y where the reference system is not known
    """

    number: int
    element: str
    element_id: str
    road: str
    value: str
    note: str
    href: str | None
    place: str
    map_href: str | None

    @property
    def title(self) -> str:
        """What a map says of it."""
        parts = (f"{self.element} {self.element_id}", self.road, self.value)
        return ", ".join(part for part in parts if part)


@dataclass(frozen=True)
class Kind:
    """Spots of one topic: the first of them, and how many there are in all.

    code
        by which the page tells kinds apart, ``kind-1`` ...
    shown
        notes of ``spots``, with geometry where they have it
    """

    topic: str
    code: str
    meaning: str
    number: int
    spots: list[Spot]
    shown: pd.DataFrame = field(repr=False)

    @property
    def more(self) -> int:
        """How many are not shown."""
        return self.number - len(self.spots)

    def points(self, crs: Any) -> Iterator[Any]:
        """Where each spot is in a system, x and y, or None."""
        if "geometry" not in self.shown:
            yield from [None] * len(self.spots)
            return
        located: Any = self.shown
        shapes = located.geometry
        if crs is not None and shapes.crs is not None and shapes.crs != crs:
            shapes = shapes.to_crs(crs)
        for shape in shapes:
            yield None if shape is None or shape.is_empty else np.array([shape.x, shape.y])


@dataclass(frozen=True)
class Spots:
    """Notes that have a place, of a network."""

    network: Network
    notes: pd.DataFrame
    openstreetmap: bool

    def kinds(self) -> list[Kind]:
        """Every kind of doubt, also those of which there is none."""
        kinds, number = [], 1
        for order, (topic, meaning) in enumerate(MEANINGS.items(), start=1):
            found = self.notes[self.notes["topic"] == topic]
            single = found[found["element_id"].notna()]
            shown = single.head(SPOTS_SHOWN)
            spots = list(self._spots(shown, number))
            total = number_of_spots(found)
            kinds.append(Kind(topic, f"kind-{order}", meaning, total, spots, shown))
            number += len(spots)
        return kinds

    def repairs(self) -> list[tuple[str, int, list[Spot]]]:
        """Other notes on single elements, by topic: how many, and the first of them."""
        other = ~self.notes["topic"].isin(list(MEANINGS)) & self.notes["element_id"].notna()
        return [
            (str(topic), len(found), list(self._spots(found.head(REPAIRS_SHOWN), 0)))
            for topic, found in self.notes[other].groupby("topic", sort=False)
        ]

    def of_links(self, ids: Sequence[str], values: Sequence[str]) -> list[Spot]:
        """Links as spots, without numbers."""
        table = pd.DataFrame({"element": "link", "element_id": ids, "value": values, "note": ""})
        notes = placed(table.reindex(columns=list(NOTE_COLUMNS)), self.network)
        return list(self._spots(notes, 0))

    def _spots(self, notes: pd.DataFrame, number: int) -> Iterator[Spot]:
        """Spots with numbers from ``number`` on; 0: without."""
        rows = zip(notes.to_dict("records"), _places(notes), strict=True)
        for place, (row, (where, map_href)) in enumerate(rows):
            element, name = str(row["element"]), str(row["element_id"])
            yield Spot(
                number + place if number else 0,
                element,
                name,
                self._road(element, name),
                _text(row["value"]),
                note_in_words(_text(row["note"]), row["value"]),
                self._href(element, name),
                where,
                map_href,
            )

    @cached_property
    def _links_at(self) -> dict[tuple[str, str], int]:
        """Row of each link, and of a link at each node."""
        links = self.network.links
        found: dict[tuple[str, str], int] = {}
        for column in ("from_node_id", "to_node_id"):
            found |= {("node", name): row for row, name in enumerate(links[column])}
        return found | {("link", name): row for row, name in enumerate(links["link_id"])}

    def _road(self, element: str, name: str) -> str:
        """Class and name of a link, or of one at a node."""
        row = self._links_at.get((element, name))
        if row is None:
            return ""
        links = self.network.links
        columns = [column for column in ("road_class", "name") if column in links]
        return " ".join(filter(None, (_text(links[column].iloc[row]) for column in columns)))

    def _href(self, element: str, name: str) -> str | None:
        """The page at OpenStreetMap of a node, or of the way of a link (joined: of its first)."""
        if not self.openstreetmap or element not in ("node", "link"):
            return None
        found = name if element == "node" else name.partition(":")[0]
        kind = "node" if element == "node" else "way"
        return f"{OSM}/{kind}/{found}" if _OSM_ID.fullmatch(found) else None


def _places(notes: pd.DataFrame) -> Iterator[tuple[str, str | None]]:
    """Longitude and latitude of notes, and a map of the place; x and y alone in unknown systems."""
    located: Any = notes
    if "geometry" not in notes:
        yield from [("", None)] * len(notes)
        return
    known = located.crs is not None
    for shape in located.geometry.to_crs("EPSG:4326") if known else located.geometry:
        if shape is None or shape.is_empty:
            yield "", None
        elif not known:
            yield f"{shape.x:g}, {shape.y:g}", None
        else:
            at = f"{shape.y:.5f}/{shape.x:.5f}"
            marker = f"mlat={shape.y:.5f}&mlon={shape.x:.5f}"
            yield f"{shape.x:.5f}, {shape.y:.5f}", f"{OSM}/?{marker}#map=18/{at}"


def _text(value: object) -> str:
    """A text of a table; nothing where it has none."""
    return value if isinstance(value, str) else ""
