"""Networks known by name, downloaded from a server on this computer."""

from __future__ import annotations

import errno
import gzip
import hashlib
import json
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
import yaml
from loopback import Reply, closed_port, serving
from small_run import CONFIG, NET, NODES, TRIPS, write_small_run

from pipeline.cli import main
from pipeline.config_file import load_config
from uxsim_geo.errors import InputError
from uxsim_geo.network.bounded_http import Patience
from uxsim_geo.network.files import read_network
from uxsim_geo.network.tntp_collection import read_collection
from uxsim_geo.network.tntp_download import Shelf, download_network

FILES = {"net": NET, "nodes": NODES, "trips": TRIPS}

COMMIT = "0123456789abcdef"

TERMS = "for tests only"


@dataclass
class FileServer:
    """Serves the small network; ``replies`` come first, by path, one each."""

    url: str = ""
    asked: list[str] = field(default_factory=list)
    agents: list[str] = field(default_factory=list)
    replies: dict[str, list[Reply]] = field(default_factory=dict)

    def reply(self, path: str, text: str) -> Reply:  # noqa: ARG002
        self.asked.append(path)
        if self.replies.get(path):
            return self.replies[path].pop(0)
        files = {path_of(role): Reply(body=text.encode()) for role, text in FILES.items()}
        return files.get(path, Reply(404))


def path_of(role: str) -> str:
    return f"/{COMMIT}/Small-Town/{role}.tntp"


def write_collection(path: Path, url: str) -> None:
    """The small network as a collection of its own, and one that has no trips."""
    lines = [
        'repository = "https://data.example"',
        f'commit = "{COMMIT}"',
        f'url = "{url}/{{commit}}"',
        'citation = "Small Networks for Tests"',
        f'terms = "{TERMS}"',
        f'credit = "Small Networks, {TERMS}"',
    ]
    for name, roles in (("Small-Town", ("net", "nodes", "trips")), ("Tripless", ("net",))):
        lines += [f"[networks.{name}]", f'about = "{name}, for tests"', 'note = "not to scale"']
        lines += ["zones = 2", "nodes = 4", "links = 3"]
        units = 'length_unit = "m", time_unit = "s", capacity_unit = "veh/h"'
        lines.append(f'keys = {{ {units}, crs = "none" }}')
        for role in roles:
            content = FILES[role].encode()
            lines += [f"[networks.{name}.files.{role}]", f'name = "{role}.tntp"']
            lines += [f"size = {len(content)}", f'sha256 = "{hashlib.sha256(content).hexdigest()}"']
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


@pytest.fixture
def server(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[FileServer]:
    """A server of the collection, which is the one shipped; the cache is a folder of the test."""
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    monkeypatch.setenv("UXSIM_GEO_CACHE", str(tmp_path / "cache"))
    state = FileServer()
    with serving(state):
        set_server(tmp_path, monkeypatch, state.url)
        yield state


def set_server(folder: Path, monkeypatch: pytest.MonkeyPatch, url: str) -> None:
    write_collection(folder / "collection.toml", url)
    monkeypatch.setattr("uxsim_geo.network.tntp_collection.SHIPPED", folder / "collection.toml")


def shelf_at(folder: Path) -> Shelf:
    return Shelf(read_collection(), folder / "cache/tntp")


def fetch(folder: Path, waited: list[float] | None = None, **more: Any) -> dict[Any, Path]:
    log = [] if waited is None else waited
    shelf = shelf_at(folder)
    network = shelf.collection.find("Small-Town")
    patience = Patience(timeout_s=10.0, wait=log.append)
    return download_network(shelf, network, tuple(network.files), patience=patience, **more)


def fault(folder: Path, waited: list[float] | None = None) -> str:
    with pytest.raises(InputError) as caught:
        fetch(folder, waited)
    assert len(caught.value.faults) == 1
    return str(caught.value)


def kept(folder: Path) -> dict[str, str]:
    """All files below the cache, hidden ones too, with what is in them."""
    files = [path for path in (folder / "cache").rglob("*") if path.is_file()]
    return {path.name: path.read_bytes().decode() for path in files}


RIGHT = {f"{role}.tntp": text for role, text in FILES.items()}
WITHOUT_TRIPS = {name: text for name, text in RIGHT.items() if name != "trips.tntp"}


def test_the_files_come_as_they_are(tmp_path: Path, server: FileServer) -> None:
    paths = fetch(tmp_path)
    assert paths == {
        role: tmp_path / f"cache/tntp/Small-Town/{role}.tntp" for role in ("net", "nodes", "trips")
    }
    assert kept(tmp_path) == RIGHT
    assert server.asked == [path_of(role) for role in FILES]
    assert all(agent.startswith("uxsim-geo/") for agent in server.agents)


def test_what_is_in_the_cache_is_not_asked_for(tmp_path: Path, server: FileServer) -> None:
    first = fetch(tmp_path)
    before = {path: path.stat() for path in first.values()}
    assert fetch(tmp_path) == first
    assert {path: path.stat() for path in first.values()} == before
    assert len(server.asked) == 3
    first["nodes"].unlink()
    assert fetch(tmp_path) == first
    assert server.asked[3:] == [path_of("nodes")]


def test_a_packed_answer_is_measured_unpacked(tmp_path: Path, server: FileServer) -> None:
    packed = Reply(body=gzip.compress(NET.encode()), headers={"Content-Encoding": "gzip"})
    server.replies[path_of("net")] = [packed]
    fetch(tmp_path)
    assert kept(tmp_path) == RIGHT
    bomb = gzip.compress(b" " * 10_000_000)
    server.replies[path_of("net")] = [Reply(body=bomb, headers={"Content-Encoding": "gzip"})]
    (tmp_path / "cache/tntp/Small-Town/net.tntp").unlink()
    assert "longer than the file" in fault(tmp_path)


def test_the_proxy_of_the_environment_is_used(
    tmp_path: Path, server: FileServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("NO_PROXY")
    monkeypatch.setenv("HTTP_PROXY", server.url)
    monkeypatch.setenv("http_proxy", server.url)
    set_server(tmp_path, monkeypatch, "http://data.example")
    fetch(tmp_path)
    assert kept(tmp_path) == RIGHT
    assert len(server.asked) == 3


@pytest.mark.parametrize(
    ("reply", "expected"),
    [
        (Reply(body=TRIPS.replace("100.0", "100.1").encode()), "another file: its SHA-256 is"),
        (Reply(body=TRIPS.encode() + b" "), f"longer than the file, which has {len(TRIPS)} bytes"),
        (Reply(body=TRIPS.encode()[:-1]), f"has {len(TRIPS) - 1} bytes, and the file {len(TRIPS)}"),
        (Reply(), f"has 0 bytes, and the file {len(TRIPS)}"),
        (Reply(body=TRIPS.encode()[:-1], cut=True), "cannot be read or was cut off"),
        (Reply(body=b"nonsense", headers={"Content-Encoding": "gzip"}), "cannot be read"),
        (Reply(404), "answers 404 Not Found"),
        (Reply(500), "answers 500 Internal Server Error"),
        (Reply(302, headers={"Location": "http://login.example/"}), "which is not followed"),
    ],
)
def test_answers_that_are_not_the_file(
    tmp_path: Path, server: FileServer, reply: Reply, expected: str
) -> None:
    server.replies[path_of("trips")] = [reply]
    text = fault(tmp_path)
    assert text.startswith(f"Small-Town: {server.url}{path_of('trips')}: ")
    assert expected in text
    # the others have come; of this one nothing is left
    assert kept(tmp_path) == WITHOUT_TRIPS
    # how to go on names what is missing and nothing else
    where, *urls = text.splitlines()
    assert where.endswith(f"put into {tmp_path}/cache/tntp/Small-Town by hand what is at")
    assert urls == [f"  {server.url}{path_of('trips')}"]
    fetch(tmp_path)
    assert kept(tmp_path) == RIGHT


def test_a_busy_server_is_asked_again_but_not_for_ever(tmp_path: Path, server: FileServer) -> None:
    busy = Reply(503, headers={"Retry-After": "7"})
    server.replies[path_of("net")] = [busy]
    waited: list[float] = []
    fetch(tmp_path, waited)
    assert waited == [7.0]
    server.replies[path_of("nodes")] = [busy] * 9
    (tmp_path / "cache/tntp/Small-Town/nodes.tntp").unlink()
    assert "answers 503: the server is not available; asked 3 times" in fault(tmp_path, waited)
    assert waited == [7.0] * 3


def test_a_changed_file_is_told_and_replaced(tmp_path: Path, server: FileServer) -> None:
    net = fetch(tmp_path)["net"]
    changed = NET.replace("1800", "1801").encode()
    net.write_bytes(changed)
    said: list[str] = []
    server.replies[path_of("net")] = [Reply(404)]
    # until the right one is there, the changed one stays
    assert "what lies there is another file" in fault(tmp_path)
    assert net.read_bytes() == changed
    fetch(tmp_path, say=said.append)
    assert said[0] == f"{net} is another file, by its SHA-256; it is downloaded anew"
    assert kept(tmp_path) == RIGHT


def test_without_a_network_it_says_how_to_do_it_by_hand(
    tmp_path: Path, server: FileServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    nobody = closed_port()
    set_server(tmp_path, monkeypatch, nobody)
    where, *urls = fault(tmp_path).splitlines()
    assert where.startswith(f"Small-Town: {nobody} cannot be reached (")
    assert where.count("cannot be reached") == 1
    folder = Path(re.search("put into (.*) by hand", where)[1])  # type: ignore[index]
    assert urls == [f"  {nobody}{path_of(role)}" for role in FILES]
    # and so it is done
    folder.mkdir(parents=True)
    for url in urls:
        name = url.rpartition("/")[2]
        (folder / name).write_text(RIGHT[name], encoding="utf-8")
    assert set(fetch(tmp_path)) == set(FILES)
    # another file in such a place is not believed
    (folder / "net.tntp").write_text("something else", encoding="utf-8")
    where, *urls = fault(tmp_path).splitlines()
    assert urls == [f"  {nobody}{path_of('net')} (what lies there is another file, by its SHA-256)"]
    assert server.asked == []


def test_a_download_that_is_interrupted_leaves_nothing(
    tmp_path: Path, server: FileServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = Path.write_bytes

    def full(path: Path, content: bytes) -> int:
        write(path, content[:10])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def stopped(path: Path, content: bytes) -> int:
        write(path, content[:10])
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "write_bytes", full)
    assert "cannot be written to the cache" in (text := fault(tmp_path))
    assert "No space left" in text
    assert kept(tmp_path) == {}
    monkeypatch.setattr(Path, "write_bytes", stopped)
    with pytest.raises(KeyboardInterrupt):
        fetch(tmp_path)
    monkeypatch.undo()
    assert kept(tmp_path) == {}
    assert len(server.asked) == 2


def test_a_cache_that_cannot_be_written(
    tmp_path: Path, server: FileServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "cache").write_text("a file where the folder should be", encoding="utf-8")
    text = fault(tmp_path)
    assert text == (
        f"Small-Town: cannot be written to the cache {tmp_path}/cache/tntp/Small-Town: "
        f"{os.strerror(errno.ENOTDIR)}"
    )
    (tmp_path / "cache").unlink()

    def denied(path: Path, *_: object, **__: object) -> None:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))

    monkeypatch.setattr(Path, "mkdir", denied)
    assert "Permission denied" in fault(tmp_path)
    assert len(server.asked) == 2


@pytest.mark.parametrize("name", ["Small-Town", "small_town", "SMALLTOWN", " small town "])
def test_names_are_understood_as_people_write_them(
    tmp_path: Path, server: FileServer, name: str
) -> None:
    assert read_collection().find(name).name == "Small-Town"
    assert main(["fetch", name]) == 0
    assert kept(tmp_path) == RIGHT
    assert len(server.asked) == 3


@pytest.mark.parametrize(
    ("name", "hint"),
    [("smaltown", "did you mean Small-Town? There are"), ("Paris", "Paris; There are"), ("", "; ")],
)
def test_unknown_names(
    server: FileServer, capsys: pytest.CaptureFixture[str], name: str, hint: str
) -> None:
    assert main(["fetch", name]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert hint in shown.err
    assert shown.err.endswith("There are Small-Town, Tripless\n")
    assert server.asked == []


def test_the_list_says_what_is_there(
    tmp_path: Path, server: FileServer, capsys: pytest.CaptureFixture[str]
) -> None:
    for there in ("no", "1 of 3", "yes"):
        assert main(["fetch"]) == 0
        shown = capsys.readouterr().out
        assert re.search(rf"^Small-Town +2 +3 +\d+ B +{there} +net nodes trips$", shown, re.M)
        assert re.search(r"^Tripless +2 +3 +\d+ B +no +net$", shown, re.MULTILINE)
        assert "Small-Town, for tests: not to scale" in shown
        assert TERMS in shown
        assert COMMIT in shown
        if there == "no":
            folder = tmp_path / "cache/tntp/Small-Town"
            folder.mkdir(parents=True)
            (folder / "net.tntp").write_text(NET, encoding="utf-8")
            (folder / "nodes.tntp").write_text("other", encoding="utf-8")
        elif there == "1 of 3":
            fetch(tmp_path)
    assert main(["fetch", "--list", "Small-Town"]) == 0
    assert capsys.readouterr().out == shown
    assert len(server.asked) == 2


def test_faults_of_the_command(
    tmp_path: Path,
    server: FileServer,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    server.replies[path_of("net")] = [Reply(404)]
    assert main(["fetch", "Small-Town"]) == 2
    set_server(tmp_path, monkeypatch, closed_port())
    (tmp_path / "cache/tntp/Small-Town/nodes.tntp").unlink()
    assert main(["fetch", "Small-Town"]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.count("error: ") == 2
    assert "Traceback" not in shown.err


def without_outputs(text: str) -> dict[str, Any]:
    told: dict[str, Any] = yaml.safe_load(text)
    return told | {"report": {"outputs": [], "plots": []}}


def run_of(folder: Path, told: dict[str, Any]) -> dict[str, Any]:
    """Run a configuration; return the stage of ingestion as the manifest has it."""
    path = folder / "run.yaml"
    path.write_text(yaml.safe_dump(told | {"name": "run"}), encoding="utf-8")
    assert main(["run", str(path), "--out", str(folder)]) == 0
    text = (folder / "run/manifest.json").read_text(encoding="utf-8")
    stage: dict[str, Any] = json.loads(text)["stages"]["ingest"]
    return stage


def test_the_configuration_shown_runs_and_says_where_its_data_are_from(
    tmp_path: Path, server: FileServer, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["fetch", "small town"]) == 0
    shown = capsys.readouterr()
    assert "Small Networks for Tests" in shown.out
    assert f"Small-Town: 3 files in {tmp_path}/cache/tntp/Small-Town" in shown.err
    stage = run_of(tmp_path, without_outputs(shown.out))
    assert list(stage["inputs"]) == ["dataset.net", "dataset.nodes", "dataset.trips"]
    hashes = [record["sha256"] for record in stage["inputs"].values()]
    figures = json.loads((tmp_path / "run/summary.json").read_text(encoding="utf-8"))
    assert figures["vehicles_completed"] == 100
    notes = read_network(tmp_path / "run/network").notes
    source = notes[notes["topic"] == "source"]
    assert source["value"].iloc[0] == f"{server.url}/{COMMIT}/Small-Town"
    assert source["value"].iloc[1:].tolist() == hashes
    assert hashes == [hashlib.sha256(text.encode()).hexdigest() for text in FILES.values()]
    assert all(word in source["note"].iloc[0] for word in ("Small Networks", COMMIT, TERMS))
    page = (tmp_path / "run/import_notes.html").read_text(encoding="utf-8")
    assert f"Data: Small-Town: Small Networks, {TERMS}." in page
    assert len(server.asked) == 3


def test_a_run_fetches_by_itself_and_then_needs_no_network(
    tmp_path: Path,
    server: FileServer,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    write_small_run(tmp_path)
    told = without_outputs(CONFIG)
    run_of(tmp_path, told)
    by_files = read_network(tmp_path / "run/network")
    for key in ("net", "nodes"):
        del told["ingest"][key]
    told["ingest"]["dataset"] = "small-town"
    del told["ingest"]["trips"]["file"]
    first = run_of(tmp_path, told)
    by_name = read_network(tmp_path / "run/network")
    assert by_name.links.equals(by_files.links)
    assert by_name.nodes.equals(by_files.nodes)
    assert f"{tmp_path}/cache/tntp/Small-Town/net.tntp: {len(NET)} bytes" in capsys.readouterr().err
    # as resolved, the configuration runs too, and its data set is still named as one
    resolved = load_config(tmp_path / "run/config.yaml").ingest
    assert (resolved.dataset, resolved.net, resolved.trips[0].file) == ("Small-Town", None, None)
    set_server(tmp_path, monkeypatch, closed_port())
    again = run_of(tmp_path, told)
    assert again == first
    assert "ingest: up to date" in capsys.readouterr().err
    assert main(["verify", str(tmp_path / "run")]) == 0
    # nor does it need what it has read: the run's own tables are there
    shelf = tmp_path / "cache/tntp/Small-Town"
    shelf.rename(tmp_path / "elsewhere")
    assert run_of(tmp_path, told) == first
    assert "its downloads are gone and could not be checked" in capsys.readouterr().err
    (tmp_path / "elsewhere").rename(shelf)
    # a file changed since is not read
    net = tmp_path / "cache/tntp/Small-Town/net.tntp"
    net.write_text(NET.replace("1800", "1801"), encoding="utf-8")
    assert main(["run", str(tmp_path / "run.yaml"), "--out", str(tmp_path)]) == 2
    assert "what lies there is another file" in capsys.readouterr().err
    assert len(server.asked) == 3


def test_own_files_take_the_place_of_those_of_the_data_set(
    tmp_path: Path, server: FileServer
) -> None:
    write_small_run(tmp_path)
    told = without_outputs(CONFIG)
    del told["ingest"]["net"]
    told["ingest"]["dataset"] = "Small-Town"
    stage = run_of(tmp_path, told)
    assert set(stage["inputs"]) == {"dataset.net", "nodes", "trips.0.file"}
    assert server.asked == [path_of("net")]


@pytest.mark.parametrize(
    ("section", "expected"),
    [
        (
            {"dataset": "smaltown"},
            r"run.yaml:3: ingest.dataset: no data set .* name smaltown; did you mean Small-Town\?",
        ),
        ({"dataset": "Tripless"}, "trips.file is missing: dataset Tripless has no trips"),
        ({"net": "net.tntp"}, "trips.file is missing: the trips file"),
        ({}, "net is missing: the network file, TNTP; or name a dataset"),
        ({"dataset": "Small-Town", "format": "csv"}, "csv is missing"),
    ],
)
def test_keys_that_do_not_fit(
    tmp_path: Path, server: FileServer, section: dict[str, str], expected: str
) -> None:
    write_small_run(tmp_path)
    units = {"length_unit": "m", "time_unit": "s", "capacity_unit": "veh/h", "crs": "none"}
    told = {
        "name": "run",
        "ingest": section | {"trips": {"demand_period_s": 600}} | units,
        "simulate": {"duration_s": 1200},
    }
    path = tmp_path / "run.yaml"
    path.write_text(yaml.safe_dump(told, sort_keys=False), encoding="utf-8")
    with pytest.raises(InputError, match=expected):
        load_config(path)
    assert server.asked == []


def test_the_collection_that_is_shipped_is_whole() -> None:
    collection = read_collection()
    assert re.fullmatch("[0-9a-f]{40}", collection.commit)
    assert collection.url.startswith("https://")
    assert collection.commit in collection.url
    assert "academic research" in collection.terms
    digests = [
        file.sha256 for network in collection.networks.values() for file in network.files.values()
    ]
    assert all(re.fullmatch("[0-9a-f]{64}", digest) for digest in digests)
    assert len(set(digests)) == len(digests) > 20
    assert all("net" in network.files for network in collection.networks.values())


NAMES = list(read_collection().networks)


@pytest.mark.parametrize("name", NAMES)
def test_the_measured_files_are_those_of_the_collection(
    tmp_path: Path,
    shared: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    name: str,
) -> None:
    """And the configuration shown for them makes a network of them, without a server."""
    monkeypatch.setenv("UXSIM_GEO_CACHE", str(tmp_path / "cache"))
    (tmp_path / "cache").mkdir()
    (tmp_path / "cache/tntp").symlink_to(shared / "data/tntp")
    assert main(["fetch", name]) == 0
    told = without_outputs(capsys.readouterr().out)
    known = read_collection().networks[name]
    if "trips" not in known.files:
        assert told["ingest"].pop("demand") is not None
        (tmp_path / "od.csv").write_text("origin,destination,vehicles\n1,2,10\n", encoding="utf-8")
        told["ingest"]["demand"] = [{"od": {"file": "od.csv"}, "demand_period_s": 3600}]
    path = tmp_path / "run.yaml"
    path.write_text(yaml.safe_dump(told), encoding="utf-8")
    assert main(["ingest", str(path), "--out", str(tmp_path), "--quiet"]) == 0
    network = read_network(tmp_path / told["name"] / "network")
    assert 0 < len(network.links) <= known.links
    assert 0 < len(network.nodes) <= known.nodes
