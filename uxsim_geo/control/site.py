"""Where control takes place: the network as plain arrays, and how measures fit in.

A *measure* is what a user writes down: a toll on these links, from then to then. Bound to a site
it becomes *rules*: what is written, where, when, and the function that writes it. The engine calls
rules and knows nothing of measures.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, Protocol

import numpy as np
import numpy.typing as npt

from uxsim_geo.control.timetable import NUMBER
from uxsim_geo.errors import Faults, InputError

if TYPE_CHECKING:
    from uxsim_geo.control.levers import Levers
    from uxsim_geo.control.traffic import Traffic

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Target:
    """Links chosen by ids, by an expression on attributes, by an area, by street; or by all.

    What is given must hold together: ``Target(where="lanes >= 2", polygon=…)`` are the links with
    two lanes in that area.

    links
        link_ids
    where
        as ``lanes >= 2 and road_class == 'primary'``
    polygon
        WKT in the reference system of the network, or a GeoJSON or GeoPackage file
    part
        of the links that touch the polygon: all of them; those inside; those that lead into it,
        or out of it
    street
        name of the road, as column ``name`` has it
    """

    links: tuple[str, ...] = ()
    where: str | None = None
    polygon: str | None = None
    part: Literal["touching", "inside", "entering", "leaving"] = "touching"
    street: str | None = None

    def __str__(self) -> str:
        parts = [f"links {', '.join(self.links)}"] if self.links else []
        parts += [f"links where {self.where}"] if self.where else []
        parts += [f"links {self.part} {self.polygon}"] if self.polygon else []
        parts += [f"links of {self.street}"] if self.street else []
        return " and ".join(parts) or "no links"


#: what is called to control
Act = Callable[["Traffic", "Levers"], None]

#: how measures are told their links: a target, or link_ids
Chosen = Target | Sequence[str]


@dataclass(frozen=True)
class Site:
    """The network as control sees it; arrays stand in the order of the tables.

    link_ids, node_ids
        of all links and nodes
    from_node, to_node
        (links,) positions among the nodes
    length, lanes, free_speed, jam_density, capacity, merge_priority
        (links,) m, –, m/s, veh/m per lane, veh/s of the whole link, –
    class_names
        of the classes of drivers
    duration, step
        s: end of the simulation; how often nodes are visited, the finest that control can act
    select
        gives the positions of the links of a target; raises InputError if it cannot
    drivable
        says how many links of a route, given by their positions, may be driven one after the other
        before a turn that is banned, or a node without through traffic
    plans
        the signals bound so far; the number of a plan is its place here
    """

    link_ids: tuple[str, ...]
    node_ids: tuple[str, ...]
    from_node: Ints
    to_node: Ints
    length: Floats
    lanes: Floats
    free_speed: Floats
    jam_density: Floats
    capacity: Floats
    merge_priority: Floats
    class_names: tuple[str, ...]
    duration: float
    step: float
    select: Callable[[Target], Ints]
    drivable: Callable[[Sequence[int]], int]
    plans: list[Any] = field(default_factory=list)
    link_position: Mapping[str, int] = field(init=False)
    node_position: Mapping[str, int] = field(init=False)

    def __post_init__(self) -> None:
        for name, ids in (("link_position", self.link_ids), ("node_position", self.node_ids)):
            object.__setattr__(self, name, {id_: number for number, id_ in enumerate(ids)})

    def links(self, chosen: Chosen, faults: Faults, *, key: str = "links") -> Ints:
        """Return the positions of some links; faults are noted where there are none."""
        target = chosen if isinstance(chosen, Target) else Target(links=as_ids(chosen))
        try:
            positions = self.select(target)
        except InputError as error:
            for fault in error.faults:
                faults.add(fault.what, column=key, value=fault.value)
            return np.empty(0, np.int64)
        if positions.size == 0:
            faults.add("no link of the network is meant", column=key, value=str(target))
        return positions

    def name_links(self, positions: Ints) -> str:
        """Name some links for people: "link a", "links a, b", "links a, b and 12 more"."""
        return _name("link", self.link_ids, positions)

    def name_nodes(self, positions: Ints) -> str:
        """Name some nodes likewise."""
        return _name("node", self.node_ids, positions)

    def node(self, node_id: str, faults: Faults, *, key: str = "node") -> Ints:
        """Return the position of a node, or none and a fault."""
        if node_id in self.node_position:
            return np.array([self.node_position[node_id]])
        faults.add("the network has no such node", column=key, value=node_id)
        return np.empty(0, np.int64)

    def classes(self, names: Sequence[str], faults: Faults) -> Ints:
        """Return the positions of some classes of drivers; of all where none is named."""
        if not names:
            return np.arange(len(self.class_names))
        known = {name: number for number, name in enumerate(self.class_names)}
        for name in as_ids(names):
            if name not in known:
                what = f"no such class of drivers; there are {', '.join(known)}"
                faults.add(what, column="classes", value=name)
        return np.array([known[name] for name in as_ids(names) if name in known], np.int64)


@dataclass(frozen=True)
class Claim:
    """A quantity of :class:`uxsim_geo.control.levers.Levers` that a rule writes, and where.

    ``rows`` are the classes, for quantities that are by class; None: the quantity has no rows.
    """

    quantity: str
    positions: Ints
    rows: Ints | None = None

    def read(self, levers: Levers) -> npt.NDArray[Any]:
        """Return what the levers hold there."""
        values: npt.NDArray[Any] = getattr(levers, self.quantity)[self._where()]
        return values

    def write(self, levers: Levers, values: npt.ArrayLike) -> None:
        """Set the levers there."""
        getattr(levers, self.quantity)[self._where()] = values

    def _where(self) -> Any:
        return self.positions if self.rows is None else np.ix_(self.rows, self.positions)


@dataclass(frozen=True)
class Rule:
    """A measure bound to a site.

    name
        for people: what, where
    act
        writes the levers, from what it sees
    claims
        what it writes; at ``end`` it is set back to what it was without control
    begin, end
        s; the first call is made at ``begin``, none at ``end`` or later
    interval
        s between two calls; None: called only at ``begin`` and at ``moments``
    moments
        s: further times at which it is called
    felt_at
        (any,) links whose vehicles feel it: it took effect if one of them leaves such a link, or
        waits on it, while it is in force
    """

    name: str
    act: Act
    claims: tuple[Claim, ...] = ()
    begin: float = 0.0
    end: float = math.inf
    interval: float | None = None
    moments: tuple[float, ...] = ()
    felt_at: Ints = field(default_factory=lambda: np.empty(0, np.int64))

    def times(self, duration: float) -> Iterator[float]:
        """Yield the times at which it is called, in any order; once for each."""
        stop = min(self.end, duration)
        yield from (time for time in (self.begin, *self.moments) if self.begin <= time < stop)
        if self.interval is not None:
            count = math.ceil((stop - self.begin) / self.interval)
            yield from (self.begin + number * self.interval for number in range(1, count))


class Measure(Protocol):
    """What a measure must offer."""

    def rules(self, site: Site, faults: Faults) -> Sequence[Rule]:
        """Bind it to a site; what is wrong with it is added to the faults."""
        ...


def as_ids(chosen: Sequence[str]) -> tuple[str, ...]:
    """Return ids as a tuple; a text is one id, not its letters."""
    return (chosen,) if isinstance(chosen, str) else tuple(str(one) for one in chosen)


def check_period(begin: float, end: float, duration: float, faults: Faults) -> None:
    """Note what is wrong with a period: it must begin within the run, and end after it began."""
    for name, value in (("begin", begin), ("end", end)):
        if not isinstance(value, NUMBER):
            faults.add("must be a number of seconds", column=name, value=value)
            return
    if not 0 <= begin < math.inf:
        faults.add("must be a finite time of 0 s or more", column="begin", value=begin)
    elif begin >= duration:
        what = f"begins when the simulation is over, which ends at {duration:g} s"
        faults.add(what, column="begin", value=begin)
    if not end > begin:
        faults.add("must be later than begin", column="end", value=end)
    elif end > duration and end != math.inf:
        what = f"lies beyond the end of the simulation, {duration:g} s; leave it out for no end"
        faults.add(what, column="end", value=end)


def check_number(value: Any, name: str, faults: Faults, *, above: float | None = None) -> None:
    """Note a value that is no finite number of 0 or more; or, told so, not above another."""
    good = isinstance(value, NUMBER) and math.isfinite(value)
    if not good or value < 0 or (above is not None and value <= above):
        limit = "of 0 or more" if above is None else f"above {above:g}"
        faults.add(f"must be a finite number {limit}", column=name, value=value)


def check_interval(interval: float, site: Site, faults: Faults) -> None:
    """Note an interval between two calls that is no time, or shorter than a step."""
    check_number(interval, "interval", faults, above=0.0)
    if 0 < interval < site.step:
        what = (
            f"is shorter than a step of the simulation, {site.step:g} s: control acts once a step"
        )
        faults.add(what, column="interval", value=interval)


def check_density(value: Any, site: Site, links: Ints, faults: Faults) -> None:
    """Note a wanted density that is none, or that some links can never exceed, veh/m."""
    check_number(value, "target_density", faults, above=0.0)
    jam = (site.lanes * site.jam_density)[links]
    if jam.size and isinstance(value, int | float) and math.isfinite(value) and value >= jam.max():
        what = (
            f"must be below the jam density of the links, {jam.max():g} veh/m; is the unit veh/m?"
        )
        faults.add(what, column="target_density", value=value)


def _name(noun: str, ids: Sequence[str], positions: Ints) -> str:
    shown = [ids[position] for position in positions[:3]]
    if len(positions) <= 3:
        return f"{noun}{'s' if len(shown) > 1 else ''} {', '.join(shown)}"
    return f"{noun}s {shown[0]}, {shown[1]} and {len(positions) - 2} more"
