"""Links joined at nodes of degree two: what is joined, what is kept, and what it is worth."""

from __future__ import annotations

from typing import Any

import pytest
from road_tables import banned, drawn, link, road, street

from uxsim_geo.network.joining import join_links
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes

LINE = {"a": (0.0, 0.0), "b": (100.0, 0.0), "c": (200.0, 50.0), "d": (300.0, 0.0)}


def joined(network: Network, short_piece: float = 0.0) -> Network:
    return join_links(network, short_piece, Notes())


def ids(network: Network) -> set[str]:
    return set(network.links["link_id"])


def chain(*changes: dict[str, Any], **other: Any) -> Network:
    first, second, third = changes or ({}, {}, {})
    roads = [street("a", "b", **first), street("b", "c", **second), street("c", "d", **third)]
    return drawn(LINE, roads, **other)


def test_a_street_becomes_one_link_each_way() -> None:
    network = joined(chain())
    assert ids(network) == {"a-b+2", "d-c+2"}
    there, back = link(network, "a-b+2"), link(network, "d-c+2")
    assert (there["from_node_id"], there["to_node_id"]) == ("a", "d")
    assert (back["from_node_id"], back["to_node_id"]) == ("d", "a")
    assert there["length"] == back["length"] == pytest.approx(100 + 2 * 12500**0.5, abs=1e-6)
    assert list(there["geometry"].coords) == [LINE[name] for name in "abcd"]
    assert list(back["geometry"].coords) == [LINE[name] for name in "dcba"]
    assert there["source_node_ids"] == "a b c d"
    assert there["source_id"] == "ab; bc; cd"
    assert set(network.nodes["node_id"]) == {"a", "d"}


def test_a_oneway_road_becomes_one_link() -> None:
    roads = [road("a", "b"), road("b", "c"), road("c", "d"), street("d", "a")]
    assert ids(joined(drawn(LINE, roads))) == {"a-b+2", "d-a", "a-d"}


def test_directions_that_part_keep_the_node() -> None:
    """Both directions to b, one on: b leads to two neighbours, but not every link goes on."""
    roads = [street("a", "b"), road("b", "c"), road("c", "d"), road("d", "a")]
    assert "b" in set(joined(drawn(LINE, roads)).nodes["node_id"])


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("lanes", 2),
        ("free_speed", 14.0),
        ("road_class", "primary"),
        ("capacity", 0.3),
        ("jam_density", 0.15),
        ("merge_priority", 2.0),
    ],
)
def test_a_change_keeps_its_nodes(column: str, value: Any) -> None:
    network = joined(chain({}, {column: value}, {}))
    assert ids(network) == {"a-b", "b-a", "b-c", "c-b", "c-d", "d-c"}


def test_other_names_and_sources_stand_side_by_side() -> None:
    changes = (
        {"name": "Long Road", "lanes_source": "given"},
        {"name": "Bridge", "lanes_source": "assumed"},
        {"name": "Long Road", "lanes_source": "given"},
    )
    there = link(joined(chain(*changes)), "a-b+2")
    assert there["name"] == "Long Road; Bridge"
    assert there["lanes_source"] == "assumed"
    assert there["free_speed_source"] == "given"


def test_a_short_piece_between_alike_is_joined_to_both_and_takes_its_time() -> None:
    changes = ({"lanes": 2}, {"lanes": 1, "free_speed": 5.0, "length": 40.0}, {"lanes": 2})
    network = joined(chain(*changes), short_piece=50.0)
    assert ids(network) == {"a-b+2", "d-c+2"}
    there = link(network, "a-b+2")
    assert there["lanes"] == 2
    time = 100 / 10 + 40 / 5 + 12500**0.5 / 10
    assert there["length"] / there["free_speed"] == pytest.approx(time, rel=1e-9)
    assert link(network, "d-c+2")["free_speed"] == there["free_speed"]


def test_a_short_piece_between_others_is_joined_to_the_shorter_and_the_change_stays() -> None:
    changes = (
        {"lanes": 1, "length": 300.0},
        {"lanes": 2, "length": 30.0},
        {"lanes": 3, "length": 200.0},
    )
    network = joined(chain(*changes), short_piece=50.0)
    assert ids(network) == {"a-b", "b-a", "b-c+1", "d-c+1"}
    assert link(network, "b-c+1")["lanes"] == 3
    assert link(network, "b-c+1")["length"] == pytest.approx(230.0)


def test_a_piece_at_the_limit_stays() -> None:
    changes = ({"lanes": 2}, {"length": 50.0}, {"lanes": 2})
    assert "b-c" in ids(joined(chain(*changes), short_piece=50.0))


def test_signals_zones_and_closed_nodes_stay() -> None:
    assert ids(joined(chain(signals=["b"]))) == {"a-b", "b-a", "b-c+1", "d-c+1"}
    assert ids(joined(chain(zones={"c": "7"}))) == {"a-b+1", "c-b+1", "c-d", "d-c"}
    closed = chain()
    closed.nodes.loc[1, "through_traffic"] = False
    assert "b" in set(joined(closed).nodes["node_id"])


def test_a_second_road_between_the_same_nodes_keeps_them() -> None:
    roads = [street("a", "b"), street("b", "c"), street("c", "d")]
    network = drawn(LINE, roads)
    network.links.loc[1, "to_node_id"] = "c"
    assert "b" in set(joined(network).nodes["node_id"])


def test_a_ban_of_going_on_keeps_its_node_and_one_of_turning_back_goes() -> None:
    network = joined(chain(bans=["a-b b-c", "c-d d-c"]))
    assert ids(network) == {"a-b", "b-a", "b-c+1", "d-c+1"}
    assert banned(network) == {"a-b b-c+1", "b-c+1 d-c+1"}
    notes = Notes()
    network = join_links(chain(bans=["a-b b-a"]), 0.0, notes)
    assert banned(network) == set()
    assert "bans without a node" in set(notes.table()["topic"])


def test_a_ban_of_going_on_after_certain_links_keeps_its_last_node() -> None:
    network = joined(chain(bans=["a-b b-c c-d"]))
    assert ids(network) == {"a-b+1", "c-b+1", "c-d", "d-c"}
    assert banned(network) == {"a-b+1 c-d"}


FORK = {**LINE, "e": (400.0, 100.0), "f": (400.0, -100.0), "s": (-100.0, 50.0), "t": (-100.0, -50)}


def test_bans_over_links_that_become_one() -> None:
    """From s over a-b-c-d to e; from b-c over c-d to f: what becomes one link counts once."""
    roads = [street(*pair) for pair in ("sa", "ta", "ab", "bc", "cd", "de", "df")]
    bans = ["s-a a-b b-c c-d d-e", "b-c c-d d-f", "t-a a-s"]
    network = joined(drawn(FORK, roads, bans=bans))
    assert banned(network) == {"s-a a-b+2 d-e", "a-b+2 d-f", "t-a a-s"}
    assert set(network.movements["node_id"]) == {"d", "a"}


def test_a_loop_keeps_the_node_nearest_its_middle() -> None:
    places = {"x": (0.0, 0.0), "y": (-100.0, 0.0), **{k: v for k, v in LINE.items() if k != "a"}}
    roads = [street(*pair) for pair in ("yx", "xb", "bc", "cd", "dx")]
    network = joined(drawn(places, roads))
    assert set(network.nodes["node_id"]) == {"x", "y", "d"}
    assert not (network.links["from_node_id"] == network.links["to_node_id"]).any()
    assert set(joined(network).nodes["node_id"]) == {"x", "y", "d"}


def test_a_ring_alone_keeps_two_nodes() -> None:
    network = joined(drawn(LINE, [road("a", "b"), road("b", "c"), road("c", "d"), road("d", "a")]))
    assert len(network.nodes) == 2
    assert network.links["length"].sum() == pytest.approx(100 + 2 * 12500**0.5 + 300)


def test_a_ring_between_two_streets_is_no_street() -> None:
    """At b one drives round: in from a, out to c by the one side, back by the other."""
    roads = [street("a", "b"), road("b", "c"), road("c", "b", length=300.0), street("c", "d")]
    assert set(joined(drawn(LINE, roads)).nodes["node_id"]) == {"a", "b", "c", "d"}


def test_names_are_not_given_twice() -> None:
    roads = [street("a", "b"), street("b", "c"), street("c", "d", link_id="a-b+1")]
    network = drawn(LINE, roads, zones={"c": "1"})
    network.links.loc[5, "link_id"] = "d-c"
    assert ids(joined(network)) == {"a-b+1'", "c-b+1", "a-b+1", "d-c"}


def test_tables_without_geometry_are_joined_too() -> None:
    network = chain()
    plain = Network(
        network.nodes.drop(columns="geometry"),
        network.links.drop(columns="geometry"),
        network.movements,
    )
    assert ids(joined(plain)) == {"a-b+2", "d-c+2"}
