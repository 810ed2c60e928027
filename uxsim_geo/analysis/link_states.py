"""What happened on every link in every time bin, by Edie's definitions, and over the whole run.

Over a link of length L and a bin of length T, with the vehicles' total distance d and total time t
in that rectangle of space and time (Edie 1963):

    flow q = d / (L T)      density k = t / (L T)      speed v = d / t = q / k

Both sums are exact: entries and exits come from the events, and positions at the edges of the bins
from the closed form in :mod:`uxsim_geo.analysis.passages`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.analysis.bins import bin_edges, bin_of, cut_at_edges
from uxsim_geo.analysis.edie import edie_states, ratio
from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.pieces import Pieces, Stretches
from uxsim_geo.analysis.spillback import times_without_room
from uxsim_geo.analysis.state_grid import StateGrid
from uxsim_geo.analysis.subsets import chosen_vehicles, names_of, rows_of_links
from uxsim_geo.analysis.table_size import MOST_STATES, check_rows
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.network.diagram import effective_capacity
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result

#: a vehicle counts as queued when it is further than this behind its free-flow trajectory, m
QUEUED_BEHIND = 1e-3

#: share of the free speed at which standing traffic counts as moving, as in route choice
STANDSTILL = 0.01


def link_times(  # noqa: PLR0913 -- three ways to choose, by keyword alone
    result: Result,
    network: Network,
    *,
    bin_s: npt.ArrayLike,
    links: str | Iterable[str] | None = None,
    vehicles: npt.ArrayLike | None = None,
    passages: Passages | None = None,
) -> pd.DataFrame:
    """States of links in time bins: one row a link and bin, links first, SI units.

    ``bin_s`` is the length of the bins, s, or their edges, as
    :func:`uxsim_geo.analysis.bins.bin_edges` takes them; ``links`` are link_ids, ``vehicles`` rows
    of the trips that alone count (None: all). ``passages`` are those of this result, where they are
    at hand. Vehicles count by their number, not by platoons. Columns:

    link_id (categorical, in the order of the links), begin_s, end_s
    entries, exits
        vehicles that entered or left the link in [begin, end); the last bin holds its end too
    distance (veh·m), time (veh·s)
        what the vehicles drove and spent on the link
    flow (veh/s), density (veh/m, all lanes together), speed (m/s)
        Edie's; speed is NaN where nobody was on the link
    delay (veh·s)
        time minus distance / free speed of the link without control: the time lost in this bin, to
        a speed limit too
    experienced_travel_time (s)
        mean time spent on the link by those who left it in this bin, NaN if nobody did
    instantaneous_travel_time (s)
        length / speed; at free speed where the link is empty, and at least at a hundredth of that
    queue (veh)
        vehicles on the link at the end of the bin which are behind the trajectory they would have
        at their own free speed, the limit in force when they entered: they have met the tail of a
        queue, or others who must drive slower, whether they stand or creep now
    queue_length (m)
        from the tail of the rearmost of those to the end of the link
    spillback_share
        part of the bin in which nobody could enter, whoever is counted, for want of room
        (:func:`uxsim_geo.analysis.spillback.times_without_room`): 0 to 1
    volume_to_capacity
        flow / capacity of the link without control, the lower of the given one and the diagram's

    Raises :class:`uxsim_geo.errors.InputError` for wrong bins, for a table of over 50 million rows,
    if ``links`` or ``vehicles`` are empty or not there, if ``passages`` are those of another
    result, or if the result is of another network.
    """
    edges = bin_edges(result.settings.duration, bin_s)
    rows = rows_of_links(network, links)
    instead = "take longer bins or fewer links"
    check_rows(len(rows) * (len(edges) - 1), MOST_STATES, "bin_s", instead)
    weight = chosen_vehicles(result.trips, vehicles).astype(float)
    passages = Passages.at_hand(passages, result, network)
    number = np.full(len(network.links), -1, np.int64)
    number[rows] = np.arange(len(rows))
    grid = _Grid(number, len(rows), edges)
    seen = np.flatnonzero((number[passages.link] >= 0) & (weight[passages.vehicle] > 0))
    pieces = Pieces.of(passages, Stretches.over_links(passages, seen), edges)
    sums = _accumulate(passages, pieces, grid)
    sums |= _count_ends(passages, seen, grid)
    sums |= _queues(passages, pieces, grid)
    closures = times_without_room(passages, network, result.settings)
    parts = cut_at_edges(closures.begin, closures.end, edges)
    full = grid.add_up(closures.link[parts.interval], parts.bin, parts.end - parts.begin)
    capacity = effective_capacity(network.links, result.settings.reaction_time)[rows]
    return _table(network, rows, grid, sums | {"full": full}, capacity)


def link_totals(states: pd.DataFrame) -> pd.DataFrame:
    """Figures of all bins together, one row a link in the order of ``states``, SI units.

    ``states`` is what :func:`link_times` returns. Columns: link_id, volume (vehicles that entered),
    exits, distance (veh·m), time (veh·s), speed (m/s, distance / time, NaN if nobody came), delay
    (veh·s), experienced_travel_time (s, mean of those who left), queue and queue_length (the
    largest found at the end of a bin: veh, m), spillback_share, volume_to_capacity (of the whole
    time).

    Raises :class:`uxsim_geo.errors.InputError` if the states are not those of each of their links
    in each bin, in that order.
    """
    grid = StateGrid.of(states)
    by_link = grid.values
    length_of_bin = grid.end - grid.begin
    exits = by_link("exits")
    distance, time = by_link("distance").sum(axis=1), by_link("time").sum(axis=1)
    on_link = np.nan_to_num(by_link("experienced_travel_time")) * exits
    return pd.DataFrame(
        {
            "link_id": grid.link_ids.to_numpy(),
            "volume": by_link("entries").sum(axis=1),
            "exits": exits.sum(axis=1),
            "distance": distance,
            "time": time,
            "speed": ratio(distance, time),
            "delay": by_link("delay").sum(axis=1),
            "experienced_travel_time": ratio(on_link.sum(axis=1), exits.sum(axis=1)),
            "queue": by_link("queue").max(axis=1),
            "queue_length": by_link("queue_length").max(axis=1),
            **{
                name: np.average(by_link(name), axis=1, weights=length_of_bin)
                for name in ("spillback_share", "volume_to_capacity")
            },
        }
    )


@dataclass(frozen=True)
class _Grid:
    """The table's rows: links first, bins within.

    number (per row of the links table: which of the table's links it is, -1: none), links, edges
    (of the bins, s).
    """

    number: Integers
    links: int
    edges: Floats

    @property
    def bins(self) -> int:
        return len(self.edges) - 1

    def _cells(self, link: Integers, bin_: Integers) -> tuple[Integers, Integers]:
        """The cell of each pair that is on the grid, and which pairs those are."""
        number = self.number[link]
        inside = np.flatnonzero((number >= 0) & (bin_ >= 0))
        return number[inside] * self.bins + bin_[inside], inside

    def add_up(self, link: Integers, bin_: Integers, values: Floats) -> Floats:
        cell, inside = self._cells(link, bin_)
        sums = np.bincount(cell, weights=values[inside], minlength=self.links * self.bins)
        return sums.astype(np.float64, copy=False)

    def largest(self, link: Integers, bin_: Integers, values: Floats) -> Floats:
        cell, inside = self._cells(link, bin_)
        result = np.zeros(self.links * self.bins)
        np.maximum.at(result, cell, values[inside])
        return result


def _accumulate(passages: Passages, pieces: Pieces, grid: _Grid) -> dict[str, Floats]:
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


def _count_ends(passages: Passages, seen: Integers, grid: _Grid) -> dict[str, Floats]:
    """Vehicles that entered and left per cell, and how long the leavers had been on the link."""
    link, vehicles = passages.link[seen], passages.vehicles[seen]
    enter, leave = passages.enter[seen], passages.exit[seen]
    left = np.where(np.isinf(leave), enter, leave) - enter
    out = bin_of(leave, grid.edges)
    exits = grid.add_up(link, out, vehicles)
    return {
        "entries": grid.add_up(link, bin_of(enter, grid.edges), vehicles),
        "exits": exits,
        "experienced_travel_time": ratio(grid.add_up(link, out, vehicles * left), exits),
    }


def _queues(passages: Passages, pieces: Pieces, grid: _Grid) -> dict[str, Floats]:
    """Vehicles behind their free-flow trajectory at the end of each bin, and how far they reach."""
    free = passages.free_speed[pieces.row] * (pieces.until - passages.enter[pieces.row])
    queued = pieces.cut & (free - pieces.position > QUEUED_BEHIND)
    row, bin_, position = pieces.row[queued], pieces.bin[queued], pieces.position[queued]
    geometry, link = passages.geometry, passages.link[row]
    length, vehicles = geometry.length[link], passages.vehicles[row]
    reach = np.minimum(length, length - position + vehicles * geometry.space_shift[link])
    return {
        "queue": grid.add_up(link, bin_, vehicles),
        "queue_length": grid.largest(link, bin_, reach),
    }


def _table(
    network: Network, rows: Integers, grid: _Grid, sums: dict[str, Floats], capacity: Floats
) -> pd.DataFrame:
    bins, edges = grid.bins, grid.edges
    length, free = (network.links[name].to_numpy(float)[rows] for name in ("length", "free_speed"))
    duration = np.tile(np.diff(edges), len(rows))
    states = edie_states(sums["distance"], sums["time"], np.repeat(length, bins) * duration)
    speed, free = states["speed"], np.repeat(free, bins)
    moving = np.where(np.isnan(speed), free, np.clip(speed, STANDSTILL * free, free))
    return pd.DataFrame(
        {
            "link_id": names_of(np.repeat(rows, bins), network.links["link_id"]),
            "begin_s": np.tile(edges[:-1], len(rows)),
            "end_s": np.tile(edges[1:], len(rows)),
            "entries": sums["entries"],
            "exits": sums["exits"],
            "distance": sums["distance"],
            "time": sums["time"],
            **states,
            "delay": sums["delay"],
            "experienced_travel_time": sums["experienced_travel_time"],
            "instantaneous_travel_time": np.repeat(length, bins) / moving,
            "queue": sums["queue"],
            "queue_length": sums["queue_length"],
            "spillback_share": np.minimum(sums["full"] / duration, 1.0),
            "volume_to_capacity": states["flow"] / np.repeat(capacity, bins),
        }
    )
