"""Which approaches of a junction have green together, from the directions they come from.

An approach is one link, or several that come from nearly the same direction (a road beside its
slip road). Two approaches that come from opposite directions share a phase: a crossroads has two
phases, a T-junction one for the road that goes on and one for its stem.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from uxsim_geo.network.signal_options import SignalOptions

#: positions of links among those given
Approach = tuple[int, ...]
Phase = tuple[Approach, ...]

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class _Arc:
    """Links that arrive within ``extent`` degrees clockwise from bearing ``start``."""

    start: float
    extent: float
    links: Approach

    @property
    def middle(self) -> float:
        return (self.start + self.extent / 2.0) % 360.0


def group_phases(
    bearings: Sequence[float],
    weights: Sequence[float],
    options: SignalOptions,
    *,
    grain: float = 0.0,
) -> list[Phase]:
    """The phases of a junction, each of one approach or of two opposite ones.

    ``bearings`` (degrees clockwise from north, in which links arrive) and ``weights`` (of what
    they carry) have one value a link. Every link is in exactly one approach of one phase.

    Phases stand in the order of the axes of their heaviest approaches, clockwise from 45° before
    the ``grain``, the direction of the streets around (:func:`street_grain`): so the nodes of a
    large junction, and junctions along a road, open the same direction at the same time.
    """
    arcs = _approaches(bearings, options.same_direction)
    heavy = [sum(weights[link] for link in arc.links) for arc in arcs]
    pairs = _opposite(arcs, heavy, options.opposite_within)
    paired = {place for pair in pairs for place in pair}
    groups = [*pairs, *((place,) for place in range(len(arcs)) if place not in paired)]

    def axis(group: tuple[int, ...]) -> tuple[float, int]:
        leader = max(group, key=lambda place: (heavy[place], -arcs[place].links[0]))
        return (arcs[leader].middle + 45.0 - grain) % 180.0, arcs[leader].links[0]

    return [
        tuple(sorted(arcs[place].links for place in group)) for group in sorted(groups, key=axis)
    ]


def street_grain(bearings: Floats, weights: Floats) -> float:
    """The direction along which, or across, most streets run: whole degrees from -45 to 45.

    A quarter of the angle of Σ w exp(4iθ), for which all four directions of a grid are one.
    Bearings that are NaN do not count; 0 where none does.
    """
    known = np.isfinite(bearings)
    turns = weights[known] * np.exp(4j * np.radians(bearings[known]))
    return round(float(np.degrees(np.angle(turns.sum()))) / 4.0)


def separate_phases(links: int) -> list[Phase]:
    """Every link in a phase of its own: what is safe where no direction is known."""
    return [((link,),) for link in range(links)]


def _approaches(bearings: Sequence[float], within: float) -> list[_Arc]:
    """Join neighbours on the compass, the closest first, while an approach stays this narrow."""
    order = sorted(range(len(bearings)), key=lambda link: (bearings[link], link))
    arcs = [_Arc(bearings[link], 0.0, (link,)) for link in order]
    while len(arcs) > 1:
        joined = [_join(arcs[place - 1], arcs[place]) for place in range(len(arcs))]
        best = min(range(len(arcs)), key=lambda place: (joined[place].extent, place))
        if joined[best].extent > within:
            break
        arcs[best] = joined[best]
        del arcs[best - 1]
    return arcs


def _join(first: _Arc, second: _Arc) -> _Arc:
    """The arc from the start of the first, clockwise, to the end of the second."""
    extent = (second.start - first.start) % 360.0 + second.extent
    return _Arc(first.start, round(extent, 2), tuple(sorted(first.links + second.links)))


def _opposite(arcs: Sequence[_Arc], heavy: Sequence[float], within: float) -> list[tuple[int, int]]:
    """Pairs of arcs, each in one at most; the most opposite first, then the heaviest."""
    found = []
    for one, other in itertools.combinations(range(len(arcs)), 2):
        miss = abs((arcs[other].middle - arcs[one].middle) % 360.0 - 180.0)
        if round(miss, 2) <= within:
            found.append((round(miss, 2), -min(heavy[one], heavy[other]), one, other))
    pairs: list[tuple[int, int]] = []
    taken: set[int] = set()
    for _, _, one, other in sorted(found):
        if not {one, other} & taken:
            pairs.append((one, other))
            taken |= {one, other}
    return pairs
