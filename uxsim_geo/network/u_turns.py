"""Turning back: bans where one does not turn back on the street one came along.

Turning back is left open at dead ends, and wherever else it is the only permitted way on from a
link or the only way into the link back. Elsewhere it may be banned. A ban is a row of movements,
which the search for shortest ways pays for, and there would be two of them a street. Shortest ways
turn back only to go round a banned turn, and drivers do not where they would stop a queue: so it is
closed at signals by default. At a merged junction it is open if a way round was there, and only
then (:mod:`uxsim_geo.network.junctions`).
"""

from __future__ import annotations

from typing import Literal

import numpy as np
import pandas as pd

from uxsim_geo.network.bans import ban_rows
from uxsim_geo.network.incidence import Ends, Flags, Turns, ends_of, signals_of_nodes, turns_of
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes

#: where turning back is banned: nowhere, at signals, at all junctions
Where = Literal["nowhere", "signals", "junctions"]

#: in the column restriction of such a ban
ASSUMED = "no_u_turn assumed"


def ban_u_turns(network: Network, where: Where, notes: Notes) -> Network:
    """Add bans of turning back at signals, or at all junctions that were one node all along."""
    if where == "nowhere":
        return network
    ends = ends_of(network)
    turns = turns_of(network, ends)
    closed = needless(network, ends, turns) & ~turns.banned
    if where == "signals":
        closed &= signals_of_nodes(network)[ends.end[turns.before]]
    node, ids = (network.links[name].to_numpy() for name in ("to_node_id", "link_id"))
    before = turns.before[closed]
    rows = ban_rows(network.movements, node[before], ids[before], ids[turns.after[closed]], ASSUMED)
    note = f"turning back banned at {where}, save where there is no other way; value: bans"
    notes.add("u-turns", note, value=len(rows))
    if not len(rows):
        return network
    movements = pd.concat([network.movements, rows], ignore_index=True)
    return Network(network.nodes, network.links, movements, network.notes)


def needless(network: Network, ends: Ends, turns: Turns) -> Flags:
    """Pairs that turn back though another way leads on, and another into the link back.

    At merged junctions turning back is no such pair: it stands for a way round that is there.
    """
    links = len(ends.start)
    others = ~turns.banned & ~turns.back
    onward = np.bincount(turns.before[others], minlength=links) > 0
    inward = np.bincount(turns.after[others], minlength=links) > 0
    plain = ~merged_before(network)[ends.end[turns.before]]
    return turns.back & onward[turns.before] & inward[turns.after] & plain


def merged_before(network: Network) -> Flags:
    """Nodes that were several, at which turning back stands for a way round; (nodes,)."""
    if "merged_node_ids" not in network.nodes:
        return np.zeros(len(network.nodes), dtype=bool)
    return np.asarray(network.nodes["merged_node_ids"].notna(), dtype=bool)
