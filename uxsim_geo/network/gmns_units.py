"""The units of a GMNS folder: stated, and held against the geometry."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from uxsim_geo.network.csv_table import CsvTable, is_missing
from uxsim_geo.network.exact import exact_factor
from uxsim_geo.network.gmns_reading import Reading, note_overruled
from uxsim_geo.network.units import LENGTHS, Quantity

#: what each column is, and how config.csv calls its unit
UNIT_OF: dict[str, tuple[Quantity, str]] = {
    "length": ("length", "long_length"),
    "free_speed": ("speed", "speed"),
}

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


def stated_unit(reading: Reading, table: CsvTable, name: str) -> str | None:
    """The unit of a column, by option or config.csv; None, and a fault, where it is needed."""
    quantity, in_config = UNIT_OF[name]
    stated: str | None = getattr(reading.options, f"{quantity}_unit")
    said: str | None = getattr(reading.config, f"{quantity}_unit")
    if stated is not None and said is not None:
        note_overruled(f"{quantity}_unit", stated, said, reading.notes)
    if stated or said:
        return stated or said
    cells = [cell.strip() for cell in table.cells(name) if not is_missing(cell)]
    if cells:
        sample = ", ".join(list(dict.fromkeys(cells))[:4])
        reading.faults["link"].add(
            f"the unit of this column must be stated as {quantity}_unit: no config.csv says it as "
            f"{in_config}, and {sample} ... could be anything",
            column=name,
        )
    return None


def check_lengths(reading: Reading, unit: str, lengths: np.ndarray, drawn: np.ndarray) -> None:
    """Hold lengths, m, that the file has in ``unit``, against those of the geometry, m.

    Where most links differ by the same factor, and another unit explains it, it is a fault that
    names the unit; a stretched map (Web Mercator) and other differences are noted.
    """
    both = (lengths > 0) & (drawn > 0)
    if both.sum() < ENOUGH_LINKS or reading.crs is None or reading.is_own:
        return
    ratios = lengths[both] / drawn[both]
    low, ratio, high = (float(part) for part in np.quantile(ratios, (0.25, 0.5, 0.75)))
    if _is_mercator(reading, ratio):
        note = (
            "lengths are longer than the geometry by the factor (value) by which Web Mercator "
            "stretches maps here: they were measured on one; length_from: geometry takes others"
        )
        reading.notes.add("lengths stretched", note, severity="warning", value=ratio)
        return
    if 1 / AGREES <= ratio <= AGREES:
        return
    likely = _likely_unit(ratio, unit)
    told = f"lengths in {unit} are {ratio:.4g} times those of the geometry"
    spread = SPREAD_OF_NEAR if max(ratio, 1 / ratio) < NEAR_UNITS else SPREAD
    if likely and high / low < spread and reading.options.length_check == "refuse":
        what = f"{told}: the unit is rather {likely}; state it as length_unit"
        what += ", or length_check: warn, if they are right"
        reading.faults["link"].add(what, column="length")
    else:
        reading.notes.add("lengths differ", told, severity="warning", value=ratio)


def _likely_unit(ratio: float, unit: str) -> str | None:
    """The unit in which lengths would agree best with the geometry; None: they would in none."""
    own = float(exact_factor(unit, "length"))
    off = {other: abs(np.log(ratio * LENGTHS[other] / own)) for other in LENGTHS}
    best = min(off, key=off.__getitem__)
    return best if off[best] <= np.log(IS_UNIT) else None


def _is_mercator(reading: Reading, ratio: float) -> bool:
    """Whether a factor is 1 / cos of the latitude of the nodes."""
    from pyproj import Transformer

    assert reading.crs is not None, "asked where the reference system is known"
    if ratio < MERCATOR_LEAST or reading.crs.geodetic_crs is None:
        return False
    x, y = (
        np.array(list(map(float, reading.nodes.cells(name)))) for name in ("x_coord", "y_coord")
    )
    to_degrees = Transformer.from_crs(reading.crs, reading.crs.geodetic_crs, always_xy=True)
    latitude = float(np.median(to_degrees.transform(x, y)[1]))
    if not abs(latitude) < 90:
        return False
    stretch = 1 / np.cos(np.radians(latitude))
    return bool(abs(ratio / stretch - 1) < MERCATOR_NEAR)


def factors(unit: str | None, quantity: Quantity, rows: int) -> list[Fraction]:
    """The factor to SI, one a row; 1 where no unit is known, which is a fault by then."""
    return [Fraction(1) if unit is None else exact_factor(unit, quantity)] * rows
