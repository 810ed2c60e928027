"""Rules called at their times: what they see, what they may set, and whether it mattered."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from uxsim_geo.control.levers import Levers
from uxsim_geo.control.site import Rule, Site
from uxsim_geo.control.traffic import Counts, Traffic
from uxsim_geo.engine.application import Application
from uxsim_geo.engine.loop import sense
from uxsim_geo.engine.records import NEVER, World
from uxsim_geo.errors import Faults


@dataclass
class History:
    """What is known of a rule so far.

    last
        counts at its last call; None: it has not been called
    wrote
        it has set something to what it would not have been
    felt
        a vehicle has left the links where it is felt, or waits there, while it was in force
    left_at_begin
        vehicles that had left those links when it began
    """

    last: Counts | None = None
    wrote: bool = False
    felt: bool = False
    left_at_begin: float = 0.0


class Steering:
    """All rules of a run, and when they are due: at starts of steps.

    levers
        what control has set, in the order of the tables
    base
        what holds without control
    """

    def __init__(
        self, site: Site, rules: Sequence[Rule], base: Levers, application: Application
    ) -> None:
        self.site = site
        self.rules = list(rules)
        self.base = base
        self.levers = base.copy()
        self.application = application
        self.histories = [History() for _ in self.rules]
        self.changes: list[tuple[float, dict[str, np.ndarray]]] = []
        self._claimed = {claim.quantity for rule in self.rules for claim in rule.claims}
        self._calls: dict[int, list[int]] = {}
        self._ends: dict[int, list[int]] = {}
        for number, rule in enumerate(self.rules):
            end = self._step(min(rule.end, site.duration))
            for step in map(self._step, rule.times(site.duration)):
                if step < end:  # a time and the end may lie in one step
                    self._calls.setdefault(step, []).append(number)
            if rule.end < site.duration:
                self._ends.setdefault(end, []).append(number)
        self._due = np.array(sorted(self._calls.keys() | self._ends.keys()), np.int64)

    def _step(self, time: float) -> int:
        """Return the first step that begins at a time or later."""
        return int(np.ceil(time / self.site.step - 1e-9))

    def next_due(self, step: int) -> int:
        """Return the first step from this one on at which a rule is due; NEVER if none is."""
        place = int(np.searchsorted(self._due, step))
        return int(self._due[place]) if place < self._due.size else int(NEVER)

    def act(self, world: World, step: int) -> None:
        """Call the rules that are due at the start of a step, and put into effect what they set.

        Raises :class:`InputError` where one sets what cannot be, or what another one holds.
        """
        time = step * self.site.step
        for number in self._ends.get(step, ()):
            self._restore(world, number)
        due = dict.fromkeys(sorted(self._calls.get(step, ())))
        now = self.look(world, time) if due else None
        for number in due:
            assert now is not None
            self._call(number, now)
        self._apply(world, time, at_once=False)

    def apply_outside(self, world: World, step: int) -> None:
        """Put into effect what was set on the levers between two calls of the simulation."""
        self._apply(world, step * self.site.step, at_once=True)

    def _apply(self, world: World, time: float, *, at_once: bool) -> None:
        changed = self.levers.differences(self.application.applied)
        if not changed:
            return
        self._check(time, changed)
        self.application.apply(world, self.levers, changed, time, at_once=at_once)
        logged = {name: getattr(self.levers, name).copy() for name in changed & {"toll"}}
        if changed & {"speed_limit"}:
            logged["speed_limit"] = np.minimum(self.levers.speed_limit, self.site.free_speed)
        if logged:
            self.changes.append((time, logged))

    def look(self, world: World, time: float, before: Counts | None = None) -> Traffic:
        """Give the state of the network at the start of the step under way."""
        order = self.application.row_of_link
        links = world.links.queue[: order.size]
        standing, waiting = np.empty(order.size), np.zeros(len(self.site.node_ids))
        sense(world.links, world.routes.road, standing, waiting)
        entered, left, queue = (np.empty(order.size) for _ in range(3))
        entered[order], left[order] = links["vehicles_entered"], links["vehicles_left"]
        queue[order] = standing
        limit = np.minimum(self.levers.speed_limit, self.site.free_speed)
        phase = self.application.plans.phase_at(self.levers, time)
        count = entered - left
        for array in (entered, left, queue, count, limit, waiting, phase):
            array.flags.writeable = False
        totals = Counts(time, entered, left)
        return Traffic(
            self.site, time, count, queue, limit, waiting, phase, totals, before or totals
        )

    def _call(self, number: int, now: Traffic) -> None:
        rule, history = self.rules[number], self.histories[number]
        if history.last is None:
            history.left_at_begin = float(now.totals.left[rule.felt_at].sum())
        seen = replace(now, before=history.last or now.totals)
        before = None if rule.claims else self.levers.copy()
        rule.act(seen, self.levers)
        history.last = now.totals
        if before is not None:
            self._refuse_trespass(rule, before, now.time)
        elif not history.wrote:
            history.wrote = any(
                (claim.read(self.levers) != claim.read(self.base)).any() for claim in rule.claims
            )

    def _refuse_trespass(self, rule: Rule, before: Levers, time: float) -> None:
        """Raise where a rule without claims has written what another one holds at this time."""
        faults = Faults("control")
        written = self.levers.differences(before) & self._claimed
        for other in self.rules if written else ():
            if other.begin <= time < other.end:
                for claim in (one for one in other.claims if one.quantity in written):
                    if (claim.read(self.levers) != claim.read(before)).any():
                        what = f"{rule.name}, at {time:g} s: sets the {claim.quantity} that "
                        faults.add(f"{what}{other.name} sets too; keep one of them")
        faults.raise_if_any()

    def _restore(self, world: World, number: int) -> None:
        """Set back what a rule held that ends now."""
        for claim in self.rules[number].claims:
            claim.write(self.levers, claim.read(self.base))
            if claim.quantity == "plan":
                self.levers.phase[claim.positions] = -1
        self._note_felt(world, number)

    def _note_felt(self, world: World, number: int) -> None:
        history, felt_at = self.histories[number], self.rules[number].felt_at
        if history.last is None:
            return
        order = self.application.row_of_link
        links = world.links.queue[: order.size]
        here = np.isin(order, felt_at)
        left = float(links["vehicles_left"][here].sum())
        waits = (links["vehicles_entered"] > links["vehicles_left"])[here].any()
        history.felt = history.felt or bool(waits) or left > history.left_at_begin

    def _check(self, time: float, changed: set[str]) -> None:
        """Raise where the levers that have changed hold what cannot be."""
        faults = Faults(f"control, at {time:g} s")
        ids = {"links": self.site.link_ids, "nodes": self.site.node_ids}
        self.levers.add_faults(faults, ids, changed)
        plan, phase = self.levers.plan, self.levers.phase
        plans = self.application.plans
        own = np.append(plans.node_of_plan, -1)[np.clip(plan, -1, plans.node_of_plan.size)]
        for node in np.flatnonzero((plan != -1) & (own != np.arange(plan.size))):
            what = f"node {self.site.node_ids[node]} has no such plan; -1 is none"
            faults.add(what, column="plan", value=int(plan[node]))
        faults.raise_if_any()
        counts = plans.phase_counts[plan]
        for node in np.flatnonzero((phase >= counts) & (phase >= 0)):
            what = f"node {self.site.node_ids[node]} has no such phase: its plan has {counts[node]}"
            faults.add(what, column="phase", value=int(phase[node]))
        faults.raise_if_any()

    def notes(self, world: World) -> tuple[str, ...]:
        """Say which rules have changed nothing for anybody; not of those still to begin."""
        found = []
        step = int(world.links.clock["step"][0])
        over = step >= world.calendar.bucket.size
        for number, (rule, history) in enumerate(zip(self.rules, self.histories, strict=True)):
            if rule.claims and (over or history.last is not None):
                if rule.end > (step - 1) * self.site.step:  # it has not been set back before now
                    self._note_felt(world, number)
                if not history.wrote:
                    found.append(f"{rule.name} never took effect: it never changed anything")
                elif not history.felt and rule.felt_at.size:
                    what = "nobody was there while it was in force"
                    found.append(f"{rule.name} never took effect: {what}")
        return tuple(found)


def base_levers(site: Site) -> Levers:
    """Return what holds without control."""
    links, nodes, classes = len(site.link_ids), len(site.node_ids), len(site.class_names)
    return Levers(
        {
            "exit_capacity": site.capacity,
            "entry_capacity": site.capacity,
            "entry_closed": np.zeros(links, bool),
            "exit_closed": np.zeros(links, bool),
            "speed_limit": site.free_speed,
            "merge_priority": site.merge_priority,
            "toll": np.zeros(links),
            "banned": np.zeros((classes, links), bool),
            "advice": np.zeros((classes, links)),
            "node_capacity": np.full(nodes, np.inf),
            "plan": np.full(nodes, -1, np.int64),
            "phase": np.full(nodes, -1, np.int64),
        }
    )
