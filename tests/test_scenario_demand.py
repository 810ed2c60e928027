"""Edits of demand: sums worked out by hand, and that nobody else is another afterwards."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_networks import across, demand, grid, network

from uxsim_geo.demand.demand import Demand
from uxsim_geo.demand.driven import driven
from uxsim_geo.demand.files import changes_path, read_demand, write_demand
from uxsim_geo.demand.platoons import Platoons, make_platoons
from uxsim_geo.demand.transform import Where, scale
from uxsim_geo.engine.simulation import simulate
from uxsim_geo.errors import InputError
from uxsim_geo.scenario.demand import replace_demand, scale_demand, shift_demand
from uxsim_geo.scenario.trips import Trips
from uxsim_geo.settings import Settings

#: one platoon: pair and number, departure, size, random identity
Platoon = tuple[tuple[str, str, str, int], float, int, int]


def base() -> Demand:
    """Real numbers, so that rounding has a choice, and two rows of one pair."""
    return demand(
        ("a", "c", 0, 600, 50.3),
        ("a", "c", 600, 1200, 40.4),
        ("a", "d", 0, 1200, 33.7),
        ("b", "c", 0, 1200, 21.9),
        ("b", "d", 300, 900, 44.6),
    )


def settings(**other: Any) -> Settings:
    return Settings(**({"duration": 3600.0, "seed": 7} | other))


def of(platoons: Platoons) -> dict[tuple[str, str, str, int], tuple[float, int, int]]:
    """Departure, vehicles and random identity of every platoon, by who it is."""
    names, classes = platoons.node_ids, platoons.class_names
    found = {}
    for row in range(platoons.number.size):
        who = (
            names[platoons.origin[row]],
            names[platoons.destination[row]],
            classes[platoons.driver_class[row]],
            int(platoons.number[row]),
        )
        assert who not in found
        what = (float(platoons.depart[row]), int(platoons.vehicles[row]), int(platoons.key[row]))
        found[who] = what
    return found


def cut(one: Demand, **other: Any) -> dict[tuple[str, str, str, int], tuple[float, int, int]]:
    return of(make_platoons(one, settings(**other)))


def rows(*numbers: int, size: int = 5) -> np.ndarray:
    chosen = np.zeros(size, bool)
    chosen[list(numbers)] = True
    return chosen


def sums(one: Demand) -> dict[tuple[str, str], float]:
    table = driven(one).table
    found = table.groupby(["origin", "destination"])["vehicles"].sum()
    return {pair: pytest.approx(value) for pair, value in found.items()}


@pytest.mark.parametrize("deterministic", [False, True])
@pytest.mark.parametrize("rounding", ["conserve", "truncate"])
def test_more_trips_come_beside_those_of_the_base(rounding: str, deterministic: bool) -> None:
    edited, changes = scale_demand(base(), rows(0, 1), 1.5, 1)
    assert sums(edited) == sums(base()) | {("a", "c"): pytest.approx(90.7 * 1.5)}
    told = changes.to_numpy().tolist()
    assert told[0] == ["demand", "a to c", "vehicles", "90.7", "136.05"]
    how: dict[str, Any] = {"demand_rounding": rounding, "deterministic": deterministic}
    before, after = cut(base(), **how), cut(edited, **how)
    assert before.items() <= after.items()
    more = [who for who in after if who not in before]
    assert {who[:2] for who in more} == {("a", "c")}
    vehicles = sum(after[who][1] for who in more)
    # 90.7/2 within one; truncated, the rows of 25.15 and 20.2 have 5 and 4 platoons
    assert vehicles == (45 if rounding == "truncate" else pytest.approx(45.35, abs=1))


@pytest.mark.parametrize("deterministic", [False, True])
@pytest.mark.parametrize("factor", [0.0, 0.3, 0.8])
def test_fewer_trips_are_some_of_those_of_the_base(factor: float, deterministic: bool) -> None:
    edited, _ = scale_demand(base(), rows(2, 3, 4), factor, 1)
    before, after = (cut(one, deterministic=deterministic) for one in (base(), edited))
    assert after.items() <= before.items()
    concerned = [who for who in before if who[:2] != ("a", "c")]
    assert set(before) - set(after) <= set(concerned)
    left = sum(who in after for who in concerned)
    assert abs(left - factor * len(concerned)) < 1
    assert sums(edited).get(("a", "d"), 0) == pytest.approx(33.7 * factor)


def test_a_part_of_the_day_is_scaled_without_the_rest_of_the_pair() -> None:
    edited, _ = scale_demand(base(), rows(0), 0.0, 1)
    before, after = cut(base()), cut(edited)
    gone = set(before) - set(after)
    assert gone
    assert all(who[:2] == ("a", "c") and before[who][0] < 600 for who in gone)
    assert all(before[who][0] >= 600 for who in after if who[:2] == ("a", "c"))
    assert after.items() <= before.items()


@pytest.mark.parametrize("share", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("by_s", [1800.0, -200.0])
def test_a_share_departs_at_another_time_and_the_others_when_they_did(
    share: float, by_s: float
) -> None:
    start = base()
    start.table["start_s"] += 300.0
    start.table["end_s"] += 300.0
    edited, changes = shift_demand(start, rows(0, 1, 2), by_s, share, 1)
    before, after = cut(start), cut(edited)
    assert set(before) == set(after)
    moved = {who for who in before if before[who] != after[who]}
    concerned = [who for who in before if who[0] == "a"]
    assert moved <= set(concerned)
    assert abs(len(moved) - share * len(concerned)) < 1
    for who in moved:
        assert after[who] == (before[who][0] + by_s, *before[who][1:])
    told = changes.set_index("id").loc["a to d"]
    assert told["attribute"] == "mean_departure_s"
    assert float(told["after"]) == pytest.approx(900 + share * by_s)


def test_whoever_a_small_share_moves_is_moved_by_a_larger_one() -> None:
    def moved(share: float) -> set[Any]:
        before = cut(base())
        after = cut(shift_demand(base(), rows(*range(5)), 600.0, share, 1)[0])
        return {who for who in before if before[who] != after[who]}

    assert moved(0.1) < moved(0.3) < moved(0.7)
    assert moved(0.3) != set(list(cut(base()))[: len(moved(0.3))])


def test_seeds_choose_others() -> None:
    edited, _ = shift_demand(base(), rows(*range(5)), 600.0, 0.3, 1)
    chosen = []
    for seed in (1, 2):
        before, after = cut(base(), seed=seed), cut(edited, seed=seed)
        chosen.append({who for who in before if before[who][0] != after[who][0]})
    assert chosen[0] != chosen[1]


def test_trips_are_replaced_by_others_and_the_rest_stays() -> None:
    new = demand(("b", "c", 0, 1200, 12.0), ("d", "c", 0, 1200, 7.0)).table
    edited, _ = replace_demand(base(), rows(3), new, 1)
    wanted = sums(base()) | {("b", "c"): pytest.approx(12.0), ("d", "c"): pytest.approx(7.0)}
    assert sums(edited) == wanted
    before, after = cut(base()), cut(edited)
    stays = {who: what for who, what in before.items() if who[:2] != ("b", "c")}
    assert stays.items() <= after.items()
    added = {who: what for who, what in after.items() if who not in stays}
    assert sum(what[1] for what in added.values()) == 19
    # numbers are not used again: another trip is nobody whom the base knows
    assert not set(added) & set(before)


def test_trips_are_taken_out_without_others() -> None:
    edited, changes = replace_demand(base(), rows(4), None, 1)
    assert ("b", "d") not in sums(edited)
    assert changes[["id", "attribute", "before"]].to_numpy().tolist() == [
        ["b to d", "vehicles", "44.6"],
        ["b to d", "mean_departure_s", "600"],
    ]
    assert changes["after"].isna().all()
    assert all(who[:2] != ("b", "d") for who in cut(edited))


def test_edits_one_after_the_other_work_on_what_is_left() -> None:
    more, _ = scale_demand(base(), rows(2), 2.0, 1)
    moved, _ = shift_demand(more, np.arange(6) >= 2, 300.0, 1.0, 2)
    half, _ = scale_demand(moved, np.isin(np.arange(6), [2, 5]), 0.5, 3)
    assert sums(half)[("a", "d")] == 33.7
    again, _ = scale_demand(half, np.isin(np.arange(6), [2, 5]), 3.0, 4)
    assert sums(again)[("a", "d")] == 33.7 * 3
    departures = [what[0] for who, what in cut(again).items() if who[:2] == ("a", "d")]
    # those that are added to moved ones move with them
    assert min(departures) >= 300


def test_classes_are_told_apart() -> None:
    table = base().table.assign(**{"class": ["default", "lorry", "lorry", "default", "default"]})
    edited, changes = scale_demand(Demand(table), rows(1, 2), 1.1, 1)
    assert changes["id"].tolist() == ["a to c (lorry)", "a to d (lorry)"]
    before, after = cut(Demand(table)), cut(edited)
    assert before.items() <= after.items()
    assert {who[2] for who in after if who not in before} == {"lorry"}


@given(
    st.lists(st.floats(0.1, 20), min_size=4, max_size=12),
    st.data(),
)
def test_nobody_else_is_another_whatever_the_demand(vehicles: list[float], data: Any) -> None:
    pairs = [("abc"[n % 3], "xyz"[n // 3 % 3]) for n in range(len(vehicles))]
    start = demand(*((*pair, 0, 900, number) for pair, number in zip(pairs, vehicles, strict=True)))
    chosen = np.array(data.draw(st.lists(st.booleans(), min_size=len(pairs), max_size=len(pairs))))
    factor = data.draw(st.sampled_from([0.0, 0.4, 1.7]))
    edited = scale_demand(start, chosen, factor, 1)[0]
    edited = shift_demand(
        edited, rows(size=len(edited.table)) | _front(chosen, edited), 60.0, 0.5, 2
    )[0]
    touched = {pair for pair, hit in zip(pairs, chosen, strict=True) if hit}
    before, after = cut(start), cut(edited)
    for who in set(before) | set(after):
        if who[:2] not in touched:
            assert before[who] == after[who]


def _front(chosen: np.ndarray, edited: Demand) -> np.ndarray:
    """Those of the base that were chosen, in a table that may have more rows."""
    return np.append(chosen, np.zeros(len(edited.table) - len(chosen), bool))


def test_trips_elsewhere_are_the_same_to_the_bit_through_the_engine() -> None:
    """Two grids that nothing connects: what is edited in one is not felt in the other."""
    here, there = grid(3), grid(3)
    for one in there:
        one |= {name: f"far {one[name]}" for name in ("link_id", "from_node_id", "to_node_id")}
    roads = network([*here, *there])
    near, far = across(3, 30.7, 900.0), across(3, 30.7, 900.0)
    far.table[["origin", "destination"]] = "far " + far.table[["origin", "destination"]]
    start = Demand(pd.concat([near.table, far.table], ignore_index=True))
    chosen = np.arange(len(start.table)) < len(near.table)
    new = near.table.assign(vehicles=11.1)
    told = settings(duration=3000.0)
    plain = _far(simulate(roads, start, told).trips)
    assert len(plain) > 100
    for edited, _ in (
        scale_demand(start, chosen, 1.4, 1),
        scale_demand(start, chosen, 0.6, 1),
        shift_demand(start, chosen, 300.0, 0.4, 1),
        replace_demand(start, chosen, new, 1),
    ):
        result = simulate(roads, edited, told)
        pd.testing.assert_frame_equal(_far(result.trips), plain)


def _far(trips: pd.DataFrame) -> pd.DataFrame:
    own = trips[trips["origin"].astype(str).str.startswith("far")].copy()
    for name in ("origin", "destination", "class"):
        own[name] = own[name].astype(str)
    own = own.sort_values(["depart_s", "origin", "destination"]).reset_index(drop=True)
    return own.drop(columns="vehicle")  # its row in the table


def test_changes_are_kept_on_disk_and_old_ones_forgotten(tmp_path: Any) -> None:
    edited, _ = shift_demand(base(), rows(1), 60.0, 0.5, 1)
    path = tmp_path / "demand.parquet"
    assert changes_path(path) in write_demand(edited, path)
    back = read_demand(path)
    pd.testing.assert_frame_equal(back.changes, edited.changes)
    assert cut(back) == cut(edited)
    assert changes_path(path) not in write_demand(base(), path)
    assert not len(read_demand(path).changes)


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda d: scale_demand(d, rows(0), -1.0, 1), "column factor: must be a finite number"),
        (lambda d: scale_demand(d, rows(0), np.inf, 1), "column factor: must be a finite number"),
        (lambda d: shift_demand(d, rows(0), 0.0, 0.5, 1), "column by_s: must be a finite number"),
        (lambda d: shift_demand(d, rows(0), 60.0, 1.5, 1), "column share: must be above 0"),
        (
            lambda d: shift_demand(d, rows(0, 4), -400.0, 0.5, 1),
            "2 rows of the demand would begin before the start, the first of them from a to c at",
        ),
    ],
)
def test_edits_that_cannot_be_made(edit: Any, message: str) -> None:
    with pytest.raises(InputError) as error:
        edit(base())
    assert message in str(error.value)


def test_two_shifts_together_must_not_lead_before_the_start() -> None:
    once, _ = shift_demand(base(), rows(4), -200.0, 0.5, 1)
    with pytest.raises(InputError, match="before the start"):
        shift_demand(once, rows(4), -200.0, 0.5, 2)


def test_a_demand_with_edits_is_not_changed_as_a_table() -> None:
    edited, _ = shift_demand(base(), rows(1), 60.0, 0.5, 1)
    with pytest.raises(InputError, match="before edits"):
        scale(edited, 2.0, Where())


# who is meant


def zoned() -> Any:
    roads = network(grid(2))
    roads.nodes["zone_id"] = ["z1", "z1", "z2", None]
    return roads


def chosen_of(trips: Trips) -> list[bool]:
    pairs = [("0,0", "1,1"), ("1,0", "0,0"), ("0,1", "1,0"), ("1,1", "0,1")]
    asked = demand(*((*pair, 100 * n, 900, 5) for n, pair in enumerate(pairs)))
    return [bool(one) for one in trips.rows(asked, zoned())]


def test_trips_are_chosen_by_all_that_is_given() -> None:
    ids = zoned().nodes["node_id"].tolist()
    assert ids == ["0,0", "0,1", "1,0", "1,1"]
    assert chosen_of(Trips()) == [True] * 4
    assert chosen_of(Trips(Where(origins=["0,0", "1,1"]))) == [True, False, False, True]
    assert chosen_of(Trips(zones=("z2",))) == [False, True, True, False]
    assert chosen_of(Trips(origin_zones=("z1",))) == [True, False, True, False]
    assert chosen_of(Trips(destination_zones=("z1",))) == [False, True, False, True]
    assert chosen_of(Trips(Where(between=(100, 300)), zones=("z2",))) == [False, True, True, False]
    assert chosen_of(Trips(Where(pairs=[("1,1", "0,1")]))) == [False, False, False, True]


@pytest.mark.parametrize(
    ("trips", "message"),
    [
        (Trips(zones=("z12",)), "column zones: no node is of this zone; did you mean z1 or z2?"),
        (Trips(Where(origins=["x"])), "column origins: no row of the table is of this name"),
        (Trips(Where(classes=["bus"])), "column classes: no row of the table is of this name"),
        (Trips(Where(between=(5, 5))), "column between: must be an earlier and a later moment"),
        (Trips(origin_area="POLYGON ((0 0, 1 0, 1 1, 0 0))"), "the network has no coordinates"),
        (Trips(origin_zones=("z1",), destination_zones=("z2",), where=Where(origins=["0,0"])),
         "no trips are meant"),
    ],
)  # fmt: skip
def test_trips_that_are_none_are_refused(trips: Trips, message: str) -> None:
    with pytest.raises(InputError) as error:
        chosen_of(trips)
    assert message in str(error.value)
