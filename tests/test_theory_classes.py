"""Classes of drivers against what they are told to know, to pay, to follow and to use.

Where chance decides, shares are compared to four standard deviations of their number.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
import pytest
from small_networks import Row, across, grid, link, network
from test_engine_order import hash_of
from test_engine_pieces import together
from test_theory_nodes import four_sigma

from uxsim_geo.control import Advice, EnforcedRoute, Toll
from uxsim_geo.control.drivers import DriverClass
from uxsim_geo.control.site import Measure
from uxsim_geo.demand.demand import DEMAND_COLUMNS, Demand
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.errors import InputError
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

sizes = pytest.mark.parametrize("size", [1, 5])


def wide(link_id: str, start: str, end: str, seconds: float) -> Row:
    """A link of so many seconds at free flow, too wide to be full."""
    return link(link_id, start, end, 20.0 * seconds, lanes=20)


#: 50 s over the short way, 100 s over the long one
WAYS = [
    wide("to", "1", "2", 10),
    wide("short", "2", "3", 50),
    wide("long", "2", "3", 100),
    wide("on", "3", "9", 10),
]


def wishes(*rows: tuple[str, str, float, float, float, str | None]) -> Demand:
    """Rows of origin, destination, start_s, end_s, vehicles, class."""
    return Demand(pd.DataFrame(rows, columns=[*DEMAND_COLUMNS, "class"]))


def from_1_to_9(
    classes: Sequence[DriverClass], size: int, platoons: int = 200, start: float = 0.0
) -> Demand:
    """So many platoons of every class, a vehicle a second."""
    count = float(platoons * size)
    return wishes(*[("1", "9", start, start + count, count, one.name) for one in classes])


def run(classes: Sequence[DriverClass], size: int, platoons: int = 200, **told: Any) -> Result:
    """Let drivers of some classes go from 1 to 9 at one time; no noise."""
    settings = Settings(platoons * size + 400.0, size, route_noise=0.0)
    demand = from_1_to_9(classes, size, platoons)
    return simulate(network(WAYS), demand, settings, classes=classes, **told)


def entries_of(result: Result, name: str, link_id: str) -> np.ndarray:
    """Times at which drivers of a class have entered a link, s, in order."""
    events = result.events[result.events["link"] == link_id]
    own = result.trips["class"].iloc[events["vehicle"]].to_numpy() == name
    return np.sort(events["enter_s"].to_numpy()[own])


def share(result: Result, name: str, link_id: str) -> float:
    """The share of the platoons of a class that have entered a link."""
    return len(entries_of(result, name, link_id)) / int((result.trips["class"] == name).sum())


def who_used(result: Result, link_id: str) -> set[str]:
    used = result.events["vehicle"][result.events["link"] == link_id]
    return set(result.trips["class"].iloc[used])


#: two ways from 1 to 9; on the faster one, by 10 s, others stand at node 9 for good
JAM = [
    wide("a1", "1", "2", 500),
    wide("a2", "2", "9", 5),
    wide("b1", "1", "3", 500),
    wide("b2", "3", "9", 15),
    link("stop", "9", "10", 100, capacity=1e-6),
]


def run_into_jam(demand: Demand, classes: Sequence[DriverClass], size: int, jam: float) -> Result:
    """The jam begins some seconds after a time, s; all routes are from the last update alone."""
    both = together(demand, wishes(("2", "10", jam, jam + 1000.0, 2000.0, None)))
    settings = Settings(both.table["end_s"].max(), size, route_noise=0.0, route_update_weight=1.0)
    return simulate(network(JAM), both, settings, classes=classes)


@sizes
def test_who_is_not_informed_drives_into_the_jam(size: int) -> None:
    classes = [DriverClass(f"{part:g}", informed_share=part) for part in (0.0, 0.3, 1.0)]
    result = run_into_jam(from_1_to_9(classes, size, 1000, 610.0), classes, size, jam=0.0)
    assert share(result, "0", "a1") == share(result, "1", "b1") == 1.0
    assert share(result, "0.3", "b1") == pytest.approx(0.3, abs=four_sigma(0.3, 1000))


@sizes
def test_drivers_react_when_their_next_update_shows_the_jam(size: int) -> None:
    """It is there from some moment between 180 and 210 s on.

    They choose at k T by the traffic of k T − d, with the interval T and the delay d, s: those of
    60 and 90 s see at 300 s what was at 210 s, and at 240 s what was at 150 s.
    """
    # T, d, and when they react
    known = [(60, 0, 240), (60, 90, 300), (60, 120, 360), (60, 300, 540), (300, 0, 300)]
    known += [(90, 0, 270), (300, 120, 600)]
    classes = [
        DriverClass(f"{interval} {delay}", information_interval=interval, information_delay=delay)
        for interval, delay, _ in known
    ]
    demand = from_1_to_9(classes, size, 800 // size)
    result = run_into_jam(demand, classes, size, jam=180.0)
    for interval, delay, time in known:
        old, new = (entries_of(result, f"{interval} {delay}", name) for name in ("a1", "b1"))
        # the next who leaves home has chosen anew
        assert time - 3 * size < old[-1] < time <= new[0] < time + 3 * size


@sizes
@pytest.mark.parametrize(
    ("toll", "away"),
    [(0.49, ""), (0.51, "poor blind"), (0.99, "poor blind"), (1.01, "poor blind rich half")],
)
def test_a_toll_is_worth_its_time_to_every_class_by_itself(
    toll: float, away: str, size: int
) -> None:
    """The short way saves 50 s, worth 0.5 at 36 an hour; who sees no traffic still sees tolls."""
    factors = {"poor": 1.0, "blind": 1.0, "rich": 1.0, "half": 0.5, "free": 0.0}
    classes = [
        DriverClass(
            name,
            value_of_time=72.0 if name == "rich" else 36.0,
            toll_factor=factor,
            informed_share=float(name != "blind"),
        )
        for name, factor in factors.items()
    ]
    result = run(classes, size, control=[Toll(["short"], toll)])
    assert who_used(result, "long") == set(away.split())
    assert who_used(result, "short") == set(factors) - set(away.split())
    for name, factor in factors.items():
        paid = result.trips["toll"][result.trips["class"] == name]
        assert paid.to_numpy() == pytest.approx(0.0 if name in away.split() else factor * toll)


@sizes
def test_distance_costs_what_it_costs(size: int) -> None:
    """The far way is 50 s faster and 1 km longer: 0.5 at 36 an hour."""
    links = [link("near", "1", "9", 1000, free_speed=10.0, lanes=9)]
    links += [link("far", "1", "9", 2000, free_speed=40.0, lanes=9)]
    classes = [DriverClass(f"{cost}", 36.0, cost) for cost in (0.0, 0.49, 0.51)]
    settings = Settings(1500, size, route_noise=0.0)
    result = simulate(network(links), from_1_to_9(classes, size), settings, classes=classes)
    assert (who_used(result, "far"), who_used(result, "near")) == ({"0.0", "0.49"}, {"0.51"})


@sizes
def test_everybody_has_paid_the_tolls_in_force_on_entry(size: int) -> None:
    """Among them some who are under way at the end, or still at home."""
    amounts = [(0.0, 0.1), (450.0, 0.3), (1000.0, 0.0)]
    control = [Toll(["short"], amounts), Toll(["on"], 0.25, begin=300, end=900)]
    classes = [DriverClass(), DriverClass("lorry", 20.0, toll_factor=2.5)]
    demand = from_1_to_9(classes, size, 1500 // size)
    settings = Settings(1200, size, route_noise=0.5, route_update_interval=60.0)
    result = simulate(network(WAYS), demand, settings, control=control, classes=classes)
    time, name = result.events["enter_s"], result.events["link"]
    in_force = np.select([time < 450, time < 1000], [0.1, 0.3], 0.0) * (name == "short")
    in_force += 0.25 * ((name == "on") & (time >= 300) & (time < 900))
    factor = np.where(result.trips["class"] == "lorry", 2.5, 1.0)
    expected = np.bincount(result.events["vehicle"], in_force, len(result.trips)) * factor
    assert result.trips["toll"].to_numpy() == pytest.approx(expected)
    assert expected.max() == pytest.approx(0.55 * 2.5)
    assert set(result.trips["status"]) == {"completed", "running", "waiting"}


@sizes
def test_those_who_comply_follow_advice(size: int) -> None:
    """Whether they are informed or not."""
    classes = [DriverClass(f"{part:g}", compliance=part) for part in (0.0, 0.3, 1.0)]
    classes.append(DriverClass("both", informed_share=0.3, compliance=0.3))
    result = run(classes, size, 1000, control=[Advice(["short"], 60.0)])
    assert share(result, "0", "short") == share(result, "1", "long") == 1.0
    for name in ("0.3", "both"):
        assert share(result, name, "long") == pytest.approx(0.3, abs=four_sigma(0.3, 1000))


@sizes
def test_links_are_banned_to_those_whom_the_ban_is_for(size: int) -> None:
    """Who has no way at all gives up, and holds up nobody."""
    bans = {"car": (), "lorry": ("short",), "tank": ("short", "long")}
    result = run([DriverClass(name, banned=links) for name, links in bans.items()], size)
    assert who_used(result, "short") == {"car"}
    assert who_used(result, "long") == {"lorry"}
    assert who_used(result, "to") == {"car", "lorry"}
    tank = result.trips["class"] == "tank"
    assert (result.trips["status"][tank] == "aborted").all()
    assert (result.trips["status"][~tank] == "completed").all()
    waited = (result.trips["enter_s"] - result.trips["depart_s"])[~tank]
    assert waited.max() <= 2 * size / 16  # behind one of each other class, at 16 veh/s


@pytest.mark.parametrize("seed", range(5))
@sizes
def test_classes_of_a_pair_keep_its_total(size: int, seed: int) -> None:
    vehicles = {"default": 33.4, "lorry": 33.3, "bus": 33.3}
    demand = wishes(*[("1", "9", 0.0, 100.0, count, name) for name, count in vehicles.items()])
    classes = [DriverClass("lorry"), DriverClass("bus")]
    result = simulate(network(WAYS), demand, Settings(999, size, seed=seed), classes=classes)
    found = result.trips.groupby("class", observed=True)["vehicles"].sum()
    assert found.sum() == 100
    assert all(abs(found[name] - count) < 1 for name, count in vehicles.items())


@sizes
def test_a_class_that_nobody_is_of_changes_nothing(size: int) -> None:
    half, lorry = DriverClass(informed_share=0.5, compliance=0.5), DriverClass("lorry", 40.0)
    case = (network(grid(3)), across(3, 17.3, 300.0), Settings(1500, size))
    for alone, both in (([half], [half, lorry]), ([half], [lorry, half]), ([], [lorry])):
        without, beside = simulate(*case, classes=alone), simulate(*case, classes=both)
        assert hash_of(without) == hash_of(beside)


@sizes
@pytest.mark.parametrize(("crowd", "far"), [(18.0, 20.6), (17.3, 20.0), (17.3, 20.6)])
def test_who_is_of_another_class_elsewhere_changes_nobody(
    crowd: float, far: float, size: int
) -> None:
    streets = network([*grid(3), link("island", "x", "y")])
    here = across(3, crowd, 300.0)
    both = together(here, wishes(("x", "y", 10.0, 200.0, far, "lorry")))
    half, lorry = DriverClass(informed_share=0.5), DriverClass("lorry", informed_share=0.5)
    alone = simulate(streets, here, Settings(1500, size), classes=[half]).events
    beside = simulate(streets, both, Settings(1500, size), classes=[half, lorry]).events
    columns = ["link", "enter_s", "exit_s"]
    beside = beside[beside["link"] != "island"]
    first, second = (one[columns].sort_values(columns[:2]) for one in (alone, beside))
    assert first.reset_index(drop=True).equals(second.reset_index(drop=True))


@sizes
def test_enforced_routes_hold_for_their_share_of_their_classes(size: int) -> None:
    """They are driven whatever they cost; the others choose."""
    classes = [DriverClass(), DriverClass("bus")]
    route = EnforcedRoute("1", "9", ("to", "long", "on"), share=0.3, classes=("bus",))
    result = run(classes, size, 1000, control=[route, Toll(["long"], 5.0)])
    assert share(result, "bus", "long") == pytest.approx(0.3, abs=four_sigma(0.3, 1000))
    assert share(result, "default", "short") == 1.0
    assert (result.trips["status"] == "completed").all()


@sizes
@pytest.mark.parametrize("control", [[], [EnforcedRoute("1", "9", ("to", "short", "on"))]])
def test_routes_of_demand_rows_are_driven_by_those_rows(control: list[Measure], size: int) -> None:
    """Before a route that control enforces; rows of one pair keep their total, 100 vehicles."""
    table = wishes(*[("1", "9", 0.0, 100.0, count, None) for count in (33.4, 33.3, 33.3)]).table
    table["route"] = pd.Series([["to", "long", "on"], None, ("to", "short", "on")])
    result = simulate(network(WAYS), Demand(table), Settings(999, size, seed=4), control=control)
    assert result.trips["vehicles"].sum() == 100
    went_long = result.trips["distance_m"] == 20 * 120
    assert result.trips["vehicles"][went_long].sum() in (33, 34)


def test_a_class_is_not_sent_over_links_that_are_banned_to_it() -> None:
    classes = [DriverClass(), DriverClass("lorry", banned=("short",))]
    route, case = ("to", "short", "on"), (network(WAYS), from_1_to_9(classes, 5))
    for names in ((), ("lorry",)):
        enforced = EnforcedRoute("1", "9", route, classes=names)
        with pytest.raises(InputError, match=r"control:1, column links: is banned .* class lorry"):
            simulate(*case, Settings(999), control=[enforced], classes=classes)
    case[1].table["route"] = pd.Series([route, route])
    with pytest.raises(InputError) as error:
        simulate(*case, Settings(999), classes=classes)
    assert [(one.line, one.value) for one in error.value.faults] == [(2, "short")]
