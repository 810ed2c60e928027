"""Which GMNS links are for motor vehicles: the others are left out, and said so."""

from __future__ import annotations

import re
from collections import Counter

import numpy as np
import numpy.typing as npt

from uxsim_geo.network.csv_table import CsvTable
from uxsim_geo.network.gmns_options import GmnsOptions
from uxsim_geo.network.gmns_reading import Reading
from uxsim_geo.network.tntp_rows import number

Flags = npt.NDArray[np.bool_]

#: columns that hold the type of a road: of the specification, of osm2gmns
ROAD_CLASSES = ("facility_type", "link_type_name")

_BETWEEN = re.compile(r"[,;|/\s]+")


def road_class_column(table: CsvTable) -> str:
    """The column that holds the type of a road."""
    return next((name for name in ROAD_CLASSES if name in table), ROAD_CLASSES[0])


def are_allowed(table: CsvTable, options: GmnsOptions) -> Flags:
    """Whether each row's allowed_uses name one of those wanted, or none at all."""
    wanted = {use.lower() for use in options.uses}
    known: dict[str, bool] = {}
    for cell in set(table.cells("allowed_uses")):
        uses = {use for use in _BETWEEN.split(cell.lower()) if use}
        known[cell] = not uses or not uses.isdisjoint(wanted)
    return np.array([known[cell] for cell in table.cells("allowed_uses")], dtype=bool)


def are_for_motor_vehicles(reading: Reading) -> Flags:
    """Which links are read; notes say how many of which kind are not."""
    table, options = reading.links, reading.options
    # of a folder that was written here every link was one of the network
    allowed = np.ones(len(table), dtype=bool) if reading.is_own else are_allowed(table, options)
    classes = table.cells(road_class_column(table))
    unwanted = {name.lower() for name in options.leave_out}
    left_out = np.array([cell.strip().lower() in unwanted for cell in classes], dtype=bool)
    stated = np.array([bool(cell.strip()) for cell in table.cells("allowed_uses")], dtype=bool)
    without = np.array([number(cell) == 0 for cell in table.cells("lanes")], dtype=bool)
    laneless = without & ~stated & allowed & ~left_out
    _note(reading, "allowed_uses", ~allowed, table.cells("allowed_uses"))
    _note(reading, road_class_column(table), left_out & allowed, classes)
    _note(reading, "lanes", laneless, table.cells("lanes"))
    kept: Flags = allowed & ~left_out & ~laneless
    if len(table) and not kept.any():
        found = ", ".join(sorted(set(table.cells("allowed_uses"))))
        what = f"no link is for any of {', '.join(options.uses)}: state uses among {found}"
        reading.faults["link"].add(what, column="allowed_uses")
    return kept


def _note(reading: Reading, column: str, wrong: Flags, cells: list[str]) -> None:
    counts = Counter(cells[row].strip() for row in np.flatnonzero(wrong).tolist())
    for value, times in sorted(counts.items()):
        note = f"{column} is {value or 'empty'}: left out, not for motor vehicles; value: links"
        reading.notes.add("left out", note, element="link", value=times)
