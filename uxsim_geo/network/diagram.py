"""The triangular fundamental diagram of links (Newell 1993, with the parameters of Seo 2023)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pandas as pd

STORAGE_DIGITS = 6


def storage(links: pd.DataFrame, platoon_size: int) -> npt.NDArray[np.float64]:
    """L m κ, the vehicles that stand on each link, but a platoon at least; shape (links,).

    length L, lanes m and jam_density κ are columns of ``links``. What is whole on paper is whole
    here: a hair less would cost a whole platoon.
    """
    length, lanes, density = (
        links[name].to_numpy(np.float64) for name in ("length", "lanes", "jam_density")
    )
    spacing = 1.0 / (lanes * density)
    vehicles: npt.NDArray[np.float64] = np.maximum(
        platoon_size, np.round(length / spacing, STORAGE_DIGITS)
    )
    return vehicles


def diagram_capacity(links: pd.DataFrame, reaction_time: float) -> npt.NDArray[np.float64]:
    """Q = m u κ / (1 + u τ κ), the top of the diagram of each whole link, veh/s; shape (links,).

    ``reaction_time`` is τ, s; lanes m, free_speed u and jam_density κ are columns of ``links``.
    """
    speed, lanes, density = (
        links[name].to_numpy(np.float64) for name in ("free_speed", "lanes", "jam_density")
    )
    resistance = 1.0 + speed * reaction_time * density
    capacity: npt.NDArray[np.float64] = lanes * speed * density / resistance
    return capacity


def effective_capacity(links: pd.DataFrame, reaction_time: float) -> npt.NDArray[np.float64]:
    """The capacity that holds, veh/s: the one given, if any, but no more than the diagram's."""
    given = links["capacity"].to_numpy(np.float64)
    capacity: npt.NDArray[np.float64] = np.fmin(given, diagram_capacity(links, reaction_time))
    return capacity
