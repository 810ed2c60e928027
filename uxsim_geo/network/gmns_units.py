"""The units of a GMNS folder: stated, and held against the geometry."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from uxsim_geo.network.csv_table import CsvTable, is_missing
from uxsim_geo.network.exact import exact_factor
from uxsim_geo.network.gmns_reading import Reading, note_overruled
from uxsim_geo.network.length_check import length_doubt
from uxsim_geo.network.units import Quantity

#: what each column is, and how config.csv calls its unit
UNIT_OF: dict[str, tuple[Quantity, str]] = {
    "length": ("length", "long_length"),
    "free_speed": ("speed", "speed"),
}


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


def check_lengths(
    reading: Reading, unit: str, places: np.ndarray, pair: tuple[np.ndarray, np.ndarray]
) -> None:
    """Hold lengths in the file, m, against those of the geometry beside them, m.

    Where another unit explains the difference, it is a fault that names the unit; else a note.
    """
    if reading.is_own:
        return
    doubt = length_doubt(*pair, unit, places, reading.crs)
    if doubt is None:
        return
    if doubt.likely and reading.options.length_check == "refuse":
        what = f"{doubt.told}: the unit is rather {doubt.likely}; state it as length_unit"
        what += ", or length_check: warn, if they are right"
        reading.faults["link"].add(what, column="length")
    else:
        note = f"{doubt.told}; length_from: geometry takes those of the geometry"
        reading.notes.add("lengths differ", note, severity="warning", value=doubt.ratio)


def factors(unit: str | None, quantity: Quantity, rows: int) -> list[Fraction]:
    """The factor to SI, one a row; 1 where no unit is known, which is a fault by then."""
    return [Fraction(1) if unit is None else exact_factor(unit, quantity)] * rows
