"""The files of a GMNS folder: which are there, their columns, and what config.csv says.

Specification: github.com/zephyr-data-specs/GMNS, 0.97. Column names are found whatever their
case, and where a shapefile has cut them at ten characters.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from uxsim_geo.errors import Faults
from uxsim_geo.network.csv_table import CsvTable, read_csv_table
from uxsim_geo.network.network import NOTE_COLUMNS

#: columns of the tables that are read, as the specification has them
COLUMNS: dict[str, tuple[str, ...]] = {
    "config": (
        "dataset_name",
        "short_length",
        "long_length",
        "speed",
        "crs",
        "geometry_field_format",
        "currency",
        "version_number",
        "id_type",
    ),
    "node": (
        "node_id",
        "name",
        "x_coord",
        "y_coord",
        "z_coord",
        "node_type",
        "ctrl_type",
        "zone_id",
        "parent_node_id",
    ),
    "link": (
        "link_id",
        "name",
        "from_node_id",
        "to_node_id",
        "directed",
        "geometry_id",
        "geometry",
        "parent_link_id",
        "dir_flag",
        "length",
        "grade",
        "facility_type",
        "capacity",
        "free_speed",
        "lanes",
        "bike_facility",
        "ped_facility",
        "parking",
        "allowed_uses",
        "toll",
        "jurisdiction",
        "row_width",
    ),
    "geometry": ("geometry_id", "geometry"),
    "lane": ("lane_id", "link_id", "lane_num", "allowed_uses", "r_barrier", "l_barrier", "width"),
    "movement": (
        "mvmt_id",
        "node_id",
        "name",
        "ib_link_id",
        "start_ib_lane",
        "end_ib_lane",
        "ob_link_id",
        "start_ob_lane",
        "end_ob_lane",
        "type",
        "penalty",
        "capacity",
        "ctrl_type",
        "mvmt_code",
        "allowed_uses",
        "geometry",
    ),
    "signal_controller": ("controller_id",),
    "signal_timing_plan": (
        "timing_plan_id",
        "controller_id",
        "timeday_id",
        "time_day",
        "cycle_length",
        "uxsim_begin_s",
        "uxsim_end_s",
    ),
    "signal_timing_phase": (
        "timing_phase_id",
        "timing_plan_id",
        "signal_phase_num",
        "min_green",
        "max_green",
        "extension",
        "clearance",
        "walk_time",
        "ped_clearance",
        "ring",
        "barrier",
        "position",
    ),
    "signal_phase_mvmt": (
        "signal_phase_mvmt_id",
        "timing_phase_id",
        "mvmt_id",
        "link_id",
        "protection",
    ),
    "signal_coordination": (
        "coordination_id",
        "timing_plan_id",
        "controller_id",
        "coord_contr_id",
        "coord_phase",
        "coord_ref_to",
        "offset",
    ),
    "uxsim_columns": ("table", "column", "file_column", "type", "blank"),
    "import_notes": NOTE_COLUMNS,
}

#: length of the column names in a shapefile
CUT = 10

#: tables that change nothing here, and what that means
NOT_READ = {
    "segment": "parts of links with other lanes, such as turn pockets, are not simulated",
    "segment_lane": "lanes of parts of links are not simulated",
    "link_tod": "attributes by the time of day are not simulated",
    "segment_tod": "attributes by the time of day are not simulated",
    "lane_tod": "attributes by the time of day are not simulated",
    "segment_lane_tod": "attributes by the time of day are not simulated",
    "movement_tod": "turns by the time of day are not simulated",
}

#: units as config.csv has them, in lower case, to those of uxsim_geo.network.units
UNIT_NAMES = {
    **dict.fromkeys(("m", "meter", "meters", "metre", "metres"), "m"),
    **dict.fromkeys(("km", "kilometer", "kilometers", "kilometre", "kilometres"), "km"),
    **dict.fromkeys(("ft", "foot", "feet"), "ft"),
    **dict.fromkeys(("mi", "mile", "miles"), "mi"),
    **dict.fromkeys(("mph", "mi/h", "mi/hr", "miles per hour", "miles/hour"), "mph"),
    **dict.fromkeys(("km/h", "kmh", "kph", "kmph", "km/hr", "kilometers per hour"), "km/h"),
    **dict.fromkeys(("m/s", "mps", "meters per second", "metres per second"), "m/s"),
    **dict.fromkeys(("ft/s", "fps", "feet per second"), "ft/s"),
}


class GmnsUnits(NamedTuple):
    """The units of lengths and speeds in files that are written."""

    length: str = "m"
    speed: str = "km/h"


@dataclass(frozen=True)
class GmnsConfig:
    """The units and the reference system that config.csv states, None where it is silent."""

    length_unit: str | None = None
    speed_unit: str | None = None
    crs: str | None = None


def table_path(folder: Path, name: str) -> Path:
    """Where a table is: ``link.csv``, whatever the case of its letters."""
    wanted = f"{name}.csv"
    if not folder.is_dir() or (folder / wanted).exists():
        return folder / wanted
    found = sorted(path for path in folder.iterdir() if path.name.lower() == wanted)
    return found[0] if found else folder / wanted


def is_there(folder: Path, name: str) -> bool:
    """Whether the folder has a table of this name."""
    return table_path(folder, name).is_file()


def read_table(folder: Path, name: str, faults: Faults) -> CsvTable | None:
    """Read a table under the specification's column names; None, and a fault, where it is none."""
    own = Faults(str(table_path(folder, name)))
    table = read_csv_table(table_path(folder, name), own, rename=_whole_names(COLUMNS[name]))
    faults.extend(own)
    return table


def read_if_there(folder: Path, name: str, faults: Faults) -> CsvTable | None:
    """Read a table that may be absent."""
    return read_table(folder, name, faults) if is_there(folder, name) else None


def _whole_names(known: tuple[str, ...]) -> Callable[[list[str]], list[str]]:
    """Header to the known names: small letters, and whole where they were cut."""

    def whole(header: list[str]) -> list[str]:
        names = [name.lower() if name.lower() in known else name for name in header]
        for place, name in enumerate(names):
            if len(name) != CUT or name in known:
                continue
            cut_from = [one for one in known if one.startswith(name.lower()) and one not in names]
            if len(cut_from) == 1:
                names[place] = cut_from[0]
        return names

    return whole


def read_config(folder: Path, faults: Faults) -> GmnsConfig:
    """The units and the reference system of the folder, as far as its config.csv states them."""
    table = read_if_there(folder, "config", faults)
    if table is None:
        return GmnsConfig()
    own = Faults(str(table.source))
    if len(table) != 1:
        own.add(f"must hold one row, it holds {len(table)}")
        faults.extend(own)
        return GmnsConfig()
    units = [_unit(table, name, own) for name in ("long_length", "speed")]
    form = table.cells("geometry_field_format")[0].strip()
    if form.lower() not in ("", "wkt"):
        what = "geometry is read as WKT alone"
        own.add(what, line=table.lines[0], column="geometry_field_format", value=form)
    crs = table.cells("crs")[0].strip()
    faults.extend(own)
    return GmnsConfig(units[0], units[1], (f"EPSG:{crs}" if crs.isdecimal() else crs) or None)


def _unit(table: CsvTable, name: str, faults: Faults) -> str | None:
    text = table.cells(name)[0].strip()
    unit = UNIT_NAMES.get(text.lower())
    if text and unit is None:
        known = ", ".join(sorted(set(UNIT_NAMES.values())))
        what = f"is no unit that is known here ({known})"
        faults.add(what, line=table.lines[0], column=name, value=text)
    return unit
