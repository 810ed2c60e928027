"""The signal tables of a GMNS folder to fixed-time signal plans.

A phase lasts min_green and then clearance, in which nobody has green. The phases of a ring follow
one another by barrier and position; rings run at the same time and reach each barrier together. A
link has green whenever one of its movements has.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from uxsim_geo.control.signals import Phase, Signal
from uxsim_geo.errors import Faults
from uxsim_geo.network.both_ways import REVERSE
from uxsim_geo.network.csv_table import (
    CsvTable,
    add_cell_faults,
    has_columns,
    id_cells,
    is_missing,
    number_column,
)
from uxsim_geo.network.gmns_nodes import add_id_faults, add_reference_faults
from uxsim_geo.network.gmns_tables import read_table, table_path
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes

#: columns without which the tables say nothing
NEEDED = {
    "signal_timing_plan": ("timing_plan_id", "controller_id"),
    "signal_timing_phase": (
        "timing_phase_id",
        "timing_plan_id",
        "min_green",
        "ring",
        "barrier",
        "position",
    ),
    "signal_phase_mvmt": ("timing_phase_id", "mvmt_id"),
    "movement": ("mvmt_id", "node_id", "ib_link_id"),
    "signal_coordination": ("timing_plan_id", "offset"),
}

#: s: ring lengths and cycles may differ so little
ROUNDING = 1e-6

RIGHT_ON_RED = "rtor"

#: where in its phase a plan is coordinated
BEGIN_OF_GREEN, BEGIN_OF_YELLOW = "begin_of_green", "begin_of_yellow"


class Signals(NamedTuple):
    """Signal plans, as measures of control, and what was assumed in reading them."""

    plans: tuple[Signal, ...]
    notes: pd.DataFrame


@dataclass(frozen=True)
class Timing:
    """A phase of a plan: when it begins in the cycle, and how long it is green and cleared, s."""

    phase_id: str
    ring: float
    barrier: float
    begin: float
    green: float
    clearance: float

    @property
    def end(self) -> float:
        """When the next phase of its ring begins, s after the cycle does."""
        return self.begin + self.green + self.clearance


def read_gmns_signals(
    folder: Path, network: Network, *, timing_plans: Collection[str] | None = None
) -> Signals:
    """Read the signal plans of a GMNS folder, for the nodes and links of ``network``.

    ``timing_plans``: the timing_plan_ids to be read, where a controller has several, one for each
    time of the day; None: all. Offsets count from the start of the simulation.

    Raises :class:`uxsim_geo.errors.InputError` with all that is wrong in the tables.
    """
    faults = Faults()
    tables = {name: read_table(folder, name, faults) for name in NEEDED if _wanted(folder, name)}
    faults.raise_if_any()
    found = {name: table for name, table in tables.items() if table is not None}
    own = {name: Faults(str(table.source)) for name, table in found.items()}
    complete = [has_columns(table, NEEDED[name], own[name]) for name, table in found.items()]
    notes = Notes()
    signals: list[Signal] = []
    if all(complete):
        _add_reference_faults(found, own)
        chosen = _chosen(found["signal_timing_plan"], timing_plans, own["signal_timing_plan"])
        timings = _timings(found["signal_timing_phase"], own["signal_timing_phase"], notes)
        greens = _greens(found, network, notes)
        offsets = _offsets(found.get("signal_coordination"), own, timings)
        if not any(one.found for one in own.values()):
            for row in chosen:
                plan = _plan(found["signal_timing_plan"], row, own["signal_timing_plan"])
                signals += _signals(plan, timings, greens, offsets, own["signal_timing_phase"])
    for one in own.values():
        faults.extend(one)
    faults.raise_if_any()
    return Signals(tuple(signals), notes.table())


def _wanted(folder: Path, name: str) -> bool:
    return name != "signal_coordination" or table_path(folder, name).is_file()


def _add_reference_faults(tables: dict[str, CsvTable], faults: dict[str, Faults]) -> None:
    """Ids that stand twice, and those that refer to what is not there."""
    for name, column in (
        ("signal_timing_plan", "timing_plan_id"),
        ("signal_timing_phase", "timing_phase_id"),
        ("movement", "mvmt_id"),
    ):
        add_id_faults(tables[name], column, faults[name])
    for name, column, known in (
        ("signal_timing_phase", "timing_plan_id", "signal_timing_plan"),
        ("signal_phase_mvmt", "timing_phase_id", "signal_timing_phase"),
        ("signal_phase_mvmt", "mvmt_id", "movement"),
        ("signal_coordination", "timing_plan_id", "signal_timing_plan"),
    ):
        if name in tables:
            ids = pd.Series(id_cells(tables[known], column), dtype="str", name=column)
            add_reference_faults(tables[name], column, ids, faults[name])


class Plan(NamedTuple):
    """A row of signal_timing_plan: its id, its cycle (s; NaN: not stated), when it holds (s)."""

    plan_id: str
    line: int
    cycle: float
    begin: float
    end: float


def _chosen(table: CsvTable, plans: Collection[str] | None, faults: Faults) -> list[int]:
    """The rows of the plans to be read: one a controller, unless they say when they hold."""
    ids, controllers = id_cells(table, "timing_plan_id"), id_cells(table, "controller_id")
    unknown = [] if plans is None else sorted(set(plans) - set(map(str, ids)))
    for plan in unknown:
        faults.add("there is no such plan", column="timing_plan_id", value=plan)
    chosen = [row for row, plan in enumerate(ids) if plans is None or plan in plans]
    timed = "uxsim_begin_s" in table
    by_controller: dict[str | None, list[str]] = {}
    for row in chosen:
        by_controller.setdefault(controllers[row], []).append(str(ids[row]))
    for controller, own in by_controller.items():
        if len(own) > 1 and not timed:
            what = f"controller {controller} has the plans {', '.join(own)}"
            faults.add(f"{what}: state which to read (timing_plans)", column="controller_id")
    return chosen


def _plan(table: CsvTable, row: int, faults: Faults) -> Plan:
    def value(name: str, missing: float) -> float:
        number = float(number_column(table.rows(np.arange(len(table)) == row), name, faults)[0])
        return missing if math.isnan(number) else number

    return Plan(
        str(id_cells(table, "timing_plan_id")[row]),
        table.lines[row],
        value("cycle_length", math.nan),
        value("uxsim_begin_s", 0.0),
        value("uxsim_end_s", math.inf),
    )


def _timings(table: CsvTable, faults: Faults, notes: Notes) -> dict[str, list[Timing]]:
    """The phases of each plan with their times, ring by ring in their order."""
    names = ("min_green", "clearance", "ring", "barrier", "position", "max_green")
    values = {name: number_column(table, name, faults) for name in names}
    for name in ("min_green", "clearance"):
        add_cell_faults(faults, table, values[name] < 0, name, "must not be negative")
    for name in ("min_green", "ring", "barrier", "position"):
        missing = np.array([is_missing(cell) for cell in table.cells(name)], dtype=bool)
        add_cell_faults(faults, table, missing, name, "needs a value")
    actuated = int((values["max_green"] > values["min_green"]).sum())
    if actuated:
        note = "phases that detectors may prolong: each is as long as its min_green; value: phases"
        notes.add("actuated signals", note, element="node", severity="warning", value=actuated)
    phases = pd.DataFrame(values).fillna(0.0)
    phases["phase_id"] = id_cells(table, "timing_phase_id")
    phases["plan_id"] = id_cells(table, "timing_plan_id")
    return {
        str(plan_id): _plan_timings(own) for plan_id, own in phases.groupby("plan_id", sort=False)
    }


def _plan_timings(phases: pd.DataFrame) -> list[Timing]:
    timings: list[Timing] = []
    for ring, own in phases.groupby("ring"):
        begin = 0.0
        for row in own.sort_values(["barrier", "position"], kind="stable").itertuples():
            green, clearance = float(row.min_green), float(row.clearance)  # type: ignore[arg-type]
            place = (float(ring), float(row.barrier))  # type: ignore[arg-type]
            timings.append(Timing(str(row.phase_id), *place, begin, green, clearance))
            begin = timings[-1].end
    return timings


def _greens(
    tables: dict[str, CsvTable], network: Network, notes: Notes
) -> dict[str, dict[str, list[str]]]:
    """By phase and node, the in-links that have green, in the order of the rows."""
    movement, table = tables["movement"], tables["signal_phase_mvmt"]
    columns = (id_cells(movement, name) for name in ("mvmt_id", "node_id", "ib_link_id"))
    of_movement = {mvmt: (node, link) for mvmt, node, link in zip(*columns, strict=True)}
    ends = dict(zip(network.links["link_id"], network.links["to_node_id"], strict=True))
    greens: dict[str, dict[str, list[str]]] = {}
    others = 0
    rows = zip(
        id_cells(table, "timing_phase_id"),
        id_cells(table, "mvmt_id"),
        table.cells("protection"),
        strict=True,
    )
    for phase, mvmt, protection in rows:
        node, link = of_movement.get(mvmt, (None, None))
        names = (link, f"{link}{REVERSE}")
        here = next((one for one in names if one in ends and ends[one] == node), None)
        if here is None or protection.strip().lower() == RIGHT_ON_RED:
            others += 1
            continue
        own = greens.setdefault(str(phase), {}).setdefault(str(node), [])
        if here not in own:
            own.append(here)
    if others:
        note = "on crossings, on links left out, or on turns on red: passed over; value: rows"
        notes.add("signal_phase_mvmt", note, element="node", value=others)
    return greens


def _offsets(
    table: CsvTable | None, faults: dict[str, Faults], timings: dict[str, list[Timing]]
) -> dict[str, float]:
    """When the first cycle of each plan begins, s: its offset less the start of what it is for."""
    if table is None:
        return {}
    own = faults["signal_coordination"]
    values = np.nan_to_num(number_column(table, "offset", own))
    offsets: dict[str, float] = {}
    rows = zip(
        id_cells(table, "timing_plan_id"),
        id_cells(table, "coord_phase"),
        table.cells("coord_ref_to"),
        values.tolist(),
        table.lines,
        strict=True,
    )
    for plan, phase, reference, offset, line in rows:
        at = reference.strip().lower() or BEGIN_OF_GREEN
        if at not in (BEGIN_OF_GREEN, BEGIN_OF_YELLOW):
            what = f"must be {BEGIN_OF_GREEN} or {BEGIN_OF_YELLOW}"
            own.add(what, line=line, column="coord_ref_to", value=reference)
            continue
        known = [one for one in timings.get(str(plan), []) if phase in (None, one.phase_id)]
        if not known:
            what = "is no timing_phase_id of the plan"
            own.add(what, line=line, column="coord_phase", value=phase)
            continue
        later = known[0].green if at == BEGIN_OF_YELLOW else 0.0
        offsets[str(plan)] = offset - (known[0].begin + later)
    return offsets


def _signals(
    plan: Plan,
    timings: dict[str, list[Timing]],
    greens: dict[str, dict[str, list[str]]],
    offsets: dict[str, float],
    faults: Faults,
) -> list[Signal]:
    """One signal a node of the plan's controller."""
    own = [timing for timing in timings.get(plan.plan_id, []) if timing.end > timing.begin]
    if not _add_time_faults(plan, own, faults):
        return []
    nodes = dict.fromkeys(node for one in own for node in greens.get(one.phase_id, {}))
    offset = offsets.get(plan.plan_id, 0.0)
    signals = []
    for node in nodes:
        phases, all_red = _phases(own, {key: at.get(node, []) for key, at in greens.items()})
        signals.append(Signal(node, phases, offset, all_red, plan.begin, plan.end))
    return signals


def _add_time_faults(plan: Plan, timings: list[Timing], faults: Faults) -> bool:
    """Note rings that do not meet at a barrier, and a cycle of another length; True: neither."""
    ends: dict[float, dict[float, float]] = {}
    for timing in timings:
        ends.setdefault(timing.barrier, {})[timing.ring] = timing.end
    for barrier, by_ring in ends.items():
        told = ", ".join(f"{end:g} s" for end in by_ring.values())
        if max(by_ring.values()) - min(by_ring.values()) > ROUNDING:
            what = f"the rings of plan {plan.plan_id} are at barrier {barrier:g} after {told}"
            faults.add(f"{what}: they must be there together", column="ring")
            return False
    length = max((timing.end for timing in timings), default=0.0)
    if timings and abs(length - plan.cycle) > ROUNDING:
        what = f"the phases of plan {plan.plan_id} last {length:g} s, its cycle {plan.cycle:g} s"
        faults.add(what, column="min_green")
        return False
    return True


def _phases(
    timings: Sequence[Timing], links: dict[str, list[str]]
) -> tuple[tuple[Phase, ...], float]:
    """The phases of one node, and the time after each in which nobody has green.

    Those of one ring with the same clearance are taken as they are; otherwise the cycle is cut
    wherever some link gets green or loses it.
    """
    rings, clearances = ({getattr(one, name) for one in timings} for name in ("ring", "clearance"))
    if len(rings) == 1 and len(clearances) == 1 and all(one.green > 0 for one in timings):
        phases = [Phase(one.green, tuple(links.get(one.phase_id, ()))) for one in timings]
        return tuple(phases), clearances.pop()
    cuts = {0.0} | {one.begin for one in timings} | {one.begin + one.green for one in timings}
    times = sorted(cuts | {max(one.end for one in timings)})
    found: list[Phase] = []
    for begin, end in pairwise(times):
        shown = [one for one in timings if one.begin <= begin and end <= one.begin + one.green]
        with_green = dict.fromkeys(link for one in shown for link in links.get(one.phase_id, ()))
        if found and found[-1].links == tuple(with_green):
            found[-1] = Phase(found[-1].duration + end - begin, found[-1].links)
        elif end - begin > ROUNDING:
            found.append(Phase(end - begin, tuple(with_green)))
    return tuple(found), 0.0
