"""Junctions that a map draws with several nodes become one node, with their turns as they were.

Crossings of dual carriageways, signals on every corner, small roundabouts, stubs: between their
nodes lie links too short to hold a queue. A vehicle's way through such a junction is decided at
once; so it is one node here. A turn is open if there was an open way for it between the nodes,
one-way roads and bans along it counted; every other is a row of ``movements``. What the links
between were long is shared among those around, see :mod:`uxsim_geo.network.approach_lengths`.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from uxsim_geo.network.approach_lengths import Additions, additions_of
from uxsim_geo.network.clusters import JunctionSizes, clusters_of
from uxsim_geo.network.headings import Headings, headings_of, metric_points
from uxsim_geo.network.incidence import Flags, Floats, ends_of, passed_nodes, rank_of
from uxsim_geo.network.inner_paths import (
    CannotMergeError,
    Junction,
    Streets,
    junction_of,
    streets_of,
)
from uxsim_geo.network.merged_tables import merged_network
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.place_notes import note_places

#: no link within a junction is longer than this many times the error that is allowed
MOST_INNER = 6.0

#: a junction that cannot be merged as a whole is tried again with links of this share of the limit
AGAIN = (1.0, 0.5)


@dataclass(frozen=True)
class Merged:
    """A junction and what its links take over."""

    junction: Junction
    additions: Additions


@dataclass(frozen=True)
class Found:
    """The junctions of a network.

    merged
        those that can be one node each
    refused
        by the row of a junction's first node: why it stays as it is
    """

    network: Network
    streets: Streets
    points: Floats | None
    merged: list[Merged]
    refused: dict[int, str]

    def without(self, apart: frozenset[str]) -> Found:
        """Leave out the junctions of which a node is named in ``apart``."""
        rows = np.flatnonzero(self.network.nodes["node_id"].isin(apart)).tolist()
        kept = [one for one in self.merged if one.junction.nodes.isdisjoint(rows)]
        return replace(self, merged=kept)


def merge_junctions(network: Network, sizes: JunctionSizes, notes: Notes) -> Network:
    """Make one node of the nodes of each junction.

    The node has the id of the signal, or else the node, that comes first among them;
    ``merged_node_ids`` (nodes) names all, ``merge_error`` says by how much (m) a way through them
    has changed at most, see :class:`uxsim_geo.network.approach_lengths.Additions`. Junctions whose
    ways would become longer or shorter by more than ``sizes.error`` stay as they are, and are
    noted; zones are no part of junctions.
    """
    return merged_of(find_junctions(network, sizes), notes)


def find_junctions(network: Network, sizes: JunctionSizes) -> Found:
    """Find junctions, and what their links take over; nothing is changed yet."""
    ends = ends_of(network)
    points = metric_points(network)
    streets, headings = streets_of(network, ends), headings_of(network)
    free = _free_nodes(network)
    merged: list[Merged] = []
    refused: dict[int, str] = {}
    for share in AGAIN:
        scaled = replace(sizes, link=sizes.link * share, signal_link=sizes.signal_link * share)
        for nodes in clusters_of(network, ends, points, scaled, free):
            try:
                found = junction_of(nodes, streets)
                merged.append(_merged(found, streets, headings, sizes.error))
            except CannotMergeError as why:
                refused[int(nodes[0])] = str(why)
                continue
            free[nodes] = False
    refused = {node: why for node, why in refused.items() if free[node]}
    return Found(network, streets, points, merged, refused)


def merged_of(found: Found, notes: Notes) -> Network:
    """The network with its junctions merged."""
    _note(found, notes)
    if not found.merged:
        return found.network
    return merged_network(found.network, found.merged, found.streets)


def _free_nodes(network: Network) -> Flags:
    """Nodes that may be a part of a junction: of no zone, passed by traffic, not merged before."""
    nodes = network.nodes
    free = passed_nodes(network)
    if "merged_node_ids" in nodes:
        free &= np.asarray(nodes["merged_node_ids"].isna(), dtype=bool)
    return free


def _merged(found: Junction, streets: Streets, headings: Headings, error: float) -> Merged:
    """Share the ways of a junction, or raise :class:`CannotMergeError`."""
    if not found.ways:
        raise CannotMergeError("nobody comes through it")
    around = (*found.inner, *found.approaches, *found.exits)
    if not all(math.isfinite(streets.time[link]) for link in around):
        raise CannotMergeError("a length or speed is not known")
    if any(streets.length[link] > MOST_INNER * error for link in found.inner):
        raise CannotMergeError("a long link leads from it to itself")
    additions = additions_of(found, streets, headings.angles(found))
    if additions.error > error:
        raise CannotMergeError("a way through it would become too long or too short")
    return Merged(found, additions)


def _note(found: Found, notes: Notes) -> None:
    merged, refused = found.merged, found.refused
    ids = found.network.nodes["node_id"].tolist()
    inner = sum(len(one.junction.inner) for one in merged)
    note = f"{len(merged)} junctions of several nodes became one node each; value: links gone"
    notes.add("junctions merged", note, element="node", value=inner)
    rank = rank_of(found.network.nodes["node_id"])
    names = [ids[min(one.junction.nodes, key=rank.__getitem__)] for one in merged]
    sizes = [len(one.junction.nodes) for one in merged]
    remark = ("junction merged", "one node in place of several; value: nodes")
    note_places(notes, remark, names, element="node", values=sizes)
    errors = [one.additions.error for one in merged]
    if errors:
        note = "greatest change of the length of a way through a merged junction; value: m"
        notes.add("junctions merged", note, element="node", value=max(errors))
    for why in sorted(Counter(refused.values())):
        remark = ("junction left", f"its nodes stay as they are: {why}")
        left = [ids[node] for node, reason in refused.items() if reason == why]
        note_places(notes, remark, left, element="node")
