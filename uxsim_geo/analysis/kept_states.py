"""States of links in time bins, kept where anything happened: tables are made of them in parts.

On a large network most links are empty most of the time, and a table of all of them takes more
memory than the run itself. So what states follow from is kept for the cells that are not empty,
and a table is made for as many links or bins as somebody needs at a time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from uxsim_geo.analysis.cell_sums import EXPERIENCED, Observed
from uxsim_geo.analysis.edie import edie_states
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.network.diagram import effective_capacity
from uxsim_geo.network.network import Network

#: share of the free speed at which standing traffic counts as moving, as in route choice
STANDSTILL = 0.01

#: cells of links × bins that are worked out together
AT_ONCE = 1_000_000

#: of the table, in their order
COLUMNS = (
    *("link_id", "begin_s", "end_s", "entries", "exits", "distance", "time"),
    *("flow", "density", "speed", "delay", EXPERIENCED, "instantaneous_travel_time"),
    *("queue", "queue_length", "spillback_share", "volume_to_capacity"),
)

EVERYTHING = slice(None)


@dataclass(frozen=True)
class LinkStates:
    """States of some links in some time bins; cells are numbered link by link, bins within.

    ids (of all links of the network), rows (which of them, ascending), length (m), free_speed
    (m/s), capacity (veh/s): of these; edges (of the bins, s); cell (numbers of those that are not
    empty, ascending); sums (of those cells, by name: what the other columns follow from).
    """

    ids: pd.Index
    rows: Integers
    length: Floats
    free_speed: Floats
    capacity: Floats
    edges: Floats
    cell: Integers
    sums: dict[str, Floats]

    @classmethod
    def of(
        cls,
        observed: Iterable[tuple[Integers, Observed]],
        network: Network,
        edges: Floats,
        reaction_time: float,
    ) -> LinkStates:
        """Work out the sums for links (rows of the table), some after the others."""
        bins, cells, parts, links = len(edges) - 1, [], [], []
        first = 0
        for own, seen in observed:
            for part in _blocks(len(own), bins):
                sums = seen.sums(own[part])
                counted = [values for name, values in sums.items() if name != EXPERIENCED]
                there = np.flatnonzero(np.any(counted, axis=0))
                cells.append(there + (first + part.start) * bins)
                parts.append({name: values[there] for name, values in sums.items()})
            links.append(own)
            first += len(own)
            del seen  # before the next are made
        rows = np.concatenate(links)
        length, free = (network.links[name].to_numpy(float) for name in ("length", "free_speed"))
        return cls(
            pd.Index(network.links["link_id"].astype(str)),
            rows,
            length[rows],
            free[rows],
            effective_capacity(network.links, reaction_time)[rows],
            edges,
            np.concatenate(cells),
            {name: np.concatenate([sums[name] for sums in parts]) for name in parts[0]},
        )

    @property
    def bins(self) -> int:
        """How many there are."""
        return len(self.edges) - 1

    def values(self, column: str) -> Floats:
        """A column of numbers of the table; shape (links, bins)."""
        if column in self.sums:
            return self._whole(EVERYTHING, EVERYTHING)(column)
        found = np.empty((len(self.rows), self.bins))
        for part in _blocks(*found.shape):
            found[part] = self.table(part)[column].to_numpy().reshape(-1, self.bins)
        return found

    def table(self, links: slice = EVERYTHING, bins: slice = EVERYTHING) -> pd.DataFrame:
        """The table that :func:`uxsim_geo.analysis.link_states.link_times` describes, or a part."""
        row = np.arange(len(self.rows))[links]
        begin, end = self.edges[:-1][bins], self.edges[1:][bins]
        whole = self._whole(links, bins)
        sums = {name: whole(name).ravel() for name in self.sums}
        full = sums.pop("full")
        length, free, capacity = (
            np.repeat(values[row], len(begin))
            for values in (self.length, self.free_speed, self.capacity)
        )
        duration = np.tile(end - begin, len(row))
        states = edie_states(sums["distance"], sums["time"], length * duration)
        speed = states["speed"]
        moving = np.where(np.isnan(speed), free, np.clip(speed, STANDSTILL * free, free))
        codes = np.repeat(self.rows[row], len(begin))
        columns = {
            "link_id": pd.Categorical.from_codes(codes, categories=self.ids),
            "begin_s": np.tile(begin, len(row)),
            "end_s": np.tile(end, len(row)),
            **sums,
            **states,
            "instantaneous_travel_time": length / moving,
            "spillback_share": np.minimum(full / duration, 1.0),
            "volume_to_capacity": states["flow"] / capacity,
        }
        return pd.DataFrame({name: columns[name] for name in COLUMNS})

    def _whole(self, links: slice, bins: slice) -> Callable[[str], Floats]:
        """What gives sums of cells by name, the empty ones too; shape (links, bins)."""
        first, last, _ = links.indices(len(self.rows))
        begin, end, _ = bins.indices(self.bins)
        low, high = np.searchsorted(self.cell, [first * self.bins, last * self.bins])
        link, bin_ = np.divmod(self.cell[low:high] - first * self.bins, self.bins)
        inside = np.flatnonzero((bin_ >= begin) & (bin_ < end))
        place = (link[inside], bin_[inside] - begin)

        def whole(name: str) -> Floats:
            empty = np.nan if name == EXPERIENCED else 0.0
            values = np.full((last - first, end - begin), empty)
            values[place] = self.sums[name][low:high][inside]
            return values

        return whole


def _blocks(links: int, bins: int) -> Iterator[slice]:
    """Parts of the links with no more than :data:`AT_ONCE` cells, or of one link."""
    together = max(AT_ONCE // bins, 1)
    for first in range(0, links, together):
        yield slice(first, min(first + together, links))
