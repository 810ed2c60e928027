"""Lengths in a file against those of the geometry, to find a wrong unit."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from uxsim_geo.network.exact import exact_factor
from uxsim_geo.network.measure import longitudes_and_latitudes
from uxsim_geo.network.units import LENGTHS

if TYPE_CHECKING:
    from pyproj import CRS

Floats = npt.NDArray[np.float64]

#: lengths and geometry may differ by this factor before the unit is doubted
AGREES = 1.4

#: a length in another unit is this near to the geometry
IS_UNIT = 1.4

#: so much may the middle half of the links differ among themselves where the unit is wrong: less
#: where the factor is that of kilometres and miles, which lengths of another kind may have too
SPREAD, SPREAD_OF_NEAR, NEAR_UNITS = 4.0, 1.6, 2.0

#: of the factor by which Web Mercator stretches; and how much that must be to be told from noise
MERCATOR_NEAR, MERCATOR_LEAST = 0.02, 1.05

#: fewer links may differ from their geometry for reasons of their own
ENOUGH_LINKS = 3


class LengthDoubt(NamedTuple):
    """What speaks against lengths: ``ratio`` to the geometry, and the unit that explains it.

    likely
        the unit in which they would agree; None: they would in none, or the links differ too much
        among themselves
    """

    told: str
    ratio: float
    likely: str | None


def length_doubt(
    lengths: Floats, drawn: Floats, unit: str, places: Floats, crs: CRS | None
) -> LengthDoubt | None:
    """Hold lengths, m, that a file has in ``unit``, against those of the geometry, m.

    ``places`` are some coordinates of the network, to know where on the earth it is. None: there
    is nothing to say, or nothing to hold them against.
    """
    both = (lengths > 0) & (drawn > 0)
    if both.sum() < ENOUGH_LINKS or crs is None:
        return None
    ratios = lengths[both] / drawn[both]
    low, ratio, high = (float(part) for part in np.quantile(ratios, (0.25, 0.5, 0.75)))
    if _is_mercator(ratio, places, crs):
        told = (
            "lengths are longer than the geometry by the factor (value) by which Web Mercator "
            "stretches maps here: they were measured on one"
        )
        return LengthDoubt(told, ratio, None)
    if 1 / AGREES <= ratio <= AGREES:
        return None
    spread = SPREAD_OF_NEAR if max(ratio, 1 / ratio) < NEAR_UNITS else SPREAD
    likely = _likely_unit(ratio, unit) if high / low < spread else None
    told = f"lengths in {unit} are {ratio:.4g} times those of the geometry"
    return LengthDoubt(told, ratio, likely)


def _likely_unit(ratio: float, unit: str) -> str | None:
    """The unit in which lengths would agree best with the geometry; None: they would in none."""
    own = float(exact_factor(unit, "length"))
    off = {other: abs(np.log(ratio * LENGTHS[other] / own)) for other in LENGTHS}
    best = min(off, key=off.__getitem__)
    return best if off[best] <= np.log(IS_UNIT) else None


def _is_mercator(ratio: float, places: Floats, crs: CRS) -> bool:
    """Whether a factor is 1 / cos of the latitude."""
    if ratio < MERCATOR_LEAST or crs.geodetic_crs is None:
        return False
    latitude = float(np.median(longitudes_and_latitudes(places, crs)[1]))
    if not abs(latitude) < 90:
        return False
    stretch = 1 / np.cos(np.radians(latitude))
    return bool(abs(ratio / stretch - 1) < MERCATOR_NEAR)
