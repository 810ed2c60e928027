"""Passages of a run of which not all need fit in memory: of some links, of some vehicles.

A link's passages belong together, since each platoon depends on those ahead of it, and different
links do not depend on one another. So links are taken block by block; and of a vehicle's own
passages all is known from those who left each link while it was there, and the last one before.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.types import Booleans, Integers
from uxsim_geo.errors import Faults
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result

#: entries that are in memory together, which take some 250 bytes each while they are worked on
TOGETHER = 2_000_000

#: but the events are not read more often than this for all blocks of them
MOST_BLOCKS = 16

#: columns of passages with an entry for each
BY_PASSAGE = ("link", "vehicle", "enter", "exit", "vehicles", "ahead", "free_speed")


class RunPassages:
    """The passages of a run; where they are few enough, they are sorted once."""

    def __init__(self, result: Result, network: Network) -> None:
        self._result, self._network = result, network
        self._together = max(TOGETHER, len(result.log) // MOST_BLOCKS)

    @cached_property
    def whole(self) -> Passages | None:
        """All of them; None if they are too many.

        Raises :class:`uxsim_geo.errors.InputError` if the result is of another network.
        """
        few = len(self._result.log) <= self._together
        return Passages.of(self._result, self._network) if few else None

    def on(self, links: Integers) -> Passages:
        """Those of the links in some rows of the table, at least."""
        return self.whole or Passages.of(self._result, self._network, links)

    def around(self, vehicles: Booleans) -> Passages:
        """Those of some vehicles (a flag for each trip) and those that theirs depend on, at least.

        Positions and speeds of these vehicles are what they are among all passages, to the bit.
        """
        if self.whole is not None:
            return self.whole
        every = np.arange(len(self._network.links))
        return _joined([_needed_by(passages, vehicles) for _, passages in self.blocks(every)])

    def blocks(self, links: Integers) -> Iterator[tuple[Integers, Passages]]:
        """Links in ascending rows, some at a time, and the passages of those at least."""
        if self.whole is not None:
            yield links, self.whole
            return
        until = np.cumsum(self._entries[links])
        number = np.maximum(until - 1, 0) // self._together
        for some in np.split(links, np.flatnonzero(np.diff(number)) + 1):
            # no name is kept for what has been given away: it can go before the next is made
            yield some, Passages.of(self._result, self._network, some)

    def drove(self, before: float = np.inf) -> Integers:
        """The vehicles that entered any link before a moment, s; rows of the trips, ascending."""
        entered = np.zeros(len(self._result.trips), bool)
        for piece in self._result.log.pieces("vehicle", "enter_s"):
            entered[piece["vehicle"][piece["enter_s"] < before]] = True
        return np.flatnonzero(entered)

    @cached_property
    def _entries(self) -> Integers:
        """How often each link was entered."""
        links = len(self._network.links)
        entries = np.zeros(links, np.int64)
        for piece in self._result.log.pieces("link"):
            entries += np.bincount(piece["link"], minlength=links)
        return entries


def blocks_at_hand(
    passages: Passages | None, result: Result, network: Network, links: Integers
) -> Iterator[tuple[Integers, Passages]]:
    """As :meth:`RunPassages.blocks`; one block where all passages are at hand.

    Raises :class:`uxsim_geo.errors.InputError` if those are of another result, or if this one is of
    another network.
    """
    if passages is None:
        yield from RunPassages(result, network).blocks(links)
        return
    if passages.log is not result.log:
        faults = Faults()
        what = "are those of another result: make them of this one, or leave them out"
        faults.add(what, column="passages")
        faults.raise_if_any()
    yield links, passages


def _needed_by(passages: Passages, vehicles: Booleans) -> Passages:
    """Passages of some vehicles, and of those whose exits they feel while they are on the link."""
    rows = np.flatnonzero(vehicles[passages.vehicle])
    unfelt = passages.first_unfelt_exit(rows, passages.enter[rows])
    begin = np.clip(unfelt - 1, passages.first[passages.link[rows]], rows)
    size = len(passages.link) + 1
    opened = np.bincount(begin, minlength=size) - np.bincount(rows + 1, minlength=size)
    kept = np.flatnonzero(np.cumsum(opened)[:-1] > 0)
    held_by = passages.held_by
    if held_by is not None:
        place = np.full(len(passages.link), -1)
        place[kept] = np.arange(len(kept))
        held_by = np.where(held_by[kept] >= 0, place[held_by[kept]], -1)
    return replace(
        passages,
        **{name: getattr(passages, name)[kept] for name in BY_PASSAGE},
        first=np.searchsorted(kept, passages.first),
        held_by=held_by,
    )


def _joined(parts: list[Passages]) -> Passages:
    """Passages of different links, in the order of these, as one."""
    columns: dict[str, Any] = {
        name: np.concatenate([getattr(part, name) for part in parts]) for name in BY_PASSAGE
    }
    held_by, before = [], 0
    for part in parts:
        if part.held_by is not None:
            held_by.append(np.where(part.held_by >= 0, part.held_by + before, -1))
        before += len(part.link)
    return replace(
        parts[0],
        **columns,
        first=np.searchsorted(columns["link"], np.arange(len(parts[0].first))),
        held_by=np.concatenate(held_by) if held_by else None,
    )
