"""What every step of reading a GMNS folder needs: its tables, the choices, faults and notes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from uxsim_geo.errors import Faults
from uxsim_geo.network.csv_table import CsvTable, has_columns
from uxsim_geo.network.gmns_options import GmnsOptions
from uxsim_geo.network.gmns_tables import (
    NOT_READ,
    GmnsConfig,
    is_there,
    read_config,
    read_if_there,
    read_table,
    table_path,
)
from uxsim_geo.network.measure import parse_crs
from uxsim_geo.network.network import NOTE_COLUMNS
from uxsim_geo.network.notes import Notes

if TYPE_CHECKING:
    from pyproj import CRS

#: columns without which a table cannot be used
NEEDED = {
    "node": ("node_id", "x_coord", "y_coord"),
    "link": ("link_id", "from_node_id", "to_node_id"),
    "geometry": ("geometry_id", "geometry"),
    "lane": ("lane_id", "link_id", "lane_num"),
    "movement": ("mvmt_id", "node_id", "ib_link_id", "ob_link_id"),
    "uxsim_columns": ("table", "column", "file_column", "type", "blank"),
    "import_notes": NOTE_COLUMNS,
}


@dataclass(frozen=True)
class Reading:
    """A folder under way: ``faults`` by table, in the order in which they are told at the end."""

    folder: Path
    options: GmnsOptions
    config: GmnsConfig
    tables: dict[str, CsvTable]
    faults: dict[str, Faults]
    notes: Notes
    crs: CRS | None

    @property
    def nodes(self) -> CsvTable:
        """The node table as it stands in the file."""
        return self.tables["node"]

    @property
    def links(self) -> CsvTable:
        """The link table as it stands in the file."""
        return self.tables["link"]

    @property
    def is_own(self) -> bool:
        """Whether the folder was written by uxsim-geo."""
        return "uxsim_columns" in self.tables

    def raise_if_any(self) -> None:
        """Raise :class:`uxsim_geo.errors.InputError` with the faults of all tables, or return."""
        together = Faults()
        for own in self.faults.values():
            together.extend(own)
        together.raise_if_any()


def open_folder(folder: Path, options: GmnsOptions) -> Reading:
    """Read the tables of a folder, without looking into their cells.

    Raises :class:`uxsim_geo.errors.InputError` with everything that cannot be read.
    """
    faults = Faults(str(folder))
    if not folder.is_dir():
        faults.add("there is no such folder")
        faults.raise_if_any()
    config = read_config(folder, faults)
    tables = {name: read_table(folder, name, faults) for name in ("node", "link")}
    optional = ["geometry", "lane", "uxsim_columns"]
    optional += ["import_notes"] if is_there(folder, "uxsim_columns") else []
    optional += ["movement"] if options.turns == "listed" else []
    tables |= {name: read_if_there(folder, name, faults) for name in optional}
    found = {name: table for name, table in tables.items() if table is not None}
    for name, table in found.items():
        own = Faults(str(table.source))
        has_columns(table, NEEDED[name], own)
        faults.extend(own)
    faults.raise_if_any()
    by_table = {name: Faults(str(table.source)) for name, table in found.items()}
    notes = Notes()
    _note_not_read(folder, options, notes)
    crs = _crs(folder, options, config, by_table, notes)
    return Reading(folder, options, config, found, by_table, notes, crs)


def _crs(
    folder: Path,
    options: GmnsOptions,
    config: GmnsConfig,
    faults: dict[str, Faults],
    notes: Notes,
) -> CRS | None:
    """The reference system that holds; None: none is known, or it is a fault that none is."""
    stated = options.crs or config.crs
    if stated is None:
        faults["node"].add(
            "the reference system of the coordinates must be stated as crs, for instance "
            "EPSG:4326 for longitude and latitude, or none: no config.csv says it"
        )
        return None
    if options.crs is not None and config.crs is not None:
        note_overruled("crs", options.crs, config.crs, notes)
    faults["config"] = Faults(str(table_path(folder, "config")) if options.crs is None else "")
    crs = parse_crs(stated, faults["config"])
    if stated.strip().lower() == "none":
        notes.add("no CRS", "coordinates of no known reference system", severity="warning")
    return crs


def note_overruled(name: str, stated: str, said: str, notes: Notes) -> None:
    """Say that an option holds against config.csv, where the two differ."""
    if stated.lower() != said.lower():
        note = f"{name} is {stated} by option, against {said} in config.csv"
        notes.add("option against config.csv", note, severity="warning", value=said)


def _note_not_read(folder: Path, options: GmnsOptions, notes: Notes) -> None:
    for name, why in NOT_READ.items():
        if is_there(folder, name):
            notes.add("not read", f"{name}.csv: {why}", severity="warning")
    if options.turns == "all" and is_there(folder, "movement"):
        notes.add("not read", "movement.csv: every turn is allowed", severity="warning")
