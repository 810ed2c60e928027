"""The outer form of TNTP files: ``<TAG> value`` lines, a header with names, rows of fields.

What varies from file to file and is met here: tags followed by any blanks, tabs or text; values
set apart by tabs (with blank padding) or by blanks; a semicolon after a tab, glued to the last
value or absent; leading tabs or none; comments (``~``) anywhere; a header with fewer names than
the rows have values, or no header. Columns are found by name, never by place.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd

from uxsim_geo.errors import Faults
from uxsim_geo.network.text import read_lines

TAG = re.compile(r"\s*<([^<>]*)>(.*)")
END_OF_METADATA = "END OF METADATA"
PLAIN_ID = re.compile(r"[1-9][0-9]{0,17}")
PADDED_ID = re.compile(r"0*([1-9][0-9]{0,17})")
NUMBER_START = re.compile(r"[-+.]?\d")


@dataclass(frozen=True)
class TntpRows:
    """A file taken apart, values still as text.

    tags
        upper-case name to (value, line)
    names
        of the columns, lower case, as many as each row has fields
    rows, lines
        fields of each row, and the line on which it stands
    whole
        False if a row was left out as damaged, or the last one is cut: there is a fault then
    """

    source: str
    tags: dict[str, tuple[str, int]] = field(default_factory=dict)
    names: list[str] = field(default_factory=list)
    rows: list[list[str]] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    whole: bool = True


def read_rows(
    path: Path, faults: Faults, *, metadata: bool = False, names: tuple[str, ...] = ()
) -> TntpRows | None:
    """Take a net, node or flow file apart; None, with a fault, where that cannot be done.

    ``metadata``: the file must have tags. ``names``: what the columns are if there is no header.
    In files without metadata every row is complete, so empty fields there only pad.
    """
    text = read_lines(path, faults)
    if text is None:
        return None
    tags, begin = read_tags(text)
    if metadata and not begin:
        faults.add(f"has no line <{END_OF_METADATA}>: it is not a TNTP file, or it is cut")
        return None
    found = TntpRows(str(path), tags)
    header = _collect(found, text, begin, keep_empty=metadata)
    if header[:1] == ["origin"]:
        faults.add("is a file of trips: a file of links or nodes was expected here")
        return None
    if not found.rows:
        faults.add("has no row of data after its header: is the file cut?")
        return None
    named = _name_columns(found, header or list(names), faults)
    if named is not None and _lacks_semicolon(named, text):
        what = "the last row lacks its semicolon: the file is cut"
        faults.add(what, line=named.lines[-1])
        return replace(named, whole=False)
    return named


def read_tags(text: list[str]) -> tuple[dict[str, tuple[str, int]], int]:
    """The tags (first of each name), and the index of the line after the metadata; 0: no end."""
    tags: dict[str, tuple[str, int]] = {}
    for index, line in enumerate(text):
        match = TAG.match(line)
        if match is None:
            continue
        name = " ".join(match[1].split()).upper()
        if name == END_OF_METADATA:
            return tags, index + 1
        tags.setdefault(name, (match[2].strip(), index + 1))
    return tags, 0


def tag_number(rows: TntpRows, name: str, faults: Faults) -> int | None:
    """A whole number from the metadata, None if it is absent or -1 (not known)."""
    value, line = rows.tags.get(name, ("", 0))
    if value in ("", "-1"):
        return None
    if not re.fullmatch(r"\d{1,18}", value):
        faults.add("must be a whole number", line=line, column=f"<{name}>", value=value)
        return None
    return int(value)


def _collect(found: TntpRows, text: list[str], begin: int, *, keep_empty: bool) -> list[str]:
    """Put the rows into ``found``; return the header's names, if it has one."""
    header: list[str] = []
    for index in range(begin, len(text)):
        line = text[index].strip()
        if not line:
            continue
        is_comment = line[0] == "~"
        if is_comment and found.rows:
            continue
        if is_comment or (not header and not found.rows and not NUMBER_START.match(line)):
            header = [_name(part) for part in _split(line.lstrip("~").strip())]
            continue
        fields = _split(line)
        if fields:
            found.rows.append(fields if keep_empty else [part for part in fields if part])
            found.lines.append(index + 1)
    return header


def _lacks_semicolon(found: TntpRows, text: list[str]) -> bool:
    """A last row without the semicolon that all the others have was cut inside a value."""
    closed = [text[line - 1].rstrip().endswith(";") for line in found.lines]
    return len(closed) > 1 and not closed[-1] and all(closed[:-1])


def _split(line: str) -> list[str]:
    line = line.rstrip(" \t;")
    return [part.strip() for part in line.split("\t")] if "\t" in line else line.split()


def _name(text: str) -> str:
    return "_".join(text.lower().split())


def _name_columns(found: TntpRows, header: list[str], faults: Faults) -> TntpRows | None:
    """Give each field of the rows a name; rows of another width than most are faults.

    Names left out at the end of a header (some files do) become ``column_10`` and so on. Where
    most rows are faults it is another kind of file: one fault, and None.
    """
    width = max(len(header), Counter(map(len, found.rows)).most_common(1)[0][0])
    names = header + [""] * (width - len(header))
    names = [name or f"column_{place}" for place, name in enumerate(names, start=1)]
    fits = [len(row) == width for row in found.rows]
    if 2 * sum(fits) < len(fits):
        faults.add(
            f"most rows do not have the {width} values that were expected "
            f"({', '.join(names)}): is it the right file?"
        )
        return None
    rows = [row for row, fit in zip(found.rows, fits, strict=True) if fit]
    lines = [line for line, fit in zip(found.lines, fits, strict=True) if fit]
    for row, line, fit in zip(found.rows, found.lines, fits, strict=True):
        if not fit:
            faults.add(
                f"the row has {len(row)} values where {width} were expected: "
                "it is damaged, or the file is cut",
                line=line,
                value="  ".join(row),
            )
    return TntpRows(found.source, found.tags, names, rows, lines, all(fits))


def id_column(rows: TntpRows, name: str, faults: Faults) -> pd.Series:
    """Node ids, text, as whole numbers above 0 are written (``007`` is ``7``)."""
    place = rows.names.index(name)
    texts = [row[place] for row in rows.rows]
    if all(map(PLAIN_ID.fullmatch, texts)):
        return pd.Series(texts, dtype="str")
    ids: list[str] = []
    for text, line in zip(texts, rows.lines, strict=True):
        whole = PADDED_ID.fullmatch(text)
        if whole is None:
            faults.add(
                "must be a node's number, whole and above 0", line=line, column=name, value=text
            )
        ids.append(whole[1] if whole else text)
    return pd.Series(ids, dtype="str")


def number_column(rows: TntpRows, name: str, faults: Faults) -> np.ndarray:
    """One float64 a row, NaN where the field is empty; other text is a fault."""
    place = rows.names.index(name)
    texts = [row[place] for row in rows.rows]
    plain = _plain_numbers(texts)
    if plain is not None:
        return plain
    values = [number(text) if text else math.nan for text in texts]
    for index, value in enumerate(values):
        if value is None:
            faults.add("must be a number", line=rows.lines[index], column=name, value=texts[index])
    return np.array(values, dtype=np.float64)


def _plain_numbers(texts: list[str]) -> np.ndarray | None:
    """All at once, as most columns can be read; None where some text is empty or no number."""
    if "_" in "".join(texts):
        return None
    try:
        return np.array(list(map(float, texts)))
    except ValueError:
        return None


def number(text: str) -> float | None:
    """The number that ``text`` is, None if it is none (``1_000`` is one to Python, not here)."""
    try:
        return None if "_" in text else float(text)
    except ValueError:
        return None


def text_column(rows: TntpRows, name: str) -> pd.Series:
    """One text a row, null where the field is empty."""
    place = rows.names.index(name)
    return pd.Series([row[place] or None for row in rows.rows], dtype="str")


def add_value_faults(
    faults: Faults, rows: TntpRows, wrong: np.ndarray, name: str, what: str
) -> None:
    """Note every row where ``wrong`` holds, with the line, column and text found there.

    Text that is no number is passed over: :func:`number_column` has told it.
    """
    place = rows.names.index(name)
    for index in np.flatnonzero(wrong):
        line, value = rows.lines[index], rows.rows[index][place]
        if not value or number(value) is not None:
            faults.add(what, line=line, column=name, value=value)
