"""Classes and colours of changes, the same on maps in QGIS, on the page, in plots and in 3D.

Classes lie symmetric about 0 and are those of all scenarios of a study, so that maps can be
compared. Where less or more is better, blue is better and red worse; where neither is, violet is
more and green less. Each pair differs in lightness as well as in hue, and is told apart with any
kind of colour blindness. What hardly changes is grey, and what cannot be compared is no change.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pandas as pd

from uxsim_geo.analysis.comparison.quantities import LINK_TIMES, LINKS, Quantity
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.export.comparison.study import Study, comparison_of
from uxsim_geo.export.page.quantities import round_breaks

#: from the smallest change to the largest
WORSE, BETTER = ("#f4a27a", "#d6542f", "#7f0a22"), ("#8fc0df", "#3f88c0", "#123a80")
MORE, LESS = ("#c9a5d6", "#9457ab", "#4d1a73"), ("#9ad0a0", "#46a05a", "#0f5a2a")
HARDLY = "#c4c4c4"
#: of links that one network alone has, and what cannot be compared
REMOVED, ADDED, UNKNOWN = "#111111", "#b8860b", "#8a8a8a"

#: the same on a dark ground, where the largest changes are the lightest
WORSE_ON_DARK, BETTER_ON_DARK = ("#8a4436", "#e0684a", "#ffc3a8"), ("#2f628a", "#4fa0dc", "#c4e6ff")
MORE_ON_DARK, LESS_ON_DARK = ("#6d4a7d", "#b583cc", "#eed6f8"), ("#2f6a3d", "#57b56b", "#c8f0cf")
HARDLY_ON_DARK = "#5a636d"
REMOVED_ON_DARK, ADDED_ON_DARK, UNKNOWN_ON_DARK = "#ffffff", "#ffd24a", "#8a929b"

#: shares of all changes but none that lie below the first, second and third break
SHARES = (0.5, 0.85, 0.97)

#: of relative changes, in percent
RELATIVE_BREAKS = (5.0, 20.0, 50.0)

#: less than this is what rounding leaves of no change
NOTHING = 1e-9

ONLY_BASE = "removed by the scenario"
ONLY_SCENARIO = "added by the scenario"
NOT_COMPARED = "not comparable: nobody there in base or scenario"
EDITED = "edited by the scenario"


class Shown(NamedTuple):
    """A quantity to show: its own, whether relative (%), and the breaks of its classes."""

    quantity: Quantity
    relative: bool
    breaks: tuple[float, ...]

    @property
    def label(self) -> str:
        """What a reader calls it."""
        return f"{self.quantity.title}, relative" if self.relative else self.quantity.title

    @property
    def unit(self) -> str:
        """Of the breaks."""
        return "%" if self.relative else self.quantity.unit

    def of(self, table: pd.DataFrame) -> Floats:
        """Changes in a table of a comparison; NaN where there is none to tell."""
        suffix, factor = ("relative", 100.0) if self.relative else ("difference", 1.0)
        values: Floats = table[f"{self.quantity.name}_{suffix}"].to_numpy(float) * factor
        return values


class ChangeClass(NamedTuple):
    """A range of changes with its colours and its words."""

    lower: float
    upper: float
    colour: str
    on_dark: str
    label: str


def shown_of_links(study: Study, *, relative: bool) -> list[Shown]:
    """What maps of the whole run show."""
    names = ("delay_veh_h", "volume_veh", "speed_kmh", "experienced_travel_time_s", "queue_m")
    tables = [comparison_of(entry).links for entry in study.compared]
    return _shown(_named(LINKS, names), tables, relative=relative)


def shown_in_time(study: Study) -> list[Shown]:
    """What maps of time bins show."""
    names = ("delay_veh_h", "flow_vph", "speed_kmh", "experienced_travel_time_s", "queue_m")
    tables = [comparison_of(entry).link_times for entry in study.compared]
    return _shown(_named(LINK_TIMES, names), tables, relative=False)


def classes_of(shown: Shown) -> list[ChangeClass]:
    """From the largest decrease to the largest increase, seven of them."""
    ups = (MORE, MORE_ON_DARK), (WORSE, WORSE_ON_DARK), (BETTER, BETTER_ON_DARK)
    downs = (LESS, LESS_ON_DARK), (BETTER, BETTER_ON_DARK), (WORSE, WORSE_ON_DARK)
    number = {0: 0, -1: 1, 1: 2}[shown.quantity.better]
    (up, up_dark), (down, down_dark) = ups[number], downs[number]
    spans = list(pairwise([*shown.breaks, np.inf]))
    least = shown.breaks[0]
    hardly = f"less than {least:g} either way"
    return [
        *(
            ChangeClass(-high, -low, down[at], down_dark[at], _label(low, high, "−"))
            for at, (low, high) in reversed(list(enumerate(spans)))
        ),
        ChangeClass(-least, least, HARDLY, HARDLY_ON_DARK, hardly),
        *(
            ChangeClass(low, high, up[at], up_dark[at], _label(low, high, "+"))
            for at, (low, high) in enumerate(spans)
        ),
    ]


def class_numbers(values: Floats, shown: Shown) -> Integers:
    """The class of each change; −1 where there is none to tell."""
    # what is exactly on a break belongs to the larger change on both sides of 0
    sizes = np.searchsorted(shown.breaks, np.abs(np.nan_to_num(values)), "right")
    number = len(shown.breaks) + np.sign(np.nan_to_num(values)) * sizes
    return np.where(np.isnan(values), -1, number).astype(np.int64)


def significance(table: pd.DataFrame, shown: Shown) -> Floats:
    """1: changes for sure, 0: perhaps by chance, NaN: not known, as of one seed.

    By the false discoveries among all rows where they are controlled; else by the row's interval.
    """
    name = shown.quantity.name
    if f"{name}_significant" in table:
        known = table[f"{name}_significant"].astype("Float64")
        return np.asarray(known.to_numpy(float, na_value=np.nan))
    low, high = (table[f"{name}_{end}"].to_numpy(float) for end in ("low", "high"))
    sure: Floats = np.where(np.isnan(low), np.nan, ((low > 0) | (high < 0)).astype(float))
    return sure


def _named(quantities: Sequence[Quantity], names: Iterable[str]) -> list[Quantity]:
    by_name = {quantity.name: quantity for quantity in quantities}
    return [by_name[name] for name in names]


def _shown(
    quantities: list[Quantity], tables: Sequence[pd.DataFrame], *, relative: bool
) -> list[Shown]:
    if relative:
        return [Shown(quantity, True, RELATIVE_BREAKS) for quantity in quantities]
    found = []
    for quantity in quantities:
        columns = [table[f"{quantity.name}_difference"].to_numpy(float) for table in tables]
        changes = np.abs(np.concatenate([np.empty(0), *columns]))
        found.append(Shown(quantity, False, round_breaks(changes[changes > NOTHING], SHARES)))
    return found


def _label(low: float, high: float, sign: str) -> str:
    if np.isinf(high):
        return f"{sign}{low:,g} and more"
    return f"{sign}{low:,g} to {sign}{high:,g}"
