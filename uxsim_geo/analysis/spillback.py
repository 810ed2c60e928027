"""When links are full: nobody can enter for want of room, a queue has grown back to their start."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.network.diagram import effective_capacity, storage
from uxsim_geo.network.network import Network
from uxsim_geo.settings import Settings

#: less than this beyond the headway is rounding, s
ROUNDING = 1e-6


class Closures(NamedTuple):
    """Times at which links had no room; arrays of one length.

    link (row of the links), begin (s), end (s; inf: still so at the end of the simulation).
    """

    link: Integers
    begin: Floats
    end: Floats


def times_without_room(passages: Passages, network: Network, settings: Settings) -> Closures:
    """When the next platoon could not have entered a link, because there was no room for it.

    After an entry the link opens again when the headway at capacity n/Q is over and the hole that
    the next platoon waits for has come back from the exit. With E vehicles entered so far, S of
    them fitting on the link, n' in the next platoon, D(c) the exit of the vehicle with c before it
    (interpolated within platoons) and T_w = L τ κ that is at

        t = max( D(E − S) + T_w,  exit of the vehicle E − S + n' )

    If t is later than the headway, the link counts as full from the entry until t: its start lies
    in a queue that moves below capacity. It never counts so beyond the next entry.
    """
    gaps = _Gaps.of(passages, network, settings)
    link, enter = passages.link, passages.enter
    headway = passages.vehicles / effective_capacity(network.links, settings.reaction_time)[link]
    opens = np.maximum(gaps.hole(passages), gaps.exits(passages))
    full = opens > enter + headway + ROUNDING
    return Closures(link[full], enter[full], np.minimum(opens, _next_entry(passages))[full])


def _next_entry(passages: Passages) -> Floats:
    """When the next platoon has entered the link after each passage, s; inf: none has."""
    entry = np.append(passages.enter[1:], np.inf)[: len(passages.link)]
    entry[passages.first[1:][np.diff(passages.first) > 0] - 1] = np.inf
    return entry


class _Gaps(NamedTuple):
    """What the next platoon after each passage waits for; arrays of the shape (passages,).

    surplus
        vehicles that must have left for the next vehicle to have room, a real number; from 0 down
        there is room without any exit
    number
        the passage that leaves next when so many have left, or the first on the link
    last
        the passage with which room for the whole next platoon is made; -1: there is room anyway
    passed
        vehicles that left before passage ``number``
    exit_headway
        per vehicle, s
    wave_time
        T_w, s
    """

    surplus: Floats
    number: Integers
    last: Integers
    passed: Floats
    exit_headway: Floats
    wave_time: Floats

    @classmethod
    def of(cls, passages: Passages, network: Network, settings: Settings) -> _Gaps:
        link, first = passages.link, passages.first[passages.link]
        geometry = passages.geometry
        fits = storage(network.links, settings.platoon_size)[link]
        follows = np.concatenate((link[1:] == link[:-1], [False]))[: len(link)]
        following = np.append(passages.vehicles[1:], 0.0)[: len(link)]
        following = np.where(follows, following, float(settings.platoon_size))
        surplus = passages.ahead + passages.vehicles - fits
        total = np.cumsum(passages.vehicles)
        before = (total - passages.vehicles)[first]
        number = np.searchsorted(total, before + surplus, side="left") + 1
        number = np.where(surplus > 0, number, first)
        last = np.searchsorted(total, before + surplus + following, side="left")
        return cls(
            surplus,
            number,
            np.where(surplus + following > 0, last, -1),
            passages.ahead[np.minimum(number, len(link) - 1)],
            1.0 / effective_capacity(network.links, settings.reaction_time)[link],
            (geometry.length * geometry.time_shift / geometry.space_shift)[link],
        )

    def hole(self, passages: Passages) -> Floats:
        """When the hole for the next vehicle has arrived, s; -inf: it waits for none."""
        leaves = passages.exit[self.number]
        gained = (self.passed - self.surplus) * self.exit_headway
        inside = self.surplus > 0
        previous = np.where(inside, self.number - 1, self.number)
        with np.errstate(invalid="ignore"):  # neither has left
            apart = (leaves - passages.exit[previous]) / passages.vehicles[previous]
            gained = np.where(inside, (self.passed - self.surplus) * apart, gained)
            hole = np.where(np.isinf(leaves), np.inf, leaves - gained)
        return np.where(self.last >= 0, hole + self.wave_time, -np.inf)

    def exits(self, passages: Passages) -> Floats:
        """When those have left whose room the next platoon takes, s; -inf: it waits for none."""
        leaves = passages.exit[np.maximum(self.last, self.number)]
        return np.where(self.last >= 0, leaves, -np.inf)
