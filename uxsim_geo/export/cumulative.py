"""Cumulative curves of a link: vehicles that have entered and left it over time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from uxsim_geo.analysis.cumulative import curves_of_passages
from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.subsets import rows_in_order
from uxsim_geo.export.corridor import note_nobody
from uxsim_geo.network.network import Network

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: column of the table, label, colour, line style
CURVES = (
    ("entries", "entered", "#2b6fad", "-"),
    ("virtual_departures", "would have left at free flow", "#5f5f5f", "--"),
    ("exits", "left", "#e0592a", "-"),
)
QUEUE = "#f9ded5"


def cumulative_figure(
    network: Network,
    passages: Passages,
    link_id: str,
    duration: float,
    size: tuple[float, float] = (6.0, 4.0),
) -> Figure:
    """Draw the numbers of vehicles that have entered and left a link, and those that queue between.

    ``duration`` is how far the simulation has come, s; ``size`` in inches. Raises
    :class:`uxsim_geo.errors.InputError` if the link is not in the network.
    """
    from matplotlib.figure import Figure

    (link,) = rows_in_order(network, [link_id])
    table = curves_of_passages(passages, int(link))
    time = table["time_s"].to_numpy()
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.add_subplot()
    low, high = table["exits"].to_numpy(), table["virtual_departures"].to_numpy()
    axes.fill_between(time, low, high, step="post", color=QUEUE, linewidth=0, label="queue")
    for name, label, colour, style in CURVES:
        axes.step(time, table[name], where="post", color=colour, linestyle=style, label=label)
    axes.set(title=f"link {link_id}", xlabel="time, s", ylabel="vehicles since the start")
    axes.set(xlim=(0, duration), ylim=(0, None))
    axes.grid(color="#e6e6e6", linewidth=0.6)
    if not table["entries"].any():
        note_nobody(axes)
    # beside the axes: there is no corner that the curves of every link leave free
    figure.legend(loc="outside lower center", ncols=4, frameon=False, fontsize="small")
    return figure
