"""Where nodes are: node files in TNTP form, or points in GeoJSON."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.errors import Faults
from uxsim_geo.network.text import read_lines
from uxsim_geo.network.tntp_options import TntpOptions
from uxsim_geo.network.tntp_rows import add_value_faults, id_column, number_column, read_rows

#: names of columns and properties that hold a node's id, and its coordinates
ID_NAMES = ("node", "node_id", "nodeid", "id", "no")
X_NAMES = ("x", "xcoord", "x_coord", "lon", "longitude")
Y_NAMES = ("y", "ycoord", "y_coord", "lat", "latitude")

#: longitude, latitude: what GeoJSON is in unless it says otherwise (RFC 7946)
LON_LAT = "EPSG:4326"


@dataclass(frozen=True)
class Coordinates:
    """Where each node is.

    table
        node_id (text, unique), x, y (float64, in units of ``crs``) and row: the line on which the
        node stands, or the number of its feature in GeoJSON
    crs
        None if unknown
    doubts
        why ``crs`` may be the wrong one
    """

    table: pd.DataFrame
    crs: str | None
    doubts: tuple[str, ...] = ()


@dataclass(frozen=True)
class Place:
    """How a fault names a row of the file: by its line, or by its feature in GeoJSON."""

    geojson: bool

    @property
    def noun(self) -> str:
        """What a row of the file is."""
        return "feature" if self.geojson else "line"

    def add(self, faults: Faults, what: str, row: int, column: str, value: str) -> None:
        """Note a fault of one row."""
        if self.geojson:
            faults.add(what, column=f"{column} of feature {row}", value=value)
        else:
            faults.add(what, line=row, column=column, value=value)


def read_coordinates(path: Path, options: TntpOptions, faults: Faults) -> Coordinates | None:
    """Read a node file; None, and at least one fault, where nothing can be made of it."""
    geojson = path.suffix.lower() in (".geojson", ".json")
    read = _read_geojson(path, faults) if geojson else _read_tntp(path, faults)
    if read is None:
        return None
    table, own_crs = read
    place = Place(geojson)
    _add_repeated_node_faults(table, place, faults)
    crs = options.crs or own_crs
    if crs is None:
        faults.add(
            "the reference system of the coordinates must be stated as crs, for instance "
            "EPSG:4326 for longitude and latitude, or none: the file does not say it"
        )
        return None
    if crs.strip().lower() == "none":
        return Coordinates(table, None)
    _add_crs_faults(table, crs, place, faults)
    return Coordinates(table, crs, () if faults.found else _doubts(table, crs))


def _read_tntp(path: Path, faults: Faults) -> tuple[pd.DataFrame, str | None] | None:
    rows = read_rows(path, faults, names=("node", "x", "y"))
    if rows is None:
        return None
    found = [
        next((name for name in names if name in rows.names), "")
        for names in (ID_NAMES, X_NAMES, Y_NAMES)
    ]
    if not all(found):
        faults.add(f"must have the columns node, x and y (columns here: {', '.join(rows.names)})")
        return None
    node, x, y = found
    table = pd.DataFrame({"node_id": id_column(rows, node, faults)})
    for column, name in (("x", x), ("y", y)):
        values = number_column(rows, name, faults)
        add_value_faults(faults, rows, ~np.isfinite(values), name, "must be a finite number")
        table[column] = values
    return table.assign(row=rows.lines), None


def _add_repeated_node_faults(table: pd.DataFrame, place: Place, faults: Faults) -> None:
    again = table[table["node_id"].duplicated()]
    first = table.drop_duplicates("node_id").set_index("node_id")["row"]
    for node_id, row in zip(again["node_id"], again["row"], strict=True):
        what = f"the node stands on {place.noun} {first[node_id]} too"
        place.add(faults, what, int(row), "node", node_id)


def _add_crs_faults(table: pd.DataFrame, crs: str, place: Place, faults: Faults) -> None:
    from pyproj import CRS
    from pyproj.exceptions import CRSError

    try:
        geographic = CRS.from_user_input(crs).is_geographic
    except CRSError:
        faults.add(
            "is not a reference system; write one as EPSG:4326, or none", column="crs", value=crs
        )
        return
    if geographic:
        _add_degree_faults(table, crs, place, faults)


def _doubts(table: pd.DataFrame, crs: str) -> tuple[str, ...]:
    """What speaks against the system: degrees where it has metres, most points off its area."""
    from pyproj import CRS, Transformer

    system = CRS.from_user_input(crs)
    degrees = bool(((table["x"].abs() <= 180) & (table["y"].abs() <= 90)).all())
    if system.is_projected and degrees:
        return (f"coordinates look like degrees, but {crs} has none: is it {LON_LAT}?",)
    area = system.area_of_use
    if area is None:
        return ()
    to_degrees = Transformer.from_crs(system, LON_LAT, always_xy=True)
    x, y = to_degrees.transform(table["x"].to_numpy(), table["y"].to_numpy())
    # an area of use that crosses the date line has its west beyond its east
    width = (area.east - area.west) % 360 or 360
    with np.errstate(invalid="ignore"):  # infinite where the system has no such point
        inside = ((x - area.west) % 360 <= width) & (y >= area.south) & (y <= area.north)
    outside = int((~inside).sum())
    if 2 * outside <= len(x):  # some just beyond its border do no harm
        return ()
    where = f"longitude {area.west:g} to {area.east:g}, latitude {area.south:g} to {area.north:g}"
    return (f"{outside} of {len(x)} nodes lie outside the area of use of {crs} ({where})",)


def _add_degree_faults(table: pd.DataFrame, crs: str, place: Place, faults: Faults) -> None:
    """Longitudes and latitudes that are none: the system is wrong if most are, else the value."""
    beyond = {"x": table["x"].abs() > 360, "y": table["y"].abs() > 90}
    if (beyond["x"] | beyond["y"]).mean() > 0.5:
        faults.add(
            "the coordinates are not longitudes and latitudes, as this system wants them",
            column="crs",
            value=crs,
        )
        return
    for column, what in (("x", "a longitude of 360"), ("y", "a latitude of 90")):
        wrong = table[beyond[column]]
        for row, value in zip(wrong["row"], wrong[column], strict=True):
            place.add(faults, f"is beyond {what} degrees", int(row), column, f"{value:g}")


def _read_geojson(path: Path, faults: Faults) -> tuple[pd.DataFrame, str | None] | None:
    lines = read_lines(path, faults)
    if lines is None:
        return None
    try:
        content = json.loads("\n".join(lines))
    except json.JSONDecodeError as error:
        faults.add(f"is not GeoJSON: {error.msg}", line=error.lineno, column=error.colno)
        return None
    except RecursionError:
        faults.add("is not GeoJSON: nested too deeply")
        return None
    features = content.get("features") if isinstance(content, dict) else None
    if not isinstance(features, list) or not features:
        faults.add("is not a GeoJSON FeatureCollection with features")
        return None
    found = [_point(feature, number, faults) for number, feature in enumerate(features, start=1)]
    points = [point for point in found if point is not None]
    table = pd.DataFrame(points, columns=["node_id", "x", "y", "row"])
    return table.astype({"node_id": "str", "x": "float64", "y": "float64"}), _crs_of(content)


def _crs_of(content: dict[str, Any]) -> str:
    """The system named in the member ``crs`` of old GeoJSON; CRS84 is longitude, latitude."""
    member = content.get("crs")
    properties = member.get("properties") if isinstance(member, dict) else None
    name = properties.get("name") if isinstance(properties, dict) else None
    return LON_LAT if name is None or str(name).endswith("CRS84") else str(name)


def _point(feature: Any, number: int, faults: Faults) -> tuple[str, float, float, int] | None:
    try:
        properties = feature["properties"]
        node_id = next(properties[name] for name in ID_NAMES if name in properties)
        x, y = (float(value) for value in feature["geometry"]["coordinates"][:2])
    except (KeyError, TypeError, ValueError, StopIteration):
        faults.add(
            "must be a Point with the node's number in the property id", column=f"feature {number}"
        )
        return None
    if not (math.isfinite(x) and math.isfinite(y)):
        what = "must have finite coordinates"
        faults.add(what, column=f"feature {number}", value=f"{x:g}, {y:g}")
        return None
    if isinstance(node_id, float) and math.isfinite(node_id) and node_id.is_integer():
        node_id = int(node_id)
    return str(node_id).strip(), x, y, number
