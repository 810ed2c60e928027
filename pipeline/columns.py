"""Rows of words set in columns, for a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def align(rows: Sequence[Sequence[str]], *, right: Iterable[int] = ()) -> str:
    """Set rows in columns, those named in ``right`` flush right."""
    if not rows:
        return ""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join(
        "  ".join(
            cell.rjust(width) if place in right else cell.ljust(width)
            for place, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    )
