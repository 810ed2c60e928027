"""Tables on disk: what is read is what was written, in the same bytes, or not there at all."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
from tntp_files import net, row, trips, write

from uxsim_geo.demand.files import read_demand, write_demand
from uxsim_geo.demand.profile import TripsOptions
from uxsim_geo.demand.tntp import read_tntp_trips
from uxsim_geo.errors import InputError
from uxsim_geo.files import replace_when_complete
from uxsim_geo.network.files import read_network, write_network
from uxsim_geo.network.network import Network
from uxsim_geo.network.tntp import read_tntp_network
from uxsim_geo.network.tntp_options import TntpOptions

UNITS = TntpOptions(length_unit="km", time_unit="min", capacity_unit="veh/h")


def network_with(folder: Path, crs: str) -> Network:
    nodes = write(folder, "node.tntp", "node x y\n1 -96.5 43.5\n2 -96.25 43.75\n")
    path = write(folder, "net.tntp", net([row(1, 2), row(2, 1)], zones=2))
    return read_tntp_network(path, replace(UNITS, crs=crs), nodes=nodes)


@pytest.mark.parametrize("crs", ["EPSG:4326", "none"])
def test_a_network_comes_back_as_it_was(tmp_path: Path, crs: str) -> None:
    network = network_with(tmp_path, crs)
    paths = write_network(network, tmp_path / "run" / "network")
    assert [path.name for path in paths] == [
        "nodes.parquet",
        "links.parquet",
        "movements.parquet",
        "import_notes.parquet",
    ]
    found = read_network(tmp_path / "run" / "network")
    for table in ("nodes", "links", "movements", "notes"):
        pd.testing.assert_frame_equal(getattr(found, table), getattr(network, table))
    assert found.links.crs == network.links.crs
    assert (found.links.crs is None) == (crs == "none")


def test_tables_without_geometry_come_back_too(tmp_path: Path) -> None:
    network = network_with(tmp_path, "none")
    plain = replace(network, links=pd.DataFrame(network.links.drop(columns="geometry")))
    write_network(plain, tmp_path)
    pd.testing.assert_frame_equal(read_network(tmp_path).links, plain.links)


def test_the_same_tables_give_the_same_bytes(tmp_path: Path) -> None:
    network = network_with(tmp_path, "EPSG:4326")
    pairs = [write_network(network, tmp_path / name) for name in ("a", "b")]
    for first, second in zip(*pairs, strict=True):
        assert first.read_bytes() == second.read_bytes()


def test_a_demand_comes_back_as_it_was(tmp_path: Path) -> None:
    network = network_with(tmp_path, "none")
    path = write(tmp_path, "trips.tntp", trips("Origin 1\n 1 : 2.0; 2 : 3.0;\n"))
    demand = read_tntp_trips(path, TripsOptions(3600.0), network)
    write_demand(demand, tmp_path / "demand.parquet")
    found = read_demand(tmp_path / "demand.parquet")
    pd.testing.assert_frame_equal(found.table, demand.table)
    pd.testing.assert_frame_equal(found.notes, demand.notes)


def test_files_that_are_missing_or_none_are_all_named(tmp_path: Path) -> None:
    write_network(network_with(tmp_path, "none"), tmp_path)
    (tmp_path / "nodes.parquet").unlink()
    (tmp_path / "links.parquet").write_bytes(b"PAR1 no more")
    with pytest.raises(InputError) as raised:
        read_network(tmp_path)
    assert len(raised.value.faults) == 2
    assert "nodes.parquet: there is no such file" in str(raised.value)
    assert "links.parquet: is not a Parquet table" in str(raised.value)


def test_a_file_appears_only_when_it_is_complete(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("before")
    with pytest.raises(KeyError), replace_when_complete(path) as temporary:  # noqa: PT012
        temporary.write_text("half")
        assert temporary.suffix == ".csv"
        assert path.read_text() == "before"
        raise KeyError
    assert [file.name for file in tmp_path.iterdir()] == ["table.csv"]
    with replace_when_complete(path) as temporary:
        temporary.write_text("after")
    assert path.read_text() == "after"
    assert [file.name for file in tmp_path.iterdir()] == ["table.csv"]
