"""A slow and plain twin of the engine: every platoon is moved in every time step.

The model is that of Seo (2023, arXiv:2309.17114) with the car-following model of Newell (2002).
Platoon k of a link with m lanes, free speed u and jam density κ per lane follows its leader k-1::

    x_k(t + δ) = min( x_k(t) + u δ,  x_{k-1}(t + δ - τΔn/m) - Δn/(mκ) )

where δ = τΔn / substeps. With one lane and one substep this is the paper's equation as it stands.
Three things make the steps harmless:

* A leader that has left the link drives on at u beyond its end, so that its follower keeps the
  headway Δn/Q with Q = m u κ / (1 + uτκ) at the exit, also after an interruption.
* A platoon enters as soon as the equation lets it stand beyond the start of the link: that one
  rule is both the storage and the capacity of the entry.
* What is left of a step when a platoon reaches a node is driven on the next link.

Nodes are those of the incremental node model: platoons at the end of their links are drawn one
after the other with probability merge_priority / sum of those still in, and each moves if its next
link takes it. Origins queue first in, first out, and go before links. Routes are fixed.

Nothing here is shared with the engine, which knows neither steps nor positions.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: m; what is nearer than this to the end of a link or of a gap is at it
TOLERANCE = 1e-6
#: stands for the origin of a node among its in-links
HOME = ""


@dataclass(frozen=True)
class TwinLink:
    """A directed link: m, m/s, veh/m per lane; capacity in veh/s of the whole link, if given."""

    link_id: str
    from_node: str
    to_node: str
    length: float
    free_speed: float = 20.0
    lanes: int = 1
    jam_density: float = 0.2
    capacity: float | None = None
    merge_priority: float = 1.0


@dataclass(frozen=True)
class TwinTrip:
    """A platoon of the full size that leaves home at ``depart`` (s) and follows ``route``."""

    depart: float
    route: tuple[str, ...]


@dataclass(frozen=True)
class Case:
    """What the twin is to run.

    ``substeps`` divides the step τΔn and must be a multiple of every link's lanes. ``merge_order``
    names, for a node, the in-links, or HOME, whose platoons go one after the other; there, nothing
    is drawn and origins do not go first. No route may hold one of the ``banned`` ways: link_ids.
    """

    links: Sequence[TwinLink]
    trips: Sequence[TwinTrip]
    duration: float
    platoon_size: float = 5
    reaction_time: float = 1.0
    substeps: int = 1
    seed: int = 0
    merge_order: Mapping[str, Sequence[str]] = field(default_factory=dict)
    banned: Sequence[tuple[str, ...]] = ()

    @property
    def step(self) -> float:
        """δ, s."""
        return self.reaction_time * self.platoon_size / self.substeps

    def __post_init__(self) -> None:
        for link in self.links:
            if self.substeps % link.lanes:
                raise ValueError(f"substeps must be a multiple of {link.lanes} ({link.link_id})")
            if link.length < link.free_speed * self.step:
                raise ValueError(f"{link.link_id} is shorter than one step: use more substeps")
        for route in {trip.route for trip in self.trips}:
            for way in self.banned:
                if f" {' '.join(way)} " in f" {' '.join(route)} ":
                    raise ValueError(f"the route {route} holds the banned turn {way}")


@dataclass(frozen=True)
class Passages:
    """Times (s), in order, at which platoons entered and left a link."""

    entries: NDArray[np.float64]
    exits: NDArray[np.float64]


@dataclass
class Stay:
    """One platoon on one link: where it was (m) at the end of each step since ``first_step``."""

    trip: TwinTrip
    hop: int
    entered: float
    first_step: int
    positions: list[float]
    left: float | None = None


class _Road:
    """A link with the platoons that are, or have been, on it."""

    def __init__(self, link: TwinLink, case: Case) -> None:
        self.link = link
        self.step = case.step
        self.spacing = case.platoon_size / (link.lanes * link.jam_density)
        self.lag = case.substeps // link.lanes  # steps in τΔn/m
        self.headway = case.platoon_size / link.capacity if link.capacity else 0.0
        self.stays: list[Stay] = []
        self.front = 0  # number of the first platoon still on the link
        self.spare: float | None = (
            None  # s of this step that it has left at the end; None: not there
        )

    def position(self, number: int, step: int) -> float:
        stay = self.stays[number]
        if stay.left is not None and step * self.step >= stay.left:
            return self.link.length + self.link.free_speed * (step * self.step - stay.left)
        if step < stay.first_step:
            return -math.inf
        return stay.positions[step - stay.first_step]

    def bound(self, number: int, step: int) -> float:
        """How far platoon ``number`` may have come at the end of ``step``, for its leader."""
        if number == 0:
            return math.inf
        return self.position(number - 1, step - self.lag) - self.spacing

    def advance(self, step: int) -> None:
        """Move every platoon through ``step``; the first one halts at the end of the link."""
        self.spare = None
        speed, end = self.link.free_speed, self.link.length
        for number in range(self.front, len(self.stays)):
            positions = self.stays[number].positions
            reached = min(positions[-1] + speed * self.step, self.bound(number, step))
            if number == self.front and reached >= end - TOLERANCE:
                self.spare = self._spare_at_end((reached - end) / speed, step * self.step)
            positions.append(min(reached, end))

    def _spare_at_end(self, spare: float, now: float) -> float | None:
        if self.front:
            previous = self.stays[self.front - 1].left
            assert previous is not None
            spare = min(spare, now - previous - self.headway)
        return max(spare, 0.0) if spare >= -TOLERANCE else None

    def enter(self, trip: TwinTrip, hop: int, spare: float, step: int) -> float | None:
        """Take a platoon that has ``spare`` seconds of ``step`` left: its entry time, or None."""
        now = step * self.step
        if self.stays:
            spare = min(spare, now - self.stays[-1].entered - self.headway)
        position = min(self.link.free_speed * spare, self.bound(len(self.stays), step))
        if position <= TOLERANCE:
            return None
        entered = now - position / self.link.free_speed
        self.stays.append(Stay(trip, hop, entered, step, [position]))
        return entered

    def release(self, time: float) -> None:
        self.stays[self.front].left = time
        self.front += 1
        self.spare = None


class _Twin:
    def __init__(self, case: Case) -> None:
        self.case = case
        self.roads = {link.link_id: _Road(link, case) for link in case.links}
        self.random = np.random.default_rng(case.seed)
        self.orders = {node: deque(order) for node, order in case.merge_order.items()}
        self.set_out: dict[str, float] = {}  # when the last platoon did, by node
        self.homes: dict[str, deque[TwinTrip]] = {}
        for trip in sorted(case.trips, key=lambda trip: trip.depart):
            home = self.roads[trip.route[0]].link.from_node
            self.homes.setdefault(home, deque()).append(trip)

    def run(self) -> None:
        ends = sorted({end for link in self.case.links for end in (link.from_node, link.to_node)})
        for step in range(1, math.ceil(self.case.duration / self.case.step) + 1):
            for road in self.roads.values():
                road.advance(step)
            for node in ends:
                if node in self.orders:
                    self._serve_in_order(node, step)
                else:
                    while self._set_out(node, step):
                        pass
                    self._serve_links(node, step)

    def _set_out(self, node: str, step: int) -> bool:
        """Let the first platoon that waits at home enter, if it is time and there is room."""
        queue = self.homes.get(node)
        if not queue:
            return False
        now = step * self.case.step
        out_at = max(queue[0].depart, self.set_out.get(node, 0.0))  # no earlier than the last one
        spare = min(self.case.step, now - out_at)
        if spare <= 0:
            return False
        entered = self.roads[queue[0].route[0]].enter(queue[0], 0, spare, step)
        if entered is None:
            return False
        self.set_out[node] = entered
        queue.popleft()
        return True

    def _serve_in_order(self, node: str, step: int) -> None:
        order = self.orders[node]
        while order and (
            self._set_out(node, step)
            if order[0] == HOME
            else self._leave(self.roads[order[0]], step)
        ):
            order.popleft()

    def _serve_links(self, node: str, step: int) -> None:
        rivals = [r for r in self.roads.values() if r.link.to_node == node and r.spare is not None]
        weights = np.array([road.link.merge_priority for road in rivals])
        if len(rivals) > 1:
            share = weights / weights.sum()
            drawn = self.random.choice(len(rivals), size=len(rivals), replace=False, p=share)
            rivals = [rivals[position] for position in drawn]
        for road in rivals:
            self._leave(road, step)

    def _leave(self, road: _Road, step: int) -> bool:
        """Let the first platoon of ``road`` go on, or arrive, if it is at the end and may."""
        if road.spare is None:
            return False
        stay = road.stays[road.front]
        time: float | None = step * self.case.step - road.spare
        if stay.hop + 1 < len(stay.trip.route):
            next_road = self.roads[stay.trip.route[stay.hop + 1]]
            time = next_road.enter(stay.trip, stay.hop + 1, road.spare, step)
        if time is None:
            return False
        road.release(time)
        return True


def run_twin(case: Case) -> dict[str, Passages]:
    """Run ``case`` and say when platoons entered and left each link, by link_id."""
    twin = _Twin(case)
    twin.run()
    return {
        link_id: Passages(
            np.array([stay.entered for stay in road.stays]),
            np.array([stay.left for stay in road.stays if stay.left is not None]),
        )
        for link_id, road in twin.roads.items()
    }


def run_twin_for_positions(case: Case) -> Iterator[tuple[str, list[Stay]]]:
    """Run ``case``; each link_id with what its platoons did on it, in the order they entered."""
    twin = _Twin(case)
    twin.run()
    for link_id, road in twin.roads.items():
        yield link_id, road.stays


def counts_at(times: ArrayLike, sizes: ArrayLike, grid: ArrayLike) -> NDArray[np.float64]:
    """Cumulative count at each time of ``grid``: what of ``sizes`` has passed by then.

    ``times`` in s, unordered, NaN for what has not passed; ``sizes`` of the same shape or a
    scalar; the result has the shape of ``grid`` and the unit of ``sizes``.
    """
    when = np.asarray(times, dtype=np.float64)
    passed = np.broadcast_to(np.asarray(sizes, dtype=np.float64), when.shape)[~np.isnan(when)]
    order = np.argsort(when[~np.isnan(when)], kind="stable")
    totals = np.concatenate(([0.0], np.cumsum(passed[order])))
    ordered = when[~np.isnan(when)][order]
    return np.asarray(totals[np.searchsorted(ordered, np.asarray(grid), side="right")])


def largest_difference(a: ArrayLike, b: ArrayLike) -> float:
    """Largest distance between two counts on the same grid, in their unit."""
    return float(np.max(np.abs(np.asarray(a, dtype=np.float64) - np.asarray(b, dtype=np.float64))))
