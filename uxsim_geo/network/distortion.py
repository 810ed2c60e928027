"""How much merging junctions has changed shortest lengths and free-flow times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from uxsim_geo.network.incidence import Flags, Floats, Rows, rank_of
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes, Severity
from uxsim_geo.network.rows import numbers
from uxsim_geo.network.turn_graph import Tree, TurnGraph, nodes_on_way, shortest, turn_graph

#: what ways are measured in
LENGTH, TIME = "length", "free-flow time"

#: what is told of the changes beside the greatest
PARTS = {"median change": 0.5, "95th percentile of change": 0.95, "99th percentile of change": 0.99}

#: m: between nearer nodes a share says little, so metres and seconds are told
NEAR = 1000.0

#: share within which lengths and times are to stay
WITHIN = 0.01

#: origins of a sample, even of the largest network
FEWEST = 8

#: of each origin, so many of the ways that have changed most are looked at
WORST = 100


@dataclass(frozen=True)
class Sample:
    """Ids of nodes that are in both networks: ways from some to all are compared."""

    origins: pd.Index
    nodes: pd.Index


@dataclass(frozen=True)
class Side:
    """One of the networks compared.

    nodes
        rows of the sample's; (nodes,)
    trees
        by measure: the shortest ways from each of the sample's origins, bans kept; turning back
        counts as closed where it is :func:`uxsim_geo.network.u_turns.needless`
    """

    graph: TurnGraph
    ids: pd.Index
    nodes: Rows
    trees: dict[str, list[Tree]]

    @classmethod
    def of(cls, network: Network, sample: Sample) -> Side:
        """Find the shortest ways of a network."""
        ids = pd.Index(network.nodes["node_id"])
        graph = turn_graph(network)
        length = numbers(network.links["length"])
        costs = {LENGTH: length, TIME: length / numbers(network.links["free_speed"])}
        nodes, origins = (
            ids.get_indexer(names).astype(np.int64) for names in (sample.nodes, sample.origins)
        )
        trees = {measure: list(shortest(graph, cost, origins)) for measure, cost in costs.items()}
        return cls(graph, ids, nodes, trees)

    def nodes_on_way(self, tree: Tree, place: int) -> set[str]:
        """Ids of the nodes on the way to one of the sample's nodes."""
        return set(self.ids[nodes_on_way(self.graph, tree, int(self.nodes[place]))])


@dataclass(frozen=True)
class Change:
    """Ways of one measure (length or free-flow time) that both networks have.

    before, after
        of the shortest ways, in m or s; (ways,)
    far
        whether each is at least :data:`NEAR` long before; (ways,)
    lost
        number of ways that are no longer there
    on_changed_ways
        ids of the nodes on the ways that are far and have changed most, by more than allowed
    """

    before: Floats
    after: Floats
    far: Flags
    lost: int
    on_changed_ways: frozenset[str]

    @property
    def shares(self) -> Floats:
        """By which share of what they were far ways have changed."""
        return np.abs(self.after[self.far] / self.before[self.far] - 1.0)


def sample_nodes(before: Network, after: Network, ways: int, seed: int) -> Sample:
    """Draw origins for so many ways among the nodes of both networks that are no merged ones.

    At least :data:`FEWEST` origins, at most all.
    """
    ids = after.nodes["node_id"]
    if "merged_node_ids" in after.nodes:
        ids = ids[after.nodes["merged_node_ids"].isna()]
    ids = ids[np.asarray(pd.Index(before.nodes["node_id"]).get_indexer(pd.Index(ids))) >= 0]
    names = ids.iloc[np.argsort(rank_of(ids))]
    origins = max(FEWEST, ways // max(len(names), 1))
    drawn = np.random.default_rng(seed).permutation(len(names))[:origins]
    return Sample(pd.Index(names.iloc[np.sort(drawn)]), pd.Index(names))


def compare(one: Side, other: Side, within: float = WITHIN) -> dict[str, Change]:
    """What became of lengths and of free-flow times, from one network to the other."""
    far = [tree.cost[one.nodes] >= NEAR for tree in one.trees[LENGTH]]
    return {measure: _compared(one, other, measure, (far, within)) for measure in one.trees}


def _compared(one: Side, other: Side, measure: str, bounds: tuple[list[Flags], float]) -> Change:
    far, within = bounds
    ways: list[Floats] = []
    fars: list[Flags] = []
    lost, on_ways = 0, set[str]()
    for tree, after, is_far in zip(one.trees[measure], other.trees[measure], far, strict=True):
        pair = np.stack([tree.cost[one.nodes], after.cost[other.nodes]])
        there = np.isfinite(pair).all(axis=0) & (pair[0] > 0)
        lost += int((np.isfinite(pair[0]) & ~np.isfinite(pair[1])).sum())
        ways.append(pair[:, there])
        fars.append(is_far[there])
        for place in _most_changed(pair, there & is_far, within):
            on_ways |= one.nodes_on_way(tree, place) | other.nodes_on_way(after, place)
    both = np.concatenate(ways, axis=1)
    return Change(both[0], both[1], np.concatenate(fars), lost, frozenset(on_ways))


def _most_changed(pair: Floats, there: Flags, within: float) -> list[int]:
    """Places of the ways that have changed by a greater share, at most :data:`WORST`."""
    share = np.zeros(pair.shape[1])
    share[there] = np.abs(pair[1, there] / pair[0, there] - 1.0)
    worst = np.argsort(-share, kind="stable")[:WORST]
    places: list[int] = worst[share[worst] > within].tolist()
    return places


def note_distortion(changes: dict[str, Change], notes: Notes) -> None:
    """Say how large the changes are."""
    for (measure, change), unit in zip(changes.items(), ("m", "s"), strict=True):
        shares = change.shares
        if len(shares):
            ways = f"{measure} of {len(shares)} sampled ways of 1 km and more"
            figures = {"share within 1 %": float((shares <= WITHIN).mean())}
            figures |= {name: float(np.quantile(shares, part)) for name, part in PARTS.items()}
            for name, value in figures.items():
                notes.add("distortion", f"{ways}: {name}", value=value)
            severity: Severity = "info" if shares.max() <= WITHIN else "warning"
            note = f"{ways}: greatest change"
            notes.add("distortion", note, severity=severity, value=float(shares.max()))
        off = np.abs(change.after - change.before)[~change.far]
        if len(off):
            note = f"{measure} of {len(off)} sampled ways below 1 km: greatest change, {unit}"
            notes.add("distortion", note, value=float(off.max()))
        if change.lost:
            note = f"sampled ways that led somewhere before, and do not now ({measure})"
            notes.add("distortion", note, severity="warning", value=change.lost)
