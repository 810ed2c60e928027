"""Capacities of links and nodes: a queue leaves at exactly what is allowed."""

from __future__ import annotations

import numpy as np
import pytest
from control_site import assert_names, bind, faults_of, only, site_of, steps_of_rule
from small_networks import Q, demand, entries, exits, link, network, simulate

from uxsim_geo.control import LinkCapacity, NodeCapacity
from uxsim_geo.settings import Settings

ROAD = [link("a", "1", "2"), link("b", "2", "3"), link("c", "3", "4")]
CROSS = [link("a", "1", "3"), link("b", "2", "3"), link("c", "3", "4"), link("d", "3", "5")]
SITE = site_of(network(CROSS))


def test_both_ends_of_a_link_follow_their_timetables() -> None:
    measure = LinkCapacity(["a", "c"], exit=((0, 0.5), (60, 0.4)), entry=0.3)
    leave, enter = bind(measure, SITE)
    assert (leave.name, enter.name) == (
        "exit capacity of links a, c",
        "entry capacity of links a, c",
    )
    steps = steps_of_rule(leave, SITE, "exit_capacity")
    assert {time: values.tolist() for time, values in steps.items()} == {
        0: [0.5, Q, 0.5, Q],
        60: [0.4, Q, 0.4, Q],
    }
    assert steps_of_rule(enter, SITE, "entry_capacity")[0.0].tolist() == [0.3, Q, 0.3, Q]


def test_the_capacity_of_a_node_is_felt_on_the_links_that_end_there() -> None:
    rule = only(NodeCapacity(["3"], 0.5), SITE)
    assert rule.name == "capacity of node 3"
    assert rule.felt_at.tolist() == [0, 1]
    nodes = steps_of_rule(rule, SITE, "node_capacity")[0.0]
    assert nodes[SITE.node_position["3"]] == 0.5
    assert np.isinf(np.delete(nodes, SITE.node_position["3"])).all()


def test_all_faults_of_capacities_are_named_at_once() -> None:
    assert_names(faults_of(LinkCapacity(["a"]), SITE), ["give exit, entry or both"])
    text = faults_of(LinkCapacity(["a"], exit=1800, entry=-1), SITE)
    assert_names(text, ["column exit: changes nothing", "0.8 veh/s", "column entry"])
    text = faults_of(NodeCapacity(["3", "9", "x"], 1.7), SITE)
    assert_names(text, ["'9'", "'x'", "column capacity: changes nothing", "1.6 veh/s"])
    assert "no node of the network is meant" in faults_of(NodeCapacity([], 0.5), SITE)


@pytest.mark.parametrize("size", [1, 5, 10])
@pytest.mark.parametrize("side", ["exit", "entry"])
def test_a_link_passes_what_its_ends_may(side: str, size: int) -> None:
    """Flow at b's end is 0.3 veh/s while it is limited, and Q afterwards."""
    measure = LinkCapacity(["b"], **{side: 0.3}, begin=600, end=1800)
    result = simulate(
        network(ROAD),
        demand(("1", "4", 0.0, 1000.0, 3000.0)),
        Settings(3000, size),
        control=[measure],
    )
    times = exits(result, "b") if side == "exit" else entries(result, "b")
    limited = times[(times >= 600 + size / 0.3) & (times < 1800)]
    assert np.diff(limited) == pytest.approx(size / 0.3)
    after = times[(times > 1900) & (times < 2900)]
    assert np.diff(after) == pytest.approx(size / Q)


@pytest.mark.parametrize("size", [1, 5, 10])
def test_a_node_passes_its_capacity_from_all_links_together(size: int) -> None:
    """Two queues of 0.8 veh/s each share 0.5 veh/s of the node, though each has its own way out."""
    result = simulate(
        network(CROSS),
        demand(("1", "4", 0.0, 1000.0, 2000.0), ("2", "5", 0.0, 1000.0, 2000.0)),
        Settings(2000, size),
        control=[NodeCapacity(["3"], 0.5, begin=500)],
    )
    times = np.sort(np.concatenate([exits(result, "a"), exits(result, "b")]))
    limited = times[times >= 500 + size / 0.5]
    assert np.diff(limited) == pytest.approx(size / 0.5)
    before = times[(times > 100) & (times < 500)]
    assert len(before) * size / 400 == pytest.approx(2 * Q, abs=2 * size / 400 + 1e-9)
