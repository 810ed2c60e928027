"""Control by functions of one's own: called in time, bound to the levers, equal to a measure."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from control_site import assert_names, faults_of, only, site_of
from small_networks import Q, demand, exits, link, network, simulate
from test_engine_order import hash_of

from uxsim_geo.control import Levers, LinkCapacity, OwnControl, Traffic
from uxsim_geo.errors import InputError
from uxsim_geo.settings import Settings

ROAD = [link("a", "1", "2"), link("b", "2", "3"), link("c", "3", "4")]
SITE = site_of(network(ROAD))
CASE = (network(ROAD), demand(("1", "4", 0.0, 1000.0, 600.0)), Settings(2000, 5))


def narrow(traffic: Traffic, levers: Levers, *, capacity: float = 0.3) -> None:
    """Let no more than so much out of b, from 600 s on."""
    if traffic.time >= 600:
        levers.exit_capacity[traffic.site.link_position["b"]] = capacity


def test_a_function_is_named_and_claims_nothing() -> None:
    rule = only(OwnControl(narrow, interval=30, begin=60), SITE)
    assert (rule.name, rule.claims, rule.interval) == ("own control narrow", (), 30)
    assert only(OwnControl(partial(narrow, capacity=0.2)), SITE).name == "own control partial"


def test_what_is_no_function_or_interval_is_refused() -> None:
    for interval in (0.0, -1.0, float("nan"), 2.5):
        text = faults_of(OwnControl("narrow", interval), SITE)  # type: ignore[arg-type]
        assert_names(text, ["column function: must be a function", "column interval"])


def test_a_function_does_what_a_measure_does_to_the_bit() -> None:
    """It is called at 0, 60, … and narrows b at 600 s, as the measure does."""
    measure = LinkCapacity(["b"], exit=0.3, begin=600)
    told = simulate(*CASE, control=[measure])
    assert hash_of(simulate(*CASE, control=[OwnControl(narrow)])) == hash_of(told)
    assert hash_of(simulate(*CASE)) != hash_of(told)


def test_a_function_is_called_at_every_interval_and_sees_what_passed() -> None:
    seen: list[tuple[float, float, float]] = []

    def watch(traffic: Traffic, _: Levers) -> None:
        seen.append((traffic.time, traffic.elapsed, float(traffic.inflow[1] * traffic.elapsed)))

    simulate(*CASE, control=[OwnControl(watch, interval=50, begin=100, end=1000)])
    assert [time for time, _, _ in seen] == [100.0 + 50 * number for number in range(18)]
    assert [elapsed for _, elapsed, _ in seen] == [0.0] + [50.0] * 17
    assert sum(entered for _, _, entered in seen) == pytest.approx(0.6 * 850, abs=10)


def test_a_function_cannot_change_what_it_sees() -> None:
    def reach(traffic: Traffic, _: Levers) -> None:
        traffic.count[0] = 0.0

    with pytest.raises(ValueError, match="read-only"):
        simulate(*CASE, control=[OwnControl(reach)])


def test_a_value_that_no_road_can_have_is_an_error() -> None:
    def slip(_: Traffic, levers: Levers) -> None:
        levers.exit_capacity[1] = -0.3

    with pytest.raises(InputError, match="exit_capacity of link b"):
        simulate(*CASE, control=[OwnControl(slip)])


@pytest.mark.parametrize("told", [2.0, float("inf")])
def test_a_capacity_above_that_of_a_link_lets_no_queue_out_faster(told: float) -> None:
    """A queue behind b, closed for 500 s, leaves at the capacity of the diagram."""

    def open_late(traffic: Traffic, levers: Levers) -> None:
        levers.exit_capacity[1] = 0.0 if traffic.time < 500 else told

    result = simulate(*CASE, control=[OwnControl(open_late, interval=5)])
    assert np.diff(exits(result, "b")[:30]) == pytest.approx(5 / Q)
