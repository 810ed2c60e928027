"""Is this an OpenStreetMap file, and safe to open? Looked at before anything is parsed.

The format must be what the name says. XML may declare no document type and no entities, a packed
file may not unpack to more than is allowed, and the blocks of a PBF file must all be there: what
they unpack to is written in front of each, and osmium refuses a block that does not keep to it.
"""

from __future__ import annotations

import bz2
import gzip
import re
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, cast

from uxsim_geo.errors import Faults

#: ends of names, and osmium's words for what lies behind them
_NAME = re.compile(r".*\.(?:(?:osm|xml)(?P<packed>\.gz|\.bz2)?|(?P<pbf>pbf))", re.IGNORECASE)

ENDINGS = ".osm, .xml (each also with .gz or .bz2 after it) or .pbf"

#: osmium's words in people's
WORDS = {"xml": "plain XML", "xml.gz": "packed by gzip", "xml.bz2": "packed by bzip2", "pbf": "PBF"}

#: what files begin with
_GZIP, _BZIP2 = b"\x1f\x8b", b"BZh"
_PBF_HEADER = b"\x0a\x09OSMHeader"

#: bytes at the start of XML within which the element <osm> must open
_HEAD = 65_536

#: bytes read at once
_BLOCK = 1 << 20

#: a coordinate with an exponent so large that osmium takes it for 0
_ENORMOUS = re.compile(rb"\bl(?:at|on)\s*=\s*[\"'][0-9.+-]{0,30}[eE][+-]?[0-9]{3}")

#: of a packed file's size, if the options do not say how much it may unpack to
_RATIO = 100
_LEAST_BYTES = 32_000_000

#: limits of the PBF format, bytes
_LARGEST_BLOB_HEADER, _LARGEST_BLOB = 65_536, 33_554_432


def checked_format(path: Path, max_unpacked_mb: float | None, faults: Faults) -> str | None:
    """Osmium's name of the file's format, or None with faults that say why it is not read."""
    start = _start(path, faults)
    written = None if start is None else _format_by_name(path, start, faults)
    if written is None:
        return None
    limit = max(_LEAST_BYTES, _RATIO * path.stat().st_size)
    if max_unpacked_mb is not None:
        limit = int(max_unpacked_mb * 1e6)
    check = _check_pbf if written == "pbf" else _check_xml
    try:
        check(path, written, limit, faults)
    except (OSError, EOFError, zlib.error, ValueError) as error:
        faults.add(f"cannot be unpacked, it is damaged or cut off: {error}")
    return None if faults.found else written


def _start(path: Path, faults: Faults) -> bytes | None:
    """The first bytes of the file, or None with a fault."""
    try:
        if path.exists() and not path.is_file():
            faults.add("is a folder or a device, a file was expected")
            return None
        with path.open("rb") as file:
            start = file.read(32)
    except FileNotFoundError:
        faults.add("there is no such file")
        return None
    except (OSError, ValueError) as error:
        faults.add(f"cannot be read: {error}")
        return None
    if not start:
        faults.add("is empty: is it the right file?")
    return start or None


def _format_by_name(path: Path, start: bytes, faults: Faults) -> str | None:
    """The format that the name promises, or None with a fault if the content is another."""
    named = _NAME.fullmatch(path.name)
    if named is None:
        faults.add(f"is not named as an OpenStreetMap file: its name must end in {ENDINGS}")
        return None
    written = "pbf" if named["pbf"] else "xml" + (named["packed"] or "").lower()
    found = _format_of(start)
    if found is None:
        faults.add(
            "is no OpenStreetMap file, neither XML (also packed) nor PBF: is it the right file?"
        )
    elif found != written:
        what = f"is {WORDS[found]}, and its name says {WORDS[written]}: name it as it is"
        faults.add(f"{what} ({ENDINGS})")
    return None if faults.found else written


def _format_of(start: bytes) -> str | None:
    if start.startswith(_GZIP):
        return "xml.gz"
    if start.startswith(_BZIP2):
        return "xml.bz2"
    if start[4:].startswith(_PBF_HEADER):
        return "pbf"
    text = start.removeprefix(b"\xef\xbb\xbf").lstrip()
    return "xml" if text.startswith(b"<") or b"\0" in start[:4] or not text else None


def _check_xml(path: Path, written: str, limit: int, faults: Faults) -> None:
    """No document type or entities, the right element, and no more bytes than ``limit``."""
    with _opened(path, written) as file:
        block = file.read(_HEAD)
        _check_head(block, faults)
        unpacked, before = 0, b""
        while block and not faults.found:
            unpacked += len(block)
            if unpacked > limit and written != "xml":
                _add_too_large(limit, faults)
            found = _ENORMOUS.search(before + block)
            if found:
                what = "has a coordinate that is none"
                faults.add(what, value=found[0].decode("ascii", errors="replace"))
            before, block = block[-100:], file.read(_BLOCK)


def _opened(path: Path, written: str) -> BinaryIO:
    if written == "xml":
        return path.open("rb")
    return cast(BinaryIO, gzip.GzipFile(path) if written == "xml.gz" else bz2.BZ2File(path))


def _check_head(head: bytes, faults: Faults) -> None:
    if b"\0" in head:
        faults.add("is not XML in UTF-8")
    elif re.search(rb"<!\s*(DOCTYPE|ENTITY)", head, re.IGNORECASE):
        faults.add("declares a document type or entities, which no OpenStreetMap file needs")
    elif re.search(rb"<osmChange[\s>]", head):
        faults.add("is a file of changes (osmChange); a file of the map itself is needed")
    elif not re.search(rb"<osm[\s/>]", head):
        faults.add("is not an OpenStreetMap file: the element <osm> is not at its start")


def _add_too_large(limit: int, faults: Faults) -> None:
    faults.add(
        f"unpacks to more than {limit / 1e6:g} MB, which is far more than such files do; "
        "if it is to be trusted, set max_unpacked_mb to what it needs"
    )


def _check_pbf(path: Path, _written: str, limit: int, faults: Faults) -> None:
    """Every block complete, and no more bytes unpacked than ``limit``."""
    unpacked = 0
    with path.open("rb") as file:
        while size := file.read(4):
            header_size = int.from_bytes(size, "big")
            if header_size > _LARGEST_BLOB_HEADER:
                raise ValueError("a block's header is larger than the format allows")
            blob_size = dict(_fields(_read(file, header_size))).get(3)
            if not isinstance(blob_size, int) or blob_size > _LARGEST_BLOB:
                raise ValueError("a block is larger than the format allows")
            fields = dict(_fields(_read(file, blob_size)))
            raw_size = fields.get(2, blob_size)
            unpacked += raw_size if isinstance(raw_size, int) else blob_size
            if unpacked > limit:
                _add_too_large(limit, faults)
                return


def _read(file: BinaryIO, size: int) -> memoryview:
    data = file.read(size)
    if len(data) < size:
        raise EOFError("the last block is not complete")
    return memoryview(data)


def _fields(message: memoryview) -> Iterator[tuple[int, int | memoryview]]:
    """Numbers of the fields of a protocol buffer, with their integers or bytes."""
    position = 0
    while position < len(message):
        key, position = _varint(message, position)
        if key & 7 == 0:
            value, position = _varint(message, position)
            yield key >> 3, value
        elif key & 7 == 2:
            size, position = _varint(message, position)
            yield key >> 3, message[position : position + size]
            position += size
        else:
            raise ValueError("a block is not written as the format wants it")
    if position > len(message):
        raise EOFError("a block is not complete")


def _varint(message: memoryview, position: int) -> tuple[int, int]:
    value = shift = 0
    while position < len(message) and shift < 64:
        byte = message[position]
        position += 1
        value |= (byte & 127) << shift
        if byte < 128:
            return value, position
        shift += 7
    raise ValueError("a block is not written as the format wants it")
