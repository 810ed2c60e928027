"""Where most time is lost: streets, or links where streets have no names, by their total delay."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd

from uxsim_geo.analysis.edie import ratio
from uxsim_geo.analysis.state_grid import StateGrid
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.export.street_names import street_names
from uxsim_geo.network.network import Network
from uxsim_geo.network.units import KMH, TIMES

#: rows of the table
MOST = 12

#: streets with less of all delay than this are left out
LEAST_SHARE = 0.0005


class WorstPlace(NamedTuple):
    """A street or link: what was lost there, and when it was at its worst.

    delay_veh_h (over the run), share (of all delay), bin (the page's with most delay), speed_kmh
    and speed_ratio (there and then), queue_m (the longest on one link), link (its row with most
    delay), links (how many it has).
    """

    name: str
    delay_veh_h: float
    share: float
    bin: int
    speed_kmh: float
    speed_ratio: float
    queue_m: float
    link: int
    links: int


def worst_places(grid: StateGrid, network: Network, first: Integers) -> list[WorstPlace]:
    """The :data:`MOST` streets with the largest delay, the worst one first, if any."""
    street, names = pd.factorize(street_names(network.links))
    distance, time, delay = (
        _by_street(np.add.reduceat(grid.values(name), first, axis=1), street, len(names))
        for name in ("distance", "time", "delay")
    )
    totals = delay.sum(axis=1)
    of_link = grid.values("delay").sum(axis=1)
    queue = grid.values("queue_length").max(axis=1)
    speed, relative = ratio(distance, time), 1.0 - ratio(delay, time)
    places = []
    for row in np.argsort(-totals, kind="stable")[:MOST]:
        if totals[row] <= LEAST_SHARE * totals.sum():
            break
        links = np.flatnonzero(street == row)
        peak = int(delay[row].argmax())
        places.append(
            WorstPlace(
                str(names[row]),
                float(totals[row] / TIMES["h"]),
                float(totals[row] / totals.sum()),
                peak,
                float(speed[row, peak] * KMH),
                float(relative[row, peak]),
                float(queue[links].max()),
                int(links[of_link[links].argmax()]),
                len(links),
            )
        )
    return places


def _by_street(values: Floats, street: Integers, streets: int) -> Floats:
    """Sums over the links of each street; shape (streets, bins)."""
    sums = np.zeros((streets, values.shape[1]))
    np.add.at(sums, street, values)
    return sums
