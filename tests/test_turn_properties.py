"""Banned turns on networks, demands and bans drawn by hypothesis: what holds for every run.

Free-flow times are those of a plain search over the links driven last; nobody drives what is
banned; all that holds without bans holds with them; and the same run gives the same bytes, however
it is run.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
import pandas as pd
import pytest
from drawn_networks import Tables, bans, webs
from hypothesis import example, given, settings
from hypothesis import strategies as st
from plain_paths import Way, best_routes, is_legal
from small_networks import demand, link, network
from test_properties import PROPERTIES, REACTION_TIME

from uxsim_geo.control.closures import Closure
from uxsim_geo.control.drivers import DriverClass
from uxsim_geo.engine.simulation import Simulation, simulate
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

Drawn = tuple[Tables, list[Way]]

OPTIONS: tuple[dict[str, object], ...] = (
    {},
    {"route_choice": "logit"},
    {"no_cycles": True},
    {"deterministic": True},
    {"route_update_gradual": True},
)


@st.composite
def barred(draw: st.DrawFn, platoon_size: int) -> Drawn:
    tables = draw(webs(platoon_size))
    return tables, draw(bans(tables[0]))


def told(platoon_size: int, **options: object) -> Settings:
    given_ = {"reaction_time": REACTION_TIME, "route_update_interval": 20.0 * platoon_size}
    return Settings(200.0 * platoon_size, platoon_size, **given_ | options)  # type: ignore[arg-type]


def routes_driven(result: Result) -> list[Way]:
    """The links of every platoon that has entered the network, in their order."""
    events = result.events.sort_values(["vehicle", "enter_s"], kind="stable")
    return [tuple(own) for _, own in events["link"].astype(str).groupby(events["vehicle"])]


def same_bytes(one: Result, other: Result) -> bool:
    return one.events.equals(other.events) and one.trips.equals(other.trips)


def check_free_times(tables: Tables, banned: Sequence[Way], result: Result) -> int:
    """Hold free-flow times to a plain search; returns how many are longer than without bans."""
    links = tables[0]
    cost = {row["link_id"]: row["length"] / row["free_speed"] for row in links}
    longer = 0
    for origin, own in result.trips.groupby("origin", observed=True):
        best = best_routes(links, banned, cost, str(origin))
        free = best_routes(links, [], cost, str(origin))
        for destination, time in zip(own["destination"], own["free_time_s"], strict=True):
            expected = best.get(destination, (np.nan,))[0]
            # the engine looks for ways in whole milliseconds: of two as good it may take either
            assert time == pytest.approx(expected, abs=2e-3 * len(links), nan_ok=True)
            longer += destination in free and expected != free[destination][0]
    return longer


def every_kind(platoon_size: int) -> Drawn:
    """Who goes on by c must have come by the slow one, or not by a; and there is no way back.

    What is drawn depends on all that is loaded beside this file: rare cases are not left to it.
    """
    length = 20.0 * platoon_size
    links = [
        link(name, *ends, length) for name, ends in zip("abc", ("01", "12", "23"), strict=True)
    ]
    links += [link("slow", "1", "2", 3 * length), link("aside", "1", "4", length)]
    end = 60.0 * platoon_size
    pairs = [("0", "3"), ("1", "3"), ("3", "0"), ("0", "4")]
    rows = [(*pair, 0.0, end, 10.0 * platoon_size) for pair in pairs]
    return (links, rows), [("a", "aside"), ("a", "b", "c")]


@pytest.mark.parametrize("options", OPTIONS, ids=str)
@pytest.mark.parametrize("platoon_size", [1, 5])
def test_in_every_run_with_bans_all_of_this_holds(
    platoon_size: int, options: dict[str, object]
) -> None:
    met = Counter[str]()

    @settings(derandomize=True, deadline=None, max_examples=25)
    @given(barred(platoon_size))
    @example(every_kind(platoon_size))
    def check(drawn: Drawn) -> None:
        tables, banned = drawn
        net = network(tables[0], banned=banned)
        result = simulate(net, demand(*tables[1]), told(platoon_size, **options))
        for holds in PROPERTIES:
            holds(tables, result)
        driven = routes_driven(result)
        assert all(is_legal(route, banned) for route in driven)
        met["longer"] += check_free_times(tables, banned, result)
        # nobody is led to where there is no way on
        aborted = result.trips["status"] == "aborted"
        assert result.trips.loc[aborted, "free_time_s"].isna().all()
        assert result.trips.loc[aborted, "enter_s"].isna().all()
        met.update(result.trips["status"].astype(str))
        met["over many links"] += sum(len(way) > 2 for way in banned)
        met["twice at a node"] += sum(len(set(route)) < len(route) for route in driven)

    check()
    for kind in ("completed", "aborted", "longer", "over many links"):
        assert met[kind] > 0, met


@pytest.mark.parametrize("platoon_size", [1, 5])
def test_however_it_is_run_the_bytes_are_the_same(platoon_size: int) -> None:
    @settings(derandomize=True, deadline=None, max_examples=30)
    @given(barred(platoon_size), st.data())
    def check(drawn: Drawn, data: st.DataObject) -> None:
        tables, banned = drawn
        net, wanted = network(tables[0], banned=banned), demand(*tables[1])
        closed = data.draw(st.sampled_from(tables[0]))["link_id"]
        begin = platoon_size * data.draw(st.floats(0, 100))
        control = [Closure((closed,), begin=begin, end=begin + 60.0 * platoon_size)]
        classes = [DriverClass(banned=(data.draw(st.sampled_from(tables[0]))["link_id"],))]
        run = told(platoon_size)
        once = simulate(net, wanted, run, control=control, classes=classes)
        awake = simulate(net, wanted, run, control=control, classes=classes, sleep=False)
        assert same_bytes(once, awake)
        pieces = Simulation(net, wanted, run, control=control, classes=classes)
        while not pieces.finished:
            pieces.advance(pieces.time + platoon_size * data.draw(st.floats(5, 100)))
        assert same_bytes(once, pieces.result())
        assert all(is_legal(route, banned) for route in routes_driven(once))

    check()


@settings(derandomize=True, deadline=None, max_examples=40)
@given(barred(5))
def test_the_order_of_the_bans_changes_nothing_nor_do_bans_elsewhere(drawn: Drawn) -> None:
    (links, rows), banned = drawn
    elsewhere = [
        row | {key: f"there:{row[key]}" for key in row if key.endswith("_id")} for row in links
    ]
    there = [tuple(f"there:{one}" for one in way) for way in banned]
    once = simulate(network(links, banned=banned), demand(*rows), told(5))
    turned = network([*links, *elsewhere], banned=[*there, *banned[::-1]])
    result = simulate(turned, demand(*rows), told(5))
    assert result.trips.equals(
        once.trips.assign(origin=result.trips["origin"], destination=result.trips["destination"])
    )
    assert (result.events["link"].astype(str) == once.events["link"].astype(str)).all()
    assert result.events.drop(columns="link").equals(once.events.drop(columns="link"))


def test_a_ban_that_nobody_could_break_changes_nothing() -> None:
    """The links of the ban lead to where nobody wants to go."""
    pd.testing.assert_frame_equal(*(_aside(banned).trips for banned in ([], [("in", "aside")])))
    pd.testing.assert_frame_equal(*(_aside(banned).events for banned in ([], [("in", "aside")])))


def _aside(banned: list[Way]) -> Result:
    links = [link("in", "1", "2"), link("out", "2", "3"), link("aside", "2", "4")]
    net: Network = network(links, banned=banned)
    return simulate(net, demand(("1", "3", 0.0, 500.0, 700.0)), Settings(1500, 5))
