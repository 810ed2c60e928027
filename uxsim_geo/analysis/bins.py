"""Time bins that somebody asks for, and which of them a moment lies in."""

from __future__ import annotations

import numpy as np

from uxsim_geo.analysis.link_states import bin_edges
from uxsim_geo.analysis.passages import Floats, Integers
from uxsim_geo.errors import Faults

#: more than anybody looks at; their edges alone would fill the memory at some point
MOST_BINS = 1_000_000


def checked_bin_edges(duration: float, bin_s: float) -> Floats:
    """Edges of the time bins, s: as :func:`uxsim_geo.analysis.link_states.bin_edges`.

    Raises :class:`uxsim_geo.errors.InputError` unless ``bin_s`` is finite, above 0 and such that
    there are no more than a million bins.
    """
    faults = Faults()
    if not 0 < bin_s < float("inf"):
        faults.add("must be a finite number of seconds above 0", column="bin_s", value=bin_s)
    elif duration / bin_s > MOST_BINS:
        shortest = duration / MOST_BINS
        what = f"makes more than {MOST_BINS:,} bins: take {shortest:g} s or more"
        faults.add(what, column="bin_s", value=bin_s)
    faults.raise_if_any()
    return bin_edges(duration, bin_s)


def bin_of(times: Floats, edges: Floats) -> Integers:
    """The bin [begin, end) in which each moment lies; the last one holds its end too.

    ``times``: s, from the first edge to the last.
    """
    bins = np.searchsorted(edges, times, side="right") - 1
    return np.minimum(bins, len(edges) - 2).astype(np.int64)
