"""Which rows of a demand are meant: by nodes, pairs, zones, areas, classes and times."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from uxsim_geo.demand.demand import Demand
from uxsim_geo.demand.transform import Where
from uxsim_geo.errors import Faults, InputError, did_you_mean
from uxsim_geo.network.network import Network
from uxsim_geo.network.selection import read_area

Flags = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Trips:
    """Trips for which all that is given holds; nothing given: all of them.

    where
        by nodes, pairs, classes and times of rows
    zones, origin_zones, destination_zones
        by column ``zone_id`` of nodes: trips that start or end there, start there, end there
    origin_area, destination_area
        WKT in the reference system of the network, or a GeoJSON or GeoPackage file: trips that
        start, or end, at a node in it
    """

    where: Where = field(default_factory=Where)
    zones: tuple[str, ...] = ()
    origin_zones: tuple[str, ...] = ()
    destination_zones: tuple[str, ...] = ()
    origin_area: str | None = None
    destination_area: str | None = None

    def rows(self, demand: Demand, network: Network) -> Flags:
        """Return whether each row is meant; shape (rows,).

        Raises :class:`uxsim_geo.errors.InputError` with all that is wrong: names that no row or
        node has, areas that are none, and no row for which all holds.
        """
        faults = Faults()
        chosen = np.ones(len(demand.table), bool)
        try:
            chosen &= self.where.rows(demand.table)
        except InputError as error:
            for fault in error.faults:
                faults.add(fault.what, column=fault.column, value=fault.value)
        chosen &= self._by_zone(demand, network, faults)
        for name, end in (("origin_area", "origin"), ("destination_area", "destination")):
            area = getattr(self, name)
            if area is not None:
                chosen &= _at(demand, end, _nodes_in(network, (name, area), faults))
        if not faults.found and not chosen.any():
            faults.add("no trips are meant: nobody fits all that is asked for")
        faults.raise_if_any()
        return chosen

    def _by_zone(self, demand: Demand, network: Network, faults: Faults) -> Flags:
        chosen = np.ones(len(demand.table), bool)
        tests: dict[str, Callable[[Flags], Flags]] = {
            "zones": lambda nodes: _at(demand, "origin", nodes) | _at(demand, "destination", nodes),
            "origin_zones": lambda nodes: _at(demand, "origin", nodes),
            "destination_zones": lambda nodes: _at(demand, "destination", nodes),
        }
        ids = network.nodes["node_id"].astype(str).to_numpy(object)
        for name, test in tests.items():
            if asked := getattr(self, name):
                of_zone = _in_zones(network, (name, asked), faults)
                chosen &= test(ids[of_zone])
        return chosen


def _at(demand: Demand, end: str, nodes: Any) -> Flags:
    at: Flags = demand.table[end].astype(str).isin(list(nodes)).to_numpy(bool)
    return at


def _in_zones(network: Network, asked: tuple[str, tuple[str, ...]], faults: Faults) -> Flags:
    """Return which nodes belong to some zones."""
    column, names = asked
    if "zone_id" not in network.nodes or network.nodes["zone_id"].isna().all():
        faults.add("the nodes of the network have no zones", column=column)
        return np.zeros(len(network.nodes), bool)
    zone = network.nodes["zone_id"].astype("str")
    known = zone.dropna().unique().tolist()
    for name in names:
        if name not in known:
            what = f"no node is of this zone{did_you_mean(name, known)}"
            faults.add(what, column=column, value=name)
    return np.asarray(zone.isin(list(names)), bool)


def _nodes_in(network: Network, named: tuple[str, str], faults: Faults) -> Any:
    """Return the ids of the nodes in an area."""
    import shapely

    column, polygon = named
    if "geometry" not in network.nodes:
        faults.add("the network has no coordinates", column=column)
        return []
    own = Faults()
    area = read_area(polygon, getattr(network.nodes, "crs", None), own)
    for fault in own.found:
        faults.add(fault.what, column=column, value=fault.value)
    if area is None:
        return []
    inside = shapely.intersects(network.nodes["geometry"].to_numpy(), area)
    if not inside.any():
        faults.add("no node lies in this area", column=column, value=polygon)
    return network.nodes["node_id"].astype(str).to_numpy(object)[inside]
