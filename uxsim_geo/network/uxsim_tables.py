"""Rows of UXsim's CSV files to network tables, and network tables to such rows.

UXsim's ``kappa`` is the jam density of all lanes together, here it is that of one. Its
coordinates have no reference system unless one is stated.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import pandas as pd

from uxsim_geo.errors import Faults
from uxsim_geo.network.exact import USUAL_DIGITS, float_text, product
from uxsim_geo.network.measure import parse_crs
from uxsim_geo.network.network import LINK_COLUMNS, NODE_COLUMNS, Network
from uxsim_geo.network.notes import Notes
from uxsim_geo.network.rows import lacking
from uxsim_geo.network.uxsim_csv import Row

Cells = dict[str, Sequence[str]]

#: what UXsim takes where a cell is empty
FREE_SPEED, JAM_DENSITY, MERGE_PRIORITY, LANES = 20.0, 0.2, 1.0, 1

#: so far around a quotient its inverse is looked for, in steps from one float64 to the next
NEIGHBOURS = 4


@dataclass(frozen=True)
class UxsimCsvOptions:
    """What the files do not say.

    crs
        of x and y, as ``EPSG:4326``; ``none``: of no known system, as UXsim takes them
    """

    crs: str = "none"

    def __post_init__(self) -> None:
        faults = Faults("options of the network")
        parse_crs(self.crs, faults)
        faults.raise_if_any()


def network_of_rows(nodes: list[Row], links: list[Row], options: UxsimCsvOptions) -> Network:
    """Nodes as points and links as straight lines between them, in the order of the rows."""
    import geopandas
    import shapely

    notes = Notes()
    crs = parse_crs(options.crs, Faults())
    if crs is None:
        notes.add("no CRS", "coordinates of no known reference system", severity="warning")
    points = _nodes(nodes)
    lines = _links(links)
    place = np.array([[row.values["x"], row.values["y"]] for row in nodes], dtype=np.float64)
    place = place.reshape(-1, 2)
    index = pd.Index(points["node_id"])
    ends = [place[index.get_indexer(lines[end])] for end in ("from_node_id", "to_node_id")]
    lines["geometry"] = shapely.linestrings(np.stack(ends, axis=1))
    _note_assumed(links, notes)
    return Network(
        geopandas.GeoDataFrame(points, geometry=shapely.points(place), crs=crs),
        geopandas.GeoDataFrame(lines, geometry="geometry", crs=crs),
        notes=notes.table(),
    )


def _nodes(rows: list[Row]) -> pd.DataFrame:
    names = pd.Series([row.values["name"] for row in rows], dtype="str")
    nodes = pd.DataFrame({"node_id": names, "zone_id": names})
    nodes["control"] = pd.Series(["none"] * len(rows), dtype="str")
    nodes["through_traffic"] = True
    return nodes[list(NODE_COLUMNS)]


def _links(rows: list[Row]) -> pd.DataFrame:
    def numbers(argument: str, default: float) -> np.ndarray:
        return np.array([row.values.get(argument, default) for row in rows], dtype=np.float64)

    def source(argument: str) -> list[str]:
        return ["given" if argument in row.values else "assumed" for row in rows]

    lanes = numbers("number_of_lanes", LANES)
    total = numbers("jam_density", math.nan)
    limits = [numbers(f"capacity_{way}", math.nan) for way in ("out", "in")]
    columns = {
        "link_id": [row.values["name"] for row in rows],
        "from_node_id": [row.values["start_node"] for row in rows],
        "to_node_id": [row.values["end_node"] for row in rows],
        "length": numbers("length", math.nan),
        "lanes": lanes.astype(np.int64),
        "free_speed": numbers("free_flow_speed", FREE_SPEED),
        "jam_density": [_of_a_lane(*pair) for pair in zip(total, lanes, strict=True)],
        "capacity": np.fmin(*limits),
        "merge_priority": numbers("merge_priority", MERGE_PRIORITY),
        "road_class": [None] * len(rows),
        "name": [row.values["name"] for row in rows],
        "source_id": [row.values["name"] for row in rows],
        "lanes_source": source("number_of_lanes"),
        "free_speed_source": source("free_flow_speed"),
    }
    text = [name for name in columns if name.endswith(("_id", "_source", "_class", "name"))]
    return pd.DataFrame(columns).astype(dict.fromkeys(text, "str"))[list(LINK_COLUMNS)]


def _of_a_lane(total: float, lanes: float) -> float:
    """Jam density of one lane: 0.6 on three lanes is 0.2 to the bit, as the decimals are."""
    if math.isnan(total):
        return JAM_DENSITY
    return product(float_text(float(total)), Fraction(1, int(lanes)))


def _note_assumed(rows: list[Row], notes: Notes) -> None:
    for argument, topic, value, unit in (
        ("free_flow_speed", "free speed assumed", FREE_SPEED, "m/s"),
        ("jam_density", "jam density assumed", JAM_DENSITY, "veh/m"),
        ("merge_priority", "merge priority assumed", MERGE_PRIORITY, "by weight"),
        ("number_of_lanes", "lanes assumed", LANES, "lanes"),
    ):
        without = sum(argument not in row.values for row in rows)
        if without:
            note = f"on {without} of {len(rows)} links, as UXsim takes it; value: {unit}"
            notes.add(topic, note, element="link", value=value)


def node_cells(network: Network, faults: Faults) -> Cells:
    """name, x, y; faults where nodes have no coordinates or no name that can be read back."""
    nodes = network.nodes
    _add_name_faults(nodes["node_id"], faults)
    place = _places(nodes)
    if place is None or not np.isfinite(place).all():
        faults.add("nodes have no coordinates: lay the network out first")
        return {}
    x, y = (list(map(float_text, own)) for own in place.T.tolist())
    return {"name": nodes["node_id"].tolist(), "x": x, "y": y}


def _places(nodes: pd.DataFrame) -> np.ndarray | None:
    """X and y of each node: of its point, otherwise its columns x and y; None without either."""
    import shapely

    if "geometry" in nodes:
        points = np.asarray(nodes["geometry"], dtype=object)
        return np.column_stack([shapely.get_x(points), shapely.get_y(points)])
    if {"x", "y"} <= set(nodes):
        return nodes[["x", "y"]].to_numpy(dtype=np.float64)
    return None


def _add_name_faults(names: pd.Series, faults: Faults) -> None:
    for name in names[names.duplicated()].unique().tolist():
        faults.add("stands there more than once", column=str(names.name), value=name)
    if lacking(names).any():
        faults.add("must be there in every row", column=str(names.name))
    for name in names.dropna().astype("str").tolist():
        if name != name.strip() or len(name.splitlines()) > 1:
            what = "has blanks around it or line ends in it, which the file would lose"
            faults.add(what, column=str(names.name), value=name)


def link_cells(network: Network, faults: Faults, notes: Notes) -> Cells:
    """Name to merge_priority, and number_of_lanes and capacity_out where any link needs them."""
    links = network.links
    _add_name_faults(links["link_id"], faults)
    names = ("length", "free_speed", "lanes", "jam_density", "merge_priority")
    values = {name: links[name].to_numpy(np.float64) for name in names}
    for name, column in values.items():
        if not (np.isfinite(column) & (column > 0)).all():
            faults.add("must be finite and above 0 in every link", column=name)
    if faults.found:
        return {}
    lanes = values["lanes"].tolist()
    totals = (values["jam_density"] * values["lanes"]).tolist()
    kappa, rounded = inverses(
        values["jam_density"].tolist(),
        [float(f"{total:.{USUAL_DIGITS}g}") for total in totals],
        lambda total, row: _of_a_lane(total, lanes[row]),
    )
    note_rounded(notes, "kappa", rounded)
    cells: Cells = {
        "name": links["link_id"].tolist(),
        "start": links["from_node_id"].tolist(),
        "end": links["to_node_id"].tolist(),
        "length": list(map(float_text, values["length"].tolist())),
        "u": list(map(float_text, values["free_speed"].tolist())),
        "kappa": list(map(float_text, kappa)),
        "merge_priority": list(map(float_text, values["merge_priority"].tolist())),
    }
    return cells | _further_cells(links, notes)


def _further_cells(links: pd.DataFrame, notes: Notes) -> Cells:
    """Columns that UXsim itself does not read: number_of_lanes and capacity_out, where needed."""
    cells: Cells = {}
    several = links["lanes"].ne(LANES).to_numpy()
    told = several.copy()
    if "lanes_source" in links:
        told |= links["lanes_source"].eq("given").to_numpy()
    if told.any():
        lanes = links["lanes"].to_numpy(np.float64).tolist()
        own = zip(lanes, told.tolist(), strict=True)
        cells["number_of_lanes"] = [float_text(lane) if given else "" for lane, given in own]
    capacity = links["capacity"].to_numpy(np.float64)
    limited = np.isfinite(capacity)
    if limited.any():
        texts = ["" if math.isnan(one) else float_text(one) for one in capacity.tolist()]
        cells["capacity_out"] = texts
    for topic, number in (
        ("lanes", int(several.sum())),
        ("capacity", int(limited.sum())),
    ):
        if number:
            column = "number_of_lanes" if topic == "lanes" else "capacity_out"
            note = f"stands in the column {column}, which uxsim-geo reads and UXsim passes over"
            note += "; value: links"
            notes.add(topic, note, element="link", severity="warning", value=number)
    return cells


def inverses(
    wanted: Sequence[float], guesses: Sequence[float], read: Callable[[float, int], float]
) -> tuple[list[float], int]:
    """Numbers that ``read`` turns into those wanted, or nearly; and how many do only nearly.

    ``read`` takes a number and its row. The guess is off by a rounding, so that its neighbours
    are tried.
    """
    found: list[float] = []
    rounded = 0
    for row, (target, guess) in enumerate(zip(wanted, guesses, strict=True)):
        up = down = number = float(guess)
        for _ in range(NEIGHBOURS):
            number = next((one for one in (up, down) if read(one, row) == target), math.nan)
            if number == number:
                break
            up, down = math.nextafter(up, math.inf), math.nextafter(down, 0.0)
        rounded += number != number
        found.append(float(guess) if number != number else number)
    return found, rounded


def note_rounded(notes: Notes, column: str, rows: int) -> None:
    """Say how many numbers of a column read back nearly, if any."""
    if rows:
        note = f"{column} has no float64 that reads back to the bit: the nearest; value: rows"
        notes.add("rounded", note, severity="warning", value=rows)


def note_lost(network: Network, notes: Notes) -> None:
    """Say what of a network has no place in UXsim's files."""
    import shapely

    nodes, links = network.nodes, network.links
    lost: list[tuple[str, int]] = [("banned turns", len(network.movements))]
    if "control" in nodes:
        lost.append(("signals", int(nodes["control"].eq("signal").sum())))
    if "through_traffic" in nodes:
        lost.append(("nodes without through traffic", int((~nodes["through_traffic"]).sum())))
    if "zone_id" in nodes:
        other = nodes["zone_id"].notna() & nodes["zone_id"].ne(nodes["node_id"])
        lost.append(("zones", int(other.sum())))
    if "geometry" in links:
        bends = shapely.get_num_coordinates(np.asarray(links["geometry"], dtype=object)) > 2
        lost.append(("shapes of links that are not straight", int(bends.sum())))
    if getattr(nodes, "crs", None) is not None:
        notes.add("not written", f"the reference system, {nodes.crs.to_string()}")
    for thing, number in lost:
        if number:
            what = f"{thing}: UXsim's files have no place for them; value: how many"
            notes.add("not written", what, severity="warning", value=number)
    _note_lost_columns(nodes, (*NODE_COLUMNS, "geometry", "x", "y"), notes)
    kept = ("lanes_source", "free_speed_source", "name", "source_id", "road_class")
    read = [name for name in LINK_COLUMNS if name not in kept]
    same = [name for name in ("name", "source_id") if name in links]
    same = [name for name in same if links[name].eq(links["link_id"]).all()]
    _note_lost_columns(links, (*read, *same, "lanes_source", "geometry"), notes)


def _note_lost_columns(table: pd.DataFrame, read: Sequence[str], notes: Notes) -> None:
    for name in table.columns:
        values = table[name]
        filled = values.notna() & ~values.isin(["", "given"]) if name not in read else None
        if filled is not None and filled.any():
            what = f"the column {name}: UXsim's files have no place for it; value: rows"
            notes.add("not written", what, value=int(filled.sum()))
