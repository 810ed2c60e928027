"""Shortest ways from places to what lies around them, region by region.

A search over a whole city costs as much memory as the city has links, however near one looks;
so origins that lie together are looked at in the part of the network around them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from uxsim_geo.network.incidence import Flags, Floats, Grouped, Rows
from uxsim_geo.network.squares import squares
from uxsim_geo.network.turn_graph import TurnGraph

#: m: origins within a square of this size have one region
CELL = 2000.0

#: ways that are searched together: origins times places, each taking 12 bytes
AT_ONCE = 2_000_000


@dataclass(frozen=True)
class Region:
    """Some origins and what lies around them.

    origins
        rows of places of the whole graph
    places, steps
        rows of the places and steps that lie here, the steps sorted by the places before and after
    before, after
        which of the region's places those of each of its steps are; (steps,)
    last
        of each place a step to it, as a number in ``steps``; (places,)
    """

    origins: Rows
    places: Rows
    steps: Rows
    before: Rows
    after: Rows
    last: Rows

    @classmethod
    def of(cls, graph: TurnGraph, origins: Rows, places: Rows, steps: Rows) -> Region:
        """Number places and steps anew."""
        before, after = (
            np.searchsorted(places, ends[steps]) for ends in (graph.before, graph.after)
        )
        last = np.zeros(len(places), dtype=np.int64)
        last[after] = np.arange(len(steps))
        return cls(origins, places, steps, before, after, last)


@dataclass(frozen=True)
class Ways:
    """Shortest ways from one place to those around it, the first to itself; (ways,) each.

    place
        row of the last place of each, in the whole graph
    cost
        of each
    step
        row of its last step, in the whole graph
    previous
        number of the way that it prolongs, 0 for the first
    """

    place: Rows
    cost: Floats
    step: Rows
    previous: Rows

    def sums(self, of_step: Floats) -> Floats:
        """Sum over the steps of each way; ``of_step`` may have a column for each of several."""
        total, previous = of_step[self.step], self.previous
        total[0] = 0.0
        # every round doubles how far back one has looked
        while previous.any():
            total = total + total[previous]
            previous = previous[previous]
        return np.asarray(total)

    def steps_to(self, way: int) -> list[int]:
        """Rows of the steps of a way, from the last to the first."""
        found = []
        while way:
            found.append(int(self.step[way]))
            way = int(self.previous[way])
        return found


def regions_of(graph: TurnGraph, points: Floats, origins: Rows, reach: float) -> Iterator[Region]:
    """Part origins by where they lie, each part with what is nearer to it than ``reach``, m.

    ``points``: x and y of each node. ``origins``: rows of places, a link standing for those who
    have come along it.
    """
    ends = np.concatenate([graph.ends.end[graph.link], np.arange(graph.ends.nodes)])
    at_node, of_place = Grouped.of(ends, graph.ends.nodes), Grouped.of(graph.before, len(ends))
    for part, nodes in squares(points, ends[origins], CELL, reach):
        places = np.sort(at_node.rows_of(nodes))
        steps = of_place.rows_of(places)
        at = np.minimum(np.searchsorted(places, graph.after[steps]), len(places) - 1)
        steps = steps[places[at] == graph.after[steps]]
        order = np.lexsort((graph.after[steps], graph.before[steps]))
        yield Region.of(graph, origins[part], places, steps[order])


def ways_around(
    region: Region, origins: Rows, costs: tuple[Floats, float], alike: Flags
) -> Iterator[Ways]:
    """Shortest ways within a region from each of some of its origins.

    ``costs``: of each step of the whole graph, above 0, and up to which ways are looked for;
    ``alike``: places to which all steps are alike in whatever is asked of them.
    """
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import dijkstra

    (cost, limit), number = costs, len(region.places)
    steps = csr_array((cost[region.steps], (region.before, region.after)), shape=(number, number))
    keys = region.before * number + region.after
    one_step = alike[region.places]
    starts, together = np.searchsorted(region.places, origins), max(AT_ONCE // number, 1)
    for first in range(0, len(starts), together):
        some = starts[first : first + together]
        found, previous = dijkstra(steps, indices=some, limit=limit, return_predecessors=True)
        for start, least, before in zip(some.tolist(), found, previous, strict=True):
            yield _ways(region, start, (least, before), (keys, one_step))


def _ways(region: Region, start: int, tree: tuple[Floats, Rows], which: tuple[Rows, Flags]) -> Ways:
    (cost, before), (keys, one_step) = tree, which
    reached = np.isfinite(cost)
    reached[start] = False
    place = np.append(start, np.flatnonzero(reached))
    number = np.zeros(len(cost), dtype=np.int64)
    number[place] = np.arange(len(place))
    last = before[place].astype(np.int64)
    last[0] = start
    step = region.last[place]
    several = np.flatnonzero(~one_step[place])
    step[several] = np.searchsorted(keys, last[several] * len(cost) + place[several])
    step[0] = 0
    return Ways(region.places[place], cost[place], region.steps[step], number[last])
