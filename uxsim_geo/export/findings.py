"""Where, when and how bad: what a reader is told first of a run, from its layers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.analysis.types import Floats
from uxsim_geo.export.clock import duration_in_words
from uxsim_geo.export.lost_time import NONE, LostTime, in_words
from uxsim_geo.network.street_names import street_names

#: shares of these that lie where a map opens
SHOWN = {"volume_veh": 0.96, "delay_veh_s": 0.98}


@dataclass(frozen=True)
class Findings:
    """Of one run.

    words
        how many drove, how late they came: a sentence each
    begin, end
        of every bin, UTC; empty where there are no states in time
    lost
        time lost on links, in bins whose times count from the first one's begin; in one of no
        meaning where there are no states in time
    """

    words: tuple[str, ...]
    begin: tuple[pd.Timestamp, ...]
    end: tuple[pd.Timestamp, ...]
    lost: LostTime

    @classmethod
    def of(cls, layers: Mapping[str, Any]) -> Findings:
        """Look at ``links``, and at ``od_lines`` and ``link_times`` if they are there."""
        links = layers["links"]
        words, times = _words(layers.get("od_lines"), links), layers.get("link_times")
        names = street_names(links)
        if times is None:
            by_bin = links["delay_veh_s"].to_numpy(float)[:, None]
            return cls(words, (), (), LostTime(names, by_bin, np.zeros(1), np.ones(1)))
        begin, end = (tuple(times.bins[name]) for name in ("begin", "end"))
        edges = [(moment - begin[0]).total_seconds() for moment in (*begin, after(end[-1]))]
        lost = LostTime(names, times.delay(), np.array(edges[:-1]), np.array(edges[1:]))
        return cls(words, begin, end, lost)


def after(end: pd.Timestamp) -> pd.Timestamp:
    """When a bin is over: its end in the layers is a second before."""
    return end + pd.Timedelta(seconds=1)


def extent_of_traffic(links: pd.DataFrame) -> tuple[float, float, float, float]:
    """Least x and y, greatest x and y of where most drive and are late, with a margin.

    A long road out of town would make the town too small to be read.
    """
    import shapely

    bounds = shapely.bounds(links["geometry"].to_numpy())
    there = ~np.isnan(bounds).any(axis=1)
    if not there.any():
        return 0.0, 0.0, 1.0, 1.0
    found = [
        _middle(bounds[there], links[name].to_numpy(float)[there], share)
        for name, share in SHOWN.items()
    ]
    x0, y0 = np.min(found, axis=0)[:2]
    x1, y1 = np.max(found, axis=0)[2:]
    edge = 0.04 * max(x1 - x0, y1 - y0, 1e-9)
    return float(x0 - edge), float(y0 - edge), float(x1 + edge), float(y1 + edge)


def _middle(bounds: Floats, weights: Floats, share: float) -> list[float]:
    """Bounds of the middle ``share`` of the weight; of all where nothing weighs anything."""
    if weights.sum() <= 0:
        weights, share = np.ones(len(bounds)), 1.0
    rest = (1.0 - share) / 2
    return [
        _percentile(bounds[:, side], weights, rest if side < 2 else 1.0 - rest) for side in range(4)
    ]


def _percentile(values: Floats, weights: Floats, share: float) -> float:
    """The value up to which ``share`` of the weight lies."""
    order = np.argsort(values, kind="stable")
    until = np.cumsum(weights[order])
    return float(values[order][min(np.searchsorted(until, share * until[-1]), len(order) - 1)])


def _words(od: pd.DataFrame | None, links: pd.DataFrame) -> tuple[str, ...]:
    queue = links["queue_m"].max()
    longest = f"The longest queue at the end of a bin fills {queue:,.0f} m of a link."
    if not queue >= 0.5:
        longest = "No bin ends with a queue of a metre or more."
    if od is None:
        return (longest,)
    departed, arrived = od["departed_veh"].sum(), od["completed_veh"].sum()
    words = [f"{departed:,.0f} vehicles departed, {arrived:,.0f} arrived by the end."]
    spent = (od["travel_time_s"] * od["departed_veh"]).sum()
    if spent > 0:
        late = od["delay_veh_s"].sum()
        mean = duration_in_words(late / departed)
        delay = f"{mean} of it ({100 * late / spent:.0f} %) are delay"
        took = f"On average a trip took {duration_in_words(spent / departed)} so far"
        words.append(f"{took}; {delay if in_words(late) != NONE else 'none of it is delay'}.")
    return (*words, longest)
