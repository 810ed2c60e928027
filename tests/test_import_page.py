"""The page of an import: what it shows, that nothing of the source becomes markup, its size."""

from __future__ import annotations

import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from road_tables import UTM, drawn, road, street
from shapely import LineString

from uxsim_geo.export import import_spots, network_svg
from uxsim_geo.export.import_page import (
    ImportDescription,
    _numbers,
    import_page,
    write_import_page,
)
from uxsim_geo.export.import_spots import MEANINGS, Spots
from uxsim_geo.export.map_plane import MapPlane
from uxsim_geo.export.network_svg import Picture, main_roads, path_of
from uxsim_geo.network.doubts import note_doubts
from uxsim_geo.network.network import Network
from uxsim_geo.network.note_geometry import placed
from uxsim_geo.network.notes import Notes

NASTY = "<script>alert('x')</script> \"Rue\" & 'Weg' 🚗 --> ]]> {{ 7 * 7 }}"

#: elements without an end tag
VOID = {"meta", "link", "br", "hr", "img", "input"}


class Reader(HTMLParser):
    """Texts and tags of a page; tags must be closed in their order."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.texts: list[str] = []
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.feed(page)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += attrs
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += attrs

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append(data)

    def links(self) -> list[str]:
        return [value or "" for name, value in self.attributes if name == "href"]


def odd_road(name: str = "Avenue", crs: str | None = UTM) -> Network:
    """A road of three pieces, the middle one, way 77, twice as fast as the others."""
    x, y = 500_000.0, 5_400_000.0
    places = {end: (x + 200.0 * k, y) for k, end in enumerate("abcd")}
    roads = [road("a", "b", name=name), road("b", "c", name=name, free_speed=20.0)]
    return drawn(places, [*roads, road("c", "d", name=name)], crs=crs)


def with_doubts(network: Network) -> pd.DataFrame:
    notes = Notes()
    notes.add_table(network.notes)
    note_doubts(network, notes)
    return placed(notes.table(), network)


def page_of(network: Network, name: str = "town", *, osm: bool = False) -> Reader:
    told = ImportDescription(name, with_doubts(network), 5.0, openstreetmap=osm)
    return Reader(import_page(network, told))


def test_the_page_shows_the_doubt_with_road_value_and_place() -> None:
    page = page_of(odd_road())
    text = " ".join(page.texts)
    for told in ("link b-c", "residential Avenue", "36-72-36 km/h", "doubtful speed: 1"):
        assert told in text
    # the middle of the zone: 9 degrees and 300 m
    (place,) = [link for link in page.links() if "mlat" in link]
    assert re.fullmatch(
        r"https://www\.openstreetmap\.org/\?mlat=48\.7\d+&mlon=9\.004\d+#map.*", place
    )
    assert "doubtful dead end: none" in text


def test_numbers_that_would_hide_each_other_stand_together() -> None:
    places = [(1, 500, 500), (2, 900, 500), (3, 510, 480), (4, 500, 540), (5, 455, 520)]
    assert _numbers(places) == [("1, 3, 5", 500, 500), ("2", 900, 500), ("4", 500, 540)]


def test_every_text_of_the_source_is_escaped() -> None:
    network = odd_road(NASTY)
    notes = Notes()
    notes.add(NASTY, NASTY, severity="warning", value=NASTY)
    notes.add_each(NASTY, NASTY, [NASTY, "b-c"], values=[NASTY, NASTY])
    basis = pd.Series([NASTY] * 3, dtype="str")
    links = network.links.assign(road_class=basis, free_speed_basis=basis)
    page = page_of(replace(network, links=links, notes=notes.table()), NASTY, osm=True)
    assert "script" not in page.tags
    assert not any(name.startswith("on") for name, _ in page.attributes)
    assert sum(NASTY in text for text in page.texts) >= 10
    titles = [text for text in page.texts if text.startswith("1: link b-c")]
    assert titles == [f"1: link b-c, {NASTY} {NASTY}, 36-72-36 km/h"]


def test_the_page_needs_no_other_file_and_no_script() -> None:
    page = page_of(odd_road(), osm=True)
    assert not {"script", "link", "img", "iframe"} & set(page.tags)
    assert not [name for name, _ in page.attributes if name == "src"]
    outside = [link for link in page.links() if not link.startswith("#")]
    assert outside
    assert all(link.startswith("https://www.openstreetmap.org/") for link in outside)


def test_every_link_within_the_page_has_its_target() -> None:
    page = page_of(odd_road())
    ids = {value for name, value in page.attributes if name == "id"}
    inside = {link[1:] for link in page.links() if link.startswith("#")}
    assert "spot-1" in inside
    assert inside <= ids


@pytest.mark.parametrize(
    ("element", "name", "href"),
    [
        ("node", "42", "/node/42"),
        ("link", "77:1-2", "/way/77"),
        ("link", "77:1-2+3", "/way/77"),
        ("node", "-42", None),  # drawn in an editor, not in the map
        ("link", "a:1-2", None),
        ("demand", "42", None),
        ("node", "42'><b>", None),
    ],
)
def test_ids_of_openstreetmap_lead_there(element: str, name: str, href: str | None) -> None:
    notes = pd.DataFrame(
        [(element, name, "topic", "info", "note", None)],
        columns=["element", "element_id", "topic", "severity", "note", "value"],
    ).astype("str")
    found = [
        spots[0].href
        for known in (True, False)
        for _, _, spots in Spots(odd_road(), notes, known).repairs()
    ]
    assert found == [href and f"https://www.openstreetmap.org{href}", None]


def test_lists_are_cut_and_say_how_many_there_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(import_spots, "SPOTS_SHOWN", 2)
    monkeypatch.setattr(import_spots, "REPAIRS_SHOWN", 1)
    notes = Notes()
    topic = "doubtful lanes"
    notes.doubt_each(topic, "note", ["a-b", "b-c", "c-d"], ["1", "2", "3"])
    notes.add(topic, "more", severity="doubt", value=1000)
    notes.add_each("mended", "note", ["a-b", "b-c"])
    network = odd_road()
    spots = Spots(network, placed(notes.table(), network), False)
    kind = spots.kinds()[list(MEANINGS).index(topic)]
    assert (kind.number, len(kind.spots), kind.more) == (1003, 2, 1001)
    ((mended, number, shown),) = spots.repairs()
    assert (mended, number, len(shown)) == ("mended", 2, 1)
    told = ImportDescription("town", placed(notes.table(), network), 5.0)
    text = import_page(network, told)
    assert "and 1,001 more" in text
    assert "and 1 more" in text


def test_networks_without_places_or_links_have_a_page_without_a_map() -> None:
    network = odd_road()
    plain = Network(
        pd.DataFrame(network.nodes.drop(columns="geometry")),
        pd.DataFrame(network.links.drop(columns="geometry")),
    )
    none = replace(network, links=network.links.iloc[:0])
    for one in (plain, none):
        page = page_of(one)
        assert "path" in page.tags  # shapes of the kinds
        assert not [1 for name, value in page.attributes if (name, value) == ("class", "map")]


def test_coordinates_of_an_unknown_system_are_shown_as_they_are() -> None:
    network = odd_road(crs=None)
    notes = Notes()
    notes.add_each("mended", "note", ["b-c"])
    page = page_of(replace(network, notes=notes.table()))
    assert "500300, 5.4e+06" in page.texts
    assert not [link for link in page.links() if "mlat" in link]


def test_the_same_input_gives_the_same_bytes(tmp_path: Path) -> None:
    network = odd_road()
    told = ImportDescription("town", with_doubts(network), 5.0)
    for name in ("one.html", "two.html"):
        write_import_page(tmp_path / name, network, told)
    one, two = ((tmp_path / name).read_bytes() for name in ("one.html", "two.html"))
    assert one == two
    assert one.startswith(b"<!DOCTYPE html>")


def test_both_directions_are_drawn_once_and_pieces_joined() -> None:
    places = {"a": (0.0, 0.0), "b": (600.0, 0.0), "c": (1000.0, 0.0), "d": (1000.0, 500.0)}
    network = drawn(places, [street("a", "b"), street("b", "c"), street("c", "d")])
    picture = Picture.of(MapPlane.of(network))
    path = path_of(picture, ~main_roads(network.links))
    assert path.count("M") == 1
    start, *steps = re.findall(r"(-?\d+) (-?\d+)", path)
    unit = 2000 / 1040  # 1 km and a margin of 2 % on either side
    assert [int(value) for value in start] == pytest.approx([20 * unit, 520 * unit], abs=1)
    moved = [tuple(map(int, step)) for step in steps]
    assert [sum(axis) for axis in zip(*moved, strict=True)] == pytest.approx(
        [1000 * unit, -500 * unit], abs=2
    )


def test_a_large_network_is_simplified_until_it_is_small(monkeypatch: pytest.MonkeyPatch) -> None:
    places = {f"{x},{y}": (100.0 * x, 100.0 * y) for x in range(12) for y in range(12)}
    roads = [street(f"{x},{y}", f"{x + 1},{y}") for x in range(11) for y in range(12)]
    roads += [street(f"{x},{y}", f"{x},{y + 1}") for x in range(12) for y in range(11)]
    network = drawn(places, roads)
    picture = Picture.of(MapPlane.of(network))
    whole = path_of(picture, ~main_roads(network.links))
    monkeypatch.setattr(network_svg, "MOST_CHARACTERS", len(whole) - 1)
    assert len(path_of(picture, ~main_roads(network.links))) < len(whole)


@pytest.mark.parametrize("shape", [None, LineString(), LineString([(0, 0), (0, 0)])], ids=str)
def test_lines_without_extent_are_no_error(shape: LineString | None) -> None:
    network = odd_road()
    lines = np.full(3, shape, dtype=object)
    links = network.links.set_geometry(lines, crs=network.links.crs)
    notes = Notes()
    notes.add_each("mended", "note", ["a-b"])
    page = page_of(replace(network, links=links, notes=notes.table()))
    assert "mended: 1" in page.texts


def test_where_nothing_is_doubtful_the_page_says_so_without_a_map() -> None:
    x, y = 500_000.0, 5_400_000.0
    places = {end: (x + 200.0 * k, y) for k, end in enumerate("abc")}
    page = page_of(drawn(places, [road("a", "b"), road("b", "c")]))
    text = " ".join(page.texts)
    assert "None was found. This was looked for:" in text
    assert "Map of the doubtful spots" not in text
    assert not [value for name, value in page.attributes if (name, value) == ("class", "map")]


def test_notes_stand_in_the_page_as_sentences() -> None:
    notes = Notes()
    notes.add("fell out", "2 links: left out; value: km", severity="warning", value=1.25)
    note = "the length (value, m) is that of the geometry"
    notes.add_each("length assumed", note, ["a-b", "b-c"], values=[7.5, 12.0])
    text = " ".join(page_of(replace(odd_road(), notes=notes.table())).texts)
    assert "2 links: left out (1.25 km)" in text
    assert "the length (7.5 to 12 m) is that of the geometry (× 2)" in text
    assert "the length (7.5 m) is that of the geometry" in text
    assert "value:" not in text
    assert "(value" not in text
