"""Streets on which most time was lost, named and numbered: where, when and how bad."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.export.space_time.choice import Choice
from uxsim_geo.export.space_time.frame import Frame
from uxsim_geo.export.space_time.look import Look
from uxsim_geo.network.network import Network
from uxsim_geo.network.units import KMH

PLACES = 5  # streets with numbers
POLE = 1.06  # height of the poles with numbers, as a part of that of the time axis
HIGHER = 0.09  # of it: what a pole beside another is higher
NEAR = 0.08  # poles nearer to each other than this stand beside each other


@dataclass(frozen=True)
class Place:
    """A street, or a link without a name, on which much time was lost.

    name, link (row of its worst link), lost (veh·h), begin and end (s, of its slow states),
    speed (km/h, the lowest in a bin of all its slow links together).
    """

    name: str
    link: int
    lost: float
    begin: float
    end: float
    speed: float


def places(network: Network, choice: Choice) -> list[Place]:
    """The streets with most lost time in slow states, of the links that are drawn."""
    if not choice.links.size:
        return []
    names = street_names(network)[choice.links]
    slow = choice.slow[choice.links]
    lost, distance, time = (
        np.where(slow, choice.grid.values(column)[choice.links], 0.0)
        for column in ("delay", "distance", "time")
    )
    street, known = pd.factorize(names)
    by_street = np.bincount(street, lost.sum(axis=1))
    found = []
    for number in np.argsort(-by_street, kind="stable")[:PLACES]:
        own = street == number
        bins = np.flatnonzero(slow[own].any(axis=0))
        spent = time[own].sum(axis=0)[bins]
        speed = KMH * float(np.min(distance[own].sum(axis=0)[bins] / spent))
        begin, end = choice.grid.begin[bins[0]], choice.grid.end[bins[-1]]
        worst = int(choice.links[np.flatnonzero(own)[0]])
        told = by_street[number] / 3600, float(begin), float(end), speed
        found.append(Place(str(known[number]), worst, *told))
    return found


def street_names(network: Network) -> npt.NDArray[np.object_]:
    """Names of streets, and the link's own id where it has none."""
    ids = "link " + network.links["link_id"].astype(str)
    if "name" not in network.links.columns:
        return ids.to_numpy(object)
    names = network.links["name"].astype("string").str.strip()
    return ids.where(names.isna() | (names == ""), names).to_numpy(object)


def in_words(lost: float) -> str:
    """A time lost by vehicles, veh·h."""
    return f"{lost:,.{0 if lost >= 10 else 1}f} veh·h"


def place_parts(network: Network, choice: Choice, frame: Frame, look: Look) -> dict[str, Any]:
    """Parts of a scene: ``notes``, a line a place, and ``marks``, their numbers on poles."""
    found = places(network, choice)
    lines = [
        f"{number}  {place.name}: {in_words(place.lost)}, "
        f"{look.clock(place.begin)}–{look.clock(place.end)}, down to {place.speed:.0f} km/h"
        for number, place in enumerate(found, 1)
    ]
    heading = ["Most time lost"] if lines else []
    texts = [str(number) for number in range(1, len(found) + 1)]
    return {
        "notes": np.array(heading + lines, dtype=str),
        "marks.points": _tops(found, frame),
        "marks.texts": np.array(texts, dtype=str),
    }


def _tops(found: list[Place], frame: Frame) -> Any:
    """Ends of poles at the worst link of each place, above all walls."""
    import shapely

    rows = [place.link for place in found]
    middles = shapely.line_interpolate_point(frame.plane.lines[rows], 0.5, normalized=True)
    xy = frame.on_ground(shapely.get_coordinates(middles))
    points = np.column_stack([xy, np.zeros(len(xy))])
    for number, point in enumerate(points):
        beside = np.hypot(*(points[:number, :2] - point[:2]).T) < NEAR
        point[2] = frame.height * (POLE + HIGHER * np.count_nonzero(beside))
    return points
