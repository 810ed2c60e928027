"""Where, when and how bad: what a reader is told first of a run, from its layers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.analysis.types import Floats
from uxsim_geo.network.units import TIMES

ROADS = 8

#: shares of these that lie where a map opens
SHOWN = {"volume_veh": 0.96, "delay_veh_s": 0.98}


@dataclass(frozen=True)
class Findings:
    """Of one run.

    words
        how many drove, how late they came: a sentence each
    roads
        those where most time is lost: name, veh·h
    begin, end
        of every bin, UTC; empty where there are no states in time
    lost
        time lost in each bin by all, veh·h
    """

    words: tuple[str, ...]
    roads: tuple[tuple[str, float], ...]
    begin: tuple[pd.Timestamp, ...]
    end: tuple[pd.Timestamp, ...]
    lost: tuple[float, ...]

    @classmethod
    def of(cls, layers: Mapping[str, Any]) -> Findings:
        """Look at ``links``, and at ``od_lines`` and ``link_times`` if they are there."""
        links = layers["links"]
        words, times = _words(layers.get("od_lines"), links), layers.get("link_times")
        if times is None:
            return cls(words, _roads(links), (), (), ())
        lost = times.delay().sum(axis=0)
        begin, end = (tuple(times.bins[name]) for name in ("begin", "end"))
        return cls(words, _roads(links), begin, end, tuple((lost / TIMES["h"]).tolist()))

    @property
    def worst(self) -> int:
        """The first bin in which most is lost, to one in a thousand: a gridlock stays as bad."""
        lost = np.asarray(self.lost)
        return int(np.argmax(lost >= 0.999 * lost.max()))


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


def _roads(links: pd.DataFrame) -> tuple[tuple[str, float], ...]:
    """By name, those without one by their id; none of those that one decimal shows as 0."""
    names = links["name"].astype("string")
    names = names.where(names.fillna("") != "", "link " + links["link_id"].astype("string"))
    lost = links["delay_veh_s"].groupby(names.to_numpy(), sort=False).sum() / TIMES["h"]
    lost = lost[lost >= 0.05].sort_values(ascending=False, kind="stable").head(ROADS)
    return tuple((str(name), float(value)) for name, value in lost.items())


def _words(od: pd.DataFrame | None, links: pd.DataFrame) -> tuple[str, ...]:
    queue = links["queue_m"].max()
    longest = f"The longest queue at the end of a bin fills {queue:,.0f} m of a link."
    if od is None:
        return (longest,)
    departed, arrived = od["departed_veh"].sum(), od["completed_veh"].sum()
    words = [f"{departed:,.0f} vehicles departed, {arrived:,.0f} arrived by the end."]
    spent = (od["travel_time_s"] * od["departed_veh"]).sum()
    if spent > 0:
        late = od["delay_veh_s"].sum()
        words.append(
            f"On average a trip took {spent / departed / 60:,.1f} min so far; "
            f"{late / departed / 60:,.1f} min of it ({100 * late / spent:.0f} %) are delay."
        )
    return (*words, longest)
