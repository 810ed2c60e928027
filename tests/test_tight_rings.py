"""Rings of links too short for a platoon: opened with no way changed, and then they never lock."""

from __future__ import annotations

from itertools import product

import pandas as pd
import pytest
from road_tables import drawn, plain_costs, road, shuffled, street

from uxsim_geo import Demand, Network, Settings, simulate
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.tight_rings import open_tight_rings

RING = "abcd"
PLACES = {"a": (0.0, 0.0), "b": (9.0, 0.0), "c": (9.0, 10.0), "d": (0.0, 10.0)}
ARMS = {"a": (0.0, -1.0), "b": (1.0, 0.0), "c": (0.0, 1.0), "d": (-1.0, 0.0)}


def crossing(*, bans: tuple[str, ...] = (), lanes: int = 1) -> Network:
    """A ring a-b-c-d of 9 and 10 m; at each node one way comes in from 500 m and one goes out."""
    places, roads = dict(PLACES), []
    for here, onward in zip(RING, RING[1:] + RING[0], strict=True):
        roads.append(road(here, onward, lanes=lanes, free_speed=8.0 + ord(here) % 4))
        x, y = PLACES[here]
        east, north = ARMS[here]
        places[f"i{here}"] = x + 500 * east + 4, y + 500 * north + 4
        places[f"o{here}"] = x + 500 * east - 4, y + 500 * north - 4
        roads += [road(f"i{here}", here), road(here, f"o{here}")]
    return drawn(places, roads, bans=bans)


def topics(notes: Notes) -> list[str]:
    return [str(row[2]) for row in notes.rows]


@pytest.mark.parametrize("cost", ["length", "time"])
@pytest.mark.parametrize("start", RING)
def test_every_way_through_is_as_long_and_as_fast_as_before(start: str, cost: str) -> None:
    notes = Notes()
    opened = open_tight_rings(crossing(), 5.0, notes)
    assert topics(notes) == ["tight ring"]
    before, after = (plain_costs(network, f"i{start}", cost) for network in (crossing(), opened))
    for end in RING:
        assert after[f"o{end}"] == pytest.approx(before[f"o{end}"], abs=1e-5)


def test_no_direct_link_leads_on_to_another() -> None:
    opened = open_tight_rings(crossing(), 5.0, Notes())
    direct = opened.links[opened.links["from_node_id"].isin(list(RING))]
    direct = direct[direct["to_node_id"].isin(list(RING))]
    pairs = set(zip(direct["from_node_id"], direct["to_node_id"], strict=True))
    assert pairs == {pair for pair in product(RING, RING) if pair[0] != pair[1]}
    bans = set(zip(opened.movements["from_link_id"], opened.movements["to_link_id"], strict=True))
    rows = list(direct[["link_id", "from_node_id", "to_node_id"]].itertuples(index=False))
    assert bans == {(one[0], two[0]) for one in rows for two in rows if one[2] == two[1]}
    assert opened.links["link_id"].is_unique
    assert opened.nodes.groupby("tight_ring")["node_id"].agg("".join).tolist() == ["abcd"]


def test_a_ring_that_locks_itself_no_longer_does() -> None:
    """Everybody goes three quarters of the way round: the ring fills, and in the model stands."""
    pairs = [("ia", "od"), ("ib", "oa"), ("ic", "ob"), ("id", "oc")]
    table = pd.DataFrame(pairs, columns=["origin", "destination"])
    demand = Demand(table.assign(start_s=0.0, end_s=600.0, vehicles=150.0))
    locked = []
    for network in (crossing(), open_tight_rings(crossing(), 5.0, Notes())):
        result = simulate(network, demand, Settings(3600.0))
        locked.append((result.locked_vehicles > 0, set(result.trips["status"])))
    assert locked[0][0]
    assert locked[1] == (False, {"completed"})


@pytest.mark.parametrize(
    ("network", "told"),
    [
        (crossing(lanes=3), []),  # 9 m x 3 lanes x 0.2 veh/m = 5.4 veh
        (crossing(bans=("ia-a a-b",)), ["tight ring left"]),
        (crossing(bans=("ia-a a-b b-c",)), ["tight ring left"]),
    ],
)
def test_rings_with_room_or_bans_stay(network: Network, told: list[str]) -> None:
    notes = Notes()
    assert open_tight_rings(network, 5.0, notes) is network
    assert topics(notes) == told


def test_roundabouts_with_two_way_streets_stay() -> None:
    places = dict(PLACES)
    roads = []
    for here, onward in zip(RING, RING[1:] + RING[0], strict=True):
        (x, y), (east, north) = PLACES[here], ARMS[here]
        places[f"s{here}"] = x + 300 * east, y + 300 * north
        roads += [road(here, onward, junction="roundabout"), street(here, f"s{here}")]
    network = drawn(places, roads)
    notes = Notes()
    assert open_tight_rings(network, 5.0, notes) is network
    assert topics(notes) == ["tight ring left"]


def test_a_ring_that_hangs_on_one_node_stays() -> None:
    places = PLACES | {"in": (-300.0, 0.0), "out": (0.0, -300.0)}
    roads = [road(here, onward) for here, onward in zip(RING, RING[1:] + RING[0], strict=True)]
    network = drawn(places, [*roads, road("in", "a"), road("a", "out")])
    assert open_tight_rings(network, 5.0, Notes()) is network


def test_nothing_is_asked_for() -> None:
    network = crossing()
    assert open_tight_rings(network, 0.0, Notes()) is network


def test_rows_in_another_order_give_the_same() -> None:
    opened = open_tight_rings(crossing(), 5.0, Notes())
    turned = open_tight_rings(shuffled(crossing(), 3), 5.0, Notes())
    for table, other, key in (
        (opened.links, turned.links, ["link_id"]),
        (opened.nodes, turned.nodes, ["node_id"]),
        (opened.movements, turned.movements, ["from_link_id", "to_link_id"]),
    ):
        one, two = (part.sort_values(key, ignore_index=True) for part in (table, other))
        pd.testing.assert_frame_equal(one, two)
