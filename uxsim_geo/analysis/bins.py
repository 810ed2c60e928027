"""Time bins that somebody asks for, and what lies in which of them."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from uxsim_geo.analysis.table_size import MOST_BINS, shortest_step
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.errors import Faults, InputError


def bin_edges(duration: float, bin_s: npt.ArrayLike) -> Floats:
    """Edges of time bins, s after the start; shape (bins + 1,).

    ``bin_s`` is the length of the bins, s: then they are its multiples, and the last bin ends with
    the simulation, at ``duration``, and may be shorter. Or it holds the edges themselves: at least
    two moments that ascend, from 0 to ``duration``.

    Raises :class:`uxsim_geo.errors.InputError` unless a length is finite, above 0 and such that
    there are no more than a million bins, or for edges that are none.
    """
    asked = numbers_of(bin_s, "bin_s")
    faults = Faults()
    if asked.ndim:
        _check_edges(asked, duration, faults)
        faults.raise_if_any()
        return asked
    length = float(asked)
    if not 0 < length < float("inf"):
        faults.add("must be a finite number of seconds above 0", column="bin_s", value=length)
    elif duration / length > MOST_BINS:
        shortest = shortest_step(duration, MOST_BINS)
        what = f"makes more than {MOST_BINS:,} bins: take {shortest:g} s or more"
        faults.add(what, column="bin_s", value=length)
    faults.raise_if_any()
    bins = max(1, int(np.ceil(duration / length - 1e-9)))
    return np.append(np.arange(bins) * length, duration)


def numbers_of(values: npt.ArrayLike, argument: str) -> Floats:
    """A number or several as an array; raises InputError for what is neither."""
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        faults = Faults()
        faults.add("must be a number, or a row of numbers", column=argument, value=values)
        raise InputError(faults.found) from None


def bin_of(times: Floats, edges: Floats) -> Integers:
    """The bin [begin, end) in which each moment lies; the last one holds its end too.

    -1 for a moment (s) before the first edge or after the last.
    """
    bins = np.searchsorted(edges, times, side="right") - 1
    bins = np.where(times == edges[-1], len(edges) - 2, bins)
    return np.where(bins > len(edges) - 2, -1, bins).astype(np.int64)


class Parts(NamedTuple):
    """Intervals cut at the edges of bins; arrays of one length, by interval and then by bin.

    interval (its number), bin, begin and end (s, of the part).
    """

    interval: Integers
    bin: Integers
    begin: Floats
    end: Floats


def cut_at_edges(begin: Floats, end: Floats, edges: Floats) -> Parts:
    """Cut intervals (from ``begin`` to ``end``, s) at the edges; what is outside them is left out.

    An interval without length has no part.
    """
    bins = len(edges) - 1
    since, until = np.maximum(begin, edges[0]), np.minimum(end, edges[-1])
    first = np.minimum(np.searchsorted(edges, since, side="right") - 1, bins - 1)
    last = np.maximum(np.searchsorted(edges, until, side="left") - 1, first)
    counts = np.where(until > since, last - first + 1, 0)
    interval = np.repeat(np.arange(len(begin)), counts)
    before = np.cumsum(counts) - counts
    bin_ = np.arange(len(interval)) + np.repeat(first - before, counts)
    return Parts(
        interval,
        bin_,
        np.maximum(since[interval], edges[bin_]),
        np.minimum(until[interval], edges[bin_ + 1]),
    )


def _check_edges(edges: Floats, duration: float, faults: Faults) -> None:
    if edges.ndim > 1 or edges.size < 2:
        faults.add("as edges needs two moments at least, s", column="bin_s", value=edges.tolist())
        return
    for moment in edges[~((edges >= 0) & (edges <= duration))]:
        what = f"has an edge that is not between 0 and the end of the simulation, {duration:g} s"
        faults.add(what, column="bin_s", value=moment)
    for before, after in pairwise(edges):
        if before >= after:
            what = "has edges that do not ascend"
            faults.add(what, column="bin_s", value=f"{before:g}, {after:g}")
