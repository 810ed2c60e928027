"""Where the weights of destinations are kept: each has a lane of a batch, of its drivers alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from uxsim_geo.demand.platoons import Ints
from uxsim_geo.engine.records import LANES

Records = npt.NDArray[Any]


def give_slots(destination: Records, rank: Ints) -> int:
    """Give destinations that have none their slots; returns the number of batches there are now.

    The slot is batch · LANES + lane. Lanes that are left in batches of the same drivers are taken
    first. ``rank`` is by which nodes are best ordered: those that stand together go into one batch.
    """
    slot = destination["slot"]
    batches = int(slot.max(initial=-1)) // LANES + 1
    without = (slot < 0) & (destination["given"] == 0)
    for driver in np.unique(destination["driver"][without]):
        ours = destination["driver"] == driver
        taken = slot[ours & (slot >= 0)]
        new = np.flatnonzero(ours & without)
        new = new[np.argsort(rank[destination["node"][new]], kind="stable")]
        free = np.setdiff1d(_all_slots(np.unique(taken // LANES)), taken)
        more = -(-max(new.size - free.size, 0) // LANES)
        free = np.concatenate([free, _all_slots(np.arange(batches, batches + more))])
        slot[new] = free[: new.size]
        batches += more
    return batches


def _all_slots(batches: Ints) -> Ints:
    slots: Ints = (batches[:, None] * LANES + np.arange(LANES)).ravel()
    return slots


def wanted_lanes(destination: Records) -> tuple[Ints, npt.NDArray[np.int32]]:
    """List the batches of destinations to which ways are wanted, and whose each lane is; -1: none.

    Shapes: (batches,) and (batches, LANES).
    """
    place = np.flatnonzero(destination["wanted"])
    batch, row = np.unique(destination["slot"][place] // LANES, return_inverse=True)
    own = np.full((batch.size, LANES), -1, np.int32)
    own[row, destination["slot"][place] % LANES] = place
    return batch.astype(np.int64), own
