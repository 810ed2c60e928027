"""What happened on every link in every time bin, by Edie's definitions, and over the whole run.

Over a link of length L and a bin of length T, with the vehicles' total distance d and total time t
in that rectangle of space and time (Edie 1963):

    flow q = d / (L T)      density k = t / (L T)      speed v = d / t = q / k

Both sums are exact: entries and exits come from the events, and positions at the edges of the bins
from the closed form in :mod:`uxsim_geo.analysis.passages`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from uxsim_geo.analysis.edie import edie_states, ratio
from uxsim_geo.analysis.passages import Floats, Integers, Passages
from uxsim_geo.network.network import Network
from uxsim_geo.settings import Settings

#: a vehicle counts as queued when it is further than this behind its free-flow trajectory, m
QUEUED_BEHIND = 1e-3


def link_times(
    network: Network,
    events: pd.DataFrame,
    trips: pd.DataFrame,
    settings: Settings,
    bin_s: float,
) -> pd.DataFrame:
    """States of all links in all time bins, of a run without speed limits: from its tables.

    As :func:`states_of_passages`, which also knows of limits.
    """
    passages = Passages.of(network, events, trips, settings)
    return states_of_passages(network, passages, settings.duration, bin_s)


def states_of_passages(
    network: Network, passages: Passages, duration: float, bin_s: float
) -> pd.DataFrame:
    """States of all links in all time bins: one row a link and bin, links first, SI units.

    The bins are ``bin_s`` seconds long from the start; the last one ends with the simulation, at
    ``duration`` in seconds, and may be shorter. Vehicles count by their number, not by platoons.
    Columns:

    link_id (categorical, in the order of the links), begin_s, end_s
    entries, exits
        vehicles that entered or left the link in [begin, end)
    distance (veh·m), time (veh·s)
        what the vehicles drove and spent on the link
    flow (veh/s), density (veh/m, all lanes together), speed (m/s)
        Edie's; speed is NaN where nobody was on the link
    delay (veh·s)
        time minus distance / free speed of the link without control: the time lost in this bin, to
        a speed limit too
    experienced_travel_time (s)
        mean time spent on the link by those who left it in this bin, NaN if nobody did
    queue (veh)
        vehicles on the link at the end of the bin which are behind the trajectory they would have
        at their own free speed, the limit in force when they entered: they have met the tail of a
        queue, or others who must drive slower, whether they stand or creep now
    queue_length (m)
        from the tail of the rearmost of those to the end of the link

    Raises ValueError if ``bin_s`` is not above 0.
    """
    edges = bin_edges(duration, bin_s)
    pieces = _cut_at_edges(passages, edges)
    grid = _Grid(len(network.links), len(edges) - 1)
    sums = _accumulate(passages, pieces, grid)
    sums |= _count_ends(passages, edges, grid)
    sums |= _queues(passages, pieces, edges, grid)
    return _table(network, edges, sums)


def link_totals(network: Network, states: pd.DataFrame) -> pd.DataFrame:
    """Whole-run figures, one row a link in the order of the links table, SI units.

    ``states`` is what :func:`link_times` returns for the same network. Columns: link_id, volume
    (vehicles that entered), exits, distance (veh·m), time (veh·s), speed (m/s, distance / time,
    NaN if nobody came), delay (veh·s), experienced_travel_time (s, mean of those who left),
    queue and queue_length (the largest found at the end of a bin: veh, m).
    """
    links = len(network.links)

    def by_link(column: str) -> Floats:
        return states[column].to_numpy(float).reshape(links, -1)

    exits = by_link("exits")
    distance, time = by_link("distance").sum(axis=1), by_link("time").sum(axis=1)
    on_link = np.nan_to_num(by_link("experienced_travel_time")) * exits
    return pd.DataFrame(
        {
            "link_id": network.links["link_id"].astype(str).to_numpy(),
            "volume": by_link("entries").sum(axis=1),
            "exits": exits.sum(axis=1),
            "distance": distance,
            "time": time,
            "speed": ratio(distance, time),
            "delay": by_link("delay").sum(axis=1),
            "experienced_travel_time": ratio(on_link.sum(axis=1), exits.sum(axis=1)),
            "queue": by_link("queue").max(axis=1),
            "queue_length": by_link("queue_length").max(axis=1),
        }
    )


def bin_edges(duration: float, bin_s: float) -> Floats:
    """Edges of the time bins, s: multiples of ``bin_s``, and the end of the simulation last."""
    if not bin_s > 0:
        raise ValueError(f"a time bin must be longer than 0 s, not {bin_s}")
    bins = max(1, int(np.ceil(duration / bin_s - 1e-9)))
    return np.append(np.arange(bins) * bin_s, duration)


@dataclass(frozen=True)
class _Grid:
    """The table's rows: links first, bins within."""

    links: int
    bins: int

    def add_up(self, link: Integers, bin_: Integers, values: Floats) -> Floats:
        cell = link * self.bins + bin_
        sums = np.bincount(cell, weights=values, minlength=self.links * self.bins)
        return sums.astype(np.float64, copy=False)

    def largest(self, link: Integers, bin_: Integers, values: Floats) -> Floats:
        result = np.zeros(self.links * self.bins)
        np.maximum.at(result, link * self.bins + bin_, values)
        return result


@dataclass(frozen=True)
class _Pieces:
    """Passages cut at the edges of the bins: one entry a passage and bin that it touches.

    row (of the passage), bin, time (s spent), distance (m driven), position (m, at the end of the
    piece), cut (True: the platoon is still on the link when the bin ends).
    """

    row: Integers
    bin: Integers
    time: Floats
    distance: Floats
    position: Floats
    cut: np.ndarray


def _cut_at_edges(passages: Passages, edges: Floats) -> _Pieces:
    bins, end = len(edges) - 1, edges[-1]
    enter, leave = np.minimum(passages.enter, end), np.minimum(passages.exit, end)
    first = np.minimum(np.searchsorted(edges, enter, side="right") - 1, bins - 1)
    last = np.maximum(np.searchsorted(edges, leave, side="left") - 1, first)
    pieces = last - first + 1
    row = np.repeat(np.arange(len(enter)), pieces)
    start_of_row = np.cumsum(pieces) - pieces
    bin_ = np.arange(len(row)) - np.repeat(start_of_row - first, pieces)
    begin = np.maximum(enter[row], edges[bin_])
    until = np.minimum(leave[row], edges[bin_ + 1])
    cut = passages.exit[row] > until
    position = passages.geometry.length[passages.link[row]]
    position[cut] = passages.positions(row[cut], until[cut])
    came_from = np.roll(position, 1)
    came_from[start_of_row] = 0.0
    return _Pieces(row, bin_, until - begin, position - came_from, position, cut)


def _accumulate(passages: Passages, pieces: _Pieces, grid: _Grid) -> dict[str, Floats]:
    """Distance and time of all vehicles per cell, and what was lost against free speed.

    That is the free speed without control: what a limit costs is delay.
    """
    link, vehicles = passages.link[pieces.row], passages.vehicles[pieces.row]
    free_time = pieces.distance / passages.geometry.free_speed[link]
    lost = np.maximum(pieces.time - free_time, 0.0)
    return {
        "distance": grid.add_up(link, pieces.bin, vehicles * pieces.distance),
        "time": grid.add_up(link, pieces.bin, vehicles * pieces.time),
        "delay": grid.add_up(link, pieces.bin, vehicles * lost),
    }


def _count_ends(passages: Passages, edges: Floats, grid: _Grid) -> dict[str, Floats]:
    """Vehicles that entered and left per cell, and how long the leavers had been on the link."""

    def count(times: Floats, weights: Floats) -> Floats:
        inside = times <= edges[-1]
        bin_ = np.searchsorted(edges, times[inside], side="right") - 1
        bin_ = np.minimum(bin_, grid.bins - 1)
        return grid.add_up(passages.link[inside], bin_, weights[inside])

    with np.errstate(invalid="ignore"):
        on_link = passages.vehicles * (passages.exit - passages.enter)
    exits = count(passages.exit, passages.vehicles)
    return {
        "entries": count(passages.enter, passages.vehicles),
        "exits": exits,
        "experienced_travel_time": ratio(count(passages.exit, on_link), exits),
    }


def _queues(passages: Passages, pieces: _Pieces, edges: Floats, grid: _Grid) -> dict[str, Floats]:
    """Vehicles behind their free-flow trajectory at the end of each bin, and how far they reach."""
    row, bin_, position = (x[pieces.cut] for x in (pieces.row, pieces.bin, pieces.position))
    geometry, link = passages.geometry, passages.link[row]
    free = passages.free_speed[row] * (edges[bin_ + 1] - passages.enter[row])
    queued = free - position > QUEUED_BEHIND
    row, bin_, position, link = row[queued], bin_[queued], position[queued], link[queued]
    length, vehicles = geometry.length[link], passages.vehicles[row]
    reach = np.minimum(length, length - position + vehicles * geometry.space_shift[link])
    return {
        "queue": grid.add_up(link, bin_, vehicles),
        "queue_length": grid.largest(link, bin_, reach),
    }


def _table(network: Network, edges: Floats, sums: dict[str, Floats]) -> pd.DataFrame:
    links, bins = len(network.links), len(edges) - 1
    link_ids = pd.Index(network.links["link_id"].astype(str).to_numpy())
    area = (network.links["length"].to_numpy(float)[:, None] * np.diff(edges)).ravel()
    return pd.DataFrame(
        {
            "link_id": pd.Categorical.from_codes(
                np.repeat(np.arange(links), bins), categories=link_ids
            ),
            "begin_s": np.tile(edges[:-1], links),
            "end_s": np.tile(edges[1:], links),
            "entries": sums["entries"],
            "exits": sums["exits"],
            "distance": sums["distance"],
            "time": sums["time"],
            **edie_states(sums["distance"], sums["time"], area),
            "delay": sums["delay"],
            "experienced_travel_time": sums["experienced_travel_time"],
            "queue": sums["queue"],
            "queue_length": sums["queue_length"],
        }
    )
