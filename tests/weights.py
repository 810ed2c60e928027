"""The weights B of a run, as the formula of its updates has them."""

from __future__ import annotations

import numpy as np

from uxsim_geo.engine.population import weight_of_update
from uxsim_geo.engine.simulation import Simulation


def weights_of(run: Simulation) -> np.ndarray:
    """Shape (destinations, arcs): λ (1−λ)^k of every update k back, the oldest known with the rest.

    Where no updates are kept, the weights that are.
    """
    routes, share = run.world.routes, weight_of_update(run.settings)
    slot, bytes_each = routes.destination["slot"][:-1], len(routes.worth)
    batch, lane = slot // 64, slot % 64
    if bytes_each == 0:
        return np.asarray(routes.weight[batch, :, lane].astype(float))
    found = np.zeros((slot.size, routes.arc.size))
    last = 8 * bytes_each - 1
    for back in range(last + 1):
        kept = routes.history[batch * bytes_each + back // 8, :, lane]
        was_on_tree = (kept >> (7 - back % 8)) & 1
        found += was_on_tree * (1 - share) ** back * (share if back < last else 1.0)
    return found
