"""Signals against what a fixed cycle does to a queue, worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from control_site import assert_names, faults_of, only, site_of, traffic_of
from small_networks import Q, across, demand, exits, grid, link, network, simulate
from test_engine_order import hash_of

from uxsim_geo.control import Levers, OwnControl, Phase, Signal, Traffic
from uxsim_geo.engine.simulation import Simulation
from uxsim_geo.engine.steering import base_levers
from uxsim_geo.errors import InputError
from uxsim_geo.settings import Settings

CROSSING = [
    link("a", "1", "3"),
    link("b", "2", "3"),
    link("to4", "3", "4"),
    link("to5", "3", "5"),
]


@pytest.mark.parametrize("size", [1, 5])
def test_phases_last_exactly_as_long_as_they_say(size: int) -> None:
    """60 s for one link and 30 s for the other, both with queues that never end."""
    signal = Signal("3", (Phase(60, ("a",)), Phase(30, ("b",))))
    rows = (("1", "4", 0.0, 1.0, 4000.0), ("2", "5", 0.0, 1.0, 4000.0))
    settings = Settings(duration=3600, platoon_size=size)
    result = simulate(network(CROSSING), demand(*rows), settings, control=[signal])
    for link_id, begin, green in (("a", 0, 60), ("b", 60, 30)):
        in_cycle = (exits(result, link_id) - begin) % 90
        assert (in_cycle < green).all()
        late = exits(result, link_id)[exits(result, link_id) >= 900]
        firsts = late[np.diff(late, prepend=0) > 20]
        assert (firsts - begin) % 90 == pytest.approx(0, abs=1e-9)
        per_cycle = np.ceil(green * Q / size - 1e-9)  # platoons at 0, size/Q, … < green
        assert len(late) == pytest.approx(30 * per_cycle, abs=per_cycle)


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
def test_the_uniform_delay_below_saturation(share: float) -> None:
    """Arrivals q, green g of a cycle c: mean delay (c − g)² / (2 c (1 − q/s))."""
    cycle, green = 90.0, 45.0
    flow = share * Q * green / cycle
    links = [link("meter", "0", "1", 100), *CROSSING[:3]]
    signal = Signal("3", (Phase(green, ("a",)), Phase(cycle - green, ("b",))))
    settings = Settings(duration=20000, platoon_size=1)
    dem = demand(("0", "4", 0.0, 18000.0, 18000 * flow))
    result = simulate(network(links), dem, settings, control=[signal])
    delay = (result.trips["arrive_s"] - result.trips["enter_s"] - (100 + 1000 + 1000) / 20).mean()
    red = cycle - green
    queued = red / (1 - flow / Q) / cycle  # share of those who arrive while a queue stands
    # the fluid of the formula leaves, on average, half a headway after the vehicle it stands for
    expected = red**2 / (2 * cycle * (1 - flow / Q)) - queued * 0.5 / Q
    assert delay == pytest.approx(expected, rel=0.03)


def test_offset_and_all_red_shift_and_part_the_greens() -> None:
    signal = Signal("3", (Phase(20, ("a",)), Phase(20, ("b",))), offset=7, all_red=5)
    assert signal.cycle == 50
    assert signal.greens() == {"a": [(0, 20)], "b": [(25, 45)]}
    rows = (("1", "4", 0.0, 1.0, 900.0), ("2", "5", 0.0, 1.0, 900.0))
    result = simulate(network(CROSSING), demand(*rows), Settings(2000), control=[signal])
    assert ((exits(result, "a") - 7) % 50 < 20).all()
    assert ((exits(result, "b") - 32) % 50 < 20).all()
    assert len(exits(result, "b")) > 100


def test_phases_that_meet_are_one_green() -> None:
    signal = Signal("3", (Phase(20, ("a", "b")), Phase(10, ("b",)), Phase(10, ("a",))))
    assert signal.greens() == {"a": [(0, 20), (30, 40)], "b": [(0, 30)]}


def test_a_trip_that_ends_at_the_signal_does_not_wait_for_it() -> None:
    signal = Signal("3", (Phase(1, ("b",)), Phase(999, ("b",))))
    never = Signal("3", (Phase(10, ("b",)), Phase(1e6, ())))
    for held in (signal, never):
        result = simulate(
            network(CROSSING), demand(("1", "3", 0, 60, 20)), Settings(600), control=[held]
        )
        assert (result.trips["status"] == "completed").all()


@pytest.mark.parametrize("seed", range(6))
def test_sleeping_at_a_red_changes_nothing(seed: int) -> None:
    random = np.random.default_rng(seed)
    streets = grid(4)
    signals = []
    for node in sorted({row["to_node_id"] for row in streets}):
        into = [row["link_id"] for row in streets if row["to_node_id"] == node]
        half = len(into) // 2
        greens = random.integers(5, 40, 2).astype(float)
        phases = (Phase(greens[0], tuple(into[:half])), Phase(greens[1], tuple(into[half:])))
        signals.append(Signal(node, phases, offset=float(random.integers(0, 60)), all_red=2.5))
    case = (network(streets), across(4, 23.9, 1200.0), Settings(duration=3000, seed=seed))
    rested = simulate(*case, control=signals)
    assert hash_of(rested) == hash_of(simulate(*case, control=signals, sleep=False))
    greens_of = {k: (s, own) for s in signals for k, own in s.greens().items()}
    ends = dict(zip(case[0].links["link_id"], case[0].links["to_node_id"], strict=True))
    goals = rested.trips["destination"].astype(str).to_numpy()
    for row in rested.events.dropna().itertuples():
        signal, own = greens_of[row.link]
        if goals[row.vehicle] != ends[row.link]:
            at = (row.exit_s - signal.offset) % signal.cycle
            near = [min(abs(at - start), abs(at - signal.cycle - start)) < 1e-6 for start, _ in own]
            assert any(near) or any(start <= at < end for start, end in own)


def test_plans_follow_one_another_by_the_time_of_day() -> None:
    """Cycles of 90 s, then of 50 s, then no signal; each begins as its own offset says."""
    plans = [
        Signal("3", (Phase(60, ("a",)), Phase(30, ("b",))), end=1800),
        Signal("3", (Phase(20, ("a",)), Phase(30, ("b",))), offset=10, begin=1800, end=3000),
    ]
    rows = (("1", "4", 0.0, 1.0, 4000.0), ("2", "5", 0.0, 1.0, 4000.0))
    result = simulate(network(CROSSING), demand(*rows), Settings(4000, 1), control=plans)
    for link_id, parts in (("a", ((0, 60), (10, 20))), ("b", ((60, 30), (30, 30)))):
        times = exits(result, link_id)
        early, late = times[times < 1800], times[(times >= 1800) & (times < 3000)]
        for within, (begin, green), cycle in ((early, parts[0], 90), (late, parts[1], 50)):
            assert ((within - begin) % cycle < green).all()
            assert len(within) > 300
        last = times[times >= 3000 + 1 / Q]
        assert np.diff(last) == pytest.approx(1 / Q)


def test_a_plan_is_numbered_and_felt_on_the_links_it_names() -> None:
    site = site_of(network(CROSSING))
    for number, phases in enumerate(((Phase(9, ("b", "a")),), (Phase(9, ("b",)),))):
        rule = only(Signal("3", phases, begin=60 * number, end=60 * number + 60), site)
        levers = base_levers(site)
        rule.act(traffic_of(site, rule.begin), levers)
        assert levers.plan[site.node_position["3"]] == number
        assert np.sum(levers.plan != -1) == 1
        assert rule.felt_at.tolist() == [[0, 1], [1]][number]
    assert len(site.plans) == 2


def test_two_plans_at_once_are_refused() -> None:
    plans = [
        Signal("3", (Phase(60, ("a",)),), end=100),
        Signal("3", (Phase(60, ("b",)),), begin=99),
    ]
    case = (network(CROSSING), demand(("1", "4", 0, 60, 20)), Settings(600, 1))
    with pytest.raises(InputError, match="signal at node 3"):
        simulate(*case, control=plans)
    simulate(*case, control=[plans[0], Signal("3", (Phase(60, ("b",)),), begin=100)])


def test_every_fault_of_a_signal_is_named_at_once() -> None:
    site = site_of(network(CROSSING))
    bad = Signal(
        "3",
        (Phase(0, ("a", "a")), Phase(float("nan"), ("nowhere",)), Phase(10, ("to4",))),
        offset=float("inf"),
        all_red=-1,
        begin=50,
        end=40,
    )
    assert_names(
        faults_of(bad, site),
        [
            "column duration: a phase must last a finite time above 0 s (found '0')",
            "(found 'nan')",
            "stands twice in phase 1 (found 'a')",
            "no such link_id",
            "'nowhere'",
            "ends at node 4, not at 3 (found 'to4')",
            "column offset",
            "column all_red",
            "later than begin",
        ],
    )
    assert_names(
        faults_of(Signal("9", ()), site), ["no such node (found '9')", "at least one phase"]
    )
    assert "nothing is held" in faults_of(Signal("3", (Phase(10, ()),)), site)


def test_a_phase_that_is_held_while_it_runs_goes_on_without_a_break() -> None:
    """a has green from 0 to 30 s; held from 20 s on it keeps it, without 10 s of all-red."""

    def hold(traffic: Traffic, levers: Levers) -> None:
        levers.phase[traffic.site.node_position["3"]] = 0

    signal = Signal("3", (Phase(30, ("a",)), Phase(30, ("b",))), all_red=10)
    rows = (("1", "4", 0.0, 100.0, 60.0), ("2", "4", 0.0, 100.0, 60.0))
    control = [signal, OwnControl(hold, begin=20)]
    result = simulate(
        network([link("a", "1", "3", 10), link("b", "2", "3", 10), link("c", "3", "4")]),
        demand(*rows),
        Settings(400, 1, demand_rounding="truncate"),
        control=control,
    )
    assert np.diff(exits(result, "a")).max() < 5
    assert exits(result, "b").size == 0


@pytest.mark.parametrize("plan", [1, -2, 99])
def test_no_node_takes_a_plan_that_is_not_its_own(plan: int) -> None:
    run = Simulation(
        network(CROSSING),
        demand(("1", "4", 0, 60, 20)),
        Settings(600, 1),
        control=[
            Signal("3", (Phase(10, ("a",)), Phase(10, ("b",)))),
            Signal("4", (Phase(9, ("to4",)), Phase(9, ()))),
        ],
    )
    run.levers.plan[run.traffic.site.node_position["3"]] = plan
    with pytest.raises(InputError, match=f"node 3 has no such plan; -1 is none .*{plan}"):
        run.advance(100)


def test_reds_are_what_the_greens_leave() -> None:
    signal = Signal("3", (Phase(60, ("a",)), Phase(30, ("b",))), offset=10, all_red=5)
    # cycles of 100 s from 10 s on, and one before: a green 10-70, 110-170; b 75-105, 175-205
    assert signal.reds("a", 200.0) == [(0.0, 10.0), (70.0, 110.0), (170.0, 200.0)]
    assert signal.reds("b", 200.0) == [(5.0, 75.0), (105.0, 175.0)]
    assert signal.reds("c", 200.0) == []


def test_reds_are_those_of_the_time_in_which_a_plan_is_in_force() -> None:
    signal = Signal("3", (Phase(60, ("a",)), Phase(40, ("b",))), begin=30, end=130)
    assert signal.reds("a", 1000.0) == [(60.0, 100.0)]
    assert signal.reds("b", 1000.0) == [(30.0, 60.0), (100.0, 130.0)]
    assert signal.reds("b", 20.0) == []


def test_nobody_leaves_in_the_reds() -> None:
    signal = Signal("3", (Phase(25, ("a",)), Phase(35, ("b",))), offset=7, all_red=3)
    rows = (("1", "4", 0.0, 600.0, 300.0), ("2", "5", 0.0, 600.0, 300.0))
    result = simulate(network(CROSSING), demand(*rows), Settings(900.0), control=[signal])
    for link_id in ("a", "b"):
        reds, left = signal.reds(link_id, 900.0), exits(result, link_id)
        assert len(left) > 20
        for begin, end in reds:
            assert not ((left > begin + 1e-9) & (left < end - 1e-9)).any()
