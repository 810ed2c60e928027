"""Batches of destinations shared out among threads."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from uxsim_geo.engine.records import LANES, Lanes

#: what is done with the batch of a row; False: it cannot be done
Work = Callable[[Lanes, int], bool]


def room_for(vertices: int, *, ways: bool = False, lanes: int = LANES) -> Lanes:
    """Make room in which a thread works on a batch; with room for ``ways`` if need be."""
    on_ways = vertices if ways else 0
    return Lanes(
        own=np.full(lanes, -1, np.int32),
        distance=np.empty((vertices, lanes), np.int32),
        nearer=np.empty(lanes, np.int32),
        fresh=np.empty(lanes, np.uint8),
        idle=np.empty(lanes, np.uint8),
        toward=np.empty((on_ways, lanes), np.int32),
        time=np.empty(on_ways),
        passed=np.empty(on_ways, np.int32),
    )


def share_out(rooms: Sequence[Lanes], own: npt.NDArray[np.int32], work: Work) -> list[int]:
    """Do the work of all batches, (batches, LANES), a thread a room; returns what was not done."""
    left = deque(range(len(own)))
    refused: list[int] = []

    def take_part(room: Lanes) -> None:
        while True:
            try:
                row = left.popleft()
            except IndexError:
                return
            room.own[:] = own[row]
            if not work(room, row):
                refused.append(row)

    if len(rooms) == 1:
        take_part(rooms[0])
    else:
        from concurrent.futures import ThreadPoolExecutor

        with ThreadPoolExecutor(len(rooms)) as pool:
            list(pool.map(take_part, rooms))
    return sorted(refused)
