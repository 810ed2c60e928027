"""Plots of a sweep: a figure of the runs against every parameter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from uxsim_geo.analysis.comparison.inference import half_width_of_mean
from uxsim_geo.analysis.types import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

RUN = "#9db7d5"
MEAN = "#1f4e84"
BASE = "#b5541c"

#: plots side by side, before another row begins
MOST_BESIDE = 3
#: points from which on a rank correlation says something
LEAST_RANKED = 5
SIZE = (4.4, 3.6)  # of one plot, inches


def sweep_figure(
    runs: pd.DataFrame, parameters: Sequence[str], figure: str, *, label: str, base: float | None
) -> Figure:
    """Draw a column of ``runs`` against each parameter.

    ``runs`` has a row a run: point (of the sweep), a column for every parameter, numbers or texts,
    and the figure. Light dots are runs, dark ones means of a point with the 95 % interval that
    its seeds give (Student's t); ``label`` names the figure with its unit, ``base`` is its mean
    without any change.
    """
    from matplotlib.figure import Figure

    beside = min(len(parameters), MOST_BESIDE)
    rows = -(-len(parameters) // beside)
    drawing = Figure(figsize=(SIZE[0] * beside, SIZE[1] * rows + 0.4), layout="constrained")
    grid = drawing.subplots(rows, beside, squeeze=False, sharey=True)
    for axes, name in zip(grid.flat, parameters, strict=False):
        _draw_parameter(axes, runs, name, figure)
        if base is not None:
            axes.axhline(base, color=BASE, linewidth=1.0, linestyle="--", label="base")
        axes.set_xlabel(name)
    for axes in list(grid.flat)[len(parameters) :]:
        axes.set_visible(False)
    for axes in grid[:, 0]:
        axes.set_ylabel(label)
    handles, labels = grid[0, 0].get_legend_handles_labels()
    drawing.legend(
        handles, labels, loc="outside lower center", ncols=3, frameon=False, fontsize="small"
    )
    return drawing


def _draw_parameter(axes: Axes, runs: pd.DataFrame, name: str, figure: str) -> None:
    place, ticks = _places(runs[name])
    values = runs[figure].to_numpy(np.float64)
    axes.plot(place, values, "o", color=RUN, markersize=3.5, label="a run", zorder=2)
    means = pd.DataFrame({"point": runs["point"], "place": place, "value": values})
    of_points = means.groupby("point", sort=True)
    place_of = of_points["place"].first().to_numpy(np.float64)
    mean = of_points["value"].mean().to_numpy(np.float64)
    style: dict[str, Any] = {"fmt": "o", "color": MEAN, "markersize": 5, "capsize": 3, "zorder": 3}
    axes.errorbar(place_of, mean, _half_widths(means), label="mean, 95 %", **style)
    if ticks is None and mean.size >= LEAST_RANKED:
        axes.set_title(f"rank correlation {_rank_correlation(place_of, mean)}", fontsize="small")
    if ticks is not None:
        axes.set_xticks(range(len(ticks)), ticks)
        axes.margins(x=0.2)
    axes.grid(color="#e6e6e6", linewidth=0.6)
    axes.set_axisbelow(True)


def _places(column: pd.Series) -> tuple[Floats, list[str] | None]:
    """Return where the values stand on an axis; texts one beside the other, with their names."""
    if pd.api.types.is_numeric_dtype(column) and not pd.api.types.is_bool_dtype(column):
        return column.to_numpy(np.float64), None
    texts = column.astype(str)
    names = list(dict.fromkeys(texts))
    return np.array([names.index(text) for text in texts], np.float64), names


def _rank_correlation(place: Floats, mean: Floats) -> str:
    """Return Spearman's coefficient in words; none where one of both never changes."""
    from scipy.stats import spearmanr

    if np.ptp(place) == 0 or np.ptp(mean) == 0:
        return "none: nothing changes"
    return f"{spearmanr(place, mean).statistic:+.2f}".replace("-", "−")


def _half_widths(means: pd.DataFrame) -> Floats:
    """Return half the 95 % interval of each mean; 0 where one run says nothing of its spread."""
    groups = means.groupby("point", sort=True)["value"]
    return np.nan_to_num([half_width_of_mean(values) for _, values in groups])
