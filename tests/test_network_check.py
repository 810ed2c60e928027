"""Networks and demands with one thing or many wrong: each is told, all at once."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from uxsim_geo.demand.check import check_demand
from uxsim_geo.demand.demand import Demand
from uxsim_geo.errors import InputError
from uxsim_geo.network.check import check_network
from uxsim_geo.network.network import Network
from uxsim_geo.settings import Settings


def two_links() -> Network:
    nodes = pd.DataFrame({"node_id": ["a", "b", "c"], "control": "none", "through_traffic": True})
    links = pd.DataFrame(
        {
            "link_id": ["a-b", "b-c"],
            "from_node_id": ["a", "b"],
            "to_node_id": ["b", "c"],
            "length": [1000.0, 500.0],
            "lanes": [1, 2],
            "free_speed": [10.0, 20.0],
            "jam_density": 0.2,
            "capacity": [np.nan, 1.0],
            "merge_priority": 1.0,
        }
    )
    return Network(nodes, links)


def one_trip() -> Demand:
    row = {"origin": "a", "destination": "c", "start_s": 0.0, "end_s": 60.0, "vehicles": 7.5}
    return Demand(pd.DataFrame([row]))


def faults_of_links(column: str, values: list[object]) -> str:
    network = two_links()
    with pytest.raises(InputError) as raised:
        check_network(replace(network, links=network.links.assign(**{column: values})))
    return str(raised.value)


def test_a_sound_network_and_demand_pass() -> None:
    check_network(two_links())
    check_demand(one_trip(), two_links())


def test_ids_that_are_numbers_are_told_with_what_to_do() -> None:
    network = two_links()
    nodes = network.nodes.assign(node_id=[1, 2, 3])
    links = network.links.assign(from_node_id=[1, 2], to_node_id=[2, 3])
    with pytest.raises(InputError) as raised:
        check_network(replace(network, nodes=nodes, links=links))
    assert str(raised.value) == (
        "nodes: 3 rows have a node_id that is not text (node_id 1, 2, 3): "
        'turn the ids of all tables into text with .astype("str")'
    )


def test_a_number_among_ids_of_text_is_told_and_a_category_of_text_is_text() -> None:
    assert "1 row has a link_id that is not text (link_id 7)" in faults_of_links(
        "link_id", ["a-b", 7]
    )
    network = two_links()
    check_network(replace(network, nodes=network.nodes.astype({"node_id": "category"})))


def test_an_origin_that_is_a_number_is_told_once() -> None:
    demand = Demand(one_trip().table.assign(origin=[1]))
    with pytest.raises(InputError) as raised:
        check_demand(demand, two_links())
    assert str(raised.value) == (
        "demand: 1 row has an origin that is not text (origin 1): "
        'turn the ids of all tables into text with .astype("str")'
    )


@pytest.mark.parametrize("column", ["length", "lanes", "free_speed", "jam_density"])
@pytest.mark.parametrize("value", [0.0, -1.0])
def test_what_is_not_above_zero_is_told_with_its_link(column: str, value: float) -> None:
    told = faults_of_links(column, [1.0, value])
    assert told == f"links: 1 row has {column} <= 0 (link_id b-c)"


@pytest.mark.parametrize(
    ("column", "limit", "unit"),
    [
        ("length", 1e7, "m"),
        ("lanes", 100, "lanes"),
        ("free_speed", 150, "m/s"),
        ("jam_density", 1, "veh/m/lane"),
    ],
)
def test_what_no_road_has_is_told_with_the_limit(column: str, limit: float, unit: str) -> None:
    network = two_links()
    check_network(replace(network, links=network.links.assign(**{column: limit})))
    told = faults_of_links(column, [limit, 2 * limit])
    assert told == (
        f"links: 1 row has {column} > {limit:g} {unit} (link_id b-c): is the unit right?"
    )


def test_parts_of_lanes_are_none() -> None:
    told = faults_of_links("lanes", [1.5, 1.0])
    assert told == "links: 1 row has lanes that are not a whole number (link_id a-b)"


def test_more_vehicles_than_anyone_can_move_are_told_once() -> None:
    table = pd.concat([one_trip().table.assign(vehicles=6e8)] * 2, ignore_index=True)
    check_demand(Demand(table.iloc[:1]), two_links())
    with pytest.raises(InputError, match=r"1.2e\+09 vehicles in all .* at most 1e\+09"):
        check_demand(Demand(table), two_links())


@pytest.mark.parametrize(
    ("changes", "column"),
    [
        ({"reaction_time": 0.001}, "reaction_time"),
        ({"reaction_time": 101.0}, "reaction_time"),
        ({"platoon_size": 10_001}, "platoon_size"),
        ({"duration": 1.1e8, "platoon_size": 100}, "duration"),
        ({"duration": 9e7, "platoon_size": 1}, "duration"),
    ],
)
def test_settings_that_no_computer_could_run(changes: dict[str, Any], column: str) -> None:
    with pytest.raises(InputError) as raised:
        Settings(**{"duration": 3600.0, **changes})
    (fault,) = raised.value.faults
    assert fault.column == column
    assert fault.value == changes[column]


@pytest.mark.parametrize("value", [np.inf, "fast"])
def test_what_is_no_finite_number_is_told(value: object) -> None:
    told = faults_of_links("free_speed", [value, 1.0])
    assert told == "links: 1 row has a free_speed that is not a finite number (link_id a-b)"


def test_empty_lanes_are_a_fault_and_empty_capacity_is_not() -> None:
    assert "1 row has no lanes" in faults_of_links("lanes", [np.nan, 1.0])
    assert "capacity <= 0" in faults_of_links("capacity", [np.nan, 0.0])


def test_why_a_reader_left_a_column_empty_is_repeated() -> None:
    note = {"topic": "placeholder", "value": "lanes", "note": "capacity is 1 on every link"}
    network = two_links()
    empty = replace(network, links=network.links.assign(lanes=np.nan), notes=pd.DataFrame([note]))
    with pytest.raises(InputError, match=r"2 rows have no lanes.*capacity is 1 on every link"):
        check_network(empty)


def test_unknown_and_missing_ends_and_repeated_ids() -> None:
    assert "a to_node_id that is not in the nodes (link_id b-c)" in faults_of_links(
        "to_node_id", ["b", "x"]
    )
    assert "1 row has no from_node_id (row 2)" in faults_of_links("from_node_id", ["a", None])
    assert "the link_id of an earlier row" in faults_of_links("link_id", ["a", "a"])


def test_all_faults_come_at_once() -> None:
    network = two_links()
    links = network.links.assign(length=[0.0, 1.0], merge_priority=[1.0, -2.0])
    nodes = network.nodes.assign(control=["none", "maybe", "none"])
    turns = pd.DataFrame({"node_id": ["b"], "from_link_id": ["a-b"], "to_link_id": ["c-a"]})
    with pytest.raises(InputError) as raised:
        check_network(Network(nodes, links, turns))
    assert len(raised.value.faults) == 4
    assert "movements: 1 row has a to_link_id that is not in the links" in str(raised.value)


def faults_of_turns(*rows: tuple[str | None, ...]) -> str:
    """All faults of banned turns: node, from and to link, via links; b-c comes after a-b."""
    columns = ["node_id", "from_link_id", "to_link_id", "via_link_ids"]
    network = two_links()
    with pytest.raises(InputError) as raised:
        check_network(Network(network.nodes, network.links, pd.DataFrame(rows, columns=columns)))
    return str(raised.value)


def test_banned_turns_name_links_that_follow_one_another() -> None:
    text = faults_of_turns(
        ("b", "a-b", "b-c", None),
        ("x", "a-b", "b-c", None),
        ("b", "a-x", "b-c", None),
        ("b", None, "b-c", None),
        ("c", "a-b", "b-c", ""),
        ("c", "b-c", "a-b", None),
        ("b", "a-b", "b-c", "b-x"),
        ("b", "a-b", "a-b", "b-c"),
    )
    for told in (
        "1 row has a node_id that is not in the nodes (row 2)",
        "1 row has a from_link_id that is not in the links (row 3)",
        "1 row has no from_link_id (row 4)",
        "2 rows have a from_link_id that does not end at its node_id (rows 2, 5)",
        "1 row has a to_link_id that does not start where its from_link_id ends (row 6)",
        "1 row has via_link_ids that are not in the links (row 7)",
        "1 row has via_link_ids that do not lead from from_link_id to to_link_id (row 8)",
        "2 rows have the banned turn of an earlier row (rows 2, 5)",
    ):
        assert told in text
    assert text.count("\n") == 7


def test_banned_turns_that_make_sense_are_accepted() -> None:
    network = two_links()
    turns = pd.DataFrame({"node_id": ["b"], "from_link_id": ["a-b"], "to_link_id": ["b-c"]})
    check_network(Network(network.nodes, network.links, turns))
    with pytest.raises(InputError, match="movements: lacks the column to_link_id"):
        check_network(Network(network.nodes, network.links, turns.drop(columns="to_link_id")))


def test_missing_columns_and_empty_tables() -> None:
    network = two_links()
    with pytest.raises(InputError, match="links: lacks the column lanes"):
        check_network(replace(network, links=network.links.drop(columns="lanes")))
    with pytest.raises(InputError, match="links: there is no row"):
        check_network(replace(network, links=network.links.iloc[:0]))


@pytest.mark.parametrize(
    ("column", "value", "told"),
    [
        ("origin", "x", "an origin that is not a node of the network"),
        ("destination", None, "no destination"),
        ("destination", "a", "the same origin and destination"),
        ("start_s", -1.0, "start_s < 0"),
        ("end_s", 0.0, "end_s <= start_s"),
        ("end_s", np.inf, "an? end_s that is not a finite number"),
        ("vehicles", 0.0, "vehicles <= 0"),
        ("vehicles", np.nan, "vehicles that are not a finite number"),
    ],
)
def test_what_is_wrong_with_a_demand(column: str, value: object, told: str) -> None:
    table = one_trip().table.astype(object)
    table.loc[0, column] = value
    with pytest.raises(InputError, match=told):
        check_demand(Demand(table), two_links())


def test_a_demand_without_rows_is_nobody_travelling() -> None:
    check_demand(Demand(one_trip().table.iloc[:0]), two_links())
