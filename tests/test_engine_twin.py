"""The engine against the twin that moves every platoon in every step.

Both get the same links, departures and routes, and the counts at both ends of every link are
compared. Where links hold a whole number of platoons the two are one model, and differ only by
what the twin's steps round. Where they do not, the twin can only store whole platoons while the
engine stores the fraction too: queues that reach back over several links may then differ by two.

Where in-links compete the two draw different lots, so the twin is told in which order the engine
let them go: rules are compared, not luck; the shares that come of luck are compared with the
priorities.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace

import numpy as np
import pandas as pd
import pytest
from twin import Case, TwinLink, TwinTrip, counts_at, largest_difference, run_twin

from uxsim_geo.demand.demand import Demand
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

#: link_ids from origin to destination: the only way there is
Routes = Mapping[tuple[str, str], Sequence[str]]
#: origin, destination, start (s), end (s), flow (veh/s)
Stream = tuple[str, str, float, float, float]

PLATOON_SIZES = (1, 5)
DURATION = 1200.0


def network_of(links: Sequence[TwinLink]) -> Network:
    table = pd.DataFrame([asdict(link) for link in links])
    table = table.rename(columns={"from_node": "from_node_id", "to_node": "to_node_id"})
    table["capacity"] = table["capacity"].astype("float64")
    ids = pd.unique(pd.concat([table["from_node_id"], table["to_node_id"]]))
    return Network(pd.DataFrame({"node_id": ids}), table)


def run_engine(links: Sequence[TwinLink], streams: Sequence[Stream], settings: Settings) -> Result:
    """Simulate streams of whole platoons, as the twin knows no smaller ones."""
    table = pd.DataFrame(streams, columns=["origin", "destination", "start_s", "end_s", "flow"])
    vehicles = table.pop("flow") * (table["end_s"] - table["start_s"])
    size = settings.platoon_size
    table["vehicles"] = np.floor(vehicles / size) * size
    return simulate(network_of(links), Demand(table), settings)


def twin_case(links: Sequence[TwinLink], routes: Routes, result: Result, substeps: int) -> Case:
    """The same run for the twin, with the engine's departures and its order at merges."""
    pairs = zip(result.trips["origin"], result.trips["destination"], strict=True)
    departures = zip(result.trips["depart_s"], pairs, strict=True)
    trips = [TwinTrip(depart, tuple(routes[pair])) for depart, pair in departures]
    assert set(result.trips["vehicles"]) == {result.settings.platoon_size}
    return Case(
        links,
        trips,
        result.settings.duration,
        result.settings.platoon_size,
        substeps=substeps,
        merge_order=merge_order(links, result.events),
    )


def merge_order(links: Sequence[TwinLink], events: pd.DataFrame) -> dict[str, list[str]]:
    ends = {link.link_id: link.to_node for link in links}
    done = events.dropna(subset="exit_s").sort_values("exit_s", kind="stable")
    order: dict[str, list[str]] = {}
    for link in done["link"].astype(str):
        order.setdefault(ends[link], []).append(link)
    in_links = pd.Series(ends).value_counts()
    return {node: went for node, went in order.items() if in_links[node] > 1}


def differences(case: Case, result: Result) -> pd.DataFrame:
    """Largest distance of the counts, in platoons, at the entry and the exit of every link."""
    grid = np.arange(0.0, case.duration, 1.0)
    passages = run_twin(case)
    rows = []
    for link_id, twin in passages.items():
        engine = result.events[result.events["link"] == link_id]
        ends = ((engine["enter_s"], twin.entries), (engine["exit_s"], twin.exits))
        rows.append(
            [largest_difference(counts_at(a, 1, grid), counts_at(b, 1, grid)) for a, b in ends]
        )
    return pd.DataFrame(rows, index=list(passages), columns=["entry", "exit"])


MERGE = [TwinLink("main", "1", "3", 600), TwinLink("side", "2", "3", 600)]
CASES: dict[str, tuple[list[TwinLink], Routes, list[Stream]]] = {
    "one link": (
        [TwinLink("a", "1", "2", 1000)],
        {("1", "2"): ["a"]},
        [("1", "2", 0, 500, 0.5), ("1", "2", 500, 800, 1.2)],
    ),
    "three lanes": (
        [TwinLink("a", "1", "2", 1000, lanes=3), TwinLink("b", "2", "3", 600, lanes=1)],
        {("1", "3"): ["a", "b"]},
        [("1", "3", 0, 900, 1.5)],
    ),
    "bottleneck by speed": (
        [
            TwinLink("fast", "1", "2", 500),
            TwinLink("slow", "2", "3", 500, 6),
            TwinLink("after", "3", "4", 500),
        ],
        {("1", "4"): ["fast", "slow", "after"]},
        [("1", "4", 0, 800, 0.75), ("1", "4", 800, 1000, 0.2)],
    ),
    "bottleneck by capacity": (
        [
            TwinLink("wide", "1", "2", 500),
            TwinLink("narrow", "2", "3", 300, capacity=0.4),
            TwinLink("after", "3", "4", 300),
        ],
        {("1", "4"): ["wide", "narrow", "after"]},
        [("1", "4", 0, 800, 0.75), ("1", "4", 800, 1000, 0.2)],
    ),
    "merge 1:1": (
        [*MERGE, TwinLink("out", "3", "4", 600)],
        {("1", "4"): ["main", "out"], ("2", "4"): ["side", "out"]},
        [("1", "4", 0, 1000, 0.7), ("2", "4", 0, 1000, 0.6)],
    ),
    "merge 1:3": (
        [
            TwinLink("main", "1", "3", 600, merge_priority=3),
            TwinLink("side", "2", "3", 600, merge_priority=1),
            TwinLink("out", "3", "4", 600),
        ],
        {("1", "4"): ["main", "out"], ("2", "4"): ["side", "out"]},
        [("1", "4", 0, 600, 0.7), ("2", "4", 200, 1000, 0.6)],
    ),
    "diverge": (
        [
            TwinLink("in", "1", "2", 600),
            TwinLink("left", "2", "3", 400),
            TwinLink("right", "2", "4", 400, capacity=0.2),
        ],
        {("1", "3"): ["in", "left"], ("1", "4"): ["in", "right"]},
        [("1", "3", 0, 800, 0.4), ("1", "4", 0, 600, 0.3)],
    ),
}


@pytest.mark.parametrize("platoon_size", PLATOON_SIZES)
@pytest.mark.parametrize("name", CASES)
def test_counts_are_those_of_the_twin(name: str, platoon_size: int) -> None:
    links, routes, streams = CASES[name]
    result = run_engine(links, streams, Settings(DURATION, platoon_size, seed=5))
    substeps = max(link.lanes for link in links)
    found = differences(twin_case(links, routes, result, substeps), result)
    assert found.to_numpy().max() <= 1, f"platoons apart:\n{found}"


@pytest.mark.parametrize("capacity", [None, 0.3])
def test_counts_on_short_links_are_those_of_the_twin(capacity: float | None) -> None:
    # 1.2 to 5.6 platoons fit on a link; with a narrow end the queue reaches back over all of them
    lengths = [1000, 37, 140, 30, 113, 61, 1000]
    links = [
        TwinLink(f"{number}", f"{number}", f"{number + 1}", length)
        for number, length in enumerate(lengths)
    ]
    links[-1] = replace(links[-1], capacity=capacity)
    routes = {("0", "7"): [link.link_id for link in links]}
    result = run_engine(links, [("0", "7", 0, 700, 1.0)], Settings(DURATION, 5, seed=1))
    found = differences(twin_case(links, routes, result, substeps=5), result)
    assert found.to_numpy().max() <= 2, f"platoons apart:\n{found}"


def corridor(seed: int) -> tuple[list[TwinLink], Routes, list[Stream]]:
    """A road with two ramps on and one off, its figures drawn; each link stores whole platoons."""
    random = np.random.default_rng(seed)

    def link(link_id: str, from_node: str, to_node: str, *, lanes: int = 1) -> TwinLink:
        capacity = None if random.random() < 0.7 else lanes * random.uniform(0.3, 0.6)
        jam_density = random.uniform(0.12, 0.2)
        return TwinLink(
            link_id,
            from_node,
            to_node,
            length=random.integers(6, 30) * 5 / (lanes * jam_density),
            free_speed=random.uniform(6, 22),
            lanes=lanes,
            jam_density=jam_density,
            capacity=capacity,
            merge_priority=random.uniform(0.5, 3),
        )

    links = [
        link("first", "a", "b", lanes=2),
        link("on", "x", "b"),
        link("second", "b", "c", lanes=2),
        link("off", "c", "y"),
        link("third", "c", "d"),
        link("on again", "z", "d"),
        link("last", "d", "e"),
    ]
    routes = {
        ("a", "e"): ["first", "second", "third", "last"],
        ("a", "y"): ["first", "second", "off"],
        ("x", "e"): ["on", "second", "third", "last"],
        ("x", "y"): ["on", "second", "off"],
        ("z", "e"): ["on again", "last"],
    }
    streams: list[Stream] = []
    for origin, destination in routes:
        start = random.uniform(0, 300)
        end = start + random.uniform(200, 600)
        streams.append((origin, destination, start, end, random.uniform(0.1, 0.6)))
    return links, routes, streams


@pytest.mark.parametrize("seed", range(8))
def test_counts_on_a_drawn_corridor_are_those_of_the_twin(seed: int) -> None:
    links, routes, streams = corridor(seed)
    result = run_engine(links, streams, Settings(DURATION, 5, seed=seed))
    found = differences(twin_case(links, routes, result, substeps=2), result)
    assert found.to_numpy().max() <= 1, f"platoons apart:\n{found}"


@pytest.mark.parametrize("platoon_size", PLATOON_SIZES)
@pytest.mark.parametrize("priority", [1.0, 3.0])
def test_a_full_merge_is_shared_by_priority(platoon_size: int, priority: float) -> None:
    links = [
        TwinLink("main", "1", "3", 600, merge_priority=priority),
        TwinLink("side", "2", "3", 600),
        TwinLink("out", "3", "4", 600),
    ]
    duration = 500.0 * platoon_size
    streams = [("1", "4", 0.0, duration, 0.8), ("2", "4", 0.0, duration, 0.8)]
    result = run_engine(links, streams, Settings(duration, platoon_size, seed=1))
    went = result.events.loc[result.events["exit_s"] > 100, "link"]
    main, side = (int((went == name).sum()) for name in ("main", "side"))
    share = priority / (1 + priority)
    spread = np.sqrt(share * (1 - share) / (main + side))
    assert main + side > 300
    assert main / (main + side) == pytest.approx(share, abs=3 * spread)
