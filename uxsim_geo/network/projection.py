"""A reference system in metres for the network, chosen from where it lies.

Lengths are columns of the links and stay as they are: a plane map stretches them by up to 0.04 %
within a zone of the UTM grid and by more beyond it, geodesic lengths do not change.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from uxsim_geo.network.incidence import Floats
from uxsim_geo.network.network import Network
from uxsim_geo.network.notes import Notes

#: degrees of longitude from the middle of a zone beyond which its map is stretched by over 0.4 %
WIDEST = 6.0

#: decimals of coordinates in metres: the last bits may differ between machines
DECIMALS = 3

#: degrees of latitude of the UTM grid; beyond them the polar systems begin
NORTHMOST, SOUTHMOST = 84.0, -80.0


def project(network: Network, crs: str | None, notes: Notes) -> Network:
    """Put the geometry into ``crs``; None: the UTM zone in whose middle the network lies.

    A network whose system is in metres already keeps it unless ``crs`` asks for another; one
    without geometry, or without a known system, stays as it is. Coordinates are rounded to 1 mm.
    """
    own = getattr(network.links, "crs", None)
    if own is None:
        notes.add("projection", "no geometry, or of no known system: left as it is")
        return network
    if crs is None and in_metres(own):
        notes.add("projection", "is in metres already: left as it is", value=own.to_string())
        return network
    degrees = lon_lat(network.nodes["geometry"])
    chosen = crs or utm_zone(degrees)
    if crs is None:
        _note_width(degrees, chosen, notes)
    notes.add("projection", "geometry put into this system; lengths unchanged", value=chosen)
    nodes, links = (_projected(table, chosen) for table in (network.nodes, network.links))
    return replace(network, nodes=nodes, links=links)


def in_metres(crs: Any) -> bool:
    """Whether a system is a plane one with metres on its axes."""
    return bool(crs.is_projected) and crs.axis_info[0].unit_conversion_factor == 1.0


def lon_lat(shapes: Any) -> Floats:
    """Longitude and latitude of the points of shapes (a GeoSeries of a known system); (n, 2)."""
    import shapely

    return np.asarray(shapely.get_coordinates(shapes.to_crs("EPSG:4326").to_numpy()))


def metres_around(shapes: Any) -> Any:
    """The system in metres for shapes (a GeoSeries): of their UTM zone, or of their pole."""
    from pyproj import CRS

    return CRS.from_user_input(utm_zone(lon_lat(shapes)))


def utm_zone(degrees: Floats) -> str:
    """The zone of the UTM grid around the middle of points, ``EPSG:326..`` north, ``327..`` south.

    The middle is halfway between the outermost longitudes, the widest gap between them left out:
    points on both sides of the 180th meridian have theirs there.
    """
    middle, latitude = _middle(degrees[:, 0]), float(np.median(degrees[:, 1]))
    if latitude > NORTHMOST:
        return "EPSG:32661"
    if latitude < SOUTHMOST:
        return "EPSG:32761"
    zone = int((middle + 180.0) // 6.0) % 60 + 1
    return f"EPSG:{(32600 if latitude >= 0 else 32700) + zone}"


def _middle(longitude: Floats) -> float:
    """Halfway between the outermost longitudes, within -180 to 180."""
    west, width = _span(longitude)
    return (west + width / 2.0 + 180.0) % 360.0 - 180.0


def _span(longitude: Floats) -> tuple[float, float]:
    """The westmost longitude and how far it is from there eastward to the last, degrees."""
    around = np.unique(longitude % 360.0)
    gaps = np.diff(around, append=around[0] + 360.0)
    widest = int(np.argmax(gaps))
    return float(around[(widest + 1) % len(around)]), 360.0 - float(gaps[widest])


def _note_width(degrees: Floats, chosen: str, notes: Notes) -> None:
    _, width = _span(degrees[:, 0])
    if width > 2 * WIDEST:
        note = (
            f"is {width:.1f} degrees wide, more than a zone shows without distortion: the map is "
            "stretched at its sides, lengths are not; a system of your own can be given"
        )
        notes.add("projection", note, severity="warning", value=chosen)


def _projected(table: Any, crs: str) -> pd.DataFrame:
    """The table in another system, with coordinates rounded to 1 mm."""
    import shapely

    table = table.to_crs(crs)
    shapes = shapely.transform(table.geometry.to_numpy(), lambda xy: np.round(xy, DECIMALS))
    rounded: pd.DataFrame = table.set_geometry(shapes, crs=table.crs)
    return rounded
