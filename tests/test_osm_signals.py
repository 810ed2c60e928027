"""Signals at the junctions they control.

A street from node 1 in the west to node 9 in the east; at node 5 another street crosses it. A unit
is 100 m, and signals lie 0.2, 0.4 ... units before the crossing.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from osm_files import node, noted, read, topics, way

from uxsim_geo.network.network import Network
from uxsim_geo.network.osm_options import OsmOptions

SIGNAL = {"highway": "traffic_signals"}
CROSSING = (
    node(1, -3, 0),
    node(9, 3, 0),
    node(6, 0, 1),
    node(7, 0, -1),
    way(20, [6, 5, 7]),
)
PLAIN = node(5, 0, 0)
STREET = (1, 2, 5, 9)  # node 2 lies before the crossing


def controlled(network: Network) -> dict[str, str]:
    """Nodes with a signal, and the nodes of the file whose signals these are."""
    nodes = network.nodes
    signals = nodes[nodes["control"] == "signal"]
    assert nodes["signal_node_ids"][nodes["control"] == "none"].isna().all()
    return dict(zip(signals["node_id"], signals["signal_node_ids"], strict=True))


def test_a_signal_at_the_junction_is_its_own(tmp_path: Path) -> None:
    network = read(tmp_path, *CROSSING, node(5, 0, 0, SIGNAL), node(2, -2, 0), way(10, STREET))
    assert controlled(network) == {"5": "5"}
    assert "signal on approach" not in topics(network)


@pytest.mark.parametrize(
    ("tags", "east", "moved"),
    [
        ({}, -0.3, True),
        ({}, -0.6, False),
        ({"traffic_signals:direction": "forward"}, -0.3, True),
        ({"traffic_signals:direction": "backward"}, -0.3, False),
        ({"traffic_signals:direction": "both"}, -0.3, True),
        ({"crossing": "traffic_signals"}, -0.15, True),
        ({"crossing": "traffic_signals"}, -0.3, False),  # in mid-block
        ({"crossing": "no"}, -0.3, True),
        ({"traffic_signals": "pedestrian_crossing"}, -0.15, False),
        ({"traffic_signals": "ramp_meter"}, -0.15, False),
        ({"traffic_signals": "signal"}, -0.3, True),
    ],
)
def test_a_signal_on_the_approach_controls_the_next_junction(
    tmp_path: Path, tags: dict[str, str], east: float, moved: bool
) -> None:
    signal = node(2, east, 0, SIGNAL | tags)
    network = read(tmp_path, *CROSSING, PLAIN, signal, way(10, STREET))
    assert controlled(network) == ({"5": "2"} if moved else {})
    notes = network.notes
    if moved:
        note = notes[notes["topic"] == "signal on approach"].iloc[0]
        assert (note["element"], note["element_id"], note["value"]) == ("node", "5", "2")
    else:
        left = notes["element_id"][notes["topic"] == "signal at no junction"]
        assert list(left) == ["2"]


def test_the_distance_is_an_option(tmp_path: Path) -> None:
    signal = node(2, -0.6, 0, SIGNAL)
    options = OsmOptions(signal_distance=70.0)
    network = read(tmp_path, *CROSSING, PLAIN, signal, way(10, STREET), options=options)
    assert controlled(network) == {"5": "2"}


def test_against_the_drawing_backward_is_towards_the_junction(tmp_path: Path) -> None:
    signal = node(2, -0.3, 0, SIGNAL | {"traffic_signals:direction": "backward"})
    network = read(tmp_path, *CROSSING, PLAIN, signal, way(10, [9, 5, 2, 1]))
    assert controlled(network) == {"5": "2"}


def test_a_signal_behind_the_junction_of_a_oneway_street_is_not_its(tmp_path: Path) -> None:
    street = way(10, [1, 5, 2, 9], {"oneway": "yes"})
    network = read(tmp_path, *CROSSING, PLAIN, node(2, 0.3, 0, SIGNAL), street)
    assert controlled(network) == {}


def test_signals_of_several_approaches_are_one_junction(tmp_path: Path) -> None:
    signals = (node(2, -0.2, 0, SIGNAL), node(3, 0.2, 0, SIGNAL), node(4, 0, 0.2, SIGNAL))
    streets = (*CROSSING[:4], way(20, [6, 4, 5, 7]), way(10, [1, 2, 5, 3, 9]))
    network = read(tmp_path, *streets, PLAIN, *signals)
    assert controlled(network) == {"5": "2 3 4"}


def test_the_way_to_the_junction_may_lead_over_other_ways_and_nodes(tmp_path: Path) -> None:
    pieces = (node(3, -0.3, 0), node(4, -0.1, 0), way(10, [1, 2, 3]), way(11, [3, 4, 5, 9]))
    network = read(tmp_path, *CROSSING, PLAIN, node(2, -0.4, 0, SIGNAL), *pieces)
    assert controlled(network) == {"5": "2"}


def test_of_two_junctions_the_nearer_one(tmp_path: Path) -> None:
    other = (node(3, -0.7, 0), node(4, -0.7, 1), way(11, [3, 4]))
    street = way(10, [1, 3, 2, 5, 9])
    network = read(tmp_path, *CROSSING, PLAIN, *other, node(2, -0.4, 0, SIGNAL), street)
    assert controlled(network) == {"3": "2"}


def test_a_node_where_two_ways_meet_end_to_end_is_no_junction(tmp_path: Path) -> None:
    ends = (node(1, 0, 0), node(2, 1, 0, SIGNAL), node(3, 2, 0), way(10, [1, 2]), way(11, [2, 3]))
    network = read(tmp_path, *ends)
    assert controlled(network) == {}
    assert topics(network)["signal at no junction"] == 1


def test_crossings_with_signals_control_no_junction(tmp_path: Path) -> None:
    tags = {"highway": "crossing", "crossing": "traffic_signals"}
    network = read(tmp_path, *CROSSING, PLAIN, node(2, -0.1, 0, tags), way(10, STREET))
    assert controlled(network) == {}
    assert noted(network, "signalled crossings") == ["1"]


def test_signals_beside_the_roads_are_none(tmp_path: Path) -> None:
    footway = (node(3, 1, 1, SIGNAL), node(4, 2, 1), way(11, [3, 4], {"highway": "footway"}))
    network = read(tmp_path, *CROSSING, PLAIN, node(2, -2, 0), way(10, STREET), *footway)
    assert controlled(network) == {}
    assert "signal at no junction" not in topics(network)


def test_signals_among_nodes_at_one_place_are_left(tmp_path: Path) -> None:
    ring = [node(number, 0, 0, SIGNAL if number == 1 else None) for number in (1, 2, 3)]
    network = read(tmp_path, *ring, way(10, [1, 2, 3, 1]))
    assert controlled(network) == {}


def test_tags_of_nodes_are_kept(tmp_path: Path) -> None:
    mini = node(5, 0, 0, {"highway": "mini_roundabout"})
    gate = node(9, 3, 0, {"barrier": "gate"})
    others = (CROSSING[0], *CROSSING[2:], node(2, -2, 0))
    network = read(tmp_path, *others, mini, gate, way(10, STREET))
    nodes = network.nodes.set_index("node_id")
    assert nodes.loc["5", "highway"] == "mini_roundabout"
    assert nodes.loc["9", "barrier"] == "gate"
    assert topics(network)["barriers"] == 1
