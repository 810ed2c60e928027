"""Junctions before which time is lost: a city's map shows circles there, but no short links."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pandas as pd

from uxsim_geo.analysis.state_grid import StateGrid
from uxsim_geo.analysis.types import Integers
from uxsim_geo.network.network import Network

#: junctions that never lose so much of what the worst one loses in a bin are left out
LEAST_SHARE = 0.02


class Bottlenecks(NamedTuple):
    """nodes (rows of the nodes table), links (their approaches), largest (delay of one bin, veh·s).

    links holds for every link the place of its end in ``nodes``, −1: not among them.
    """

    nodes: Integers
    links: Integers
    largest: float


def bottlenecks(grid: StateGrid, network: Network, first: Integers) -> Bottlenecks:
    """Nodes by the delay on the links that lead to them, in the page's time bins."""
    delay = np.add.reduceat(grid.values("delay"), first, axis=1)
    rows = pd.Index(network.nodes["node_id"].astype(str))
    end = rows.get_indexer(pd.Index(network.links["to_node_id"].astype(str)))
    sums = np.zeros((len(rows), delay.shape[1]))
    np.add.at(sums, end, delay)
    worst = sums.max(axis=1)
    largest = float(worst.max(initial=0.0))
    nodes = np.flatnonzero(worst > LEAST_SHARE * largest)
    place = np.full(len(rows), -1, np.int64)
    place[nodes] = np.arange(len(nodes))
    return Bottlenecks(nodes, place[end], largest)
