"""Is this network fit to be simulated? All that is wrong with it, told at once."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pandas as pd

from uxsim_geo.errors import Faults
from uxsim_geo.network.bans import VIA_COLUMN, via_links
from uxsim_geo.network.network import MOVEMENT_COLUMNS, REQUIRED_LINK_COLUMNS, Network
from uxsim_geo.network.note_words import note_in_words
from uxsim_geo.network.rows import (
    add_missing_columns,
    add_rows,
    is_among,
    lacking,
    not_text,
    numbers,
)

#: of nodes; they may also lack control (then none) and through_traffic (True)
REQUIRED_NODE_COLUMNS = ("node_id",)
POSITIVE_LINK_COLUMNS = ("length", "lanes", "free_speed", "jam_density", "merge_priority")
CONTROLS = ("none", "signal")

#: no road is beyond these: a larger value is a slip of units, and would make a run endless
LARGEST: dict[str, tuple[float, str]] = {
    "length": (1e7, "m"),
    "lanes": (100, "lanes"),
    "free_speed": (150, "m/s"),
    "jam_density": (1, "veh/m/lane"),
}

#: what to do about ids that are numbers: 1 and "1" would be two nodes
AS_TEXT = 'turn the ids of all tables into text with .astype("str")'

#: topic of the notes that say why a reader left a column empty; their value is that column's name
PLACEHOLDER = "placeholder"


def check_network(network: Network) -> None:
    """Raise :class:`InputError` with every reason why ``network`` cannot be simulated, or return.

    Looked at: the columns needed, ids (present, unique), end nodes (known), length, lanes,
    free_speed, jam_density and merge_priority (finite, above 0, within :data:`LARGEST`; lanes
    whole), capacity (finite and above 0, or null), control and through_traffic; and of banned turns
    links and nodes (known), that the links follow one another at that node, and that no turn is
    banned twice.
    """
    faults = Faults()
    faults.extend(_node_faults(network.nodes))
    faults.extend(_link_faults(network))
    faults.extend(_movement_faults(network))
    faults.raise_if_any()


def _node_faults(nodes: pd.DataFrame) -> Faults:
    faults = Faults("nodes")
    if add_missing_columns(faults, nodes, REQUIRED_NODE_COLUMNS):
        return faults
    if nodes.empty:
        faults.add("there is no row")
    _add_id_faults(faults, nodes["node_id"])
    ids = nodes["node_id"]
    if "control" in nodes:
        wrong = ~nodes["control"].isin(CONTROLS)
        add_rows(faults, wrong, "a control other than none or signal", ids=ids)
    if "through_traffic" in nodes:
        wrong = ~nodes["through_traffic"].isin([True, False])
        add_rows(faults, wrong, "a through_traffic other than true or false", ids=ids)
    return faults


def _link_faults(network: Network) -> Faults:
    faults = Faults("links")
    links = network.links
    if add_missing_columns(faults, links, REQUIRED_LINK_COLUMNS):
        return faults
    if links.empty:
        faults.add("there is no row")
    _add_id_faults(faults, links["link_id"])
    _add_end_faults(faults, links, network.nodes)
    for column in POSITIVE_LINK_COLUMNS:
        _add_missing_value_faults(faults, network, column)
        _add_number_faults(faults, links, column)
    _add_number_faults(faults, links, "capacity")
    return faults


def _add_id_faults(faults: Faults, ids: pd.Series) -> None:
    missing = lacking(ids)
    add_rows(faults, missing, f"no {ids.name}")
    wrong = not_text(ids)
    add_rows(faults, wrong, f"a {ids.name} that is not text", ids=ids, advice=AS_TEXT)
    repeated = np.asarray(ids.duplicated(), dtype=bool) & ~missing
    add_rows(faults, repeated, f"the {ids.name} of an earlier row", ids=ids)


def _add_end_faults(faults: Faults, links: pd.DataFrame, nodes: pd.DataFrame) -> None:
    known = nodes["node_id"] if "node_id" in nodes else pd.Series(dtype="str")
    for column in ("from_node_id", "to_node_id"):
        missing = lacking(links[column])
        add_rows(faults, missing, f"no {column}")
        unknown = ~is_among(links[column], known) & ~missing
        add_rows(faults, unknown, f"a {column} that is not in the nodes", ids=links["link_id"])


def _add_missing_value_faults(faults: Faults, network: Network, column: str) -> None:
    values = network.links[column]
    notes = network.notes
    why = ""
    if {"topic", "value", "note"} <= set(notes.columns):
        told = notes.loc[(notes["topic"] == PLACEHOLDER) & (notes["value"] == column), "note"]
        why = "".join(f"; {note_in_words(note)}" for note in told)
    ids = network.links["link_id"]
    advice = f"give it in an overrides table{why}"
    add_rows(faults, values.isna(), f"no {column}", ids=ids, advice=advice)


def _add_number_faults(faults: Faults, links: pd.DataFrame, column: str) -> None:
    filled = np.asarray(links[column].notna(), dtype=bool)
    values = numbers(links[column])
    ids = links["link_id"]
    add_rows(
        faults, filled & ~np.isfinite(values), f"a {column} that is not a finite number", ids=ids
    )
    with np.errstate(invalid="ignore"):
        add_rows(faults, filled & (values <= 0), f"{column} <= 0", ids=ids)
    finite = np.where(np.isfinite(values), values, 0.0)
    if column in LARGEST:
        limit, unit = LARGEST[column]
        advice = "is the unit right?"
        what = f"{column} > {limit:g} {unit}"
        add_rows(faults, finite > limit, what, ids=ids, advice=advice)
    if column == "lanes":
        add_rows(faults, finite % 1 != 0, "lanes that are not a whole number", ids=ids)


def _movement_faults(network: Network) -> Faults:
    faults = Faults("movements")
    moves, links = network.movements, network.links
    if moves.empty or add_missing_columns(faults, moves, MOVEMENT_COLUMNS):
        return faults
    if {"link_id", "from_node_id", "to_node_id"} <= set(links) and "node_id" in network.nodes:
        known = {"nodes": network.nodes["node_id"], "links": links["link_id"]}
        for column in MOVEMENT_COLUMNS:
            missing = lacking(moves[column])
            add_rows(faults, missing, f"no {column}")
            table = "nodes" if column == "node_id" else "links"
            unknown = ~is_among(moves[column].astype("str"), known[table].astype("str")) & ~missing
            add_rows(faults, unknown, f"a {column} that is not in the {table}")
        _add_turn_faults(faults, moves, links)
    return faults


def _add_turn_faults(faults: Faults, moves: pd.DataFrame, links: pd.DataFrame) -> None:
    """Note banned turns whose links do not follow one another, and those banned before."""
    ids, starts, ends = (
        links[column].astype("str") for column in ("link_id", "from_node_id", "to_node_id")
    )
    start, end = (dict(zip(ids, nodes, strict=True)) for nodes in (starts, ends))
    at, first, last = (moves[column].astype("str") for column in MOVEMENT_COLUMNS)
    ways = [
        (one, *via, other) for one, via, other in zip(first, via_links(moves), last, strict=True)
    ]
    unknown = [any(link_id not in start for link_id in way[1:-1]) for way in ways]
    add_rows(faults, np.array(unknown), f"{VIA_COLUMN} that are not in the links")
    away = [way[0] in end and end[way[0]] != node for way, node in zip(ways, at, strict=True)]
    add_rows(faults, np.array(away), "a from_link_id that does not end at its node_id")
    gap = np.array(
        [
            any(one in end and other in start and end[one] != start[other] for one, other in pairs)
            for pairs in map(pairwise, ways)
        ]
    )
    over = np.array([len(way) > 2 for way in ways])
    add_rows(faults, gap & ~over, "a to_link_id that does not start where its from_link_id ends")
    add_rows(faults, gap & over, f"{VIA_COLUMN} that do not lead from from_link_id to to_link_id")
    add_rows(faults, pd.Series(ways).duplicated(), "the banned turn of an earlier row")
