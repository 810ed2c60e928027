"""What is asked of OpenStreetMap's servers: the roads of some classes in a place, a box, a polygon.

The question is written in Overpass QL
(https://wiki.openstreetmap.org/wiki/Overpass_API/Overpass_QL).
"""

from __future__ import annotations

import hashlib
import json
import math
import re
import unicodedata
from dataclasses import dataclass
from typing import Any

from uxsim_geo.errors import Faults
from uxsim_geo.network.osm_options import PUBLIC_ROADS, ROAD_CLASSES

#: coordinates of a polygon beyond which servers are not asked
MOST_POINTS = 20_000

#: decimals of degrees in questions and keys, as many as OpenStreetMap has
DECIMALS = 7


@dataclass(frozen=True)
class OsmQuery:
    """Which roads: in exactly one of place, bbox and polygon.

    place
        text for the geocoder, as ``Monaco``; it must know an area of that name, not a point alone
    bbox
        west, south, east, north, degrees (EPSG:4326)
    polygon
        path of a GeoPackage or GeoJSON file, all of whose polygons count, or WKT in EPSG:4326
    road_classes
        values of the tag highway
    """

    place: str | None = None
    bbox: tuple[float, ...] | None = None
    polygon: str | None = None
    road_classes: tuple[str, ...] = PUBLIC_ROADS

    def __post_init__(self) -> None:
        faults = Faults("roads from OpenStreetMap")
        given = [name for name in ("place", "bbox", "polygon") if getattr(self, name) is not None]
        if len(given) != 1:
            told = " and ".join(given) or "none of them is given"
            faults.add(f"exactly one of place, bbox and polygon is needed: {told}")
        if self.place is not None and not self.place.strip():
            faults.add("must not be empty", column="place")
        if self.bbox is not None:
            _check_bbox(self.bbox, faults)
        unknown = [name for name in self.road_classes if name not in ROAD_CLASSES]
        if unknown or not self.road_classes:
            what = f"must be some of {', '.join(ROAD_CLASSES)}"
            faults.add(what, column="road_classes", value=", ".join(unknown))
        faults.raise_if_any()

    def __str__(self) -> str:
        if self.place is not None:
            return f"place {self.place}"
        if self.bbox is not None:
            return f"bbox {', '.join(f'{degrees:g}' for degrees in self.bbox)}"
        told = str(self.polygon)
        return f"polygon {told if len(told) <= 60 else told[:59] + '…'}"

    def area(self) -> Any:
        """The shape of bbox or polygon, EPSG:4326; raises InputError where it is none."""
        import shapely

        if self.bbox is not None:
            return shapely.box(*self.bbox)
        faults = Faults(str(self))
        area = read_area_in_degrees(str(self.polygon), faults)
        faults.raise_if_any()
        return area

    def described(self) -> dict[str, Any]:
        """All that the answer depends on beside the map itself, as JSON can hold it."""
        import shapely

        told: dict[str, Any] = {"road_classes": sorted(self.road_classes)}
        if self.place is not None:
            return told | {"place": " ".join(self.place.split())}
        if self.bbox is not None:
            return told | {"bbox": [round(float(degrees), DECIMALS) for degrees in self.bbox]}
        area = shapely.normalize(self.area())
        return told | {"polygon": shapely.to_wkt(area, rounding_precision=DECIMALS)}

    def file_name(self) -> str:
        """The same for the same question: a word to know it by, and 12 digits of its SHA-256."""
        told = self.described()
        text = json.dumps(told, sort_keys=True, ensure_ascii=False)
        if self.place is not None:
            text = text.casefold()
        digest = hashlib.sha256(text.encode("utf-8", errors="replace")).hexdigest()
        return f"{_word(self)}-{digest[:12]}.osm.gz"


def read_area_in_degrees(polygon: str, faults: Faults) -> Any:
    """The area of a file or of WKT in EPSG:4326, or None and a fault."""
    from uxsim_geo.network.selection import read_area

    area = read_area(polygon, "EPSG:4326", faults)
    if area is not None and (area.is_empty or not area.area > 0):
        faults.add("has no area", column="polygon")
    elif area is not None:
        _check_bounds(area.bounds, "polygon", faults)
    return area


def overpass_question(area: Any, road_classes: tuple[str, ...], timeout_s: float) -> str:
    """Ways of these classes in an area (EPSG:4326), their nodes, and restrictions on turning there.

    Roads that reach out of the area come whole. Holes of the area count as part of it: Overpass
    knows outlines alone.
    """
    classes = "|".join(sorted(road_classes))
    ways = "".join(
        f'way["highway"~"^({classes})$"](poly:"{outline}");' for outline in _outlines(area)
    )
    return (
        f"[out:json][timeout:{math.ceil(timeout_s)}];({ways})->.roads;"
        '(.roads;node(w.roads);rel(bw.roads)["type"~"^restriction"];);out body;'
    )


def _outlines(area: Any) -> list[str]:
    """Latitude and longitude of the corners of each part, as Overpass wants them."""
    import shapely

    if shapely.get_num_coordinates(area) > MOST_POINTS:
        faults = Faults("roads from OpenStreetMap")
        what = f"the outline has more than {MOST_POINTS:,} corners; give a simpler polygon or bbox"
        faults.add(what, value=int(shapely.get_num_coordinates(area)))
        faults.raise_if_any()
    parts = shapely.get_parts(area)
    corners = [shapely.get_coordinates(part.exterior).tolist() for part in parts]
    return [" ".join(f"{y:.{DECIMALS}f} {x:.{DECIMALS}f}" for x, y in part) for part in corners]


def area_km2(area: Any) -> float:
    """The size of an area in EPSG:4326 on the WGS 84 ellipsoid, km²."""
    import pyproj
    import shapely

    # seen from above, the outline must run against the clock for an area above 0
    oriented = shapely.orient_polygons(area)
    square_metres, _ = pyproj.Geod(ellps="WGS84").geometry_area_perimeter(oriented)
    return abs(float(square_metres)) / 1e6


def _check_bbox(bbox: tuple[float, ...], faults: Faults) -> None:
    order = "must be four numbers: west, south, east, north, in degrees"
    if len(bbox) != 4:
        faults.add(order, column="bbox", value=len(bbox))
        return
    if not all(map(math.isfinite, bbox)):
        faults.add(order, column="bbox")
        return
    west, south, east, north = bbox
    if not (west < east and south < north):
        what = f"{order}; west < east and south < north (areas across 180° need two runs)"
        faults.add(what, column="bbox", value=", ".join(map(str, bbox)))
    _check_bounds(bbox, "bbox", faults)


def _check_bounds(bounds: tuple[float, ...], column: str, faults: Faults) -> None:
    west, south, east, north = bounds
    if not (-180 <= west <= east <= 180 and -90 <= south <= north <= 90):
        what = "must lie within 180 and 90 degrees: longitude first, EPSG:4326"
        faults.add(what, column=column, value=", ".join(f"{degrees:g}" for degrees in bounds))


def _word(query: OsmQuery) -> str:
    """A short name in plain letters."""
    if query.place is None:
        return "bbox" if query.bbox is not None else "polygon"
    plain = unicodedata.normalize("NFKD", query.place).encode("ascii", "ignore").decode().lower()
    return re.sub(r"[^a-z0-9]+", "_", plain)[:40].strip("_") or "place"
