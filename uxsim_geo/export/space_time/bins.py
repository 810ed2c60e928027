"""States in fewer and longer time bins, as many as a picture of space and time can show."""

from __future__ import annotations

import numpy as np
import pandas as pd

from uxsim_geo.analysis.edie import ratio
from uxsim_geo.analysis.state_grid import StateGrid, States
from uxsim_geo.network.network import Network

MOST_BINS = 36  # of shorter ones traffic lights make stripes that hide the queues


def coarser(states: States, network: Network) -> States:
    """States in bins of which each joins as many as make at most 36; the same if they are so few.

    Sums are those of the bins together, density is their mean by time, speed their distance over
    their time, and queues are those at the end of the last. Columns that a scene does not need are
    left out.
    """
    grid = StateGrid.of_all(states, network)
    bins = len(grid.begin)
    if bins <= MOST_BINS:
        return states
    first = np.arange(0, bins, -(-bins // MOST_BINS))
    last = np.append(first[1:], bins) - 1
    begin, end = grid.begin[first], grid.end[last]
    sums = {
        name: np.add.reduceat(grid.values(name), first, axis=1)
        for name in ("distance", "time", "delay")
    }
    inside = np.add.reduceat(grid.values("density") * (grid.end - grid.begin), first, axis=1)
    columns = sums | {
        "density": inside / (end - begin),
        "queue": grid.values("queue")[:, last],
        "queue_length": grid.values("queue_length")[:, last],
    }
    links = len(grid.link_ids)
    times = {"begin_s": np.tile(begin, links), "end_s": np.tile(end, links)}
    codes = np.repeat(np.arange(links), len(first))
    link_id = pd.Categorical.from_codes(codes, categories=grid.link_ids)
    flat = {name: values.ravel() for name, values in columns.items()}
    flat["speed"] = ratio(flat["distance"], flat["time"])
    return pd.DataFrame({"link_id": link_id} | times | flat)
