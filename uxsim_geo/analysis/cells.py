"""Flow, density and speed by time and place within links, by Edie's definitions, exactly.

A cell is a part of a link during a time bin. When platoons pass the ends of the parts follows from
the closed form (:mod:`uxsim_geo.analysis.crossings`), so that times and distances in cells are
exact, and over the cells of a link add up to those of the link.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.analysis.bins import bin_edges, numbers_of
from uxsim_geo.analysis.crossings import times_at
from uxsim_geo.analysis.edie import edie_states
from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.pieces import Pieces, Stretches
from uxsim_geo.analysis.run_passages import blocks_at_hand
from uxsim_geo.analysis.subsets import chosen_vehicles, names_of, rows_of_links
from uxsim_geo.analysis.table_size import MOST_CELLS, check_rows
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.errors import Faults
from uxsim_geo.network.network import Network
from uxsim_geo.result import Result

#: stretches worked on at a time, which take some 100 bytes each
BLOCK = 500_000


def space_time_cells(  # noqa: PLR0913 -- what to look at, and how finely, by keyword alone
    result: Result,
    network: Network,
    *,
    bin_s: npt.ArrayLike,
    cell_m: npt.ArrayLike,
    links: str | Iterable[str] | None = None,
    vehicles: npt.ArrayLike | None = None,
    passages: Passages | None = None,
) -> pd.DataFrame:
    """States in cells of time and place: one row a link, bin and cell, in that order, SI units.

    Every link is cut into the fewest equal parts of at most ``cell_m`` metres: one number, or one a
    link of the table, in its order. ``bin_s``,
    ``links``, ``vehicles`` and ``passages`` are as of
    :func:`uxsim_geo.analysis.link_states.link_times`. Columns: link_id (categorical), begin_s,
    end_s, begin_m, end_m (from the start of the link), distance (veh·m), time (veh·s), flow
    (veh/s), density (veh/m, all lanes together), speed (m/s; NaN where nobody was). A platoon is
    where its first vehicle is; standing at the border of two cells it is in the second.

    Raises :class:`uxsim_geo.errors.InputError` for wrong bins or cells, for a table of over 20
    million rows, if ``links`` or ``vehicles`` are empty or not there, if ``passages`` are those of
    another result, or if the result is of another network.
    """
    edges = bin_edges(result.settings.duration, bin_s)
    rows = rows_of_links(network, links)
    length = network.links["length"].to_numpy(float)[rows]
    parts = _parts(length, cell_m, len(edges) - 1)
    chosen = chosen_vehicles(result.trips, vehicles)
    first = np.cumsum(parts) - parts
    total = np.zeros((2, int(parts.sum()) * (len(edges) - 1)))
    for own, there in blocks_at_hand(passages, result, network, rows):
        place = np.searchsorted(rows, own)
        for some in _blocks(there, own, parts[place]):
            cells = (own[some], parts[place[some]], first[place[some]])
            _add_up(total, there, chosen, cells, edges)
        del there  # before the next are made
    return _table(network, (rows, parts, first), edges, total)


def _parts(length: Floats, cell_m: npt.ArrayLike, bins: int) -> Integers:
    """How many cells each link has."""
    size, faults = numbers_of(cell_m, "cell_m"), Faults()
    if size.shape not in ((), length.shape):
        what = f"must be one number, or one for each of {len(length)} links"
        faults.add(what, column="cell_m", value=size.shape)
    for wrong in np.unique(size[~((size > 0) & np.isfinite(size))]):
        faults.add("must be a finite number of metres above 0", column="cell_m", value=wrong)
    faults.raise_if_any()
    parts: Integers = np.maximum(1, np.ceil(length / size - 1e-9)).astype(np.int64)
    instead = "take longer cells, longer bins or fewer links"
    check_rows(parts.sum() * bins, MOST_CELLS, "cell_m", instead, cell_m)
    return parts


def _blocks(passages: Passages, rows: Integers, parts: Integers) -> Iterator[slice]:
    """Slices of links that have about as many stretches as a block holds."""
    stretches = np.cumsum(np.diff(passages.first)[rows] * parts)
    wanted = np.arange(0, int(stretches[-1]) + 1, BLOCK)[1:]
    cuts = np.unique([0, *(np.searchsorted(stretches, wanted) + 1), len(rows)])
    for begin, end in zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True):
        yield slice(begin, end)


def _add_up(
    total: Floats,
    passages: Passages,
    chosen: npt.NDArray[np.bool_],
    links: tuple[Integers, Integers, Integers],
    edges: Floats,
) -> None:
    """Add distance and time on some links (row, number of parts, first cell) to ``total``."""
    rows, parts, first = links
    number = np.full(len(passages.first) - 1, -1, np.int64)
    number[rows] = np.arange(len(rows))
    seen = np.flatnonzero((number[passages.link] >= 0) & chosen[passages.vehicle])
    own = number[passages.link[seen]]
    stretches, part = _stretches(passages, seen, parts[own])
    pieces = Pieces.of(passages, stretches, edges)
    cells = np.repeat(first[own], parts[own]) + part
    place = cells[pieces.stretch] * (len(edges) - 1) + pieces.bin
    vehicles = passages.vehicles[pieces.row]
    for sums, values in zip(total, (pieces.distance, pieces.time), strict=True):
        sums += np.bincount(place, vehicles * values, minlength=len(sums))


def _stretches(passages: Passages, seen: Integers, parts: Integers) -> tuple[Stretches, Integers]:
    """The way of each passage over each part of its link, and which part that is."""
    row = np.repeat(seen, parts)
    begins = np.cumsum(parts) - parts
    part = np.arange(len(row)) - np.repeat(begins, parts)
    size = np.repeat(passages.geometry.length[passages.link[seen]] / parts, parts)
    is_first = part == 0
    is_last = np.roll(is_first, -1)
    end = np.where(is_last, passages.geometry.length[passages.link[row]], (part + 1) * size)
    leave = passages.exit[row]
    leave[~is_last] = times_at(passages, row[~is_last], end[~is_last])
    begin, enter = np.roll(end, 1), np.roll(leave, 1)
    begin[is_first], enter[is_first] = 0.0, passages.enter[seen]
    # by rounding a platoon in a queue may come to a place after it has left
    leave = np.minimum(leave, passages.exit[row])
    return Stretches(row, begin, end, np.minimum(enter, leave), leave), part


def _table(
    network: Network,
    links: tuple[Integers, Integers, Integers],
    edges: Floats,
    total: Floats,
) -> pd.DataFrame:
    """The sums, which are by cell and then by bin, as rows by link, bin and cell."""
    rows, parts, first = links
    bins = len(edges) - 1
    link = np.repeat(np.arange(len(rows)), parts * bins)
    within = np.arange(len(link)) - np.repeat(first * bins, parts * bins)
    bin_, part = np.divmod(within, parts[link])
    distance, time = total[:, (first[link] + part) * bins + bin_]
    size = (network.links["length"].to_numpy(float)[rows] / parts)[link]
    return pd.DataFrame(
        {
            "link_id": names_of(rows[link], network.links["link_id"]),
            "begin_s": edges[bin_],
            "end_s": edges[bin_ + 1],
            "begin_m": part * size,
            "end_m": (part + 1) * size,
            "distance": distance,
            "time": time,
            **edie_states(distance, time, size * (edges[bin_ + 1] - edges[bin_])),
        }
    )
