"""Bans on links that became parts of longer ones."""

from __future__ import annotations

from itertools import pairwise

import pandas as pd

from uxsim_geo.network.bans import VIA_COLUMN, ban_paths
from uxsim_geo.network.incidence import Flags, Rows
from uxsim_geo.network.network import Network


def movements_of_joined(
    network: Network, joined: Flags, number: Rows, ids: pd.Series
) -> tuple[pd.DataFrame, int]:
    """The bans in terms of the joined links, and how many have become void.

    ``joined``: nodes that are no longer; ``number``: row of the joined link that each link is
    now a part of; ``ids``: theirs. Links of one path that are parts of one link count once. A ban
    that turns back at a node that is no longer is void.
    """
    movements = network.movements
    row = {link_id: row for row, link_id in enumerate(network.links["link_id"])}
    gone = set(network.nodes["node_id"][joined])
    start = network.links["from_node_id"].tolist()
    names, chain = ids.tolist(), number.tolist()
    kept, paths = [], []
    for place, ban in enumerate(ban_paths(movements)):
        rows = [row[link_id] for link_id in ban]
        turns = [(chain[one], chain[other], start[other] in gone) for one, other in pairwise(rows)]
        if any(one != other and at_gone for one, other, at_gone in turns):
            continue
        path = [chain[rows[0]], *(other for one, other, _ in turns if one != other)]
        kept.append(place)
        paths.append([names[link] for link in path])
    table = movements.iloc[kept].reset_index(drop=True)
    table["from_link_id"] = pd.Series([path[0] for path in paths], dtype="str")
    table["to_link_id"] = pd.Series([path[-1] for path in paths], dtype="str")
    if VIA_COLUMN in movements:
        between = [" ".join(path[1:-1]) or None for path in paths]
        table[VIA_COLUMN] = pd.Series(between, dtype="str")
    return table, len(movements) - len(kept)
