"""How much merging junctions has changed shortest lengths and free-flow times."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain

import numpy as np
import pandas as pd

from uxsim_geo.network.incidence import Flags, Floats, rank_of
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes, Severity
from uxsim_geo.network.rows import numbers
from uxsim_geo.network.turn_graph import shortest, turn_graph

#: what ways are measured in
LENGTH, TIME = "length", "free-flow time"

#: what is told of the changes beside the greatest
PARTS = {"median change": 0.5, "95th percentile of change": 0.95, "99th percentile of change": 0.99}

#: m: between nearer nodes a share says little, so metres and seconds are told
NEAR = 1000.0

#: share within which lengths and times are to stay
WITHIN = 0.01

#: origins of a sample from which all nodes are looked at, even in the largest network
FEWEST = 8

#: origins from which at least the nodes around are looked at
NEAR_ORIGINS = 100

#: m and s up to which nodes are around an origin, before merging; and after, not to miss any
AROUND, AROUND_AFTER = {LENGTH: 3 * NEAR, TIME: 300.0}, 1.1


@dataclass(frozen=True)
class Sample:
    """Ids of nodes that are in both networks: ways from some to all are compared.

    origins
        the first ``far`` of them to all nodes, the others to those around
    """

    origins: pd.Index
    nodes: pd.Index
    far: int


@dataclass(frozen=True)
class Change:
    """Ways of one measure (length or free-flow time) that both networks have.

    before, after
        of the shortest ways, in m or s; (ways,)
    far
        whether each is at least :data:`NEAR` long before; (ways,)
    lost
        number of ways that are no longer there
    """

    before: Floats
    after: Floats
    far: Flags
    lost: int

    @property
    def shares(self) -> Floats:
        """By which share of what they were far ways have changed."""
        return np.abs(self.after[self.far] / self.before[self.far] - 1.0)


def sample_nodes(before: Network, after: Network, ways: int, seed: int) -> Sample:
    """Draw origins for so many ways among the nodes of both networks that are whole junctions.

    Neither merged ones, nor those of a ring that was opened: nobody goes on along the ring there.

    From at least :data:`FEWEST` of them all nodes are looked at, from :data:`NEAR_ORIGINS` those
    around.
    """
    ids = after.nodes["node_id"]
    for column in ("merged_node_ids", "tight_ring"):
        if column in after.nodes:
            ids = ids[after.nodes.loc[ids.index, column].isna()]
    ids = ids[np.asarray(pd.Index(before.nodes["node_id"]).get_indexer(pd.Index(ids))) >= 0]
    names = ids.iloc[np.argsort(rank_of(ids))]
    far = max(FEWEST, ways // max(len(names), 1))
    drawn = np.random.default_rng(seed).permutation(len(names))[: max(far, NEAR_ORIGINS)]
    return Sample(pd.Index(names.iloc[drawn]), pd.Index(names), min(far, len(drawn)))


def compare(before: Network, after: Network, sample: Sample) -> dict[str, Change]:
    """What became of lengths and of free-flow times, bans kept, from one network to the other.

    Turning back counts as closed where it is :func:`uxsim_geo.network.u_turns.needless`.
    """
    was, now = _costs(before, sample, 1.0), _costs(after, sample, AROUND_AFTER)
    far = was[LENGTH] >= NEAR  # also where it is further than was looked
    return {measure: _compared(was[measure], now[measure], far) for measure in was}


def _costs(network: Network, sample: Sample, more: float) -> dict[str, Floats]:
    """By measure: of the shortest ways from the sample's origins to its nodes; (origins, nodes)."""
    ids = pd.Index(network.nodes["node_id"])
    graph = turn_graph(network)
    length = numbers(network.links["length"])
    nodes, origins = (
        ids.get_indexer(names).astype(np.int64) for names in (sample.nodes, sample.origins)
    )
    found = {}
    for measure, cost in ((LENGTH, length), (TIME, length / numbers(network.links["free_speed"]))):
        all_around = shortest(graph, cost, origins[: sample.far])
        near = shortest(graph, cost, origins[sample.far :], AROUND[measure] * more)
        found[measure] = np.stack([costs[nodes] for costs in chain(all_around, near)])
    return found


def _compared(was: Floats, now: Floats, far: Flags) -> Change:
    there = np.isfinite(was) & np.isfinite(now) & (was > 0)
    lost = int((np.isfinite(was) & ~np.isfinite(now)).sum())
    return Change(was[there], now[there], far[there], lost)


def note_distortion(changes: dict[str, Change], notes: Notes) -> None:
    """Say how large the changes of sampled ways are."""
    for (measure, change), unit in zip(changes.items(), ("m", "s"), strict=True):
        shares = change.shares
        if len(shares):
            ways = f"{measure} of {len(shares)} sampled ways of 1 km and more"
            figures = {"share within 1 %": float((shares <= WITHIN).mean())}
            figures |= {name: float(np.quantile(shares, part)) for name, part in PARTS.items()}
            for name, value in figures.items():
                notes.add("distortion", f"{ways}: {name}; value: share", value=value)
            severity: Severity = "info" if shares.max() <= WITHIN else "warning"
            note = f"{ways}: greatest change; value: share"
            notes.add("distortion", note, severity=severity, value=float(shares.max()))
        off = np.abs(change.after - change.before)[~change.far]
        if len(off):
            note = (
                f"{measure} of {len(off)} sampled ways below 1 km: greatest change; value: {unit}"
            )
            notes.add("distortion", note, value=float(off.max()))
        if change.lost:
            note = f"sampled ways that now lead nowhere ({measure}); value: ways"
            notes.add("distortion", note, severity="warning", value=change.lost)
