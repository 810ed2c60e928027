"""Barriers, each within a road of its own that is named by the tags of its barrier."""

from __future__ import annotations

from pathlib import Path

import pytest
from osm_files import node, noted, read, read_data, restriction, topics, way

from uxsim_geo.network.network import Network
from uxsim_geo.network.osm_options import OsmOptions
from uxsim_geo.network.ready import make_ready
from uxsim_geo.network.ready_options import ReadyOptions

CLOSED, OPEN, PRIVATE = "closed", "open", "private"

#: private: open if roads of private access are
BARRIERS = {
    "barrier=bollard": CLOSED,
    "barrier=block": CLOSED,
    "barrier=jersey_barrier": CLOSED,
    "barrier=cycle_barrier": CLOSED,
    "barrier=chain": CLOSED,
    "barrier=fence": CLOSED,
    "barrier=bus_trap": CLOSED,
    "barrier=gate": OPEN,
    "barrier=lift_gate": OPEN,
    "barrier=toll_booth": OPEN,
    "barrier=cattle_grid": OPEN,
    "barrier=height_restrictor": OPEN,
    "barrier=yes": OPEN,
    "barrier=kerb": OPEN,
    "barrier=gate & locked=yes": CLOSED,
    "barrier=gate & locked=no": OPEN,
    "barrier=gate & access=no": CLOSED,
    "barrier=gate & access=private": PRIVATE,
    "barrier=lift_gate & motor_vehicle=private": PRIVATE,
    "barrier=gate & access=private & motorcar=yes": OPEN,
    "barrier=gate & locked=yes & access=yes": OPEN,
    "barrier=gate & access=destination": OPEN,
    "barrier=bollard & access=yes": OPEN,
    "barrier=bollard & motor_vehicle=permissive": OPEN,
    "barrier=bollard & bicycle=yes": CLOSED,
    "barrier=bollard & vehicle=no": CLOSED,
    "barrier=bollard & bollard=rising": OPEN,
    "barrier=bollard & bollard=removable": CLOSED,
    "barrier=bollard & bollard=rising & access=no": CLOSED,
    "barrier=toll_booth & hgv=no": OPEN,
}

#: roads besides those: of two ways, at a junction and an end, one-way, before a footway
OTHERS = {
    *("to the bollard", "from the bollard", "through the junction", "branch"),
    *("ends at a bollard", "one-way", "before a footway"),
}


def links_of(network: Network, *names: str) -> set[str]:
    return set(network.links["link_id"][network.links["name"].isin(names)])


def bans(network: Network, *names: str) -> set[tuple[str, str]]:
    """Banned turns between the links of the roads named."""
    table = network.movements
    own = table[table["from_link_id"].isin(links_of(network, *names))]
    assert set(own["restriction"]) <= {"barrier"}
    return set(zip(own["from_link_id"], own["to_link_id"], strict=True))


@pytest.mark.parametrize("name", BARRIERS)
@pytest.mark.parametrize("private", [False, True])
def test_a_barrier_cuts_its_road_or_leaves_it_whole(name: str, private: bool) -> None:
    network = read_data("barriers.osm", OsmOptions(private=private))
    closed = BARRIERS[name] == CLOSED or (BARRIERS[name] == PRIVATE and not private)
    way_id = 100 + list(BARRIERS).index(name)
    first, middle, last = (3 * (way_id - 100) + number for number in (1, 2, 3))
    if not closed:
        assert links_of(network, name) == {f"{way_id}:{first}-{last}", f"{way_id}:{last}-{first}"}
        assert bans(network, name) == set()
        return
    there, back = f"{way_id}:{first}-{middle}", f"{way_id}:{middle}-{first}"
    onward, from_there = f"{way_id}:{middle}-{last}", f"{way_id}:{last}-{middle}"
    assert links_of(network, name) == {there, back, onward, from_there}
    # nobody goes on; turning round stays open
    assert bans(network, name) == {(there, onward), (from_there, back)}
    rows = network.movements[network.movements["from_link_id"] == there]
    assert list(rows["node_id"]) == list(rows["source_id"]) == [str(middle)]


def test_no_road_of_the_file_is_forgotten_here() -> None:
    assert set(read_data("barriers.osm").links["name"]) == {*BARRIERS, *OTHERS}


def test_where_two_ways_meet_nobody_passes_either() -> None:
    network = read_data("barriers.osm")
    assert bans(network, "to the bollard", "from the bollard") == {
        ("201:201-202", "202:202-203"),
        ("202:203-202", "201:202-201"),
    }


def test_a_oneway_road_ends_at_its_bollard() -> None:
    assert bans(read_data("barriers.osm"), "one-way") == {("231:231-232", "231:232-233")}


def test_at_a_junction_and_where_the_road_ends_nothing_is_closed() -> None:
    network = read_data("barriers.osm")
    names = ("through the junction", "branch", "ends at a bollard", "before a footway")
    assert bans(network, *names) == set()
    notes = network.notes[network.notes["topic"] == "barrier at a junction"]
    assert list(notes["severity"]) == ["warning"]
    assert notes["note"].iloc[0].startswith("node 212:")


def test_every_link_that_ends_at_a_barrier_is_told_of() -> None:
    network = read_data("barriers.osm")
    notes = network.notes[network.notes["topic"] == "barrier"]
    assert set(notes["element_id"]) == set(network.movements["from_link_id"])
    told = dict(zip(notes["element_id"], notes["value"], strict=True))
    assert told["100:1-2"] == told["100:3-2"] == "barrier=bollard"
    assert told["118:55-56"] == "barrier=lift_gate motor_vehicle=private"
    others = network.notes[network.notes["topic"] == "barriers"]
    kinds = {note.split()[2]: int(value) for note, value in others[["note", "value"]].values}
    assert kinds["barrier=bollard"] == 5  # three with access or rising, two where a road ends
    assert kinds["barrier=gate"] == 5


def test_barriers_can_be_ignored() -> None:
    network = read_data("barriers.osm", OsmOptions(barriers="ignored"))
    assert len(network.movements) == 0
    assert links_of(network, "barrier=bollard") == {"100:1-3", "100:3-1"}
    assert "barrier" not in topics(network)
    assert sum(int(number) for number in noted(network, "barriers")) == len(BARRIERS) + 5


def test_a_restriction_at_the_same_place_keeps_its_name(tmp_path: Path) -> None:
    nodes = (node(1, 0, 0), node(2, 1, 0, {"barrier": "bollard"}), node(3, 2, 0))
    ban = restriction(7, "no_straight_on", "from w10 via n2 to w11")
    network = read(tmp_path, *nodes, way(10, [1, 2]), way(11, [2, 3]), ban)
    table = network.movements.set_index("from_link_id")
    assert table.loc["10:1-2", ["restriction", "source_id"]].tolist() == ["no_straight_on", "7"]
    assert table.loc["11:3-2", ["restriction", "source_id"]].tolist() == ["barrier", "2"]


def test_the_cut_stays_when_the_network_is_made_ready(tmp_path: Path) -> None:
    """A square with a bollard in one side: what was one side is two dead ends, not joined."""
    places = {1: (0, 0), 2: (5, 0), 3: (5, 5), 4: (0, 5)}
    corners = (node(number, x, y) for number, (x, y) in places.items())
    bollard = node(9, 2, 0, {"barrier": "bollard"})
    square = way(10, [1, 9, 2, 3, 4, 1])
    arms = (node(5, -3, 0), node(6, 8, 0), way(11, [5, 1]), way(12, [2, 6]))
    network = read(tmp_path, *corners, bollard, square, *arms)
    ready = make_ready(network, ReadyOptions(sampled_ways=100))
    nodes = set(ready.nodes["node_id"])
    assert "9" in nodes
    assert not {"3", "4"} & nodes  # joined: nothing meets there
    through = ready.movements[ready.movements["restriction"] == "barrier"]
    assert set(through["node_id"]) == {"9"}
    assert len(through) == 2
