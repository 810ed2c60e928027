"""Links taken out, and what names them: banned turns, signal plans, given routes."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np
import pandas as pd

from uxsim_geo.control.site import Target
from uxsim_geo.demand.demand import Demand
from uxsim_geo.errors import Faults
from uxsim_geo.network.bans import ban_paths
from uxsim_geo.network.network import Network
from uxsim_geo.scenario.changes import EXISTS, Changes
from uxsim_geo.scenario.link_attributes import chosen_links


def remove_links(network: Network, target: Target) -> tuple[Network, pd.DataFrame]:
    """Take links out, and the banned turns that name them; nodes stay.

    Returns the network and the changes. Raises :class:`uxsim_geo.errors.InputError` where the
    target is wrong, means no link, or all of them.
    """
    rows = chosen_links(network, target)
    if len(rows) == len(network.links):
        faults = Faults()
        faults.add("no link of the network would stay", column="links", value=str(target))
        faults.raise_if_any()
    changes = Changes()
    gone = network.links["link_id"].iloc[rows].astype(str).tolist()
    for link_id in gone:
        changes.add("link", link_id, EXISTS, "yes", None)
    stay = np.ones(len(network.links), bool)
    stay[rows] = False
    paths = ban_paths(network.movements) if len(network.movements) else []
    names = set(gone)
    named = np.array([not names.isdisjoint(path) for path in paths], bool)
    for path, hit in zip(paths, named, strict=True):
        if hit:
            changes.add("turn", " ".join(path), "banned", "yes", None)
    movements = network.movements
    if named.any():
        movements = movements[~named].reset_index(drop=True)
    links = network.links[stay].reset_index(drop=True)
    return replace(network, links=links, movements=movements), changes.table()


def without_routes_over(demand: Demand, gone: Collection[str]) -> tuple[Demand, pd.DataFrame]:
    """Let drivers whose given route names links that are gone choose their own way.

    Returns the demand and the changes.
    """
    changes = Changes()
    if "route" not in demand.table:
        return demand, changes.table()
    names = set(gone)
    routes = demand.table["route"].tolist()
    for row, route in enumerate(routes):
        if isinstance(route, list | tuple | np.ndarray) and not names.isdisjoint(map(str, route)):
            one = demand.table.iloc[row]
            pair = f"{one['origin']} to {one['destination']}"
            changes.add("demand", pair, "route", " ".join(map(str, route)), "chosen on the way")
            routes[row] = None
    column = pd.Series(routes, demand.table.index, dtype=object)
    return replace(demand, table=demand.table.assign(route=column)), changes.table()


def without_signals_over(signals: pd.DataFrame, links: Collection[str]) -> pd.DataFrame:
    """Return a signal table without links that are gone; phases stay as long as they are.

    ``links`` are those that are there. A phase that loses its last link is one in which nobody
    drives, and a node that loses all its links has no plan any more.
    """
    there = signals["link_id"].isna() | signals["link_id"].isin(list(links))
    nodes = signals.loc[there & signals["link_id"].notna(), "node_id"]
    signals = signals[signals["node_id"].isin(nodes)].copy()
    there = there.loc[signals.index]
    signals.loc[~there, "link_id"] = None
    phase = [signals["node_id"], signals["phase"]]
    some = signals["link_id"].notna().groupby(phase).transform("any")
    first = ~signals.duplicated(["node_id", "phase"])
    return signals[there | (~some & first)].reset_index(drop=True)
