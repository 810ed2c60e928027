"""The trip of one platoon: its speed over time, and the links it drove."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.samples import Samples
from uxsim_geo.network.network import Network

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_NAMES = 15  # of links, that do not cover one another


def vehicle_figure(
    network: Network, passages: Passages, samples: Samples, vehicle: int, duration: float
) -> Figure:
    """Draw the speed of a platoon (its row of the trips) over time, above the links it drove.

    ``duration`` is how far the simulation has come, s. Raises ValueError if it never entered a
    link.
    """
    from matplotlib.figure import Figure

    driven = np.flatnonzero(passages.vehicle == vehicle)
    if not driven.size:
        raise ValueError(f"vehicle {vehicle} has entered no link")
    driven = driven[np.argsort(passages.enter[driven], kind="stable")]
    own = np.flatnonzero(passages.vehicle[samples.row] == vehicle)
    own = own[np.argsort(samples.time[own], kind="stable")]
    figure = Figure(figsize=(7.0, 4.5), layout="constrained")
    speed, ways = figure.subplots(2, 1, sharex=True)
    speed.step(samples.time[own], samples.speed[own], where="post", color="#2b6fad")
    speed.set(title=f"vehicle {vehicle}", ylabel="speed, m/s", ylim=(0, None))
    names = network.links["link_id"].astype(str).to_numpy()[passages.link[driven]]
    begin, end = passages.enter[driven], np.minimum(passages.exit[driven], duration)
    ways.barh(np.arange(driven.size), end - begin, left=begin, color="#84bcd8")
    named = np.arange(0, driven.size, -(-driven.size // MOST_NAMES))
    ways.set_yticks(named, labels=list(names[named]))
    ways.set(xlabel="time, s", ylabel="link")
    for axes in (speed, ways):
        axes.grid(color="#e6e6e6", linewidth=0.6)
        axes.set_axisbelow(True)
    return figure
