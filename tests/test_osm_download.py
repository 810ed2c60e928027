"""Roads downloaded by place, box and polygon, from servers on this computer."""

from __future__ import annotations

import gzip
import json
import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import geopandas as gpd
import osmium
import pandas as pd
import pytest
import yaml
from conftest import REPOSITORY
from loopback import Reply, closed_port
from osm_loopback import DATE, PLACES, TOWN_BOX, Loopback, loopback, match, overpass
from shapely.geometry import Point, Polygon, box

from pipeline.cli import main
from pipeline.config_file import load_config
from uxsim_geo.errors import InputError
from uxsim_geo.network.files import read_network
from uxsim_geo.network.osm import read_osm_network
from uxsim_geo.network.osm_download import Download, cached_osm, download_osm
from uxsim_geo.network.osm_options import PUBLIC_ROADS, OsmOptions
from uxsim_geo.network.osm_query import OsmQuery, area_km2, overpass_question
from uxsim_geo.network.osm_servers import Servers, osmnx_settings

TOWN = OsmQuery(bbox=TOWN_BOX)


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> Iterator[Loopback]:
    """Servers on this computer; OSMnx's pause of a second before each question is left out."""
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    monkeypatch.setattr(time, "sleep", lambda _seconds: None)
    with loopback() as running:
        yield running


def servers_at(url: str, waited: list[float] | None = None, **more: Any) -> Servers:
    log = [] if waited is None else waited
    return Servers(url, url, wait=log.append, **({"timeout_s": 10.0} | more))


def ask(folder: Path, server: Loopback, query: OsmQuery = TOWN, **more: Any) -> Download:
    refresh = more.pop("refresh", False)
    return download_osm(query, folder, refresh=refresh, servers=servers_at(server.url, **more))


def fault(folder: Path, server: Loopback, query: OsmQuery = TOWN, **more: Any) -> str:
    with pytest.raises(InputError) as caught:
        ask(folder, server, query, **more)
    assert not list(folder.glob(".*")), "nothing half-written is left"
    return str(caught.value)


def elements(path: Path) -> list[tuple[str, int]]:
    root = ElementTree.fromstring(gzip.decompress(path.read_bytes()))
    return [(one.tag, int(one.attrib["id"])) for one in root if one.tag != "meta"]


PUBLIC_TOWN = [
    *(("node", number) for number in (1, 2, 3, 4)),
    *(("way", number) for number in (10, 11, 13)),
    ("relation", 20),
]


def test_a_box_brings_roads_nodes_and_restrictions(tmp_path: Path, server: Loopback) -> None:
    got = ask(tmp_path, server)
    assert elements(got.path) == PUBLIC_TOWN
    assert got.elements == {"nodes": 4, "ways": 3, "relations": 1}
    assert (got.data_date, got.overpass) == (DATE, server.url)
    network = read_osm_network(got.path, OsmOptions())
    assert sorted(network.links["source_id"].unique()) == ["10", "11", "13"]
    assert network.links["name"].dropna().unique().tolist() == ['Straße "A" & <B>']
    bans = network.movements[["from_link_id", "to_link_id"]].to_numpy().tolist()
    assert bans == [["10:1-2", "11:2-4"]]
    assert network.nodes.set_index("node_id")["control"]["2"] == "signal"


def test_a_place_is_taken_for_its_area(tmp_path: Path, server: Loopback) -> None:
    got = ask(tmp_path, server, OsmQuery(place="Smalltown"))
    assert elements(got.path) == PUBLIC_TOWN
    assert (got.found, got.others) == ("Smalltown, Hesse, Germany", 0)
    assert server.asked == ["/search", "/interpreter"]
    assert got.area_km2 == pytest.approx(area_km2(box(*TOWN_BOX)), abs=0.001)


def test_of_several_places_the_most_important_area_is_taken(
    tmp_path: Path, server: Loopback
) -> None:
    got = ask(tmp_path, server, OsmQuery(place="Springfield"))
    assert (got.found, got.others) == ("Springfield, Hesse, Germany", 2)
    assert elements(got.path) == PUBLIC_TOWN


def test_a_polygon_as_text_and_as_a_file(tmp_path: Path, server: Loopback) -> None:
    west = box(7.99, 49.99, 8.005, 50.01)
    got = ask(tmp_path, server, OsmQuery(polygon=west.wkt))
    # the way comes whole, though one of its ends lies outside
    assert elements(got.path) == [("node", 1), ("node", 2), ("way", 10), ("relation", 20)]
    both = gpd.GeoDataFrame(geometry=[west, box(8.09, 50.09, 8.105, 50.11)], crs="EPSG:4326")
    both.to_crs("EPSG:25832").to_file(tmp_path / "areas.gpkg")
    got = ask(tmp_path, server, OsmQuery(polygon=str(tmp_path / "areas.gpkg")))
    ways = [number for kind, number in elements(got.path) if kind == "way"]
    assert ways == [10, 15]


def test_road_classes_are_asked_for(tmp_path: Path, server: Loopback) -> None:
    got = ask(tmp_path, server, OsmQuery(bbox=TOWN_BOX, road_classes=("service",)))
    assert elements(got.path) == [("node", 4), ("node", 5), ("way", 12)]


def test_holes_of_an_area_are_asked_for_too() -> None:
    whole, hole = box(7.99, 49.99, 8.03, 50.01), box(8.0, 50.0, 8.02, 50.005)
    ring = Polygon(whole.exterior, [hole.exterior])
    questions = {overpass_question(area, ("road",), 9.5) for area in (whole, ring)}
    assert len(questions) == 1
    assert questions.pop().startswith('[out:json][timeout:10];(way["highway"~"^(road)$"](poly:"')
    sizes = [area_km2(area) for area in (ring, hole, whole)]
    assert sizes[0] + sizes[1] == pytest.approx(sizes[2])


def test_the_same_question_has_the_same_file() -> None:
    names = [
        OsmQuery(place="São  Paulo").file_name(),
        OsmQuery(place="são Paulo", road_classes=PUBLIC_ROADS[::-1]).file_name(),
        OsmQuery(place="São Paulo", road_classes=PUBLIC_ROADS[:3]).file_name(),
        OsmQuery(place="São Paulo, Brazil").file_name(),
        OsmQuery(bbox=TOWN_BOX).file_name(),
        OsmQuery(polygon=box(*TOWN_BOX).wkt).file_name(),
        OsmQuery(polygon=box(*TOWN_BOX).reverse().wkt).file_name(),
        OsmQuery(place="札幌").file_name(),
    ]
    assert names[0] == names[1]
    assert names[5] == names[6]
    assert len(set(names)) == len(names) - 2
    assert [name.rpartition("-")[0] for name in names[3:]] == [
        "sao_paulo_brazil",
        "bbox",
        "polygon",
        "polygon",
        "place",
    ]


def test_an_outline_may_not_have_endless_corners() -> None:
    area = Point(8.0, 50.0).buffer(0.1, quad_segs=6000)
    with pytest.raises(InputError, match="more than 20,000 corners"):
        overpass_question(area, PUBLIC_ROADS, 10.0)


def test_area_of_a_box_on_the_ellipsoid() -> None:
    # between two parallels: 2 pi R^2 (sin b - sin a) of a sphere of the same size, for a degree
    assert area_km2(box(8.0, 0.0, 9.0, 1.0)) == pytest.approx(111.3195 * 110.574, rel=1e-3)


def test_the_servers_are_asked_once(tmp_path: Path, server: Loopback) -> None:
    query = OsmQuery(place="Smalltown")
    first = ask(tmp_path, server, query)
    assert cached_osm(query, tmp_path) == first
    again = ask(tmp_path, server, OsmQuery(place=" smalltown "))
    assert again == first
    assert server.asked == ["/search", "/interpreter"]


def test_refresh_asks_again_and_the_same_map_gives_the_same_bytes(
    tmp_path: Path, server: Loopback
) -> None:
    first = ask(tmp_path, server)
    again = ask(tmp_path, server, refresh=True)
    assert server.asked == ["/interpreter"] * 2
    assert again.sha256 == first.sha256


def test_texts_that_xml_cannot_hold_are_mended(tmp_path: Path, server: Loopback) -> None:
    answer = overpass(overpass_question(TOWN.area(), TOWN.road_classes, 10.0))
    answer = json.loads(json.dumps(answer).replace("Stra", r"\ud800\u0000]]>&lt;"))
    server.replies["/interpreter"] = [Reply(body=json.dumps(answer).encode())]
    network = read_osm_network(ask(tmp_path, server).path, OsmOptions())
    (name,) = network.links["name"].dropna().unique()
    assert name.startswith("\ufffd\ufffd]]>&lt;")


def test_the_side_file_says_how_the_roads_came(tmp_path: Path, server: Loopback) -> None:
    got = ask(tmp_path, server, OsmQuery(place="Smalltown"))
    told = json.loads(Path(f"{got.path}.json").read_text(encoding="utf-8"))
    assert told["attribution"] == "© OpenStreetMap contributors"
    assert told["data_date"] == DATE
    assert told["query"]["place"] == "Smalltown"
    assert told["question"] == server.questions[0]
    assert told["sha256"] == got.sha256
    assert told["nominatim"] == server.url


def test_questions_say_who_asks(tmp_path: Path, server: Loopback) -> None:
    ask(tmp_path, server, OsmQuery(place="Smalltown"))
    assert len(server.agents) == 2
    assert all(agent.startswith("uxsim-geo/") for agent in server.agents)


def test_a_file_changed_since_is_not_believed(tmp_path: Path, server: Loopback) -> None:
    got = ask(tmp_path, server)
    got.path.write_bytes(got.path.read_bytes() + b" ")
    assert "not as it was downloaded; refresh" in fault(tmp_path, server)
    assert ask(tmp_path, server, refresh=True).sha256 == got.sha256
    Path(f"{got.path}.json").write_text("{}", encoding="utf-8")
    assert "does not say how the roads came" in fault(tmp_path, server)
    Path(f"{got.path}.json").unlink()
    assert ask(tmp_path, server).sha256 == got.sha256
    assert len(server.asked) == 3


@pytest.mark.parametrize("query", [TOWN, OsmQuery(place="Smalltown")], ids=str)
def test_without_a_network_the_cache_serves(
    tmp_path: Path, server: Loopback, query: OsmQuery
) -> None:
    nobody = Loopback(url=closed_port())
    text = fault(tmp_path, nobody, query)
    assert text.count("\n") == 0
    assert "cannot be reached" in text
    assert "name it as file" in text
    assert str(tmp_path) in text
    first = ask(tmp_path, server, query)
    assert ask(tmp_path, nobody, query) == first
    text = fault(tmp_path, nobody, query, refresh=True)
    assert "refresh: false uses what was downloaded before" in text
    assert ask(tmp_path, nobody, query) == first


@pytest.mark.parametrize(
    ("place", "expected"),
    [
        ("Nowhere", "no place is known by the name Nowhere"),
        ("Signpost", "is known, but not as an area; give a bbox or a polygon"),
        ("Empire", "km² is more than the 2,500 km²"),
    ],
)
def test_places_that_are_no_use(
    tmp_path: Path, server: Loopback, place: str, expected: str
) -> None:
    assert expected in fault(tmp_path, server, OsmQuery(place=place))
    assert server.asked == ["/search"]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("path", ["/search", "/interpreter"])
def test_a_busy_server_is_asked_again(tmp_path: Path, server: Loopback, path: str) -> None:
    server.replies[path] = [Reply(429), Reply(504, headers={"Retry-After": "7"})]
    waited: list[float] = []
    got = ask(tmp_path, server, OsmQuery(place="Smalltown"), waited=waited)
    assert elements(got.path) == PUBLIC_TOWN
    assert waited == [30.0, 7.0]


def test_a_busy_server_is_not_asked_for_ever(tmp_path: Path, server: Loopback) -> None:
    reply = Reply(504, headers={"Retry-After": "100000"})
    server.replies["/interpreter"] = [reply] * 9
    waited: list[float] = []
    text = fault(tmp_path, server, waited=waited)
    assert "answers 504: the server is too busy for it; asked 3 times" in text
    assert "with a smaller area" in text
    assert waited == [120.0, 120.0]
    assert len(server.asked) == 3


def elements_reply(*found: object, **more: object) -> Reply:
    return Reply(body=json.dumps({"elements": found} | more).encode())


FAR_NODE = {"type": "node", "id": 1, "lat": 91.0, "lon": 8.0}
WAY = {"type": "way", "id": 1, "nodes": [1, 2], "tags": {"highway": "primary"}}


@pytest.mark.parametrize(
    ("reply", "expected"),
    [
        (Reply(body=b"<html>Welcome</html>"), "is no JSON"),
        (Reply(body=b'{"elements": [{"type":'), "was cut off"),
        (Reply(body=b"[" * 100_000), "is no JSON"),
        (Reply(body=b'{"elements": [', cut=True), "cut off"),
        (Reply(body=b"nonsense", headers={"Content-Encoding": "gzip"}), "cannot be read"),
        (Reply(body=b"[]"), "holds no elements"),
        (Reply(), "is no JSON"),
        (elements_reply(), "no roads of these classes there"),
        (elements_reply(WAY, remark="runtime error: Query timed out"), "the server gave up"),
        (elements_reply(WAY, FAR_NODE), "an element that is none"),
        (elements_reply(WAY | {"nodes": ["1' onload='x"]}), "an element that is none"),
        (elements_reply(WAY | {"id": True}), "an element that is none"),
        (elements_reply({"type": "area", "id": 1}), "an element that is none"),
        (elements_reply({"type": [], "id": 1}), "an element that is none"),
        (Reply(400, b"parse error"), "answers 400"),
        (Reply(301, headers={"Location": "http://evil.example/"}), "http://evil.example/"),
    ],
)
def test_answers_that_are_no_roads(
    tmp_path: Path, server: Loopback, reply: Reply, expected: str
) -> None:
    server.replies["/interpreter"] = [reply]
    text = fault(tmp_path, server)
    assert expected in text
    assert text.startswith(f"roads of {TOWN}: ")
    assert server.asked == ["/interpreter"]
    assert list(tmp_path.iterdir()) == []


EMPTY = {"type": "Polygon", "coordinates": []}


@pytest.mark.parametrize(
    ("reply", "expected"),
    [
        (Reply(body=b"<html>Welcome</html>"), "is not what a geocoder says"),
        (Reply(body=b"{}"), "is not what a geocoder says"),
        (Reply(body=b'[{"display_name": "x"}]'), "is not what a geocoder says"),
        (Reply(body=b"[1]"), "is not what a geocoder says"),
        (Reply(body=b"[" * 100_000), "is not what a geocoder says"),
        (Reply(body=json.dumps([match("x", EMPTY, 0.5)]).encode()), "there is no area"),
        (Reply(403), "answers 403"),
        (Reply(302, headers={"Location": "http://evil.example/"}), "is not followed"),
    ],
)
def test_answers_that_are_no_place(
    tmp_path: Path, server: Loopback, reply: Reply, expected: str
) -> None:
    server.replies["/search"] = [reply]
    assert expected in fault(tmp_path, server, OsmQuery(place="Smalltown"))
    assert server.asked == ["/search"]


@pytest.mark.parametrize("packed", [False, True])
def test_an_answer_may_not_be_larger_than_allowed(
    tmp_path: Path, server: Loopback, packed: bool
) -> None:
    body = b'{"elements": []}' + b" " * 2_000_000
    headers = {"Content-Encoding": "gzip"} if packed else {}
    reply = Reply(body=gzip.compress(body) if packed else body, headers=headers)
    server.replies["/interpreter"] = [reply]
    assert "larger than 1 MB" in fault(tmp_path, server, max_mb=1.0)


def test_an_answer_may_not_trickle_in_for_ever(
    tmp_path: Path, server: Loopback, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = iter(range(0, 10**9, 1000))
    monkeypatch.setattr("uxsim_geo.network.bounded_http.time.monotonic", lambda: next(clock))
    assert "comes in too slowly" in fault(tmp_path, server)


def test_a_block_that_does_not_come_is_not_waited_for(
    tmp_path: Path, server: Loopback, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first byte is there, and by the clock it is too late: what follows does not matter."""
    server.replies["/interpreter"] = [Reply(body=b" " * 5000, stalls=True)]
    clock = iter(range(0, 10**9, 1000))
    monkeypatch.setattr("uxsim_geo.network.bounded_http.time.monotonic", lambda: next(clock))
    assert "comes in too slowly" in fault(tmp_path, server)


def test_settings_of_osmnx_are_put_back(tmp_path: Path, server: Loopback) -> None:
    from osmnx import settings

    before = dict(vars(settings))
    ask(tmp_path, server, OsmQuery(place="Smalltown"))
    assert dict(vars(settings)) == before
    with osmnx_settings(Servers("http://own.example"), 1) as own:
        assert own.overpass_url == "http://own.example"
    assert dict(vars(settings)) == before
    fault(tmp_path, Loopback(url=closed_port()), OsmQuery(place="Smalltown"), refresh=True)
    assert dict(vars(settings)) == before


def test_servers_are_those_of_osmnx_unless_told(
    tmp_path: Path, server: Loopback, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("osmnx.settings.overpass_url", f"{server.url}/")
    assert download_osm(TOWN, tmp_path, servers=Servers()).overpass == server.url


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ({}, "exactly one of place, bbox and polygon"),
        ({"place": "A", "bbox": TOWN_BOX}, "place and bbox"),
        ({"place": "  "}, "must not be empty"),
        ({"bbox": (8.0, 50.0, 8.1)}, "four numbers"),
        ({"bbox": (8.1, 50.0, 8.0, 50.1)}, "west < east"),
        ({"bbox": (8.0, 50.0, float("nan"), 50.1)}, "four numbers"),
        ({"bbox": (8.0, 89.0, 8.1, 91.0)}, "within 180 and 90 degrees"),
        ({"place": "A", "road_classes": ()}, "must be some of"),
        ({"place": "A", "road_classes": ('x"];out;',)}, "must be some of"),
    ],
)
def test_questions_that_are_none(keys: dict[str, Any], expected: str) -> None:
    with pytest.raises(InputError, match=expected):
        OsmQuery(**keys)


@pytest.mark.parametrize(
    ("polygon", "expected"),
    [
        ("POLYGON ((0 0, 1 1, 1 0, 0 1, 0 0))", "no valid polygon"),
        ("POLYGON EMPTY", "with an area"),
        ("POLYGON ((500 0, 501 0, 501 1, 500 0))", "within 180 and 90 degrees"),
        ("nowhere.gpkg", "nor a file that is there"),
    ],
)
def test_polygons_that_are_none(
    tmp_path: Path, server: Loopback, polygon: str, expected: str
) -> None:
    with pytest.raises(InputError, match=expected):
        ask(tmp_path, server, OsmQuery(polygon=polygon))
    assert server.asked == []


def as_overpass_says(path: Path) -> dict[str, Any]:
    """All public roads of a file, their nodes and the restrictions that name them."""
    ways, wanted, roads, found = [], set(), set(), []
    for one in osmium.FileProcessor(path, osmium.osm.WAY):
        if one.tags.get("highway") in PUBLIC_ROADS:
            refs = [ref.ref for ref in one.nodes]
            ways.append({"type": "way", "id": one.id, "nodes": refs, "tags": dict(one.tags)})
            roads.add(one.id)
            wanted.update(refs)
    for one in osmium.FileProcessor(path, osmium.osm.NODE | osmium.osm.RELATION):
        told = {"id": one.id, "tags": dict(one.tags)}
        if isinstance(one, osmium.osm.Node):
            if one.id in wanted:
                place = {"lat": one.location.lat, "lon": one.location.lon}
                found.append({"type": "node"} | told | place)
        elif one.tags.get("type", "").startswith("restriction"):
            kinds = {"n": "node", "w": "way", "r": "relation"}
            members = [
                {"type": kinds[each.type], "ref": each.ref, "role": each.role}
                for each in one.members
            ]
            if any(each["type"] == "way" and each["ref"] in roads for each in members):
                found.append({"type": "relation", "members": members} | told)
    return {"osm3s": {"timestamp_osm_base": DATE}, "elements": ways + found}


@pytest.mark.parametrize("name", ["monaco-latest.osm.pbf", "reisterstown-via-restriction.osm.pbf"])
def test_downloaded_roads_are_those_of_the_whole_file(
    tmp_path: Path, server: Loopback, shared: Path, name: str
) -> None:
    whole = shared / "data" / "osm" / name
    body = json.dumps(as_overpass_says(whole)).encode()
    server.replies["/interpreter"] = [Reply(body=body)]
    got = read_osm_network(ask(tmp_path, server).path, OsmOptions())
    expected = read_osm_network(whole, OsmOptions())
    assert len(expected.links) > 100
    assert len(expected.movements) > 0
    pd.testing.assert_frame_equal(got.links, expected.links)
    # of paths and other ways that nobody has asked for a download knows nothing
    told = got.nodes["beyond"].fillna("other way") == expected.nodes["beyond"].fillna("other way")
    assert told.all()
    assert (got.nodes["beyond"].notna() <= expected.nodes["beyond"].notna()).all()
    beside = expected.nodes.drop(columns="beyond")
    pd.testing.assert_frame_equal(got.nodes.drop(columns="beyond"), beside)
    pd.testing.assert_frame_equal(got.movements, expected.movements)


def config(folder: Path, server: Loopback, **osm: Any) -> Path:
    own = {"overpass_url": server.url, "nominatim_url": server.url, "cache": "cache"}
    gravity = {
        "zones": {"cell_m": 400},
        "productions": {"road_km": 1},
        "attractions": {"road_km": 1},
        "total_vehicles": 100,
    }
    told = {
        "name": "run",
        "ingest": {
            "format": "osm",
            "osm": own | osm,
            "demand": [{"gravity": gravity, "demand_period_s": 600}],
        },
        "simulate": {"duration_s": 3600},
        "report": {"outputs": [], "plots": []},
    }
    path = folder / "run.yaml"
    path.write_text(yaml.safe_dump(told), encoding="utf-8")
    return path


def run(folder: Path, path: Path, *edits: str) -> int:
    sets = [word for edit in edits for word in ("--set", edit)]
    return main(["run", str(path), "--out", str(folder), *sets])


def ingest_record(folder: Path) -> dict[str, Any]:
    text = (folder / "run/manifest.json").read_text(encoding="utf-8")
    found: dict[str, Any] = json.loads(text)["stages"]["ingest"]
    return found


def test_a_place_to_a_finished_run(
    tmp_path: Path, server: Loopback, capsys: pytest.CaptureFixture[str]
) -> None:
    path = config(tmp_path, server, place="Smalltown")
    server.replies["/interpreter"] = [Reply(429, headers={"Retry-After": "5"})]
    assert run(tmp_path, path) == 0
    assert "busy; it is asked again in 5 s" in capsys.readouterr().err
    server.asked.remove("/interpreter")
    figures = json.loads((tmp_path / "run/summary.json").read_text(encoding="utf-8"))
    assert figures["vehicles_demanded"] > 0
    notes = read_network(tmp_path / "run/network").notes
    source = notes[notes["topic"] == "source"]
    assert any(DATE in note and "© OpenStreetMap" in note for note in source["note"])
    record = ingest_record(tmp_path)["inputs"]["osm.download"]
    assert record["sha256"] in set(source["value"])
    assert "Smalltown, Hesse, Germany" in set(source["value"])
    assert "osm.cache" not in "".join(ingest_record(tmp_path)["inputs"])
    capsys.readouterr()
    # a second run asks nobody, says of when the roads are, and has nothing to do
    (tmp_path / "cache/another.osm.gz").write_bytes(b"of another run")
    assert run(tmp_path, path) == 0
    shown = capsys.readouterr().err
    assert f"from the cache: Smalltown, Hesse, Germany; map of {DATE}" in shown
    assert "ingest: up to date" in shown
    assert server.asked == ["/search", "/interpreter"]
    assert main(["verify", str(tmp_path / "run")]) == 0


def test_a_finished_run_is_reported_again_without_its_download(
    tmp_path: Path, server: Loopback, capsys: pytest.CaptureFixture[str]
) -> None:
    path = config(tmp_path, server, bbox=list(TOWN_BOX))
    assert run(tmp_path, path) == 0
    shutil.rmtree(tmp_path / "cache")
    capsys.readouterr()
    edits = ("--set", "report.outputs=[geopackage]")
    assert main(["report", str(path), "--out", str(tmp_path), *edits]) == 0
    shown = capsys.readouterr().err
    assert "ingest: up to date; its downloads are gone and could not be checked (" in shown
    assert "simulate: up to date" in shown
    assert (tmp_path / "run/results.gpkg").is_file()
    assert server.asked == ["/interpreter"]
    assert main(["verify", str(tmp_path / "run")]) == 0
    assert "is gone since: that the run was made from it cannot be" in capsys.readouterr().out
    # what depends on the source asks for it again, and so does refresh
    assert run(tmp_path, path, "ingest.osm.private=true") == 0
    shutil.rmtree(tmp_path / "cache")
    assert run(tmp_path, path, "ingest.osm.private=true", "ingest.osm.refresh=true") == 0
    assert server.asked == ["/interpreter"] * 3


def test_the_configuration_that_names_a_place_runs(
    tmp_path: Path, server: Loopback, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(PLACES, "Bad Hersfeld, Germany", PLACES["Smalltown"])
    servers = [f"ingest.osm.{name}_url={server.url}" for name in ("overpass", "nominatim")]
    monkeypatch.setenv("UXSIM_GEO_CACHE", str(tmp_path / "cache"))
    path = REPOSITORY / "configs/osm_place.yaml"
    assert run(tmp_path, path, *servers, "report.outputs=[]", "report.plots=[]") == 0
    figures = json.loads((tmp_path / "osm_place/summary.json").read_text(encoding="utf-8"))
    assert figures["vehicles_departed"] > 0
    assert server.asked == ["/search", "/interpreter"]


def test_another_map_makes_ingestion_run_again(
    tmp_path: Path, server: Loopback, capsys: pytest.CaptureFixture[str]
) -> None:
    path = config(tmp_path, server, bbox=list(TOWN_BOX), refresh=True)
    assert run(tmp_path, path) == 0
    before = ingest_record(tmp_path)
    assert run(tmp_path, path) == 0
    assert ingest_record(tmp_path) == before
    assert "ingest: up to date" in capsys.readouterr().err
    answer = {"elements": [FAR_NODE | {"lat": 50.0}, FAR_NODE | {"id": 2, "lat": 50.01}, WAY]}
    server.replies["/interpreter"] = [Reply(body=json.dumps(answer).encode())]
    assert run(tmp_path, path) == 0
    assert len(server.asked) == 3
    after = ingest_record(tmp_path)
    assert after["inputs"]["osm.download"] != before["inputs"]["osm.download"]
    assert read_network(tmp_path / "run/network").links["source_id"].unique().tolist() == ["1"]


def test_a_place_without_a_network_is_one_error(
    tmp_path: Path, server: Loopback, capsys: pytest.CaptureFixture[str]
) -> None:
    server.url = closed_port()
    assert run(tmp_path, config(tmp_path, server, place="Smalltown")) == 2
    shown = capsys.readouterr().err
    assert "Traceback" not in shown
    assert shown.count("cannot be reached") == 1
    assert not (tmp_path / "run/manifest.json").exists()


def test_the_cache_is_where_the_environment_says(
    tmp_path: Path, server: Loopback, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = config(tmp_path, server, bbox=list(TOWN_BOX))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "shared"))
    monkeypatch.delenv("UXSIM_GEO_CACHE", raising=False)
    assert run(tmp_path, path, "ingest.osm.cache=null") == 0
    assert len(list((tmp_path / "shared/uxsim-geo/osm").glob("bbox-*.osm.gz"))) == 1
    monkeypatch.setenv("UXSIM_GEO_CACHE", str(tmp_path / "own"))
    # a run that is there needs no download: another one does
    assert run(tmp_path, path, "ingest.osm.cache=null", "name=other") == 0
    assert len(list((tmp_path / "own/osm").glob("bbox-*.osm.gz"))) == 1


@pytest.mark.parametrize(
    ("osm", "expected"),
    [
        ({}, "needs exactly one of file, place, bbox, polygon; none is given"),
        ({"place": "A", "bbox": list(TOWN_BOX)}, "not place and bbox"),
        ({"bbox": [8.0, 50.0]}, "four numbers: west, south, east, north"),
        ({"polygon": "nowhere.gpkg"}, "no such file"),
        ({"place": "A", "overpass_url": "ftp://x"}, "must be the address of a server"),
        ({"place": "A", "cache": "run.yaml"}, "is no folder"),
        ({"place": "A", "timeout_s": 0}, "greater than 0"),
    ],
)
def test_keys_that_do_not_fit(
    tmp_path: Path, server: Loopback, osm: dict[str, Any], expected: str
) -> None:
    path = config(tmp_path, server, **osm)
    with pytest.raises(InputError, match=expected):
        load_config(path)
