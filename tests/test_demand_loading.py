"""From zones to nodes: shares by hand, and nothing lost without a word."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from od_files import hour, od, told, values, write
from small_networks import grid, link, network

from uxsim_geo.demand.access import Access, access_of_network, access_of_nodes, with_shares
from uxsim_geo.demand.access_file import read_access
from uxsim_geo.demand.check import check_demand
from uxsim_geo.demand.od_loading import load_od
from uxsim_geo.demand.od_table import OdTable, ends_of, natural_order, vehicles_of
from uxsim_geo.demand.profile import TripsOptions
from uxsim_geo.demand.profile_file import read_profiles
from uxsim_geo.demand.reachable import reachable_pairs
from uxsim_geo.demand.spreading import _check_size
from uxsim_geo.demand.timing import in_time
from uxsim_geo.errors import InputError
from uxsim_geo.network.network import Network

#: a → b → c → a, and d that only c leads to
RING = network(
    [link("ab", "a", "b"), link("bc", "b", "c"), link("ca", "c", "a"), link("cd", "c", "d")]
)


def access(*rows: tuple[str, str, float], zones: str = "") -> Access:
    """Rows of zone, node, weight, for both ends; ``zones`` without a node may be named."""
    table = pd.DataFrame(rows, columns=["zone", "node", "weight"])
    shares = with_shares(table, table["weight"].to_numpy(float))
    names = pd.Index(list(dict.fromkeys([*table["zone"], *zones.split()])), dtype="str")
    return Access(names, shares, shares)


def test_vehicles_go_by_the_product_of_the_shares() -> None:
    of = access(("1", "a", 3.0), ("1", "b", 1.0), ("2", "c", 1.0), ("2", "b", 1.0))
    loaded = load_od(hour(("1", "2", 70.0)), RING, of)
    # of ac, ab, bc, bb the last is no trip: 3/8, 3/8, 1/8 of 7/8
    assert values(loaded.demand.table) == [
        ["a", "b", 0.0, 3600.0, 30.0],
        ["a", "c", 0.0, 3600.0, 30.0],
        ["b", "c", 0.0, 3600.0, 10.0],
    ]
    check_demand(loaded.demand, RING)


def test_vehicles_keep_to_the_pairs_that_a_path_connects() -> None:
    of = access(("1", "d", 1.0), ("1", "a", 1.0), ("2", "b", 1.0))
    loaded = load_od(hour(("1", "2", 8.0), ("2", "1", 4.0)), RING, of)
    assert values(loaded.demand.table, "origin", "destination", "vehicles") == [
        ["a", "b", 8.0],  # nothing leaves d
        ["b", "a", 2.0],
        ["b", "d", 2.0],
    ]


def test_all_that_is_dropped_is_told_with_its_reason() -> None:
    of = access(("1", "a", 1.0), ("2", "b", 1.0), ("3", "a", 1.0), ("4", "d", 1.0), zones="5")
    table = hour(
        ("1", "2", 10.0),
        ("1", "1", 2.5),
        ("1", "3", 3.0),
        ("4", "1", 4.0),
        ("1", "5", 5.0),
        ("5", "5", 6.0),
    )
    loaded = load_od(table, RING, of)
    assert values(loaded.dropped) == [
        ["intrazonal", "1", "1", 2.5],
        ["same access node", "1", "3", 3.0],
        ["no access node", "1", "5", 5.0],
        ["no path", "4", "1", 4.0],
        ["intrazonal", "5", "5", 6.0],
    ]
    report = loaded.report.set_index("place")
    assert report.columns.tolist() == [
        *("out_given", "out_loaded", "out_dropped", "in_given", "in_loaded", "in_dropped", "why")
    ]
    assert report.loc["1"].tolist() == [
        *(20.5, 10.0, 10.5, 6.5, 0.0, 6.5),
        "intrazonal: out 2.5, in 2.5; no access node: out 5; no path: in 4; "
        "same access node: out 3",
    ]
    assert report.loc["2"].tolist() == [0.0, 0.0, 0.0, 10.0, 10.0, 0.0, ""]
    notes = loaded.demand.notes.set_index("topic")["value"]
    assert notes["dropped: intrazonal"] == "8.5"
    assert notes["dropped: no path"] == "4.0"
    kept = load_od(table, RING, of, unreachable="keep")
    assert values(kept.demand.table, "origin", "destination", "vehicles") == [
        ["a", "b", 10.0],
        ["d", "a", 4.0],
    ]
    assert kept.demand.notes.set_index("topic")["value"]["no path"] == "4.0"
    assert "no path" not in set(kept.dropped["reason"])


def test_what_a_reader_dropped_is_in_the_report() -> None:
    lost = pd.DataFrame(
        {"reason": "outside the time", "origin": ["a", "a"], "destination": "c", "vehicles": 1.5}
    )
    table = replace(hour(("a", "b", 2.0)), dropped=lost)
    loaded = load_od(table, RING)
    assert values(loaded.dropped) == [["outside the time", "a", "c", 3.0]]
    report = loaded.report.set_index("place")
    assert report.loc["a", ["out_given", "out_loaded", "out_dropped"]].tolist() == [5.0, 2.0, 3.0]


def test_places_that_are_not_known_are_told_where_they_stand_first() -> None:
    table = hour(("a", "x", 1.0), ("y", "b", 1.0), ("a", "b", 1.0), ("y", "x", 2.0))
    table = replace(table, table=table.table.rename_axis("line"), source="od.csv")
    with pytest.raises(InputError) as raised:
        load_od(table, RING)
    assert told(raised.value) == [(2, "origin", "y"), (1, "destination", "x")]


def test_places_of_a_wider_area_may_be_dropped() -> None:
    table = hour(("a", "x", 1.0), ("x", "x", 2.0), ("a", "b", 3.0))
    loaded = load_od(table, RING, unknown="drop")
    assert loaded.demand.table["vehicles"].tolist() == [3.0]
    assert values(loaded.dropped) == [
        ["unknown place", "a", "x", 1.0],
        ["unknown place", "x", "x", 2.0],
    ]


def test_a_table_without_times_is_refused() -> None:
    with pytest.raises(InputError, match="has no times"):
        load_od(od(("a", "b", 1.0)), RING)


def test_an_empty_table_is_nobody() -> None:
    loaded = load_od(hour(("a", "a", 3.0)), RING)
    assert loaded.demand.table.empty
    check_demand(loaded.demand, RING)
    assert loaded.report["out_dropped"].tolist() == [3.0]


def test_zones_of_the_network_have_their_nodes_in_even_shares() -> None:
    nodes = RING.nodes.assign(zone_id=["1", "1", "2", None])
    of = access_of_network(Network(nodes, RING.links))
    assert values(of.origins) == [["1", "a", 0.5], ["1", "b", 0.5], ["2", "c", 1.0]]
    assert access_of_network(RING).zones.tolist() == ["a", "b", "c", "d"]
    assert access_of_nodes(RING).origins["share"].tolist() == [1.0] * 4


def test_nothing_is_lost_on_random_tables() -> None:
    """Against a twin that goes pair by pair."""
    generator = np.random.default_rng(11)
    of = network([*grid(4), link("out", "3,3", "away")], no_through=["0,0"])
    nodes = of.nodes["node_id"].tolist()
    for _ in range(6):
        rows = [
            (str(zone), str(node), float(generator.integers(1, 5)))
            for zone in range(6)
            for node in generator.choice(nodes, 3, replace=False)
        ]
        shares = access(*rows, zones="6")
        pairs = [(str(a), str(b)) for a in range(7) for b in range(7)]
        table = hour(*((a, b, float(generator.random() * 9)) for a, b in pairs))
        loaded = load_od(table, of, shares)
        check_demand(loaded.demand, of)
        expected, lost = pair_by_pair(table, of, shares)
        found = loaded.demand.table.set_index(["origin", "destination"])["vehicles"].to_dict()
        assert found.keys() == expected.keys()
        for pair, vehicles in expected.items():
            assert found[pair] == pytest.approx(vehicles, rel=1e-12)
        assert loaded.dropped["vehicles"].sum() == pytest.approx(lost, rel=1e-12)
        report = loaded.report
        for end in ("out", "in"):
            assert report[f"{end}_given"].sum() == pytest.approx(table.table["vehicles"].sum())
            assert np.allclose(
                report[f"{end}_given"], report[f"{end}_loaded"] + report[f"{end}_dropped"]
            )
        assert report["out_loaded"].sum() == pytest.approx(loaded.demand.table["vehicles"].sum())


def pair_by_pair(
    table: OdTable, of: Network, shares: Access
) -> tuple[dict[tuple[str, str], float], float]:
    expected: dict[tuple[str, str], float] = {}
    lost = 0.0
    for origin, destination, vehicles in table.table[
        ["origin", "destination", "vehicles"]
    ].itertuples(index=False):
        starts = shares.origins[shares.origins["zone"] == origin]
        ends = shares.destinations[shares.destinations["zone"] == destination]
        parts = {
            (a.node, b.node): a.share * b.share
            for a in starts.itertuples()
            for b in ends.itertuples()
            if a.node != b.node and reachable_pairs(of, pd.Series([a.node]), pd.Series([b.node]))[0]
        }
        if origin == destination or not parts:
            lost += vehicles
            continue
        for pair, part in parts.items():
            expected[pair] = expected.get(pair, 0.0) + vehicles * part / sum(parts.values())
    return expected, lost


def test_more_rows_than_memory_has_are_refused() -> None:
    with pytest.raises(InputError, match="50,000,001 rows"):
        _check_size(50_000_001)


def test_a_profile_spreads_a_table_and_its_factor() -> None:
    options = TripsOptions(3600.0, factor=0.5, start_s=600.0, profile=((900.0, 1), (3600.0, 3)))
    timed = in_time(od(("a", "b", 16.0), ("b", "a", 8.0)), options)
    assert values(timed.table) == [
        ["a", "b", 600.0, 1500.0, 2.0],
        ["a", "b", 1500.0, 4200.0, 6.0],
        ["b", "a", 600.0, 1500.0, 1.0],
        ["b", "a", 1500.0, 4200.0, 3.0],
    ]
    with pytest.raises(InputError, match="has times of its own"):
        in_time(timed, options)


def test_a_class_may_have_a_profile_of_its_own() -> None:
    table = od(("a", "b", 6.0, None), ("a", "b", 4.0, "truck"), columns=COLUMNS_WITH_CLASS)
    night = TripsOptions(1000.0, start_s=5000.0)
    timed = in_time(table, TripsOptions(600.0), {"truck": night})
    assert values(timed.table, "start_s", "end_s", "vehicles", "class") == [
        [0.0, 600.0, 6.0, "default"],
        [5000.0, 6000.0, 4.0, "truck"],
    ]
    with pytest.raises(InputError, match=r"there are: default, truck.*'bus'"):
        in_time(table, TripsOptions(600.0), {"bus": night})


COLUMNS_WITH_CLASS = "origin destination vehicles class"


def test_classes_are_kept_apart() -> None:
    table = od(
        ("1", "2", 0.0, 60.0, 6.0, "car"),
        ("3", "2", 0.0, 60.0, 1.0, "car"),
        ("1", "2", 0.0, 60.0, 4.0, "truck"),
        columns="origin destination start_s end_s vehicles class",
    )
    of = access(("1", "a", 1.0), ("3", "a", 1.0), ("2", "b", 1.0))
    assert values(load_od(table, RING, of).demand.table) == [
        ["a", "b", 0.0, 60.0, 7.0, "car"],  # both zones get on at a
        ["a", "b", 0.0, 60.0, 4.0, "truck"],
    ]


def test_names_are_in_natural_order() -> None:
    assert natural_order(["b", "10", "9", "010", "a1", "²"]) == ["9", "010", "10", "a1", "b", "²"]
    assert natural_order(["9" * 5000, "1" + "0" * 5000])[0] == "9" * 5000


def test_ends_and_totals() -> None:
    table = od(("10", "2", 1.0), ("2", "10", 4.0), ("2", "9", 2.0)).table
    ends = ends_of(table)
    assert ends.names.tolist() == ["2", "9", "10"]
    out, into = ends.totals(vehicles_of(table))
    assert out.tolist() == [6.0, 0.0, 1.0]
    assert into.tolist() == [1.0, 2.0, 4.0]


def test_access_nodes_chosen_by_hand(tmp_path: Path) -> None:
    text = "zone,node,weight,end\n2,c,1,\n1,b,1,origin\n1,a,3,origin\n1,d,1,destination\n"
    of = read_access(write(tmp_path, "access.csv", text), RING)
    assert values(of.origins) == [["1", "a", 0.75], ["1", "b", 0.25], ["2", "c", 1.0]]
    assert values(of.destinations) == [["1", "d", 1.0], ["2", "c", 1.0]]
    text = "zone,node,weight\n1,x,1\n,a,1\n1,a,0\n1,b,1\n1,b,2\n"
    with pytest.raises(InputError) as raised:
        read_access(write(tmp_path, "access.csv", text), RING)
    assert {(line, column) for line, column, _ in told(raised.value)} == {
        *((2, "node"), (3, "zone"), (4, "weight"), (6, "node"))
    }


def test_profiles_from_a_file(tmp_path: Path) -> None:
    text = "class,until_s,share\ntruck,3600,1\n,3600,3\n,900,1\n"
    found = read_profiles(write(tmp_path, "profile.csv", text))
    assert found == {"default": ((900.0, 1.0), (3600.0, 3.0)), "truck": ((3600.0, 1.0),)}
    assert TripsOptions(3600.0, profile=found["default"]).slices()[1].share == 0.75
    plain = write(tmp_path, "plain.csv", "until,weight\n1800,2\n")
    assert read_profiles(plain) == {"default": ((1800.0, 2.0),)}
    with pytest.raises(InputError) as raised:
        read_profiles(write(tmp_path, "bad.csv", "until_s,share\nnoon,1\n3600,\n"))
    assert told(raised.value) == [(2, "until_s", "noon"), (3, "share", "")]
    with pytest.raises(InputError, match=r"lacks the column share \(columns here: until_s\)"):
        read_profiles(write(tmp_path, "bad.csv", "until_s\n1\n"))
