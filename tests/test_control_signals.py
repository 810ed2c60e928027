"""Signals against what a fixed cycle does to a queue, worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from small_networks import Q, across, demand, grid, link, network
from test_engine_order import hash_of

from uxsim_geo.control.signals import Phase, Signal
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.errors import InputError
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

CROSSING = [
    link("a", "1", "3"),
    link("b", "2", "3"),
    link("to4", "3", "4"),
    link("to5", "3", "5"),
]


def exits(result: Result, link_id: str) -> np.ndarray:
    events = result.events[result.events["link"] == link_id]
    return np.sort(events["exit_s"].dropna().to_numpy())


@pytest.mark.parametrize("size", [1, 5])
def test_phases_last_exactly_as_long_as_they_say(size: int) -> None:
    """60 s for one link and 30 s for the other, both with queues that never end."""
    signal = Signal("3", (Phase(60, ("a",)), Phase(30, ("b",))))
    rows = (("1", "4", 0.0, 1.0, 4000.0), ("2", "5", 0.0, 1.0, 4000.0))
    settings = Settings(duration=3600, platoon_size=size)
    result = simulate(network(CROSSING), demand(*rows), settings, signals=[signal])
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
    result = simulate(network(links), dem, settings, signals=[signal])
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
    result = simulate(network(CROSSING), demand(*rows), Settings(2000), signals=[signal])
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
            network(CROSSING), demand(("1", "3", 0, 60, 20)), Settings(600), signals=[held]
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
    rested = simulate(*case, signals=signals)
    assert hash_of(rested) == hash_of(simulate(*case, signals=signals, sleep=False))
    greens_of = {k: (s, own) for s in signals for k, own in s.greens().items()}
    ends = dict(zip(case[0].links["link_id"], case[0].links["to_node_id"], strict=True))
    goals = rested.trips["destination"].astype(str).to_numpy()
    for row in rested.events.dropna().itertuples():
        signal, own = greens_of[row.link]
        if goals[row.vehicle] != ends[row.link]:
            at = (row.exit_s - signal.offset) % signal.cycle
            near = [min(abs(at - start), abs(at - signal.cycle - start)) < 1e-6 for start, _ in own]
            assert any(near) or any(start <= at < end for start, end in own)


def test_every_fault_of_signals_is_named_at_once() -> None:
    signals = [
        Signal("3", (Phase(0, ("a",)), Phase(float("nan"), ("nowhere",)))),
        Signal("9", (), offset=float("inf")),
        Signal("3", (Phase(10, ("to4",)),), all_red=-1),
    ]
    with pytest.raises(InputError) as error:
        simulate(network(CROSSING), demand(("1", "4", 0, 60, 20)), Settings(600), signals=signals)
    text = str(error.value)
    for part in (
        "above 0 s",
        "nowhere",
        "no link ends",
        "'9'",
        "at least one phase",
        "a signal already",
        "ends at node 4, not at 3",
        "all_red",
        "offset",
    ):
        assert part in text
