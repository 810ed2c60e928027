"""Between which places trips are told of: one rule for the page and the layer of desire lines.

1. The zones of the network, where all nodes with trips have one (``zone_id``) and zones are not
   more than :data:`MOST_ZONES`: a reader knows them by their names.
2. The nodes, where those with trips are not more than :data:`MOST_NODES`, or lie nowhere.
3. Squares of the map, as small as leaves not more than :data:`MOST_SQUARES` of them with trips:
   their sides are 1, 2 or 5 times a power of ten. Letters of columns go from west to east,
   numbers of rows from south to north, from the first with trips on.

Each place lies at the mean of the trips that start or end there.
"""

from __future__ import annotations

import string
from dataclasses import dataclass

import numpy as np
import pandas as pd

from uxsim_geo.analysis.edie import ratio
from uxsim_geo.analysis.groups import Groups
from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.export.map_plane import MapPlane, round_below
from uxsim_geo.network.network import Network

MOST_ZONES = 400
MOST_NODES = 150
MOST_SQUARES = 60


@dataclass(frozen=True)
class TripEnds:
    """Places where trips start and end.

    kind
        what they are, in words
    names
        of all places
    of_node
        row of ``names`` for every node; −1: no trips
    side
        length of a square's side, m; NaN where ends are no squares, or there is no CRS
    origin, destination
        rows of the nodes for every row of the table
    vehicles
        of every row of the table
    """

    kind: str
    names: list[str]
    of_node: Integers
    side: float
    origin: Integers
    destination: Integers
    vehicles: Floats

    @classmethod
    def of(cls, network: Network, od: pd.DataFrame) -> TripEnds:
        """Choose places for a table of :func:`uxsim_geo.analysis.od.od_table`.

        Raises ValueError if it names nodes that the network lacks.
        """
        known = pd.Index(network.nodes["node_id"].astype(str))
        origin, destination = (
            known.get_indexer(pd.Index(od[end].astype(str))).astype(np.int64)
            for end in ("origin", "destination")
        )
        used = np.unique(np.concatenate([origin, destination]))
        if used.size and used[0] < 0:
            raise ValueError("the table names nodes that the network lacks")
        kind, names, side = _places(network, used)
        number, found = pd.factorize(pd.Series(names, dtype=object))
        of_node = np.full(len(known), -1, np.int64)
        of_node[used] = number
        vehicles = od["vehicles_demanded"].to_numpy(float)
        texts = [str(name) for name in found]
        return cls(kind, texts, of_node, side, origin, destination, vehicles)

    def pairs(self) -> Groups:
        """Rows of the table by the places where their trips start and end."""
        return Groups.of(self.of_node[self.origin], self.of_node[self.destination])

    def points(self, of_nodes: Floats) -> Floats:
        """Where the places lie, from the points of all nodes, shape (nodes, 2)."""
        node = np.concatenate([self.origin, self.destination])
        end, size = self.of_node[node], len(self.names)
        # pairs without vehicles have a place too
        weights = np.maximum(np.concatenate([self.vehicles] * 2), 1e-9)
        whole = np.bincount(end, weights, minlength=size).astype(float)
        # distances from one of them, so that a place with one node lies exactly there
        first = of_nodes[node[np.unique(end, return_index=True)[1]]]
        away = of_nodes[node] - first[end]
        sums = [np.bincount(end, weights * away[:, axis], size).astype(float) for axis in (0, 1)]
        mean: Floats = first + np.stack([ratio(total, whole) for total in sums], axis=1)
        return mean


def _places(network: Network, used: Integers) -> tuple[str, list[str], float]:
    """What the places of the used nodes are, the name of each node's, and the side of squares."""
    nodes = network.nodes.iloc[used]
    if "zone_id" in nodes and nodes["zone_id"].notna().all() and len(nodes):
        zones = nodes["zone_id"].astype(str)
        if zones.nunique() <= MOST_ZONES:
            return "zones of the network", zones.tolist(), np.nan
    if len(nodes) <= MOST_NODES or "geometry" not in network.nodes:
        return "nodes", nodes["node_id"].astype(str).tolist(), np.nan
    return _squares(MapPlane.of(network), used)


def _squares(plane: MapPlane, used: Integers) -> tuple[str, list[str], float]:
    points, metres = plane.points[used], plane.metres_per_unit
    unit = metres or 1.0
    low = points.min(axis=0)
    side = round_below(max(float((points.max(axis=0) - low).max()) * unit, 1e-6) / 200)
    while len(np.unique(cells := _cells(points, side / unit), axis=0)) > MOST_SQUARES:
        side = round_below(side * 2.55)  # the next of 1, 2 and 5 times a power of ten
    column, row = (cells - cells.min(axis=0)).T.tolist()
    names = [f"{_letters(x)}{y + 1}" for x, y in zip(column, row, strict=True)]
    if metres is None:
        return "squares", names, np.nan
    size = f"{side / 1000:g} km" if side >= 1000 else f"{side:g} m"
    return f"squares of {size}, A1 in the south-west", names, side


def _cells(points: Floats, side: float) -> Integers:
    """Column and row of each point, in a grid that does not hang on which nodes have trips."""
    return np.floor(points / side).astype(np.int64)


def _letters(number: int) -> str:
    """A ... Z, AA ..."""
    letters = ""
    number += 1
    while number:
        number, rest = divmod(number - 1, 26)
        letters = string.ascii_uppercase[rest] + letters
    return letters
