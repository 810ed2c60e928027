"""Traffic signals: which in-links of a node may be left when."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from uxsim_geo.errors import Faults


@dataclass(frozen=True)
class Phase:
    """A part of a cycle: ``duration`` s in which the ``links`` (link_id) have green."""

    duration: float
    links: tuple[str, ...]


@dataclass(frozen=True)
class Signal:
    """A signal with a fixed cycle, for ever.

    The phases follow one another, each exactly as long as it says and then ``all_red`` s in which
    nobody has green; the first cycle begins at ``offset`` s, and those before it by repetition.
    In-links of the node that no phase names are not held by the signal.
    """

    node_id: str
    phases: tuple[Phase, ...]
    offset: float = 0.0
    all_red: float = 0.0

    @property
    def cycle(self) -> float:
        """Time until the first phase comes again, s."""
        return sum(phase.duration + self.all_red for phase in self.phases)

    def greens(self) -> dict[str, list[tuple[float, float]]]:
        """When each link has green, s after the cycle begins; phases that meet are joined."""
        greens: dict[str, list[tuple[float, float]]] = {}
        begin = 0.0
        for phase in self.phases:
            end = begin + phase.duration
            for link_id in phase.links:
                own = greens.setdefault(link_id, [])
                if own and own[-1][1] == begin:
                    own[-1] = (own[-1][0], end)
                else:
                    own.append((begin, end))
            begin = end + self.all_red
        return greens


def check_signals(signals: Iterable[Signal], end_nodes: Mapping[str, str]) -> None:
    """Raise :class:`InputError` with all that is wrong with some signals, or return.

    ``end_nodes`` gives the to_node_id of every link_id of the network.
    """
    faults = Faults("signals")
    seen: set[str] = set()
    nodes = set(end_nodes.values())
    for number, signal in enumerate(signals, start=1):
        if signal.node_id in seen:
            faults.add("the node has a signal already", line=number, value=signal.node_id)
        seen.add(signal.node_id)
        if signal.node_id not in nodes:
            faults.add("no link ends at this node_id", line=number, value=signal.node_id)
        _check_times(faults, signal, number)
        for link_id in dict.fromkeys(link for phase in signal.phases for link in phase.links):
            if link_id not in end_nodes:
                faults.add("the network has no such link_id", line=number, value=link_id)
            elif end_nodes[link_id] != signal.node_id:
                what = f"the link ends at node {end_nodes[link_id]}, not at {signal.node_id}"
                faults.add(what, line=number, value=link_id)
    faults.raise_if_any()


def _check_times(faults: Faults, signal: Signal, number: int) -> None:
    if not signal.phases:
        faults.add("a signal needs at least one phase", line=number, value=signal.node_id)
    for phase in signal.phases:
        if not 0 < phase.duration < math.inf:
            what = "a phase must last a finite time above 0 s"
            faults.add(what, line=number, column="duration", value=phase.duration)
    if not 0 <= signal.all_red < math.inf:
        what = "must be a finite time of 0 s or more"
        faults.add(what, line=number, column="all_red", value=signal.all_red)
    if not math.isfinite(signal.offset):
        faults.add("must be a finite time", line=number, column="offset", value=signal.offset)
