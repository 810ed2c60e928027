"""Signal plans as the engine reads them: a cycle and its greens at the exit of every link."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from uxsim_geo.control.levers import Levers
from uxsim_geo.control.signals import Signal
from uxsim_geo.control.site import Site, as_ids
from uxsim_geo.engine import records

# A phase that is held is a green of half a cycle that lasts for 31 years.
_HELD_CYCLE = 1e9  # s
_HELD_GREEN = 5e8  # s

Ints = npt.NDArray[np.int64]
Records = npt.NDArray[Any]


class Plans:
    """All plans of a run; each has a row for every link that it holds.

    phase_counts
        (plans + 1,) phases of each plan, and of none
    node_of_plan
        (plans,) the node that each plan is for
    greens
        records GREEN: the first is that of a phase that is held, then those of every row
    """

    def __init__(self, site: Site, plans: Sequence[Signal], position_of_row: Ints) -> None:
        self.site = site
        rows = [
            (number, site.link_position[link_id], plan, link_id, own)
            for number, plan in enumerate(plans)
            for link_id, own in plan.greens().items()
        ]
        counts = np.array([len(own) for *_, own in rows], np.int64)
        self.plan = np.array([number for number, *_ in rows], np.int64)
        self.node = site.to_node[[row[1] for row in rows]] if rows else np.empty(0, np.int64)
        self.link = position_of_row[[row[1] for row in rows]] if rows else np.empty(0, np.int64)
        self.cycle = np.array([plan.cycle for _, _, plan, _, _ in rows])
        self.offset = np.array([plan.offset for _, _, plan, _, _ in rows])
        self.all_red = np.array([plan.all_red for _, _, plan, _, _ in rows])
        self.last_green = 1 + np.cumsum(counts)
        self.first_green = self.last_green - counts
        times = [(0.0, _HELD_GREEN), *(green for *_, own in rows for green in own)]
        self.greens: Records = np.array(times, records.GREEN)
        most = max((len(plan.phases) for plan in plans), default=0)
        self.in_phase = np.zeros((len(rows), most), bool)
        for row, (_, _, plan, link_id, _) in enumerate(rows):
            for number, phase in enumerate(plan.phases):
                self.in_phase[row, number] = link_id in as_ids(phase.links)
        self._ends = _Ends(plans, most)
        self.phase_counts = np.array([*(len(plan.phases) for plan in plans), 0], np.int64)
        self.node_of_plan = np.array([site.node_position[plan.node_id] for plan in plans], np.int64)
        self._is_first = np.zeros(self.link.size, bool)  # of the rows of its link
        self._is_first[np.unique(self.link, return_index=True)[1]] = True

    def phase_at(self, levers: Levers, time: float) -> Ints:
        """Return the phase of every node, -1 where all is red or there is no signal."""
        phase = np.where(levers.plan >= 0, levers.phase, -1)
        nodes = np.flatnonzero((levers.plan >= 0) & (phase < 0))
        if nodes.size:
            ends = self._ends
            plan = levers.plan[nodes]
            at = np.mod(time - ends.offset[plan], ends.cycle[plan])[:, None]
            running = (at >= ends.starts[plan]) & (at < ends.ends[plan])
            phase[nodes] = np.where(running.any(axis=1), running.argmax(axis=1), -1)
        return phase

    def put(self, queue: Records, levers: Levers, before: Levers, time: float) -> Ints:
        """Put the plans and phases in force into the links of all nodes where they have changed.

        Returns these links.
        """
        changed = (levers.plan != before.plan) | (levers.phase != before.phase)
        concerned = changed[self.node]
        queue["cycle"][self.link[concerned]] = 0.0
        rows = np.flatnonzero(concerned & (levers.plan[self.node] == self.plan))
        held = levers.phase[self.node[rows]]
        if (held < 0).any():
            self._let_run(queue, rows[held < 0])
        if (held >= 0).any():
            self._hold(queue, rows[held >= 0], levers, before, time)
        links: Ints = self.link[concerned & self._is_first]
        return links

    def _let_run(self, queue: Records, rows: Ints) -> None:
        link = self.link[rows]
        queue["cycle"][link], queue["offset"][link] = self.cycle[rows], self.offset[rows]
        queue["first_green"][link] = self.first_green[rows]
        queue["last_green"][link] = self.last_green[rows]

    def _hold(
        self, queue: Records, rows: Ints, levers: Levers, before: Levers, time: float
    ) -> None:
        """Hold phases: links in them get green, after all-red unless they had it before."""
        link, node = self.link[rows], self.node[rows]
        green = self.in_phase[rows, levers.phase[node]]
        shown = self.phase_at(before, time)[node]  # whether held or run by the plan itself
        had_green = (before.plan[node] == levers.plan[node]) & (shown >= 0)
        had_green &= self.in_phase[rows, shown]
        queue["cycle"][link] = _HELD_CYCLE
        queue["offset"][link] = time + np.where(had_green, 0.0, self.all_red[rows])
        queue["first_green"][link] = 0
        queue["last_green"][link] = np.where(green, 1, 0)


class _Ends:
    """When phases begin and end in their cycle, s; shape (plans, most phases), padded with inf."""

    def __init__(self, plans: Sequence[Signal], most: int) -> None:
        self.starts = np.full((len(plans), most), np.inf)
        self.ends = np.full((len(plans), most), np.inf)
        self.cycle = np.array([plan.cycle for plan in plans])
        self.offset = np.array([plan.offset for plan in plans])
        for number, plan in enumerate(plans):
            begin = 0.0
            for place, phase in enumerate(plan.phases):
                self.starts[number, place] = begin
                self.ends[number, place] = begin + phase.duration
                begin += phase.duration + plan.all_red
