"""Trips between zones, as the page tells of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd

from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.export.trip_ends import TripEnds
from uxsim_geo.network.network import Network

#: pairs that the page keeps, the largest
MOST_PAIRS = 20_000


class Zones(NamedTuple):
    """Zones with trips, and the pairs between them from the largest on.

    kind (what a zone is, in words), names, points (degrees), origin, destination (rows of names),
    vehicles (demanded), delay (mean of those departed, s), pairs (how many there are, also those
    left out)
    """

    kind: str
    names: list[str]
    points: Floats
    origin: Integers
    destination: Integers
    vehicles: Floats
    delay: Floats
    pairs: int


def zones(network: Network, points: Floats, od: pd.DataFrame) -> Zones:
    """Sum the pairs of nodes of :func:`uxsim_geo.analysis.od.od_table` over zones.

    ``points`` are the nodes' places in degrees.
    """
    ends = TripEnds.of(network, od)
    pairs = ends.pairs()
    vehicles, departed, delay = (
        pairs.total(od[name].to_numpy(float))
        for name in ("vehicles_demanded", "vehicles_departed", "total_delay_so_far_veh_s")
    )
    kept = np.argsort(-vehicles, kind="stable")[:MOST_PAIRS]
    origin, destination = (key[kept] for key in pairs.keys)
    return Zones(
        ends.kind,
        ends.names,
        ends.points(points),
        origin,
        destination,
        vehicles[kept],
        (delay / np.maximum(departed, 1e-9))[kept],
        len(pairs),
    )
