"""What is assumed where a file is silent: tables by country and road class, or by zone.

``osm_road_classes.csv``: country, road_class, speed (as the tag maxspeed writes it: ``50``,
``30 mph``), lanes (of one direction), lanes_oneway (of a one-way road, where those are more: as of
the carriageways of a wide road), merge_priority (weight where links meet).
``osm_zone_speeds.csv``: country, zone, speed: what the law makes of ``DE:urban`` and the like.

Rows of ``default`` hold where a country has no row or an empty cell; one with a region
(``BE-VLG``) falls back to its country first. A table of one's own has the same columns, or some
of them beside the first two; its rows take precedence over those shipped, cell by cell.

Speeds of zones are those of the law for cars, after the page "Default speed limits" of the
OpenStreetMap wiki and newer laws; docs/networks.md names the sources and what is convention.
"""

from __future__ import annotations

import csv
import difflib
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from uxsim_geo.errors import Faults
from uxsim_geo.network.osm_options import ROAD_CLASSES, OsmOptions
from uxsim_geo.network.osm_speeds import FASTEST, SLOWEST, parse_numbers
from uxsim_geo.network.text import read_lines

CLASS_COLUMNS = ("country", "road_class", "speed", "lanes", "lanes_oneway", "merge_priority")
ZONE_COLUMNS = ("country", "zone", "speed")

SHIPPED_CLASSES = Path(__file__).with_name("osm_road_classes.csv")
SHIPPED_ZONES = Path(__file__).with_name("osm_zone_speeds.csv")

#: codes that mean the same country
SAME = {"UK": "GB"}

Cells = dict[tuple[str, str, str], float]


@dataclass(frozen=True)
class Defaults:
    """The tables: (country, road class or zone, column) to a number in SI units."""

    classes: Cells
    zones: Cells

    def speed(self, country: str, road_class: str) -> float:
        """The free speed assumed, m/s."""
        return self._of_class(country, road_class, "speed")

    def lanes(self, country: str, road_class: str, *, oneway: bool = False) -> int:
        """The lanes assumed in one direction."""
        lanes = self._of_class(country, road_class, "lanes")
        own = _look_up(self.classes, country, road_class, "lanes_oneway") if oneway else None
        return int(lanes if own is None else max(lanes, own))

    def merge_priority(self, country: str, road_class: str) -> float:
        """The weight of a link of this class where links meet."""
        return self._of_class(country, road_class, "merge_priority")

    def zone(self, country: str, zone: str) -> float | None:
        """The speed in a zone, m/s; None where no table knows such a zone."""
        return _look_up(self.zones, country, zone, "speed")

    def why_unknown(self, country: str) -> str | None:
        """What is wrong with the code of a country or region; None where a table knows it."""
        places = self._places()
        place = SAME.get(country, country)
        if place == "default" or place.partition("-")[0] in places:
            return None
        countries = [one for one in places if "-" not in one]
        near = difflib.get_close_matches(place.upper()[:2], countries, n=3, cutoff=0.5)
        hint = f": {' or '.join(near)}" if near else ""
        return (
            f"is not known: write its two letters, as DE or BR{hint}; default, or a class_table "
            "with rows of it, does as well"
        )

    def regions_beside(self, region: str) -> list[str] | None:
        """The regions with rows, where a region of the country (``US-XX``) has none.

        Those whose names are nearest come first. None for a country, or a region with rows.
        """
        place, places = SAME.get(region, region), self._places()
        own, dash, _ = place.partition("-")
        if not dash or place in places:
            return None
        known = sorted(one for one in places if one.startswith(f"{own}-"))
        near = difflib.get_close_matches(place.upper(), known, n=3)
        return [*near, *(one for one in known if one not in near)]

    def _places(self) -> set[str]:
        return {SAME.get(key[0], key[0]) for key in (*self.classes, *self.zones)} - {"default"}

    def _of_class(self, country: str, road_class: str, column: str) -> float:
        value = _look_up(self.classes, country, road_class, column)
        assert value is not None, "the default rows are complete"
        return value


def _look_up(cells: Cells, country: str, row: str, column: str) -> float | None:
    country = SAME.get(country, country)
    for place in (country, country.partition("-")[0], "default"):
        value = cells.get((place, row, column))
        if value is not None:
            return value
    return None


def read_defaults(options: OsmOptions) -> Defaults:
    """The shipped tables with the rows of the options' own laid over them.

    Raises :class:`uxsim_geo.errors.InputError` with every fault of the tables, and if they do not
    know the country.
    """
    faults = Faults()
    defaults = _read_tables(options, faults)
    what = defaults.why_unknown(options.country)
    if what is not None:
        own = Faults("options of the network")
        own.add(what, column="country", value=options.country)
        faults.extend(own)
    faults.raise_if_any()
    return defaults


def fault_of_country(
    country: str, class_table: Path | None = None, zone_table: Path | None = None
) -> str | None:
    """What is wrong with a country; None where nothing is, or where the tables are at fault."""
    faults = Faults()
    defaults = _read_tables(OsmOptions(class_table=class_table, zone_table=zone_table), faults)
    return None if faults.found else defaults.why_unknown(country)


def _read_tables(options: OsmOptions, faults: Faults) -> Defaults:
    classes: Cells = {}
    zones: Cells = {}
    for path in (SHIPPED_CLASSES, options.class_table):
        if path is not None:
            cells = _read(path, CLASS_COLUMNS, faults)
            # lanes of one's own hold for one-way roads too, whatever is shipped for those
            oneway = {(*key[:2], "lanes_oneway"): cells[key] for key in cells if key[2] == "lanes"}
            classes |= oneway | cells if path == options.class_table else cells
    for path in (SHIPPED_ZONES, options.zone_table):
        if path is not None:
            zones |= _read(path, ZONE_COLUMNS, faults)
    return Defaults(classes, zones)


def _read(path: Path, columns: tuple[str, ...], faults: Faults) -> Cells:
    own = Faults(str(path))
    cells: Cells = {}
    seen: set[tuple[str, str]] = set()
    for line, row in _rows(path, columns, own):
        country, name = SAME.get(row["country"], row["country"]), row[columns[1]].lower()
        if (country, name) in seen:
            own.add("stands there more than once", line=line, value=f"{country},{name}")
        seen.add((country, name))
        if not country or not name:
            own.add(f"must name a country (or default) and a {columns[1]}", line=line)
        if columns[1] == "road_class" and name not in ROAD_CLASSES:
            what = f"must be among {', '.join(ROAD_CLASSES)}"
            own.add(what, line=line, column="road_class", value=name)
        for column in columns[2:]:
            if row[column]:
                cells[country, name, column] = _number(row[column], column, line, own)
    faults.extend(own)
    return cells


def _rows(
    path: Path, columns: tuple[str, ...], faults: Faults
) -> Iterator[tuple[int, dict[str, str]]]:
    """Rows of a CSV file with the first two columns and any of the others, and their lines."""
    reader = csv.reader(read_lines(path, faults) or [], strict=True)
    try:
        header = [cell.strip() for cell in next(reader, [])]
        if faults.found:
            return
        known = set(header) <= set(columns) and len(set(header)) == len(header)
        if not (known and set(columns[:2]) <= set(header)):
            what = f"must have columns among {', '.join(columns)}, the first two at least"
            faults.add(what, line=1, value=",".join(header))
            return
        for row in reader:
            if not any(cell.strip() for cell in row):
                continue
            if len(row) == len(header):
                found = dict(zip(header, (cell.strip() for cell in row), strict=True))
                yield reader.line_num, dict.fromkeys(columns, "") | found
            else:
                what = f"the row has {len(row)} values under {len(header)} names"
                faults.add(what, line=reader.line_num, value=",".join(row))
    except csv.Error as error:
        faults.add(f"is not a CSV table: {error}", line=reader.line_num)


def _number(text: str, column: str, line: int, faults: Faults) -> float:
    """The cell in SI units; NaN, with a fault, if it is no such number."""
    if column == "speed":
        speeds = parse_numbers(text)
        if len(speeds) == 1 and SLOWEST <= speeds[0] <= FASTEST:
            return speeds[0]
        faults.add(
            "must be a speed as 50 or 30 mph, 1 to 250 km/h", line=line, column=column, value=text
        )
        return math.nan
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    counts = column.startswith("lanes")
    whole = not counts or (value % 1 == 0 and value <= 20)
    if not (0 < value < math.inf and whole):
        what = "must be a whole number from 1 to 20" if counts else "must be above 0"
        faults.add(what, line=line, column=column, value=text)
    return value
