"""The part of the network in which every origin can reach every destination.

Links are the places and permitted turns the steps between them, so that a street which can only
be left by a banned turn is not taken for one that can be left. A ban that depends on the links
before (``via_link_ids``) is not looked at here: it closes a way round, seldom a street.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from uxsim_geo.network.incidence import (
    Ends,
    Flags,
    Floats,
    Rows,
    Turns,
    ends_of,
    rank_of,
    turns_of,
    without,
)
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.one_part import is_one_part
from uxsim_geo.network.rows import count, numbers

#: why a piece fell out
ISLAND, TRAP, SPRING = (
    "neither entered nor left from the rest",
    "entered but not left",
    "left but not entered",
)


def keep_largest_part(network: Network, notes: Notes) -> Network:
    """Keep the strongly connected part with the greatest length of lanes, and its origins' ways.

    Links by which the trips of a zone come from its node into the part, and those that lead from
    the part to such a node, stay: a motorway from outside is entered and never reached. So do the
    links of nodes that nobody may drive through. What falls out is listed, one note a piece.
    """
    ends = ends_of(network)
    if not len(ends.start):
        return network
    turns = turns_of(network, ends)
    graph = _graph(*_open_turns(network, ends, turns), len(ends.start))
    core = _largest(graph, _lane_length(network))
    if core.sum() == 1:  # a link alone is no part: nowhere does one come back to it
        note = "no two links lead to one another: everything is kept"
        notes.add("largest part", note, severity="warning")
        return network
    kept = core | _connectors(network, ends, core, turns) | _of_zones(network, ends, graph, core)
    if not kept.all():
        _note_what_fell_out(network, graph, core, ~kept, notes)
        network = without(network, ~kept)
    share = float(numbers(network.links["length"]).sum()) / 1000.0
    note = "links in the part where every origin reaches every destination; value: km"
    notes.add("largest part", f"{len(network.links)} {note}", value=share)
    return network


def strong_parts(network: Network, ends: Ends, turns: Turns) -> tuple[int, float]:
    """How many parts of links there are in which every link leads to every other, by open turns.

    And the share of the length of all links that is in the greatest of them.
    """
    if not len(ends.start):
        return 0, 0.0
    before, after = _open_turns(network, ends, turns)
    if is_one_part(before, after, len(ends.start)):
        parts, label = 1, np.zeros(len(ends.start), int)
    else:
        from scipy.sparse.csgraph import connected_components

        graph = _graph(before, after, len(ends.start))
        parts, label = connected_components(graph, directed=True, connection="strong")
    lengths = np.bincount(label, weights=np.nan_to_num(numbers(network.links["length"])))
    return int(parts), float(lengths.max() / lengths.sum()) if lengths.sum() else 0.0


def _open_turns(network: Network, ends: Ends, turns: Turns) -> tuple[Rows, Rows]:
    """Which link leads to which over nodes that may be passed."""
    passed = ~turns.banned & ~_closed(network)[ends.end[turns.before]]
    return turns.before[passed], turns.after[passed]


def _closed(network: Network) -> Flags:
    """Whether nobody may drive through each node."""
    if "through_traffic" not in network.nodes:
        return np.zeros(len(network.nodes), dtype=bool)
    return ~np.asarray(network.nodes["through_traffic"], dtype=bool)


def _lane_length(network: Network) -> Floats:
    """Length of lanes, m; what a file does not say counts as 1."""
    return np.asarray(
        np.nan_to_num(numbers(network.links["length"]), nan=1.0)
        * np.nan_to_num(numbers(network.links["lanes"]), nan=1.0)
    )


def _graph(before: Rows, after: Rows, links: int) -> Any:
    """Which link leads to which, as a sparse matrix."""
    from scipy.sparse import csr_array

    ones = np.ones(len(before), dtype=np.int8)
    return csr_array((ones, (before, after)), shape=(links, links))


def _largest(graph: Any, weight: Floats) -> Flags:
    """Links of the strongly connected part with the greatest weight."""
    from scipy.sparse.csgraph import connected_components

    _, label = connected_components(graph, directed=True, connection="strong")
    # by what one can read: equal parts may differ by the rounding of their sums
    found = np.round(np.bincount(label, weights=weight), 3)
    return np.asarray(label == label[np.flatnonzero(found[label] == found.max())[0]])


def _connectors(network: Network, ends: Ends, core: Flags, turns: Turns) -> Flags:
    """Links from and to closed nodes by which one enters or leaves the core."""
    closed = _closed(network)
    found = np.zeros(len(core), dtype=bool)
    into = ~turns.banned & closed[ends.start[turns.before]] & core[turns.after]
    out_of = ~turns.banned & closed[ends.end[turns.after]] & core[turns.before]
    found[turns.before[into]] = True
    found[turns.after[out_of]] = True
    return found


def _of_zones(network: Network, ends: Ends, graph: Any, core: Flags) -> Flags:
    """Links on ways from nodes of zones into the core, and from the core to such nodes."""
    origins, destinations = (_zones(network, name) for name in ("origin_of", "destination_of"))
    against = graph.T.tocsr()
    inward = _reached(graph, origins[ends.start]) & _reached(against, core)
    outward = _reached(against, destinations[ends.end]) & _reached(graph, core)
    return inward | outward


def _zones(network: Network, name: str) -> Flags:
    """Nodes at which trips of zones start (or end): as a column says, or all nodes of zones."""
    column = network.nodes.get(name, network.nodes.get("zone_id"))
    if column is None:
        return np.zeros(len(network.nodes), dtype=bool)
    return np.asarray(column.notna(), dtype=bool)


def _reached(graph: Any, starts: Flags) -> Flags:
    """Links that some lead to, themselves included."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import breadth_first_order

    number = len(starts)
    first = np.flatnonzero(starts)
    rows = graph.tocoo()
    before = np.concatenate([rows.coords[0], np.full(len(first), number)])
    after = np.concatenate([rows.coords[1], first])
    ones = np.ones(len(before), dtype=np.int8)
    whole = csr_array((ones, (before, after)), shape=(number + 1, number + 1))
    found = np.zeros(number + 1, dtype=bool)
    found[breadth_first_order(whole, number, return_predecessors=False)] = True
    return found[:number]


def _note_what_fell_out(
    network: Network, graph: Any, core: Flags, out: Flags, notes: Notes
) -> None:
    from scipy.sparse.csgraph import connected_components

    why = _reasons(graph, core)
    length = numbers(network.links["length"])
    rows = np.flatnonzero(out)
    for reason in (ISLAND, TRAP, SPRING):
        of_it = rows[why[rows] == reason]
        if len(of_it):
            km = float(length[of_it].sum()) / 1000.0
            note = f"{count(len(of_it), 'link')} that can be {reason}: left out; value: km"
            notes.add("fell out", note, element="link", severity="warning", value=km)
    _, piece = connected_components(graph[rows][:, rows], directed=False)
    rank = rank_of(network.links["link_id"])[rows]
    order = np.lexsort((rank, -np.round(length[rows], 3), piece))
    first = np.flatnonzero(np.diff(piece[order], prepend=-1))
    size = np.diff(np.append(first, len(order)))
    lengths_km = np.bincount(piece, weights=length[rows]) / 1000.0
    ids = np.asarray(network.links["link_id"], dtype=object)[rows[order[first]]]
    reasons = why[rows[order[first]]]
    told = sorted(
        zip(ids.tolist(), reasons.tolist(), size.tolist(), lengths_km.tolist(), strict=True)
    )
    for link_id, reason, number, length_km in told:
        note = f"a piece of {count(number, 'link')}, {length_km:.3f} km, that can be {reason}"
        notes.add_each("fell out", f"{note}; its longest link", [link_id])


def _reasons(graph: Any, core: Flags) -> Any:
    """Of each link, whether the core leads to it, or it to the core, or neither."""
    why = np.full(len(core), ISLAND, dtype=object)
    for direction, reason in ((graph, TRAP), (graph.T.tocsr(), SPRING)):
        why[_reached(direction, core)] = reason
    return why
