"""Is an HDF5 file safe to open? HDF5 itself takes on trust what would keep it busy for ever.

A global heap holds texts of any length: objects one after the other, each with its size, and free
space at the end as object 0. HDF5 steps over them by their sizes, and never ends at free space of
size 0 (H5HG, and the file format specification, III.E).
"""

from __future__ import annotations

import mmap
from collections.abc import Iterator
from pathlib import Path

_SIGNATURE = b"GCOL\x01\0\0\0"
_HEAD = 16  # bytes before the first object, and before the data of each


def has_endless_heap(path: Path) -> bool:
    """Whether a global heap of the file would never be read to its end."""
    with path.open("rb") as file:
        if not path.stat().st_size:
            return False
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
            return any(_is_endless(content, start) for start in _heaps(content))


def _heaps(content: mmap.mmap) -> Iterator[int]:
    start = content.find(_SIGNATURE)
    while start >= 0:
        yield start
        start = content.find(_SIGNATURE, start + len(_SIGNATURE))


def _is_endless(content: mmap.mmap, start: int) -> bool:
    end = min(start + _number(content, start + 8, 8), len(content))
    place = start + _HEAD
    while place + _HEAD <= end:
        number, size = _number(content, place, 2), _number(content, place + 8, 8)
        if number == 0 and size == 0:
            return True
        # sizes are rounded up to multiples of 8; that of free space has its head in it
        place += size if number == 0 else _HEAD + (size + 7) // 8 * 8
    return False


def _number(content: mmap.mmap, place: int, size: int) -> int:
    return int.from_bytes(content[place : place + size], "little")
