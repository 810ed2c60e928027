"""Where trips of a zone start and end: access nodes, each with its share of the zone's trips."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.demand.loading import zone_nodes
from uxsim_geo.network.network import NOTE_COLUMNS, Network

End = Literal["origin", "destination"]
ENDS: tuple[End, End] = ("origin", "destination")


@dataclass(frozen=True)
class Access:
    """Nodes at which trips of each zone start, and at which they end.

    zones
        all zones that are known, those without a node too
    origins, destinations
        zone, node (text), share (float64, > 0; those of a zone sum to 1)
    notes
        what was assumed, as in :class:`uxsim_geo.network.network.Network`
    """

    zones: pd.Index[str]
    origins: pd.DataFrame
    destinations: pd.DataFrame
    notes: pd.DataFrame = field(
        default_factory=lambda: pd.DataFrame(
            {name: pd.Series(dtype="str") for name in NOTE_COLUMNS}
        )
    )

    def of(self, end: End) -> pd.DataFrame:
        """The nodes of one end."""
        return self.origins if end == "origin" else self.destinations


def access_of_network(network: Network) -> Access:
    """The zones that the network itself names, their nodes in even shares.

    As :func:`uxsim_geo.demand.loading.zone_nodes`: in a network without zones every node is one.
    """
    tables = []
    for end in ENDS:
        table = zone_nodes(network, end).rename(columns={f"{end}_zone": "zone", end: "node"})
        tables.append(with_shares(table, np.ones(len(table))))
    return Access(_zones_of(tables), *tables)


def access_of_nodes(network: Network) -> Access:
    """Every node as a zone of its own, for tables between nodes."""
    ids = network.nodes["node_id"].astype("str").reset_index(drop=True)
    table = pd.DataFrame({"zone": ids, "node": ids, "share": 1.0})
    return Access(pd.Index(ids, dtype="str"), table, table)


def with_shares(table: pd.DataFrame, weights: npt.NDArray[np.float64]) -> pd.DataFrame:
    """zone, node and the share of each node in the weights (> 0) of its zone, ordered by zone."""
    zones, names = pd.factorize(table["zone"])
    share = weights / np.bincount(zones, weights, minlength=len(names))[zones]
    found = table[["zone", "node"]].astype("str").assign(share=share)
    return found.iloc[np.argsort(zones, kind="stable")].reset_index(drop=True)


def _zones_of(tables: list[pd.DataFrame]) -> pd.Index[str]:
    zones: pd.Index[str] = pd.Index(
        pd.concat([table["zone"] for table in tables]).unique(), dtype="str"
    )
    return zones
