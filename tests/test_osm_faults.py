"""Files that are none, damaged, or made to do harm: an InputError that says why, and no more."""

from __future__ import annotations

import bz2
import gzip
import zlib
from contextlib import suppress
from pathlib import Path

import osmium
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from osm_files import DATA, node, osm, way

from uxsim_geo.errors import InputError
from uxsim_geo.network.osm import read_osm_network
from uxsim_geo.network.osm_guard import checked_format
from uxsim_geo.network.osm_options import OsmOptions

STREET = (node(1, 0, 0), node(2, 1, 0), way(10, [1, 2]))
GOOD = osm(*STREET).encode()

BOMB = """<?xml version="1.0"?>
<!DOCTYPE osm [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;"><!ENTITY c "&b;&b;&b;&b;">]>
<osm version="0.6"><node id="1" lat="0" lon="0"><tag k="name" v="&c;"/></node></osm>
"""
FILE_ENTITY = """<?xml version="1.0"?>
<!doctype osm [<!ENTITY a SYSTEM "file:///etc/hostname">]>
<osm version="0.6"><node id="1" lat="0" lon="0"><tag k="name" v="&a;"/></node></osm>
"""
#: a document type too far inside to be seen at the start
LATE = f"<!--{'x' * 100_000}-->{BOMB[22:]}"
#: the same, behind something that looks like the beginning
HIDDEN = f"<!-- <osm > {'x' * 100_000}-->{BOMB[22:]}"


def fault_of(path: Path, options: OsmOptions | None = None) -> str:
    with pytest.raises(InputError) as raised:
        read_osm_network(path, options or OsmOptions())
    assert str(raised.value).startswith(str(path))
    return str(raised.value)


def written(folder: Path, name: str, content: bytes) -> Path:
    path = folder / name
    path.write_bytes(content)
    return path


WRONG = {
    "empty": ("a.osm", b"", "is empty"),
    "blank": ("a.osm", b" \n" * 20, "not at its start"),
    "text": ("a.osm", b"hello, this is no map", "is no OpenStreetMap file"),
    "page": ("a.osm", b"<html><body>Too many requests</body></html>", "<osm> is not at its start"),
    "changes": ("a.osm", b"<osmChange version='0.6'></osmChange>", "changes"),
    "other name": ("a.txt", GOOD, "its name must end in"),
    "no name": (".osmx", GOOD, "its name must end in"),
    "pbf by name": ("a.osm.pbf", GOOD, "is plain XML, and its name says PBF"),
    "gzip by name": ("a.osm.gz", GOOD, "is plain XML, and its name says packed by gzip"),
    "packed unsaid": ("a.osm", gzip.compress(GOOD), "is packed by gzip, and its name says plain"),
    "other packing": ("a.osm.bz2", gzip.compress(GOOD), "packed by gzip"),
    "entities": ("a.osm", BOMB.encode(), "declares a document type"),
    "entities, packed": ("a.osm.gz", gzip.compress(BOMB.encode()), "declares a document type"),
    "entity of a file": ("a.osm", FILE_ENTITY.encode(), "declares a document type"),
    "entities in UTF-16": ("a.osm", BOMB.encode("utf-16"), "UTF-8"),
    "entities far inside": ("a.osm", LATE.encode(), "not at its start"),
    "entities behind a comment": ("a.osm", HIDDEN.encode(), "entities are not supported"),
    "cut off": ("a.osm", GOOD[:-20], "damaged or cut off"),
    "cut off, gzip": ("a.osm.gz", gzip.compress(GOOD)[:-9], "damaged or cut off"),
    "cut off, bzip2": ("a.osm.bz2", bz2.compress(GOOD)[:-9], "damaged or cut off"),
    "gzip of nothing": ("a.osm.gz", gzip.compress(b""), "not at its start"),
    "not UTF-8": ("a.osm", GOOD.replace(b"residential", b"\xff\xfe"), "cannot be read"),
    "far away": ("a.osm", GOOD.replace(b"lat='0.0000000'", b"lat='1e300'"), "coordinate"),
    "far beyond": ("a.osm", GOOD.replace(b"lat='0.0000000'", b"lat='1e12'"), "coordinate"),
    "beyond the pole": ("a.osm", GOOD.replace(b"lat='0.0000000'", b"lat='91'"), "node 1 is at"),
    "round the world": ("a.osm", GOOD.replace(b"lon='0.0009000'", b"lon='181'"), "node 2 is at"),
    "not a number": ("a.osm", GOOD.replace(b"lat='0.0000000'", b"lat='nan'"), "coordinate"),
    "id of text": ("a.osm", GOOD.replace(b"id='1'", b"id='one'"), "id"),
    "id of 65 bits": ("a.osm", GOOD.replace(b"id='1'", b"id='18446744073709551616'"), "id"),
    "no roads": ("a.osm", osm(*STREET[:2]).encode(), "no way has the tag highway"),
    "no nodes": ("a.osm", osm(STREET[2]).encode(), "none of the nodes"),
    "no links": ("a.osm", osm(node(1, 0, 0), way(10, [1])).encode(), "no piece of road"),
    "other roads": (
        "a.osm",
        osm(*STREET[:2], way(10, [1, 2], {"highway": "footway"})).encode(),
        "1 ways other road classes",
    ),
}


@pytest.mark.parametrize(("name", "content", "why"), WRONG.values(), ids=WRONG)
def test_wrong_files_are_told(tmp_path: Path, name: str, content: bytes, why: str) -> None:
    assert why in fault_of(written(tmp_path, name, content))


def test_what_is_no_file_is_told(tmp_path: Path) -> None:
    assert "there is no such file" in fault_of(tmp_path / "absent.osm")
    (tmp_path / "folder.osm").mkdir()
    assert "is a folder" in fault_of(tmp_path / "folder.osm")


@pytest.mark.parametrize(
    ("name", "pack"), [("a.osm.gz", gzip.compress), ("a.osm.bz2", bz2.compress)]
)
def test_what_unpacks_to_far_more_is_refused_before_it_is_parsed(
    tmp_path: Path, name: str, pack: object
) -> None:
    """40 MB of blanks before the end: 40 kB packed."""
    content = GOOD.replace(b"</osm>", b" " * 40_000_000 + b"</osm>")
    path = written(tmp_path, name, pack(content))  # type: ignore[operator]
    why = fault_of(path)
    assert "unpacks to more than 32 MB" in why
    assert "set max_unpacked_mb" in why
    network = read_osm_network(path, OsmOptions(max_unpacked_mb=50.0))
    assert len(network.links) == 2
    assert "more than 1 MB" in fault_of(path, OsmOptions(max_unpacked_mb=1.0))


# PBF: blocks of (length of the header, header, blob); fields as protocol buffers write them


def varint(value: int) -> bytes:
    out = b""
    while value > 127:
        out += bytes([value & 127 | 128])
        value >>= 7
    return out + bytes([value])


def field(number: int, value: int | bytes) -> bytes:
    if isinstance(value, int):
        return varint(number << 3) + varint(value)
    return varint(number << 3 | 2) + varint(len(value)) + value


def block(kind: bytes, content: bytes, raw_size: int | None = None) -> bytes:
    size = len(content) if raw_size is None else raw_size
    blob = field(2, size) + field(3, zlib.compress(content))
    header = field(1, kind) + field(3, len(blob))
    return len(header).to_bytes(4, "big") + header + blob


HEADER = block(b"OSMHeader", field(4, b"OsmSchema-V0.6") + field(4, b"DenseNodes"))


@pytest.fixture
def pbf(tmp_path: Path) -> bytes:
    path = tmp_path / "good.osm.pbf"
    with osmium.SimpleWriter(str(path)) as writer:
        for element in osmium.FileProcessor(str(DATA / "shapes.osm")):
            writer.add(element)
    return path.read_bytes()


@pytest.mark.parametrize("part", [0.2, 0.5, 0.9, 0.999])
def test_a_pbf_file_that_was_cut_off_is_told(tmp_path: Path, pbf: bytes, part: float) -> None:
    path = written(tmp_path, "a.osm.pbf", pbf[: int(len(pbf) * part)])
    assert "cut off" in fault_of(path)


@pytest.mark.parametrize(
    "blocks",
    [
        HEADER + b"\xff\xff\xff\xff",
        HEADER + (20).to_bytes(4, "big") + b"x" * 20,
        HEADER + (4).to_bytes(4, "big") + field(3, 1 << 30)[:4],
        HEADER + block(b"OSMData", b"\xff" * 100),
        HEADER + block(b"OSMData", b"\0" * 1000, raw_size=10),
        HEADER + block(b"OSMData", b"\0" * 1000, raw_size=1 << 40),
    ],
    ids=["header", "no fields", "cut", "no data", "larger than said", "said to be larger"],
)
def test_a_pbf_file_that_is_none_inside_is_told(tmp_path: Path, blocks: bytes) -> None:
    assert fault_of(written(tmp_path, "a.osm.pbf", blocks))


def test_blocks_that_unpack_to_far_more_are_refused_before_they_are(tmp_path: Path) -> None:
    bomb = block(b"OSMData", b"\0" * 30_000_000)
    path = written(tmp_path, "a.osm.pbf", HEADER + bomb + bomb)
    assert len(bomb) < 100_000
    assert "unpacks to more than 32 MB" in fault_of(path)


@settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_damaged_files_give_a_network_or_an_input_error(
    tmp_path: Path, pbf: bytes, data: st.DataObject
) -> None:
    name, content = data.draw(
        st.sampled_from([("b.osm", (DATA / "shapes.osm").read_bytes()), ("b.pbf", pbf)])
    )
    at = data.draw(st.integers(0, len(content) - 1))
    put = data.draw(st.binary(max_size=4))
    skip = data.draw(st.integers(0, 4))
    path = written(tmp_path, name, content[:at] + put + content[at + skip :])
    with suppress(InputError):
        read_osm_network(path, OsmOptions())


def test_the_guard_lets_good_files_pass(tmp_path: Path, pbf: bytes) -> None:
    from uxsim_geo.errors import Faults

    for name, content, expected in (
        ("A.OSM", GOOD, "xml"),
        ("a.osm", b"\xef\xbb\xbf<?xml version='1.0'?>\n" + GOOD, "xml"),
        ("a.b.xml.gz", gzip.compress(GOOD), "xml.gz"),
        ("a.osm.BZ2", bz2.compress(GOOD), "xml.bz2"),
        ("a.pbf", pbf, "pbf"),
    ):
        faults = Faults()
        assert checked_format(written(tmp_path, name, content), None, faults) == expected
        assert not faults.found
        read_osm_network(tmp_path / name, OsmOptions())
