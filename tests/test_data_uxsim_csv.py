"""The loader of UXsim's tables: trailing commas, further columns, Japanese encoding."""

from __future__ import annotations

from pathlib import Path

import pytest
from uxsim_csv import read_uxsim_demand, read_uxsim_network

from uxsim_geo.demand.check import check_demand
from uxsim_geo.network.check import check_network
from uxsim_geo.network.network import LINK_COLUMNS, NODE_COLUMNS


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp932"])
@pytest.mark.parametrize("tail", ["", ","])
def test_tables_in_any_of_their_dresses(tmp_path: Path, encoding: str, tail: str) -> None:
    tables = {
        "nodes": ["name,x,y", "橋,1.5,-2", "10276762426,0,0"],
        "links": [
            "name,start,end,length,u,kappa,merge_priority",
            "通り,橋,10276762426,500,20,0.2,0.5",
        ],
        "demand": ["orig,dest,start_t,end_t,q,volume", "橋,10276762426,100,300,0.25,50"],
    }
    for name, lines in tables.items():
        text = "".join(f"{line}{tail}\n" for line in lines)
        (tmp_path / name).write_bytes(text.encode(encoding))
    network = read_uxsim_network(tmp_path / "nodes", tmp_path / "links")
    demand = read_uxsim_demand(tmp_path / "demand")
    check_network(network)
    check_demand(demand, network)
    assert tuple(network.nodes.columns) == (*NODE_COLUMNS, "x", "y")
    assert tuple(network.links.columns) == LINK_COLUMNS
    assert network.nodes["node_id"].tolist() == ["橋", "10276762426"]
    link = network.links.iloc[0]
    assert [link["length"], link["free_speed"], link["jam_density"]] == [500, 20, 0.2]
    assert demand.table.to_numpy().tolist() == [["橋", "10276762426", 100, 300, 50]]
