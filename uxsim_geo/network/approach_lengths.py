"""What the links at a merged junction take over of the ways through it.

Let d be the length of the open way from approach a to exit b through a junction. When the junction
becomes a point, a becomes longer by α and b by β such that α_a + β_b is as near d_ab as can be,
by least squares with α, β ≥ 0; going straight counts ten times as much as turning, and both
directions of one street become longer by the same. The same with free-flow times gives speeds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from uxsim_geo.network.incidence import Floats
from uxsim_geo.network.inner_paths import Junction, Pair, Streets

#: degrees up to which one goes straight on, and from which one turns round
STRAIGHT, ROUND = 45.0, 150.0

#: how much the ways straight on, of turns and of turning round count
WEIGHTS = (1.0, 0.1, 0.01)

#: a way of turning round may be off by so many times what others may: it is seldom taken
ROUND_LIMIT = 3.0

#: holds α and β small where the ways leave them open
RIDGE = 1e-4


@dataclass(frozen=True)
class Additions:
    """What each link at a junction takes over, m and s, and the greatest error of a turn.

    That is in m, of turning round a third of it; an error of time counts as the way that is driven
    in it at the speed of the links.
    """

    length: dict[int, float]
    time: dict[int, float]
    error: float


def additions_of(junction: Junction, streets: Streets, angles: dict[Pair, float]) -> Additions:
    """Share the ways through a junction between the links at it.

    ``angles``: by approach and exit: how far one turns, degrees within ±180; empty where it is
    not known where the links lie.
    """
    pairs = sorted(junction.ways)
    number = _unknowns(junction, streets)
    kinds = np.array([_kind(angles.get(pair, 0.0)) for pair in pairs])
    kinds[[streets.twin[a] == b for a, b in pairs]] = 2
    weights = np.sqrt(np.array(WEIGHTS)[kinds])
    columns = np.array([[number[a], number[b]] for a, b in pairs])
    ways = np.array([junction.ways[pair] for pair in pairs])
    sums = np.zeros((len(pairs), len(set(number.values()))))
    np.add.at(sums, (np.repeat(np.arange(len(pairs)), 2), columns.ravel()), 1.0)
    length = _fit(sums, weights, ways[:, 0])
    time = _fit(sums, weights, ways[:, 1])
    off = np.abs(np.stack([sums @ length, sums @ time], axis=1) - ways)
    speeds = [streets.length[link] / streets.time[link] for link in number]
    off[:, 1] *= float(np.mean(speeds))
    off[kinds == 2] /= ROUND_LIMIT
    return Additions(
        {link: round(float(length[column]), 3) for link, column in number.items()},
        {link: round(float(time[column]), 4) for link, column in number.items()},
        float(off.max(initial=0.0)),
    )


def _unknowns(junction: Junction, streets: Streets) -> dict[int, int]:
    """Number of the unknown of each link; both directions of a street have one."""
    number: dict[int, int] = {}
    for link in (*junction.approaches, *junction.exits):
        twin = streets.twin[link]
        number[link] = number[twin] if twin in number else len(set(number.values()))
    return number


def _kind(angle: float) -> int:
    return (abs(angle) > STRAIGHT) + (abs(angle) > ROUND)


def _fit(sums: Floats, weights: Floats, wanted: Floats) -> Floats:
    """Unknowns that are not negative, whose sums are nearest what is wanted; (unknowns,).

    ``sums``: how often each unknown is in the sum of each pair; (pairs, unknowns).
    """
    from scipy.optimize import nnls

    unknowns = sums.shape[1]
    matrix = np.concatenate([sums * weights[:, None], np.eye(unknowns) * math.sqrt(RIDGE)])
    found, _ = nnls(matrix, np.concatenate([wanted * weights, np.zeros(unknowns)]))
    return np.asarray(found)
