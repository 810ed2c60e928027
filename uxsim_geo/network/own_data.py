"""Does a map file hold its own data? GDAL opens a file by its content, whatever it is called.

Some of its formats are a few lines of text that say where the data are: in other files, or on a
server. A file that came from somebody else must not make a run read what its user did not name.
"""

from __future__ import annotations

from pathlib import Path

from uxsim_geo.errors import Faults

#: what files with data of their own begin with
_BEGINNINGS = {
    "GeoPackage": b"SQLite format 3\0",
    "shapefile": b"\0\0\x27\x0a",
    "FlatGeobuf": b"fgb",
}

#: bytes that GDAL looks at, and some more
_HEAD = 1 << 20

#: in JSON that is no data but commands of GDAL
_COMMANDS = b"gdal_streamed_alg"


def holds_own_data(path: Path, faults: Faults) -> bool:
    """Tell whether GDAL would read a file as data and nothing else; if not, there is a fault.

    What is no file, or cannot be read, is left to GDAL, which says what is wrong with it.
    """
    if not path.is_file():
        return True
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except OSError:
        return True
    if head.startswith(tuple(_BEGINNINGS.values())) or _is_geojson(head):
        return True
    kinds = ", ".join(_BEGINNINGS)
    what = "cannot be read as a table, it holds no data that are read here"
    faults.add(f"{what}: convert it to {kinds} or GeoJSON")
    return False


def _is_geojson(head: bytes) -> bool:
    text = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    return text.startswith(b"{") and _COMMANDS not in head
