"""Where every platoon is at any time, in closed form, from its entry and exit times.

The inside of a link follows from what happens at its two ends (Newell 1993; Seo 2023, X-model).
On a link of length L, free speed u, m lanes, jam density κ and reaction time τ, platoon k with
C_k vehicles ahead of it since the start, entry e_k and exit s_k is at time t at

    x_k(t) = min( u (t − e_k),
                  min over a ≤ k of  L + u max(0, t − (C_k − C_a) τ/m − s_a) − (C_k − C_a)/(m κ) )

The exit of platoon a is *felt* by k once t − C_k τ/m ≥ g_a with g_a = s_a − C_a τ/m. As platoons
leave at least n/Q apart, and n/Q = n τ/m + n/(m κ u), g increases with a: the felt exits are those
of the first platoons. Among felt exits the last binds, among the others the first one does, so
that one binary search on g finds the minimum.

Where speed limits change, every platoon has a free speed u_k of its own, that of its entry. Two
things are then added, with d = (C_k − C_a)/(mκ) and θ = (C_k − C_a) τ/m. Behind a platoon a that
is no faster and whose exit is not felt, nobody is further than its own free way, shifted,

    x_k(t) ≤ u_a (t − θ − e_a) − d

and the way gone since an exit was felt is driven at the lowest free speed of those whose exit is
not, but never so slowly that k comes too late for the next exit: those who leave a queue after a
limit was lifted do so as fast as the road then lets them.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from uxsim_geo.analysis.own_speeds import last_no_faster, own_free_speeds
from uxsim_geo.analysis.subsets import check_links
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.errors import Faults
from uxsim_geo.events import EventLog
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings


@dataclass(frozen=True)
class LinkGeometry:
    """What the position of a platoon needs to know of each link; one entry a row of ``links``.

    length (m), free_speed (m/s, without control), time_shift (τ/m, s per vehicle ahead) and
    space_shift (1/(mκ), m per vehicle ahead): the two shifts between trajectories of a queue.
    """

    length: Floats
    free_speed: Floats
    time_shift: Floats
    space_shift: Floats

    @classmethod
    def of(cls, network: Network, settings: Settings) -> LinkGeometry:
        """Take the columns of the links table."""
        links = network.links
        lanes = links["lanes"].to_numpy(float)
        return cls(
            length=links["length"].to_numpy(float),
            free_speed=links["free_speed"].to_numpy(float),
            time_shift=settings.reaction_time / lanes,
            space_shift=1.0 / (lanes * links["jam_density"].to_numpy(float)),
        )


@dataclass(frozen=True)
class Passages:
    """All link entries of a run, sorted by link and then by entry; arrays of one length.

    link (row of the links table), vehicle (row of the trips table), enter (s), exit (s; inf while
    on the link at the end), vehicles (in the platoon), ahead (vehicles that entered this link
    before), free_speed (m/s, its own: the limit in force when it entered, else that of the link),
    first (per link and one more: where its passages begin), geometry (of the links), held_by (the
    last passage before it that is no faster, as :func:`last_no_faster` tells; None: there were no
    speed limits), end (of the simulation, s), log (of the events that they were made of).

    There may be fewer: those of some links, or of some vehicles and of those that matter to them
    (:class:`uxsim_geo.analysis.run_passages.RunPassages`).
    """

    link: Integers
    vehicle: Integers
    enter: Floats
    exit: Floats
    vehicles: Floats
    ahead: Floats
    free_speed: Floats
    first: Integers
    geometry: LinkGeometry
    held_by: Integers | None
    end: float
    log: EventLog = field(repr=False, compare=False)

    @classmethod
    def of(cls, result: Result, network: Network, links: Integers | None = None) -> Passages:
        """Sort the events of a run, or of the links in some rows of the table, by link.

        Raises :class:`uxsim_geo.errors.InputError` if the events or limits are of another network.
        """
        check_links(result, network)
        limits = result.speed_limits
        geometry = LinkGeometry.of(network, result.settings)
        limited = _limited_links(limits, network)
        wanted = None if links is None else np.isin(np.arange(len(network.links)), links)
        events = result.log.some("vehicle", "link", "enter_s", "exit_s", links=wanted)
        enter, exit_ = events["enter_s"], events["exit_s"]
        exit_ = np.where(np.isnan(exit_), np.inf, exit_)
        order = np.lexsort((exit_, enter, events["link"]))
        link, enter = events["link"][order].astype(np.int64, copy=False), enter[order]
        vehicle = events["vehicle"][order].astype(np.int64, copy=False)
        vehicles = result.trips["vehicles"].to_numpy(float)[vehicle]
        first = np.searchsorted(link, np.arange(len(network.links) + 1))
        own = own_free_speeds(link, enter, geometry.free_speed, limits, limited)
        return cls(
            link=link,
            vehicle=vehicle,
            enter=enter,
            exit=exit_[order],
            vehicles=vehicles,
            ahead=_sum_before(vehicles, first, link),
            free_speed=own,
            first=first,
            geometry=geometry,
            held_by=last_no_faster(own, first, np.unique(limited)) if limited.size else None,
            end=result.settings.duration,
            log=result.log,
        )

    def positions(self, rows: Integers, times: Floats) -> Floats:
        """Distance from the start of its link of passage ``rows[i]`` at ``times[i]``, m.

        0 until it enters, the link's length from its exit on, and never falling in between.
        """
        link = self.link[rows]
        length, time_shift = self.geometry.length[link], self.geometry.time_shift[link]
        space_shift, speed = self.geometry.space_shift[link], self.free_speed[rows]
        unfelt = np.minimum(self.first_unfelt_exit(rows, times), rows + 1)
        if self.held_by is None:
            free = speed * (times - self.enter[rows])
        else:
            free, slowest = self._behind_others(self.held_by, rows, times, unfelt)
            speed = np.maximum(slowest, self._speed_to_be_in_time(rows, unfelt))

        between = self.ahead[rows] - self.ahead[np.minimum(unfelt, rows)]
        behind_standing = length - between * space_shift

        felt = np.maximum(unfelt - 1, self.first[link])
        between = self.ahead[rows] - self.ahead[felt]
        moving_for = times - between * time_shift - self.exit[felt]
        behind_moving = length + speed * moving_for - between * space_shift
        behind_moving[unfelt == self.first[link]] = np.inf

        position = np.minimum(free, np.minimum(behind_standing, behind_moving))
        position = np.clip(position, 0.0, length)
        return np.where(times >= self.exit[rows], length, position)

    def _behind_others(
        self, held_by: Integers, rows: Integers, times: Floats, unfelt: Integers
    ) -> tuple[Floats, Floats]:
        """How far those get whom no exit holds up, m, and the lowest speed up to that exit, m/s.

        Of the platoons between a passage and the last exit that it has felt, only those matter that
        are no faster than any behind them.
        """
        speed = self.free_speed[rows]
        reached = speed * (times - self.enter[rows])
        slow = held_by[rows]
        held = np.flatnonzero(slow >= unfelt)
        while held.size:
            ahead, link = slow[held], self.link[rows[held]]
            between = self.ahead[rows[held]] - self.ahead[ahead]
            since = times[held] - between * self.geometry.time_shift[link] - self.enter[ahead]
            speed[held] = self.free_speed[ahead]
            behind = speed[held] * since - between * self.geometry.space_shift[link]
            reached[held] = np.minimum(reached[held], behind)
            slow[held] = held_by[ahead]
            held = held[slow[held] >= unfelt[held]]
        return reached, speed

    def _speed_to_be_in_time(self, rows: Integers, unfelt: Integers) -> Floats:
        """Speed by which a queue has closed up to the next exit when that is felt, m/s.

        The room of the platoon that left last, over the time between the two exits less the time
        in which the first is passed on; at most the free speed without control.
        """
        link = self.link[rows]
        felt, following = np.maximum(unfelt - 1, self.first[link]), np.minimum(unfelt, rows)
        vehicles = self.vehicles[felt]
        room = vehicles * self.geometry.space_shift[link]
        with np.errstate(invalid="ignore"):  # neither has left
            apart = self.exit[following] - self.exit[felt]
        time = apart - vehicles * self.geometry.time_shift[link]
        needed = np.divide(room, time, out=np.full(len(rows), np.inf), where=time > 0)
        needed_or_free: Floats = np.minimum(needed, self.geometry.free_speed[link])
        return needed_or_free

    def first_unfelt_exit(self, rows: Integers, times: Floats) -> Integers:
        """The first passage on the same link whose exit has not been felt, by binary search."""
        shift = self.ahead * self.geometry.time_shift[self.link]
        exits = self.exit - shift
        wanted = times - shift[rows]
        order = np.argsort(self.link[rows], kind="stable")
        bounds = np.searchsorted(self.link[rows[order]], np.arange(len(self.first)))
        unfelt = np.empty(len(rows), np.int64)
        for link in np.flatnonzero(np.diff(bounds)):
            queries = order[bounds[link] : bounds[link + 1]]
            begin, end = self.first[link], self.first[link + 1]
            found = np.searchsorted(exits[begin:end], wanted[queries], side="right")
            unfelt[queries] = begin + found
        return unfelt


def _limited_links(limits: pd.DataFrame, network: Network) -> Integers:
    """Row of the links table of every limit."""
    if not len(limits):
        return np.empty(0, np.int64)
    ids = pd.Index(network.links["link_id"].astype(str))
    rows = ids.get_indexer(pd.Index(limits["link"].astype(str)))
    faults = Faults("speed_limits")
    for name in pd.unique(limits["link"][rows < 0]):
        faults.add("the network has no such link: are they of another run?", value=name)
    faults.raise_if_any()
    return rows.astype(np.int64)


def _sum_before(values: Floats, first: Integers, group: Integers) -> Floats:
    """Running sum within each group, excluding the value itself."""
    total = np.concatenate(([0.0], np.cumsum(values)))
    return total[:-1] - total[first[group]]
