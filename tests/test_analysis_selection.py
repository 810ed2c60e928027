"""Who uses a link or a zone: by hand, and against counts found another way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drives import Drive, crowded_grid, result_of
from small_networks import link, network

from uxsim_geo.analysis.link_states import link_times
from uxsim_geo.analysis.od import od_table
from uxsim_geo.analysis.selection import (
    flows_of,
    select_link,
    select_zone,
    users_of_links,
    users_of_zones,
)
from uxsim_geo.errors import InputError
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result

NAN = np.nan
RING = network([link("ab", "a", "b"), link("bc", "b", "c"), link("ca", "c", "a")])


def around() -> Result:
    """Once round and on over ab again; along bc; ca alone; and one that never gets in."""
    drives = [
        Drive("a", "b", 0.0, [("ab", 0, 50), ("bc", 50, 100), ("ca", 100, 150), ("ab", 150, 200)]),
        Drive("b", "c", 5.0, [("bc", 60, 110)], vehicles=2),
        Drive("a", "c", 9.0, [("ab", 70, 120), ("bc", 120, NAN)], "running", 3),
        Drive("c", "a", 20.0, [("ca", 20, 70)], vehicles=4),
        Drive("c", "a", 30.0, (), "waiting", 1),
    ]
    return result_of(RING, drives, 210.0)


def test_users_of_any_and_of_all_links() -> None:
    users = users_of_links(around(), ["ab", "bc"])
    assert users["vehicle"].tolist() == [0, 1, 2]
    assert users["link"].tolist() == ["ab", "bc", "ab"]
    assert users["link_enter_s"].tolist() == [0.0, 60.0, 70.0]
    assert users["origin"].tolist() == ["a", "b", "a"]
    both = users_of_links(around(), ["bc", "ab"], use="all")
    assert both["vehicle"].tolist() == [0, 2]
    assert both["link_enter_s"].tolist() == [0.0, 70.0]
    # entering one link twice is not entering two
    assert users_of_links(around(), ["ab", "ca"], use="all")["vehicle"].tolist() == [0]
    assert users_of_links(around(), "ca")["vehicle"].tolist() == [0, 3]


def test_users_within_a_time() -> None:
    late = users_of_links(around(), "ab", between=(70.0, 151.0))
    assert late["vehicle"].tolist() == [0, 2]
    assert late["link_enter_s"].tolist() == [150.0, 70.0]  # the first entry within that time
    assert users_of_links(around(), "ab", between=(0.0, 70.0))["vehicle"].tolist() == [0]
    both = ["ab", "bc"]
    assert users_of_links(around(), both, between=(60.0, 121.0), use="all")["vehicle"].tolist() == [
        2
    ]
    assert users_of_links(around(), both, between=(100.0, 160.0), use="all").empty
    assert users_of_links(around(), "ab", between=(200.0, 210.0)).empty


def test_flows_of_those_who_use_a_link() -> None:
    flows = select_link(around(), RING, "bc")
    assert flows.users["vehicle"].tolist() == [0, 1, 2]
    assert flows.links["link_id"].tolist() == ["ab", "bc", "ca"]
    assert flows.links["user_entries"].tolist() == [13.0, 10.0, 5.0]
    assert flows.links["entries"].tolist() == [13.0, 10.0, 9.0]
    assert flows.links["share"].tolist() == [1.0, 1.0, pytest.approx(5 / 9)]
    pairs = [list(row) for row in flows.pairs.itertuples(index=False)]
    assert pairs == [["a", "b", 5, 5, 1], ["a", "c", 3, 3, 1], ["b", "c", 2, 2, 1]]


def test_flows_of_those_who_start_or_end_somewhere() -> None:
    of, result = zones_on_nodes(), around()
    assert users_of_zones(result, of, "west", end="origin")["vehicle"].tolist() == [0, 2]
    assert users_of_zones(result, of, "west", end="destination")["vehicle"].tolist() == [3, 4]
    assert users_of_zones(result, of, ["west"])["vehicle"].tolist() == [0, 2, 3, 4]
    assert users_of_zones(result, of, ["east"])["vehicle"].tolist() == [0, 1, 2, 3, 4]
    assert users_of_zones(result, of, "east", between=(5.0, 20.0))["vehicle"].tolist() == [1, 2]
    flows = select_zone(result, of, "west", end="origin")
    assert flows.links["user_entries"].tolist() == [13.0, 8.0, 5.0]
    assert flows.pairs["user_vehicles"].tolist() == [5.0, 3.0]


def zones_on_nodes() -> Network:
    return replace(RING, nodes=RING.nodes.assign(zone_id=["west", "east", "east"]))


def test_nobody_is_an_answer() -> None:
    flows = select_link(around(), RING, "ca", between=(180.0, 190.0))
    assert flows.users.empty
    assert flows.pairs.empty
    assert flows.links["user_entries"].tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("row", [0, 17, 40])
def test_the_users_of_a_link_make_up_its_entries(row: int) -> None:
    of, result = crowded_grid()
    link_id = of.links["link_id"][row]
    flows = select_link(result, of, link_id)
    states = link_times(result, of, bin_s=1e4)
    assert flows.links["entries"].tolist() == states["entries"].tolist()
    assert flows.links["share"][row] == 1.0
    assert (flows.links["share"].dropna() <= 1).all()
    assert (flows.links["share"] < 1).any()
    users = flows.users["vehicles"].sum()
    assert flows.pairs["user_vehicles"].sum() == users
    # nobody enters a link twice in this run
    assert flows.links["user_entries"][row] == users
    pairs = od_table(result, of, vehicles=flows.users["vehicle"])
    assert pairs["vehicles_demanded"].tolist() == flows.pairs["user_vehicles"].tolist()


def test_the_origins_share_out_all_traffic() -> None:
    of, result = crowded_grid()
    entries = [
        select_zone(result, of, node, end="origin").links["user_entries"]
        for node in result.trips["origin"].unique()
    ]
    everybody = flows_of(result, of, result.trips).links
    assert (everybody["share"].dropna() == 1).all()
    assert np.sum(entries, axis=0).tolist() == everybody["entries"].tolist()


def test_wrong_questions_are_refused() -> None:
    with pytest.raises(InputError, match="links: there is none of this name") as error:
        users_of_links(around(), ["ab", "xx", "yy"])
    assert [fault.value for fault in error.value.faults] == ["xx", "yy"]
    with pytest.raises(InputError, match="links: is empty"):
        users_of_links(around(), [])
    with pytest.raises(InputError, match="earlier and a later"):
        users_of_links(around(), "ab", between=(50.0, 50.0))
    with pytest.raises(InputError, match="use: must be any or all"):
        users_of_links(around(), "ab", use="each")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="end: must be origin, destination or either"):
        users_of_zones(around(), RING, "a", end="both")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="zones: there is none of this name"):
        users_of_zones(around(), zones_on_nodes(), "north")
    with pytest.raises(InputError, match="another run"):
        select_link(around(), crowded_grid()[0], "ab")
