"""What looks wrong in a finished network: one note a doubt, of severity ``doubt``, at its place.

Nothing is changed. Whether a doubt is right only a look at the map, or at the road, can tell; what
is wrong is mended in the source or by an overrides table.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd

from uxsim_geo.errors import InputError
from uxsim_geo.network.doubtful_ends import doubtful_ends
from uxsim_geo.network.doubtful_values import (
    Road,
    bottlenecks,
    lane_jumps,
    narrow_pieces,
    odd_speeds,
)
from uxsim_geo.network.headings import in_plane
from uxsim_geo.network.incidence import Ends, Rows, ends_of, turns_of
from uxsim_geo.network.largest_part import strong_parts
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Element, Notes
from uxsim_geo.network.place_notes import MOST_SINGLE_NOTES
from uxsim_geo.network.ready_check import check_ids
from uxsim_geo.network.rows import count
from uxsim_geo.network.straight_on import straight_on
from uxsim_geo.network.units import KMH, PER_HOUR

#: topic of what is said of how links hang together
CONNECTIONS = "connections"

#: topic and note of streets that end before another
DEAD_END = (
    "doubtful dead end",
    "a street ends just before another to which no short way leads; value: gap",
)


@dataclass(frozen=True)
class Comparison:
    """What holds links against the road before and after them.

    column, factor, unit
        of the values told
    both
        whether the values before, here and after are told; otherwise those here and after
    """

    topic: str
    note: str
    find: Callable[[Road], Rows]
    column: str
    factor: float
    unit: str
    both: bool = True

    def values(self, road: Road, rows: Rows) -> list[str]:
        """Values of links with those of the road beside them, as ``50-100-50 km/h``."""
        numbers = road.number(self.column) * self.factor
        beside = [rows, road.on.after[rows]]
        if self.both:
            beside.insert(0, road.on.before[rows])
        columns = [[f"{value:.0f}" for value in numbers[row].tolist()] for row in beside]
        return [f"{'-'.join(parts)} {self.unit}" for parts in zip(*columns, strict=True)]


COMPARISONS = (
    Comparison(
        "doubtful narrow piece",
        "fewer lanes than the same road has on both sides; value: before, here, after",
        narrow_pieces,
        *("lanes", 1.0, "lanes"),
    ),
    Comparison(
        "doubtful lanes",
        "the same road goes on with two lanes more or fewer; value: here, after",
        lane_jumps,
        *("lanes", 1.0, "lanes"),
        both=False,
    ),
    Comparison(
        "doubtful speed",
        "far from the speed of the same road on both sides; value: before, here, after",
        odd_speeds,
        *("free_speed", KMH, "km/h"),
    ),
    Comparison(
        "doubtful capacity",
        "far less capacity than the same road has on both sides; value: before, here, after",
        bottlenecks,
        *("capacity", PER_HOUR, "veh/h"),
    ),
)

#: topics of doubts, in the order in which they are told
DOUBTS = (DEAD_END[0], *(comparison.topic for comparison in COMPARISONS))


def note_doubts(network: Network, notes: Notes) -> None:
    """Note how the network hangs together, and every doubtful spot.

    Spots are found where it is known where all links lie; in other networks the connections alone
    are told. Where ids are missing, not unique or not known, nothing is: that is no doubt but a
    fault, and is told by :func:`uxsim_geo.network.check.check_network`.
    """
    if not _is_tied(network):
        return
    ends = ends_of(network)
    turns = turns_of(network, ends)
    parts, share = strong_parts(network, ends, turns)
    note = f"{count(parts, 'part')} in which every link leads to every other"
    notes.add(CONNECTIONS, f"{note}; value: share of the km in the greatest", value=share)
    plane = _drawn_in_metres(network)
    if plane is None:
        return
    _note_dead_ends(plane, ends, notes)
    road = Road(network.links, ends, turns, straight_on(plane, ends, turns))
    for comparison in COMPARISONS:
        rows = comparison.find(road)
        values = comparison.values(road, rows)
        remark = (comparison.topic, comparison.note)
        _note_each(notes, remark, _ids(network.links["link_id"], rows), values)


def _is_tied(network: Network) -> bool:
    """Whether all ids that the tables name are there, once."""
    try:
        check_ids(network)
    except InputError:
        return False
    return True


def _drawn_in_metres(network: Network) -> Network | None:
    """The network in metres; None unless every link is a line there and every node a point."""
    import shapely

    if "geometry" not in network.links or "geometry" not in network.nodes:
        return None
    plane = in_plane(network)
    if plane is None:
        return None
    lines, points = (table["geometry"].to_numpy() for table in (plane.links, plane.nodes))
    kinds = ((lines, shapely.GeometryType.LINESTRING), (points, shapely.GeometryType.POINT))
    for shapes, kind in kinds:
        if (shapely.get_type_id(shapes) != kind).any() or shapely.is_empty(shapes).any():
            return None
        # around half the world no plane holds everything
        if not np.isfinite(shapely.get_coordinates(shapes)).all():
            return None
    return plane


def _note_dead_ends(network: Network, ends: Ends, notes: Notes) -> None:
    gaps = doubtful_ends(network, ends)
    links = _ids(network.links["link_id"], gaps.link)
    pairs = zip(gaps.metres.tolist(), links, strict=True)
    values = [f"{metres:.1f} m to {link}" for metres, link in pairs]
    _note_each(notes, DEAD_END, _ids(network.nodes["node_id"], gaps.node), values, "node")


def _ids(column: pd.Series, rows: Rows) -> list[str]:
    return [str(name) for name in column.iloc[rows]]


def _note_each(
    notes: Notes,
    remark: tuple[str, str],
    ids: list[str],
    values: list[str],
    element: Element = "link",
) -> None:
    """One note a doubt, up to a number that can be read; the rest are counted."""
    topic, note = remark
    most = MOST_SINGLE_NOTES
    notes.doubt_each(topic, note, ids[:most], values[:most], element=element)
    if len(ids) > most:
        more = "more of these, too many to list; value: how many"
        notes.add(topic, more, element=element, severity="doubt", value=len(ids) - most)
