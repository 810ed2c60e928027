"""``import_notes.html``: what an import found, assumed, repaired and doubts, on one page."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.export.import_spots import Kind, Spots
from uxsim_geo.export.map_plane import MapPlane
from uxsim_geo.export.network_svg import Picture, main_roads, path_of
from uxsim_geo.files import replace_when_complete
from uxsim_geo.network.doubts import CONNECTIONS
from uxsim_geo.network.import_shares import (
    kilometres_by_basis,
    shares_by_class,
    shares_of_all,
    short_links,
)
from uxsim_geo.network.network import Network
from uxsim_geo.network.note_words import note_in_words, notes_in_words, percent

TEMPLATE = "import_notes.html.jinja"

MOST_NUMBERS = 40  # of spots on the map
BESIDE, BELOW = 60, 36  # units of the picture within which one number would hide another

#: so many rows are shown of what has more: short links, bases of speeds, different notes of a topic
SHORTEST_SHOWN, BASES_SHOWN, NOTES_SHOWN = 15, 15, 4


@dataclass(frozen=True)
class ImportDescription:
    """What the page says beside the network.

    name
        of the run
    notes
        of network and demand, with their places (:mod:`uxsim_geo.network.note_geometry`)
    step
        s: links that are driven in less at free speed are listed as short
    openstreetmap
        whether ids are those of OpenStreetMap, so that they lead there
    attribution
        whose other data it is; empty: nobody's that is known
    """

    name: str
    notes: pd.DataFrame
    step: float
    openstreetmap: bool = False
    attribution: str = ""


def write_import_page(path: Path, network: Network, told: ImportDescription) -> None:
    """Write the page: one file that needs no other, the same bytes for the same input.

    It replaces an existing one when it is complete.
    """
    text = import_page(network, told)
    with replace_when_complete(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def import_page(network: Network, told: ImportDescription) -> str:
    """The page as HTML; every text of the source is escaped."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["percent"] = percent
    spots = Spots(network, told.notes, told.openstreetmap)
    kinds = spots.kinds()
    short = short_links(network, told.step)
    shortest = short.head(SHORTEST_SHOWN)
    return environment.get_template(TEMPLATE).render(
        name=told.name,
        openstreetmap=told.openstreetmap,
        attribution=told.attribution,
        nodes=len(network.nodes),
        all=shares_of_all(network.links),
        classes=shares_by_class(network.links).to_dict("records"),
        bases=_bases(network.links),
        kinds=kinds,
        doubts=sum(kind.number for kind in kinds),
        map=_map(network, kinds),
        looked="geometry" in network.links and getattr(network.links, "crs", None) is not None,
        step=told.step,
        greatest=_greatest_part(told.notes),
        short=len(short),
        shortest=spots.of_links(
            shortest["link_id"].tolist(), [f"{time:.2f} s" for time in shortest["time"]]
        ),
        connections=_notes_of(told.notes, CONNECTIONS, "largest part", "fell out"),
        topics=_topics(told.notes),
        repairs=spots.repairs(),
    )


def _greatest_part(notes: pd.DataFrame) -> float:
    """The share of the length in which every link leads to every other; NaN: not told."""
    values = pd.to_numeric(notes["value"][notes["topic"] == CONNECTIONS], errors="coerce")
    return float(values.iloc[-1]) if len(values) else float("nan")


def _bases(links: pd.DataFrame) -> list[tuple[str, float]]:
    """By what free speeds go, with km; the rarer ones together."""
    found = kilometres_by_basis(links)
    rows = [(str(basis), float(km)) for basis, km in found.head(BASES_SHOWN).items()]
    rest = found.iloc[BASES_SHOWN:]
    return [*rows, (f"{len(rest)} others", float(rest.sum()))] if len(rest) else rows


def _notes_of(notes: pd.DataFrame, *topics: str) -> list[str]:
    """Notes on the whole, of these topics, in words."""
    whole = notes[notes["element_id"].isna()]
    found = pd.concat([whole[whole["topic"] == topic] for topic in topics])
    return [
        note_in_words(note, value)
        for note, value in zip(found["note"], found["value"], strict=True)
    ]


def _topics(notes: pd.DataFrame) -> list[dict[str, Any]]:
    """Everything but the doubts, by severity and topic: how many notes, and what they say."""
    rows = []
    order = notes[notes["severity"] != "doubt"].assign(
        first=lambda table: table["severity"].map({"warning": 0}).fillna(1)
    )
    order = order.sort_values("first", kind="stable")
    for (severity, topic), found in order.groupby(["severity", "topic"], sort=False):
        said = found.groupby("note", sort=False)
        texts = [
            {"note": notes_in_words(str(note), same["value"]), "number": len(same)}
            for note, same in list(said)[:NOTES_SHOWN]
        ]
        more = said.ngroups - len(texts)
        row = {"severity": severity, "topic": topic, "number": len(found)}
        rows.append({**row, "texts": texts, "more": more})
    return rows


def _numbers(places: list[tuple[int, int, int]]) -> list[tuple[str, int, int]]:
    """Numbers of spots and where they stand on the map; those that would hide each other in one."""
    texts: dict[tuple[int, int], str] = {}
    for number, x, y in places:
        near = (at for at in texts if abs(at[0] - x) < BESIDE and abs(at[1] - y) < BELOW)
        at = next(near, (x, y))
        texts[at] = f"{texts[at]}, {number}" if at in texts else str(number)
    return [(text, x, y) for (x, y), text in texts.items()]


def _map(network: Network, kinds: list[Kind]) -> dict[str, Any] | None:
    """Paths of the network and places of the spots in its picture; None without geometry."""
    if "geometry" not in network.links or not len(network.links):
        return None
    plane = MapPlane.of(network)
    if not np.isfinite(plane.extent).all():  # no line has a place that can be drawn
        return None
    picture = Picture.of(plane)
    main = main_roads(network.links)
    main = main | (not main.any())  # where classes say nothing, all roads are drawn wider
    markers = [
        (kind.code, spot.number, spot.title, *map(round, picture.place(at[None])[0].tolist()))
        for kind in kinds
        for spot, at in zip(kind.spots, kind.points(picture.plane.crs), strict=True)
        if at is not None
    ]
    places = [(number, x, y) for _, number, _, x, y in markers]
    return {
        "width": picture.width,
        "height": picture.height,
        "streets": path_of(picture, ~main),
        "main": path_of(picture, main),
        "bar": picture.bar(),
        "markers": markers,
        "numbers": _numbers(places) if len(markers) <= MOST_NUMBERS else [],
    }
