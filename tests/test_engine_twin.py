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

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
import pandas as pd
import pytest
from drawn_networks import Barred, Drawn, Routes, barred_webs, row_of, substeps_for, trees
from hypothesis import example, given, settings
from plain_paths import Way, best_routes
from small_networks import Stream, network
from twin import HOME, Case, TwinLink, TwinTrip, counts_at, largest_difference, run_twin

from uxsim_geo.demand.demand import Demand
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

PLATOON_SIZES = (1, 5, 10)
DURATION = 1200.0


def run_engine(
    links: Sequence[TwinLink],
    streams: Sequence[Stream],
    settings: Settings,
    banned: Sequence[Way] = (),
) -> Result:
    """Simulate streams of whole platoons, as the twin knows no smaller ones."""
    table = pd.DataFrame(streams, columns=["origin", "destination", "start_s", "end_s", "flow"])
    vehicles = table.pop("flow") * (table["end_s"] - table["start_s"])
    size = settings.platoon_size
    table["vehicles"] = np.floor(vehicles / size) * size
    net = network([row_of(link) for link in links], banned=banned)
    return simulate(net, Demand(table), settings)


def twin_case(
    links: Sequence[TwinLink],
    routes: Routes,
    result: Result,
    substeps: int,
    banned: Sequence[Way] = (),
) -> Case:
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
        banned=banned,
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
    """Hold every passage of the engine against that of the twin.

    The twin's clock rounds twice a link: when a platoon is through, and when its gap is back.
    """
    rounding = 2 * len(case.links) * case.step
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


def detours(platoon_size: int) -> Barred:
    """Three pairs of nodes whose fastest ways are banned: how many are drawn is left to chance."""
    links: list[TwinLink] = []
    for here, there, stored_by_long in (("0", "1", 18), ("1", "2", 21), ("2", "0", 25)):
        for name, lanes, stored in ((f"short{here}", 2, 12), (f"long{here}", 1, stored_by_long)):
            length = (stored + 1e-9) * platoon_size / (lanes * 0.2)
            links.append(TwinLink(name, here, there, length, lanes=lanes))
    banned = [(f"short{here}", f"short{there}") for here, there in ("01", "12", "20")]
    streams = [
        (*pair, 80.0 * platoon_size * number, 80.0 * platoon_size * number + 40.0, 0.5)
        for number, pair in enumerate([("0", "2"), ("1", "0"), ("2", "1")])
    ]
    return links, banned, streams


@pytest.mark.parametrize("platoon_size", PLATOON_SIZES)
def test_all_passages_under_drawn_bans_are_those_of_the_twin(platoon_size: int) -> None:
    """Up to ten links, and bans; all take the way that a plain search finds, as nobody looks again.

    Runs where two ways are as good to a few milliseconds are left out.
    """
    compared = Counter[str]()

    @settings(derandomize=True, deadline=None, max_examples=120)
    @given(barred_webs(platoon_size))
    @example(detours(platoon_size))
    def check(drawn: Barred) -> None:
        links, banned, streams = drawn
        duration = 300.0 * platoon_size
        told = Settings(duration, platoon_size, route_noise=0.0, route_update_interval=duration)
        pairs = {(origin, destination) for origin, destination, *_ in streams}
        routes = {pair: best_way(links, banned, pair) for pair in sorted(pairs)}
        open_ = [stream for stream in streams if routes[stream[:2]]]
        if not open_ or "tie" in routes.values():
            return
        result = run_engine(links, open_, told, banned)
        found = {pair: list(way) for pair, way in routes.items() if way}
        check_passages(twin_case(links, found, result, substeps_for(links), banned), result)
        compared["runs"] += 1
        compared["detours"] += sum(
            best_way(links, [], pair) != way for pair, way in routes.items() if way
        )

    check()
    assert compared["runs"] > 40, compared
    assert compared["detours"] >= 3, compared


def best_way(
    links: Sequence[TwinLink], banned: Sequence[Way], pair: tuple[str, str]
) -> Way | Literal["tie"]:
    """The fastest way between two nodes, empty: none, or that there are two as good."""
    cost = {link.link_id: link.length / link.free_speed for link in links}
    rows = [row_of(link) for link in links]
    origin, destination = pair
    time, way = best_routes(rows, banned, cost, origin).get(destination, (np.inf, ()))
    for link_id in way:  # any other way leaves out one of these links
        others = [row for row in rows if row["link_id"] != link_id]
        other, _ = best_routes(others, banned, cost, origin).get(destination, (np.inf, ()))
        if other < time + 1e-3 * (len(links) + 1):
            return "tie"
    return way
