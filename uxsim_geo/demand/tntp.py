"""TNTP trips files to demand tables."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from uxsim_geo.demand.demand import Demand
from uxsim_geo.demand.loading import (
    add_zone_faults,
    between_zones,
    over_time,
    zone_trips_at_nodes,
)
from uxsim_geo.demand.od_table import OdTable, ordered
from uxsim_geo.demand.profile import TripsOptions
from uxsim_geo.errors import Faults
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.text import read_lines
from uxsim_geo.network.tntp_rows import END_OF_METADATA, number, read_tags

ORIGIN = re.compile(r"Origin\s+(\S+)", re.IGNORECASE)
TOTAL = "TOTAL OD FLOW"

#: so large a part of the declared total may be missing through rounding, but not more
CUT_SHARE = 0.01


@dataclass
class Cells:
    """The numbers of a trips file as they stand there: zones, trips, and the line of each."""

    origins: list[str] = field(default_factory=list)
    destinations: list[str] = field(default_factory=list)
    trips: list[float] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)

    def table(self) -> pd.DataFrame:
        """origin_zone, destination_zone (text), trips (float64), line; one row a number."""
        table = pd.DataFrame(
            {
                "origin_zone": pd.Series(self.origins, dtype="str"),
                "destination_zone": pd.Series(self.destinations, dtype="str"),
            }
        )
        trips = np.array(self.trips, dtype=np.float64)
        return table.assign(trips=trips, line=np.array(self.lines, dtype=np.int64))


def read_tntp_od(trips: Path) -> OdTable:
    """Read a TNTP trips file as a table between zones, trips within a zone included.

    Raises :class:`InputError` with all that is wrong in the file.
    """
    faults = Faults(str(trips))
    notes = Notes()
    cells, declared = _read_cells(trips, faults)
    _add_repeated_pair_faults(cells, faults)
    faults.raise_if_any()
    _compare_total(float(cells["trips"].sum()), declared, notes, faults)
    faults.raise_if_any()
    names = {"origin_zone": "origin", "destination_zone": "destination", "trips": "vehicles"}
    table = cells[cells["trips"] > 0].rename(columns=names).set_index("line")
    return OdTable(ordered(table[[*names.values()]]), faults.source, notes.table())


def read_tntp_trips(trips: Path, options: TripsOptions, network: Network) -> Demand:
    """Read a TNTP trips file into demand between nodes of ``network``.

    Trips within a zone and zeros make no demand; the notes say how many trips were left out.
    Zones whose trips may start or end at several nodes have them in even parts over those pairs
    of nodes that a path connects. Raises :class:`InputError` with all that is wrong in the file.
    """
    faults = Faults(str(trips))
    notes = Notes()
    cells, declared = _read_cells(trips, faults)
    add_zone_faults(cells, network, faults)
    _add_repeated_pair_faults(cells, faults)
    faults.raise_if_any()
    _compare_total(float(cells["trips"].sum()), declared, notes, faults)
    faults.raise_if_any()
    kept = between_zones(cells, options, notes)
    at_nodes = zone_trips_at_nodes(kept, network, notes)
    return Demand(over_time(at_nodes, options), notes.table())


def _read_cells(path: Path, faults: Faults) -> tuple[pd.DataFrame, tuple[str, int] | None]:
    """All numbers of the file, and the declared total as it is written, with its line."""
    cells = Cells()
    lines = read_lines(path, faults)
    if lines is None:
        return cells.table(), None
    tags, begin = read_tags(lines)
    if not begin:
        faults.add(f"has no line <{END_OF_METADATA}>: it is not a TNTP file, or it is cut")
        return cells.table(), None
    origin: str | None = None
    before: tuple[int, str] | None = None
    for index in range(begin, len(lines)):
        text = lines[index].strip()
        if not text or text[0] == "~":
            continue
        found = ORIGIN.fullmatch(text)
        if found:
            origin = _zone(found[1], index + 1, faults)
        elif origin is None:
            before = before or (index + 1, text)
        else:
            _read_items(text, origin, index + 1, cells, faults)
    if origin is None:
        faults.add("has no Origin line: is this a trips file?")
    elif before is not None:
        faults.add("stands before the first Origin line", line=before[0], value=before[1])
    return cells.table(), tags.get(TOTAL)


def _read_items(text: str, origin: str, line: int, cells: Cells, faults: Faults) -> None:
    """The items ``destination : trips;`` of one line."""
    if not text.endswith(";"):
        faults.add("the line lacks its closing semicolon: the file is cut", line=line, value=text)
    for item in text.split(";"):
        if not item or item.isspace():
            continue
        zone, colon, amount = item.partition(":")
        value = number(amount)
        if not colon or value is None:
            faults.add("must be destination : trips;", line=line, value=item.strip())
            continue
        if not 0 <= value < math.inf:
            faults.add("trips must be finite and not negative", line=line, value=item.strip())
        cells.destinations.append(_zone(zone.strip(), line, faults))
        cells.origins.append(origin)
        cells.trips.append(value)
        cells.lines.append(line)


def _zone(text: str, line: int, faults: Faults) -> str:
    if text.isdecimal() and text.isascii() and text.strip("0"):
        return text.lstrip("0")
    faults.add("must be a zone's number, whole and above 0", line=line, value=text)
    return ""


def _add_repeated_pair_faults(cells: pd.DataFrame, faults: Faults) -> None:
    again = cells[cells.duplicated(["origin_zone", "destination_zone"])]
    again = again[(again["origin_zone"] != "") & (again["destination_zone"] != "")]
    for origin, destination, line in zip(
        again["origin_zone"], again["destination_zone"], again["line"], strict=True
    ):
        what = "the trips of this pair stand on an earlier line too"
        faults.add(what, line=line, value=f"{origin} to {destination}")


def _compare_total(
    found: float, declared: tuple[str, int] | None, notes: Notes, faults: Faults
) -> None:
    """Compare with the declared total, as precisely as that is written.

    A sum far below it is a fault, since that is what a cut file looks like; else a note tells.
    """
    notes.add(
        "trips in file", "sum over all pairs; value: trips", element="demand", value=repr(found)
    )
    text, line = declared or ("", 0)
    total = number(text)
    if total is None or not math.isfinite(total):
        return
    mantissa, _, exponent = text.lower().partition("e")
    decimals = len(mantissa.partition(".")[2]) - int(exponent or 0)
    written_to = float(f"1e{-decimals}")
    if total - found > max(written_to, CUT_SHARE * total):
        faults.add(
            f"the file is cut, or its total is wrong: declared {text}, found {found:.10g}; "
            "correct one or remove the tag",
            line=line,
            column=f"<{TOTAL}>",
        )
    elif abs(found - total) > max(written_to, 1e-9 * abs(total)):
        note = (
            f"the trips in the file do not sum to the total that it declares, {text}; value: trips"
        )
        notes.add("trips total", note, element="demand", severity="warning", value=repr(found))
