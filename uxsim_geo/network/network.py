"""The road network as tables: one row a node, one row a directed link, SI units.

The columns are those of GMNS where GMNS has them. A table may be a GeoDataFrame (with its CRS, or
explicitly without one) or a plain DataFrame without geometry; the engine needs no geometry.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import pandas as pd

#: columns of ``nodes`` beside ``geometry`` (point), in their order
NODE_COLUMNS = ("node_id", "zone_id", "control", "through_traffic")

#: columns of ``links`` that a simulation reads
REQUIRED_LINK_COLUMNS = (
    "link_id",
    "from_node_id",
    "to_node_id",
    "length",
    "lanes",
    "free_speed",
    "jam_density",
    "capacity",
    "merge_priority",
)

#: columns of ``links`` beside ``geometry`` (line), in their order
LINK_COLUMNS = (
    *REQUIRED_LINK_COLUMNS,
    "road_class",
    "name",
    "source_id",
    "lanes_source",
    "free_speed_source",
)

#: banned turns: from which link to which link at which node; a further column via_link_ids, where
#: there is one, names the links between (with blanks): then the way over all of them is banned
MOVEMENT_COLUMNS = ("node_id", "from_link_id", "to_link_id")

#: what was assumed or repaired on import; ``element`` is node, link, demand or network
NOTE_COLUMNS = ("element", "element_id", "topic", "severity", "note", "value")


def _empty(columns: tuple[str, ...]) -> pd.DataFrame:
    return pd.DataFrame({column: pd.Series(dtype="str") for column in columns})


@dataclass(frozen=True)
class Network:
    """Nodes, links, banned turns and the notes of the import.

    nodes
        node_id (text), zone_id (text, null where the node is no zone), control (``none`` or
        ``signal``), through_traffic (False: trips may only start or end here), geometry (point).
    links
        link_id, from_node_id, to_node_id (text), length (m), lanes (of this direction),
        free_speed (m/s), jam_density (veh/m/lane), capacity (veh/s of the whole link; null: that
        of the triangular diagram), merge_priority (weight, > 0), road_class, name, source_id
        (text), lanes_source and free_speed_source (``given`` or ``assumed``), geometry (line).
        Readers may add columns of their own after these.
    movements
        banned turns: node_id, from_link_id, to_link_id; with via_link_ids banned ways.
    notes
        what the import assumed or repaired: element, element_id, topic, severity (``info``,
        ``warning``, or ``doubt`` of what looks wrong), note, value; on disk also geometry, the
        place (:mod:`uxsim_geo.network.note_geometry`).

    Ids are the source's own and rows keep the source's order.
    """

    nodes: pd.DataFrame
    links: pd.DataFrame
    movements: pd.DataFrame = field(default_factory=lambda: _empty(MOVEMENT_COLUMNS))
    notes: pd.DataFrame = field(default_factory=lambda: _empty(NOTE_COLUMNS))
