"""Trips between zones, few enough to look at: the network's own zones, its nodes, or squares."""

from __future__ import annotations

import string
from typing import NamedTuple

import numpy as np
import pandas as pd

from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.export.map_plane import round_below
from uxsim_geo.network.network import Network

#: more zones than this cannot be told apart on a map
MOST_ZONES = 400

#: the trips of more nodes than this are put together in squares
MOST_NODES = 150

#: of squares, about so many along the longer side of the map
SQUARES = 10

#: pairs that the page keeps, the largest
MOST_PAIRS = 20_000


class Zones(NamedTuple):
    """Zones with trips, and the pairs between them from the largest on.

    kind (what a zone is, in words), names, points (degrees; the mean of where trips start or end),
    origin, destination (rows of names), vehicles (demanded), delay (mean of those departed, s),
    pairs (how many there are, also those left out)
    """

    kind: str
    names: list[str]
    points: Floats
    origin: Integers
    destination: Integers
    vehicles: Floats
    delay: Floats
    pairs: int


def zones(network: Network, points: Floats, od: pd.DataFrame, *, on_earth: bool) -> Zones:
    """Sum the pairs of nodes of :func:`uxsim_geo.analysis.od.od_table` over zones.

    ``points`` are the nodes' places in degrees. Squares are as long as a round number of metres;
    their letters go from west to east, their numbers from south to north.
    """
    nodes = pd.Index(network.nodes["node_id"].astype(str))
    ends = [nodes.get_indexer(pd.Index(od[end].astype(str))) for end in ("origin", "destination")]
    used = np.unique(np.concatenate(ends)).astype(np.int64)
    names, kind = _names(network, points, used, on_earth=on_earth)
    zone, found = pd.factorize(names)
    zone_of = np.full(len(nodes), -1, np.int64)
    zone_of[used] = zone
    pairs = pd.DataFrame({"origin": zone_of[ends[0]], "destination": zone_of[ends[1]]})
    pairs["vehicles"] = od["vehicles_demanded"].to_numpy(float)
    pairs["departed"] = od["vehicles_departed"].to_numpy(float)
    pairs["delay"] = od["total_delay_so_far_veh_s"].to_numpy(float)
    sums = pairs.groupby(["origin", "destination"], as_index=False).sum()
    sums = sums.sort_values("vehicles", ascending=False, kind="stable")
    kept = sums.head(MOST_PAIRS)
    count = np.maximum(np.bincount(zone, minlength=len(found)), 1)
    centres = [np.bincount(zone, points[used, axis], len(found)) / count for axis in (0, 1)]
    return Zones(
        kind,
        [str(name) for name in found],
        np.stack(centres, axis=1),
        kept["origin"].to_numpy(np.int64),
        kept["destination"].to_numpy(np.int64),
        kept["vehicles"].to_numpy(float),
        (kept["delay"] / np.maximum(kept["departed"], 1e-9)).to_numpy(float),
        len(sums),
    )


def _names(
    network: Network, points: Floats, used: Integers, *, on_earth: bool
) -> tuple[pd.Series, str]:
    """The zone of each node that is used, and what zones are."""
    nodes = network.nodes.iloc[used].reset_index(drop=True)
    given = nodes["zone_id"] if "zone_id" in nodes else pd.Series(pd.NA, index=nodes.index)
    if given.notna().all() and given.nunique() <= MOST_ZONES:
        return given.astype(str), "zones of the network"
    if len(nodes) <= MOST_NODES:
        return nodes["node_id"].astype(str), "nodes"
    return _squares(points[used], on_earth=on_earth)


def _squares(points: Floats, *, on_earth: bool) -> tuple[pd.Series, str]:
    metres = 111_320.0
    plane = points * metres
    if on_earth:
        plane = plane * [np.cos(np.radians(points[:, 1].mean())), 1.0]
    plane = plane - plane.min(axis=0)
    side = round_below(float(plane.max()) / SQUARES * 1.3) if plane.max() > 0 else 1.0
    column, row = np.floor(plane / side).astype(np.int64).T
    names = [_letters(c) + str(r + 1) for c, r in zip(column.tolist(), row.tolist(), strict=True)]
    size = f"{side / 1000:g} km" if side >= 1000 else f"{side:g} m"
    kind = f"squares of {size}, A1 in the south-west" if on_earth else "squares"
    return pd.Series(names), kind


def _letters(number: int) -> str:
    """A ... Z, AA ..."""
    letters = ""
    number += 1
    while number:
        number, rest = divmod(number - 1, 26)
        letters = string.ascii_uppercase[rest] + letters
    return letters
