"""Trajectories as tables: where each vehicle is at chosen moments, on its link and on the map.

Positions on the link are the closed form of :mod:`uxsim_geo.analysis.passages`. On the map a
vehicle stands at the same share of the line that its link is drawn as: the length of a link and
that of its line need not be the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.run_passages import RunPassages
from uxsim_geo.analysis.samples import Samples, check_step, checked_moments, numbered_from, seen_at
from uxsim_geo.analysis.subsets import check_links, chosen_vehicles, named_rows, names_of
from uxsim_geo.analysis.table_size import MOST_SAMPLES, check_rows
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.errors import Faults
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result
from uxsim_geo.settings import Settings

#: samples worked on at a time: few enough for what lies between to stay in the processor's cache
BLOCK = 100_000


def trajectories(  # noqa: PLR0913 -- three ways to choose, by keyword alone
    result: Result,
    network: Network,
    *,
    times: npt.ArrayLike | None = None,
    step_s: float | None = None,
    vehicles: npt.ArrayLike | None = None,
    links: str | Iterable[str] | None = None,
) -> pd.DataFrame:
    """Where vehicles are on links: one row a platoon and moment, ordered by platoon and time.

    The moments are ``times`` (s after the start, in any order) or the multiples of ``step_s`` up to
    the end of the simulation. ``vehicles`` are rows of the trips, ``links`` link_ids (None: all).
    A platoon is on a link from its entry on and before its exit. Columns:

    vehicle (row of the trips, int32), link (link_id, categorical), time_s
    position
        of the platoon's first vehicle, m from the start of the link
    speed
        m/s: mean over the time step Δt = τΔn of the run that begins here, or up to the exit or the
        end of the simulation: at one moment platoons in a queue either stand or drive. It does
        not depend on which moments are asked for. NaN at the very end, after which nothing is known
    x, y
        on the line of the link, at the same share of its length in the network's CRS; NaN where a
        link has no line. Only if the network has geometry

    Raises :class:`uxsim_geo.errors.InputError` unless either ``times`` or ``step_s`` is given, for
    moments outside of the simulation, for a step that is not above 0 or makes more than a million
    moments, for a table of over 50 million rows, if ``vehicles`` or ``links`` are empty or not
    there, or if the result is of another network.
    """
    duration = result.settings.duration
    moments = _moments(times, step_s, duration)
    check_links(result, network)
    passages, rows = _chosen_passages(result, network, vehicles, links)
    lines = None
    if "geometry" in network.links.columns:
        lines = LinkLines.of(network.links["geometry"].to_numpy())
    columns = _columns(passages, rows, moments, result.settings, lines)
    link = names_of(columns.pop("link"), network.links["link_id"])
    # the columns are new: not copying them halves the memory that a long table takes
    return pd.DataFrame({"vehicle": columns.pop("vehicle"), "link": link} | columns, copy=False)


@dataclass(frozen=True)
class LinkLines:
    """Lines of links as flat arrays, in which places on millions of them are found fast.

    x, y (of all vertices), reach (share of its line's length up to each vertex), order (2 · number
    of the line + reach: ascends, with a gap between the end of a line and the next), first (per
    line and one more: where its vertices begin).
    """

    x: Floats
    y: Floats
    reach: Floats
    order: Floats
    first: Integers

    @classmethod
    def of(cls, lines: npt.NDArray[Any]) -> LinkLines:
        """Take shapely lines, one a link; None and empty ones have no places."""
        import shapely

        points, line = shapely.get_coordinates(lines, return_index=True)
        first = np.searchsorted(line, np.arange(len(lines) + 1)).astype(np.int64)
        steps = np.hypot(*np.diff(points, axis=0, prepend=points[:1]).T)
        steps[first[:-1][np.diff(first) > 0]] = 0.0
        driven = np.cumsum(steps)
        driven -= driven[first[line]]
        whole = driven[first[line + 1] - 1]
        reach = np.divide(driven, whole, out=np.zeros(len(line)), where=whole > 0)
        return cls(points[:, 0], points[:, 1], reach, 2.0 * line + reach, first)

    def points(self, rows: Integers, shares: Floats) -> tuple[Floats, Floats]:
        """The x and y at shares (0 to 1) of the length of lines ``rows``; NaN where there is none.

        As shapely's ``line_interpolate_point(normalized=True)``, without an object a point.
        """
        begin, end = self.first[rows], self.first[rows + 1]
        after = np.searchsorted(self.order, 2.0 * rows + shares, side="right")
        there = end > begin
        after = np.where(there, np.clip(after, begin + 1, end - 1), 0)
        before = np.maximum(after - 1, 0)
        start = self.reach[before]
        part = self.reach[after] - start
        share = np.divide(shares - start, part, out=np.zeros(len(rows)), where=part > 0)
        share = np.where(there, np.clip(share, 0.0, 1.0), np.nan)
        x = self.x[before] + share * (self.x[after] - self.x[before])
        y = self.y[before] + share * (self.y[after] - self.y[before])
        return x, y


def _moments(times: npt.ArrayLike | None, step_s: float | None, duration: float) -> Floats:
    """The moments asked for, ascending and once each."""
    faults = Faults()
    if (times is None) == (step_s is None):
        faults.add("give either times or step_s", column="times")
    faults.raise_if_any()
    if step_s is None:
        assert times is not None
        return np.unique(checked_moments(times, duration))
    check_step("step_s", step_s, duration)
    steps = np.arange(np.floor(duration / step_s + 1e-9) + 1)
    return np.minimum(steps * step_s, duration)


def _chosen_passages(
    result: Result,
    network: Network,
    vehicles: npt.ArrayLike | None,
    links: str | Iterable[str] | None,
) -> tuple[Passages, Integers]:
    """Passages, and which rows of them are of the chosen vehicles over the chosen links."""
    meant = chosen_vehicles(result.trips, vehicles)
    if links is None:
        of_run = RunPassages(result, network)
        passages = Passages.of(result, network) if vehicles is None else of_run.around(meant)
        return passages, np.flatnonzero(meant[passages.vehicle])
    known = pd.Index(network.links["link_id"].astype(str))
    asked = named_rows(links, known, "links")
    passages = Passages.of(result, network, asked)
    return passages, np.flatnonzero(meant[passages.vehicle])


def _columns(
    passages: Passages,
    rows: Integers,
    moments: Floats,
    settings: Settings,
    lines: LinkLines | None,
) -> dict[str, Any]:
    """The table's columns, filled block by block; link is the row of the links."""
    counts = seen_at(passages, rows, moments)[1]
    total = int(counts.sum())
    instead = "take fewer moments (a longer step_s), vehicles or links"
    check_rows(total, MOST_SAMPLES, "times", instead)
    columns: dict[str, Any] = {name: np.empty(total, np.int32) for name in ("vehicle", "link")}
    named = ("time_s", "position", "speed") + (() if lines is None else ("x", "y"))
    columns |= {name: np.empty(total) for name in named}
    begin = _places_by_vehicle(passages, rows, counts)
    for block in _blocks(counts):
        samples = Samples.at(
            passages, rows[block], moments, interval=settings.step, end=settings.duration
        )
        into = numbered_from(begin[block], counts[block])
        link = passages.link[samples.row]
        columns["vehicle"][into] = passages.vehicle[samples.row]
        columns["link"][into] = link
        columns["time_s"][into] = samples.time
        columns["position"][into] = samples.position
        columns["speed"][into] = samples.speed
        if lines is not None:
            shares = samples.position / passages.geometry.length[link]
            columns["x"][into], columns["y"][into] = lines.points(link, shares)
    return columns


def _places_by_vehicle(passages: Passages, rows: Integers, counts: Integers) -> Integers:
    """Where in a table by vehicle and time the samples of each passage begin."""
    order = np.lexsort((passages.enter[rows], passages.vehicle[rows]))
    begin = np.empty(len(rows), np.int64)
    begin[order] = np.cumsum(counts[order]) - counts[order]
    return begin


def _blocks(counts: Integers) -> Iterator[slice]:
    """Slices of passages that have about as many samples as a block holds."""
    until = np.cumsum(counts)
    edges = np.searchsorted(until, np.arange(0, int(counts.sum()), BLOCK), side="right")
    edges = np.unique(np.append(edges, len(counts)))
    for begin, end in pairwise(edges):
        yield slice(int(begin), int(end))
