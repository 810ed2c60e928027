"""Which merged junctions change ways by too much: all ways around them are looked at.

A way of 1 km and more is made of pieces of 1 to 2 km. Each of them has changed no more than what
lies between the first and the last merged junction on it. So it is enough to look at the shortest
ways up to 2 km from the nodes before merged junctions: none of them may have changed by more
than 1 % of its length or, where it is shorter, of the kilometre that it may be a part of. It must
hold for the shortest ways before, which may not have become longer, and for those after, which may
not have been longer. With free-flow times it is the same, the rest of the kilometre being
driven as fast as the fastest ways around.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from uxsim_geo.network.distortion import LENGTH, NEAR, TIME, WITHIN
from uxsim_geo.network.incidence import Flags, Floats, Rows
from uxsim_geo.network.merged_steps import Costs, MergedSteps
from uxsim_geo.network.near_ways import Region, Ways, regions_of, ways_around

#: m and s up to which ways are followed: 2 km, and what they take at 8 m/s
REACH = {LENGTH: 2 * NEAR, TIME: 2 * NEAR / 8.0}

#: ways are held to this share of what is allowed: lengths are rounded to the millimetre
MARGIN = 0.99

#: m: junctions that change ways by less are not looked at for themselves
TINY = 0.02

#: m: of ways that have changed by less it does not matter by how much
HARDLY = 0.5

#: s per m: no way around is taken to be slower than 5 m/s
SLOWEST = 0.2


@dataclass(frozen=True)
class Seen:
    """What has been seen from each origin; (origins,) each.

    origins
        rows of places: nodes before junctions, and links from which some turn is banned there
    passed
        numbers of the junctions on the ways from each
    most
        by measure: m or s by which one of the ways below 1 km has changed most
    """

    origins: Rows
    passed: list[Rows]
    most: Costs

    @classmethod
    def nothing(cls, steps: MergedSteps) -> Seen:
        """All places that may be origins, whatever junctions are left apart."""
        ends, link, junctions = steps.graph.ends, steps.graph.link, steps.nodes()
        before = np.zeros(ends.nodes, dtype=bool)
        before[ends.start[np.isin(ends.end, junctions)]] = True
        origins = np.flatnonzero(np.append(before[ends.end[link]] & steps.held[link], before))
        most = {measure: np.zeros(len(origins)) for measure in REACH}
        return cls(origins, [np.empty(0, dtype=np.int32)] * len(origins), most)

    def pass_some(self, junctions: Flags) -> Flags:
        """Origins whose ways pass one of some junctions; (origins,)."""
        return np.array([junctions[passed].any() for passed in self.passed], dtype=bool)


@dataclass(frozen=True)
class Looked:
    """What ways are judged by while some junctions are left apart.

    apart
        whether each junction is left apart; (junctions,)
    after, change
        what steps cost then, and how much more that is than before; (steps,)
    origins
        whether each place is an origin then: before a junction, in none; (places,)
    ends
        number of the node at which each place ends, -1 where it is a junction; every place has its
        own in junctions left apart, which are several nodes; (places,)
    alike
        places to which no step passes a junction; (places,)
    least
        room for the least cost to each node, infinite whenever it is not in use; (nodes + 1,)
    """

    steps: MergedSteps
    apart: Flags
    after: Costs
    change: Costs
    origins: Flags
    ends: Rows
    alike: Flags
    least: Floats

    @classmethod
    def of(cls, steps: MergedSteps, apart: Flags) -> Looked:
        """Leave some junctions apart."""
        ends, link, junctions = steps.graph.ends, steps.graph.link, steps.nodes()
        merged, before = np.zeros((2, ends.nodes), dtype=bool)
        merged[junctions[~apart & (steps.greatest_errors() > TINY)]] = True
        before[ends.start[merged[ends.end]]] = True
        merged[junctions[~apart]] = True
        before &= ~merged
        # within one left apart, not every node leads everywhere: those who arrive stand for them
        several = np.isin(np.arange(ends.nodes), junctions)
        origins = np.append(before[ends.end[link]] & steps.held[link], before & ~several)
        node = np.append(ends.end[link], np.arange(ends.nodes))
        places = np.where(several[node], ends.nodes + np.cumsum(several[node]), node)
        places[merged[node]] = -1
        alike = np.ones(len(places), dtype=bool)
        alike[steps.graph.after[steps.junction >= 0]] = False
        after = steps.after(apart)
        change = {measure: after[measure] - steps.before[measure] for measure in REACH}
        least = np.full(int(places.max(initial=-1)) + 2, np.inf)
        return cls(steps, apart.copy(), after, change, origins, places, alike, least)


def junctions_to_leave(steps: MergedSteps, tell: Callable[[float], None]) -> tuple[Flags, Seen]:
    """Junctions to leave apart so that no way changes by more than is allowed; (junctions,).

    Of each origin's way that has changed most, the junction goes that changes it most; origins
    whose ways pass one that has gone are looked at again. Also returns what was seen in the end.
    ``tell`` is called with the share done.
    """
    apart = np.zeros(len(steps.found.merged), dtype=bool)
    seen = Seen.nothing(steps)
    regions = list(regions_of(steps.graph, steps.points, seen.origins, REACH[LENGTH]))
    rows_of = [np.searchsorted(seen.origins, region.origins) for region in regions]
    fastest: list[float] = [SLOWEST] * len(regions)
    unseen, times = np.ones(len(seen.origins), dtype=bool), 0.0
    while unseen.any():
        looked = Looked.of(steps, apart)
        now = unseen & looked.origins[seen.origins]
        unseen &= ~now
        more = np.zeros(len(apart), dtype=bool)
        for number, region in enumerate(regions):
            rows = rows_of[number][now[rows_of[number]]]
            if len(rows):
                found, fastest[number] = _look(looked, region, (seen, rows), fastest[number])
                more[found] = True
            times += 1.0 / len(regions)
            tell(1.0 - 0.4**times)  # how often is not known before
        if not more.any() and not now.any():
            break
        apart |= more
        unseen |= seen.pass_some(more)
    still = Looked.of(steps, apart).origins[seen.origins]
    for most in seen.most.values():
        most[~still] = 0.0
    return apart, seen


def _look(
    looked: Looked, region: Region, whose: tuple[Seen, Rows], fastest: float
) -> tuple[list[int], float]:
    """Look at the shortest ways from some origins, before and after.

    ``whose``: where to write what is seen, and its rows; ``fastest``: s per m of the fastest ways
    that were seen here. Returns the junctions that change ways too much, and the fastest.
    """
    seen, rows = whose
    passed: list[list[Rows]] = [[] for _ in rows]
    found: list[int] = []
    for measure, reach in REACH.items():
        seen.most[measure][rows] = 0.0
        costs = (looked.steps.before[measure], looked.after[measure])
        for sign, cost in zip((1, -1), costs, strict=True):
            ways = list(ways_around(region, seen.origins[rows], (cost, reach), looked.alike))
            if sign > 0 and measure == TIME:
                fastest = min(fastest, *(_fastest(one, looked.steps) for one in ways))
            pace = 1.0 if measure == LENGTH else fastest
            for row, one, junctions in zip(rows.tolist(), ways, passed, strict=True):
                junctions.append(_passed(looked, one))
                near, way = _changed(looked, one, (measure, sign, pace))
                seen.most[measure][row] = max(seen.most[measure][row], near)
                found += _greatest_part(looked, way, (measure, sign))
    for row, junctions in zip(rows.tolist(), passed, strict=True):
        seen.passed[row] = np.unique(np.concatenate(junctions))
    return found, fastest


def _changed(looked: Looked, ways: Ways, of: tuple[str, int, float]) -> tuple[float, list[int]]:
    """By how much one below 1 km has changed, and the way that has changed most, if by too much.

    ``of``: measure, 1 for ways that were shortest before and -1 for those that are it after, and
    the pace of the rest of the kilometre, s or m per m.
    """
    measure, sign, pace = of
    change = sign * ways.sums(looked.change[measure])
    some = np.flatnonzero(change > HARDLY * pace)
    some = some[_best(looked, ways, some)]
    if not len(some):
        return 0.0, []
    change = change[some]
    whole = ways.cost[some] + (0.0 if sign > 0 else change)
    metres = whole if measure == LENGTH else ways.sums(looked.steps.before[LENGTH])[some]
    share = change / (MARGIN * WITHIN * (whole + pace * np.maximum(NEAR - metres, 0.0)))
    worst = int(np.argmax(share))
    near = float(change[metres < NEAR].max(initial=0.0))
    return near, ways.steps_to(int(some[worst])) if share[worst] > 1.0 else []


def _fastest(ways: Ways, steps: MergedSteps) -> float:
    """Time per length of the fastest of the ways that are half a kilometre and longer, s/m."""
    metres = ways.sums(steps.before[LENGTH])
    far = metres >= NEAR / 2
    return float((ways.cost[far] / metres[far]).min()) if far.any() else SLOWEST


def _passed(looked: Looked, ways: Ways) -> Rows:
    """Numbers of the junctions on ways, once or more."""
    junction = looked.steps.junction[ways.step[1:]]
    return junction[junction >= 0].astype(np.int32)


def _best(looked: Looked, ways: Ways, some: Rows) -> Flags:
    """Which of some ways are the best of all to a node that is no merged junction."""
    if not len(some):
        return np.zeros(0, dtype=bool)
    ends, least = looked.ends[ways.place], looked.least
    np.minimum.at(least, ends, ways.cost)  # those of -1 are at the last place, of no node
    node = ends[some]
    best = (node >= 0) & (ways.cost[some] <= least[node])
    least[ends] = np.inf
    return np.asarray(best)


def _greatest_part(looked: Looked, way: list[int], of: tuple[str, int]) -> list[int]:
    """Number of the merged junction that changes a way most; ``of``: measure, and 1 or -1."""
    measure, sign = of
    junction, error = looked.steps.junction, looked.steps.error[measure]
    merged = [step for step in way if junction[step] >= 0 and not looked.apart[junction[step]]]
    parts = [(round(sign * float(error[step]), 6), -int(junction[step])) for step in merged]
    return [-max(parts)[1]] if parts else []
