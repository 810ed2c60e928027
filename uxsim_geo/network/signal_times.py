"""How long a cycle lasts and how it is split: Webster's rule, or one without volumes.

F. V. Webster, Traffic signal settings, Road Research Technical Paper 39, London 1958.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from uxsim_geo.network.signal_options import SignalOptions

_NOISE = 1e-9  # s


def webster_cycle(ratios: Sequence[float], lost: float, options: SignalOptions) -> float:
    """C = (1.5 L + 5) / (1 − Y), s, within the bounds of the options.

    L = ``lost``: s of the cycle in which nobody drives. Y: the sum of ``ratios``, the critical
    flow ratio of each phase: volume over saturation flow, the largest of its links. From Y = 1 on
    no cycle is long enough and the longest is taken.
    """
    load = math.fsum(ratios)
    best = (1.5 * lost + 5.0) / (1.0 - load) if load < 1.0 else math.inf
    return min(max(best, options.min_cycle), options.max_cycle)


def assumed_cycle(phases: int, options: SignalOptions) -> float:
    """The cycle for a number of phases where there are no volumes, s, within the bounds."""
    return min(max(options.cycle_per_phase * phases, options.min_cycle), options.max_cycle)


def greens(
    cycle: float, lost: float, weights: Sequence[float], options: SignalOptions
) -> list[int]:
    """Whole s of green of each phase, in proportion to ``weights`` (Webster: the flow ratios).

    Together they fill the cycle but for the ``lost`` seconds: rounded up to whole seconds, unless
    the cycle would then be longer than the longest. No phase gets less than the shortest green,
    though that may make the cycle longer than the longest.
    """
    least = int(options.min_green)
    whole = math.ceil(cycle - lost - _NOISE)
    longest = math.floor(options.max_cycle - lost + _NOISE)
    total = max(min(whole, longest), least * len(weights))
    return split(total, weights, least)


def split(total: int, weights: Sequence[float], least: int) -> list[int]:
    """Whole numbers in proportion to weights, none below ``least``, that sum to ``total``.

    ``total`` is at least as much as all need. What a phase needs more than its share is taken from
    the others by their weights. The whole numbers are those nearest by largest remainders, the
    earlier of equal ones first; weights that are all 0 count as equal.
    """
    if not any(weights):
        weights = [1.0] * len(weights)
    open_to, shares = set(range(len(weights))), [float(least)] * len(weights)
    while open_to:
        left = total - least * (len(weights) - len(open_to))
        sum_of_weights = math.fsum(weights[phase] for phase in sorted(open_to))
        below = {phase for phase in open_to if left * weights[phase] < least * sum_of_weights}
        if not below:
            for phase in open_to:
                shares[phase] = left * weights[phase] / sum_of_weights
            break
        open_to -= below
    return _rounded(shares, total)


def _rounded(shares: Sequence[float], total: int) -> list[int]:
    whole = [math.floor(share) for share in shares]
    order = sorted(range(len(shares)), key=lambda place: (whole[place] - shares[place], place))
    for place in order[: total - sum(whole)]:
        whole[place] += 1
    return whole
