"""Which links a target means: by their ids, by their attributes, by an area, by their street."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.control.site import Target
from uxsim_geo.damage import damage_as_fault
from uxsim_geo.errors import Faults, did_you_mean
from uxsim_geo.network.expressions import add_unknown_texts, rows_where
from uxsim_geo.network.network import Network
from uxsim_geo.network.vector_files import PARQUET, layers_of, read_layer, read_vector_file

#: unknown ids for which those nearest to them are looked for, which takes long in large networks
SUGGESTED = 5

#: stands between the names of links that were joined into one
JOINED_BY = "; "

_PARTS = ("touching", "inside", "entering", "leaving")
_WKT = re.compile(r"\s*((MULTI)?(POINT|LINESTRING|POLYGON)|GEOMETRYCOLLECTION)\b", re.IGNORECASE)

Flags = npt.NDArray[np.bool_]


def select_links(
    network: Network, target: Target, *, link_ids: pd.Index[str] | None = None
) -> npt.NDArray[np.int64]:
    """Return the positions (row numbers) of the links that a target means, in rising order.

    ``link_ids`` are those of the network as an index, for who makes many selections in it.

    All that the target gives must hold: ``links`` and ``where`` and ``polygon`` and ``street``. A
    link leads into a polygon if its geometry starts outside and ends inside; on the border is
    inside.

    Raises :class:`uxsim_geo.errors.InputError` with all that is wrong with the target: unknown ids,
    columns and streets, an expression that cannot be read, or that holds nowhere since no link has
    a text of it, an area that is none or whose reference system is not known.
    """
    faults = Faults()
    meant = np.ones(len(network.links), bool)
    if target.links:
        if link_ids is None:
            link_ids = pd.Index(network.links["link_id"].astype(str))
        meant &= _with_ids(link_ids, target.links, faults)
    if target.where is not None:
        meant &= _fitting(network.links, target.where, faults)
    if target.polygon is not None:
        meant &= _in_area(network, target, faults)
    elif target.part != "touching":
        faults.add("is part of a polygon, and there is none", column="part", value=target.part)
    if target.street is not None:
        meant &= _of_street(network.links, target.street, faults)
    given = (target.links or None, target.where, target.polygon, target.street)
    if all(one is None for one in given):
        faults.add("names no links: give links, where, polygon or street")
    faults.raise_if_any()
    return np.flatnonzero(meant).astype(np.int64)


def _with_ids(link_ids: pd.Index[str], links: tuple[str, ...], faults: Faults) -> Flags:
    wanted = list(dict.fromkeys(links))
    places = link_ids.get_indexer(pd.Index(wanted, dtype=link_ids.dtype))
    for number, place in enumerate(np.flatnonzero(places < 0)):
        advice = did_you_mean(wanted[place], link_ids) if number < SUGGESTED else ""
        what = f"the network has no such link_id{advice}"
        faults.add(what, column="links", value=wanted[place])
    named = np.zeros(len(link_ids), bool)
    named[places[places >= 0]] = True
    return named


def _fitting(links: pd.DataFrame, expression: str, faults: Faults) -> Flags:
    """Return for which links an expression holds."""
    own = Faults()
    holds = rows_where(links, expression, own)
    if not holds.any() and not own.found:
        add_unknown_texts(links, expression, own)
    for fault in own.found:
        faults.add(fault.what, column="where", value=fault.value)
    return holds


def _of_street(links: pd.DataFrame, street: str, faults: Faults) -> Flags:
    """Return which links have the name of a street, alone or among those of joined links.

    Names near to one that none has are told.
    """
    if "name" not in links or links["name"].isna().all():
        faults.add("the links of the network have no names", column="street", value=street)
        return np.zeros(len(links), bool)
    names = links["name"].astype("str").reset_index(drop=True)
    names = names.str.split(JOINED_BY).explode().dropna()
    named = np.zeros(len(links), bool)
    named[names.index[names == street]] = True
    if not named.any():
        what = f"no link has this name{did_you_mean(street, names.unique().tolist())}"
        faults.add(what, column="street", value=street)
    return named


def _in_area(network: Network, target: Target, faults: Faults) -> Flags:
    import shapely

    nowhere = np.zeros(len(network.links), bool)
    if target.part not in _PARTS:
        faults.add(f"must be one of {', '.join(_PARTS)}", column="part", value=target.part)
        return nowhere
    if "geometry" not in network.links.columns:
        what = "the network has no coordinates: choose links by their ids or by where"
        faults.add(what, column="polygon")
        return nowhere
    area = read_area(str(target.polygon), getattr(network.links, "crs", None), faults)
    if area is None:
        return nowhere
    lines = np.asarray(network.links["geometry"])
    shapely.prepare(area)
    if target.part == "touching":
        return np.asarray(shapely.intersects(lines, area), bool)
    if target.part == "inside":
        return np.asarray(shapely.covered_by(lines, area), bool)
    start, end = (shapely.covers(area, points) for points in _end_points(lines))
    entering = target.part == "entering"
    crossing: Flags = ~start & end if entering else start & ~end
    return crossing


def _end_points(lines: npt.NDArray[Any]) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    """Return the first and the last point of each line; none where there is no line."""
    import shapely

    coordinates, line = shapely.get_coordinates(lines, return_index=True)
    numbers = np.arange(len(lines))
    found = np.isin(numbers, line)
    ends = []
    for places in (np.searchsorted(line, numbers), np.searchsorted(line, numbers, "right") - 1):
        points = np.full(len(lines), None, dtype=object)
        points[found] = shapely.points(coordinates[places[found]])
        ends.append(points)
    return ends[0], ends[1]


def read_area(polygon: str, crs: Any, faults: Faults) -> Any:
    """Return the area of a file's polygons, or of WKT, in the system ``crs``; or None and a fault.

    WKT is taken to be in that system already.
    """
    import shapely

    text = _WKT.match(polygon)
    shapes = _from_text(polygon, faults) if text else _from_file(Path(polygon), crs, faults)
    if shapes is None:
        return None
    for shape in shapes:
        if not shapely.is_valid(shape):
            what = f"is no valid polygon ({shapely.is_valid_reason(shape)}); mend its outline"
            faults.add(what, column="polygon", value=polygon)
            return None
    return shapely.union_all(shapes)


def _from_text(text: str, faults: Faults) -> npt.NDArray[Any] | None:
    import shapely

    try:
        shape = shapely.from_wkt(text)
    except shapely.errors.ShapelyError as error:
        faults.add(f"is no WKT: {error}", column="polygon", value=text)
        return None
    if shape.geom_type not in ("Polygon", "MultiPolygon") or shape.is_empty:
        what = "must be a POLYGON or MULTIPOLYGON with an area"
        faults.add(what, column="polygon", value=text)
        return None
    return np.array([shape], dtype=object)


def _from_file(path: Path, crs: Any, faults: Faults) -> npt.NDArray[Any] | None:
    """Return the polygons of all layers of a file, in the reference system of the network."""
    layers, what = _polygon_layers(path)
    if not what and not layers:
        what = "holds no polygon"
    if not what and crs is None:
        what = (
            "cannot be laid over the network, whose reference system is not known: give the "
            "polygon as WKT in the network's coordinates"
        )
    if not what and any(layer.crs is None for layer in layers):
        what = "does not say its reference system: write it into the file"
    if what:
        faults.add(what, column="polygon", value=str(path))
        return None
    own = Faults()
    with damage_as_fault(own, "cannot be brought to the network's reference system"):
        return np.concatenate([layer.to_crs(crs).geometry.to_numpy() for layer in layers])
    faults.add(own.found[0].what, column="polygon", value=str(path))
    return None


def _polygon_layers(path: Path) -> tuple[list[Any], str]:
    """Return a table of the polygons of each layer that has some, and why they cannot be read."""
    if not path.is_file():
        return [], "is neither WKT nor a file that is there"
    own = Faults()
    if path.suffix.lower() in PARQUET:
        tables: list[Any] = [read_vector_file(path, None, own)]
    else:
        names = [name for name, shape in layers_of(path, own).items() if shape is not None]
        tables = [read_layer(path, name, own, columns=[]) for name in names]
    if own.found:
        return [], own.found[0].what
    areas = [table[table.geom_type.isin(("Polygon", "MultiPolygon"))] for table in tables]
    return [area for area in areas if len(area)], ""
