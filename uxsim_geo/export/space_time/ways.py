"""Ways of some vehicles in space and time, as lines."""

from __future__ import annotations

import numpy as np

from uxsim_geo.analysis.run_passages import RunPassages
from uxsim_geo.analysis.samples import Samples
from uxsim_geo.analysis.trajectories import LinkLines
from uxsim_geo.analysis.types import Floats
from uxsim_geo.export.map_plane import MapPlane
from uxsim_geo.network.network import Network

MOMENTS = 240  # between the beginning and the end of the run, beside every entry of a link


def sampled_ways(network: Network, run: RunPassages, most: int) -> list[Floats]:
    """Where some platoons were: points (n, 3) each, x and y on the projected map, time in s.

    Of more than ``most`` platoons that drove so many are shown, spread evenly over all. Their ways
    go through the start of every link that they entered. Raises ValueError if the network has no
    geometry.
    """
    drove = run.drove()
    if not drove.size or most < 1:
        return []
    chosen = drove[np.unique(np.linspace(0, len(drove) - 1, min(most, len(drove))).astype(int))]
    passages = run.around(np.isin(np.arange(drove[-1] + 1), chosen))
    rows = np.flatnonzero(np.isin(passages.vehicle, chosen))
    end = float(passages.end)
    moments = np.linspace(0.0, end, MOMENTS + 1)[1:]
    samples = Samples.at(passages, rows, moments, interval=end / MOMENTS, end=end)
    left = rows[passages.exit[rows] <= end]
    row = np.concatenate([rows, samples.row, left])
    length = passages.geometry.length[passages.link]
    share = np.concatenate(
        [np.zeros(len(rows)), samples.position / length[samples.row], np.ones(len(left))]
    )
    time = np.concatenate([passages.enter[rows], samples.time, passages.exit[left]])
    lines = LinkLines.of(MapPlane.of(network).lines)
    x, y = lines.points(passages.link[row], share)
    vehicle = passages.vehicle[row]
    order = np.lexsort((time, vehicle))
    points = np.stack([x, y, time], axis=1)[order]
    return np.split(points, np.flatnonzero(np.diff(vehicle[order])) + 1)
