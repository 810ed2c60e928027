"""What the page's scripts read, as one document of plain values, and arrays beside it."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.analysis.types import Floats, Integers
from uxsim_geo.export.clock import Clock
from uxsim_geo.export.lost_time import LEAST_JUNCTION, Junctions, Street
from uxsim_geo.export.page.levels import Levels
from uxsim_geo.export.page.over_time import OverTime
from uxsim_geo.export.page.places import Places
from uxsim_geo.export.page.quantities import quantities
from uxsim_geo.export.page.zones import Zones
from uxsim_geo.network.diagram import effective_capacity
from uxsim_geo.network.network import Network
from uxsim_geo.network.street_names import street_names
from uxsim_geo.network.units import KMH, PER_HOUR, PER_KM, TIMES

#: of more links than this the least used are shown only when one looks closer
MOST_SHOWN = 40_000

#: for about so many ticks the axes of large and of small curves have room
TICKS = (5, 2)


class Tables(NamedTuple):
    """What was made of a run for the page, in its time bins.

    first are the report's bins with which those begin, worst_bin the report's in which most is
    lost, volume the vehicles that entered each link.
    """

    first: Integers

    levels: Levels
    network: OverTime
    streets: list[Street]
    worst_bin: int
    junctions: Junctions
    zones: Zones
    volume: Floats


def document(tables: Tables, places: Places, clock: Clock) -> dict[str, Any]:
    """Everything but the links that is no array of links × bins: JSON's types alone."""
    levels, edges = tables.levels, tables.levels.edges.tolist()
    return {
        "edges": plain(levels.edges, 3),
        "spans": [clock.span(*span) for span in pairwise(edges)],
        "ticks": {str(most): clock.ticks(most) for most in TICKS},
        "top": levels.top,
        "least": levels.least,
        "largest": levels.largest,
        "quantities": [entry._asdict() for entry in quantities(dict(levels.values))],
        "network": {name: plain(values, 3) for name, values in tables.network._asdict().items()},
        "zones": _zones(tables.zones),
        "junctions": _junctions(tables.junctions, places.points),
        "worst_bin": bin_of_page(tables.worst_bin, tables.first),
        "worst": [
            {"link": street.link, "bin": bin_of_page(street.bin, tables.first)}
            for street in tables.streets
        ],
    }


def link_columns(
    network: Network, reaction_time: float, volume: npt.NDArray[Any]
) -> dict[str, Any]:
    """Attributes of the links, by column; texts that repeat are told once.

    ``volume`` are the vehicles that entered each link. order are the rows as they are drawn, unused
    ones first, then slow and narrow ones; the first ``minor`` of them wait until one looks closer.
    """
    links = network.links
    names, name = _told_once(street_names(links))
    classes, road_class = _told_once(_texts(links, "road_class"))
    nodes, ends = _told_once(pd.concat([links["from_node_id"], links["to_node_id"]]).astype(str))
    capacity = effective_capacity(links, reaction_time)
    free, lanes = links["free_speed"].to_numpy(float), links["lanes"].to_numpy(float)
    order = np.lexsort((volume, free * lanes, volume > 0))
    return {
        "ids": links["link_id"].astype(str).tolist(),
        "names": names,
        "name": name,
        "named": _texts(links, "name").ne("").any().item(),
        "classes": classes,
        "class": road_class,
        "nodes": nodes,
        "from": ends[: len(links)],
        "to": ends[len(links) :],
        "length": plain(links["length"], 1),
        "lanes": plain(lanes, 2),
        "free_kmh": plain(free * KMH, 1),
        "capacity_vph": plain(capacity * PER_HOUR, 0),
        "jam_vpkm": plain(links["jam_density"].to_numpy(float) * lanes * PER_KM, 1),
        "volume": plain(volume, 0),
        "order": order.tolist(),
        "minor": max(len(links) - MOST_SHOWN, 0),
    }


def plain(values: npt.ArrayLike, digits: int) -> list[float | int | None]:
    """Rounded numbers for JSON: whole ones without a point, None for those that are not finite."""
    rounded = np.round(np.asarray(values, float), digits)
    return [
        None if not np.isfinite(value) else int(value) if value == int(value) else value
        for value in rounded.tolist()
    ]


def bin_of_page(number: int, first: Integers) -> int:
    """The page's time bin that holds one of the report's."""
    return int(np.searchsorted(first, number, side="right")) - 1


def _junctions(junctions: Junctions, points: Floats) -> dict[str, Any]:
    return {
        "points": [plain(point, 6) for point in points[junctions.nodes]],
        "links": junctions.links.tolist(),
        "largest_min": junctions.largest / TIMES["min"],
        "least": LEAST_JUNCTION,
    }


def _zones(zones: Zones) -> dict[str, Any]:
    return {
        "kind": zones.kind,
        "names": zones.names,
        "points": [plain(point, 6) for point in zones.points],
        "origin": zones.origin.tolist(),
        "destination": zones.destination.tolist(),
        "vehicles": plain(zones.vehicles, 1),
        "delay_min": plain(zones.delay / TIMES["min"], 2),
        "pairs": zones.pairs,
    }


def _told_once(texts: pd.Series) -> tuple[list[str], list[int]]:
    codes, names = pd.factorize(texts)
    return [str(name) for name in names], codes.tolist()


def _texts(links: pd.DataFrame, column: str) -> pd.Series:
    if column not in links:
        return pd.Series("", index=links.index)
    return links[column].astype("string").fillna("").astype(str)
