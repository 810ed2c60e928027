"""One-way rings whose links hold less than a platoon each: direct links take their place.

Around the middle of a crossing of one-way carriageways that cannot be one node, links of a few
metres lead in a ring. Once each of them is full of vehicles that want to go on to the next, none
can move ever again: in a model of platoons a few vehicles are enough, on the road they would not
have stopped there. So every node of the ring at which vehicles come in gets a
direct link to every node at which they go out, along the same way: as long, and as fast. No direct
link leads on to another, so nobody waits for one in a ring; lengths and times stay exactly as they
were. Flows that cross within the ring no longer hinder one another, as at any single node.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain, product

import numpy as np
import pandas as pd
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, shortest_path

from uxsim_geo.network.bans import ban_paths, ban_rows
from uxsim_geo.network.incidence import Ends, Flags, Grouped, Rows, ends_of, passed_nodes
from uxsim_geo.network.joined_columns import Groups
from uxsim_geo.network.joining import kind_of_each, links_of_chains, located
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.place_notes import note_places
from uxsim_geo.network.rows import numbers

#: nodes of a ring; larger ones would need too many direct links
MOST_NODES = 8

#: why a ring stays as it is
BANNED = "turns in it are banned"
TWO_WAY = "one can turn back into a street by going round it"

#: in the column restriction of bans of going from one direct link on to another
ALONG_RING = "direct link"


@dataclass(frozen=True)
class Ring:
    """A ring: rows of its links, of the links that lead into it, and of those that lead out.

    entries, exits
        rows of its nodes at which they do
    """

    links: Rows
    inward: Rows
    outward: Rows
    entries: Rows
    exits: Rows


def open_tight_rings(network: Network, storage: float, notes: Notes) -> Network:
    """Put direct links in the place of rings whose links hold fewer vehicles than ``storage``.

    ``storage`` in veh, by length, lanes and jam density; 0: nothing is done. Rings of more than
    :data:`MOST_NODES` nodes stay; those in which turns are banned, and those with a two-way street
    at a node, as roundabouts have them, stay and are noted. Nodes get the column tight_ring: an id
    that the nodes of one ring share, null of all others.
    """
    if not storage or not len(network.links):
        return network
    ends = ends_of(network)
    found = _rings(network, ends, storage)
    in_ban = _in_bans(network)
    why = [_why_not(ring, ends, in_ban) for ring in found]
    ids = network.nodes["node_id"].to_numpy()
    for reason in (BANNED, TWO_WAY):
        left = [
            min(ids[ring.entries]) for ring, one in zip(found, why, strict=True) if one == reason
        ]
        remark = ("tight ring left", f"its links may lock one another: {reason}")
        note_places(notes, remark, left, element="node")
    rings = [ring for ring, one in zip(found, why, strict=True) if one is None]
    if not rings:
        return network
    remark = ("tight ring", "direct links in the place of so many; value: links gone")
    names, sizes = [min(ids[ring.entries]) for ring in rings], [len(ring.links) for ring in rings]
    note_places(notes, remark, names, element="node", values=sizes)
    return _with_direct_links(network, ends, rings)


def _rings(network: Network, ends: Ends, storage: float) -> list[Ring]:
    """All rings of a size that can be opened, in the order of their first links."""
    tight = _tight(network, ends, storage)
    part = _strong_parts(ends, tight)
    within = tight & (part[ends.start] == part[ends.end])
    arriving, leaving = (Grouped.of(node, ends.nodes) for node in (ends.end, ends.start))
    of_part = Grouped.of(np.where(within, part[ends.start], ends.nodes), ends.nodes + 1)
    rings: list[Ring] = []
    for one in dict.fromkeys(part[ends.start[within]].tolist()):
        links = of_part.rows_of_one(one)
        nodes = np.unique(ends.start[links])
        inward, outward = (
            np.setdiff1d(around.rows_of(nodes), links) for around in (arriving, leaving)
        )
        entries, exits = np.unique(ends.end[inward]), np.unique(ends.start[outward])
        leads_on = len(entries) and len(exits) and len(np.union1d(entries, exits)) > 1
        if 3 <= len(nodes) <= MOST_NODES and leads_on:
            rings.append(Ring(links, inward, outward, entries, exits))
    return rings


def _why_not(ring: Ring, ends: Ends, in_ban: Flags) -> str | None:
    """Why a ring has to stay; None: it can be opened."""
    if in_ban[ring.links].any():
        return BANNED
    both = set(np.intersect1d(ring.entries, ring.exits).tolist())
    come = _pairs(ends.end[ring.inward], ends.start[ring.inward])
    leave = _pairs(ends.start[ring.outward], ends.end[ring.outward])
    return TWO_WAY if any(node in both for node, _ in come & leave) else None


def _pairs(one: Rows, other: Rows) -> set[tuple[int, int]]:
    return set(zip(one.tolist(), other.tolist(), strict=True))


def _tight(network: Network, ends: Ends, storage: float) -> Flags:
    """Links that hold fewer vehicles, of one-way pairs of nodes between which traffic may pass."""
    links = network.links
    room = numbers(links["length"]) * numbers(links["lanes"]) * numbers(links["jam_density"])
    pairs = ends.start * ends.nodes + ends.end
    one_way = ~np.isin(ends.end * ends.nodes + ends.start, pairs)
    single = pd.Series(pairs).map(pd.Series(pairs).value_counts()).to_numpy() == 1
    passed = passed_nodes(network)
    speeds_known = np.isfinite(numbers(links["free_speed"]))
    at_ends = passed[ends.start] & passed[ends.end]
    return np.asarray((room < storage) & one_way & single & at_ends & speeds_known)


def _strong_parts(ends: Ends, tight: Flags) -> Rows:
    """The strongly connected part of every node, over tight links alone."""
    start, end = ends.start[tight], ends.end[tight]
    graph = csr_array((np.ones(len(start)), (start, end)), shape=(ends.nodes, ends.nodes))
    part: Rows = connected_components(graph, directed=True, connection="strong")[1]
    return part.astype(np.int64)


def _in_bans(network: Network) -> Flags:
    named = set(chain.from_iterable(ban_paths(network.movements)))
    return np.asarray(network.links["link_id"].isin(named), dtype=bool)


def _with_direct_links(network: Network, ends: Ends, rings: list[Ring]) -> Network:
    """The network without the links of the rings, and with direct ones behind all others."""
    paths = [path for ring in rings for path in _paths(network, ends, ring)]
    gone = np.concatenate([ring.links for ring in rings])
    kept = np.ones(len(network.links), dtype=bool)
    kept[gone] = False
    direct = _direct(network, paths)
    together = pd.concat([network.links[kept], direct], ignore_index=True)
    links = located(together[network.links.columns], network.links)
    used = np.unique(np.concatenate([*(ring.entries for ring in rings), ends.start[kept]]))
    used = np.union1d(used, np.concatenate([*(ring.exits for ring in rings), ends.end[kept]]))
    nodes = network.nodes.assign(tight_ring=_ring_of_node(network, ends, rings))
    nodes = nodes.iloc[used].reset_index(drop=True)
    movements = pd.concat([network.movements, _bans(network, direct)], ignore_index=True)
    return Network(nodes, links, movements, network.notes)


def _ring_of_node(network: Network, ends: Ends, rings: list[Ring]) -> pd.Series:
    """The least id of the entries of its ring, of every node of one."""
    ids = network.nodes["node_id"].to_numpy()
    found = pd.Series([None] * len(ids), index=network.nodes.index, dtype="str")
    for ring in rings:
        found.iloc[np.unique(ends.start[ring.links])] = min(ids[ring.entries])
    return found


def _paths(network: Network, ends: Ends, ring: Ring) -> list[Rows]:
    """Rows of links along the fastest way from each entry to each exit of a ring."""
    nodes = np.unique(ends.start[ring.links])
    start = np.searchsorted(nodes, ends.start[ring.links])
    end = np.searchsorted(nodes, ends.end[ring.links])
    links = network.links.iloc[ring.links]
    time = numbers(links["length"]) / numbers(links["free_speed"])
    graph = csr_array((time, (start, end)), shape=(len(nodes), len(nodes)))
    _, before = shortest_path(graph, return_predecessors=True)
    pairs = zip(start.tolist(), end.tolist(), strict=True)
    row = dict(zip(pairs, ring.links.tolist(), strict=True))
    entries, exits = (np.searchsorted(nodes, at).tolist() for at in (ring.entries, ring.exits))
    return [_way(before, row, *pair) for pair in product(entries, exits) if pair[0] != pair[1]]


def _way(before: Rows, row: dict[tuple[int, int], int], entry: int, exit_: int) -> Rows:
    way = []
    place = exit_
    while place != entry:
        previous = int(before[entry, place])
        way.append(row[previous, place])
        place = previous
    return np.array(way[::-1], dtype=np.int64)


def _direct(network: Network, paths: list[Rows]) -> pd.DataFrame:
    """One link a path: its pieces' lengths and times in all, and their words side by side."""
    pieces = network.links.iloc[np.concatenate(paths)].reset_index(drop=True)
    size = np.array([len(path) for path in paths], dtype=np.int64)
    groups = Groups(np.arange(len(pieces)), np.cumsum(size) - size, size)
    return links_of_chains(pieces, groups, kind_of_each(pieces), set(network.links["link_id"]))


def _bans(network: Network, direct: pd.DataFrame) -> pd.DataFrame:
    """From no direct link on to another."""
    columns = ["link_id", "from_node_id", "to_node_id"]
    pairs = direct[columns].merge(
        direct[columns], left_on="to_node_id", right_on="from_node_id", suffixes=("", "_after")
    )
    links = pairs["to_node_id"], pairs["link_id"], pairs["link_id_after"]
    return ban_rows(network.movements, *links, ALONG_RING)
