"""Junctions merged as far as shortest ways stay what they were."""

from __future__ import annotations

from collections.abc import Callable

from uxsim_geo.network.clusters import JunctionSizes
from uxsim_geo.network.distortion import WITHIN, Side, compare, sample_nodes
from uxsim_geo.network.junctions import find_junctions, merged_of
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes

#: junctions are taken apart where a way has changed by more than this share of what is allowed:
#: other ways than those looked at change a little more
MARGIN = 0.8

#: m: junctions that change ways by less stay merged
HARDLY = 1.0

#: seed of the sample of ways that are looked at
SEED = 1


def merge_within(
    network: Network,
    sizes: JunctionSizes,
    limits: tuple[int, int],
    notes: Notes,
    tell: Callable[[float], None],
) -> Network:
    """Merge junctions, and take those apart again over which ways change by too much.

    ``limits``: so many ways are looked at, so many times; ``tell`` is
    called with the share done. What is left is a network in which the ways looked at that are
    1 km and longer have changed by less than 1 %, or the times were not enough.
    """
    ways, rounds = limits
    found = find_junctions(network, sizes)
    tell(0.3)
    own = Notes()
    merged = merged_of(found, own)
    apart: frozenset[str] = frozenset()
    sample = sample_nodes(network, merged, ways, SEED)
    before = Side.of(network, sample) if ways and rounds and found.merged else None
    for number in range(rounds if before is not None else 0):
        assert before is not None
        tell(0.4 + 0.6 * number / rounds)
        changes = compare(before, Side.of(merged, sample), MARGIN * WITHIN).values()
        on_ways = frozenset[str]().union(*(one.on_changed_ways for one in changes))
        more = _nodes_that_changed_ways(merged, on_ways)
        if not more:
            break
        apart |= more
        own = Notes()
        merged = merged_of(found.without(apart), own)
    notes.rows.extend(own.rows)
    note = "nodes of junctions left apart, since ways over them changed too much; value: how many"
    notes.add("junctions merged", note, element="node", value=len(apart))
    return merged


def _nodes_that_changed_ways(network: Network, ids: frozenset[str]) -> frozenset[str]:
    """Ids of all nodes of the merged junctions that are named and have changed some way."""
    if "merged_node_ids" not in network.nodes:
        return frozenset()
    changed = network.nodes["merge_error"] > HARDLY
    members = [names.split() for names in network.nodes["merged_node_ids"][changed]]
    return frozenset(name for names in members if not ids.isdisjoint(names) for name in names)
