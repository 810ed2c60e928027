"""From where links come to their ends: compass bearings in any reference system."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pandas as pd

Floats = npt.NDArray[np.float64]
Lines = npt.NDArray[Any]

EARTH_RADIUS = 6_371_008.8  # m, mean


def arrival_bearings(links: pd.DataFrame, look_back: float) -> Floats:
    """The direction in which each link arrives at its end, degrees clockwise from north, (links,).

    That of the chord over the last ``look_back`` m, or over the whole link where it is shorter:
    the very last piece of a line is often a metre long and drawn anyhow. Rounded to a hundredth,
    so that no noise decides between equal angles. NaN where the line is missing, no LineString,
    has coordinates that are not finite, or ends where the chord begins.

    North is that of the reference system; degrees are turned into metres about each link's end.
    """
    bearings = np.full(len(links), np.nan)
    if "geometry" not in links.columns:
        return bearings
    import shapely

    lines = np.asarray(links["geometry"], dtype=object)
    rows = np.flatnonzero(_usable(lines))
    if not len(rows):
        return bearings
    local = _about_ends(lines[rows], getattr(links["geometry"], "crs", None))
    back = shapely.line_interpolate_point(local, -look_back)
    east, north = -shapely.get_x(back), -shapely.get_y(back)
    angle = np.round(np.degrees(np.arctan2(east, north)), 2) % 360.0
    bearings[rows] = np.where(np.hypot(east, north) > 0.0, angle, np.nan)
    return bearings


def _usable(lines: Lines) -> npt.NDArray[np.bool_]:
    """Which are lines with coordinates, all of them finite."""
    import shapely

    usable = shapely.get_type_id(lines) == shapely.GeometryType.LINESTRING
    usable &= ~shapely.is_empty(lines)
    coordinates, line = shapely.get_coordinates(lines, return_index=True)
    usable[line[~np.isfinite(coordinates).all(axis=1)]] = False
    return np.asarray(usable, dtype=bool)


def _about_ends(lines: Lines, crs: Any) -> Lines:
    """The lines in metres east and north of their own ends."""
    import shapely

    coordinates, line = shapely.get_coordinates(lines, return_index=True)
    last = np.searchsorted(line, np.arange(len(lines)), side="right") - 1
    unit = crs.axis_info[0].unit_conversion_factor if crs is not None else 1.0
    offset = (coordinates - coordinates[last][line]) * unit
    if crs is not None and crs.is_geographic:
        latitude = coordinates[last, 1][line] * unit
        across = (offset[:, 0] + np.pi) % (2.0 * np.pi) - np.pi  # over the date line too
        offset = EARTH_RADIUS * np.column_stack([across * np.cos(latitude), offset[:, 1]])
    return np.asarray(shapely.linestrings(offset, indices=line), dtype=object)
