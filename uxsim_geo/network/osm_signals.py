"""Traffic signals at the junctions they control.

A node with ``highway=traffic_signals`` that has at least three neighbours is a junction and has
its signal. Any other is taken for a signal on the approach: it controls the next junction in its
direction (``traffic_signals:direction``; where that says nothing, the nearer one of the
directions open to traffic), reached along the road within a distance that the options give. One
that is tagged as a crossing for pedestrians too stands at a junction only if that is nearer
(:data:`CROSSING_DISTANCE`): farther away it is one in mid-block.

A signal from which no junction is that near, or which is tagged as one for pedestrians or for
metering a ramp, controls no junction: it is noted and left out, as are crossings with signals.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from uxsim_geo.network.notes import Notes
from uxsim_geo.network.osm_file import OsmFile
from uxsim_geo.network.osm_sections import Sections, rows_of
from uxsim_geo.network.osm_tags import Tags, values
from uxsim_geo.network.osm_ways import Ways

#: neighbours from which on a node is a junction
JUNCTION = 3

#: m: signals of crossings for pedestrians at a junction are within this distance of it
CROSSING_DISTANCE = 20.0

#: no road has more nodes within the distance at which a signal is looked for
MOST_STEPS = 100

#: values of the tag traffic_signals that stop nobody at a junction
OF_NO_JUNCTION = frozenset(
    [
        "pedestrian_crossing",
        "pedestrian",
        "crossing",
        "crosswalk",
        "ramp_meter",
        "bus_priority",
        "lane_control",
        "level_crossing",
        "rail_crossing",
    ]
)


@dataclass(frozen=True)
class Steps:
    """Pieces of road that may be driven, from one point to the next, sorted by where they start.

    first
        those from node row ``n`` are rows ``first[n]`` to ``first[n + 1]``; (nodes + 1,)
    to, length, backward
        the node row each leads to, m, and whether it leads against the way's drawing

    Lists, since they are looked at one by one.
    """

    first: list[int]
    to: list[int]
    length: list[float]
    backward: list[bool]

    def from_node(self, node: int) -> range:
        """Rows of the pieces that start at the row of a node."""
        return range(self.first[node], self.first[node + 1])


@dataclass
class Signals:
    """Rows of junctions to rows of the nodes whose signals control them, and what became of all.

    ``moved``: (signal, junction); ``left``: signals that control no junction.
    """

    at: dict[int, list[int]] = field(default_factory=dict)
    moved: list[tuple[int, int]] = field(default_factory=list)
    left: list[int] = field(default_factory=list)


def place_signals(file: OsmFile, sections: Sections, ways: Ways, distance: float) -> Signals:
    """Find the junction of every signal on a road; ``distance`` in m."""
    signals = Signals()
    ids = [node for node, tags in sorted(file.node_tags.items()) if is_signal(tags)]
    rows, _ = rows_of(np.array(ids, dtype=np.int64), file.node_ids)
    steps, neighbours = _steps(sections, ways), sections.neighbours.tolist()
    for row in rows[sections.neighbours[rows] > 0].tolist():
        tags = file.node_tags[int(file.node_ids[row])]
        junction = _junction(row, tags, steps, neighbours, distance)
        if junction is None:
            signals.left.append(row)
            continue
        signals.at.setdefault(junction, []).append(row)
        if junction != row:
            signals.moved.append((row, junction))
    return signals


def is_signal(tags: Tags) -> bool:
    """Whether a node is a signal for cars; crossings with signals are not."""
    return tags.get("highway") == "traffic_signals"


def is_signalled_crossing(tags: Tags) -> bool:
    """Whether a node is a crossing for pedestrians with a signal."""
    signalled = tags.get("crossing") == "traffic_signals" or tags.get("crossing:signals") == "yes"
    return tags.get("highway") == "crossing" and signalled


def _steps(sections: Sections, ways: Ways) -> Steps:
    inside = np.ones(len(sections.points), dtype=bool)
    inside[sections.first[1:] - 1] = False
    at = np.flatnonzero(inside)
    open_to = np.repeat(ways.open[sections.way], np.diff(sections.first), axis=0)[at]
    low, high, length = sections.points[at], sections.points[at + 1], sections.step[at]
    ahead, against = open_to[:, 0], open_to[:, 1]
    start = np.concatenate([low[ahead], high[against]])
    to = np.concatenate([high[ahead], low[against]])
    lengths = np.concatenate([length[ahead], length[against]])
    backward = np.repeat([False, True], [ahead.sum(), against.sum()])
    order = np.lexsort((to, start))
    first = np.searchsorted(start[order], np.arange(len(sections.neighbours) + 1))
    columns = (first, to[order], lengths[order], backward[order])
    return Steps(*(column.tolist() for column in columns))


def _junction(
    row: int, tags: Tags, steps: Steps, neighbours: list[int], distance: float
) -> int | None:
    """The row of the junction that a signal controls, None if it controls none."""
    if neighbours[row] >= JUNCTION:
        return row
    if OF_NO_JUNCTION.intersection(values(tags.get("traffic_signals", ""))):
        return None
    if tags.get("crossing", "no") != "no":
        distance = min(distance, CROSSING_DISTANCE)
    side = tags.get("traffic_signals:direction")
    reached = []
    for step in steps.from_node(row):
        if side in ("forward", "backward") and steps.backward[step] != (side == "backward"):
            continue
        found = _next_junction(row, step, steps, neighbours, distance)
        if found is not None:
            reached.append(found)
    return min(reached)[1] if reached else None


def _next_junction(
    before: int, step: int, steps: Steps, neighbours: list[int], distance: float
) -> tuple[float, int] | None:
    """Go on along a piece of road from the node ``before``: how far and where a junction is."""
    covered = 0.0
    for _ in range(MOST_STEPS):
        at = steps.to[step]
        covered += steps.length[step]
        if covered > distance:
            return None
        if neighbours[at] >= JUNCTION:
            return covered, at
        onward = [other for other in steps.from_node(at) if steps.to[other] != before]
        if not onward:
            return None
        before, step = at, onward[0]
    return None  # nodes at one place, round and round


def note_signals(file: OsmFile, sections: Sections, signals: Signals, notes: Notes) -> None:
    """Say which signals were moved, and which control no junction."""
    ids = file.node_ids
    junctions = [str(ids[junction]) for _, junction in signals.moved]
    note = "controlled by a signal on its approach, at the node (value)"
    sources: list[object] = [str(ids[row]) for row, _ in signals.moved]
    notes.add_each("signal on approach", note, junctions, element="node", values=sources)
    note = "a signal that controls no junction: left out"
    left = [str(ids[row]) for row in signals.left]
    notes.add_each("signal at no junction", note, left, element="node")
    on_road = set(ids[sections.neighbours > 0].tolist())
    crossings = sum(
        node in on_road and is_signalled_crossing(tags) for node, tags in file.node_tags.items()
    )
    if crossings:
        note = "crossings for pedestrians, which control no junction: left out; value: nodes"
        notes.add("signalled crossings", note, element="node", value=crossings)
