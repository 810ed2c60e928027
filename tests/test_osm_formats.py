"""The same data give the same bytes: from every format, and in any order of the file."""

from __future__ import annotations

import bz2
import gzip
import random
import shutil
from pathlib import Path

import osmium
import pytest
from osm_files import DATA

from uxsim_geo.network.files import write_network
from uxsim_geo.network.osm import read_osm_network
from uxsim_geo.network.osm_options import OsmOptions

FILES = ("edges.osm", "lanes.osm", "shapes.osm", "speeds.osm")
ENDINGS = ("osm", "osm.xml", "xml", "osm.gz", "osm.xml.gz", "osm.bz2", "xml.bz2", "osm.pbf", "pbf")


def bytes_of(path: Path, folder: Path) -> list[bytes]:
    """The files of the network's tables."""
    network = read_osm_network(path, OsmOptions())
    return [table.read_bytes() for table in write_network(network, folder)]


def converted(source: Path, ending: str, folder: Path) -> Path:
    """The same data in another format."""
    path = folder / f"converted.{ending}"
    if ending.endswith("gz"):
        path.write_bytes(gzip.compress(source.read_bytes()))
    elif ending.endswith("bz2"):
        path.write_bytes(bz2.compress(source.read_bytes()))
    elif ending.endswith("pbf"):
        rewrite(source, path)
    else:
        shutil.copy(source, path)
    return path


def rewrite(source: Path, path: Path) -> None:
    """Let osmium write the elements; deleted ones it would write as if they were there."""
    with osmium.SimpleWriter(str(path)) as writer:
        for element in osmium.FileProcessor(str(source)):
            if not element.deleted:
                writer.add(element)


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("name", FILES)
def test_every_format_gives_the_same_bytes(tmp_path: Path, name: str, ending: str) -> None:
    expected = bytes_of(DATA / name, tmp_path / "xml")
    path = converted(DATA / name, ending, tmp_path)
    assert bytes_of(path, tmp_path / "converted") == expected


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", FILES)
def test_any_order_of_the_file_gives_the_same_bytes(tmp_path: Path, name: str, seed: int) -> None:
    expected = bytes_of(DATA / name, tmp_path / "ordered")
    elements = shuffled(DATA / name, seed)
    path = tmp_path / "shuffled.osm"
    path.write_text("\n".join(["<osm version='0.6'>", *elements, "</osm>"]), encoding="utf-8")
    assert bytes_of(path, tmp_path / "shuffled") == expected


def shuffled(path: Path, seed: int) -> list[str]:
    """The elements of a file in another order: ways before their nodes, large ids first."""
    from xml.etree import ElementTree

    root = ElementTree.parse(path).getroot()
    elements = [ElementTree.tostring(element, encoding="unicode") for element in root]
    random.Random(seed).shuffle(elements)
    return elements


def test_real_files_give_the_same_bytes_from_every_format(shared: Path, tmp_path: Path) -> None:
    for number, name in enumerate(("moorgate.osm.pbf", "o2s_fremantle_placement.osm")):
        source = shared / "data" / "osm" / name
        expected = bytes_of(source, tmp_path / f"{number}")
        for ending in ("osm", "osm.gz", "osm.bz2", "pbf"):
            path = tmp_path / f"{number}.{ending}"
            rewrite(source, path)
            assert bytes_of(path, tmp_path / f"{number}{ending}") == expected, path.name
