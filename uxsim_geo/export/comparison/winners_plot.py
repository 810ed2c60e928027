"""Plot of winners and losers: how travel times change, and who gains and who loses."""

from __future__ import annotations

from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from uxsim_geo.analysis.comparison.numbers import percent
from uxsim_geo.export.comparison.changes import BETTER, HARDLY, WORSE
from uxsim_geo.export.comparison.plots import literal
from uxsim_geo.export.comparison.rows import span_in_words
from uxsim_geo.export.comparison.study import Scenario, comparison_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def winners_figure(entry: Scenario) -> Figure:
    """Distribution of the change of travel times, and the shares that gain and that lose."""
    from matplotlib.figure import Figure

    found = comparison_of(entry)
    table = found.trip_changes
    figure = Figure(figsize=(9.0, 4.6), layout="constrained")
    axes = figure.add_subplot()
    shares = 100 * table["share"].fillna(0.0).to_numpy(float)
    colours = [
        BETTER[1] if to_s <= 0 else WORSE[1] if from_s >= 0 else HARDLY
        for from_s, to_s in zip(table["from_s"], table["to_s"], strict=True)
    ]
    places = np.arange(len(table))
    axes.bar(places, shares, width=0.94, color=colours)
    for place, share in zip(places, shares, strict=True):
        axes.annotate(percent(share), (place, share), ha="center", va="bottom", fontsize=7)
    words = [
        "\n".join(wrap(span_in_words(low, high), 6))
        for low, high in zip(table["from_s"], table["to_s"], strict=True)
    ]
    axes.set_xticks(places, words, fontsize=7)
    axes.set(ylabel="% of those who arrived in both runs", xlabel="change of travel time")
    axes.set_title(
        literal(f"{entry.name}: winners and losers") + f"\n{_shares(found.trips)}",
        loc="left",
        fontsize=10,
    )
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def _shares(trips: pd.DataFrame) -> str:
    every = trips[trips["group"] == "all"]
    if every.empty or not every["vehicles"].iloc[0] > 0:
        return "there are no trips to compare"
    row = every.iloc[0]
    told = [
        f"{percent(100 * row[f'{part}_share'])} % {word}"
        for part, word in (
            ("gaining", "gain"),
            ("little_change", "little change"),
            ("losing", "lose"),
            ("undetermined", "unknown"),
        )
    ]
    return f"of {row['vehicles']:,.0f} vehicles: {', '.join(told)}"
