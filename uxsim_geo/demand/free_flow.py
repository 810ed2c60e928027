"""Free-flow travel times between zones, by shortest paths between their access nodes."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.demand.access import Access
from uxsim_geo.demand.od_table import natural_order
from uxsim_geo.network.network import Network
from uxsim_geo.network.paths import Paths

Floats = npt.NDArray[np.float64]

#: numbers in the distances that are held at once
BLOCK = 10_000_000


class ZoneTimes(NamedTuple):
    """Travel times between zones.

    zones
        in natural order
    seconds
        shape (zones, zones), from the row to the column; NaN where no path leads, and from each
        zone to itself
    """

    zones: pd.Index[str]
    seconds: Floats


def free_flow_times(network: Network, access: Access) -> ZoneTimes:
    """Times between zones if every link is driven at its free speed, s.

    With access nodes i of share p_i and j of share q_j, t = Σ p_i q_j t_ij / Σ p_i q_j over the
    pairs of different nodes that a path connects: the mean of those who drive, as
    :func:`uxsim_geo.demand.od_loading.load_od` spreads them.
    """
    paths = Paths.of(network)
    links = network.links
    seconds = links["length"].to_numpy(np.float64) / links["free_speed"].to_numpy(np.float64)
    zones = pd.Index(natural_order(access.zones), dtype="str")
    ids = pd.Index(network.nodes["node_id"].astype("str"))
    start, starts = _shares(access.origins, zones, ids)
    end, ends = _shares(access.destinations, zones, ids)
    sums, weights = (np.zeros((len(zones), len(zones))) for _ in range(2))
    step = max(1, BLOCK // max(1, paths.node.size))
    for begin in range(0, len(start), step):
        part = slice(begin, begin + step)
        times = paths.shortest(seconds, start[part])[:, end]
        drive = np.isfinite(times) & (start[part, None] != end[None, :])
        sums += starts[:, part] @ (np.where(drive, times, 0.0) @ ends.T)
        weights += starts[:, part] @ (drive.astype(np.float64) @ ends.T)
    np.fill_diagonal(weights, 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        return ZoneTimes(zones, np.where(weights > 0, sums / weights, np.nan))


def _shares(
    table: pd.DataFrame, zones: pd.Index[str], ids: pd.Index[str]
) -> tuple[npt.NDArray[np.int64], Any]:
    """Nodes that serve any zone, ascending, and each zone's share of them; (zones, nodes)."""
    from scipy.sparse import csr_array

    place = ids.get_indexer(pd.Index(table["node"].astype("str")))
    nodes, column = np.unique(place, return_inverse=True)
    row = zones.get_indexer(pd.Index(table["zone"].astype("str")))
    share = table["share"].to_numpy(np.float64)
    shares = csr_array((share, (row, column)), shape=(len(zones), len(nodes)))
    return nodes.astype(np.int64), shares
