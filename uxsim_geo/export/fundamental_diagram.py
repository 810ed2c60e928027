"""Measured states of links against the triangular diagram that each of them is given."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from uxsim_geo.analysis.subsets import rows_in_order
from uxsim_geo.analysis.types import Floats
from uxsim_geo.errors import Fault, InputError
from uxsim_geo.export.corridor import note_nobody
from uxsim_geo.network.diagram import diagram_capacity, effective_capacity
from uxsim_geo.network.network import Network
from uxsim_geo.network.units import PER_HOUR, PER_KM

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: of Okabe and Ito, apart for readers with any kind of colour blindness
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#000000")
SHARED = "#5f5f5f"
MARKERS = ("o", "^", "s")
MOST_LINKS = len(COLOURS) * len(MARKERS)  # that can be told apart


def fundamental_diagram_figure(
    network: Network,
    states: pd.DataFrame,
    link_ids: Sequence[str],
    reaction_time: float,
    title: str,
) -> Figure:
    """Flow against density of some links, one point a time bin, with the diagram of each link.

    ``states`` comes from :func:`uxsim_geo.analysis.link_states.link_times`. Diagrams are those of
    whole links: up at free speed u to the capacity Q = m u κ / (1 + u τ κ), down to the jam
    density m κ, cut off (dashed) where a lower capacity is given. ``reaction_time`` is τ, s. Raises
    :class:`uxsim_geo.errors.InputError` if a link is not in the network, or for more links than can
    be told apart.
    """
    from matplotlib.figure import Figure

    if len(link_ids) > MOST_LINKS:
        what = f"at most {MOST_LINKS} links can be told apart"
        raise InputError([Fault(what, column="links", value=len(link_ids))])
    rows = rows_in_order(network, link_ids)
    figure = Figure(figsize=(7.0, 5.2), layout="constrained")
    axes = figure.add_subplot()
    _draw_diagrams(axes, network.links.iloc[rows], reaction_time)
    for number, name in enumerate(link_ids):
        own = states[states["link_id"].astype(str) == name]
        # points at zero stand on the axes, whole
        style: dict[str, Any] = {"s": 22, "linewidths": 0.4, "zorder": 3, "clip_on": False}
        style |= {"marker": MARKERS[number // len(COLOURS)], "c": COLOURS[number % len(COLOURS)]}
        points = own["density"] * PER_KM, own["flow"] * PER_HOUR
        axes.scatter(*points, edgecolors="white", label=f"link {name}", **style)
    axes.set(title=title, xlim=(0, None), ylim=(0, None))
    axes.set(xlabel="density, veh/km of the link", ylabel="flow, veh/h of the link")
    axes.grid(color="#e6e6e6", linewidth=0.6)
    axes.set_axisbelow(True)
    chosen = states["link_id"].astype(str).isin(list(link_ids))
    if not (states["time"].to_numpy(float)[chosen] > 0).any():
        note_nobody(axes)
    columns = min(len(axes.get_legend_handles_labels()[1]), 4)
    figure.legend(loc="outside lower center", ncols=columns, frameon=False, fontsize="small")
    return figure


def _draw_diagrams(axes: Axes, links: pd.DataFrame, reaction_time: float) -> None:
    """Draw each diagram once: in the colour of its link, or grey if it is that of several."""
    top, given = diagram_capacity(links, reaction_time), effective_capacity(links, reaction_time)
    speed = links["free_speed"].to_numpy(float)
    jam = (links["lanes"] * links["jam_density"]).to_numpy(float)
    shapes = np.stack([speed, jam, top, given], axis=1)
    unique, link = np.unique(shapes, axis=0, return_inverse=True)
    labels: dict[str, str | None] = {"diagram": "own diagram", "given": "capacity given"}
    for number, (u, m_kappa, Q, capacity) in enumerate(unique):
        (own,) = np.nonzero(link == number)
        style: dict[str, Any] = {
            "color": COLOURS[own[0] % len(COLOURS)] if own.size == 1 else SHARED
        }
        density = np.array([0.0, Q / u, m_kappa])
        _line(axes, density, np.array([0.0, Q, 0.0]), label=labels.pop("diagram", None), **style)
        if capacity < Q:  # both branches at that flow
            ends = np.array([capacity / u, m_kappa - capacity / Q * (m_kappa - Q / u)])
            style |= {"linestyle": "--", "label": labels.pop("given", None)}
            _line(axes, ends, np.full(2, capacity), **style)


def _line(axes: Axes, density: Floats, flow: Floats, **style: Any) -> None:
    axes.plot(density * PER_KM, flow * PER_HOUR, linewidth=1.2, zorder=2, **style)
