"""Order, causality and repeatability: what must hold in the event log of any run."""

from __future__ import annotations

import hashlib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from small_networks import Row, across, demand, grid, link, network
from weights import weights_of

from uxsim_geo.demand.demand import Demand
from uxsim_geo.draws import CHOICE, combine, unit
from uxsim_geo.engine import arrays
from uxsim_geo.engine.simulation import Simulation, simulate
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

Case = tuple[Network, Demand, Settings]


def random_case(seed: int) -> Case:
    """A grid of streets of all kinds with too much traffic, lanes and sizes included."""
    random = np.random.default_rng(seed)
    size = int(random.integers(3, 6))
    links = grid(size)
    for row in links:
        row["length"] = float(random.choice([8.0, 31.0, 120.0, 400.0, 900.0]))
        row["free_speed"] = float(random.choice([6.0, 13.0, 22.0]))
        row["lanes"] = int(random.choice([1, 1, 1, 2, 3]))
        row["merge_priority"] = float(random.choice([0.5, 1.0, 3.0]))
        row["capacity"] = float(random.choice([np.nan, np.nan, np.nan, 0.3]))
    vehicles = float(random.choice([7.3, 23.9, 61.0]))
    settings = Settings(
        duration=float(random.choice([1500.0, 3001.0])),
        platoon_size=int(random.choice([1, 3, 5, 10])),
        reaction_time=float(random.choice([1.0, 1.3])),
        route_update_interval=float(random.choice([60.0, 333.0, 600.0])),
        seed=seed,
    )
    banned = some_bans(links, seed) if seed % 3 == 0 else []
    return network(links, banned=banned), across(size, vehicles, 1200.0), settings


def some_bans(links: list[Row], seed: int) -> list[tuple[str, ...]]:
    """One turn in twelve, and one way in fifty over a link between."""
    random = np.random.default_rng([seed, 1])
    follows = [
        [number for number, after in enumerate(links) if after["from_node_id"] == row["to_node_id"]]
        for row in links
    ]
    pairs = [(one, other) for one in range(len(links)) for other in follows[one]]
    over = [(*pair, other) for pair in pairs for other in follows[pair[1]]]
    banned = [pair for pair in pairs if random.random() < 1 / 12]
    banned += [way for way in over if random.random() < 1 / 50]
    return [tuple(links[number]["link_id"] for number in way) for way in banned]


def steps_of(settings: Settings) -> int:
    return int(np.ceil(settings.duration / settings.step - 1e-9))


def hash_of(result: Result) -> str:
    digest = hashlib.sha256()
    for column in ("vehicle", "enter_s", "exit_s"):
        digest.update(result.events[column].to_numpy().tobytes())
    digest.update(result.events["link"].cat.codes.to_numpy().tobytes())
    digest.update(result.trips["arrive_s"].to_numpy().tobytes())
    return digest.hexdigest()


CASES = range(12)


@pytest.mark.parametrize("seed", CASES)
def test_sleeping_and_trying_again_give_the_same_bytes(seed: int) -> None:
    case = random_case(seed)
    assert hash_of(simulate(*case)) == hash_of(simulate(*case, sleep=False))


@pytest.mark.parametrize("seed", CASES)
def test_links_and_origins_are_first_in_first_out(seed: int) -> None:
    result = simulate(*random_case(seed))
    for _, passages in result.events.groupby("link", observed=True):
        ordered = passages.sort_values("enter_s", kind="stable")
        assert ordered["enter_s"].is_unique
        assert ordered["exit_s"].dropna().is_monotonic_increasing
        assert ordered["exit_s"].isna().is_monotonic_increasing  # those still there came last
    for _, trips in result.trips.groupby("origin", observed=True):
        assert trips["depart_s"].is_monotonic_increasing
        assert trips["enter_s"].dropna().is_monotonic_increasing
        assert trips["enter_s"].isna().is_monotonic_increasing


@pytest.mark.parametrize("seed", CASES)
def test_no_rule_of_a_link_is_broken(seed: int) -> None:
    """Free flow, capacity at both ends, and never more vehicles than the link stores."""
    net, dem, settings = random_case(seed)
    result = simulate(net, dem, settings)
    size = result.trips["vehicles"].to_numpy()
    for row in net.links.itertuples():
        passages = result.events[result.events["link"] == row.link_id].sort_values("enter_s")
        enter, exit_ = passages["enter_s"].to_numpy(), passages["exit_s"].to_numpy()
        vehicles = size[passages["vehicle"]]
        top = row.lanes * row.free_speed * row.jam_density
        top /= 1 + row.free_speed * settings.reaction_time * row.jam_density
        headway = vehicles[:-1] / np.fmin(top, row.capacity)
        assert (exit_ - enter >= row.length / row.free_speed - 1e-9)[~np.isnan(exit_)].all()
        assert (np.diff(enter) >= headway - 1e-9).all()
        assert (np.diff(exit_) >= headway - 1e-9)[~np.isnan(exit_[1:])].all()
        times = np.concatenate([enter, exit_[~np.isnan(exit_)]])
        change = np.concatenate([vehicles, -vehicles[~np.isnan(exit_)]])
        order = np.lexsort((change, times))  # at one moment, those who leave first
        held = np.cumsum(change[order])
        storage = max(settings.platoon_size, row.lanes * row.jam_density * row.length)
        assert held.max(initial=0) <= storage + 1e-9


@pytest.mark.parametrize("seed", CASES)
def test_vehicles_are_conserved_and_trips_are_unbroken_chains(seed: int) -> None:
    net, dem, settings = random_case(seed)
    result = simulate(net, dem, settings)
    assert result.trips["vehicles"].sum() == pytest.approx(dem.table["vehicles"].sum(), abs=1)
    ends = net.links.set_index("link_id")[["from_node_id", "to_node_id"]]
    events = result.events.sort_values(["vehicle", "enter_s"], kind="stable")
    events = events.join(ends, on=events["link"].astype(str))
    trips = result.trips
    following = events["vehicle"].to_numpy()[1:] == events["vehicle"].to_numpy()[:-1]
    assert (events["enter_s"].to_numpy()[1:] == events["exit_s"].to_numpy()[:-1])[following].all()
    joined = events["from_node_id"].to_numpy()[1:] == events["to_node_id"].to_numpy()[:-1]
    assert joined[following].all()
    first = events.groupby("vehicle").first()
    last = events.groupby("vehicle").last()
    on_road = trips.loc[first.index]
    assert (first["from_node_id"] == on_road["origin"].astype(str)).all()
    assert (first["enter_s"] == on_road["enter_s"]).all()
    done = trips[trips["status"] == "completed"]
    assert (last.loc[done.index, "to_node_id"] == done["destination"].astype(str)).all()
    assert (last.loc[done.index, "exit_s"] == done["arrive_s"]).all()
    assert trips.loc[~trips.index.isin(first.index), "enter_s"].isna().all()
    assert (on_road["enter_s"] >= on_road["depart_s"]).all()


@pytest.mark.parametrize("seed", CASES)
@pytest.mark.parametrize("update_weight", [0.5, 1.0])
def test_no_move_is_made_before_its_out_link_was_chosen(seed: int, update_weight: float) -> None:
    """Draw the choice again for the step in which each move was made, with the weights of then."""
    net, dem, settings = random_case(seed)
    settings = replace(  # much to choose
        settings,
        route_update_interval=60.0,
        route_noise=0.5,
        route_update_weight=update_weight,
    )
    simulation = Simulation(net, dem, settings)
    weights = []
    for step in range(steps_of(settings)):
        simulation.advance((step + 1) * settings.step)
        weights.append(weights_of(simulation))
    result = simulation.result()
    moves = moves_between_links(simulation, result)
    assert len(moves) > 50
    options = 0
    for move in moves.itertuples():
        # a move at the very edge of two steps belongs to either
        steps = {int(move.time / settings.step + hair) for hair in (-1e-9, 1e-9)}
        assert move.out_arc in {chosen_arc(move, step, weights[step]) for step in steps}
        weight = weights[min(steps)][move.destination, move.first_out : move.last_out]
        options += np.count_nonzero(weight) - 1
    assert options > 20 or update_weight == 1.0


def chosen_arc(move: Any, step: int, weights: np.ndarray) -> int:
    weight = weights[move.destination, move.first_out : move.last_out].astype(float)
    options = np.flatnonzero(weight)
    if len(options) == 1:
        return int(move.first_out + options[0])
    mark = choice_draw(move.trip_key, move.link_key, step) * weight.sum()
    chosen = np.searchsorted(np.cumsum(weight), mark, side="right")
    return int(move.first_out + min(chosen, options[-1]))


@np.errstate(over="ignore")
def choice_draw(trip_key: int, link_key: int, step: int) -> float:
    keys = [np.uint64(key) for key in (trip_key, link_key, step)]
    return float(unit(combine(combine(keys[0], keys[1] ^ CHOICE), keys[2])))


def moves_between_links(simulation: Simulation, result: Result) -> pd.DataFrame:
    """Each move from a link to the next, in positions of the engine's records."""
    routes, queue = simulation.world.routes, simulation.world.links.queue
    paths = simulation.setting.paths
    position = np.empty(len(simulation.network.links), int)
    position[simulation.setting.row_of_link] = np.arange(position.size)
    events = result.events.assign(row=result.events["link"].cat.codes.astype(int))
    events = events.sort_values(["vehicle", "enter_s"], kind="stable").reset_index(drop=True)
    arcs = [paths.arcs_along(own.tolist()) for _, own in events["row"].groupby(events["vehicle"])]
    events["arc"] = np.concatenate(arcs)
    following = events.shift(-1)
    moves = events[following["vehicle"] == events["vehicle"]]
    out_arc = following.loc[moves.index, "arc"].astype(int).to_numpy()
    link_of_move, trip = position[moves["row"].to_numpy()], moves["vehicle"].to_numpy()
    vertex = paths.tail[out_arc]
    codes = result.trips["destination"].cat.codes.to_numpy()
    rank = np.searchsorted(routes.destination["node"][:-1], node_positions(simulation)[codes[trip]])
    return pd.DataFrame(
        {
            "time": moves["exit_s"].to_numpy(),
            "out_arc": out_arc,
            "destination": rank,
            "first_out": routes.vertex["first_out"][vertex],
            "last_out": routes.vertex["first_out"][vertex + 1],
            "trip_key": simulation.platoons.key[trip],
            "link_key": queue["key"][link_of_move],
        }
    )


def node_positions(simulation: Simulation) -> np.ndarray:
    ids = pd.Index(simulation.network.nodes["node_id"])
    return ids.get_indexer(pd.Index(simulation.platoons.node_ids))


@pytest.mark.parametrize("seed", [1, 4, 7])
def test_piece_by_piece_is_the_same_as_in_one_go(seed: int) -> None:
    net, dem, settings = random_case(seed)
    simulation = Simulation(net, dem, settings)
    step = 0
    while not simulation.finished:
        step += 1 + step % 7
        simulation.advance(step * settings.step)
    assert hash_of(simulation.result()) == hash_of(simulate(net, dem, settings))


@pytest.mark.parametrize("seed", [2, 5, 10, 14])
def test_full_buffers_change_nothing(seed: int) -> None:
    """With room for a few events and no spare ring, the run has to stop and go on all the time."""
    net, dem, settings = random_case(seed)
    simulation = Simulation(net, dem, settings)
    links, log = simulation.world.links, simulation.world.log
    used = int(links.clock["platoons_used"][0])
    fullest = int(links.queue["storage"].max()) + 1
    simulation.world = simulation.world._replace(
        links=links._replace(platoon=links.platoon[:used].copy()),
        log=log._replace(event=log.event[: max(fullest, 64)].copy()),
    )
    simulation.advance(settings.duration)
    assert simulation.world.links.platoon.size > used
    assert hash_of(simulation.result()) == hash_of(simulate(net, dem, settings))


@pytest.mark.parametrize("seed", range(3))
def test_looking_ahead_changes_nothing(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    case = random_case(seed)
    without = simulate(*case)
    monkeypatch.setattr(arrays, "_IN_CACHE", -1)
    assert Simulation(*case).world.links.clock["is_large"][0]
    assert hash_of(simulate(*case)) == hash_of(without)


def test_two_runs_and_two_threads_give_the_same_bytes() -> None:
    cases = [random_case(seed) for seed in (1, 2, 3, 1, 2, 3)]
    one_by_one = [hash_of(simulate(*case)) for case in cases]
    with ThreadPoolExecutor(max_workers=3) as pool:
        together = list(pool.map(lambda case: hash_of(simulate(*case)), cases))
    assert one_by_one[:3] == one_by_one[3:]
    assert together == one_by_one


def test_a_vehicle_elsewhere_changes_no_other_vehicle() -> None:
    """Two towns without a road between them: more traffic in one is not felt in the other."""
    town = grid(4)
    elsewhere = [link("x1", "x", "y"), link("x2", "y", "z")]
    home = across(4, 23.9, 1200.0)
    settings = Settings(duration=3000, seed=5)
    before = simulate(network([*town, *elsewhere]), home, settings)
    more = Demand(pd.concat([demand(("x", "z", 0.0, 600.0, 50.0)).table, home.table]))
    # the other town comes first in all tables, so that every position moves
    after = simulate(network([*elsewhere, *town]), more, settings)
    assert fates(before) == {key: fate for key, fate in fates(after).items() if key[0] != "x"}


def fates(result: Result) -> dict[tuple, list[tuple]]:
    """The events of every platoon by what names it in any run."""
    events = result.events.merge(result.trips[["vehicle", "origin", "destination", "number"]])
    events["exit_s"] = events["exit_s"].fillna(-1.0)
    fate: dict[tuple, list[tuple]] = {}
    for row in events.sort_values("enter_s").itertuples():
        name = (row.origin, row.destination, row.number)
        fate.setdefault(name, []).append((row.link, row.enter_s, row.exit_s))
    return fate
