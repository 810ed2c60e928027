"""When every platoon is at any place of its link: positions turned round.

In :mod:`uxsim_geo.analysis.passages` the position of platoon k is the least of some ways, none of
which ever goes back. It is at place x when the last of them is, and of those that an exit sets
free only one matters: that of the nearest platoon a ahead behind which there is no room for k
beyond x, (C_k − C_a)/(mκ) > L − x. The exits of others ahead of that one are felt earlier. So

    t_k(x) = max( e_k + x/u,  s_a + (C_k − C_a) τ/m + (x − L + (C_k − C_a)/(mκ)) / u )

Where limits changed during the run the moment is found by bisection.
"""

from __future__ import annotations

import numpy as np

from uxsim_geo.analysis.passages import Passages
from uxsim_geo.analysis.types import Booleans, Floats, Integers

#: halvings of an interval of time that leave no more than rounding
HALVINGS = 64


def times_at(passages: Passages, rows: Integers, places: Floats) -> Floats:
    """When passage ``rows[i]`` is ``places[i]`` m from the start of its link, s; shape (rows,).

    inf where it has not come so far by the end of the simulation.
    """
    times = _by_formula(passages, rows, places)
    limited = _on_limited_links(passages)[rows]
    if limited.any():
        times[limited] = _by_bisection(passages, rows[limited], places[limited])
    return np.where(times > passages.end, np.inf, times)


def _by_formula(passages: Passages, rows: Integers, places: Floats) -> Floats:
    link, geometry = passages.link[rows], passages.geometry
    length, speed = geometry.length[link], passages.free_speed[rows]
    free = passages.enter[rows] + places / speed
    # vehicles for whom there is room between x and the end of the link
    room = (length - places) / geometry.space_shift[link]
    begin = passages.first[link]
    before = np.concatenate(([0.0], np.cumsum(passages.vehicles)))[:-1]
    nearest = np.searchsorted(before, before[rows] - room, side="left") - 1
    held = nearest >= begin
    nearest = np.where(held, nearest, rows)
    between = passages.ahead[rows] - passages.ahead[nearest]
    way = places - length + between * geometry.space_shift[link]
    since = passages.exit[nearest] + between * geometry.time_shift[link]
    times: Floats = np.where(held, np.maximum(free, since + way / speed), free)
    return times


def _by_bisection(passages: Passages, rows: Integers, places: Floats) -> Floats:
    before = passages.enter[rows].copy()
    after = np.minimum(passages.exit[rows], passages.end)
    reached = passages.positions(rows, after) >= places
    for _ in range(HALVINGS):
        middle = (before + after) / 2
        there = passages.positions(rows, middle) >= places
        after = np.where(there, middle, after)
        before = np.where(there, before, middle)
    return np.where(reached, after, np.inf)


def _on_limited_links(passages: Passages) -> Booleans:
    """Whether speeds differ on the link of each passage."""
    if passages.held_by is None:
        return np.zeros(len(passages.link), bool)
    differs = passages.free_speed != passages.geometry.free_speed[passages.link]
    limited: Booleans = np.isin(passages.link, passages.link[differs])
    return limited
