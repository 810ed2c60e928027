"""The twin against kinematic wave theory, before it may judge the engine.

Formulas: Q = m u κ / (1 + uτκ); a hole needs L τ κ to travel back over a link; a link of length L
holds m κ L / Δn platoons.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from twin import Case, Passages, TwinLink, TwinTrip, counts_at, largest_difference, run_twin

PLATOON_SIZES = (1, 5)


def diagram_capacity(link: TwinLink, reaction_time: float = 1.0) -> float:
    speed, density = link.free_speed, link.jam_density
    return link.lanes * speed * density / (1 + speed * reaction_time * density)


def crowd(
    route: Sequence[str], count: int, start: float = 0.0, every: float = 0.0
) -> list[TwinTrip]:
    """``count`` platoons on ``route``, all waiting from ``start`` or leaving one by one."""
    return [TwinTrip(start + every * number, tuple(route)) for number in range(count)]


def flow(times: np.ndarray, case: Case) -> float:
    """Mean flow (veh/s) between the first and the last of ``times``."""
    return float(case.platoon_size * (len(times) - 1) / (times[-1] - times[0]))


def check_order(passages: dict[str, Passages]) -> None:
    for link in passages.values():
        assert np.all(np.diff(link.entries) > 0)
        assert np.all(np.diff(link.exits) > 0)
        assert np.all(link.exits > link.entries[: len(link.exits)])


@pytest.mark.parametrize("platoon_size", PLATOON_SIZES)
def test_free_travel_takes_length_over_speed(platoon_size: int) -> None:
    links = [TwinLink("a", "1", "2", 1000, 20), TwinLink("b", "2", "3", 700, 12)]
    passages = run_twin(Case(links, [TwinTrip(13.7, ("a", "b"))], 200, platoon_size))
    assert passages["a"].entries == pytest.approx([13.7])
    assert passages["a"].exits == pytest.approx([63.7])
    assert passages["b"].exits == pytest.approx([63.7 + 700 / 12])


@pytest.mark.parametrize("platoon_size", PLATOON_SIZES)
@pytest.mark.parametrize("lanes", [1, 2, 3])
@pytest.mark.parametrize("free_speed", [7.0, 20.0])
def test_a_link_takes_and_gives_its_capacity(
    platoon_size: int, lanes: int, free_speed: float
) -> None:
    link = TwinLink("a", "1", "2", 500, free_speed, lanes)
    case = Case([link], crowd(["a"], 60), 500, platoon_size, substeps=lanes)
    passages = run_twin(case)
    check_order(passages)
    assert flow(passages["a"].entries, case) == pytest.approx(diagram_capacity(link), rel=0.002)
    assert flow(passages["a"].exits, case) == pytest.approx(diagram_capacity(link), rel=0.002)


@pytest.mark.parametrize("platoon_size", PLATOON_SIZES)
def test_a_slow_link_is_a_bottleneck(platoon_size: int) -> None:
    links = [
        TwinLink("fast", "1", "2", 1000, 20),
        TwinLink("slow", "2", "3", 500, 5),
        TwinLink("after", "3", "4", 500, 20),
    ]
    case = Case(links, crowd(["fast", "slow", "after"], 80), 900, platoon_size)
    passages = run_twin(case)
    check_order(passages)
    assert diagram_capacity(links[1]) == 0.5
    assert flow(passages["fast"].exits, case) == pytest.approx(0.5, rel=0.005)
    assert flow(passages["after"].exits, case) == pytest.approx(0.5, rel=0.005)


@pytest.mark.parametrize("platoon_size", PLATOON_SIZES)
def test_a_given_capacity_holds_at_entry_and_exit(platoon_size: int) -> None:
    links = [TwinLink("a", "1", "2", 1000), TwinLink("b", "2", "3", 500, capacity=0.3)]
    case = Case(links, crowd(["a", "b"], 50), 1000, platoon_size)
    passages = run_twin(case)
    assert np.diff(passages["b"].entries) == pytest.approx(platoon_size / 0.3)
    assert np.diff(passages["b"].exits) == pytest.approx(platoon_size / 0.3)


@pytest.mark.parametrize("platoon_size", PLATOON_SIZES)
@pytest.mark.parametrize("lanes", [1, 2])
def test_a_full_link_holds_its_storage_and_passes_holes_back(platoon_size: int, lanes: int) -> None:
    # one exit a minute, and a hole needs 50 s: between two exits the link is full
    links = [
        TwinLink("feeder", "0", "1", 250, lanes=lanes),
        TwinLink("full", "1", "2", 250, lanes=lanes),
        TwinLink("outlet", "2", "3", 250, capacity=platoon_size / 60),
    ]
    storage = lanes * 0.2 * 250 / platoon_size
    trips = crowd(["feeder", "full", "outlet"], round(2 * storage))
    case = Case(links, trips, 900, platoon_size, substeps=lanes)
    passages = run_twin(case)
    check_order(passages)
    full = passages["full"]
    grid = np.arange(0, case.duration, 1.0)
    assert np.max(counts_at(full.entries, 1, grid) - counts_at(full.exits, 1, grid)) == storage
    refills = full.entries[round(storage) :]
    assert len(refills) >= 10
    wait = refills - full.exits[: len(refills)]
    # a platoon that moves and halts within one step is seen at the step's end
    assert np.all((wait >= 250 * 0.2 - 1e-6) & (wait <= 250 * 0.2 + case.step))


@pytest.mark.parametrize("platoon_size", PLATOON_SIZES)
@pytest.mark.parametrize(
    ("main", "capacity"),
    [
        (TwinLink("main", "1", "3", 250, 10), 2 / 3),
        (TwinLink("main", "1", "3", 250, 20, capacity=0.5), 0.5),
    ],
)
def test_a_queue_discharges_at_capacity_from_its_first_platoon(
    platoon_size: int, main: TwinLink, capacity: float
) -> None:
    # a side road of overwhelming priority holds the main road up until its crowd is through;
    # what follows could take more than the main road can give
    links = [
        main,
        TwinLink("side", "2", "3", 250, merge_priority=1e9),
        TwinLink("out", "3", "4", 1000),
    ]
    side = crowd(["side", "out"], 60)
    case = Case(links, side + crowd(["main", "out"], 30, start=30), 900, platoon_size)
    passages = run_twin(case)
    assert passages["main"].exits[0] > passages["side"].exits[-1]
    assert len(passages["main"].exits) == 30
    assert np.diff(passages["main"].exits) == pytest.approx(platoon_size / capacity)


@pytest.mark.parametrize("platoon_size", PLATOON_SIZES)
@pytest.mark.parametrize("priority", [1.0, 3.0])
def test_a_full_merge_is_shared_by_priority(platoon_size: int, priority: float) -> None:
    links = [
        TwinLink("main", "1", "3", 500, merge_priority=priority),
        TwinLink("side", "2", "3", 500, merge_priority=1.0),
        TwinLink("out", "3", "4", 500),
    ]
    trips = crowd(["main", "out"], 400) + crowd(["side", "out"], 400)
    case = Case(links, trips, 400 * platoon_size, platoon_size, seed=3)
    passages = run_twin(case)
    check_order(passages)
    exits = {name: len(passages[name].exits) for name in ("main", "side")}
    total = sum(exits.values())
    share = priority / (1 + priority)
    spread = np.sqrt(share * (1 - share) / total)
    assert total >= 300
    assert exits["main"] / total == pytest.approx(share, abs=3 * spread)
    assert flow(passages["out"].entries, case) == pytest.approx(0.8, rel=0.01)


def test_a_given_order_is_kept_at_a_merge() -> None:
    links = [
        TwinLink("main", "1", "3", 500),
        TwinLink("side", "2", "3", 500),
        TwinLink("out", "3", "4", 500),
    ]
    order = ["side", "side", "main", "side", "main", "main"]
    trips = crowd(["main", "out"], 3) + crowd(["side", "out"], 3)
    passages = run_twin(Case(links, trips, 200, merge_order={"3": order}))
    went = [(time, name) for name in ("main", "side") for time in passages[name].exits]
    assert [name for _, name in sorted(went)] == order


@pytest.mark.parametrize("platoon_size", PLATOON_SIZES)
def test_a_blocked_branch_holds_up_the_other(platoon_size: int) -> None:
    # every second platoon wants the narrow branch; first in, first out gives both its flow
    links = [
        TwinLink("in", "1", "2", 1000),
        TwinLink("wide", "2", "3", 500),
        TwinLink("narrow", "2", "4", 500, capacity=0.2),
    ]
    trips = [TwinTrip(0.0, ("in", "wide" if number % 2 else "narrow")) for number in range(100)]
    case = Case(links, trips, 1000, platoon_size)
    passages = run_twin(case)
    check_order(passages)
    assert flow(passages["narrow"].entries, case) == pytest.approx(0.2, rel=0.01)
    assert flow(passages["wide"].entries, case) == pytest.approx(0.2, rel=0.01)


def test_origins_are_first_in_first_out_over_their_links() -> None:
    # the second platoon could go at once, but the first one waits before it
    links = [TwinLink("shut", "1", "2", 500, capacity=0.05), TwinLink("open", "1", "3", 500)]
    trips = [TwinTrip(2.0, ("shut",)), TwinTrip(3.0, ("shut",)), TwinTrip(4.0, ("open",))]
    passages = run_twin(Case(links, trips, 300))
    assert passages["shut"].entries == pytest.approx([2, 102])
    assert passages["open"].entries == pytest.approx([102])


def test_substeps_change_nothing_but_the_rounding() -> None:
    links = [
        TwinLink("a", "1", "2", 800),
        TwinLink("b", "2", "3", 400, 8),
        TwinLink("c", "3", "4", 400),
    ]
    trips = crowd(["a", "b", "c"], 60, every=7.0)
    grid = np.arange(0, 900, 5.0)
    results = [run_twin(Case(links, trips, 900, substeps=substeps)) for substeps in (1, 5)]
    for name in ("a", "b", "c"):
        coarse, fine = (counts_at(result[name].exits, 1, grid) for result in results)
        assert largest_difference(coarse, fine) <= 1


def test_a_link_shorter_than_a_step_is_refused() -> None:
    with pytest.raises(ValueError, match="substeps"):
        Case([TwinLink("a", "1", "2", 50)], [], 100)


def test_counts_take_every_platoon_at_its_size() -> None:
    times = [3.0, 1.0, np.nan, 2.0]
    counts = counts_at(times, [5, 1, 9, 3], [0.5, 1.0, 2.5, 10.0])
    assert counts.tolist() == [0, 1, 4, 9]
    assert largest_difference(counts, [0, 1, 6, 9]) == 2
    assert counts_at([], 1, [0, 1]).tolist() == [0, 0]
