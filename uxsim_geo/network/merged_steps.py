"""What each step of a way costs before junctions are merged, and after.

Merging leaves open what was open: the ways of both networks are the same, over the same links,
and differ in what the links and the ways through junctions are long. So one graph stands for
both, that of the merged network, with two costs a step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from uxsim_geo.network.distortion import LENGTH, TIME
from uxsim_geo.network.headings import metric_points
from uxsim_geo.network.incidence import Flags, Floats, Rows, turns_of
from uxsim_geo.network.junctions import Found, merged_of
from uxsim_geo.network.merged_tables import lengths_and_speeds
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.rows import numbers
from uxsim_geo.network.squares import points_by_road
from uxsim_geo.network.turn_graph import TurnGraph, turn_graph

#: by measure: m or s of each step, or of each link
Costs = dict[str, Floats]


@dataclass(frozen=True)
class MergedSteps:
    """The turn graph of a network with all its junctions merged.

    found
        the junctions, in the network before
    points
        x and y of the nodes of the merged network, m; where that is not known, such as
        :func:`points_by_road` gives; (nodes, 2)
    link
        row there of each link of the merged network; (links,)
    held
        whether some turn, other than back, is banned from each of its links; (links,)
    junction
        number of the junction in ``found.merged`` that each step passes, -1 for none; (steps,)
    before
        what each step costs before merging: the link and the way through the junction; (steps,)
    within, error
        what of that is within the junction, and what merging adds to it; (steps,)
    """

    found: Found
    graph: TurnGraph
    points: Floats
    link: Rows
    held: Flags
    junction: Rows
    before: Costs
    within: Costs
    error: Costs

    @classmethod
    def of(cls, found: Found) -> MergedSteps:
        """Merge all junctions that were found."""
        merged = merged_of(found, Notes())
        graph = turn_graph(merged)
        row = {link_id: row for row, link_id in enumerate(found.network.links["link_id"])}
        link = np.array([row[link_id] for link_id in merged.links["link_id"]], dtype=np.int64)
        ways = _ways(found)
        pairs = zip(*_links_of_steps(graph, link), strict=True)
        rows = [ways.get(pair, (-1, 0.0, 0.0, 0.0, 0.0)) for pair in pairs]
        table = np.array(rows).reshape(-1, 5)
        within = {LENGTH: table[:, 1], TIME: table[:, 2]}
        error = {LENGTH: table[:, 3], TIME: table[:, 4]}
        length, speed = (numbers(found.network.links[name]) for name in ("length", "free_speed"))
        after = link[graph.link[graph.after]]
        before = {LENGTH: length[after] + within[LENGTH]}
        before[TIME] = (length / speed)[after] + within[TIME]
        junction = table[:, 0].astype(np.int64)
        points = metric_points(merged)
        if points is None:
            points = points_by_road(graph.ends, length[link])
        turns = turns_of(merged, graph.ends)
        held = np.zeros(len(link), dtype=bool)
        held[turns.before[turns.banned & ~turns.back]] = True
        return cls(found, graph, points, link, held, junction, before, within, error)

    def after(self, apart: Flags) -> Costs:
        """What each step costs if all junctions but those ``apart`` are merged; (steps,)."""
        merged = [one for one, left in zip(self.found.merged, apart, strict=True) if not left]
        length, speed = lengths_and_speeds(self.found.network.links, merged)
        after = self.link[self.graph.link[self.graph.after]]
        left = (self.junction >= 0) & apart[self.junction]
        return {
            measure: cost[after] + np.where(left, self.within[measure], 0.0)
            for measure, cost in ((LENGTH, length), (TIME, length / speed))
        }

    def greatest_errors(self) -> Floats:
        """By how much each junction changes a way through it at most, m; (junctions,).

        An error of time counts as what is driven in it at 10 m/s.
        """
        passing = np.flatnonzero(self.junction >= 0)
        off = np.maximum(np.abs(self.error[LENGTH]), 10.0 * np.abs(self.error[TIME]))
        greatest = np.zeros(len(self.found.merged))
        np.maximum.at(greatest, self.junction[passing], off[passing])
        return greatest

    def nodes(self) -> Rows:
        """Row in the merged network of the node of each junction; (junctions,)."""
        row = np.full(len(self.found.network.links), -1)
        row[self.link] = np.arange(len(self.link))
        # of each junction a link out of it, which is there also where no step passes it
        exits = np.array([min(one.junction.exits) for one in self.found.merged], dtype=np.int64)
        nodes: Rows = self.graph.ends.start[row[exits]]
        return nodes


def _ways(found: Found) -> dict[tuple[int, int], tuple[float, ...]]:
    """By first and last link of ways through junctions: its number, m and s, and their errors."""
    ways: dict[tuple[int, int], tuple[float, ...]] = {}
    for number, one in enumerate(found.merged):
        length, time = one.additions.length, one.additions.time
        for (a, b), (metres, seconds) in one.junction.ways.items():
            errors = (length[a] + length[b] - metres, time[a] + time[b] - seconds)
            ways[a, b] = (number, metres, seconds, *errors)
    return ways


def _links_of_steps(graph: TurnGraph, link: Rows) -> tuple[list[int], list[int]]:
    """Rows of the links before and after each step, -1 before those that start at a node."""
    of_place = np.append(link[graph.link], np.full(graph.ends.nodes, -1))
    return of_place[graph.before].tolist(), of_place[graph.after].tolist()
