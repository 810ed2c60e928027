"""Turn restrictions to banned turns between links.

``no_*`` bans the turn from one link to another; ``only_*`` bans all others from that link at that
place. With ways between (``via``) the ban holds for those who came along them: such a row names
the links between in ``via_link_ids``, and an ``only_*`` binds at the end of them.

A restriction that excepts cars bans nothing; one under conditions (times, axles) or for other
vehicles is noted and not applied. One that cannot be understood, or whose roads do not meet, is
noted with its number.
"""

from __future__ import annotations

from collections import Counter

import numpy as np
import pandas as pd

from uxsim_geo.network.network import MOVEMENT_COLUMNS
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.osm_barriers import BARRIER, blocked_turns
from uxsim_geo.network.osm_file import Ids
from uxsim_geo.network.osm_junctions import Junctions
from uxsim_geo.network.osm_paths import Path, paths_of
from uxsim_geo.network.osm_relations import RestrictionError, Turn, turn_of
from uxsim_geo.network.osm_sections import rows_of

#: columns of movements after the shared ones
OWN_COLUMNS = ("via_link_ids", "restriction", "source_id")

#: topics that are counted, since nothing is wrong with the restrictions
COUNTED = {
    "restriction of other vehicles": "say nothing of cars; value: turn restrictions",
    "restriction excepts cars": "except cars; value: turn restrictions",
    "restriction on other roads": "at ways that are no roads here; value: turn restrictions",
    "restriction without effect": "ban what is impossible anyway; value: turn restrictions",
}


#: rows of links from, between, to; and the kinds and ids of the restrictions (of a barrier: its
#: node) that ban the path
Bans = dict[Path, list[tuple[str, int]]]


def banned_turns(junctions: Junctions, closed: Ids, notes: Notes) -> pd.DataFrame:
    """The table of movements; what becomes of restrictions that ban nothing goes into the notes.

    ``closed``: ids of nodes with barriers that cars do not pass.
    """
    bans: Bans = {}
    counted: Counter[str] = Counter()
    for relation in junctions.file.restrictions:
        try:
            turn = turn_of(relation)
            for path in _banned(turn, junctions):
                bans.setdefault(path, []).append((turn.kind, relation.id))
        except RestrictionError as error:
            _note(error, relation.id, counted, notes)
        if any(key.endswith(":conditional") for key in relation.tags):
            note = "has conditions, which are not applied: relation (value)"
            notes.add("conditional restriction", note, value=relation.id)
    for topic, number in sorted(counted.items()):
        notes.add(topic, COUNTED[topic], value=number)
    for pair, node_id in blocked_turns(closed, junctions).items():
        bans.setdefault(pair, [(BARRIER, node_id)])
    return _table(bans, junctions)


def _note(error: RestrictionError, relation: int, counted: Counter[str], notes: Notes) -> None:
    if error.topic in COUNTED:
        counted[error.topic] += 1
    elif error.topic == "broken restriction":
        note = f"{error}: relation (value) bans nothing"
        notes.add(error.topic, note, severity="warning", value=relation)
    elif str(error):
        notes.add(error.topic, f"{error}: relation (value)", value=relation)


def _banned(turn: Turn, junctions: Junctions) -> list[Path]:
    """The paths that a restriction bans; all others from its place, if it allows only one."""
    for way in (*turn.from_ways, *turn.to_ways):
        junctions.of(way)
    node = None
    if turn.via_node is not None:
        rows, known = rows_of(np.array([turn.via_node]), junctions.file.node_ids)
        if not known[0]:
            raise RestrictionError(
                "broken restriction", f"node {turn.via_node} is on no road in the file"
            )
        node = int(rows[0])
    paths = paths_of(turn, node, junctions)
    if turn.only:
        paths = _others(paths, junctions)
    if not paths:
        raise RestrictionError("restriction without effect", "there is nothing that it could ban")
    return paths


def _others(allowed: list[Path], junctions: Junctions) -> list[Path]:
    """All paths that end as none of those does that are allowed."""
    others: list[Path] = []
    for path in allowed:
        onward = junctions.from_node(junctions.start(path[-1]))
        others.extend((*path[:-1], link) for link in onward)
    return [path for path in others if path not in allowed]


def _table(bans: Bans, junctions: Junctions) -> pd.DataFrame:
    """One row a ban, by the node at which it begins, from link, to link and the links between."""
    paths = sorted(bans, key=lambda path: (junctions.start(path[1]), path[0], path[-1], path[1:-1]))
    ids = junctions.links.ids.tolist()
    nodes = junctions.file.node_ids
    columns: dict[str, list[str | None]] = {
        "node_id": [str(nodes[junctions.start(path[1])]) for path in paths],
        "from_link_id": [ids[path[0]] for path in paths],
        "to_link_id": [ids[path[-1]] for path in paths],
        "via_link_ids": [" ".join(ids[row] for row in path[1:-1]) or None for path in paths],
        "restriction": [bans[path][0][0] for path in paths],
        "source_id": [" ".join(str(number) for _, number in bans[path]) for path in paths],
    }
    return pd.DataFrame(columns, columns=[*MOVEMENT_COLUMNS, *OWN_COLUMNS], dtype="str")
