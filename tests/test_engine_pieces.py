"""A run in pieces: looked at, changed, added to, saved and taken up again."""

from __future__ import annotations

import json
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from small_networks import across, demand, grid, link, network
from test_engine_order import Case, hash_of, random_case

from uxsim_geo.control import (
    Advice,
    Closure,
    CongestionToll,
    EnforcedRoute,
    LinkCapacity,
    MergePriority,
    NodeCapacity,
    OwnControl,
    Phase,
    Signal,
    SpeedLimit,
    Toll,
)
from uxsim_geo.control.drivers import DriverClass
from uxsim_geo.control.levers import Levers
from uxsim_geo.control.site import Measure
from uxsim_geo.control.traffic import Traffic
from uxsim_geo.demand.demand import Demand
from uxsim_geo.engine.simulation import Simulation, simulate
from uxsim_geo.errors import InputError
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings


def meter(traffic: Traffic, levers: Levers) -> None:
    """Let fewer in where much is on the road; hold one phase of every signal in turn."""
    levers.entry_capacity = traffic.site.capacity * np.clip(1.2 - traffic.occupancy, 0.0, 1.0)
    levers.phase[levers.plan >= 0] = int(traffic.time // 60) % 3 - 1


def controlled_case(seed: int) -> tuple[Case, list[Measure], list[DriverClass]]:
    """A random case under measures of every kind, drawn, and drivers of two classes."""
    net, dem, settings = random_case(seed)
    random = np.random.default_rng(1000 + seed)
    nodes = list(net.nodes["node_id"])
    ids = list(net.links["link_id"])
    drawn = iter(random.permutation(ids))

    def some(count: int) -> list[str]:
        return [next(drawn) for _ in range(count)]

    signal_node = str(random.choice(nodes))
    into = list(net.links.loc[net.links["to_node_id"] == signal_node, "link_id"])
    phases = (Phase(20, tuple(into[:1])), Phase(13, tuple(into[1:])))
    control: list[Measure] = [
        Signal(signal_node, phases, offset=3.0, all_red=2.5, begin=100),
        Closure(some(2), 300, 700),
        Closure(some(1), 200, 900, on_link="stay"),
        LinkCapacity(some(2), exit=[(0, 0.2), (400, 0.0), (500, 0.6)]),
        NodeCapacity(list(random.permutation(nodes)[:2]), 0.7, begin=50, end=1100),
        MergePriority(some(2), 7.0, begin=100, end=800),
        SpeedLimit(some(3), 3.0, begin=250, end=750),
        Toll(some(4), [(0, 1.0), (500, 9.0)]),
        CongestionToll(some(1), 0.05, 40.0, max_amount=5.0, interval=120),
        Advice(some(2), 300.0, begin=60),
        OwnControl(meter, interval=77.0, begin=400, end=1000),
    ]
    classes = [
        DriverClass(informed_share=0.7, information_delay=90.0, compliance=0.5),
        DriverClass("lorry", 40.0, 0.3, 2.0, information_interval=150.0),
    ]
    table = dem.table.copy()
    table["class"] = np.where(random.random(len(table)) < 0.3, "lorry", None)
    return (net, replace(dem, table=table), settings), control, classes


def under_all_control(seed: int) -> Result:
    case, control, classes = controlled_case(seed)
    return simulate(*case, control=control, classes=classes)


def together(*demands: Demand) -> Demand:
    return Demand(pd.concat([one.table for one in demands], ignore_index=True))


@pytest.mark.parametrize("seed", range(8))
def test_with_all_control_sleeping_pieces_and_saving_change_nothing(
    seed: int, tmp_path: Path
) -> None:
    case, control, classes = controlled_case(seed)
    settings = replace(
        case[2], no_cycles=seed % 2 == 0, route_choice=("inertia", "logit")[seed % 2]
    )
    case = (case[0], case[1], settings)
    whole = simulate(*case, control=control, classes=classes)
    awake = simulate(*case, control=control, classes=classes, sleep=False)
    assert hash_of(awake) == hash_of(whole)
    run = Simulation(*case, control=control, classes=classes)
    for until in (0.0, 113.0, 299.0, 300.0, 641.0, 1000.0):
        run.advance(until)
        run.result()
        run.save(tmp_path / "run.zip")
        run = Simulation.resume(tmp_path / "run.zip", control=control, classes=classes)
    run.advance(settings.duration)
    resumed = run.result()
    assert hash_of(resumed) == hash_of(whole)
    assert resumed.trips.equals(whole.trips)
    assert resumed.notes == whole.notes
    assert (whole.trips["toll"] > 0).any()


def test_no_events_before_the_first_change_are_others() -> None:
    """Measures that begin at 300 s leave all that happens before as it was, to the bit."""
    net, dem, settings = random_case(6)
    free = simulate(net, dem, settings).events
    held = simulate(
        net, dem, settings, control=[Closure(list(net.links["link_id"])[:3], 300, 600)]
    ).events
    for column in ("enter_s", "exit_s"):
        early = [np.sort(events[column][events[column] < 300]) for events in (free, held)]
        assert len(early[0]) > 100
        assert (early[0] == early[1]).all()


def test_a_measure_that_sets_what_holds_anyway_changes_nothing() -> None:
    net, dem, settings = random_case(3)
    idle = [
        MergePriority([str(one["link_id"])], float(one["merge_priority"]), begin=60)
        for _, one in net.links.iterrows()
    ]
    result = simulate(net, dem, settings, control=idle)
    assert hash_of(result) == hash_of(simulate(net, dem, settings))
    assert len(result.notes) == len(idle)
    assert all("never took effect: it never changed anything" in note for note in result.notes)


def test_demand_added_on_the_way_is_as_if_it_had_been_there() -> None:
    """A pair that leaves home at 600 s, known at the start or added at 500 s."""
    net = network(grid(4))
    early, late = across(4, 12.0, 400.0), demand(("1,1", "2,2", 600.0, 900.0, 50.0))
    settings = Settings(3000, seed=3)
    both = together(early, late)
    known = simulate(net, both, settings)
    run = Simulation(net, early, settings)
    run.advance(500)
    run.add(late)
    run.advance(settings.duration)
    added = run.result()

    def of_pair(result, inner):
        is_pair = (result.trips["origin"] == "1,1") & (result.trips["destination"] == "2,2")
        return result.trips[is_pair == inner].drop(columns="vehicle").reset_index(drop=True)

    assert len(of_pair(added, True)) == 10
    # the tree of a destination that is new is made at once, from the costs of the last update
    assert (of_pair(added, True)["status"] == "completed").all()
    assert (of_pair(added, True)["depart_s"] == of_pair(known, True)["depart_s"]).all()
    assert (added.trips["free_time_s"].notna()).all()
    assert added.trips["vehicles"].sum() == known.trips["vehicles"].sum()


def test_who_is_added_takes_the_short_way_at_once() -> None:
    """Between two updates of routes, to a destination that nobody had before."""
    ways = [
        link("in", "1", "2", 200),
        link("short", "2", "3", 400),
        link("long", "2", "3", 4000),
        link("out", "3", "4", 200),
    ]
    run = Simulation(network(ways), demand(("1", "2", 0, 10, 5)), Settings(2000))
    run.advance(100)
    run.add(demand(("1", "4", 120, 220, 40)))
    run.advance(2000)
    result = run.result()
    assert (result.trips["status"] == "completed").all()
    used = result.events["link"].value_counts()
    assert (used["short"], used["long"]) == (8, 0)


def test_who_is_added_for_where_nobody_went_any_more_takes_the_way_of_now() -> None:
    """The short way is tolled after the first trip has ended; the next update is far away."""
    ways = [link("short", "2", "3", 400), link("long", "2", "3", 800), link("far", "3", "4")]
    dem = demand(("2", "3", 0, 10, 5), ("2", "4", 0, 3000, 50))
    toll = Toll(["short"], 100.0, begin=300)
    run = Simulation(network(ways), dem, Settings(3000), control=[toll])
    run.advance(700)
    run.add(demand(("2", "3", 720, 800, 40)))
    run.advance(3000)
    trips = run.result().trips
    assert (
        trips["distance_m"][(trips["destination"] == "3") & (trips["depart_s"] > 700)] == 800
    ).all()


def test_who_is_added_elsewhere_changes_nobody() -> None:
    """A vehicle on an unconnected link, there from the start or added: no other event changes."""
    island = [link("island", "x", "y")]
    streets = network([*grid(4), *island])
    crowd, one = across(4, 40.0, 900.0), demand(("x", "y", 450.0, 451.0, 1.0))
    settings = Settings(2000, seed=5)
    alone = simulate(streets, crowd, settings)
    run = Simulation(streets, crowd, settings)
    run.advance(430)
    run.add(one)
    run.advance(2000)
    both = together(crowd, one)
    for result in (run.result(), simulate(streets, both, settings)):
        others = result.events[result.events["link"] != "island"]
        assert len(result.events) == len(alone.events) + 1
        for column in ("enter_s", "exit_s"):
            assert (np.sort(others[column]) == np.sort(alone.events[column])).all()


def test_demand_of_the_past_is_refused() -> None:
    run = Simulation(network(grid(3)), across(3, 5.0, 100.0), Settings(1000))
    run.advance(500)
    with pytest.raises(InputError, match="begins before the time that the run has come to, 500 s"):
        run.add(demand(("0,0", "2,2", 400, 600, 10)))
    before = hash_of(run.result())
    assert before == hash_of(run.result())


def test_a_look_on_the_way_shows_who_is_where() -> None:
    net, dem, settings = random_case(2)
    run = Simulation(net, dem, settings)
    run.advance(600)
    traffic, events = run.traffic, run.result().events
    codes = events["link"].cat.codes
    inside = events["exit_s"].isna() | (events["exit_s"] >= run.time)
    counts = (
        events.loc[inside]
        .groupby(codes[inside])["vehicle"]
        .apply(lambda rows: run.result().trips["vehicles"].iloc[rows].sum())
    )
    assert traffic.count.sum() > 50
    for code, count in counts.items():
        assert traffic.count[code] == count
    assert (traffic.queue <= traffic.count).all()
    assert (traffic.travel_time >= 0.999 * traffic.site.length / traffic.site.free_speed).all()
    with pytest.raises(ValueError, match="read-only"):
        traffic.count[0] = 1.0


@pytest.mark.parametrize(
    "damage", ["cut", "other version", "changed", "spoilt", "no zip", "missing"]
)
def test_a_file_that_is_no_saved_run_is_refused(damage: str, tmp_path: Path) -> None:
    run = Simulation(network(grid(3)), across(3, 5.0, 100.0), Settings(1000))
    path = tmp_path / "run.zip"
    run.save(path)
    if damage == "cut":
        path.write_bytes(path.read_bytes()[:-100])
    elif damage == "spoilt":
        content = bytearray(path.read_bytes())
        with zipfile.ZipFile(path) as archive:
            largest = max(archive.infolist(), key=lambda part: part.compress_size)
        begin = largest.header_offset + 30 + len(largest.filename)
        content[begin : begin + 20] = b"x" * 20
        path.write_bytes(content)
    elif damage == "no zip":
        path.write_text("nothing")
    elif damage == "missing":
        path.unlink()
    else:
        with zipfile.ZipFile(path) as archive:
            parts = {name: archive.read(name) for name in archive.namelist()}
        if damage == "other version":
            parts["state.json"] = json.dumps({"saved_by": "0"}).encode()
        else:
            parts["arrays/events.npy"] += b"x"
        with zipfile.ZipFile(path, "w") as archive:
            for name, content in parts.items():
                archive.writestr(name, content)
    with pytest.raises(InputError) as error:
        Simulation.resume(path)
    assert str(path) in str(error.value)


def test_a_run_is_not_resumed_under_other_control(tmp_path: Path) -> None:
    net = network(grid(3))
    run = Simulation(net, across(3, 5.0, 100.0), Settings(1000), control=[Toll(["0,0-0,1"], 1.0)])
    run.save(tmp_path / "run.zip")
    with pytest.raises(InputError, match=r"other control: Toll\(.*amount=1.0"):
        Simulation.resume(tmp_path / "run.zip")
    with pytest.raises(InputError, match="other control"):
        Simulation.resume(tmp_path / "run.zip", control=[Toll(["0,0-0,1"], 2.0)])
    with pytest.raises(InputError, match="other classes"):
        Simulation.resume(
            tmp_path / "run.zip", control=[Toll(["0,0-0,1"], 1.0)], classes=[DriverClass("x")]
        )
    with pytest.raises(InputError, match=r"other classes of drivers: .*value_of_time=15\.0"):
        Simulation.resume(
            tmp_path / "run.zip",
            control=[Toll(["0,0-0,1"], 1.0)],
            classes=[DriverClass(value_of_time=20.0)],
        )


def test_a_run_goes_no_further_than_its_end() -> None:
    run = Simulation(network(grid(3)), across(3, 5.0, 100.0), Settings(1003))
    run.advance(float("inf"))
    assert run.finished
    assert run.time == 1003


def test_routes_that_are_given_are_driven() -> None:
    ways = [link("in", "1", "2", 200), link("short", "2", "3", 400), link("long", "2", "3", 4000)]
    dem = demand(("1", "3", 0, 300, 100))
    dem.table["route"] = [("in", "long")]
    result = simulate(network(ways), dem, Settings(2000))
    assert (result.trips["status"] == "completed").all()
    assert (result.trips["distance_m"] == 4200).all()
    half = EnforcedRoute("1", "3", ("in", "long"), share=0.5, begin=100, end=200)
    free = demand(("1", "3", 0, 300, 3000))
    result = simulate(network(ways), free, Settings(9000), control=[half])
    went_long = result.trips["distance_m"] == 4200
    in_time = result.trips["depart_s"].between(100, 200, inclusive="left")
    assert not (went_long & ~in_time).any()
    assert went_long[in_time].mean() == pytest.approx(0.5, abs=3 * 0.5 / np.sqrt(in_time.sum()))
    dem.table["route"] = [("short", "nowhere")]
    with pytest.raises(InputError, match="nowhere"):
        simulate(network(ways), dem, Settings(2000))


def test_faults_of_classes_and_of_control_say_whose_they_are() -> None:
    """Classes are numbered as they are given, whether or not the default is among them."""
    classes = [
        DriverClass("a", informed_share=2.0),
        DriverClass("b", banned=("nowhere",)),
        DriverClass("a"),
    ]
    told = [Toll(["0,0-0,1"], 1.0), Toll(["elsewhere"], -1.0)]
    with pytest.raises(InputError) as error:
        Simulation(
            network(grid(3)), across(3, 5, 100), Settings(900), control=told, classes=classes
        )
    assert [(one.source, one.line, one.column) for one in error.value.faults] == [
        ("classes", 1, "informed_share"),
        ("classes", 3, "name"),
        ("classes", 2, "banned"),
        ("control", 2, "links"),
        ("control", 2, "amount"),
    ]


def test_one_link_and_one_class_may_be_told_without_a_list() -> None:
    ways = [link("long way", "1", "2"), link("short", "1", "2", 200)]
    dem = demand(("1", "2", 0, 100, 20), ("1", "2", 0, 100, 20))
    dem.table["class"] = ["van", "delivery van"]
    route = EnforcedRoute("1", "2", "long way", classes="delivery van")  # type: ignore[arg-type]
    classes = [DriverClass("van"), DriverClass("delivery van")]
    trips = simulate(network(ways), dem, Settings(900), control=[route], classes=classes).trips
    assert (trips["distance_m"] == np.where(trips["class"] == "van", 200, 1000)).all()


def test_shares_of_several_routes_are_shares_of_all_drivers() -> None:
    ways = [link(name, "1", "2", length) for name, length in (("a", 200), ("b", 300), ("c", 400))]
    routes = [EnforcedRoute("1", "2", (name,), share=0.5) for name in "bc"]
    dem = demand(("1", "2", 0, 8000, 4000))
    trips = simulate(network(ways), dem, Settings(9000), control=routes).trips
    driven = trips["distance_m"].value_counts()
    assert driven.sum() == 800
    assert driven.get(200.0, 0) == 0
    assert driven[300.0] == pytest.approx(400, abs=3 * 0.5 * 800**0.5)


def test_a_look_on_the_way_does_not_write_off_what_is_in_force_or_still_to_come() -> None:
    ways = [link("a", "1", "2", 200), link("b", "2", "3", 200)]
    control = [
        MergePriority(["a"], 2.0, 0, 800),
        MergePriority(["b"], 2.0, 600, 803),
        Advice(["b"], 60.0, begin=802, end=804),  # between two steps
    ]
    run = Simulation(network(ways), demand(("1", "3", 0, 800, 200)), Settings(804), control=control)
    run.advance(400)
    assert run.result().notes == ()
    run.advance(804)
    (note,) = run.result().notes
    assert note == "advice on link b never took effect: it never changed anything"


def test_an_enforced_route_that_nobody_is_given_is_told() -> None:
    ways = [link("in", "1", "2", 200), link("out", "2", "3", 400)]
    late = EnforcedRoute("1", "3", ("in", "out"), begin=500)
    result = simulate(network(ways), demand(("1", "3", 0, 300, 100)), Settings(900), control=[late])
    assert len(result.notes) == 1
    assert result.notes[0].startswith("enforced route from 1 to 3 never took effect")
