"""States of links as small integers: what the page's map, hover texts and curves are made from.

Three numbers a link and bin are enough. With density k, speed v, length L and bin length T the
rest follows exactly (Edie 1963): flow q = k v, and delay = L T k (1 − v / u), u the free speed.
Density runs over orders of magnitude and is stored by its logarithm, v / u and the queue's share
of the link as they are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from uxsim_geo.analysis.edie import ratio
from uxsim_geo.analysis.state_grid import StateGrid
from uxsim_geo.analysis.types import Booleans, Floats, Integers
from uxsim_geo.network.network import Network
from uxsim_geo.network.units import PER_HOUR, PER_KM, TIMES

#: with more cells than this a page would be too large: bins are put together
MOST_CELLS = 12_000_000

#: up to so many cells are told within 0.1 %, more of them within 3 %
MOST_FINE_CELLS = 600_000

#: the least density that is told apart from lower ones, as a share of the largest
LEAST_SHARE = 1e-5


@dataclass(frozen=True)
class Levels:
    """Codes of links × bins, and what they mean.

    edges
        of the bins, s
    density
        0: nobody; else with top the largest code of its type and ``least`` and ``largest`` in
        veh/m: least · (largest / least) ** ((code − 1) / (top − 1))
    speed, queue
        speed / free speed and queue length / link length, each times top; where nobody is, the
        speed is that of the bin before, which takes no room
    values
        of the cells in which somebody was: volume (veh/h), density (veh/km), delay (veh·min) and
        queue (m), to choose classes by
    """

    edges: Floats
    density: npt.NDArray[Any]
    speed: npt.NDArray[Any]
    queue: npt.NDArray[Any]
    least: float
    largest: float
    values: Mapping[str, Floats]

    @property
    def top(self) -> int:
        """The largest code."""
        return int(np.iinfo(self.density.dtype).max)


def levels(grid: StateGrid, network: Network, first: Integers) -> Levels:
    """Codes of all links of a network; ``first`` is what :func:`first_of_merged` says."""
    sums = _Sums.of(grid, network, first)
    dtype = np.uint16 if sums.time.size <= MOST_FINE_CELLS else np.uint8
    top = int(np.iinfo(dtype).max)
    density = sums.time / sums.area
    largest = float(density.max(initial=0.0)) or 1.0
    least = max(float(density[density > 0].min(initial=largest)), LEAST_SHARE * largest)
    codes = _logarithmic(density, least, largest, top)
    speed = _linear(ratio(sums.distance, sums.time) / sums.free_speed, top)
    return Levels(
        np.append(grid.begin[first], grid.end[-1]),
        codes.astype(dtype),
        _carried_on(speed, codes > 0).astype(dtype),
        _linear(sums.queue / sums.length, top).astype(dtype),
        least,
        largest,
        sums.values_where(codes > 0),
    )


def first_of_merged(grid: StateGrid, most_cells: int = MOST_CELLS) -> Integers:
    """The first bin of each of the page's: every bin, or several together where there are many."""
    links, bins = len(grid.link_ids), len(grid.begin)
    together = int(np.ceil(links * bins / most_cells))
    return np.arange(0, bins, max(together, 1))


class _Sums(NamedTuple):
    """Of links × bins of the page: distance, time, delay, queue length, and length × bin length.

    length and free_speed have one column. SI units.
    """

    distance: Floats
    time: Floats
    delay: Floats
    queue: Floats
    area: Floats
    length: Floats
    free_speed: Floats

    @classmethod
    def of(cls, grid: StateGrid, network: Network, first: Integers) -> _Sums:
        distance, time, delay = (
            np.add.reduceat(grid.values(name), first, axis=1)
            for name in ("distance", "time", "delay")
        )
        queue = np.maximum.reduceat(grid.values("queue_length"), first, axis=1)
        length, free = (
            network.links[name].to_numpy(float)[:, None] for name in ("length", "free_speed")
        )
        edges = np.append(grid.begin[first], grid.end[-1])
        return cls(distance, time, delay, queue, length * np.diff(edges), length, free)

    def values_where(self, busy: Booleans) -> dict[str, Floats]:
        return {
            "volume": (self.distance[busy] / self.area[busy]) * PER_HOUR,
            "density": (self.time[busy] / self.area[busy]) * PER_KM,
            "delay": self.delay[busy] / TIMES["min"],
            "queue": self.queue[busy],
        }


def _logarithmic(values: Floats, least: float, largest: float, top: int) -> Integers:
    span = np.log(largest / least) or 1.0
    with np.errstate(divide="ignore"):
        share = np.log(values / least) / span
    codes = 1 + np.round(np.clip(share, 0.0, 1.0) * (top - 1))
    return np.where(values > 0, codes, 0).astype(np.int64)


def _linear(share: Floats, top: int) -> Integers:
    return np.round(np.clip(np.nan_to_num(share), 0.0, 1.0) * top).astype(np.int64)


def _carried_on(codes: Integers, known: Booleans) -> Integers:
    """Codes with each unknown one replaced by the last known one of its row, else by 0."""
    last = np.maximum.accumulate(np.where(known, np.arange(codes.shape[1]), -1), axis=1)
    carried: Integers = np.where(
        last >= 0, np.take_along_axis(codes, np.maximum(last, 0), axis=1), 0
    )
    return carried
