"""What trips between nodes add up to between zones, and at either end of them."""

from __future__ import annotations

import pandas as pd

from uxsim_geo.analysis.areas import Areas
from uxsim_geo.analysis.comparison.quantities import KEYS, TRIPS
from uxsim_geo.errors import Faults
from uxsim_geo.network.network import Network

ENDS = ("origin", "destination")


def check_zones(zones: Areas, network: Network) -> None:
    """Raise :class:`uxsim_geo.errors.InputError` for zones without nodes, or of unknown ones."""
    faults, known = Faults("zones"), set(network.nodes["node_id"].astype(str))
    if not zones:
        faults.add("is empty: name one at least")
    for name, nodes in zones.items():
        if not list(nodes):
            faults.add("names no node: name one at least", column=name)
        for node in nodes:
            if node not in known:
                faults.add("the network has no such node", column=name, value=node)
    faults.raise_if_any()


def zone_pairs(od: pd.DataFrame, zones: Areas) -> pd.DataFrame:
    """Trips between zones, one row a pair that has any, in the order of the zones.

    ``od`` are the pairs of nodes of :class:`uxsim_geo.analysis.comparison.measured.Measured`. A
    node of several zones counts in each of them. Columns: origin_zone, destination_zone, and the
    same quantities.
    """
    members = [(zone, node) for zone, nodes in zones.items() for node in nodes]
    table = od
    for end in ENDS:
        column = pd.DataFrame(members, columns=[f"{end}_zone", end], dtype="str")
        names = pd.CategoricalDtype(pd.Index([str(zone) for zone in zones], dtype="str"))
        table = table.merge(column.astype({f"{end}_zone": names}), on=end)
    return _together(table, list(KEYS["zone_pairs"]))


def zones_of_pairs(pairs: pd.DataFrame) -> pd.DataFrame:
    """Trips that start, and those that end, in every zone.

    ``pairs`` are what :func:`zone_pairs` gives. Columns: end, zone, and the same quantities.
    """
    tables = []
    for end in ENDS:
        key = f"{end}_zone"
        order = pd.CategoricalDtype(pd.Index(pd.unique(pairs[key]), dtype="str"))
        table = _together(pairs.astype({key: order}), [key]).rename(columns={key: "zone"})
        table.insert(0, "end", pd.Series([end] * len(table), dtype="str"))
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def _together(table: pd.DataFrame, keys: list[str]) -> pd.DataFrame:
    """Rows of equal keys as one: sums, and means weighted by the departed vehicles.

    Keys are categories; the rows come in their order.
    """
    means = [quantity.name for quantity in TRIPS if not quantity.adds_up]
    weighted = {name: (table[name] * table["departed_veh"]).fillna(0.0) for name in means}
    names = [quantity.name for quantity in TRIPS]
    found = table.assign(**weighted).groupby(keys, observed=True)[names].sum().reset_index()
    departed = found["departed_veh"].where(found["departed_veh"] > 0)
    for name in means:
        found[name] = found[name] / departed
    return found.astype(dict.fromkeys(keys, "str"))
