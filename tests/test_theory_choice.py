"""The options of route choice against what they say, worked out by hand.

Where chance decides, shares are compared to four standard deviations of their number.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from small_networks import Row, across, demand, entries, grid, link, network, on_link
from test_engine_order import hash_of
from test_theory_nodes import four_sigma
from weights import weights_of

from uxsim_geo.control import Closure, EnforcedRoute, Toll
from uxsim_geo.control.drivers import DriverClass
from uxsim_geo.control.site import Measure
from uxsim_geo.engine.simulation import Simulation, simulate
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

sizes = pytest.mark.parametrize("size", [1, 5])

PLATOONS = 8000
SPREAD = 20.0  # s
SECOND = 15.0 / 3600.0  # the value of a second to drivers of no class, currency


def way(link_id: str, start: str, end: str, seconds: float) -> Row:
    """A link of so many seconds at free flow, too wide to be full."""
    return link(link_id, start, end, 20.0 * seconds, lanes=20)


def run_logit(
    roads: Network, size: int, *, spread: float = SPREAD, control: tuple[Measure, ...] = ()
) -> Result:
    """From 1 to 9, a vehicle a second; updates are 4,000 platoons apart."""
    end = float(PLATOONS * size)
    told = Settings(end + 1000.0, size, route_noise=0.0, route_update_interval=end / 2)
    told = replace(told, route_choice="logit", logit_spread=spread)
    return simulate(roads, demand(("1", "9", 0.0, end, end)), told, control=control)


def share(result: Result, link_id: str, among: int = PLATOONS) -> float:
    return len(on_link(result, link_id)) / among


@sizes
@pytest.mark.parametrize(
    ("spread", "times"),
    [(20.0, (100, 115)), (20.0, (100, 110, 130)), (20.0, (100, 100)), (0.01, (100, 101))],
)
def test_logit_shares_are_the_ratios_of_what_detours_weigh(
    spread: float, times: tuple[float, ...], size: int
) -> None:
    """Where the spread is small all take the best."""
    links = [way(f"{number}", "1", "9", time) for number, time in enumerate(times)]
    result = run_logit(network(links), size, spread=spread)
    weights = np.exp(-(np.array(times) - times[0]) / spread)
    for number, expected in enumerate(weights / weights.sum()):
        error = four_sigma(expected, PLATOONS)
        assert share(result, f"{number}") == pytest.approx(expected, abs=error)
    assert (result.trips["status"] == "completed").all()


@sizes
def test_logit_chooses_at_every_node_among_links_that_lead_nearer(size: int) -> None:
    """1 to 9 takes 150 s over 2, 160 s over 3; nobody goes where it takes longer from."""
    links = [
        way("a", "1", "2", 100),
        way("a1", "2", "9", 50),
        way("a2", "2", "9", 60),
        way("back", "2", "1", 1),
        way("b", "1", "3", 110),
        way("b1", "3", "9", 50),
        way("away", "1", "4", 1),
        way("round", "4", "9", 151),
        way("in", "1", "z", 10),
        way("out", "z", "9", 10),
    ]
    result = run_logit(network(links, no_through=["z"]), size)
    assert set(result.events["link"]) == {"a", "a1", "a2", "b", "b1"}
    second = 1 / (1 + np.exp(10 / SPREAD))
    assert share(result, "b") == pytest.approx(second, abs=four_sigma(second, PLATOONS))
    came = len(on_link(result, "a"))
    assert share(result, "a2", came) == pytest.approx(second, abs=four_sigma(second, came))


@sizes
def test_logit_goes_by_the_last_update_alone(size: int) -> None:
    """A toll of one spread comes with the second update: half, and then 1/(1 + e) take it."""
    middle = PLATOONS * size / 2
    toll = Toll(["tolled"], SPREAD * SECOND, begin=middle)
    links = [way("tolled", "1", "9", 100), way("free", "1", "9", 100)]
    into = entries(run_logit(network(links), size, control=(toll,)), "tolled")
    for found, expected in ((into < middle, 0.5), (into >= middle, 1 / (1 + np.e))):
        error = four_sigma(expected, PLATOONS // 2)
        assert found.sum() / (PLATOONS // 2) == pytest.approx(expected, abs=error)


#: from the first step on, the old way counts 20 s more
TWO_WAYS = [way("old", "1", "9", 100), way("new", "1", "9", 110)]
SWITCH = Toll(["old"], 20 * SECOND, begin=1)


def two_ways(size: int, interval: float, order: int = 1, **told: Any) -> Simulation:
    """One vehicle a second; from the second update on, the new way is the better one."""
    end = 4 * interval
    settings = Settings(end, size, route_update_interval=interval, route_noise=0.0, **told)
    wish = demand(("1", "9", 0.0, end, end))
    return Simulation(network(TWO_WAYS[::order]), wish, settings, control=[SWITCH])


def weight_after(run: Simulation, time: float) -> float:
    """The weight of the old way, after the update at a time."""
    run.advance(time + run.settings.step)
    return float(weights_of(run)[0, 0])


@sizes
@pytest.mark.parametrize("weight", [0.0, 0.3, 0.5, 1.0])
@pytest.mark.parametrize("interval", [600.0, 20.0])
def test_gradual_updates_are_ten_small_steps_that_weigh_the_same(
    interval: float, weight: float, size: int
) -> None:
    """B = (1−λ)^(t/T) after every tenth of an interval T, as far as there are steps of time."""
    gradual = two_ways(size, interval, route_update_weight=weight, route_update_gradual=True)
    coarse = two_ways(size, interval, route_update_weight=weight)
    for tenth in range(1, 40):
        time = tenth * interval / 10
        if time % size == 0:
            here = weight_after(gradual, time)
            assert here == pytest.approx((1 - weight) ** (tenth / 10), abs=1e-5)
        if tenth % 10 == 0:
            assert here == pytest.approx(weight_after(coarse, time), abs=1e-5)


#: after the second update the fast way from a, 100 s, counts 400 s; over b there are 210 s
RING = [
    way("to", "1", "a", 10),
    way("fast", "a", "9", 100),
    way("over", "a", "b", 10),
    way("back", "b", "a", 10),
    way("slow", "b", "9", 200),
]


@sizes
@pytest.mark.parametrize("no_cycles", [False, True])
def test_inertia_sends_drivers_round_and_the_rule_against_cycles_does_not(
    no_cycles: bool, size: int
) -> None:
    """λ = ½: half go over from a to b; half of these come back, where no rule is against it."""
    trips, second = 3000, 3500.0 * size  # the second update, s
    told = Settings(2 * second, size, route_noise=0.0, route_update_interval=second)
    wish = demand(("1", "9", second, second + trips * size, trips * size))
    toll = Toll(["fast"], 300 * SECOND, begin=1)
    told = replace(told, no_cycles=no_cycles)
    result = simulate(network(RING), wish, told, control=[toll])
    assert set(result.trips["status"]) == {"completed"}
    over = on_link(result, "over")["vehicle"].value_counts()
    assert over.size / trips == pytest.approx(0.5, abs=four_sigma(0.5, trips))
    again = (over > 1).sum() / trips
    assert again == pytest.approx(0.0 if no_cycles else 0.125, abs=four_sigma(0.125, trips))
    assert (len(on_link(result, "back")) == 0) == no_cycles


@sizes
def test_who_has_been_everywhere_goes_on_all_the_same(size: int) -> None:
    """The way on from b is closed while some are on their way there: they return, and get home."""
    links = [
        way("to", "1", "a", 10),
        way("over", "a", "b", 100),
        way("back", "b", "a", 10),
        way("closed", "b", "9", 10),
        way("other", "a", "9", 300),
    ]
    told = Settings(3000, size, route_noise=0.0, route_update_weight=1.0, no_cycles=True)
    wish = demand(("1", "9", 0.0, 1000.0, 1000.0))
    result = simulate(network(links), wish, told, control=[Closure(["closed"], begin=600)])
    assert (result.trips["status"] == "completed").all()
    over, back, other = (set(on_link(result, n)["vehicle"]) for n in ("over", "back", "other"))
    assert back == over & other
    # they came to a between 500 and 600 s
    assert len(back) == pytest.approx(100 / size, abs=1)


@sizes
def test_without_draws_departures_lie_in_the_middle_of_their_share(size: int) -> None:
    """13 vehicles in 130 s: with platoons of 5 the last is of 3."""
    wish = demand(("1", "9", 20.0, 150.0, 13.0))
    result = simulate(network(TWO_WAYS), wish, Settings(999, size, deterministic=True))
    first = np.arange(0, 13, size)
    middle = (first + np.minimum(first + size, 13)) / 2
    assert result.trips["depart_s"].to_numpy() == pytest.approx(20 + 10 * middle)


@sizes
def test_without_draws_any_seed_gives_the_same_bytes(size: int) -> None:
    """Even where fractions of vehicles are rounded, and some of a class are informed."""
    half = DriverClass(informed_share=0.5, compliance=0.5)
    route = EnforcedRoute("0,1", "2,1", ("0,1-1,1", "1,1-2,1"), share=0.5)
    case = (network(grid(3)), across(3, 17.3, 300.0))

    def hash_with(seed: int) -> str:
        told = Settings(1500, size, seed=seed, deterministic=True)
        return hash_of(simulate(*case, told, control=[route], classes=[half]))

    assert hash_with(1) == hash_with(2)


@sizes
@pytest.mark.parametrize("order", ["ab", "ba"])
@pytest.mark.parametrize("priorities", [(1, 1), (1, 2), (3, 1), (2, 3)])
def test_without_draws_a_merge_shares_by_priority_in_every_round(
    priorities: tuple[int, int], order: str, size: int
) -> None:
    """Of any p + q that pass one after the other, p come from a and q from b."""
    priority = dict(zip("ab", priorities, strict=True))
    links = [link(name, name, "m", merge_priority=priority[name]) for name in order]
    wish = demand(*[(name, "9", 0.0, 100.0, 400.0 * size) for name in "ab"])
    told = Settings(300.0 * size, size, deterministic=True)
    result = simulate(network([*links, link("out", "m", "9")]), wish, told)
    passed = pd.concat([on_link(result, name) for name in "ab"]).dropna().sort_values("exit_s")
    from_a = (passed["link"] == "a").to_numpy()[4:]  # both have come to the node by then
    rounds = np.convolve(from_a, np.ones(sum(priorities)), mode="valid")
    assert rounds.size > 180
    assert (rounds == priorities[0]).all()


@sizes
@pytest.mark.parametrize(
    ("weight", "order", "updates"), [(0.4, 1, 2), (0.6, 1, 1), (0.5, 1, 2), (0.5, -1, 1)]
)
def test_without_draws_all_take_the_heaviest_way_or_the_first_of_equals(
    weight: float, order: int, updates: int, size: int
) -> None:
    """The old way weighs (1−λ)^n; at λ = ½ both weigh the same after one update."""
    run = two_ways(size, 600.0, order, route_update_weight=weight, deterministic=True)
    run.advance(run.settings.duration)
    old, new = (entries(run.result(), name) for name in ("old", "new"))
    assert old[-1] < updates * 600.0 <= new[0]
    assert old.size == updates * 600 // size
