"""Fixed-time signal plans to GMNS's signal tables."""

from __future__ import annotations

import math
from collections.abc import Sequence

from uxsim_geo.control.signals import Signal
from uxsim_geo.control.site import as_ids
from uxsim_geo.errors import Faults
from uxsim_geo.network.exact import float_text
from uxsim_geo.network.gmns_signals import BEGIN_OF_GREEN

Cells = dict[str, Sequence[str]]

#: by table, the columns written
COLUMNS = {
    "signal_controller": ("controller_id",),
    "signal_timing_plan": (
        "timing_plan_id",
        "controller_id",
        "cycle_length",
        "uxsim_begin_s",
        "uxsim_end_s",
    ),
    "signal_timing_phase": (
        "timing_phase_id",
        "timing_plan_id",
        "signal_phase_num",
        "min_green",
        "clearance",
        "ring",
        "barrier",
        "position",
    ),
    "signal_phase_mvmt": ("signal_phase_mvmt_id", "timing_phase_id", "mvmt_id", "protection"),
    "signal_coordination": (
        "coordination_id",
        "timing_plan_id",
        "controller_id",
        "coord_phase",
        "coord_ref_to",
        "offset",
    ),
}


def signal_cells(signals: Sequence[Signal], movement: Cells, faults: Faults) -> dict[str, Cells]:
    """The cells of the signal tables; ``movement`` are those of movement.csv.

    Each plan is one ring, its controller has the id of its node. What GMNS cannot say is a fault.
    """
    rows: dict[str, list[tuple[str, ...]]] = {name: [] for name in COLUMNS}
    of_link: dict[tuple[str, str], list[str]] = {}
    columns = (movement.get(name, ()) for name in ("mvmt_id", "node_id", "ib_link_id"))
    for mvmt, node, link in zip(*columns, strict=True):
        of_link.setdefault((node, link), []).append(mvmt)
    for number, signal in enumerate(signals, start=1):
        _add_plan(rows, str(number), signal, faults)
        _add_phases(rows, str(number), signal, of_link, faults)
    for node in dict.fromkeys(signal.node_id for signal in signals):
        rows["signal_controller"].append((node,))
    return {
        name: {column: [row[place] for row in own] for place, column in enumerate(COLUMNS[name])}
        for name, own in rows.items()
        if own
    }


def _add_plan(
    rows: dict[str, list[tuple[str, ...]]], plan: str, signal: Signal, faults: Faults
) -> None:
    limits = [
        "" if one in (0.0, math.inf) else float_text(one) for one in (signal.begin, signal.end)
    ]
    cycle = float_text(float(signal.cycle))
    rows["signal_timing_plan"].append((plan, signal.node_id, cycle, *limits))
    if signal.offset < 0:
        what = f"signal at node {signal.node_id}: GMNS has no negative offset: add the cycle to it"
        faults.add(what, column="offset", value=f"{signal.offset:g}")
    if signal.offset:
        offset = float_text(float(signal.offset))
        row = (str(len(rows["signal_coordination"]) + 1), plan, signal.node_id)
        first = f"{plan}.1"
        rows["signal_coordination"].append((*row, first, BEGIN_OF_GREEN, offset))


def _add_phases(
    rows: dict[str, list[tuple[str, ...]]],
    plan: str,
    signal: Signal,
    of_link: dict[tuple[str, str], list[str]],
    faults: Faults,
) -> None:
    clearance = float_text(float(signal.all_red))
    for place, phase in enumerate(signal.phases, start=1):
        phase_id, position = f"{plan}.{place}", str(place)
        green = float_text(float(phase.duration))
        row = (phase_id, plan, position, green, clearance, "1", "1", position)
        rows["signal_timing_phase"].append(row)
        for link in as_ids(phase.links):
            movements = of_link.get((signal.node_id, link), [])
            if not movements:
                what = f"signal at node {signal.node_id}: no turn leads from this link there"
                faults.add(what, column="phases", value=link)
            for mvmt in movements:
                number = str(len(rows["signal_phase_mvmt"]) + 1)
                rows["signal_phase_mvmt"].append((number, phase_id, mvmt, "protected"))
