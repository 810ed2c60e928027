"""Barriers on roads that cars cannot pass: there the road is cut, as routers for cars cut it.

What is said of cars at the node decides (motorcar, motor_vehicle, vehicle, access, as on ways).
Where nothing is said, the kind of barrier does: bollards, blocks and the like keep cars out, gates
and toll booths do not unless they are locked. A bollard that sinks into the ground lets cars pass.

A road is cut by banned turns: nobody goes on at the node, and everybody may turn round there, as at
a dead end. At a junction one does not know which of its roads a barrier closes: that is a mistake
of the map, which is noted and closes nothing.
"""

from __future__ import annotations

from collections import Counter

import numpy as np

from uxsim_geo.network.notes import Notes
from uxsim_geo.network.osm_access import access_of, is_closed
from uxsim_geo.network.osm_file import Ids, OsmFile
from uxsim_geo.network.osm_junctions import Junctions
from uxsim_geo.network.osm_options import OsmOptions
from uxsim_geo.network.osm_sections import Rows, Sections, rows_of
from uxsim_geo.network.osm_tags import Tags

#: kinds that keep cars out where nothing else is said
SOLID = frozenset(
    [
        "barrier_board",
        "block",
        "bollard",
        "bus_trap",
        "chain",
        "cycle_barrier",
        "debris",
        "fence",
        "guard_rail",
        "hedge",
        "jersey_barrier",
        "kissing_gate",
        "log",
        "motorcycle_barrier",
        "planter",
        "stile",
        "sump_buster",
        "turnstile",
        "wall",
    ]
)

#: in the column restriction of movements
BARRIER = "barrier"

#: neighbours of a node within one road
WITHIN = 2


def keeps_out(tags: Tags, private: bool) -> bool:
    """Whether a barrier keeps cars out; ``private``: those of private access are open."""
    if access_of(tags) is not None:
        return is_closed(tags, None, private)
    if tags.get("locked") == "yes":
        return True
    return tags["barrier"] in SOLID and tags.get("bollard") != "rising"


def closed_nodes(file: OsmFile, options: OsmOptions) -> Ids:
    """Ids of the nodes on roads with a barrier that keeps cars out, sorted."""
    if options.barriers == "ignored":
        return np.empty(0, dtype=np.int64)
    ids = (
        node_id
        for node_id, tags in file.node_tags.items()
        if "barrier" in tags and keeps_out(tags, options.private)
    )
    return np.array(sorted(ids), dtype=np.int64)


def blocked_turns(closed: Ids, junctions: Junctions) -> dict[tuple[int, int], int]:
    """Rows of the links that nobody goes on between, to the id of the node that is closed."""
    turns = {}
    for node in _within(closed, junctions.file, junctions.sections).tolist():
        onward = junctions.from_node(node)
        for before in junctions.to_node(node):
            for after in onward:
                if not junctions.back(before, after):
                    turns[before, after] = int(junctions.file.node_ids[node])
    return turns


def _within(closed: Ids, file: OsmFile, sections: Sections) -> Rows:
    """Rows of those closed nodes that lie within one road, where it leads on at both sides."""
    rows, known = rows_of(closed, file.node_ids)
    within: Rows = rows[known & (sections.neighbours[rows] == WITHIN)]
    return within


def note_barriers(file: OsmFile, closed: Ids, junctions: Junctions, notes: Notes) -> None:
    """Say of every link that ends at a barrier, and which barriers close nothing."""
    rows, known = rows_of(closed, file.node_ids)
    number = junctions.sections.neighbours[rows[known]]
    within, ids = rows[known][number == WITHIN], closed[known]
    ends = np.flatnonzero(np.isin(junctions.links.end, within))
    told = file.node_ids[junctions.links.end[ends]].tolist()
    notes.add_each(
        "barrier",
        "ends at a barrier (value) that cars do not pass",
        junctions.links.ids.iloc[ends].tolist(),
        values=[_written(file.node_tags[node_id]) for node_id in told],
    )
    for node_id in ids[number > WITHIN].tolist():
        note = f"node {node_id}: a barrier (value) at a junction, it closes none of the roads"
        value = _written(file.node_tags[node_id])
        topic = "barrier at a junction"
        notes.add(topic, note, element="node", severity="warning", value=value)
    _note_open(file, ids[number >= WITHIN], notes)


def _note_open(file: OsmFile, told: Ids, notes: Notes) -> None:
    """Count the other barriers, by kind: those that cars pass, and those where a road ends."""
    others = set(file.node_tags) - set(told.tolist())
    tags = (file.node_tags[node_id] for node_id in others)
    kinds = Counter(tag["barrier"] for tag in tags if "barrier" in tag)
    for kind, number in sorted(kinds.items()):
        note = f"nodes with barrier={kind} on roads: nothing is closed there"
        notes.add("barriers", note, element="node", value=number)


def _written(tags: Tags) -> str:
    keys = ("barrier", "bollard", "locked", "motorcar", "motor_vehicle", "vehicle", "access")
    return " ".join(f"{key}={tags[key]}" for key in keys if key in tags)
