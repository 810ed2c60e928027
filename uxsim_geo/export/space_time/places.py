"""Streets on which most time was lost, named and numbered: where, when and how bad."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.analysis.types import Integers
from uxsim_geo.export.space_time.choice import Choice
from uxsim_geo.export.space_time.frame import Frame
from uxsim_geo.export.space_time.look import Look
from uxsim_geo.export.street_names import street_names
from uxsim_geo.network.network import Network
from uxsim_geo.network.units import KMH

PLACES = 5  # streets with numbers
POLE = 1.06  # height of the poles with numbers, as a part of that of the time axis
HIGHER = 0.09  # of it: what a pole beside another is higher
LONGEST = 45  # letters of a street's name
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
    """The streets with most lost time in slow states of all their links, of those with walls."""
    rows = np.flatnonzero(choice.slow.any(axis=1))
    street, known = pd.factorize(street_names(network.links).to_numpy(object)[rows])
    lost = np.where(choice.slow[rows], choice.grid.values("delay")[rows], 0.0).sum(axis=1)
    by_street = np.bincount(street, lost, minlength=len(known))
    found: list[Place] = []
    for number in np.argsort(-by_street, kind="stable"):
        own = rows[street == number]
        drawn = np.isin(choice.links, own)
        if drawn.any() and len(found) < PLACES:
            worst = int(choice.links[np.argmax(drawn)])
            told = (by_street[number] / 3600, *_when_and_how_slow(choice, own))
            found.append(Place(str(known[number]), worst, *told))
    return found


def _when_and_how_slow(choice: Choice, links: Integers) -> tuple[float, float, float]:
    """From when to when any of some links is slow, and the lowest speed of those together."""
    slow = choice.slow[links]
    bins = np.flatnonzero(slow.any(axis=0))
    distance, time = (
        np.where(slow, choice.grid.values(column)[links], 0.0).sum(axis=0)[bins]
        for column in ("distance", "time")
    )
    speed = KMH * float(np.min(distance / time))
    return float(choice.grid.begin[bins[0]]), float(choice.grid.end[bins[-1]]), speed


def in_words(lost: float) -> str:
    """A time lost by vehicles, veh·h."""
    return f"{lost:,.{0 if lost >= 10 else 1}f} veh·h"


def place_parts(network: Network, choice: Choice, frame: Frame, look: Look) -> dict[str, Any]:
    """Parts of a scene: ``notes``, a line a place, and ``marks``, their numbers on poles."""
    found = places(network, choice)
    lines = [
        f"{number}  {cut(place.name)}: {in_words(place.lost)}, "
        f"{look.clock(place.begin)}–{look.clock(place.end)}, down to {place.speed:.0f} km/h"
        for number, place in enumerate(found, 1)
    ]
    heading = ["Most time lost"] if lines else []
    texts = [str(number) for number in range(1, len(found) + 1)]
    return {
        "notes": np.array(heading + lines, dtype=str),
        "marks.points": tops([place.link for place in found], frame),
        "marks.texts": np.array(texts, dtype=str),
    }


def cut(name: str) -> str:
    """A name that leaves room for the colour bar beside it."""
    return name if len(name) <= LONGEST else f"{name[: LONGEST - 1]}…"


def tops(rows: list[int], frame: Frame) -> Any:
    """Ends of poles at some links (their rows), above all walls."""
    import shapely

    middles = shapely.line_interpolate_point(frame.plane.lines[rows], 0.5, normalized=True)
    xy = frame.on_ground(shapely.get_coordinates(middles))
    points = np.column_stack([xy, np.zeros(len(xy))])
    for number, point in enumerate(points):
        beside = np.hypot(*(points[:number, :2] - point[:2]).T) < NEAR
        point[2] = frame.height * (POLE + HIGHER * np.count_nonzero(beside))
    return points
