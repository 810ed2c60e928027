"""Lines as text (WKT): read with a reason where it is none, written so that no bit is lost."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from uxsim_geo.network.exact import float_text

#: anything else is refused unread: a parser may run out of stack in nested collections
LINE = re.compile(r"\s*(MULTI)?LINESTRING\b", re.IGNORECASE)

NO_LINE = "must be a LINESTRING in WKT"

Lines = npt.NDArray[np.object_]


def parse_lines(texts: Sequence[str]) -> tuple[Lines, dict[int, str]]:
    """Lines (None where a text is blank or none), and by position what is wrong with the others."""
    import shapely

    lines = np.full(len(texts), None, dtype=object)
    wrong: dict[int, str] = {}
    filled = [place for place, text in enumerate(texts) if text and not text.isspace()]
    looked = [place for place in filled if LINE.match(texts[place])]
    wrong |= dict.fromkeys(sorted(set(filled) - set(looked)), NO_LINE)
    with np.errstate(over="ignore", invalid="ignore"):
        lines[looked] = shapely.from_wkt([texts[place] for place in looked], on_invalid="ignore")
    joined, reasons = joined_lines(lines)
    wrong |= {place: reasons.get(place, NO_LINE) for place in looked if joined[place] is None}
    return joined, wrong


def joined_lines(lines: Lines) -> tuple[Lines, dict[int, str]]:
    """One LineString each, with the reason by position where there is none to be had.

    Parts of a MultiLineString must follow one another, end to end. Lines need two points or more,
    all of them finite. None stays None, without a reason.
    """
    import shapely

    found = np.array(lines, dtype=object)
    wrong: dict[int, str] = {}
    kinds = shapely.get_type_id(found)
    empty = np.flatnonzero(shapely.is_empty(found)).tolist()
    wrong |= dict.fromkeys(empty, "is a line without a point")
    for place in np.flatnonzero(kinds == shapely.GeometryType.MULTILINESTRING).tolist():
        found[place] = _joined(found[place])
        if found[place] is None:
            wrong.setdefault(place, "has parts that do not join into one line")
    strange = ~np.isin(kinds, (-1, shapely.GeometryType.LINESTRING))
    strange &= kinds != shapely.GeometryType.MULTILINESTRING
    wrong |= dict.fromkeys(np.flatnonzero(strange).tolist(), "is not a line")
    places, line = shapely.get_coordinates(found, return_index=True)
    endless = np.unique(line[~np.isfinite(places).all(axis=1)])
    what = "has a coordinate that is not a finite number"
    wrong |= {place: what for place in endless.tolist() if place not in wrong}
    found[list(wrong)] = None
    return found, wrong


def _joined(parts: Any) -> Any:
    """One line of a MultiLineString whose parts meet, in their direction if it is one."""
    import shapely

    if len(parts.geoms) < 2:
        return parts.geoms[0] if len(parts.geoms) else None
    for directed in (True, False):
        line = shapely.line_merge(parts, directed=directed)
        if line.geom_type == "LineString" and not line.is_empty:
            return line
    return None


def line_texts(lines: Lines) -> list[str]:
    """WKT whose numbers read back as the same floats; empty where there is no line.

    Shapely's own writer rounds some of them away.
    """
    import shapely

    texts = [""] * len(lines)
    for with_z in (False, True):
        own = np.flatnonzero(~shapely.is_missing(lines) & (shapely.has_z(lines) == with_z))
        places, line = shapely.get_coordinates(lines[own], include_z=with_z, return_index=True)
        numbers = [" ".join(map(float_text, point)) for point in places.tolist()]
        first = np.searchsorted(line, np.arange(len(own) + 1)).tolist()
        kind = "LINESTRING Z" if with_z else "LINESTRING"
        for place, begin, end in zip(own.tolist(), first[:-1], first[1:], strict=True):
            texts[place] = f"{kind} ({', '.join(numbers[begin:end])})"
    return texts
