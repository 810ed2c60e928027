"""Turn restrictions of every kind on a crossroads, over ways, and broken in every way.

The crossroads: node 9 in the middle, ways 1 to 4 from it to nodes 1 (north), 2 (east), 3 (south)
and 4 (west), all drawn from outside to the middle, so that ``1:1-9`` is the way in from the north.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from osm_files import node, noted, read, read_data, restriction, topics, way

from uxsim_geo.network.network import MOVEMENT_COLUMNS, Network

PLACES = {1: (0, 1), 2: (1, 0), 3: (0, -1), 4: (-1, 0)}
CROSSROADS = (
    node(9, 0, 0),
    *(node(number, x, y) for number, (x, y) in PLACES.items()),
    *(way(number, [number, 9]) for number in PLACES),
)

IN = {number: f"{number}:{number}-9" for number in PLACES}
OUT = {number: f"{number}:9-{number}" for number in PLACES}


def bans(network: Network) -> set[tuple[str, ...]]:
    """Links from, between (if any), to."""
    table = network.movements.fillna("")
    found = set()
    for row in table.itertuples():
        between = row.via_link_ids.split()
        found.add((row.from_link_id, *between, row.to_link_id))
    assert len(found) == len(table)
    return found


@pytest.mark.parametrize(
    ("kind", "to"),
    [
        ("no_left_turn", 2),
        ("no_straight_on", 3),
        ("no_right_turn", 4),
        ("no_u_turn", 1),
        ("no_entry", 2),
        ("no_exit", 4),
    ],
)
def test_no_bans_one_turn(tmp_path: Path, kind: str, to: int) -> None:
    network = read(tmp_path, *CROSSROADS, restriction(7, kind, f"from w1 via n9 to w{to}"))
    assert bans(network) == {(IN[1], OUT[to])}
    row = network.movements.iloc[0]
    assert (row["node_id"], row["restriction"], row["source_id"]) == ("9", kind, "7")
    assert list(network.movements.columns[:3]) == list(MOVEMENT_COLUMNS)


@pytest.mark.parametrize(
    ("kind", "to"),
    [("only_left_turn", 2), ("only_straight_on", 3), ("only_right_turn", 4), ("only_u_turn", 1)],
)
def test_only_bans_all_others(tmp_path: Path, kind: str, to: int) -> None:
    network = read(tmp_path, *CROSSROADS, restriction(7, kind, f"from w1 via n9 to w{to}"))
    assert bans(network) == {(IN[1], OUT[other]) for other in OUT if other != to}


def test_no_entry_may_come_from_several_ways_and_no_exit_lead_to_several(tmp_path: Path) -> None:
    several = "from w1 from w3 via n9 to w2"
    assert bans(read(tmp_path, *CROSSROADS, restriction(7, "no_entry", several))) == {
        (IN[1], OUT[2]),
        (IN[3], OUT[2]),
    }
    several = "from w1 via n9 to w2 to w4"
    assert bans(read(tmp_path, *CROSSROADS, restriction(7, "no_exit", several))) == {
        (IN[1], OUT[2]),
        (IN[1], OUT[4]),
    }


@pytest.mark.parametrize("excepted", ["motorcar", "psv;motor_vehicle", "bicycle; vehicle"])
def test_a_restriction_that_excepts_cars_bans_nothing(tmp_path: Path, excepted: str) -> None:
    relation = restriction(7, "no_left_turn", "from w1 via n9 to w2", {"except": excepted})
    network = read(tmp_path, *CROSSROADS, relation)
    assert network.movements.empty
    assert noted(network, "restriction excepts cars") == ["1"]


def test_a_restriction_that_excepts_others_holds(tmp_path: Path) -> None:
    relation = restriction(7, "no_left_turn", "from w1 via n9 to w2", {"except": "psv;bicycle"})
    assert bans(read(tmp_path, *CROSSROADS, relation)) == {(IN[1], OUT[2])}


def test_what_is_said_of_cars_goes_before_what_is_said_of_all(tmp_path: Path) -> None:
    tags = {"restriction:motorcar": "no_right_turn"}
    relation = restriction(7, "only_left_turn", "from w1 via n9 to w4", tags)
    assert bans(read(tmp_path, *CROSSROADS, relation)) == {(IN[1], OUT[4])}


@pytest.mark.parametrize(
    "tags",
    [
        {"restriction:hgv": "no_left_turn"},
        {"restriction:bus": "no_left_turn"},
        {"type": "restriction:hgv", "restriction": "no_left_turn"},
    ],
)
def test_restrictions_of_other_vehicles_are_counted(tmp_path: Path, tags: dict[str, str]) -> None:
    relation = restriction(7, "", "from w1 via n9 to w2", tags)
    network = read(tmp_path, *CROSSROADS, relation)
    assert network.movements.empty
    assert noted(network, "restriction of other vehicles") == ["1"]


@pytest.mark.parametrize(
    ("kind", "tags"),
    [
        ("", {"restriction:conditional": "no_left_turn @ (07:00-09:00)"}),
        ("no_left_turn", {"day_on": "Monday", "hour_on": "07:00"}),
    ],
)
def test_conditional_restrictions_are_noted_and_not_applied(
    tmp_path: Path, kind: str, tags: dict[str, str]
) -> None:
    network = read(tmp_path, *CROSSROADS, restriction(7, kind, "from w1 via n9 to w2", tags))
    assert network.movements.empty
    assert noted(network, "conditional restriction") == ["7"]


def test_of_a_restriction_with_conditions_what_holds_always_is_applied(tmp_path: Path) -> None:
    tags = {"restriction:conditional": "none @ (Su)"}
    relation = restriction(7, "no_left_turn", "from w1 via n9 to w2", tags)
    network = read(tmp_path, *CROSSROADS, relation)
    assert bans(network) == {(IN[1], OUT[2])}
    assert noted(network, "conditional restriction") == ["7"]


BROKEN = {
    "no from": "via n9 to w2",
    "no to": "from w1 via n9",
    "no via": "from w1 to w2",
    "two from": "from w1 from w3 via n9 to w2",
    "two to": "from w1 via n9 to w2 to w4",
    "two via nodes": "from w1 via n9 via n1 to w2",
    "node and way via": "from w1 via n9 via w3 to w2",
    "wrong roles": "start w1 middle n9 end w2",
    "wrong types": "from n1 via n9 to n2",
    "way not in the file": "from w99 via n9 to w2",
    "node not in the file": "from w1 via n99 to w2",
    "node elsewhere": "from w1 via n2 to w2",
    "via way not in the file": "from w1 via w99 to w2",
    "via way elsewhere": "from w1 via w5 to w2",
    "relation as member": "from w1 via r9 to w2",
}


@pytest.mark.parametrize("members", BROKEN.values(), ids=BROKEN)
def test_broken_restrictions_are_noted_with_their_number(tmp_path: Path, members: str) -> None:
    elsewhere = (node(5, 5, 5), node(6, 6, 5), way(5, [5, 6]))
    relation = restriction(7, "no_left_turn", members)
    network = read(tmp_path, *CROSSROADS, *elsewhere, relation)
    assert network.movements.empty
    assert noted(network, "broken restriction") == ["7"]


@pytest.mark.parametrize("kind", ["no_right_turn_on_red", "stop", "no_left", " "])
def test_unknown_restrictions_are_noted(tmp_path: Path, kind: str) -> None:
    network = read(tmp_path, *CROSSROADS, restriction(7, kind, "from w1 via n9 to w2"))
    assert network.movements.empty
    assert noted(network, "broken restriction") == ["7"]


def test_a_restriction_on_ways_that_are_no_roads_here_is_counted(tmp_path: Path) -> None:
    alley = (node(5, 1, 1), way(5, [5, 9], {"highway": "service"}))
    for kind in ("no_left_turn", "only_left_turn"):
        relation = restriction(7, kind, "from w1 via n9 to w5")
        network = read(tmp_path, *CROSSROADS, *alley, relation)
        assert network.movements.empty
        assert noted(network, "restriction on other roads") == ["1"]


def test_what_oneway_roads_forbid_already_is_counted(tmp_path: Path) -> None:
    inward = (node(5, 1, 1), way(5, [5, 9], {"oneway": "yes"}))
    relation = restriction(7, "no_left_turn", "from w1 via n9 to w5")
    network = read(tmp_path, *CROSSROADS, *inward, relation)
    assert network.movements.empty
    assert noted(network, "restriction without effect") == ["1"]


def test_a_ban_that_stands_there_twice_is_one_row_of_two_sources(tmp_path: Path) -> None:
    members = "from w1 via n9 to w2"
    relations = [restriction(8, "no_left_turn", members), restriction(7, "no_exit", members)]
    network = read(tmp_path, *CROSSROADS, *relations)
    assert bans(network) == {(IN[1], OUT[2])}
    assert network.movements["source_id"].tolist() == ["7 8"]


# a way that goes on beyond the place: 1 is one road from north to south

THROUGH = (
    *CROSSROADS[:5],
    way(1, [1, 9, 3]),
    way(2, [2, 9]),
    way(4, [4, 9]),
)


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        ("no_left_turn", ("1:1-9", "2:9-2")),  # from the north, the east is to the left
        ("no_right_turn", ("1:3-9", "2:9-2")),
    ],
)
def test_where_a_way_goes_on_the_name_says_which_side(
    tmp_path: Path, kind: str, expected: tuple[str, str]
) -> None:
    network = read(tmp_path, *THROUGH, restriction(7, kind, "from w1 via n9 to w2"))
    assert bans(network) == {expected}


def test_where_the_name_does_not_say_it_the_restriction_is_broken(tmp_path: Path) -> None:
    network = read(tmp_path, *THROUGH, restriction(7, "no_entry", "from w1 via n9 to w2"))
    assert network.movements.empty
    assert noted(network, "broken restriction") == ["7"]


# two crossroads tied by way 5: from 1 (north of 8) over 8-9 to 3 (north of 9)

H_SHAPE = (
    *(node(number, x, y) for number, x, y in [(8, 0, 0), (9, 1, 0), (1, 0, 1), (2, 0, -1)]),
    *(node(number, x, y) for number, x, y in [(3, 1, 1), (4, 1, -1)]),
    *(way(number, [number, 8]) for number in (1, 2)),
    *(way(number, [number, 9]) for number in (3, 4)),
)
BETWEEN = way(5, [8, 9])


def test_a_restriction_over_a_way_holds_for_those_who_came_that_way(tmp_path: Path) -> None:
    relation = restriction(7, "no_u_turn", "from w1 via w5 to w3")
    network = read(tmp_path, *H_SHAPE, BETWEEN, relation)
    assert bans(network) == {("1:1-8", "5:8-9", "3:9-3")}
    assert network.movements["node_id"].tolist() == ["8"]


def test_only_over_a_way_binds_at_its_end(tmp_path: Path) -> None:
    relation = restriction(7, "only_right_turn", "from w1 via w5 to w4")
    network = read(tmp_path, *H_SHAPE, BETWEEN, relation)
    assert bans(network) == {
        ("1:1-8", "5:8-9", "3:9-3"),
        ("1:1-8", "5:8-9", "5:9-8"),
    }


def test_several_ways_between_in_any_order_and_drawn_either_way(tmp_path: Path) -> None:
    pieces = (node(6, 0.3, 0), node(7, 0.6, 0), way(5, [8, 6]), way(6, [7, 6]), way(7, [7, 9]))
    relation = restriction(7, "no_u_turn", "from w1 via w7 via w5 via w6 to w3")
    network = read(tmp_path, *H_SHAPE, *pieces, relation)
    assert bans(network) == {("1:1-8", "5:8-6", "6:6-7", "7:7-9", "3:9-3")}


def test_a_way_between_may_itself_be_cut(tmp_path: Path) -> None:
    side = (node(6, 0.5, 0), node(7, 0.5, 1), way(5, [8, 6, 9]), way(6, [6, 7]))
    relation = restriction(7, "no_u_turn", "from w1 via w5 to w3")
    network = read(tmp_path, *H_SHAPE, *side, relation)
    assert bans(network) == {("1:1-8", "5:8-6", "5:6-9", "3:9-3")}


def test_a_way_between_that_leads_the_other_way_bans_nothing(tmp_path: Path) -> None:
    against = way(5, [9, 8], {"oneway": "yes"})
    relation = restriction(7, "no_u_turn", "from w1 via w5 to w3")
    network = read(tmp_path, *H_SHAPE, against, relation)
    assert network.movements.empty
    assert topics(network)["restriction without effect"] == 1


def test_a_restriction_that_asks_for_too_much_is_given_up(tmp_path: Path) -> None:
    """Ways between that meet side streets at every node, and a member named a thousand times."""
    numbers = range(100, 400)
    ladder = [node(number, number / 10, 0) for number in numbers]
    steps = [node(number + 1000, number / 10, 1) for number in numbers]
    sides = [way(number, [number, number + 1000]) for number in numbers]
    long = way(5, [8, *numbers, 9])
    relation = restriction(7, "no_u_turn", "from w1 via w5 to w3")
    network = read(tmp_path, *H_SHAPE, *ladder, *steps, *sides, long, relation)
    assert network.movements.empty
    assert noted(network, "broken restriction") == ["7"]
    many = restriction(7, "no_entry", f"{'from w1 ' * 1000}via n8 to w2")
    network = read(tmp_path, *H_SHAPE, BETWEEN, many)
    assert network.movements.empty
    assert noted(network, "broken restriction") == ["7"]


#: the turns banned at each crossroads of the file: to which of its ways, from that in the north
FILE = {
    "no_left_turn": {2},
    "no_right_turn": {4},
    "no_straight_on": {3},
    "no_u_turn": {1},
    "no_entry": {2},
    "no_exit": {4},
    "only_left_turn": {1, 3, 4},
    "only_right_turn": {1, 2, 3},
    "only_straight_on": {1, 2, 4},
    "only_u_turn": {2, 3, 4},
    "except cars": set(),
    "at some hours": set(),
    "of lorries": set(),
}


@pytest.mark.parametrize("kind", FILE)
def test_every_kind_in_the_file(kind: str) -> None:
    network = read_data("restrictions.osm")
    names = network.links.set_index("link_id")["name"]
    table = network.movements
    own = table[table["from_link_id"].map(names) == f"{kind} 1"]
    assert {name.rpartition(" ")[2] for name in own["to_link_id"].map(names)} == {
        str(way) for way in FILE[kind]
    }
    assert set(own["restriction"]) == ({kind} if FILE[kind] else set())


def test_the_ban_over_a_way_in_the_file() -> None:
    network = read_data("restrictions.osm")
    table = network.movements.dropna(subset="via_link_ids")
    assert table[["from_link_id", "via_link_ids", "to_link_id"]].values.tolist() == [
        ["1401:1401-1409", "1402:1409-1402", "1405:1402-1405"]
    ]
    assert noted(network, "conditional restriction") == ["12"]
    assert noted(network, "restriction of other vehicles") == ["1"]
    assert noted(network, "restriction excepts cars") == ["1"]
