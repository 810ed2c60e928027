"""A table of what is better known than in the source: it replaces attributes of links.

The table is a CSV file or a GeoPackage with a column link_id; every other column is named as in
the links table (SI units) or with another unit at the end of its name, as ``free_speed_kmh``,
``length_km`` or ``capacity_vph``. An empty cell leaves what is there.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from uxsim_geo.errors import Faults
from uxsim_geo.network.check import PLACEHOLDER
from uxsim_geo.network.csv_table import has_columns, read_csv_table, text_column
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.rows import whole_where_possible
from uxsim_geo.network.text import read_bytes
from uxsim_geo.network.tntp_rows import number
from uxsim_geo.network.units import CAPACITIES, LENGTHS, SPEEDS
from uxsim_geo.network.vector_files import layers_of, read_layer

NUMBERS = ("length", "lanes", "free_speed", "jam_density", "capacity", "merge_priority")
TEXTS = ("road_class", "name", "source_id")

#: columns that say where a number comes from; it is given once it is overridden
SOURCES = {"lanes": "lanes_source", "free_speed": "free_speed_source"}

#: topics of the notes on a column, which no longer hold once every link has another value there
TOPICS = {
    "length": ("length assumed", "length copied"),
    "lanes": ("lanes assumed",),
    "free_speed": (
        "free speed clipped",
        "free speed implausible",
        "free speeds equal",
        "no free speed",
        "no free-flow time",
    ),
}

#: name in the table to (column of the links, its factor to SI)
NAMES: dict[str, tuple[str, float]] = {name: (name, 1.0) for name in NUMBERS} | {
    "length_m": ("length", 1.0),
    "length_km": ("length", LENGTHS["km"]),
    "length_mi": ("length", LENGTHS["mi"]),
    "length_ft": ("length", LENGTHS["ft"]),
    "free_speed_m_s": ("free_speed", 1.0),
    "free_speed_kmh": ("free_speed", SPEEDS["kmh"]),
    "free_speed_mph": ("free_speed", SPEEDS["mph"]),
    "capacity_vph": ("capacity", CAPACITIES["vph"]),
    "jam_density_vpkm": ("jam_density", 1.0 / LENGTHS["km"]),
}


@dataclass(frozen=True)
class Overrides:
    """cells: text, one row a link, null where empty; lines: where each row stands, to name it."""

    cells: pd.DataFrame
    lines: list[int]


def apply_overrides(network: Network, path: Path) -> Network:
    """Replace attributes of links by those in a table (CSV, or GeoPackage by its suffix .gpkg).

    Lanes and free speeds set here become ``given``. Raises :class:`InputError` with every unknown
    column and link, repeated link, value that is no number and unit given twice.
    """
    faults = Faults(str(path))
    geopackage = path.suffix.lower() == ".gpkg"
    table = _read_geopackage(path, faults) if geopackage else _read_csv(path, faults)
    faults.raise_if_any()
    _add_column_faults(table.cells, faults)
    _add_link_faults(table, network, faults)
    links = network.links.copy()
    rows = pd.Index(links["link_id"]).get_indexer(table.cells["link_id"])
    for name in table.cells.columns:
        if name in NAMES:
            _set_numbers(links, rows, table, name, faults)
        elif name in TEXTS:
            given = table.cells[name].notna().to_numpy() & (rows >= 0)
            links.loc[links.index[rows[given]], name] = table.cells[name][given].to_numpy()
    faults.raise_if_any()
    notes = Notes()
    columns = ", ".join(name for name in table.cells.columns if name != "link_id")
    note = f"{columns} taken from {path.name} where it has values; value: rows"
    notes.add("overrides", note, element="link", value=len(table.cells))
    still = network.notes[~_is_outdated(network, table)]
    all_notes = pd.concat([still, notes.table()], ignore_index=True)
    return replace(network, links=links, notes=all_notes)


def _is_outdated(network: Network, table: Overrides) -> np.ndarray:
    """Which notes of the network are on a column that the table sets on every link."""
    outdated = np.zeros(len(network.notes), dtype=bool)
    topic, value = network.notes["topic"], network.notes["value"]
    for name in NAMES.keys() & set(table.cells.columns):
        if table.cells[name].notna().sum() == len(network.links):
            column = NAMES[name][0]
            outdated |= np.asarray(topic.isin(TOPICS.get(column, ())), dtype=bool)
            outdated |= np.asarray((topic == PLACEHOLDER) & (value == column), dtype=bool)
    return outdated


def _read_csv(path: Path, faults: Faults) -> Overrides:
    table = read_csv_table(path, faults)
    if table is None or not has_columns(table, ["link_id"], faults):
        return Overrides(pd.DataFrame(), [])
    columns = {name: text_column(cells).str.strip() for name, cells in table.columns.items()}
    return Overrides(pd.DataFrame(columns), table.lines)


def _read_geopackage(path: Path, faults: Faults) -> Overrides:
    nothing = Overrides(pd.DataFrame(), [])
    if read_bytes(path, faults) is None:
        return nothing
    layers = list(layers_of(path, faults))
    if faults.found:
        return nothing
    if len(layers) != 1:
        faults.add(f"must hold one table, it holds {', '.join(layers) or 'none'}")
        return nothing
    found = read_layer(path, layers[0], faults, read_geometry=False)
    if found is None:
        return nothing
    if "link_id" not in found:
        faults.add("lacks the column link_id", value=", ".join(found.columns))
    cells = pd.DataFrame({name: _as_text(found[name]) for name in found.columns})
    return Overrides(cells, list(range(1, len(cells) + 1)))


def _as_text(column: pd.Series) -> pd.Series:
    """Numbers as they would be written, so that both kinds of table are read by one rule."""
    texts = [None if pd.isna(value) else str(value).strip() or None for value in column]
    return pd.Series(texts, dtype="str")


def _add_column_faults(cells: pd.DataFrame, faults: Faults) -> None:
    known = [*NAMES, *TEXTS]
    seen: dict[str, str] = {}
    for name in cells.columns:
        if name == "link_id":
            continue
        if name not in known:
            near = difflib.get_close_matches(str(name), known, n=1)
            hint = f"; did you mean {near[0]}?" if near else f"; known are {', '.join(known)}"
            faults.add(f"is no attribute of links that can be set{hint}", column=name)
            continue
        attribute = NAMES[name][0] if name in NAMES else name
        if attribute in seen:
            faults.add(f"sets {attribute}, as {seen[attribute]} does", column=name)
        seen[attribute] = name


def _add_link_faults(table: Overrides, network: Network, faults: Faults) -> None:
    known = set(network.links["link_id"])
    seen: set[str] = set()
    for link_id, line in zip(table.cells["link_id"], table.lines, strict=True):
        if pd.isna(link_id):
            faults.add("the row names no link", line=line, column="link_id")
        elif link_id not in known:
            near = difflib.get_close_matches(link_id, known, n=1) if len(faults.found) < 5 else []
            hint = f"; did you mean {near[0]}?" if near else ""
            what = f"the network has no such link{hint}"
            faults.add(what, line=line, column="link_id", value=link_id)
        elif link_id in seen:
            faults.add(
                "the link has a row above: keep one", line=line, column="link_id", value=link_id
            )
        else:
            seen.add(link_id)


def _set_numbers(
    links: pd.DataFrame, rows: np.ndarray, table: Overrides, name: str, faults: Faults
) -> None:
    column, factor = NAMES[name]
    values = links[column].to_numpy(dtype=np.float64, copy=True)
    given = np.zeros(len(links), dtype=bool)
    for row, text, line in zip(rows, table.cells[name], table.lines, strict=True):
        if pd.isna(text):
            continue
        value = number(text)
        if value is None or not 0 < value < np.inf:
            what = "must be a finite number above 0, or empty"
            faults.add(what, line=line, column=name, value=text)
        elif row >= 0:
            values[row], given[row] = value * factor, True
    links[column] = whole_where_possible(values) if column == "lanes" else values
    if column in SOURCES:
        links.loc[given, SOURCES[column]] = "given"
