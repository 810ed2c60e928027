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
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.network.network import Network
from uxsim_geo.settings import Settings

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


@dataclass(frozen=True)
class LinkGeometry:
    """What the position of a platoon needs to know of each link; one entry a row of ``links``.

    length (m), free_speed (m/s), time_shift (τ/m, s per vehicle ahead) and space_shift (1/(mκ), m
    per vehicle ahead): the two shifts between trajectories of a queue.
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
    before), first (per link and one more: where its passages begin), geometry (of the links).
    """

    link: Integers
    vehicle: Integers
    enter: Floats
    exit: Floats
    vehicles: Floats
    ahead: Floats
    first: Integers
    geometry: LinkGeometry

    @classmethod
    def of(
        cls, network: Network, events: pd.DataFrame, trips: pd.DataFrame, settings: Settings
    ) -> Passages:
        """Sort the events by link.

        Raises ValueError if an event names a link that the network does not have.
        """
        link = _rows_of_links(events["link"], network.links["link_id"])
        enter = events["enter_s"].to_numpy(float)
        exit_ = events["exit_s"].to_numpy(float)
        exit_ = np.where(np.isnan(exit_), np.inf, exit_)
        order = np.lexsort((exit_, enter, link))
        link = link[order]
        vehicle = events["vehicle"].to_numpy(np.int64)[order]
        vehicles = trips["vehicles"].to_numpy(float)[vehicle]
        first = np.searchsorted(link, np.arange(len(network.links) + 1))
        return cls(
            link=link,
            vehicle=vehicle,
            enter=enter[order],
            exit=exit_[order],
            vehicles=vehicles,
            ahead=_sum_before(vehicles, first, link),
            first=first,
            geometry=LinkGeometry.of(network, settings),
        )

    def positions(self, rows: Integers, times: Floats) -> Floats:
        """Distance from the start of its link of passage ``rows[i]`` at ``times[i]``, m.

        0 until it enters, the link's length from its exit on, and never falling in between.
        """
        link = self.link[rows]
        length, speed = self.geometry.length[link], self.geometry.free_speed[link]
        time_shift, space_shift = self.geometry.time_shift[link], self.geometry.space_shift[link]
        unfelt = np.minimum(self._first_unfelt_exit(rows, times), rows + 1)

        between = self.ahead[rows] - self.ahead[np.minimum(unfelt, rows)]
        behind_standing = length - between * space_shift

        felt = np.maximum(unfelt - 1, self.first[link])
        between = self.ahead[rows] - self.ahead[felt]
        moving_for = times - between * time_shift - self.exit[felt]
        behind_moving = length + speed * moving_for - between * space_shift
        behind_moving[unfelt == self.first[link]] = np.inf

        free = speed * (times - self.enter[rows])
        position = np.minimum(free, np.minimum(behind_standing, behind_moving))
        position = np.clip(position, 0.0, length)
        return np.where(times >= self.exit[rows], length, position)

    def _first_unfelt_exit(self, rows: Integers, times: Floats) -> Integers:
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


def _rows_of_links(names: pd.Series, link_ids: pd.Series) -> Integers:
    """Row of the links table for every event."""
    index = pd.Index(link_ids.astype(str))
    if isinstance(names.dtype, pd.CategoricalDtype):
        rows = index.get_indexer(names.cat.categories.astype(str))[names.cat.codes.to_numpy()]
    else:
        rows = index.get_indexer(pd.Index(names.astype(str).to_numpy()))
    if (rows < 0).any():
        unknown = sorted(set(names[rows < 0].astype(str)))
        raise ValueError(f"events name {len(unknown)} links that the network lacks: {unknown[:5]}")
    return rows.astype(np.int64)


def _sum_before(values: Floats, first: Integers, group: Integers) -> Floats:
    """Running sum within each group, excluding the value itself."""
    total = np.concatenate(([0.0], np.cumsum(values)))
    return total[:-1] - total[first[group]]
