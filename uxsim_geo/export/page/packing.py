"""Numbers and text as they lie in the page: deltas, gzip, base64.

Browsers unpack gzip themselves (DecompressionStream). Neighbours in time or along a line differ
little, so their differences are small numbers, and those compress well. Text goes the same way:
whatever a name holds, quotes, tags or emoji, it is no HTML until a script writes it as text.
"""

from __future__ import annotations

import base64
import json
import zlib
from typing import Any

import numpy as np
import numpy.typing as npt

#: degrees between two neighbouring places that the page can tell apart, half a metre or less
DEGREES = 5e-6


#: for zlib: the header and trailer of gzip, without a time or name
_AS_GZIP = 31


def packed(content: bytes, level: int = 6) -> str:
    """Bytes, gzipped and in base64; the same bytes give the same text.

    With ``gzip.compress`` the header would tell one version of Python from another.
    """
    return base64.b64encode(zlib.compress(content, level, wbits=_AS_GZIP)).decode("ascii")


def packed_json(value: object) -> str:
    """A document of plain values; raises ValueError for numbers that JSON lacks, as NaN."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return packed(text.encode("utf-8"))


def packed_rows(codes: npt.NDArray[Any]) -> str:
    """Unsigned integers of 8 or 16 bits, shape (rows, columns), as differences along the rows.

    Differences wrap round, so that they need no more bits; the first column is kept.
    """
    little_endian = np.ascontiguousarray(codes).astype(codes.dtype.newbyteorder("<"))
    return packed(_differences(little_endian).tobytes())


def _differences(codes: npt.NDArray[Any]) -> npt.NDArray[Any]:
    differences = codes.copy()
    differences[:, 1:] -= codes[:, :-1]
    return differences


def packed_numbers(values: npt.NDArray[Any]) -> str:
    """Numbers of any size, exact to one in 60,000, NaN too: the upper 24 bits of a float32.

    The three bytes of all of them stand apart, all lowest ones first.
    """
    bits = np.ascontiguousarray(values, "<f4").ravel().view("<u4")
    rounded = np.where(np.isnan(values).ravel(), np.uint32(0x7FC00000), bits + np.uint32(0x80))
    planes = np.ascontiguousarray(rounded >> np.uint32(8), "<u4").view(np.uint8).reshape(-1, 4)
    return packed(np.ascontiguousarray(planes[:, :3].T).tobytes())


def packed_lines(lines: npt.NDArray[Any]) -> tuple[str, str]:
    """Lines in degrees: how many points each has (uint32), and differences of their places.

    Places are whole multiples of :data:`DEGREES`. Every place is told by its difference from the
    place before it, x and y in turn, over all lines as if they were one; the four bytes of these
    int32 stand apart, all lowest ones first.
    """
    import shapely

    points = shapely.get_num_points(lines).astype("<u4")
    places = np.round(shapely.get_coordinates(lines) / DEGREES).astype("<i4")
    differences = np.diff(places, axis=0, prepend=np.zeros((1, 2), "<i4")).astype("<i4")
    planes = differences.reshape(-1, 1).view(np.uint8).T
    return packed(points.tobytes()), packed(np.ascontiguousarray(planes).tobytes())
