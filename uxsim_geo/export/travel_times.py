"""How long trips took: the distribution of the travel times of those who arrived."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from uxsim_geo.analysis.groups import Groups
from uxsim_geo.analysis.types import Floats
from uxsim_geo.export.map_plane import round_below
from uxsim_geo.export.map_sheet import in_words
from uxsim_geo.network.units import TIMES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BARS = 40  # at least, if the longest trip is not much longer than the others
MARKS = ((50, "median", "-"), (95, "95th percentile", "--"))
TAKEN, FREE = "#84bcd8", "#5f5f5f"
MARK = "#8c0d25"


def travel_times_figure(
    trips: pd.DataFrame, title: str, *, duration: float = np.inf, free_flow: bool = True
) -> Figure:
    """Histogram of experienced travel times, from the wish to depart to the arrival.

    ``trips`` are those of a :class:`uxsim_geo.result.Result`, or some of them. A platoon counts by
    its vehicles. Median and 95th percentile are those times within which that share of the
    vehicles arrived; of those who have departed by ``duration``, s, the end of the simulation, and
    have not arrived, the figure says how many they are. With
    ``free_flow`` the times of the same trips on empty roads stand beside.
    """
    from matplotlib.figure import Figure

    done = trips[(trips["status"] == "completed").to_numpy()]
    vehicles = done["vehicles"].to_numpy(float)
    minutes = (done["arrive_s"] - done["depart_s"]).to_numpy(float) / TIMES["min"]
    free = done["free_time_s"].to_numpy(float) / TIMES["min"]
    figure = Figure(figsize=(7.0, 4.6), layout="constrained")
    axes = figure.add_subplot()
    edges = _edges(np.concatenate([minutes, free]) if free_flow else minutes)
    bars: dict[str, Any] = {"bins": edges, "weights": vehicles}
    axes.hist(minutes, color=TAKEN, label="experienced", **bars)
    if free_flow and len(done):
        style: dict[str, Any] = {
            "histtype": "step",
            "color": FREE,
            "linewidth": 1.2,
            "label": "at free flow",
        }
        axes.hist(free, **bars, **style)
    _mark(axes, minutes, vehicles)
    axes.set(xlabel="travel time, min", ylabel=f"vehicles per {edges[1]:g} min")
    axes.set(xlim=(0, edges[-1]), ylim=(0, None))
    axes.set_title(f"{title}\n", loc="left")
    axes.text(
        0.0,
        1.02,
        _absent(trips[trips["depart_s"].to_numpy(float) <= duration]),
        transform=axes.transAxes,
        fontsize="small",
    )
    axes.grid(color="#e6e6e6", linewidth=0.6)
    axes.set_axisbelow(True)
    if len(done):
        # beside the axes: there is no corner that every distribution leaves free
        figure.legend(loc="outside lower center", ncols=4, frameon=False, fontsize="small")
    return figure


def _edges(minutes: Floats) -> Floats:
    """Edges of the bars, min: multiples of a round number, up to the longest time."""
    longest = max(float(minutes.max(initial=0.0)), 1e-3) if minutes.size else 1.0
    width = round_below(longest / BARS)
    edges: Floats = np.arange(int(np.ceil(longest / width * (1 + 1e-12))) + 1) * np.float64(width)
    return edges


def _mark(axes: Axes, minutes: Floats, vehicles: Floats) -> None:
    """Lines at the percentiles, with their values in the legend."""
    if not minutes.size:
        axes.text(0.5, 0.5, "nobody has arrived", transform=axes.transAxes, ha="center")
        return
    everybody = Groups((np.zeros(1, np.int64),), np.zeros(len(minutes), np.int64))
    found = everybody.percentiles(minutes, vehicles, [percent for percent, *_ in MARKS])
    for (_, name, style), (value,) in zip(MARKS, found, strict=True):
        axes.axvline(value, color=MARK, linestyle=style, label=f"{name}: {value:,.1f} min")


def _absent(trips: pd.DataFrame) -> str:
    """Say how many vehicles the histogram holds, and of how many nothing is known."""
    by_status = trips["vehicles"].groupby(trips["status"].astype(str)).sum()
    completed, aborted = (int(by_status.get(name, 0)) for name in ("completed", "aborted"))
    unfinished = int(by_status.sum()) - completed - aborted
    parts = [f"{in_words(completed, 'vehicle')} arrived"]
    parts += [f"{unfinished:,} had not arrived by the end"] if unfinished else []
    parts += [f"{aborted:,} gave up"] if aborted else []
    return "; ".join(parts)
