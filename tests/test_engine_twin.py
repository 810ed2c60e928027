"""The engine against the twin that moves every platoon in every step.

Both get the same links, departures and routes. Where links hold a whole number of platoons the two
are one model, and every passage of every platoon is compared: the twin, which sees what begins or
ends within a step at its end, may be late by one of its steps for each link, and never early.
Where links hold a fraction of a platoon the twin can only store whole ones while the engine stores
the fraction too: there the counts are compared, and queues that reach back over several links may
differ by two platoons.

Where queues compete for a node the two draw different lots, so the twin is told in which order the
engine let them go: rules are compared, not luck.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace

import numpy as np
import pandas as pd
import pytest
from drawn_networks import Drawn, Routes, substeps_for, trees
from hypothesis import given, settings
from small_networks import Stream
from twin import HOME, Case, TwinLink, TwinTrip, counts_at, largest_difference, run_twin

from uxsim_geo.demand.demand import Demand
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

PLATOON_SIZES = (1, 5, 10)
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
        merge_order=merge_order(links, result),
    )


def merge_order(links: Sequence[TwinLink], result: Result) -> dict[str, list[str]]:
    """From which of several in-links, or from home, platoons went over each node in turn."""
    ends = {link.link_id: link.to_node for link in links}
    done, out = result.events.dropna(subset="exit_s"), result.trips.dropna(subset="enter_s")
    link = done["link"].astype(str)
    went = pd.DataFrame({"time": done["exit_s"], "node": link.map(ends), "queue": link})
    home = pd.DataFrame({"time": out["enter_s"], "node": out["origin"].astype(str), "queue": HOME})
    moves = pd.concat([home, went]).sort_values("time", kind="stable")
    orders = {str(node): own["queue"].tolist() for node, own in moves.groupby("node")}
    return {node: order for node, order in orders.items() if len(set(order)) > 1}


def passages(case: Case, result: Result) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Each end of each link, and the times (s) at which platoons pass it: engine, twin."""
    for link_id, twin in run_twin(case).items():
        engine = result.events[result.events["link"] == link_id]
        yield f"entry of {link_id}", np.sort(engine["enter_s"]), twin.entries
        yield f"exit of {link_id}", np.sort(engine["exit_s"].dropna()), twin.exits


def check_passages(case: Case, result: Result) -> None:
    """Hold every passage of the engine against that of the twin."""
    rounding = len(case.links) * case.step
    for name, engine, twin in passages(case, result):
        common = min(engine.size, twin.size)
        late = twin[:common] - engine[:common]
        assert late.min(initial=0) > -1e-6, name
        assert late.max(initial=0) < rounding, name
        unmatched = np.concatenate([engine[common:], twin[common:]])
        assert (unmatched > case.duration - rounding).all(), name


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
def test_all_passages_are_those_of_the_twin(name: str, platoon_size: int) -> None:
    links, routes, streams = CASES[name]
    result = run_engine(links, streams, Settings(DURATION, platoon_size, seed=5))
    substeps = max(link.lanes for link in links)
    check_passages(twin_case(links, routes, result, substeps), result)


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
    grid = np.arange(0.0, DURATION, 1.0)
    for name, engine, twin in passages(twin_case(links, routes, result, substeps=5), result):
        assert largest_difference(counts_at(engine, 1, grid), counts_at(twin, 1, grid)) <= 2, name


@pytest.mark.parametrize("platoon_size", PLATOON_SIZES)
def test_all_passages_on_drawn_trees_are_those_of_the_twin(platoon_size: int) -> None:
    """Up to eight links with merges, diverges, lanes, narrow links and trips from everywhere."""

    @settings(derandomize=True, deadline=None, max_examples=60)
    @given(trees(platoon_size))
    def check(drawn: Drawn) -> None:
        links, routes, streams = drawn
        result = run_engine(links, streams, Settings(240.0 * platoon_size, platoon_size, seed=1))
        check_passages(twin_case(links, routes, result, substeps_for(links)), result)

    check()
