"""Streets on which most time was lost, named and numbered: where, when and how bad."""

from __future__ import annotations

from typing import Any

import numpy as np

from uxsim_geo.analysis.state_grid import StateGrid, States
from uxsim_geo.analysis.types import Floats
from uxsim_geo.export.clock import Clock
from uxsim_geo.export.lost_time import LostTime, Street, states_of
from uxsim_geo.export.space_time.frame import Frame
from uxsim_geo.export.space_time.look import Look
from uxsim_geo.network.network import Network
from uxsim_geo.network.units import KMH

PLACES = 5  # streets with numbers
POLE = 1.06  # height of the poles with numbers, as a part of that of the time axis
HIGHER = 0.09  # of it: what a pole beside another is higher
LONGEST = 40  # letters of a street's name
NEAR = 0.08  # poles nearer to each other than this stand beside each other


def place_parts(network: Network, states: States, frame: Frame, look: Look) -> dict[str, Any]:
    """Parts of a scene: ``notes``, a line a street, and ``marks``, their numbers on poles.

    ``states`` of all links in all bins of the report, so that figures are those of all results.
    """
    grid = StateGrid.of_all(states, network)
    lost = LostTime.of(network.links, grid)
    streets, clock = lost.streets(PLACES), look.clock([*grid.begin, grid.end[-1]])
    speeds = [KMH * state.speed for state in states_of(streets, grid)]
    lines = [
        f"{number}  {_line(street, lost, clock)} at {speed:.0f} km/h"
        for number, (street, speed) in enumerate(zip(streets, speeds, strict=True), 1)
    ]
    middles = [_on_map(street, lost, frame) for street in streets]
    shown = [(number, place) for number, place in enumerate(middles, 1) if place is not None]
    heading = ["Most time lost, and each when it was worst"] if lines else []
    return {
        "notes": np.array(heading + lines, dtype=str),
        "marks.points": tops([place for _, place in shown], frame),
        "marks.texts": np.array([str(number) for number, _ in shown], dtype=str),
    }


def _line(street: Street, lost: LostTime, clock: Clock) -> str:
    span = clock.span(lost.begin[street.bin], lost.end[street.bin])
    return f"{cut(street.name)}: {lost.unit.text(street.lost)}, {span}"


def cut(name: str) -> str:
    """A name that leaves room for the colour bar beside it."""
    return name if len(name) <= LONGEST else f"{name[: LONGEST - 1]}…"


def _on_map(street: Street, lost: LostTime, frame: Frame) -> Floats | None:
    """The middle of its worst link that the map shows; None where it shows none."""
    import shapely

    order = np.argsort(-np.round(lost.delay[street.links].sum(axis=1), 3), kind="stable")
    lines = frame.plane.lines[street.links[order]]
    middles = shapely.get_coordinates(shapely.line_interpolate_point(lines, 0.5, normalized=True))
    low, high = np.reshape(frame.box, (2, 2))
    inside = ((middles >= low) & (middles <= high)).all(axis=1)
    return frame.on_ground(middles[np.argmax(inside)]) if inside.any() else None


def tops(middles: list[Floats], frame: Frame) -> Floats:
    """Ends of poles at these places on the ground, above all walls."""
    xy = np.reshape(middles, (-1, 2))
    points = np.column_stack([xy, np.zeros(len(xy))])
    for number, point in enumerate(points):
        beside = np.hypot(*(points[:number, :2] - point[:2]).T) < NEAR
        point[2] = frame.height * (POLE + HIGHER * np.count_nonzero(beside))
    return points
