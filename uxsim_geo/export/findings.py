"""Where, when and how bad: what a reader is told first of a run, from its layers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from uxsim_geo.analysis.types import Floats
from uxsim_geo.network.units import TIMES

ROADS = 8
MOST_TRAFFIC = 0.99  # of the distance driven lies where a map opens


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
    def of(cls, layers: Mapping[str, pd.DataFrame]) -> Findings:
        """Look at ``links``, and at ``od_lines`` and ``link_times`` if they are there."""
        links = layers["links"]
        words, times = _words(layers.get("od_lines"), links), layers.get("link_times")
        if times is None:
            return cls(words, _roads(links), (), (), ())
        bins = times.iloc[: len(times) // len(links)]
        lost = times["delay_veh_s"].to_numpy(float).reshape(len(links), -1).sum(axis=0)
        begin, end = (tuple(bins[name]) for name in ("begin", "end"))
        return cls(words, _roads(links), begin, end, tuple((lost / TIMES["h"]).tolist()))

    @property
    def worst(self) -> int:
        """The bin in which most time is lost."""
        return int(np.argmax(self.lost))


def extent_of_traffic(links: pd.DataFrame) -> tuple[float, float, float, float]:
    """Least x and y, greatest x and y of where nearly all is driven; a margin around."""
    import shapely

    bounds = shapely.bounds(links["geometry"].to_numpy())
    there = ~np.isnan(bounds).any(axis=1)
    bounds = bounds[there]
    weights = (links["volume_veh"] * links["length_m"]).to_numpy(float)[there]
    if weights.sum() <= 0:
        weights = np.ones(len(bounds))
    rest = (1.0 - MOST_TRAFFIC) / 2
    low = [_percentile(bounds[:, axis], weights, rest) for axis in (0, 1)]
    high = [_percentile(bounds[:, axis + 2], weights, 1.0 - rest) for axis in (0, 1)]
    edge = 0.04 * max(high[0] - low[0], high[1] - low[1], 1e-9)
    return low[0] - edge, low[1] - edge, high[0] + edge, high[1] + edge


def _percentile(values: Floats, weights: Floats, share: float) -> float:
    """The value up to which ``share`` of the weight lies."""
    order = np.argsort(values, kind="stable")
    until = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(until, share * until[-1])])


def _roads(links: pd.DataFrame) -> tuple[tuple[str, float], ...]:
    """By name, those without one by their id; of links without delay none."""
    names = links["name"].astype("string")
    names = names.where(names.fillna("") != "", "link " + links["link_id"].astype("string"))
    lost = links["delay_veh_s"].groupby(names.to_numpy(), sort=False).sum() / TIMES["h"]
    lost = lost[lost > 0].sort_values(ascending=False, kind="stable").head(ROADS)
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
            f"A trip took {spent / departed / 60:,.1f} min so far, {late / departed / 60:,.1f} min "
            f"({100 * late / spent:.0f} %) longer than on empty roads."
        )
    return (*words, longest)
