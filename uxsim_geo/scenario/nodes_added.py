"""New nodes, at which new links may start and end; and nodes without their signals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.errors import Faults, did_you_mean
from uxsim_geo.network.measure import add_degree_faults, parse_crs
from uxsim_geo.network.network import Network
from uxsim_geo.scenario.changes import EXISTS, Changes
from uxsim_geo.scenario.columns import longer


def add_node(
    network: Network, node_id: str, place: tuple[float, float], crs: str | None = None
) -> tuple[Network, pd.DataFrame]:
    """Put a node behind those of a network; it is no zone, has no signal and lets traffic through.

    ``place``: x and y in ``crs``, or in the reference system of the network. Returns the network
    and the changes. Raises :class:`uxsim_geo.errors.InputError` for an id that is taken and a
    place that is none.
    """
    faults, changes = Faults(), Changes()
    if node_id in set(network.nodes["node_id"].astype(str)):
        faults.add("the network has this node_id already", column="id", value=node_id)
    x, y = _in_network(network, place, crs, faults)
    faults.raise_if_any()
    known = {"node_id": node_id, "control": "none", "through_traffic": True}
    columns = {
        name: longer(network.nodes[name], [known.get(name)])
        for name in network.nodes.columns
        if name != "geometry"
    }
    nodes = pd.DataFrame(columns)
    if "geometry" in network.nodes:
        import geopandas
        import shapely

        points = [*network.nodes["geometry"], shapely.Point(x, y)]
        own = getattr(network.nodes, "crs", None)
        nodes = geopandas.GeoDataFrame(nodes, geometry=points, crs=own)[network.nodes.columns]
    changes.add("node", node_id, EXISTS, None, "yes")
    return replace(network, nodes=nodes), changes.table()


def _in_network(
    network: Network, place: tuple[float, float], crs: str | None, faults: Faults
) -> tuple[float, float]:
    """Return a place in the reference system of the network."""
    own: Any = getattr(network.nodes, "crs", None)
    given = own if crs is None else parse_crs(crs, faults)
    point = np.array([place], np.float64)
    if crs is not None and given is not None and own is None:
        faults.add("the network has no reference system: leave it out", column="crs", value=crs)
    elif given is not None and own is not None and given != own:
        from pyproj import Transformer

        add_degree_faults(point, given, faults)
        if faults.found:
            return place
        x, y = Transformer.from_crs(given, own, always_xy=True).transform(*place)
        point = np.array([[x, y]], np.float64)
        if not np.isfinite(point).all():
            what = "is outside of the reference system of the network"
            faults.add(what, column="x", value=place[0])
    add_degree_faults(point, own, faults)
    return float(point[0, 0]), float(point[0, 1])


def remove_signals(network: Network, node_ids: Sequence[str]) -> tuple[Network, pd.DataFrame]:
    """Take the signals of nodes away: their control is ``none`` then.

    Returns the network and the changes, none for nodes that have no signal. Raises
    :class:`uxsim_geo.errors.InputError` for nodes that are not there.
    """
    faults, changes = Faults(), Changes()
    ids = network.nodes["node_id"].astype(str).tolist()
    known = set(ids)
    for node_id in node_ids:
        if node_id not in known:
            what = f"the network has no such node_id{did_you_mean(node_id, ids)}"
            faults.add(what, column="nodes", value=node_id)
    faults.raise_if_any()
    if "control" not in network.nodes:
        return network, changes.table()
    control = network.nodes["control"].copy()
    meant = np.isin(ids, list(node_ids))
    for node_id in np.array(ids, object)[meant & np.asarray(control == "signal", bool)]:
        changes.add("node", node_id, "control", "signal", "none")
    control[meant] = "none"
    return replace(network, nodes=network.nodes.assign(control=control)), changes.table()
