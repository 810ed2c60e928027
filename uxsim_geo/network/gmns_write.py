"""Networks to GMNS folders that read back as the same tables.

length, free_speed   in the units that config.csv states
capacity             of a lane and hour, as the specification has it
movement.csv         at nodes with banned turns, all turns that are not banned
uxsim_columns.csv    what GMNS has no place for; see uxsim_geo.network.gmns_columns
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np
import pandas as pd

from uxsim_geo.control.signals import Signal
from uxsim_geo.errors import Faults
from uxsim_geo.network.csv_table import write_csv_table
from uxsim_geo.network.exact import exact_factor, float_text, shortest_text
from uxsim_geo.network.gmns_columns import blank_of, cells_of, column_type, place_in_file
from uxsim_geo.network.gmns_movements import turns_at
from uxsim_geo.network.gmns_signals_write import signal_cells
from uxsim_geo.network.gmns_tables import UNIT_NAMES, GmnsUnits, is_there
from uxsim_geo.network.network import NOTE_COLUMNS, Network
from uxsim_geo.network.rows import lacking
from uxsim_geo.network.turn_types import turn_types
from uxsim_geo.network.units import SPEEDS
from uxsim_geo.network.wkt import line_texts

Cells = dict[str, Sequence[str]]

VERSION = "0.97"

#: tables that a folder may lack
OPTIONAL = (
    "movement",
    "geometry",
    "lane",
    "demand",
    "signal_controller",
    "signal_timing_plan",
    "signal_timing_phase",
    "signal_phase_mvmt",
    "signal_coordination",
    "import_notes",
)

#: where the columns of a network have their place in a file
NODE_PLACES = {"node_id": "node_id", "zone_id": "zone_id", "control": "ctrl_type"}
LINK_PLACES = {
    "link_id": "link_id",
    "name": "name",
    "from_node_id": "from_node_id",
    "to_node_id": "to_node_id",
    "geometry": "geometry",
    "length": "length",
    "road_class": "facility_type",
    "capacity": "capacity",
    "free_speed": "free_speed",
    "lanes": "lanes",
}

#: what a use is called that no vehicle has: of a movement that is listed only to ban all others
NO_USE = "none"

POSITIVE = ("length", "lanes", "free_speed", "jam_density", "capacity", "merge_priority")


def write_gmns_network(
    network: Network,
    folder: Path,
    *,
    signals: Sequence[Signal] = (),
    units: GmnsUnits = GmnsUnits(),  # noqa: B008 -- a tuple of two words
) -> list[Path]:
    """Write a network, and signal plans, as GMNS into ``folder`` (made if absent).

    Returns the paths written. Tables of an earlier writing that are not needed now are removed.
    Raises :class:`uxsim_geo.errors.InputError` with all that cannot be written, before anything is.
    """
    return write_tables(gmns_tables(network, signals, units), folder)


def write_tables(tables: dict[str, Cells], folder: Path) -> list[Path]:
    """Write cells by table; an optional table that is not among them does not stay either.

    Only a folder without such tables, or one that was written before, is written into.
    """
    if not is_there(folder, "uxsim_columns"):
        faults = Faults(str(folder))
        for name in ("config", "node", "link", *OPTIONAL):
            if is_there(folder, name):
                what = f"holds a {name}.csv that uxsim-geo did not write: write to another folder"
                faults.add(what)
        faults.raise_if_any()
    folder.mkdir(parents=True, exist_ok=True)
    for name in OPTIONAL:
        if name not in tables:
            (folder / f"{name}.csv").unlink(missing_ok=True)
    return [write_csv_table(folder / f"{name}.csv", cells) for name, cells in tables.items()]


def gmns_tables(network: Network, signals: Sequence[Signal], units: GmnsUnits) -> dict[str, Cells]:
    """The cells of config, node, link, movement, the signals, uxsim_columns and import_notes."""
    faults = Faults("network to be written as GMNS")
    _add_unit_faults(faults, units)
    _add_geometry_faults(faults, network)
    for name, table in (("node", network.nodes), ("link", network.links)):
        _add_id_faults(faults, table, f"{name}_id")
        _add_column_faults(faults, table)
    _add_number_faults(faults, network.links)
    faults.raise_if_any()
    described: list[tuple[str, ...]] = []
    tables = {
        "config": _config(network, units),
        "node": _nodes(network.nodes, described),
        "link": _links(network.links, described, units),
    }
    if len(network.movements) or signals:
        tables["movement"] = _movements(network, [signal.node_id for signal in signals])
        tables |= signal_cells(signals, tables["movement"], faults)
        faults.raise_if_any()
    tables["uxsim_columns"] = columns_table(described)
    if len(network.notes):
        notes = network.notes[list(NOTE_COLUMNS)].astype("str")
        tables["import_notes"] = {name: cells_of(notes[name]) for name in NOTE_COLUMNS}
    return tables


def columns_table(described: list[tuple[str, ...]]) -> Cells:
    """uxsim_columns.csv: table, column, file_column, type and blank, one row a column."""
    names = ("table", "column", "file_column", "type", "blank")
    return {name: [row[place] for row in described] for place, name in enumerate(names)}


def _add_unit_faults(faults: Faults, units: GmnsUnits) -> None:
    known = sorted(set(UNIT_NAMES.values()))
    speeds = [unit for unit in known if unit in SPEEDS]
    for name, unit, those in (
        ("length", units.length, [unit for unit in known if unit not in speeds]),
        ("speed", units.speed, speeds),
    ):
        if unit not in those:
            faults.add(f"must be one of {', '.join(those)}", column=name, value=unit)


def _add_geometry_faults(faults: Faults, network: Network) -> None:
    import shapely

    for name, table, kind in (("nodes", network.nodes, 0), ("links", network.links, 1)):
        if "geometry" not in table:
            faults.add(f"the {name} have no geometry, which GMNS needs: lay the network out first")
            continue
        shapes = np.asarray(table["geometry"], dtype=object)
        wrong = int((shapely.get_type_id(shapes) != kind).sum())
        if wrong:
            faults.add(f"{wrong} {name} have no {'line' if kind else 'point'}", column="geometry")
        elif not kind and shapely.has_z(shapes).any():
            faults.add("nodes have heights: take shapely.force_2d of them", column="geometry")
        elif not np.isfinite(shapely.get_coordinates(shapes)).all():
            faults.add(f"{name} have coordinates that are not finite", column="geometry")
    crs = [getattr(table, "crs", None) for table in (network.nodes, network.links)]
    if crs[0] != crs[1]:
        faults.add("nodes and links are in different reference systems", column="geometry")


def _add_id_faults(faults: Faults, table: pd.DataFrame, name: str) -> None:
    if name not in table:
        faults.add(f"there is no column {name}")
        return
    columns = [column for column in table if str(column).endswith("_id") and column in ID_COLUMNS]
    for column in columns:
        ids = table[column].dropna().astype("str")
        wrong = ids[(ids != ids.str.strip()) | ids.str.lower().isin(["", "nan"])]
        what = "cannot be written as an id: it would be taken for none, or lose its blanks"
        for text in wrong.unique().tolist():
            faults.add(what, column=column, value=text)
    if bool(lacking(table[name]).any()) or bool(table[name].duplicated().any()):
        faults.add("must be there and its own in every row", column=name)


#: columns of ids that other rows refer to
ID_COLUMNS = ("node_id", "link_id", "zone_id", "from_node_id", "to_node_id")


def _add_column_faults(faults: Faults, table: pd.DataFrame) -> None:
    for name in table.columns:
        if name == "geometry":
            continue
        column = table[name]
        if not isinstance(name, str) or column_type(column) is None:
            what = f"values of the type {column.dtype} cannot be written: make them text or numbers"
            faults.add(what, column=str(name))
        elif column_type(column) == "str":
            texts = column.dropna().astype("str")
            if bool(texts.str.contains("\0", regex=False).any()):
                faults.add("has a text with a NUL in it", column=name)
            if bool(((texts != "") & (texts.str.strip() == "")).any()):
                faults.add("has a text of blanks alone, which would be taken for none", column=name)
            if bool((texts == "").any()) and bool(column.isna().any()):
                what = "has empty texts and nulls, which a cell cannot tell apart: make them one"
                faults.add(what, column=name)


def _add_number_faults(faults: Faults, links: pd.DataFrame) -> None:
    for name in POSITIVE:
        if name not in links:
            faults.add(f"there is no column {name}")
            continue
        values = links[name].to_numpy(np.float64)
        wrong = int(((values <= 0) | np.isinf(values)).sum())
        if wrong or (name == "length" and np.isnan(values).any()):
            faults.add("must be finite and above 0 in every link", column=name)


def _config(network: Network, units: GmnsUnits) -> Cells:
    from pyproj import CRS

    crs = getattr(network.links, "crs", None)
    text = "none" if crs is None else crs.to_string()
    if crs is not None and CRS.from_user_input(text) != crs:
        text = crs.to_wkt()
    return {
        "dataset_name": ["uxsim-geo"],
        "short_length": [units.length],
        "long_length": [units.length],
        "speed": [units.speed],
        "crs": [text],
        "geometry_field_format": ["wkt"],
        "version_number": [VERSION],
        "id_type": ["string"],
    }


def _nodes(nodes: pd.DataFrame, described: list[tuple[str, ...]]) -> Cells:
    import shapely

    places = shapely.get_coordinates(np.asarray(nodes["geometry"], dtype=object)).T.tolist()
    cells: Cells = {"node_id": cells_of(nodes["node_id"])}
    for name, own in zip(("x_coord", "y_coord"), places, strict=True):
        cells[name] = list(map(float_text, own))
    return _with_others(cells, "node", nodes, NODE_PLACES, described)


def _links(links: pd.DataFrame, described: list[tuple[str, ...]], units: GmnsUnits) -> Cells:
    rows = len(links)
    lanes = links["lanes"].to_numpy(np.float64)
    whole = np.where(np.isfinite(lanes) & (lanes % 1 == 0), lanes, 1.0).astype(np.int64).tolist()
    per_lane = exact_factor("veh/h/lane", "capacity")
    lines = np.asarray(links["geometry"], dtype=object)
    texts: Cells = {
        "directed": ["1"] * rows,
        "dir_flag": ["1"] * rows,
        "geometry": line_texts(lines),
        "length": _in_unit(links["length"], [exact_factor(units.length, "length")] * rows),
        "free_speed": _in_unit(links["free_speed"], [exact_factor(units.speed, "speed")] * rows),
        "capacity": _in_unit(links["capacity"], [per_lane * lane for lane in whole]),
    }
    order = ("link_id", "name", "from_node_id", "to_node_id", "directed", "geometry", "dir_flag")
    cells: Cells = {}
    for name in (*order, "length", "road_class", "capacity", "free_speed", "lanes"):
        if name in texts:
            cells[name] = texts[name]
        elif name in links:
            cells[LINK_PLACES[name]] = cells_of(links[name])
    return _with_others(cells, "link", links, LINK_PLACES, described)


def _in_unit(column: pd.Series, factors: Sequence[Fraction]) -> list[str]:
    """Numbers in a unit, such that they read back as the same floats; empty where there is none."""
    known: dict[tuple[float, Fraction], str] = {}
    cells = []
    for pair in zip(column.to_numpy(np.float64).tolist(), factors, strict=True):
        if pair not in known:
            known[pair] = "" if pair[0] != pair[0] else shortest_text(*pair)
        cells.append(known[pair])
    return cells


def _with_others(
    cells: Cells,
    of: str,
    table: pd.DataFrame,
    places: dict[str, str],
    described: list[tuple[str, ...]],
) -> Cells:
    """Add the columns that have no place in the file, and describe them all."""
    for name in table.columns:
        if name == "geometry":
            described.append((of, name, places.get(name, ""), "geometry", "null"))
            continue
        place = places.get(name) or place_in_file(name, of, cells)
        if place not in cells:
            cells[place] = cells_of(table[name])
        kind = column_type(table[name])
        described.append((of, name, place, str(kind), blank_of(table[name])))
    return cells


def _movements(network: Network, signalled: Sequence[str]) -> Cells:
    """All allowed turns at nodes with banned ones or signals.

    At a node where none is allowed a turn for no use is listed, which bans the others.
    """
    links, banned = network.links, network.movements
    turns = turns_at(pd.Index([*banned["node_id"], *signalled], dtype="str"), links)
    pairs = ["from_link_id", "to_link_id"]
    is_banned = pd.MultiIndex.from_frame(turns[pairs]).isin(pd.MultiIndex.from_frame(banned[pairs]))
    some = pd.Series(~is_banned).groupby(turns["node_id"].to_numpy()).transform("any").to_numpy()
    first = ~turns["node_id"].duplicated().to_numpy()
    listed = ~is_banned | (~some & first)
    turns, closed = turns[listed].reset_index(drop=True), is_banned[listed]
    return {
        "mvmt_id": [str(number) for number in range(1, len(turns) + 1)],
        "node_id": cells_of(turns["node_id"]),
        "ib_link_id": cells_of(turns["from_link_id"]),
        "ob_link_id": cells_of(turns["to_link_id"]),
        "type": turn_types(turns, links),
        "allowed_uses": [NO_USE if one else "" for one in closed.tolist()],
    }
