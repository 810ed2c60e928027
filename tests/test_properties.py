"""What holds for every run, on networks and demands drawn by hypothesis.

Networks have up to eight links between up to five nodes, with loops, parallel links, dead ends and
lanes; platoons of all sizes up to Δn. Cumulative counts are in vehicles, a platoon counting as
a whole from the moment of its first vehicle: what theory says of the vehicles then holds to one
platoon, Δn.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import pytest
from drawn_networks import Tables, webs
from hypothesis import example, given, settings
from small_networks import Row, demand, link, network, on_link
from twin import counts_at

from uxsim_geo.engine.simulation import simulate
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

#: s or vehicles: what rounding may do
HAIR = 1e-6
REACTION_TIME = 1.3  # s

Property = Callable[[Tables, Result], None]


@dataclass(frozen=True)
class Passing:
    """What passed a link, in the order of the entries: s, NaN while on it; vehicles."""

    road: Row
    enter: np.ndarray
    leave: np.ndarray
    vehicles: np.ndarray

    def room(self, platoon_size: int) -> float:
        """Vehicles that the link has room for at rest, one platoon at least."""
        road = self.road
        jammed: float = road["lanes"] * road["jam_density"] * road["length"]
        return max(jammed, platoon_size)

    def entered(self, times: np.ndarray) -> np.ndarray:
        """Vehicles that have entered the link by these times."""
        return counts_at(self.enter, self.vehicles, times)

    def left(self, times: np.ndarray) -> np.ndarray:
        """Vehicles that have left the link by these times."""
        return counts_at(self.leave, self.vehicles, times)


def passings(tables: Tables, result: Result) -> Iterator[Passing]:
    sizes = result.trips["vehicles"].to_numpy()
    for road in tables[0]:
        events = on_link(result, road["link_id"])
        enter, leave = events["enter_s"].to_numpy(), events["exit_s"].to_numpy()
        yield Passing(road, enter, leave, sizes[events["vehicle"]])


def steps(result: Result) -> np.ndarray:
    """The moments at which steps end, and the end of the run."""
    told = result.settings
    return np.append(np.arange(told.step, told.duration, told.step), told.duration)


def times_are_positive_and_in_order(tables: Tables, result: Result) -> None:
    trips, duration = result.trips, result.settings.duration
    assert trips["depart_s"].min() >= 0
    assert not (trips["enter_s"] < trips["depart_s"]).any()
    assert not (trips["arrive_s"] < trips["enter_s"]).any()
    for passing in passings(tables, result):
        assert (passing.enter >= 0).all()
        assert not (passing.leave < passing.enter).any()
        assert not (passing.leave > duration).any()


def nobody_is_faster_than_free_flow(tables: Tables, result: Result) -> None:
    for passing in passings(tables, result):
        free = passing.road["length"] / passing.road["free_speed"]
        assert not (passing.leave - passing.enter < free - HAIR).any()
    done = result.trips[result.trips["status"] == "completed"]
    assert not (done["arrive_s"] - done["enter_s"] < done["free_time_s"] - HAIR).any()


def links_are_first_in_first_out(tables: Tables, result: Result) -> None:
    for passing in passings(tables, result):
        assert (np.diff(passing.enter) > 0).all()
        gone = ~np.isnan(passing.leave)
        assert (np.diff(passing.leave[gone]) > 0).all()
        assert not (np.diff(gone.astype(int)) > 0).any()  # those still there came last


def vehicles_are_conserved_in_every_step(tables: Tables, result: Result) -> None:
    """Those who set out have arrived or are on just one link, whenever one looks."""
    moments, trips = steps(result), result.trips
    vehicles = trips["vehicles"].to_numpy()
    assert vehicles.sum() == sum(row[4] for row in tables[1])
    started = trips["status"] != "aborted"
    gone_out = counts_at(trips["enter_s"].where(started), vehicles, moments)
    arrived = counts_at(trips["arrive_s"], vehicles, moments)
    on_links = np.zeros(moments.size)
    for passing in passings(tables, result):
        on_links += passing.entered(moments) - passing.left(moments)
    assert (gone_out - arrived == on_links).all()
    running = trips.loc[trips["status"] == "running", "vehicles"].sum()
    assert on_links[-1] == running


def no_link_holds_more_than_its_jam_density(tables: Tables, result: Result) -> None:
    """Nor more than one platoon, where it is too short for that."""
    moments = steps(result)
    for passing in passings(tables, result):
        road = passing.road
        room = max(
            road["lanes"] * road["jam_density"] * road["length"], result.settings.platoon_size
        )
        held = passing.entered(moments) - passing.left(moments)
        assert held.min() >= 0
        assert held.max() <= room + HAIR


def flows_stay_below_capacity(tables: Tables, result: Result) -> None:
    """Behind the first vehicle of any platoon at most Q T follow within T, at either end."""
    for passing in passings(tables, result):
        road = passing.road
        speed, jam = road["free_speed"], road["jam_density"]
        top = road["lanes"] * speed * jam / (1 + speed * result.settings.reaction_time * jam)
        top = np.fmin(top, road["capacity"])
        gone = ~np.isnan(passing.leave)
        for times, vehicles in (
            (passing.enter, passing.vehicles),
            (passing.leave[gone], passing.vehicles[gone]),
        ):
            # the vehicles before each, less what capacity lets through by then, never rise
            over = np.cumsum(vehicles) - vehicles - top * times
            assert (np.diff(over) <= HAIR).all()


def waves_travel_as_the_diagram_says(tables: Tables, result: Result) -> None:
    """Newell's N-curves: D(t) ≤ A(t − L/u), and A(t) ≤ D(t − L/w) + m κ L, to one platoon."""
    for passing in passings(tables, result):
        road, size = passing.road, result.settings.platoon_size
        forward = road["length"] / road["free_speed"]
        backward = road["length"] * result.settings.reaction_time * road["jam_density"]
        moments = np.concatenate([steps(result), passing.enter, passing.leave])
        moments = moments[~np.isnan(moments)]
        assert (passing.left(moments) <= passing.entered(moments - forward + HAIR)).all()
        holes = passing.left(moments - backward + HAIR) + passing.room(size) + size
        assert (passing.entered(moments) <= holes + HAIR).all()


def arrivals_are_departures_a_travel_time_later(tables: Tables, result: Result) -> None:
    """A(t) = D(t + TT(t)): whoever enters as number n leaves as number n, its travel time on."""
    moments_checked = 0
    for passing in passings(tables, result):
        gone = ~np.isnan(passing.leave)
        enter, taken = passing.enter[gone], (passing.leave - passing.enter)[gone]
        assert (passing.entered(enter) == passing.left(enter + taken + HAIR)).all()
        moments_checked += enter.size
    assert moments_checked == result.events["exit_s"].notna().sum()


PROPERTIES: tuple[Property, ...] = (
    times_are_positive_and_in_order,
    nobody_is_faster_than_free_flow,
    links_are_first_in_first_out,
    vehicles_are_conserved_in_every_step,
    no_link_holds_more_than_its_jam_density,
    flows_stay_below_capacity,
    waves_travel_as_the_diagram_says,
    arrivals_are_departures_a_travel_time_later,
)


def kinds(tables: Tables, result: Result) -> set[str]:
    """What a run shows: trips of each status, delays on links, full links."""
    size = result.settings.platoon_size
    met = {str(status) for status in result.trips["status"].unique()}
    for passing in passings(tables, result):
        free = passing.road["length"] / passing.road["free_speed"]
        held = passing.entered(passing.enter) - passing.left(passing.enter)
        if (passing.leave - passing.enter > 1.5 * free).any():
            met.add("delayed")
        if (held > passing.room(size) - size).any():
            met.add("full")
    return met


def every_kind(platoon_size: int) -> Tables:
    """More than a road can take, and a pair without a way: trips end in each status here."""
    length = 20.0 * platoon_size
    links = [link("a", "0", "1", length), link("b", "1", "2", length, capacity=0.2)]
    end = 100.0 * platoon_size
    return links, [("0", "2", 0.0, end, 80.0 * platoon_size), ("2", "0", 0.0, end, 20.0)]


@pytest.mark.parametrize("platoon_size", [1, 5, 10])
def test_in_every_run_all_of_this_holds(platoon_size: int) -> None:
    met = Counter[str]()

    @settings(derandomize=True, deadline=None, max_examples=60)
    @given(webs(platoon_size))
    @example(every_kind(platoon_size))
    def check(tables: Tables) -> None:
        links, rows = tables
        told = Settings(200.0 * platoon_size, platoon_size, reaction_time=REACTION_TIME)
        result = simulate(network(links), demand(*rows), told)
        for holds in PROPERTIES:
            holds(tables, result)
        met.update(kinds(tables, result))

    check()
    # the runs are worth the while
    for kind in ("completed", "running", "waiting", "aborted", "delayed", "full"):
        assert met[kind] > 0, met
