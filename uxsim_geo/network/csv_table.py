"""Tables of comma-separated values with a header: read with every fault in place, and written."""

from __future__ import annotations

import csv
import io
import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pandas as pd

from uxsim_geo.errors import Faults
from uxsim_geo.files import replace_when_complete
from uxsim_geo.network.text import read_text
from uxsim_geo.network.tntp_rows import number

#: in a column of numbers or ids these mean that there is no value
MISSING = ("", "nan")


@dataclass(frozen=True)
class CsvTable:
    """The cells of a file as text, by column; ``lines`` says where each row begins."""

    source: Path
    columns: dict[str, list[str]]
    lines: list[int]

    def __len__(self) -> int:
        return len(self.lines)

    def __contains__(self, name: str) -> bool:
        return name in self.columns

    def cells(self, name: str) -> list[str]:
        """One text a row; empty where the file has no such column."""
        return self.columns.get(name) or [""] * len(self.lines)

    def rows(self, kept: npt.NDArray[np.bool_]) -> CsvTable:
        """The rows where ``kept`` holds."""
        places = np.flatnonzero(kept).tolist()
        columns = {name: [cells[row] for row in places] for name, cells in self.columns.items()}
        return CsvTable(self.source, columns, [self.lines[row] for row in places])


def read_csv_table(
    path: Path, faults: Faults, *, rename: Callable[[list[str]], list[str]] | None = None
) -> CsvTable | None:
    """Read a table in UTF-8, with or without a byte-order mark; None, and a fault, if it is none.

    ``rename`` makes the names that are used of those in the header. Blank rows are passed over,
    and so are columns without a name in which nothing stands. Rows of another width than the
    header and names that stand there twice are faults.
    """
    text = read_text(path, faults)
    if text is None:
        return None
    rows, lines = _rows(text, faults)
    if faults.found:
        return None
    if not rows:
        faults.add("is empty: is it the right file?")
        return None
    header = [cell.strip() for cell in rows[0]]
    names = rename(header) if rename else header
    rows, lines = rows[1:], lines[1:]
    _add_width_faults(faults, len(names), rows, lines)
    _add_name_faults(faults, header, names, rows)
    if faults.found:
        return None
    width = len(names)
    cut = [row if len(row) == width else row[:width] for row in rows]
    cells = zip(*cut, strict=True) if cut else ([] for _ in names)
    columns = {name: list(own) for name, own in zip(names, cells, strict=True) if name}
    return CsvTable(path, columns, lines)


def _rows(text: str, faults: Faults) -> tuple[list[list[str]], list[int]]:
    """The rows in which anything stands, and the line on which each begins."""
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    rows: list[list[str]] = []
    lines: list[int] = []
    begin = 1
    try:
        for row in reader:
            if any(cell and not cell.isspace() for cell in row):
                rows.append(row)
                lines.append(begin)
            begin = reader.line_num + 1
    except csv.Error as error:
        faults.add(f"is no table of comma-separated values: {error}", line=begin)
    return rows, lines


def _add_width_faults(faults: Faults, width: int, rows: list[list[str]], lines: list[int]) -> None:
    for row, line in zip(rows, lines, strict=True):
        if len(row) != width and not (len(row) > width and not any(map(str.strip, row[width:]))):
            what = f"the row has {len(row)} values under {width} names"
            faults.add(what, line=line, value=",".join(row))


def _add_name_faults(
    faults: Faults, header: list[str], names: list[str], rows: list[list[str]]
) -> None:
    """Names that stand there twice, and columns with values but no name."""
    if len(header) == 1 and (";" in header[0] or "\t" in header[0]):
        faults.add("separate the columns by commas", line=1, value=header[0])
    for name, times in Counter(names).items():
        if name and times > 1:
            faults.add("the column stands there more than once", line=1, column=name)
    for place, name in enumerate(names):
        if not name and any(row[place].strip() for row in rows if place < len(row)):
            what = f"column {place + 1} has values but no name: name it, or remove it"
            faults.add(what, line=1)


def has_columns(table: CsvTable, needed: Iterable[str], faults: Faults) -> bool:
    """Whether the table has these columns; a fault for each that it lacks."""
    missing = [name for name in needed if name not in table]
    for name in missing:
        present = ", ".join(table.columns) or "none"
        faults.add(f"lacks the column {name} (columns here: {present})", line=1)
    return not missing


def is_missing(cell: str) -> bool:
    """Whether a cell of numbers or ids says that there is no value."""
    return cell.strip().lower() in MISSING


def id_cells(table: CsvTable, name: str) -> list[str | None]:
    """Ids as text without the blanks around them; None where there is none."""
    return [None if is_missing(cell) else cell.strip() for cell in table.cells(name)]


def text_column(cells: Sequence[str]) -> pd.Series:
    """Text as it stands in the cells; null where nothing stands."""
    return pd.Series([None if not cell or cell.isspace() else cell for cell in cells], dtype="str")


def number_column(table: CsvTable, name: str, faults: Faults) -> npt.NDArray[np.float64]:
    """One number a row, NaN where there is none; anything else than a finite number is a fault."""
    cells = table.cells(name)
    if "_" not in "".join(cells):
        try:
            plain = np.array([float(cell) for cell in cells])
        except ValueError:
            plain = np.array([math.nan])
        if np.isfinite(plain).all():
            return plain
    values = np.full(len(cells), np.nan)
    for row, cell in enumerate(cells):
        if is_missing(cell):
            continue
        value = number(cell)
        if value is None or not math.isfinite(value):
            faults.add("must be a finite number", line=table.lines[row], column=name, value=cell)
        else:
            values[row] = value
    return values


def add_cell_faults(
    faults: Faults, table: CsvTable, wrong: npt.NDArray[np.bool_], name: str, what: str
) -> None:
    """Note every row where ``wrong`` holds, with its line, the column and what stands there."""
    cells = table.cells(name)
    for row in np.flatnonzero(wrong).tolist():
        faults.add(what, line=table.lines[row], column=name, value=cells[row] or None)


def write_csv_table(path: Path, columns: dict[str, Sequence[str]]) -> Path:
    """Write columns of cells in UTF-8; ``path`` appears when it is complete."""
    lines = [columns.keys(), *zip(*columns.values(), strict=True)]
    with replace_when_complete(path) as temporary:
        text = "".join(",".join(map(_quoted, line)) + "\n" for line in lines)
        temporary.write_bytes(text.encode("utf-8"))
    return path


def _quoted(cell: str) -> str:
    """A cell as it is written: in quotes where it would otherwise be taken for several."""
    special = '"' in cell or "," in cell or "\n" in cell or "\r" in cell
    return f'"{cell.replace(chr(34), chr(34) * 2)}"' if special else cell
