"""Metres between coordinates of any reference system, never in degrees.

Where the system lies on the earth, distances are those on its ellipsoid: a map's own scale, which
in Web Mercator is 35 % off in Boston, does not enter. Elsewhere they are plane, in its unit.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from uxsim_geo.errors import Faults

if TYPE_CHECKING:
    from pyproj import CRS

Floats = npt.NDArray[np.float64]


def parse_crs(text: str, faults: Faults) -> CRS | None:
    """The reference system that a text names; None for ``none``, and with a fault."""
    from pyproj import CRS
    from pyproj.exceptions import CRSError

    if text.strip().lower() == "none":
        return None
    try:
        return CRS.from_user_input(text)
    except CRSError:
        what = "is not a reference system; write one as EPSG:4326, or none"
        faults.add(what, column="crs", value=text)
        return None


def distances(first: Floats, second: Floats, crs: CRS | None) -> Floats:
    """Metres between points, shape (points, 2) each, beside one another; without a CRS, units."""
    geodetic = None if crs is None else crs.geodetic_crs
    if geodetic is None:
        apart: Floats = np.hypot(*(first - second).T)
        return apart * _plane_unit(crs)
    ends = [longitudes_and_latitudes(points, crs) for points in (first, second)]
    geod = geodetic.get_geod()
    assert geod is not None, "a geodetic system has an ellipsoid"
    metres = geod.inv(*ends[0], *ends[1])[2]
    return np.asarray(metres, dtype=np.float64)


def line_lengths(lines: npt.NDArray[np.object_], crs: CRS | None) -> Floats:
    """Metres along each line (shapely); NaN where there is none. Without a CRS, in its units."""
    import shapely

    places, line = shapely.get_coordinates(lines, return_index=True)
    within = line[1:] == line[:-1]
    steps = distances(places[:-1][within], places[1:][within], crs)
    lengths = np.bincount(line[1:][within], steps, minlength=len(lines)).astype(np.float64)
    there = np.bincount(line, minlength=len(lines)) > 0
    return np.where(there, lengths, np.nan)


def metric_places(points: Floats, crs: CRS | None) -> Floats:
    """Where points are in metres, such that near ones are as far apart as on the ground.

    On the earth: from its centre, shape (points, 3); elsewhere in the plane, (points, 2).
    """
    geodetic = None if crs is None else crs.geodetic_crs
    if geodetic is None:
        return points * _plane_unit(crs)
    geod = geodetic.get_geod()
    assert geod is not None, "a geodetic system has an ellipsoid"
    east, north = (np.radians(one) for one in longitudes_and_latitudes(points, crs))
    radius = geod.a / np.sqrt(1.0 - geod.es * np.sin(north) ** 2)
    flat = radius * np.cos(north)
    up = radius * (1.0 - geod.es) * np.sin(north)
    return np.column_stack([flat * np.cos(east), flat * np.sin(east), up])


def _plane_unit(crs: CRS | None) -> float:
    """Metres in one unit of the axes; 1 where nothing is known."""
    return 1.0 if crs is None else float(crs.axis_info[0].unit_conversion_factor)


def longitudes_and_latitudes(points: Floats, crs: CRS | None) -> tuple[Floats, Floats]:
    """Degrees on the system's own ellipsoid, so that no change of datum enters."""
    from pyproj import Transformer

    assert crs is not None, "asked for systems that lie on the earth"
    if crs.is_geographic:
        return points[:, 0].copy(), points[:, 1].copy()
    to_degrees = Transformer.from_crs(crs, crs.geodetic_crs, always_xy=True)
    x, y = to_degrees.transform(points[:, 0], points[:, 1])
    return np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)


def add_degree_faults(points: Floats, crs: CRS | None, faults: Faults) -> None:
    """Note coordinates that cannot be longitudes and latitudes in a system that wants these."""
    if crs is None or not crs.is_geographic:
        return
    beyond = np.flatnonzero((np.abs(points[:, 0]) > 360) | (np.abs(points[:, 1]) > 90))
    if len(beyond):
        x, y = points[beyond[0]]
        faults.add(
            f"{len(beyond)} of {len(points)} points are not at a longitude and latitude, as this "
            f"system wants them, the first of them at {x:g}, {y:g}",
            column="crs",
            value=crs.to_string(),
        )


def crs_doubt(points: Floats, crs: CRS | None) -> str | None:
    """What speaks against the system: degrees where it has metres; None if nothing does."""
    if crs is None or not crs.is_projected or not len(points):
        return None
    if (np.abs(points) > [180, 90]).any():
        return None
    return f"coordinates look like degrees, but {crs.to_string()} has none: is it EPSG:4326?"
