"""What speed limits that change during a run make of the free speed of every single passage.

A limit holds for those who enter a link while it is in force, and for their whole way over it.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from uxsim_geo.analysis.types import Floats, Integers


def own_free_speeds(
    link: Integers, enter: Floats, free_speed: Floats, limits: pd.DataFrame, limited: Integers
) -> Floats:
    """Free speed of every passage, m/s: the limit in force at its entry, else that of its link.

    ``link`` (row of the links table, ascending) and ``enter`` (s) are of the passages,
    ``free_speed`` (m/s) of the links. ``limits`` is the table ``speed_limits`` of a
    :class:`uxsim_geo.result.Result`, ``limited`` the row of the link that each of its rows names.
    A limit counts from its very moment on.
    """
    own = free_speed[link]
    if not len(limits):
        return own
    time, speed = (limits[name].to_numpy(float) for name in ("time_s", "speed_limit_m_s"))
    order = np.lexsort((time, limited))
    time, speed = time[order], speed[order]
    links, changes = np.unique(limited, return_counts=True)
    last = np.cumsum(changes)
    for one, since, until in zip(links, last - changes, last, strict=True):
        begin, end = np.searchsorted(link, (one, one + 1))
        number = np.searchsorted(time[since:until], enter[begin:end], side="right")
        own[begin:end] = np.append(free_speed[one], speed[since:until])[number]
    return own


def last_no_faster(own: Floats, first: Integers, links: Integers) -> Integers:
    """Of every passage, the last one before it on its link that is no faster; -1: there is none.

    Of those that entered in a row with the same free speed, each keeps clear of the one before
    anyway: for all of them it is the last one before that row. ``own`` (m/s) are the free speeds of
    the passages, ``first`` tells per link, and one more, where its passages begin, ``links`` on
    which links speeds differ at all.
    """
    found = np.full(len(own), -1, np.int64)
    for link in links:
        begin, end = int(first[link]), int(first[link + 1])
        starts = begin + np.flatnonzero(np.diff(own[begin:end], prepend=np.nan))
        ends = np.append(starts[1:], end)[: len(starts)]
        last: list[int] = []  # of the rows before, those not followed by a slower one
        for row_begin, row_end in zip(starts, ends, strict=True):
            while last and own[last[-1]] > own[row_begin]:
                last.pop()
            found[row_begin:row_end] = last[-1] if last else -1
            last.append(int(row_end) - 1)
    return found
