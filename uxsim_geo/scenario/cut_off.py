"""Pairs of a demand that edits of the network leave without any way."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np
import pandas as pd

from uxsim_geo.demand.demand import Demand
from uxsim_geo.demand.driven import driven
from uxsim_geo.demand.reachable import reachable_pairs
from uxsim_geo.network.network import Network


def cut_off_pairs(
    before: Network, after: Network, demand: Demand, closed: Collection[str] = ()
) -> pd.DataFrame:
    """Return the pairs that no way connects after edits: origin, destination, vehicles, had_way.

    ``closed``: link_ids that nobody may enter at any time; ``had_way``: whether a way connected
    them before.
    """
    table = driven(demand).table
    pairs = table.groupby(["origin", "destination"], sort=False)["vehicles"].sum().reset_index()
    pairs = pairs.astype({"origin": "str", "destination": "str"})
    if not len(pairs):
        return pairs.assign(had_way=pd.Series(dtype=bool))
    lost = ~reachable_pairs(_open(after, closed), pairs["origin"], pairs["destination"])
    pairs = pairs[lost].reset_index(drop=True)
    if not len(pairs):
        return pairs.assign(had_way=pd.Series(dtype=bool))
    known = pairs["origin"].isin(before.nodes["node_id"])
    known &= pairs["destination"].isin(before.nodes["node_id"])
    had_way = np.asarray(known, bool).copy()
    some = pairs[had_way]
    had_way[had_way] = reachable_pairs(before, some["origin"], some["destination"])
    return pairs.assign(had_way=had_way)


def _open(network: Network, closed: Collection[str]) -> Network:
    """The network without closed links, and without the banned turns that name them."""
    if not closed:
        return network
    from uxsim_geo.network.bans import ban_paths

    names = set(closed)
    links = network.links[~network.links["link_id"].isin(names)].reset_index(drop=True)
    paths = ban_paths(network.movements) if len(network.movements) else []
    stay = [names.isdisjoint(path) for path in paths]
    moves = network.movements[stay].reset_index(drop=True) if paths else network.movements
    return replace(network, links=links, movements=moves)
