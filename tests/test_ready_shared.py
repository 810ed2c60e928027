"""Measured cities made ready: fit, whole, short of short links, and with the ways they had."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from road_tables import in_order, shuffled
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from uxsim_geo.network.check import check_network
from uxsim_geo.network.files import write_network
from uxsim_geo.network.network import Network
from uxsim_geo.network.osm import read_osm_network
from uxsim_geo.network.osm_options import OsmOptions
from uxsim_geo.network.ready import make_ready
from uxsim_geo.network.ready_options import ReadyOptions

FILES = (
    "bad-hersfeld.osm.xml.gz",
    "heidelberg.osm.pbf",
    "monaco-latest.osm.pbf",
    "sao-paulo-centro.osm.pbf",
    "portland-central-filtered.osm.pbf",
    "porto-alegre.osm.pbf",
    "reisterstown-via-restriction.osm.pbf",
)


def read(shared: Path, name: str) -> Network:
    return read_osm_network(shared / "data" / "osm" / name, OsmOptions())


@pytest.fixture(scope="module", params=FILES)
def both(request: pytest.FixtureRequest, shared: Path) -> tuple[Network, Network]:
    """The network as it was read, and made ready."""
    network = read(shared, request.param)
    return network, make_ready(network, ReadyOptions())


def short(network: Network) -> int:
    """Links that are driven in less than 5 s."""
    return int((network.links["length"] < 5.0 * network.links["free_speed"]).sum())


def test_it_can_be_simulated(both: tuple[Network, Network]) -> None:
    _, network = both
    check_network(replace(network, movements=network.movements[:0]))
    assert network.links.crs.axis_info[0].unit_name == "metre"
    assert not (network.links["from_node_id"] == network.links["to_node_id"]).any()
    length = network.links["length"]
    drawn = np.asarray(network.links.geometry.length)
    assert length.sum() == pytest.approx(drawn.sum(), rel=0.01)


def test_every_node_reaches_every_other(both: tuple[Network, Network]) -> None:
    _, network = both
    ids = pd.Index(network.nodes["node_id"])
    start, end = (
        ids.get_indexer(pd.Index(network.links[f"{side}_node_id"])) for side in ("from", "to")
    )
    graph = csr_array((np.ones(len(start)), (start, end)), shape=(len(ids), len(ids)))
    assert connected_components(graph, connection="strong")[0] == 1


def test_far_ways_stay_within_one_percent(both: tuple[Network, Network]) -> None:
    """Of sampled ways all; shorter ones by no more than 1 % of a kilometre."""
    _, network = both
    notes = network.notes[network.notes["topic"] == "distortion"].set_index("note")["value"]
    assert not notes.index.str.contains("lead nowhere").any()
    for measure in ("length", "free-flow time"):
        own = notes[notes.index.str.startswith(measure)].astype(float)
        assert own[own.index.str.contains("share within")].item() == 1.0
        assert own[own.index.str.contains("greatest change; value: share")].item() <= 0.01
        assert own[own.index.str.contains("99th")].item() <= 0.005
    lengths = notes[notes.index.str.startswith("length")].astype(float)
    sampled = lengths[lengths.index.str.contains("below 1 km: greatest change; value: m")].item()
    assert sampled <= lengths[lengths.index.str.startswith("length of all ways")].item() <= 10.0


def test_fewer_links_are_short(both: tuple[Network, Network]) -> None:
    before, after = both
    assert short(after) < 0.85 * short(before)


def test_what_fell_out_adds_up(both: tuple[Network, Network]) -> None:
    """Links that fell out, by reason and piece by piece, are the same number."""
    before, after = both
    notes = after.notes[after.notes["topic"] == "fell out"]
    number = notes["note"].str.extract(r"(\d+) links?")[0].astype(int)
    total = number[notes["element_id"].isna()].sum()
    assert total == number[notes["element_id"].notna()].sum()
    assert 0 <= total < len(before.links) / 3
    assert set(notes["element_id"].dropna()).isdisjoint(after.links["link_id"])


def test_every_source_link_is_somewhere(both: tuple[Network, Network]) -> None:
    """Sources of links that are left are sources of before, and no kept road lost its own."""
    before, after = both
    own = {name for names in after.links["source_id"] for name in names.split("; ")}
    assert own <= set(before.links["source_id"])


def test_rows_in_another_order_give_the_same(shared: Path, tmp_path: Path) -> None:
    network = read(shared, "monaco-latest.osm.pbf")
    one, other = (make_ready(tables, ReadyOptions()) for tables in (network, shuffled(network, 1)))
    for table, same in zip(in_order(one), in_order(other), strict=True):
        pd.testing.assert_frame_equal(table, same)
    again = make_ready(network, ReadyOptions())
    hashes = []
    for number, tables in enumerate((one, again)):
        paths = write_network(tables, tmp_path / str(number))
        hashes.append([hashlib.sha256(path.read_bytes()).hexdigest() for path in paths])
    assert hashes[0] == hashes[1]
